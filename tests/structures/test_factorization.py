"""Both factorizations: the same solutions, the same inertia, the same refusals."""

import numpy as np
import pytest
import skfem
from scipy.linalg import eigvalsh

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.model import Material
from seatfem.structures.reduction.factorization import (
    SINGLE,
    FactorizationError,
    _pardiso_class,
    factorize,
    solve_on_two_grids,
)

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


@pytest.mark.slow
@pytest.mark.parametrize("backend", BACKENDS)
def test_counts_the_eigenvalues_below_a_shift(model, backend):
    values = eigvalsh(model.K.toarray(), model.M.toarray())
    for n in (1, 6, 20):
        gap = n + int(np.argmax(np.diff(values[n : n + 5])))
        shift = (values[gap] + values[gap + 1]) / 2
        factor = factorize(model.K - shift * model.M, definite=False, backend=backend)
        assert factor.negative_pivots == gap + 1


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_message_names_the_matrix_and_the_remedy(model, backend):
    shifted = model.K - 100.0 * model.M
    with pytest.raises(FactorizationError, match=rf"K.*w\^2 M \({model.size} unknowns\).*fix"):
        factorize(shifted, backend=backend, name="K - w^2 M")


STEEL, PEEK = Material(200e9, 0.3, 7850.0), Material(3.6e9, 0.4, 1300.0)
ALLOWED = 1e-4
STEEPER = np.concatenate([[0.0], np.geomspace(1e-7, 1e-3, 7)])


def evenly(length, cells):
    return np.linspace(0, length, cells + 1)


def body(*sides, material=STEEL):
    mesh = skfem.MeshTet.init_tensor(*sides)
    top = sides[2][-1]
    named = {"contact": lambda x: x[2] > top * (1 - 1e-9), "fixed": lambda x: x[0] < 1e-12}
    mesh = mesh.with_boundaries(named)
    if isinstance(material, dict):
        mesh = mesh.with_subdomains({"lower": lambda x: x[2] < top / 2, "upper": lambda x: x[2] >= top / 2})
    return assemble(mesh, material, order=2)


BLOCK = (evenly(20e-3, 6), evenly(20e-3, 6), evenly(8e-3, 4))
BODIES = [
    ("block", lambda: body(*BLOCK), 300e3, "plain"),
    ("PEEK on steel, slow", lambda: body(*BLOCK, material={"lower": STEEL, "upper": PEEK}), 10e3, "refined"),
    ("plate of 0.2 mm", lambda: body(evenly(20e-3, 10), evenly(20e-3, 10), evenly(0.2e-3, 1)), 300e3, "refined"),
    ("plate of 0.2 mm, slow", lambda: body(evenly(20e-3, 10), evenly(20e-3, 10), evenly(0.2e-3, 1)), 10e3, "double"),
    ("plate of 20 um", lambda: body(evenly(20e-3, 10), evenly(20e-3, 10), evenly(20e-6, 1)), 300e3, "double"),
    ("nearly incompressible", lambda: body(*BLOCK, material=Material(4e9, 0.4999, 1300.0)), 300e3, "refined"),
    ("elements of 0.1 um and 1 mm", lambda: body(STEEPER, STEEPER, STEEPER), 300e3, "double"),
]


@pytest.mark.slow(but="plate of 0.2 mm")
@pytest.mark.skipif(not _pardiso_class(), reason="no MKL")
@pytest.mark.parametrize(("make", "band", "how"), [case[1:] for case in BODIES], ids=[case[0] for case in BODIES])
def test_single_precision_is_refined_or_refused_where_it_leaves_too_much(make, band, how):
    """No solution under a load on the port, nor of the next vector, is further off than allowed."""
    model = make()
    matrix = model.K + (2 * np.pi * band) ** 2 * model.M
    exact, factor = factorize(matrix), factorize(matrix, allowed=ALLOWED)
    assert ("double" if SINGLE not in factor.backend else "refined" if factor.refined else "plain") == how
    grids = solve_on_two_grids(matrix, model.dofs, 1e-3)
    assert (grids is not None) == (how == "plain")  # others take too many steps
    first = exact.solve(model.port_matrix)
    for load in (model.port_matrix, model.M @ first):
        x, rough = exact.solve(load), factor.solve(load)
        assert np.linalg.norm(rough - x) <= ALLOWED * np.linalg.norm(x)
        if how != "double":
            assert np.linalg.norm(rough - x) > 1e-12 * np.linalg.norm(x)  # it is rounded indeed
        if grids is not None:
            off = grids.solve(load) - x
            assert 1e-8 < np.sum(off * (matrix @ off)) / np.sum(x * (matrix @ x)) < (2e-3) ** 2


@pytest.mark.skipif(not _pardiso_class(), reason="no MKL")
def test_numbers_out_of_the_range_of_single_precision_are_scaled(model):
    for scale in (1e-60, 1e60):
        factor = factorize(scale * model.K, allowed=1e-3)
        load = 1e50 * model.port_matrix
        assert SINGLE in factor.backend
        exact = factorize(scale * model.K).solve(load)
        np.testing.assert_allclose(factor.solve(load), exact, rtol=0.0, atol=1e-3 * np.abs(exact).max())
        assert not np.any(factor.solve(0.0 * load))


def test_a_poor_first_solve_is_reported_with_its_number(model):
    with pytest.raises(FactorizationError, match=r"leaves a residual of \d"):
        factorize(model.K, tolerance=1e-30)
