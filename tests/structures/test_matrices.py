"""Matrices from files: the same model whatever the format and units; every defect named with its file."""

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse
from scipy.io import mmwrite

from seatfem.structures.formats.matrices import read_matrices
from seatfem.structures.model import ModelError

N = 12
K = sparse.csr_array(sparse.diags_array([2.0 * np.ones(N), -np.ones(N - 1), -np.ones(N - 1)], offsets=[0, 1, -1]) * 3e7)
M = sparse.csr_array(sparse.diags_array([4.0 * np.ones(N), np.ones(N - 1), np.ones(N - 1)], offsets=[0, 1, -1]) * 1e-3)
PORT = {N - 1: 0.5, N - 2: 0.5}


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    out = {"mass": tmp_path / "M.mtx", "stiffness": tmp_path / "K.mtx"}
    mmwrite(out["mass"], sparse.coo_array(M), symmetry="symmetric", precision=17)
    mmwrite(out["stiffness"], sparse.coo_array(K), symmetry="symmetric", precision=17)
    return out


def put(path: Path, matrix: sparse.csr_array | np.ndarray, **options: str) -> None:
    mmwrite(path, sparse.coo_array(matrix) if sparse.issparse(matrix) else matrix, precision=17, **options)


def test_every_format_gives_the_same_matrices(files: dict[str, Path], tmp_path: Path) -> None:
    reference = read_matrices(**files, ports={"contact": PORT})
    assert abs(reference.K - K).max() < 1e-9
    assert abs(reference.M - M).max() < 1e-18
    assert reference.port_matrix[:, 0] @ np.ones(N) == 1.0
    put(tmp_path / "general.mtx", K, symmetry="general")
    put(tmp_path / "dense.mtx", K.toarray(), symmetry="general")
    (tmp_path / "packed.mtx.gz").write_bytes(gzip.compress(files["stiffness"].read_bytes()))
    sparse.save_npz(tmp_path / "K.npz", K)
    np.save(tmp_path / "K.npy", K.toarray())
    for name in ("general.mtx", "dense.mtx", "packed.mtx.gz", "K.npz", "K.npy"):
        other = read_matrices(files["mass"], tmp_path / name, ports={"contact": PORT})
        assert abs(other.K - reference.K).max() == 0, name


def test_a_column_is_a_diagonal_mass(files: dict[str, Path], tmp_path: Path) -> None:
    np.save(tmp_path / "m.npy", np.arange(1.0, N + 1)[:, None])
    model = read_matrices(tmp_path / "m.npy", files["stiffness"], ports={"contact": PORT})
    assert model.M.diagonal() == pytest.approx(np.arange(1.0, N + 1))


@pytest.mark.parametrize(
    ("system", "mass", "time"),
    [
        ("SI", 1.0, 1.0),
        ("mm-t-s", 1e3, 1.0),
        ("mm-kg-ms", 1.0, 1e-3),
        ("inch-lbf-s", 4.4482216152605 / 0.0254, 1.0),
    ],
)
def test_units_and_damping(files: dict[str, Path], tmp_path: Path, system: Any, mass: float, time: float) -> None:
    """Stiffness is force over length, thus mass/time^2 whatever the unit of length."""
    sparse.save_npz(tmp_path / "C.npz", 1e-5 * K)
    model = read_matrices(**files, damping=tmp_path / "C.npz", ports={"contact": PORT}, system=system)
    for matrix, own, factor in ((model.M, M, mass), (model.C, 1e-5 * K, mass / time), (model.K, K, mass / time**2)):
        assert abs(matrix - factor * own).max() < 1e-12 * factor * abs(own).max()


def test_ports_from_a_file_numbered_from_one(files: dict[str, Path], tmp_path: Path) -> None:
    (tmp_path / "lip.csv").write_text("# patch\ndof,weight\n11,0.5\n12,0.5\n")
    model = read_matrices(**files, ports={"lip": tmp_path / "lip.csv", "same": PORT | {}}, first_dof=1)
    assert np.flatnonzero(model.ports["lip"].vector).tolist() == [10, 11]
    assert np.flatnonzero(model.ports["same"].vector).tolist() == [9, 10]


def test_penalties_and_empty_rows_are_told_and_taken_out(files: dict[str, Path], tmp_path: Path) -> None:
    held = K.tolil()
    held[0, 0] = 1e36
    held[3, :] = held[:, 3] = 0
    free = M.tolil()
    free[3, :] = free[:, 3] = 0
    put(tmp_path / "held.mtx", held.tocsr(), symmetry="symmetric")
    put(tmp_path / "free.mtx", free.tocsr(), symmetry="symmetric")
    given = {"mass": tmp_path / "free.mtx", "stiffness": tmp_path / "held.mtx"}
    with pytest.raises(ModelError, match=r"held.mtx: 2 unknowns.*dof 0, 3; .*constrained=.drop"):
        read_matrices(**given, ports={"contact": PORT})
    model = read_matrices(**given, ports={"contact": PORT}, constrained="drop")
    assert model.size == N - 2
    assert np.flatnonzero(model.ports["contact"].vector).tolist() == [N - 4, N - 3]
    with pytest.raises(ModelError, match=r"'contact'.*constrained.*3"):
        read_matrices(**given, ports={"contact": {3: 1.0}}, constrained="drop")


def changed(matrix: sparse.csr_array, i: int, j: int, value: float) -> sparse.csr_array:
    out = matrix.tolil()
    out[i, j] = value
    return out.tocsr()


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (sparse.csr_array(K[:, :-1]), r"K.mtx:.*12 x 11:.*square"),
        (sparse.tril(K).tocsr(), "K.mtx:.*one.*'symmetric'"),
        (changed(K, 0, 1, 5.0), "K.mtx:.*symmetric.*reciprocity"),
        (changed(K, 2, 2, np.inf), "K.mtx:.*values.*1"),
        (K.astype(complex), "K.mtx: is complex"),
        (sparse.csr_array(K[:8, :8]), "M.mtx: M.*12 unknowns.*8.*K.*K.mtx"),
        (changed(K, 2, 2, -1.0), "K.mtx: K.*indefinite.*Lagrange"),
        (changed(K, 2, 2, 0.0), r"K.mtx: K.*4 places.*1, 2"),
    ],
)
def test_bad_stiffness(files: dict[str, Path], matrix: sparse.csr_array, message: str) -> None:
    put(files["stiffness"], matrix, symmetry="general")
    with pytest.raises(ModelError, match=message):
        read_matrices(**files, ports={"contact": PORT})


def test_bad_files(files: dict[str, Path], tmp_path: Path) -> None:
    def refused(message: str, mass: Path = files["mass"], **ports: object) -> None:
        with pytest.raises(ModelError, match=message):
            read_matrices(mass, files["stiffness"], ports=ports or {"contact": PORT})  # type: ignore[arg-type]

    refused("none.mtx: no such file", tmp_path / "none.mtx")
    (tmp_path / "M.txt").write_text("1 2 3")
    refused("M.txt: .* must end in .mtx", tmp_path / "M.txt")
    (tmp_path / "cut.mtx").write_text(files["mass"].read_text()[:-40])
    refused("cut.mtx: .*matrix", tmp_path / "cut.mtx")
    (tmp_path / "ones.mtx").write_text("%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n")
    refused("ones.mtx: .*pattern.* no values", tmp_path / "ones.mtx")
    put(tmp_path / "light.mtx", changed(M, 5, 5, 0.0), symmetry="general")
    refused(r"light.mtx: M .*1 unknowns \(dof 5\)", tmp_path / "light.mtx")
    refused("port 'lip': dof 12 .*0 ... 11", lip={12: 1.0})
    refused(r"port 'lip' .*\(3,\), .*\(12,\)", lip=np.ones(3))
    for text, message in (
        ("node,weight\n1,1\n", "first line .*'dof,weight'"),
        ("dof,weight\n1.5,1\n", "line 2: '1.5,1'"),
        ("dof,weight\n1,1\n1,2\n", "line 3: dof 1 .*twice"),
        ("dof,weight\n1,one\n", "line 2, column 2: 'one'"),
        ("dof,weight\n²,1\n", "line 2: .*weight"),
        (f"dof,weight\n{'9' * 5000},1\n", "line 2: .*weight"),
    ):
        (tmp_path / "lip.csv").write_text(text, encoding="utf-8")
        refused(f"lip.csv.*{message}", lip=tmp_path / "lip.csv")
    with pytest.raises(ModelError, match=r"'cgs'.*unknown.*SI"):
        read_matrices(**files, ports={"contact": PORT}, system="cgs")  # type: ignore[arg-type]
