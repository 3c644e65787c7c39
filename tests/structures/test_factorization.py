"""Both factorizations: the same solutions, the same inertia, the same refusals."""

from importlib import metadata

import numpy as np
import pytest
import skfem
from scipy import sparse
from scipy.linalg import eigvalsh

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.reduction.factorization import FactorizationError, _mkl_runtime, _pardiso_class, factorize

BACKENDS = ["superlu", pytest.param("pardiso", marks=pytest.mark.skipif(not _pardiso_class(), reason="no MKL"))]


@pytest.fixture(scope="module")
def model():
    mesh = skfem.MeshTet.init_tensor(*(np.linspace(0, 1, 5) for _ in range(3)))
    mesh = mesh.with_boundaries({"contact": lambda x: x[2] > 1 - 1e-9, "fixed": lambda x: x[2] < 1e-9})
    return assemble(mesh, {"young": 1.0, "poisson": 0.3, "density": 1.0}, order=2)


@pytest.mark.parametrize("backend", BACKENDS)
def test_solves_one_and_several_right_hand_sides(model, backend):
    matrix = model.K + 4.0 * model.M
    factor = factorize(matrix, backend=backend)
    rhs = np.random.default_rng(1).standard_normal((model.size, 3))
    several = factor.solve(rhs)
    assert factor.backend == backend
    assert factor.negative_pivots == 0
    assert factor.residual < 1e-12
    assert np.linalg.norm(matrix @ several - rhs) < 1e-11 * np.linalg.norm(rhs)
    assert np.allclose(factor.solve(rhs[:, 1]), several[:, 1], rtol=1e-9, atol=1e-12 * np.abs(several).max())


@pytest.mark.parametrize("backend", BACKENDS)
def test_counts_the_eigenvalues_below_a_shift(model, backend):
    values = eigvalsh(model.K.toarray(), model.M.toarray())
    for n in (1, 6, 20):
        gap = n + int(np.argmax(np.diff(values[n : n + 5])))
        shift = (values[gap] + values[gap + 1]) / 2
        factor = factorize(model.K - shift * model.M, definite=False, backend=backend)
        assert factor.negative_pivots == gap + 1


def test_refuses_empty_rows_and_wrong_sizes(model):
    with pytest.raises(FactorizationError, match="1 diagonal values are zero"):
        factorize(np.diag([1.0, 0.0, 2.0]))
    with pytest.raises(FactorizationError, match="2 rows, must have 3"):
        factorize(np.eye(3) + 0.1, backend="superlu").solve(np.ones(2))


def test_a_poor_first_solve_is_reported_with_its_number(model):
    with pytest.raises(FactorizationError, match=r"leaves a residual of \d"):
        factorize(model.K, tolerance=1e-30)


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_message_names_the_matrix_and_the_remedy(model, backend):
    shifted = model.K - 100.0 * model.M
    with pytest.raises(FactorizationError, match=rf"K - w\^2 M \({model.size} unknowns\).*fix a body that can move"):
        factorize(shifted, backend=backend, name="K - w^2 M")


@pytest.mark.skipif(not _pardiso_class(), reason="no MKL")
def test_pardiso_is_told_where_mkl_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search through all files of the environment took longer than a small factorization."""
    monkeypatch.setattr("glob.glob", None)
    matrix = sparse.csr_array(sparse.diags_array([2.0, 3.0]))
    assert factorize(matrix, backend="pardiso").solve(np.ones(2)) == pytest.approx([1 / 2, 1 / 3])


def test_another_installation_of_mkl_is_left_to_pypardiso(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "files", missing)
    assert _mkl_runtime() is None
