"""The same impact on a rod by line elements and on the analytic rod."""

import numpy as np
from scipy.linalg import eigh

import impact
from impact import Body, ContactProblem, ModalGreens, Residual, measures
from tests.rod_model import rod_model

ROD = {"young": 4.0, "density": 1.0, "area": 3.0, "length": 2.0}  # c = 2, Z = 6, l/c = 1, mass 6
STEP, FILTER = 1 / 2000, 0.25


def strike(greens: impact.GreensFunction) -> impact.ImpactResult:
    striker = impact.rigid_mass(mass=6.0, velocity=-1.0)
    return impact.solve(ContactProblem(striker, Body(greens)), dt=STEP, duration=3.5)


def fe_rod(n: int) -> ModalGreens:
    """The n lowest modes of 4 n quadratic line elements, eight elements to the shortest wave (with fewer, the
    highest frequencies spoil the order); the rest of the static compliance, and 1/Z, as the exponential residual.
    """
    model = rod_model(**ROD, elements=4 * n)
    port = model.ports["contact"].vector
    stiffness, mass = model.K.toarray(), model.M.toarray()
    squares, vectors = eigh(stiffness, mass, subset_by_index=[0, n - 1])
    omega, shapes = np.sqrt(squares), (vectors.T @ port)[:, None]
    left_out = port @ np.linalg.solve(stiffness, port) - float(np.sum((shapes[:, 0] / omega) ** 2))
    return ModalGreens(omega, np.zeros(n), shapes, Residual.exponential(left_out, 1 / 6.0))


def test_finite_element_rod_gives_the_analytic_rods_impact() -> None:
    """First order in 1/n for the force (L1, and averaged over l/4c), as for n exact modes; the impulse faster."""
    exact = strike(impact.fixed_rod(**ROD))
    filtered = measures.filtered_force(exact, FILTER)
    errors = []
    for n in (8, 24, 72):
        result = strike(fe_rod(n))
        assert result.energy.residual < 1e-11
        errors.append(
            (
                np.sum(np.abs(result.force - exact.force)) / np.sum(exact.force),
                np.max(np.abs(measures.filtered_force(result, FILTER) - filtered)) / filtered.max(),
                abs(measures.impulse(result) / measures.impulse(exact) - 1),
            )
        )
    l1, average, impulse = np.array(errors).T
    for error in (l1, average):
        order = np.log(error[:-1] / error[1:]) / np.log(3)
        np.testing.assert_allclose(order, 1.0, atol=0.12)
    assert l1[-1] < 1.3 / 72  # exact modes: 1.2/n
    assert average[-1] < 1.0 / 72
    # no clean order (its sign changes with n), but below 0.06/n^2 for n = 8 ... 160
    assert np.all(impulse < 0.06 / np.array([8, 24, 72]) ** 2)
