"""Modal Green's functions and the residuals that complete them."""

import numpy as np
import pytest
from scipy.integrate import quad

from impact import GreensFunctionError, ModalGreens, Residual, single_mode

RNG = np.random.default_rng(11)


def spd(n: int, rank: int) -> np.ndarray:
    factor = RNG.normal(size=(n, rank))
    return factor @ factor.T


def only(residual: Residual) -> ModalGreens:
    ports = tuple(f"p{k}" for k in range(len(residual.compliance)))
    return ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, len(ports))), residual, port_names=ports)


def matrix(greens: ModalGreens, t: float) -> np.ndarray:
    n = range(len(greens.ports))
    return np.array([[float(greens.impulse_response(t, i, j)) for j in n] for i in n])


def test_exponential_residual_has_the_integral_and_the_start() -> None:
    greens = only(Residual.exponential(3e-9, 0.06))
    assert greens.initial_value()[0, 0] == pytest.approx(0.06, rel=1e-14)
    assert greens.static_compliance()[0, 0] == pytest.approx(3e-9, rel=1e-14)
    tau = 3e-9 / 0.06
    assert quad(lambda t: float(greens.impulse_response(t)), 0, 60 * tau)[0] == pytest.approx(3e-9, rel=1e-10)
    assert float(greens.impulse_response(tau)) == pytest.approx(0.06 / np.e, rel=1e-14)


@pytest.mark.parametrize(("ports", "rank"), [(2, 2), (4, 4), (4, 2)])
def test_exponential_residual_of_several_ports_is_symmetric_and_passive(ports: int, rank: int) -> None:
    r0, g0 = spd(ports, rank), np.diag(RNG.uniform(0.5, 2.0, ports))
    greens = only(Residual.exponential(r0, g0))
    np.testing.assert_allclose(greens.static_compliance(), r0, atol=1e-12 * np.abs(r0).max())
    if rank == ports:
        np.testing.assert_allclose(greens.initial_value(), g0, atol=1e-13)
    else:  # null directions of r0 yield not at all
        assert np.linalg.matrix_rank(greens.initial_value(), tol=1e-10) == rank
    for t in (0.0, 0.1, 1.0, 10.0):
        g = matrix(greens, t)
        np.testing.assert_allclose(g, g.T, atol=1e-14)
        assert np.linalg.eigvalsh(g)[0] >= -1e-13


def test_residual_refuses_what_gains_energy() -> None:
    with pytest.raises(GreensFunctionError, match=r"compliance .*eigenvalue -1"):
        Residual.spring(np.diag([1.0, -1.0]))
    with pytest.raises(GreensFunctionError, match="smallest eigenvalue 0"):
        Residual.exponential(1.0, 0.0)
    with pytest.raises(GreensFunctionError, match="finite square matrix"):
        Residual.spring([[1.0, 2.0]])
    with pytest.raises(GreensFunctionError, match="give equal shapes"):
        Residual.exponential(np.eye(2), np.eye(3))


@pytest.mark.parametrize(
    ("omega", "zeta", "shapes", "words"),
    [
        ([1.0], [0.1, 0.2], [[1.0]], "shapes must match"),
        ([-1.0], [0.1], [[1.0]], "omega must be >= 0"),
        ([1.0], [-0.1], [[1.0]], "zeta must be >= 0"),
        ([1.0], [0.1], [[np.nan]], "shapes .*finite"),
    ],
)
def test_modes_that_cannot_be_are_refused(omega: list, zeta: list, shapes: list, words: str) -> None:
    with pytest.raises(GreensFunctionError, match=words):
        ModalGreens(np.array(omega), np.array(zeta), np.array(shapes), Residual.none())


@pytest.mark.parametrize(
    ("omega", "shapes", "rates"),
    [((3, 1), (1, 1), (1,)), ((3,), (1,), (1,)), ((3,), (), (1,)), ((3,), (1, 1), ()), ((3,), (1, 1), (1, 1))],
)
def test_arrays_of_the_wrong_shape_are_refused(
    omega: tuple[int, ...], shapes: tuple[int, ...], rates: tuple[int, ...]
) -> None:
    """Arrays whose shapes do not match, as a damaged file may hold them, are refused."""
    residual = Residual(np.ones(shapes), np.ones(rates), np.zeros((1, 1)))
    with pytest.raises(GreensFunctionError, match="shapes must match"):
        ModalGreens(np.ones(omega), np.zeros(3), np.ones((3, 1)), residual)


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


@pytest.mark.parametrize(
    ("damping", "amplitudes", "words"),
    [
        ([0.01, 0.02, 0.03], [1.0, 2.0], r"frequencies \(M,\), damping \(M,\)"),
        (0.01, [1.0, 2.0, 3.0], "shapes must match"),
        (-0.01, [1.0, 2.0], "zeta must be >= 0"),
    ],
)
def test_modes_that_do_not_belong_together(damping: object, amplitudes: object, words: str) -> None:
    with pytest.raises(GreensFunctionError, match=words):
        ModalGreens.from_hz([100.0, 250.0], damping, amplitudes)  # type: ignore[arg-type]
