"""Closed forms behind the finite element cases, each by another way than the literature's table or the case itself."""

import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from scipy.special import iv, ivp, jv, jvp, kv, kvp, yv, yvp

from seatfem.structures.model import Material
from tests.known_answers.round_bars import bar_frequency
from tests.known_answers.solids import bending_frequency, tube_widening
from tests.known_answers.spheres import sphere_frequency

ENTRIES = {entry["id"]: entry for entry in json.loads(Path(__file__).with_name("finite_elements.json").read_text())}
NU = 0.3
ROUND = {
    "circ_plate_C_nu0.3": ("C", "", 0.0),
    "circ_plate_S_nu0.3": ("S", "", 0.0),
    "annular_FF_0.5": ("F", "F", 0.5),
    "annular_CC_0.5": ("C", "C", 0.5),
    "annular_SF_0.5": ("S", "F", 0.5),
}


def rows(edge: str, n: int, k: float, r: float, solutions: int) -> list[list[float]]:
    """Return the two conditions of an edge at r for w = Z_n(k r) cos n th, one column per Z: J, I, Y, K.

    Of Z'' only the sign in Z'' = -Z'/x -/+ (1 -/+ n^2/x^2) Z matters: laplace w = -/+ k^2 w.
    """
    x, sign = k * r, np.array([-1.0, 1.0, -1.0, 1.0])[:solutions]
    value = np.array([jv(n, x), iv(n, x), yv(n, x), kv(n, x)][:solutions])
    slope = k * np.array([jvp(n, x), ivp(n, x), yvp(n, x), kvp(n, x)][:solutions])
    laplace = sign * k**2 * value
    twist = slope / r - n**2 * value / r**2
    moment = laplace - (1 - NU) * twist
    shear = sign * k**2 * slope - (1 - NU) * n**2 / r**2 * (slope - value / r)
    pairs = {"C": (value, slope), "S": (value, moment), "F": (moment, shear)}
    return [list(row) for row in pairs[edge]]


def determinant(outer: str, inner: str, hole: float, n: int, k: float) -> float:
    matrix = rows(outer, n, k, 1.0, 4 if inner else 2) + (rows(inner, n, k, hole, 4) if inner else [])
    a = np.array(matrix)
    a /= np.abs(a).max(axis=1, keepdims=True)
    return float(np.linalg.det(a / np.abs(a).max(axis=0)))


@pytest.mark.slow(but="circ_plate_C_nu0.3")
@pytest.mark.parametrize("name", ROUND)
def test_round_plates_have_the_roots_of_the_bessel_determinant(name: str) -> None:
    grid = np.arange(1.5, 16.5, 0.05)
    for n in range(4):
        signs = [determinant(*ROUND[name], n, k) for k in grid]
        roots = [
            brentq(lambda k, n=n: determinant(*ROUND[name], n, k), a, b) ** 2
            for (a, b), (f, g) in zip(itertools.pairwise(grid), itertools.pairwise(signs), strict=True)
            if f * g < 0
        ]
        for key, value in ENTRIES[name]["value"].items():
            diameters, mode = map(int, key.split(","))
            if diameters == n:
                assert roots[mode - 1] == pytest.approx(value, rel=ENTRIES[name]["rtol"])


@pytest.mark.parametrize(
    ("kind", "bounds", "printed"), [("torsional", (2.0, 3.0), 2.501), ("spheroidal", (2.3, 3.0), 2.640)]
)
def test_sphere_of_degree_two(kind: str, bounds: tuple[float, float], printed: float) -> None:
    """Sato & Usami 1962 print 2.501 and, for nu = 1/4, 2.640."""
    assert sphere_frequency(kind, *bounds, poisson=0.25) == pytest.approx(printed, abs=5e-4)


def test_breathing_sphere() -> None:
    speeds = math.sqrt((1 - 2 * NU) / (2 - 2 * NU))
    for value in ENTRIES["sphere_radial_nu0.3"]["value"]:
        x = value / speeds
        frequency = sphere_frequency("radial", 0.98 * x, 1.02 * x)
        assert frequency * speeds == pytest.approx(value, rel=1e-9)


def test_round_bar_is_rayleighs_for_long_waves_and_for_short_ones() -> None:
    """Long waves have c/c_0 = 1 - (nu k a)^2/4 to (k a)^4, short ones the surface wave's speed to 1/(k a)."""
    nu = 0.29
    for k in (0.05, 0.1):
        assert bar_frequency(k) / k == pytest.approx(1 - (nu * k) ** 2 / 4, abs=0.1 * k**4)
    assert bar_frequency(150.0) / 150.0 == pytest.approx(0.57640466, rel=0.2 / 150)


def test_tube_by_its_differential_equation() -> None:
    """The widening solves u'' + u'/r - u/r^2 = 0 with sigma_r = -p at the bore and 0 outside."""
    a, b = 1.0, 2.0
    lam, mu = NU / ((1 + NU) * (1 - 2 * NU)), 1 / (2 * (1 + NU))

    def stress(u: float, du: float, r: float) -> float:
        return (lam + 2 * mu) * du + lam * u / r

    solution = solve_bvp(
        lambda r, y: np.stack([y[1], y[0] / r**2 - y[1] / r]),
        lambda left, right: np.array([stress(*left, a) + 1.0, stress(*right, b)]),
        np.linspace(a, b, 20),
        np.ones((2, 20)),
        tol=1e-10,
    )
    assert solution.sol(a)[0] == pytest.approx(tube_widening(a, b, NU), rel=1e-8)


@pytest.mark.parametrize(("wave", "printed"), [((1, 1), 0.0932), ((1, 2), 0.2226), ((2, 2), 0.3421), ((1, 3), 0.4171)])
def test_thick_plate_of_srinivas(wave: tuple[int, int], printed: float) -> None:
    """w h (rho/G)^(1/2) is that of Srinivas, Rao & Joga Rao, J. Sound Vib. 12 (1970) 187, h/a = 0.1."""
    steel = Material(200e9, 0.3, 8000.0)
    frequency = bending_frequency(math.pi / 10 * math.hypot(*wave), 0.5, steel)
    assert 2 * math.pi * frequency / steel.c_s == pytest.approx(printed, abs=6e-5)
