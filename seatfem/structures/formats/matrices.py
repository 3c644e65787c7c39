"""M, K and C from files of other programs: Matrix Market, scipy .npz, numpy .npy; sizes are checked before reading."""

from __future__ import annotations

import gzip
import os
import re
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, Final, Literal, get_args

import numpy as np
from scipy import sparse
from scipy.io import mminfo, mmread

from impact.files.csv_table import read_csv
from impact.files.safe_files import MB, check_file
from seatfem.machine.resources import available_memory
from seatfem.structures.model import Array, ModelError, Port, SecondOrderModel

LIMIT: Final = 8192 * MB
MOST_PACKED: Final = 20  # largest compression ratio: matrices of structures have less than ten
FREE: Final = 64 * MB  # size to which any compressed file may expand [bytes]
LONGEST_LINE: Final = 1 << 16
ENTRY: Final = 64.0  # memory per entry while it is read, sorted and made symmetric [bytes]
_ROWS, _SPARSEST = 1000, 10  # limit of rows: 1000 + 10 per entry; structures have several entries per row
_OF_NUMBERS = b"0123456789+-.eE \t\r\n"
_FOREIGN = re.compile(rb"(?!(?<!\S)[-+]?(?i:nan|inf|infinity)(?!\S))(?<!\S)\S*[^-+.0-9eE\s]\S*")
_WORDS = {"real": 1, "integer": 1, "unsigned-integer": 1, "complex": 2, "pattern": 0}  # words per value of an entry


def load_matrix(path: Path) -> Any:
    """Return the matrix in the file: an array, or a sparse matrix whose indices are within its size.

    Raises `ValueError` for an unknown format, corrupt values, and sizes beyond the file's bytes or the available
    memory; and all errors of zipfile, gzip and scipy for a corrupt file.
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
        with path.open("rb") as file:  # load_npz would not close a corrupt file
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
        expected = (2 + _WORDS.get(kind, 1)) * entries + 3
        if entries > rows * columns:
            raise ValueError(f"it has {entries} entries, must have at most {rows} x {columns}")
    else:
        lower = {"general": 0, "skew-symmetric": -rows}.get(symmetry, rows)
        stored = rows * columns if symmetry == "general" else (rows * columns + lower) // 2
        expected = _WORDS.get(kind, 1) * stored + 2
    if words != expected:
        raise ValueError(f"it has {words} words; {entries} entries, as its first line says, take {expected}")
    _refuse_beyond_memory(ENTRY * entries)
    return mmread(path)


def _check_members(file: BinaryIO, size: int) -> None:
    with zipfile.ZipFile(file) as members:
        listed = members.infolist()
        total = sum(member.file_size for member in listed)
        limit = max(FREE, MOST_PACKED * size)
        if len(listed) > 16 or total > limit:
            raise ValueError(
                f"its {len(listed)} arrays claim {total / MB:.4g} MB in a file of {size / MB:.3g} MB; at most "
                f"{limit / MB:.4g} MB are unfolded: save it uncompressed (compressed=False)"
            )
        for member in listed:
            with members.open(member) as array:
                _check_array(array, member.file_size)  # type: ignore[arg-type]
    _refuse_beyond_memory(4.0 * total)


def _check_array(file: BinaryIO, size: int) -> None:
    """Check the shape in the header of an array against the size of the file."""
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
    """Return the number of words in the file without comments. Raises `ValueError` for words that are not numbers:
    scipy's reader accepts a number up to its first invalid character, and can crash if that is the end of the file."""
    words = 0
    for lines in _blocks(path):
        text = b"\n".join(line for line in lines.split(b"\n") if not line.startswith(b"%"))
        if text.translate(None, _OF_NUMBERS) and (foreign := _FOREIGN.search(text)):
            raise ValueError(f"{foreign[0][:40]!r} must be a number (exponents are 1e-3)")
        words += len(text.split())
    return words


def _blocks(path: Path) -> Iterator[bytes]:
    """Yield complete lines in blocks of about a megabyte."""
    packed = path.suffix == ".gz"
    limit = max(FREE, MOST_PACKED * path.stat().st_size) if packed else LIMIT
    count, partial = 0, b""
    with (gzip.open if packed else open)(path, "rb") as file:
        while block := file.read(MB):
            count += len(block)
            if count > limit:
                raise ValueError(
                    f"it unfolds to more than {limit / MB:.4g} MB, {MOST_PACKED} times its size: unpack it"
                )
            whole, _, partial = (partial + block).rpartition(b"\n")
            if len(partial) > LONGEST_LINE:
                raise ValueError(f"its lines must have at most {LONGEST_LINE} characters")
            yield whole
    yield partial


System = Literal["SI", "mm-t-s", "mm-kg-ms", "inch-lbf-s"]
Constrained = Literal["refuse", "drop"]
PortLike = str | os.PathLike[str] | Mapping[int, float] | Array
_LBF_PER_INCH = 4.4482216152605 / 0.0254
FACTORS: dict[str, tuple[float, float, float]] = {
    "SI": (1.0, 1.0, 1.0),
    "mm-t-s": (1e3, 1e3, 1e3),
    "mm-kg-ms": (1.0, 1e3, 1e6),
    "inch-lbf-s": (_LBF_PER_INCH,) * 3,
}
"""Factors of mass, damping and stiffness to kg, N s/m, N/m (from t, N s/mm, N/mm; lbf s^2/inch, ...)."""
PENALTY = 1e10  # least stiffness of a constraint over the median of the diagonal: beyond all springs of structures
_DOF = re.compile(r"[0-9]{1,15}")
_SKEW = 1e-6  # relative asymmetry within the rounding of a text file


def read_matrices(
    mass: str | os.PathLike[str],
    stiffness: str | os.PathLike[str],
    damping: str | os.PathLike[str] | None = None,
    *,
    ports: Mapping[str, PortLike],
    system: System = "SI",
    first_dof: Literal[0, 1] = 0,
    constrained: Constrained = "refuse",
) -> SecondOrderModel:
    """Return the model M u'' + C u' + K u = sum_p b_p F_p from files, in SI units.

    Files: Matrix Market (.mtx, .mtx.gz: coordinate or array, symmetric or general), `scipy.sparse.save_npz` (.npz),
    `numpy.save` (.npy). An n x 1 matrix is a diagonal.

    Args:
        mass, stiffness, damping: files of M, K and C.
        ports: by name: {dof: weight}, or the vector b (n,) itself, or a CSV file with the header ``dof,weight``. The
            weights of a patch sum to 1: b'u is its mean displacement along the outward normal.
        system: units of the files, one of `FACTORS`.
        first_dof: number of the first unknown in ``ports``: 0 as in Python, 1 as in Matrix Market.
        constrained: unknowns fixed by a penalty (a stiffness diagonal beyond `PENALTY` times the median) or absent from
            K and M: "refuse" raises an error that lists them, "drop" removes them from the model.

    Raises:
        ModelError: a file that cannot be read, is not real, square, finite, symmetric, or of another size; constrained
            or massless unknowns, Lagrange multipliers; a port off the model or on a constrained unknown.
    """
    if system not in get_args(System):
        raise ModelError(f"system {system!r} is unknown; choose from {', '.join(get_args(System))}")
    names = {"M": Path(mass), "C": None if damping is None else Path(damping), "K": Path(stiffness)}
    matrices = {
        key: factor * _read(path)
        for (key, path), factor in zip(names.items(), FACTORS[system], strict=True)
        if path is not None
    }
    n = matrices["K"].shape[0]
    for key, matrix in matrices.items():
        if matrix.shape[0] != n:
            raise ModelError(
                f"{names[key]}: {key} has {matrix.shape[0]} unknowns, must have the {n} of K in {names['K']}"
            )
    vectors = {name: _vector(name, port, n, first_dof) for name, port in ports.items()}
    fixed = _held(matrices["K"], matrices["M"])
    if np.any(fixed):
        if constrained != "drop":
            raise ModelError(
                f"{names['K']}: {fixed.sum()} unknowns are constrained (a penalty beyond {PENALTY:g} times the median "
                f"diagonal, or no stiffness and mass at all): dof {_some(np.flatnonzero(fixed) + first_dof)}; "
                'take them out, or give constrained="drop"'
            )
        for name, vector in vectors.items():
            if np.any(vector[fixed]):
                numbers = np.flatnonzero(fixed & (vector != 0)) + first_dof
                raise ModelError(f"port {name!r} must not act on the constrained dof {_some(numbers)}")
        matrices = {key: matrix[~fixed][:, ~fixed] for key, matrix in matrices.items()}
        vectors = {name: vector[~fixed] for name, vector in vectors.items()}
    _refuse_indefinite(matrices, names, fixed, first_dof)
    try:
        return SecondOrderModel(
            matrices["M"], matrices.get("C"), matrices["K"], {name: Port(vector) for name, vector in vectors.items()}
        )
    except ModelError as problem:
        files = (name for name in (*names.values(), *ports.values()) if isinstance(name, str | os.PathLike))
        raise ModelError(f"{', '.join(map(str, files))}: {problem}") from problem


def _read(path: Path) -> sparse.csr_array:
    """Return a real, square, finite, symmetric matrix from a file."""
    if not path.exists():
        raise ModelError(f"{path}: no such file; check the path")
    try:
        raw = load_matrix(path)
    except Exception as problem:  # a corrupt file makes zlib, zipfile and tokenize raise any error
        raise ModelError(
            f"{path}: cannot be read as a matrix ({type(problem).__name__}: {problem}); check it, or export it again"
        ) from problem
    if np.issubdtype(raw.dtype, np.complexfloating):
        raise ModelError(f"{path}: is complex; give the real part here, and loss as damping")
    if raw.dtype.kind not in "fiub":
        raise ModelError(f"{path}: holds {raw.dtype}, must hold numbers")
    matrix = sparse.csr_array(raw, dtype=np.float64)
    if matrix.shape[1] == 1:
        matrix = sparse.csr_array(sparse.diags_array(matrix.toarray()[:, 0]))
    matrix.sum_duplicates()
    if matrix.shape[0] != matrix.shape[1]:
        raise ModelError(f"{path}: is {matrix.shape[0]} x {matrix.shape[1]}: it must be square")
    if bad := int(np.sum(~np.isfinite(matrix.data))):
        raise ModelError(f"{path}: all values must be finite, {bad} are not")
    return _symmetric(matrix, path)


def _symmetric(matrix: sparse.csr_array, path: Path) -> sparse.csr_array:
    scale = abs(matrix).max() if matrix.nnz else 0.0
    skew = float(abs(matrix - matrix.T).max() / scale) if scale else 0.0
    if skew > _SKEW:
        half = not sparse.triu(matrix, 1).nnz or not sparse.tril(matrix, -1).nnz
        remedy = (
            "it holds one triangle only: mark it 'symmetric' in its Matrix Market header, or save A + A' - diag(A)"
            if half
            else "leave out what breaks reciprocity (follower forces, friction, gyroscopic terms?)"
        )
        raise ModelError(f"{path}: is not symmetric, |A - A'|/|A| = {skew:.1e}; {remedy}")
    return sparse.csr_array((matrix + matrix.T) / 2) if skew else matrix


def _held(stiffness: sparse.csr_array, mass: sparse.csr_array) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return a mask of unknowns with a penalty stiffness, or in no equation."""
    diagonal = stiffness.diagonal()
    positive = diagonal[diagonal > 0]
    limit = PENALTY * float(np.median(positive)) if positive.size else np.inf
    empty = (abs(stiffness).sum(axis=0) == 0) & (abs(mass).sum(axis=0) == 0)
    return np.asarray((diagonal > limit) | empty)


def _refuse_indefinite(
    matrices: Mapping[str, sparse.csr_array], names: Mapping[str, Path | None], fixed: Any, first: int
) -> None:
    """Raise `ModelError` for a matrix with |a_ij|^2 > a_ii a_jj, which cannot be positive semidefinite."""
    numbers = np.flatnonzero(~fixed) + first
    for key, matrix in matrices.items():
        diagonal = matrix.diagonal()
        if key == "M" and np.any(none := diagonal <= 0):
            raise ModelError(
                f"{names[key]}: M has no mass at {none.sum()} unknowns (dof {_some(numbers[none])}): condense them "
                "statically, or export a consistent mass matrix"
            )
        entry = sparse.coo_array(matrix)
        root = np.sqrt(np.abs(diagonal))
        bad = (diagonal[entry.row] < 0) | (np.abs(entry.data) > (1 + 1e-9) * root[entry.row] * root[entry.col])
        if np.any(bad):
            i, j = (int(numbers[index[bad][0]]) for index in (entry.row, entry.col))
            raise ModelError(
                f"{names[key]}: {key} is indefinite: |{key}_ij| exceeds sqrt({key}_ii {key}_jj) at {bad.sum()} places, "
                f"the first dof {i}, {j}; Lagrange multipliers or a wrong sign? export with constraints eliminated"
            )


def _vector(name: str, port: PortLike, n: int, first: int) -> Array:
    if isinstance(port, str | os.PathLike):
        name, port = f"{name} of {port}", _weights(Path(port))
    if not isinstance(port, Mapping):
        vector = np.asarray(port, dtype=float)
        if vector.shape != (n,):
            raise ModelError(f"port {name!r} is {vector.shape}, the matrices need ({n},)")
        return vector
    vector = np.zeros(n)
    for dof, weight in port.items():
        if not first <= dof < n + first:
            raise ModelError(f"port {name!r}: dof {dof} is outside {first} ... {n - 1 + first}")
        vector[dof - first] = weight
    return vector


def _weights(path: Path) -> dict[int, float]:
    """Return a table of dof and weight."""
    if not path.exists():
        raise ModelError(f"{path}: no such file; check the path")
    table = read_csv(path, ModelError)
    if [head.text.lower() for head in table.heads] != ["dof", "weight"]:
        raise ModelError(f"{path}: the first line must be 'dof,weight'")
    out: dict[int, float] = {}
    for line, cells in zip(table.lines, table.rows, strict=True):
        if len(cells) != 2 or not _DOF.fullmatch(cells[0].strip()):
            raise ModelError(f"{path}, line {line}: {','.join(cells)!r} must be a dof number and a weight")
        dof = int(cells[0])
        if dof in out:
            raise ModelError(f"{path}, line {line}: dof {dof} stands there twice; keep one")
        out[dof] = 0.0
    return dict(zip(out, map(float, table.numbers([1])[:, 0]), strict=True))


def _some(numbers: Any) -> str:
    return ", ".join(map(str, numbers[:8])) + (", ..." if len(numbers) > 8 else "")
