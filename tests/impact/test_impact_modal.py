"""Modal Green's functions, the residuals that complete them, and bodies of modes."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.linalg import expm

import impact
from impact import Body, GreensFunctionError, ModalGreens, ModalState, Residual, single_mode
from impact.greens import oscillator

RNG = np.random.default_rng(11)


def matrix(greens: ModalGreens, t: float) -> np.ndarray:
    n = range(len(greens.ports))
    return np.array([[float(greens.impulse_response(t, i, j)) for j in n] for i in n])


@pytest.mark.parametrize(("ports", "rank"), [(2, 2), (4, 4), (4, 2)])
def test_exponential_residual_of_several_ports_is_symmetric_and_passive(ports: int, rank: int) -> None:
    factor, g0 = RNG.normal(size=(ports, rank)), np.diag(RNG.uniform(0.5, 2.0, ports))
    r0 = factor @ factor.T
    names = tuple(f"p{k}" for k in range(ports))
    greens = ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, ports)), Residual.exponential(r0, g0), port_names=names)
    np.testing.assert_allclose(greens.static_compliance(), r0, atol=1e-12 * np.abs(r0).max())
    if rank == ports:
        np.testing.assert_allclose(greens.initial_value(), g0, atol=1e-13)
    else:  # null directions of r0 yield not at all
        assert np.linalg.matrix_rank(greens.initial_value(), tol=1e-10) == rank
    for t in (0.0, 0.1, 1.0, 10.0):
        g = matrix(greens, t)
        np.testing.assert_allclose(g, g.T, atol=1e-14)
        assert np.linalg.eigvalsh(g)[0] >= -1e-13


def test_modes_as_test_programs_list_them() -> None:
    """Frequencies in hertz, one damping or many, and amplitudes at one port or several make the function."""
    one = ModalGreens.from_hz([100.0, 250.0], 0.01, [1.0, 2.0])
    assert np.allclose(one.omega, 2 * np.pi * np.array([100.0, 250.0]), rtol=1e-15)
    assert one.port_names == ("contact",)
    assert np.array_equal(one.zeta, [0.01, 0.01])
    two = ModalGreens.from_hz([100.0, 250.0], [0.01, 0.02], [[1.0, 2.0], [3.0, 4.0]])
    assert two.port_names == ("port_1", "port_2")
    assert np.array_equal(two.shapes, [[1.0, 2.0], [3.0, 4.0]])
    same = single_mode(frequency_hz=100.0, mass=0.25, damping_ratio=0.01)
    t = np.linspace(0.0, 0.05, 200)
    assert np.allclose(
        ModalGreens.from_hz(100.0, 0.01, 2.0).impulse_response(t), same.impulse_response(t), rtol=1e-13, atol=1e-16
    )


def of_shapes(omega: tuple[int, ...], shapes: tuple[int, ...], rates: tuple[int, ...]) -> ModalGreens:
    """Return a function with arrays of these shapes, as a damaged file may hold them."""
    residual = Residual(np.ones(shapes), np.ones(rates), np.zeros((1, 1)))
    return ModalGreens(np.ones(omega), np.zeros(3), np.ones((3, 1)), residual)


def of_modes(omega: float, zeta: float, shape: float) -> ModalGreens:
    return ModalGreens(np.array([omega]), np.array([zeta]), np.array([[shape]]), Residual.none())


HERTZ = [100.0, 250.0]
MODE = single_mode(frequency_hz=1.0, mass=1.0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        *(
            (lambda each=each: of_shapes(*each), "shapes must match")
            for each in (
                ((3, 1), (1, 1), (1,)), ((3,), (1,), (1,)), ((3,), (), (1,)), ((3,), (1, 1), ()), ((3,), (1, 1), (1, 1))
            )
        ),
        (lambda: Residual.spring(np.diag([1.0, -1.0])), r"compliance .*eigenvalue -1"),
        (lambda: Residual.exponential(1.0, 0.0), "smallest eigenvalue 0"),
        (lambda: Residual.spring([[1.0, 2.0]]), "finite square matrix"),
        (lambda: Residual.exponential(np.eye(2), np.eye(3)), "give equal shapes"),
        (lambda: of_modes(-1.0, 0.1, 1.0), "omega must be >= 0"),
        (lambda: of_modes(1.0, -0.1, 1.0), "zeta must be >= 0"),
        (lambda: of_modes(1.0, 0.1, np.nan), "shapes .*finite"),
        (lambda: ModalGreens.from_hz(HERTZ, [0.01, 0.02, 0.03], [1.0, 2.0]), r"frequencies \(M,\), damping \(M,\)"),
        (lambda: ModalGreens.from_hz(HERTZ, 0.01, [1.0, 2.0, 3.0]), "shapes must match"),
        (lambda: ModalGreens.from_hz(HERTZ, -0.01, [1.0, 2.0]), "zeta must be >= 0"),
        (lambda: Body(impact.spring(stiffness=1.0), velocity=-1.0), "translate: velocity = -1"),
        (lambda: Body(impact.rigid_mass(mass=1.0, velocity=0.0).greens, velocity=np.inf), "must be finite"),
        (lambda: impact.rigid_mass(mass=0.0, velocity=-1.0), "mass = 0 kg"),
        (lambda: Body(MODE, state=ModalState(np.zeros(2), np.zeros(1))), "state.displacement must be 1"),
        (lambda: Body(MODE, state=ModalState(np.zeros(1), np.full(1, np.nan))), "state.velocity.*1 finite"),
    ],
)  # fmt: skip
def test_modes_and_bodies_that_cannot_be_are_refused(make: Callable[[], object], words: str) -> None:
    with pytest.raises(GreensFunctionError, match=words):
        make()


OMEGA = [0.0, 1e-8, 1e-4, 0.3, 1.0, 7.0, 40.0]
ZETA = [0.0, 1e-12, 0.03, 0.5, 1 - 1e-9, 1.0, 1 + 1e-9, 1.3, 8.0]


def exact_step(dt: float, omega: float, zeta: float) -> np.ndarray:
    """Return the (2, 3) map of (q, q', f), f constant."""
    generator = np.array([[0.0, 1.0, 0.0], [-(omega**2), -2 * zeta * omega, 1.0], [0.0, 0.0, 0.0]])
    # balanced by max(omega, 1/dt), so that every entry is a number of order one
    scale = np.diag([max(omega, 1.0 / dt), 1.0, 1.0])
    inverse = np.diag(1 / np.diag(scale))
    return (inverse @ expm(scale @ generator @ inverse * dt) @ scale)[:2]


@pytest.mark.parametrize("omega", OMEGA)
@pytest.mark.parametrize("zeta", ZETA)
@pytest.mark.parametrize("dt", [1e-3, 1.0])
def test_transition_is_the_matrix_exponential(omega: float, zeta: float, dt: float) -> None:
    a, b = oscillator.transition(dt, np.array([omega]), np.array([zeta]))
    ours = np.column_stack([a[:, :, 0], b[:, 0]])
    exact = exact_step(dt, omega, zeta)
    # expm loses about norm(A dt) = 2 zeta omega dt <= 640 times round-off, each entry against its row and column scale
    size = np.array([[1.0, dt, dt**2], [1 / dt, 1.0, dt]])
    limit = 1e-13 * (1 + (1 + 2 * zeta) * omega * dt) ** 2 * size
    assert np.all(np.abs(ours - exact) <= limit)


def test_step_response_keeps_its_digits_from_short_to_long() -> None:
    """The response is t^2/2 - w^2 t^4/24 for w t -> 0 and does not jump where the formula changes."""
    t = np.array([1e-9, 1e-6, 1e-3])
    series = t**2 / 2 - t**4 / 24
    np.testing.assert_allclose(oscillator.step_response(t, np.array(1.0), np.array(0.0)), series, rtol=1e-14)
    around = np.array([0.5 - 1e-12, 0.5 + 1e-12])
    low, high = oscillator.step_response(around, np.array(1.0), np.array(0.0))
    assert high == pytest.approx(low, rel=1e-11)


@pytest.mark.parametrize("omega", [0.0, 1e-3, 0.5, 4.0, 300.0])
@pytest.mark.parametrize("zeta", [0.0, 0.01, 0.3, 0.6, 1.0, 3.0])
def test_dissipation_closes_the_energy_balance(omega: float, zeta: float) -> None:
    """E0 + work of f - E1 = D(x, x): D is integrated on its own, E1 comes from the exact step."""
    dt = 0.7
    form = oscillator.dissipation_form(dt, np.array([omega]), np.array([zeta]))[:3, :3, 0]
    np.testing.assert_allclose(form, form.T, atol=1e-14 * (1 + np.abs(form).max()))
    step = exact_step(dt, omega, zeta)
    for q, p, f in np.random.default_rng(3).normal(size=(20, 3)):
        x = np.array([q / max(omega, 1.0), p, f * max(omega, 1.0)])
        q1, p1 = step @ x
        before, after = (x[1] ** 2 + (omega * x[0]) ** 2) / 2, (p1**2 + (omega * q1) ** 2) / 2
        lost = before + x[2] * (q1 - x[0]) - after
        assert x @ form @ x == pytest.approx(lost, abs=1e-11 * (before + after + abs(x[2] * (q1 - x[0]))))
