"""Changes inside an HDF5 file that leave the file itself sound, sealed again or without a seal."""

from collections.abc import Callable, Mapping
from pathlib import Path
from random import Random
from types import MappingProxyType
from typing import Any, Final

import h5py
import numpy as np

from impact.files.hdf5_structure import USER_BLOCK, seal_of

_VALUES: Final[tuple[Any, ...]] = (
    np.nan, np.inf, -np.inf, 0.0, -1.0, 1e308, 1e-308, -1e30, 1e30, 1e-30, 2**62, -5, "", "nan", "modal", "sampled",
    "poles", "delay_rod", "power_law", "half_space_patch", "zero", "hold", "rigid", "{", "[]", "{}", '["a", "a"]',
    '{"kind": "delay_rod", "impedance": 1e999}', '{"kind": "modal", "seat_key": [1]}', "[" * 5000, "null", "7", "[1]",
    np.zeros(0), np.zeros((3, 3)), np.arange(5000), b"\xff\xfe", True, np.complex128(1 + 1j),
)  # fmt: skip


def seal(path: Path) -> None:
    """Write the checksum of a closed file with a user block into that block."""
    with path.open("r+b") as file:
        file.seek(USER_BLOCK)
        block = seal_of(file.read())
        file.seek(0)
        file.write(block)


def attribute_replaced(file: Any, random: Random) -> None:
    """An attribute holds something else."""
    holder = random.choice(_holders(file))
    holder.attrs[random.choice(list(holder.attrs))] = random.choice(_VALUES)


def attribute_lost(file: Any, random: Random) -> None:
    """An attribute is missing."""
    holder = random.choice(_holders(file))
    del holder.attrs[random.choice(list(holder.attrs))]


def values_changed(file: Any, random: Random) -> None:
    """One number of a dataset, or all, extreme."""
    name = random.choice(_datasets(file))
    values = np.array(file[name][...], dtype=float)
    new = random.choice((np.nan, np.inf, -np.inf, 0.0, -1.0, 1e308, -1e308, 1e-308, 1e150, 1e30, 1e9, 1e-9))
    if values.size and random.random() < 0.6:
        values.flat[random.randrange(values.size)] = new
    else:
        values[...] = new
    _replace(file, name, values)


def values_scaled(file: Any, random: Random) -> None:
    """A dataset times a power of ten, or its sign turned."""
    name = random.choice(_datasets(file))
    _replace(
        file, name, np.array(file[name][...], dtype=float) * random.choice((-1.0, 10.0 ** random.randint(-15, 15)))
    )


def reshaped(file: Any, random: Random) -> None:
    """Longer, shorter, empty, of more or fewer dimensions."""
    name = random.choice(_datasets(file))
    values = np.array(file[name][...])
    flat = values.ravel()
    changes: tuple[Callable[[], Any], ...] = (
        lambda: flat[:-1],
        lambda: np.append(flat, 1.0),
        lambda: flat[:0],
        lambda: values[..., None],
        lambda: np.broadcast_to(values, (2, *values.shape)),
        lambda: values.T.copy(),
        lambda: flat,
        lambda: flat[:1].reshape(()) if flat.size else flat,
        lambda: values[:0],
    )
    _replace(file, name, random.choice(changes)())


def retyped(file: Any, random: Random) -> None:
    """Numbers of another type, text, or no array at all."""
    name = random.choice(_datasets(file))
    values = np.array(file[name][...], dtype=float)
    kinds: tuple[Callable[[], Any], ...] = (
        lambda: np.nan_to_num(values).astype(np.int8),
        lambda: values.astype(complex),
        lambda: values.astype("S8"),
        lambda: values.astype(np.float16),
        lambda: values.astype(bool),
        lambda: values.astype([("a", "f8")]),
        lambda: "text",
        lambda: h5py.Empty("f8"),
    )
    with np.errstate(all="ignore"):
        new = random.choice(kinds)()
    _replace(file, name, new)


def object_lost(file: Any, random: Random) -> None:
    """A dataset or a group is missing."""
    del file[random.choice(_objects(file))]


def object_replaced(file: Any, random: Random) -> None:
    """A group where a dataset was, a link that leads nowhere, into another file, or round in a circle."""
    name = random.choice(_objects(file))
    del file[name]
    new = random.choice((None, h5py.SoftLink("/nowhere"), h5py.ExternalLink("other.h5", "/"), h5py.SoftLink("/")))
    if new is None:
        file.create_group(name)
    else:
        file[name] = new


def enormous(file: Any, random: Random) -> None:
    """A dataset that takes no room in the file and terabytes in memory."""
    name = random.choice(_datasets(file))
    rank = file[name].ndim or 1
    shape = tuple(int(1e13 ** (1 / rank)) for _ in range(rank)) if random.random() < 0.5 else (10_000_000,) * 1
    del file[name]
    file.create_dataset(name, shape=shape, dtype="f8", chunks=tuple(min(n, 1000) for n in shape), compression="gzip")


def swapped(file: Any, random: Random) -> None:
    """Two datasets have changed places."""
    one, other = random.choice(_datasets(file)), random.choice(_datasets(file))
    a, b = np.array(file[one][...]), np.array(file[other][...])
    _replace(file, one, b)
    _replace(file, other, a)


HDF5: Final[Mapping[str, Callable[[Any, Random], None]]] = MappingProxyType(
    {
        each.__name__: each
        for each in (
            attribute_replaced,
            attribute_lost,
            values_changed,
            values_scaled,
            reshaped,
            retyped,
            object_lost,
            object_replaced,
            enormous,
            swapped,
        )
    }
)


def mutate(path: Path, name: str, random: Random) -> None:
    """Change the file in place; nine of ten are sealed again, the others say nothing of a seal."""
    with h5py.File(path, "r+") as file:
        change = HDF5[name] if _datasets(file) else attribute_replaced
        change(file, random)
    seal(path)
    if random.random() < 0.1:
        data = path.read_bytes()
        path.write_bytes(b"\0" * USER_BLOCK + data[USER_BLOCK:])


def _objects(file: Any) -> list[str]:
    names: list[str] = []
    file.visit(names.append)
    return sorted(names)


def _datasets(file: Any) -> list[str]:
    return [name for name in _objects(file) if isinstance(file[name], h5py.Dataset)]


def _holders(file: Any) -> list[Any]:
    return [each for each in (file, *(file[name] for name in _objects(file))) if len(each.attrs)]


def _replace(file: Any, name: str, values: Any) -> None:
    del file[name]
    file[name] = values
