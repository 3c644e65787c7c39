"""Both factorizations: the same solutions, the same inertia, the same refusals."""

from importlib import metadata

import numpy as np
import pytest
import skfem
from scipy import sparse

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
    values = np.linalg.eigvals(np.linalg.solve(model.M.toarray(), model.K.toarray())).real
    values.sort()
    for n in (1, 6, 20):
        gap = n + int(np.argmax(np.diff(values[n : n + 5])))
        shift = (values[gap] + values[gap + 1]) / 2
        factor = factorize(model.K - shift * model.M, definite=False, backend=backend)
        assert factor.negative_pivots == gap + 1


@pytest.mark.parametrize("backend", BACKENDS)
def test_refuses_what_is_not_positive_definite(model, backend):
    with pytest.raises(FactorizationError, match="not positive definite"):
        factorize(model.K - 100.0 * model.M, backend=backend)


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
def test_the_direct_solve_is_pypardisos_own(model):
    matrix = sparse.csr_matrix(model.K + 4.0 * model.M)
    rhs = np.random.default_rng(2).standard_normal((model.size, 2))
    theirs = _pardiso_class()(mtype=11)
    assert factorize(matrix, backend="pardiso").solve(rhs) == pytest.approx(theirs.solve(matrix, rhs), rel=1e-9)
    theirs.free_memory(everything=True)


@pytest.mark.skipif(not _pardiso_class(), reason="no MKL")
def test_solves_are_one_call_of_phase_33_on_the_upper_triangle(model, monkeypatch):
    """No copy, comparison or hash of the matrix, which the wrapper would make in every call; all vectors together."""
    solvers, calls = [], []

    class Watched(_pardiso_class()):
        def __init__(self, mtype):
            super().__init__(mtype=mtype)
            solvers.append(self)

    monkeypatch.setattr("seatfem.structures.reduction.factorization._pardiso_class", lambda: Watched)
    matrix = sparse.csr_matrix(model.K + 4.0 * model.M)
    factor = factorize(matrix, backend="pardiso")
    (solver,) = solvers
    library = solver._mkl_pardiso

    def watched(*arguments):
        calls.append(arguments)
        library(*arguments)

    rhs = np.random.default_rng(3).standard_normal((model.size, 16))
    with monkeypatch.context() as patch:
        for name in ("solve", "factorize", "_is_already_factorized", "_hash_csr_matrix", "_call_pardiso"):
            patch.setattr(Watched, name, None)
        patch.setattr(solver, "_mkl_pardiso", watched)
        found = factor.solve(rhs)
    assert np.linalg.norm(matrix @ found - rhs) < 1e-11 * np.linalg.norm(rhs)
    ((_, _, _, mtype, phase, size, _, starts, *_, vectors, _, _, _, _, _),) = calls
    assert [argument._obj.value for argument in (phase, size, vectors)] == [33, model.size, 16]
    assert getattr(mtype._obj, "value", None) == 2
    assert starts[model.size] - 1 == sparse.triu(matrix).nnz


@pytest.mark.skipif(not _pardiso_class(), reason="no MKL")
@pytest.mark.parametrize(("rough", "steps"), [(1e-8, 0), (0.0, 2)])
def test_solves_are_refined_only_where_the_first_one_is_rough(model, monkeypatch, rough, steps):
    """Refinement takes two thirds of the time of a solve, and round-off is all that it could take away."""
    solvers = []

    class Watched(_pardiso_class()):
        def __init__(self, mtype):
            super().__init__(mtype=mtype)
            solvers.append(self)

    monkeypatch.setattr("seatfem.structures.reduction.factorization._pardiso_class", lambda: Watched)
    monkeypatch.setattr("seatfem.structures.reduction.factorization._ROUGH", rough)
    for definite, count in ((True, 0), (False, 0)):
        factor = factorize(model.K + 4.0 * model.M, definite=definite, backend="pardiso")
        assert factor.negative_pivots == count
        assert solvers[-1].get_iparm(7) == steps  # refinement steps that the last solve took


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
