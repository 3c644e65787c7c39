"""What an HDF5 file may be made of: datasets in the file itself, of sizes that the file can hold.

HDF5 lets a file name others, whose bytes then stand for numbers (external storage, external links, virtual datasets),
point at itself (soft links), and claim a thousand times its size (compression). Checked before a number is read.

A checksum stands in front: the library that reads HDF5 can crash on damaged bytes, so they are found first. This seal
is in HDF5's user block, 512 bytes that the format leaves to the application: other programs read the file as before.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
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


USER_BLOCK = 512
_MAGIC = b"impact file, sha256 of all after byte 512: "
_PROBE = "import sys, h5py\nwith h5py.File(sys.argv[1]) as f: f.visititems(lambda _, x: dict(x.attrs) and None)"


def seal_of(image: bytes) -> bytes:
    """The user block to stand in front of the bytes of an HDF5 file."""
    return (_MAGIC + hashlib.sha256(image).hexdigest().encode() + b"\n").ljust(USER_BLOCK, b"\0")


def seal_holds(path: Path) -> bool | None:
    """Whether the file is as it was sealed; ``None`` for a file without a seal."""
    with path.open("rb") as file:
        head = file.read(USER_BLOCK)
        if not head.startswith(_MAGIC):
            return None
        digest = hashlib.file_digest(file, "sha256").hexdigest().encode()
    return head[len(_MAGIC) :].split(b"\n")[0] == digest


def can_be_opened(path: Path) -> bool:
    """Whether HDF5 reads the file's structure without crashing, tried in a process of its own."""
    try:
        probe = subprocess.run(
            [sys.executable, "-P", "-c", _PROBE, str(path)], capture_output=True, timeout=60, check=False
        )
    except subprocess.TimeoutExpired:
        return False
    return probe.returncode >= 0
