"""Structure check of HDF5 files, and a seal: only datasets in the file itself, of sizes that the file can contain.

HDF5 lets a file refer to others whose bytes are read as numbers (external storage, external links, virtual datasets),
refer to itself (soft links), and claim a thousand times its size (compression). This is checked before reading.

A checksum precedes the data, because the HDF5 library can crash on damaged bytes. This seal is in HDF5's user block,
512 bytes that the format leaves to the application: other programs still read the file.
"""

import hashlib
import math
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np

MB: Final = 1 << 20
MOST_OBJECTS: Final = 20_000
MOST_ATTRIBUTES: Final = 200_000
DEEPEST: Final = 32
OWN_FILTERS: Final = (*range(1, 7), 32000)  # numbers of HDF5's own filters, and of LZF, which h5py contains
FREE: Final = 64 * MB  # total size that datasets of any file may claim, however small the file is [bytes]


def check_structure(path: Path, error: type[Exception], most_packed: float = 100.0) -> None:
    """Raise ``error``, naming file, key, value and limit, for an HDF5 file that is not plain.

    Refused are: soft, external or user-defined links, external storage, virtual datasets, filters that load a plug-in,
    groups with two names, more than `MOST_OBJECTS` objects, `MOST_ATTRIBUTES` attributes or `DEEPEST` levels, and
    datasets, chunks and attributes that together claim more than ``most_packed`` times the file's size and more than
    `FREE` bytes. Entries of variable length may share one place in the file: each counts as the whole file.
    """
    size = path.stat().st_size
    limit = max(FREE, int(most_packed * size))
    claimed = attributes = 0
    with h5py.File(path, "r") as file:
        for key, member in _objects(file, path, error):
            attributes += len(member.attrs)
            if attributes > MOST_ATTRIBUTES:
                raise error(f"{path}: has more than {MOST_ATTRIBUTES} attributes: refused")
            for name in member.attrs:
                claimed += _bytes_of_attribute(member, name, size, limit - claimed)
                if claimed > limit:
                    raise error(
                        f"{path}: attribute {name!r} of {key or 'the file'}, with what is before it, may take more "
                        f"than {limit / MB:.4g} MB from a file of {size / MB:.3g} MB: refused; write one short text"
                    )
            if not isinstance(member, h5py.Dataset):
                continue
            dataset = member
            if problem := _not_plain(dataset):
                raise error(f"{path}: {key} {problem}: refused; write it as a plain dataset")
            entry = size if dataset.dtype.hasobject else int(dataset.dtype.itemsize)
            claimed += entry * max(math.prod(dataset.shape or ()), math.prod(dataset.chunks or (0,)))
            if claimed > limit:
                raise error(
                    f"{path}: {key} of {dataset.shape} {dataset.dtype}, in chunks of {dataset.chunks}, with those "
                    f"before it claims {claimed / MB:.4g} MB in a file of {size / MB:.3g} MB; at most {limit / MB:.4g} "
                    "MB are read. Compute or export it again"
                )


def _objects(file: Any, path: Path, error: type[Exception]) -> Iterator[tuple[str, Any]]:
    """Yield the file, then name and object of every hard link. Groups with two names are refused, not read twice."""
    addresses = {_address(file)}
    waiting = [("", file, 0)]
    objects = 0
    yield "", file
    while waiting:
        prefix, group, depth = waiting.pop()
        if depth > DEEPEST:
            raise error(f"{path}: {prefix} is nested more than {DEEPEST} deep: refused; write it flatter")
        for name in group:
            key = f"{prefix}/{name}".lstrip("/")
            objects += 1
            if objects > MOST_OBJECTS:
                raise error(f"{path}: has more than {MOST_OBJECTS} objects: refused; write fewer")
            link = group.get(name, getlink=True)
            if not isinstance(link, h5py.HardLink):
                raise error(
                    f"{path}: {key} is a {type(link).__name__} to {getattr(link, 'filename', '')}"
                    f"{getattr(link, 'path', '')!r}: links are not followed; write the data itself"
                )
            member = group[name]
            if isinstance(member, h5py.Group):
                address = _address(member)
                if address in addresses:
                    raise error(f"{path}: {key} is a group with another name, too: refused; write each group once")
                addresses.add(address)
                waiting.append((key, member, depth + 1))
            if isinstance(member, h5py.Dataset | h5py.Group):
                yield key, member


def _address(group: Any) -> tuple[int, int]:
    """Return the address of the group in the file."""
    place = h5py.h5o.get_info(group.id)
    return place.fileno, place.addr


def _bytes_of_attribute(member: Any, name: str, size: int, most: int) -> int:
    """Return the size of an attribute's value after reading it [bytes]; only its claim if that exceeds ``most``."""
    attribute = member.attrs.get_id(name)
    count = math.prod(attribute.shape or ())
    claim = count * (size if attribute.dtype.hasobject else int(attribute.dtype.itemsize))
    if claim > most:
        return claim
    value: object = None
    with suppress(TypeError, ValueError, OSError):  # of a type that is unknown here and that no caller needs
        value = member.attrs[name]
    return _taken(value)


def _taken(value: Any) -> int:
    """Return the memory of a text, a number or an array, including entries of variable length [bytes]."""
    if isinstance(value, np.ndarray) and value.dtype == object:
        return value.nbytes + sum(map(_taken, value.flat))
    return int(value.nbytes) if hasattr(value, "nbytes") else len(value) if isinstance(value, str | bytes) else 8


def _not_plain(dataset: Any) -> str:
    """Return the property that makes a dataset not plain; "" if it is plain."""
    if dataset.external:
        return f"has its bytes in another file, {dataset.external[0][0]!r}"
    if dataset.is_virtual:
        return "is put together from other datasets (virtual)"
    properties = dataset.id.get_create_plist()
    codes = [properties.get_filter(k)[0] for k in range(properties.get_nfilters())]
    if foreign := [str(code) for code in codes if code not in OWN_FILTERS]:
        return f"is packed by a plug-in (filter {', '.join(foreign)})"
    return ""


USER_BLOCK = 512
_MAGIC = b"impact file, sha256 of all after byte 512: "
_PROBE_MEMORY: Final = 1024 * MB  # address space of the process that probes a file, besides the file's size [bytes]
_PROBE_SECONDS: Final = 20  # processor time of that process [s]


def seal_of(image: bytes) -> bytes:
    """Return the user block that precedes the bytes of an HDF5 file."""
    return (_MAGIC + hashlib.sha256(image).hexdigest().encode() + b"\n").ljust(USER_BLOCK, b"\0")


def seal_holds(path: Path) -> bool | None:
    """Return whether the file matches its seal; ``None`` for a file without a seal."""
    with path.open("rb") as file:
        head = file.read(USER_BLOCK)
        if not head.startswith(_MAGIC):
            return None
        digest = hashlib.file_digest(file, "sha256").hexdigest().encode()
    return head[len(_MAGIC) :].split(b"\n")[0] == digest


def can_be_opened(path: Path) -> bool:
    """Return whether HDF5 reads the file's structure without crashing, tested in a separate process."""
    try:
        probe = subprocess.run(
            [sys.executable, "-P", __file__, str(path)], capture_output=True, timeout=60, check=False
        )
    except subprocess.TimeoutExpired:
        return False
    return probe.returncode >= 0


def _probe(path: Path) -> None:
    """Walk through a file within limits of memory and time; its errors are reported by the reader."""
    with suppress(ImportError, OSError, ValueError):  # absent on Windows
        import resource

        mapped = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        most = mapped + _PROBE_MEMORY + path.stat().st_size
        resource.setrlimit(resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))
        resource.setrlimit(resource.RLIMIT_CPU, (_PROBE_SECONDS, resource.RLIM_INFINITY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.RLIM_INFINITY))
    check_structure(path, ValueError)


if __name__ == "__main__":
    _probe(Path(sys.argv[1]))
