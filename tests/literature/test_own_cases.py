"""Closed forms beyond the tables, each derived here by another way than the verification case's."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from seatfem.verify import verification_cases
from tests.known_answers.half_space import RADIATION

ENTRIES = json.loads(Path(__file__).with_name("own_cases.json").read_text())
CASES = {(case.case, case.quantity): case for case in verification_cases()}
Stop = Callable[[float, np.ndarray], float]


def mass_on_rod(alpha: float, reflection: float) -> list[float]:
    """End of contact, largest stress, rebound velocity, by intervals s = c t/l - 2n in 0..2.

    The mass M sends the wave a = V exp(-alpha s) P_n(s) into the rod, alpha = rod mass/M. The rod's end moves with
    v = a(t) + R a(t - T), N = Z (a(t) - R a(t - T)), M v' = -N: P_n' = -R P_(n-1)' + 2 alpha R P_(n-1); v does not
    jump: P_n(0) = exp(-2 alpha) P_(n-1)(2) + (-R)^n.
    """
    decay, r = math.exp(-2 * alpha), reflection
    last, largest = Polynomial([0.0]), 0.0
    for n in range(20):
        start = decay * last(2.0) + (-r) ** n
        now = start + 2 * alpha * r * last.integ() - r * (last - last(0.0))
        force = now - r * last  # times exp(-alpha s)
        s = np.linspace(0.0, 2.0, 4001)
        below = np.flatnonzero(force(s) <= 0)
        largest = max(largest, float(np.max(np.exp(-alpha * s) * force(s))))
        if below.size:
            end = float(brentq(force, s[below[0] - 1], s[below[0]], xtol=1e-15))
            return [2 * n + end, largest, -math.exp(-alpha * end) * (now + r * last)(end)]
        last = now
    raise AssertionError("still in contact")


def until(
    rates: Callable[[float, np.ndarray], list[float]], start: list[float], stop: Stop
) -> tuple[float, np.ndarray]:
    """Return time and state when ``stop`` falls to zero."""

    def falls(t: float, y: np.ndarray) -> float:
        return stop(t, y) if t > 1e-3 else 1.0

    falls.terminal, falls.direction = True, -1.0  # type: ignore[attr-defined]
    path = solve_ivp(rates, (0.0, 50.0), start, method="DOP853", rtol=1e-12, atol=1e-13, events=falls, max_step=0.05)
    return float(path.t_events[0][0]), path.y_events[0][0]


def hunt_crossley() -> list[float]:
    def force(y: np.ndarray) -> float:
        return max(y[0], 0.0) ** 1.5 * (1 + 0.5 * y[1])

    _, back = until(lambda t, y: [y[1], -force(y)], [0.0, 1.0], lambda t, y: y[0])
    _, deepest = until(lambda t, y: [y[1], -force(y)], [0.0, 1.0], lambda t, y: y[1])
    return [-back[1], deepest[0]]


def pad() -> list[float]:
    end, state = until(lambda t, y: [y[1], -y[0] - 0.6 * y[1]], [0.0, 1.0], lambda t, y: y[0] + 0.6 * y[1])
    return [-state[1], end]


def soft_tip() -> list[float]:
    """Return rebound velocity and largest compression of d' = v - N/Z, v' = -N, N = d, Z = 2.5."""
    _, end = until(lambda t, y: [y[1] - y[0] / 2.5, -y[0]], [0.0, 1.0], lambda t, y: y[0])
    _, top = until(lambda t, y: [y[1] - y[0] / 2.5, -y[0]], [0.0, 1.0], lambda t, y: y[1] - y[0] / 2.5)
    return [-end[1], top[0]]


def deepest(height: float) -> float:
    """Return the lowest place of a weight dropped on a spring, m = k = g = 1."""
    _, lowest = until(lambda t, y: [y[1], 1 - y[0]], [0.0, math.sqrt(2 * height)], lambda t, y: y[1])
    return float(lowest[0])


def in_contact(height: float) -> float:
    return until(lambda t, y: [y[1], 1 - y[0]], [0.0, math.sqrt(2 * height)], lambda t, y: y[0])[0]


def chain() -> list[float]:
    def rates(t: float, y: np.ndarray) -> list[float]:
        x, v = y[:3], y[3:]
        first, second = x[0] - x[1], x[1] - x[2]
        return [*v, -first, first - second, second]

    end, state = until(rates, [0, 0, 0, 1, 0, 0], lambda t, y: y[0] - y[1])
    return [end, state[3]]


def infinite_beam() -> list[float]:
    """Solve s v = 1/(1 + s^(-1/2)) (Laplace), M C = 1: v = sum (-t^(1/2))^n/Gamma(n/2 + 1), and N = -v'."""
    n = np.arange(120)
    gamma = np.array([math.gamma(k / 2 + 1) for k in n])
    terms = (-1.0) ** n / gamma
    return [math.fsum(terms), -math.fsum(terms * n / 2)]


def slow_plate() -> list[float]:
    """Return int s^3 dt along Hertz's s'' = -s^(3/2), to and fro."""
    end, state = until(lambda t, y: [y[1], -(max(y[0], 0.0) ** 1.5), y[0] ** 3], [0, 1, 0], lambda t, y: y[0])
    assert end == pytest.approx(3.2180654597, rel=1e-9)
    return [float(state[2])]


def radiation(poisson: float) -> float:
    """Return Im of point compliance over omega, rho = c_s = 1: Lamb's slowness integral and its Rayleigh residue."""
    kappa2 = (1 - 2 * poisson) / (2 * (1 - poisson))

    def rate(x: float) -> float:
        a, b = np.emath.sqrt(x * x - kappa2), np.emath.sqrt(x * x - 1)
        return float((x * a / ((2 * x * x - 1) ** 2 - 4 * x * x * a * b)).imag)

    def rayleigh(x: float) -> float:
        return (2 * x * x - 1) ** 2 - 4 * x * x * math.sqrt((x * x - kappa2) * (x * x - 1))

    gamma, h = brentq(rayleigh, 1.01, 1.3, xtol=1e-15), 1e-5
    slope = (rayleigh(gamma + h) - rayleigh(gamma - h)) / (2 * h)
    body = quad(rate, 0, math.sqrt(kappa2))[0] + quad(rate, math.sqrt(kappa2), 1, limit=200)[0]
    return (body - math.pi * gamma * math.sqrt(gamma**2 - kappa2) / slope) / (2 * math.pi)


def propped_cantilever(spring: float) -> float:
    """Solve EI w'''' = -q, clamped at 0; w'' = 0, w''' = spring w at 1 (EI = q = L = 1): w = a x^2 + b x^3 - x^4/24."""
    _, b = np.linalg.solve([[2.0, 6.0], [1.0, 1.0 - 6.0 / spring]], [0.5, 1 / 24 - 1.0 / spring])
    return float(1 - 6 * b)


def two_supports() -> list[float]:
    """Return two supports' forces by flexibilities: a cantilever of length 2, held at x = 1 and 2, under q = 1."""
    at = np.array([1.0, 2.0])
    a, b = np.minimum.outer(at, at), np.maximum.outer(at, at)
    under_pressure = at**2 * (6 * 2.0**2 - 4 * 2.0 * at + at**2) / 24
    return list(np.linalg.solve(a**2 * (3 * b - a) / 6, under_pressure))


def clearance_period() -> list[float]:
    """Return the four equal quarters' time, each from the centre to rest in the spring."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -max(y[0] - 1.0, 0.0)]

    return [4 * until(rates, [0.0, 1.0], lambda t, y: y[1])[0]]


def lattice(impedances: tuple[float, float], delays: tuple[int, int]) -> list[float]:
    """Return impulse and restitution of free rods that meet at speed 1, by unit steps and two delay lines each."""
    lines = [np.zeros(d) for d in delays]
    velocities, impulse, forces = (-1.0, 0.0), 0.0, []
    z1, z2 = impedances
    for step in range(40):
        returned = [line[step % len(line)] for line in lines]
        upper, lower = velocities[0] + 2 * returned[0], velocities[1] - 2 * returned[1]
        force = max((lower - upper) / (1 / z1 + 1 / z2), 0.0)
        forces.append(force)
        impulse += force
        for line, back, z in zip(lines, returned, impedances, strict=True):
            line[step % len(line)] = back + force / z
    masses = [z * d / 2 for z, d in zip(impedances, delays, strict=True)]
    return [impulse * (1 / masses[0] + 1 / masses[1]) - 1.0, impulse, *forces]


def derived() -> dict[str, list[float]]:
    one, two, three = (lattice((1, 1), (4, 8)), lattice((1, 3), (4, 2)), lattice((1, 1e15), (4, 4)))
    return {
        "rod_fixed_1_6": mass_on_rod(1 / 6, -1.0),
        "rod_fixed_1_2": mass_on_rod(1 / 2, -1.0),
        "rod_fixed_2": mass_on_rod(2.0, -1.0),
        "rod_dashpot_1_2": mass_on_rod(1 / 2, -0.5),
        "rods_lengths": [one[0], one[1] / 4 * 2 / 0.5],
        "rods_impedances": [two[2 + 2], two[0]],
        "rod_wall": [2.0 * np.count_nonzero(np.array(three[2:]) > 1e-9) / 4, three[2]],
        "soft_tip": soft_tip(),
        "hunt_crossley": hunt_crossley(),
        "pad": pad(),
        "falling_weight": [deepest(4.0), in_contact(4.0)],
        "laid_weight": [deepest(0.0)],
        "chain": chain(),
        "pressed_reed": [propped_cantilever(math.inf), propped_cantilever(3.0)],
        "two_supports": two_supports(),
        "clearance": clearance_period(),
        "infinite_beam": infinite_beam(),
        "slow_plate": slow_plate(),
        "slow_half_space": [radiation(0.25) / RADIATION],
    }


DERIVED = derived()


@pytest.mark.parametrize("entry", ENTRIES, ids=[entry["id"] for entry in ENTRIES])
def test_value_is_derived_and_claimed(entry: dict[str, object]) -> None:
    np.testing.assert_allclose(DERIVED[entry["id"]], entry["value"], rtol=entry["rtol"])
    assert 0 < entry["rtol"] < 1e-6
    assert entry["source"]
    for quantity, value in zip(entry["quantity"], entry["value"], strict=True):
        assert CASES[entry["case"], quantity].exact == pytest.approx(value, rel=1e-9)


def test_every_derivation_is_used() -> None:
    assert {entry["id"] for entry in ENTRIES} == set(DERIVED)
    assert len(ENTRIES) >= 10


def test_light_rod_is_a_spring() -> None:
    """Contact lasts half a period on K = E A/l with a third of the rod's mass added (Rayleigh) as alpha -> 0."""
    alpha = 0.01
    end, _, _ = mass_on_rod(alpha, -1.0)
    assert end == pytest.approx(math.pi * math.sqrt((1 + alpha / 3) / alpha), rel=2e-2)
