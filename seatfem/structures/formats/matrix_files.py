"""One matrix from a Matrix Market, .npz or .npy file, its size known before memory is taken."""

from __future__ import annotations

import gzip
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np
from scipy import sparse
from scipy.io import mminfo, mmread

from impact.files.input_files import MB, check_file
from seatfem.machine.memory import available_memory

LIMIT: Final = 8192 * MB
MOST_PACKED: Final = 20  # bytes per byte of a compressed file: matrices of structures come to less than ten
FREE: Final = 64 * MB  # bytes that any compressed file may unfold to
LONGEST_LINE: Final = 1 << 16
ENTRY: Final = 64.0  # bytes while an entry is read, sorted and made symmetric
_ROWS, _SPARSEST = 1000, 10  # most rows without and per entry: matrices of structures have several entries a row
_OF_NUMBERS = b"0123456789+-.eE \t\r\n"
_FOREIGN = re.compile(rb"(?!(?<!\S)[-+]?(?i:nan|inf|infinity)(?!\S))(?<!\S)\S*[^-+.0-9eE\s]\S*")
_WORDS = {"real": 1, "integer": 1, "unsigned-integer": 1, "complex": 2, "pattern": 0}  # of an entry's value


def load_matrix(path: Path) -> Any:
    """Return what the file holds: an array or a sparse matrix whose indices are within its size.

    Raises `ValueError` for a file of another kind, values that are broken, and sizes that its bytes, or this machine,
    have no room for; whatever zipfile, gzip and scipy raise for a broken one.
    """
    check_file(path, LIMIT, ValueError)
    raw = _raw(path)
    if isinstance(raw, np.ndarray):
        return raw
    if max(raw.shape) > _ROWS + _SPARSEST * raw.nnz:
        raise ValueError(f"it is {raw.shape[0]} x {raw.shape[1]} large, must have more than {raw.nnz} entries")
    if raw.format in ("csr", "csc", "bsr"):
        raw.check_format(full_check=True)
    return raw


def _raw(path: Path) -> Any:
    if path.suffix == ".npz":
        with path.open("rb") as file:  # which load_npz leaves open where the file is broken
            _check_members(file, path.stat().st_size)
            file.seek(0)
            return sparse.load_npz(file)
    if path.suffix == ".npy":
        with path.open("rb") as file:
            _check_array(file, path.stat().st_size)
        return np.atleast_2d(np.load(path, allow_pickle=False))
    if not path.name.endswith((".mtx", ".mtx.gz")):
        raise ValueError("its name must end in .mtx, .mtx.gz, .npz or .npy")
    words = _words(path)
    rows, columns, entries, form, kind, symmetry = mminfo(path)
    if kind == "pattern":
        raise ValueError(f"a Matrix Market file of {kind}s has no values; export them")
    if form == "coordinate":
        wanted = (2 + _WORDS.get(kind, 1)) * entries + 3
        if entries > rows * columns:
            raise ValueError(f"it has {entries} entries, must have at most {rows} x {columns}")
    else:
        lower = {"general": 0, "skew-symmetric": -rows}.get(symmetry, rows)
        stored = rows * columns if symmetry == "general" else (rows * columns + lower) // 2
        wanted = _WORDS.get(kind, 1) * stored + 2
    if words != wanted:
        raise ValueError(f"it has {words} words; {entries} entries, as its first line says, take {wanted}")
    _refuse_beyond_memory(ENTRY * entries)
    return mmread(path)


def _check_members(file: BinaryIO, size: int) -> None:
    with zipfile.ZipFile(file) as members:
        every = members.infolist()
        total = sum(member.file_size for member in every)
        limit = max(FREE, MOST_PACKED * size)
        if len(every) > 16 or total > limit:
            raise ValueError(
                f"its {len(every)} arrays claim {total / MB:.4g} MB in a file of {size / MB:.3g} MB; at most "
                f"{limit / MB:.4g} MB are unfolded: save it uncompressed (compressed=False)"
            )
        for member in every:
            with members.open(member) as array:
                _check_array(array, member.file_size)  # type: ignore[arg-type]
    _refuse_beyond_memory(4.0 * total)


def _check_array(file: BinaryIO, size: int) -> None:
    """Check the shape in an array's head against the bytes there are."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(file)
    if dtype.hasobject:
        raise ValueError("it must hold numbers, not Python objects")
    claimed = dtype.itemsize
    for length in shape:
        claimed *= int(length)
    if claimed > size:
        raise ValueError(f"its head claims {claimed / MB:.4g} MB, must claim at most its {size / MB:.3g} MB")
    _refuse_beyond_memory(4.0 * claimed)


def _refuse_beyond_memory(need: float) -> None:
    if need > (free := available_memory()):
        raise ValueError(
            f"reading it takes {need / 1e9:.3g} GB of memory, must take at most the {free / 1e9:.3g} GB that are free"
        )


def _words(path: Path) -> int:
    """Return words of the file without its comments. scipy's reader takes a number up to where it is broken, and can
    crash where that is the end of the file: raises `ValueError` for words that are no numbers.
    """
    words = 0
    for lines in _blocks(path):
        text = b"\n".join(line for line in lines.split(b"\n") if not line.startswith(b"%"))
        if text.translate(None, _OF_NUMBERS) and (foreign := _FOREIGN.search(text)):
            raise ValueError(f"{foreign[0][:40]!r} must be a number (exponents are 1e-3)")
        words += len(text.split())
    return words


def _blocks(path: Path) -> Iterator[bytes]:
    """Yield whole lines, about a megabyte at once."""
    packed = path.suffix == ".gz"
    limit = max(FREE, MOST_PACKED * path.stat().st_size) if packed else LIMIT
    count, begun = 0, b""
    with (gzip.open if packed else open)(path, "rb") as file:
        while block := file.read(MB):
            count += len(block)
            if count > limit:
                raise ValueError(
                    f"it unfolds to more than {limit / MB:.4g} MB, {MOST_PACKED} times its size: unpack it"
                )
            whole, _, begun = (begun + block).rpartition(b"\n")
            if len(begun) > LONGEST_LINE:
                raise ValueError(f"its lines must have at most {LONGEST_LINE} characters")
            yield whole
    yield begun
