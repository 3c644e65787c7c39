"""What an HDF5 file may be made of: datasets in the file itself, of sizes that the file can hold.

HDF5 lets a file name others, whose bytes then stand for numbers (external storage, external links, virtual datasets),
point at itself (soft links), and claim a thousand times its size (compression). Checked before a number is read.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import h5py

MB: Final = 1 << 20
MOST_OBJECTS: Final = 20_000
DEEPEST: Final = 32
OWN_FILTERS: Final = (*range(1, 7), 32000)  # HDF5's own, and 32000: LZF, which h5py brings along
FREE: Final = 64 * MB  # bytes that any file may claim


def check_structure(path: Path, error: type[Exception], most_packed: float = 100.0) -> None:
    """Raise ``error``, naming file, key, value and limit, for an HDF5 file that is not plain.

    Refused: links that are soft, external or of a user's class, external storage, virtual datasets, filters that load
    a plug-in, more than `MOST_OBJECTS` objects or `DEEPEST` levels, datasets and chunks that claim together more than
    ``most_packed`` times the file's size and more than `FREE` bytes.
    """
    size = path.stat().st_size
    limit = max(FREE, int(most_packed * size))
    claimed = 0
    with h5py.File(path, "r") as file:
        for key, dataset in _datasets(file, path, error):
            if problem := _not_plain(dataset):
                raise error(f"{path}: {key} {problem}: refused; write it as a plain dataset")
            claimed += max(_bytes(dataset, dataset.shape or (1,)), _bytes(dataset, dataset.chunks or (0,)))
            if claimed > limit:
                raise error(
                    f"{path}: {key} of {dataset.shape} {dataset.dtype}, in chunks of {dataset.chunks}, with those "
                    f"before it claims {claimed / MB:.4g} MB in a file of {size / MB:.3g} MB; at most {limit / MB:.4g} "
                    "MB are read. Compute or export it again"
                )


def _datasets(file: Any, path: Path, error: type[Exception]) -> Iterator[tuple[str, Any]]:
    """Name and dataset of every hard link; each group once, however many names it has."""
    seen: set[Any] = set()
    waiting = [("", file, 0)]
    objects = 0
    while waiting:
        prefix, group, depth = waiting.pop()
        if depth > DEEPEST:
            raise error(f"{path}: {prefix} is nested more than {DEEPEST} deep: refused")
        for name in group:
            key = f"{prefix}/{name}".lstrip("/")
            objects += 1
            if objects > MOST_OBJECTS:
                raise error(f"{path}: has more than {MOST_OBJECTS} objects: refused")
            link = group.get(name, getlink=True)
            if not isinstance(link, h5py.HardLink):
                raise error(
                    f"{path}: {key} is a {type(link).__name__} to {getattr(link, 'filename', '')}"
                    f"{getattr(link, 'path', '')!r}: links are not followed; write the data itself"
                )
            found = group[name]
            if isinstance(found, h5py.Dataset):
                yield key, found
            elif isinstance(found, h5py.Group):
                address = h5py.h5o.get_info(found.id)
                mark = (address.fileno, address.addr)
                if mark not in seen:
                    seen.add(mark)
                    waiting.append((key, found, depth + 1))


def _not_plain(dataset: Any) -> str:
    """What a dataset has that may not be; "" for none."""
    if dataset.external:
        return f"has its bytes in another file, {dataset.external[0][0]!r}"
    if dataset.is_virtual:
        return "is put together from other datasets (virtual)"
    made = dataset.id.get_create_plist()
    codes = [made.get_filter(k)[0] for k in range(made.get_nfilters())]
    if foreign := [str(code) for code in codes if code not in OWN_FILTERS]:
        return f"is packed by a plug-in (filter {', '.join(foreign)})"
    return ""


def _bytes(dataset: Any, shape: tuple[int, ...]) -> int:
    count = int(dataset.dtype.itemsize)
    for length in shape:
        count *= int(length)
    return count
