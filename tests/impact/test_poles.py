"""Sums of poles: against modes, a direct integration, state space and receptance; in contact; their passivity."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg
from scipy.linalg import eig, expm

import impact
from impact.greens.base import GreensFunction, GreensFunctionError
from impact.greens.modal import ModalGreens, Residual
from impact.greens.passivity import pole_passivity, real_mobility
from impact.greens.poles import PoleGreens

MODAL = impact.ModalGreens(
    2 * np.pi * np.array([0.0, 1e3, 2.3e3, 5e3, 8e3]),
    np.array([0.0, 0.02, 0.3, 1.7, 0.0]),
    np.array([[1.0, 0.5], [2.0, -1.0], [1.5, 1.2], [0.3, 0.9], [0.4, 0.1]]),
    impact.Residual.exponential([[2e-9, 1e-9], [1e-9, 3e-9]], [[1e-4, 0.0], [0.0, 2e-4]]),
    ("lip", "stop"),
)
POLES = impact.PoleGreens.from_modal(MODAL)
T = np.concatenate([[-1e-3, 0.0, 1e-12, 1e-9], np.linspace(1e-6, 5e-3, 400)])
DT = 2e-6
# a mass pushed at the first of two, a dashpot between the second and the ground only: not Rayleigh damping
M, K = np.diag([0.02, 0.03]), np.array([[4e5, -3e5], [-3e5, 5e5]])
C = np.array([[0.0, 0.0], [0.0, 40.0]])


def complex_modes(m: np.ndarray, c: np.ndarray, k: np.ndarray, ports: np.ndarray) -> impact.PoleGreens:
    scale = np.sqrt(np.linalg.norm(k) / np.linalg.norm(m))  # of time, for the digits of the eigenvalues
    n, zero, c, k = len(m), np.zeros_like(m), c / scale, k / scale**2
    s, v = eig(np.block([[zero, np.eye(n)], [-k, -c]]), np.block([[np.eye(n), zero], [zero, m]]))
    order = np.argsort(s.imag)[n:]
    s, v = s[order], v[:n, order]
    norm = np.array([x @ (2 * a * m + c) @ x for a, x in zip(s, v.T, strict=True)])
    names = tuple(str(j) for j in range(ports.shape[1]))
    return impact.PoleGreens(scale * s, (ports.T @ v / np.sqrt(norm * scale)).T, port_names=names)


COUPLED = complex_modes(M, C, K, np.eye(2)[:, :1])


@pytest.mark.parametrize("ports", [(0, 0), (0, 1), (1, 1)])
def test_modes_and_their_poles_are_the_same_function(ports: tuple[int, int]) -> None:
    for name in ("impulse_response", "step_response"):
        expected = getattr(MODAL, name)(T, *ports)
        assert getattr(POLES, name)(T, *ports) == pytest.approx(expected, rel=1e-9, abs=1e-12 * np.abs(expected).max())
    hann = MODAL.filtered(T, 3e-4, *ports)
    assert POLES.filtered(T, 3e-4, *ports) == pytest.approx(hann, rel=1e-8, abs=1e-9 * np.abs(hann).max())
    assert POLES.filtered_matrix(T, 3e-4)[ports] == pytest.approx(POLES.filtered(T, 3e-4, *ports), rel=1e-12)


@pytest.mark.parametrize("greens", [MODAL, POLES, MODAL.scaled(2.0), impact.SumGreens((MODAL, POLES))])
def test_own_step_responses_are_those_of_each_port(greens: GreensFunction) -> None:
    each = [greens.step_response(T[4:], i, i) for i in range(2)]
    assert greens.own_step_responses(T[4:]) == pytest.approx(np.transpose(each), rel=1e-12)


def test_contact_with_a_nonproportional_system_equals_a_direct_integration() -> None:
    n, stiffness, mass = 2000, 2e6, 0.01
    striker, law = impact.rigid_mass(mass=mass, velocity=-1.0), impact.LinearSpring(stiffness=stiffness)
    problem = impact.ContactProblem(striker, target=impact.Body(COUPLED), law=law)
    result = impact.solve(problem, dt=DT, duration=n * DT, rule="passive")
    a = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    push = np.array([0.0, 0.0, 1 / M[0, 0], 0.0])  # of a force that is constant over a step
    both = expm(DT * np.block([[a, push[:, None]], [np.zeros((1, 5))]]))
    a, b = both[:4, :4], both[:4, 4]
    state, y, v, force = np.zeros(4), 0.0, -1.0, []
    own = b[0] + DT**2 / (2 * mass)
    # implicit in the closure at the end of the step, as the solver's passive rule for a linear spring
    for _ in range(n):
        free = (a @ state)[0] - (y + DT * v)
        push = max(0.0, stiffness * free / (1 + stiffness * own))
        state = a @ state - b * push
        y, v = y + DT * v + DT**2 / (2 * mass) * push, v + DT / mass * push
        force.append(push)
    assert max(force) > 100
    assert result.force[1:] == pytest.approx(force, abs=1e-8 * max(force))
    assert result.energy.residual < 1e-10


def test_real_mobility_is_that_of_the_transfer_function() -> None:
    w = np.array([10.0, 2e3, 4.4e3, 1e5])
    both = complex_modes(M, C, K, np.eye(2))
    exact = [np.linalg.inv(K + 1j * x * C - x**2 * M) * 1j * x for x in w]
    mobility, size = real_mobility(both, w)
    assert np.all(np.abs(mobility - np.real(exact)) <= 1e-12 * size[:, None, None])
    assert mobility[:3] == pytest.approx(np.real(exact)[:3], rel=1e-6)
    assert np.all(size >= np.trace(mobility, axis1=1, axis2=2) * (1 - 1e-9))


def test_a_residue_turned_too_far_gains_energy() -> None:
    # R = exp(i a)/(2i): g(0+) = sin a >= 0, and Re[iw G]/w^2 at w -> 0 asks for a <= 2 asin(zeta)
    s = 1e3 * (-0.05 + 1j * np.sqrt(1 - 0.05**2))
    for turn, passive in ((0.03, True), (0.97, True), (1.03, False), (-0.03, False)):
        shape = np.sqrt(np.exp(2j * turn * np.arcsin(0.05)) / 2j)
        pair = impact.PoleGreens(np.array([s]), np.array([[shape]]))
        assert pole_passivity(pair).passive is passive, turn


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"poles": np.array([1 + 1j])}, "grows as exp"),
        ({"poles": np.array([-1 - 1j])}, "Im s = -1"),
        ({"poles": np.array([-1 + 1j, 2])}, "shapes must match"),
        ({"shapes": np.array([[np.nan]])}, "shapes .*finite"),
        ({"rates": np.array([-2.0]), "real_shapes": np.ones((1, 1)), "signs": np.ones(1)}, r"grows as exp\(2 t\)"),
        ({"rates": np.array([2.0]), "real_shapes": np.ones((1, 1)), "signs": np.array([0.5])}, "signs must be"),
        ({"rates": np.array([0.0]), "real_shapes": np.ones((1, 1)), "signs": -np.ones(1)}, "signs must be"),
        ({"compliance": -np.ones((1, 1))}, "positive semidefinite"),
    ],
)
def test_what_is_refused(change: dict[str, np.ndarray], words: str) -> None:
    good = impact.PoleGreens(np.array([-1 + 1j]), np.ones((1, 1), complex))
    with pytest.raises(GreensFunctionError, match=words):
        replace(good, **change)


TIMES = np.array([0.0, 1e-4, 7e-4, 3e-3])


def oscillators() -> ModalGreens:
    """Return two ports with a rigid motion, an overdamped and a light mode, a relaxation and a bare compliance."""
    rest = Residual(np.array([[0.2, 0.1]]), np.array([4e3]), np.array([[2e-6, 1e-6], [1e-6, 3e-6]]))
    omega, zeta = np.array([0.0, 2e3, 5e3]), np.array([0.0, 1.5, 0.01])
    return ModalGreens(omega, zeta, np.array([[1.0, 1.0], [0.5, -0.7], [-0.3, 0.9]]), rest, ("a", "b"))


def poles() -> PoleGreens:
    """Return the same with complex shapes, real poles and a rigid motion."""
    return PoleGreens(
        np.array([-50 + 2e3j, -80 + 6e3j]),
        np.array([[0.02 - 0.02j, 0.01 + 0.005j], [0.005 - 0.01j, 0.01 - 0.012j]]),
        np.array([3e3, 5e3]),
        np.array([[0.1, 0.05], [0.02, 0.03]]),
        np.array([1.0, -1.0]),
        np.array([[1.0, 0.5]]),
        np.array([[1e-6, 0.0], [0.0, 2e-6]]),
        ("a", "b"),
    )


@pytest.mark.parametrize("greens", [oscillators(), poles()], ids=["oscillators", "poles"])
def test_the_state_space_is_g(greens: GreensFunction) -> None:
    space = impact.state_space(greens)
    assert space.ports == ("a", "b")
    assert len(space.states) == len(space.A)
    for i in (0, 1):
        for j in (0, 1):
            response = [space.C[i] @ linalg.expm(space.A * t) @ space.B[:, j] for t in TIMES]
            exact = greens.impulse_response(TIMES, i, j)
            np.testing.assert_allclose(response, exact, rtol=1e-9, atol=1e-12 * np.abs(exact).max())
    np.testing.assert_array_equal(space.D, greens.transfer(np.array([1e12 + 0j]))[0].real.round(12))


def test_a_rod_has_no_state_space() -> None:
    rod = impact.fixed_rod(young=2e11, density=7850.0, length=0.1, area=1e-4)
    with pytest.raises(impact.GreensFunctionError, match="no finite sum of poles"):
        impact.state_space(rod)


def test_receptance_arrays_and_back() -> None:
    """Arrays have frequency, response, reference in this order, and fitted poles reproduce them."""
    shapes = np.array([[0.5, -0.7], [-0.3, 0.9]])
    greens = ModalGreens(np.array([2e3, 5e3]), np.array([0.02, 0.01]), shapes, Residual.none(2), ("a", "b"))
    f = np.linspace(5.0, 1500.0, 300)
    array = impact.receptance(greens, f)
    assert array.shape == (300, 2, 2)
    assert impact.receptance(greens, f[0]).shape == (2, 2)
    w, response, reference = 2 * np.pi * f, 1, 0
    denominators = greens.omega**2 - w[:, None] ** 2 + 2j * greens.zeta * greens.omega * w[:, None]
    np.testing.assert_allclose(array[:, response, reference], (shapes[:, 1] * shapes[:, 0] / denominators).sum(axis=1))
    np.testing.assert_array_equal(array[:, 1, 0], impact.receptance(greens, f, 1, 0))
    back = impact.fit_poles(impact.FrequencyResponse(f, array, ("a", "b")))
    np.testing.assert_allclose(impact.receptance(back, f), array, atol=1e-6 * np.abs(array).max())
