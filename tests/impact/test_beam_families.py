"""Every family of beams against spectral Galerkin solutions, which share only the energies with the closed forms."""

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.linalg import eigh

from impact.beams.euler_bernoulli import Cantilever, ClampedClamped, RectangularBeam, TipMassCantilever, gauss
from impact.beams.timoshenko import TimoshenkoCantilever
from impact.greens.base import GreensFunctionError

REED = {"young": 2e11, "density": 7850.0, "length": 25.4e-3, "width": 10e-3, "thickness": 0.305e-3}
STUBBY = {**REED, "thickness": 2.54e-3}  # L/h = 10: mode 14 is above the cutoff
SQUAT = {**REED, "thickness": 25.4e-3}  # L/h = 1: nearly all modes are
BEAMS = [
    Cantilever(**REED),
    *(TipMassCantilever(**REED, tip_mass=ratio * Cantilever(**REED).mass) for ratio in (1e-3, 0.3, 1.0, 30.0)),
    ClampedClamped(**REED),
    TimoshenkoCantilever(**REED),
    TimoshenkoCantilever(**STUBBY),
    TimoshenkoCantilever(**SQUAT, poisson=0.2, shear_factor=0.85),
]
NAMES = [f"{b.family} {i}" for i, b in enumerate(BEAMS)]


def polynomials(xi: np.ndarray, size: int, envelope: np.polynomial.Polynomial) -> list[np.ndarray]:
    """Return the envelope times Legendre polynomials of 2 xi - 1 and two derivatives, each (size, G)."""
    out = [np.zeros((size, len(xi))) for _ in range(3)]
    e = [envelope.deriv(k)(xi) if k else envelope(xi) for k in range(3)]
    for j in range(size):
        p = [legendre.legval(2 * xi - 1, legendre.legder(np.eye(size)[j], k)) * 2**k for k in range(3)]
        out[0][j] = e[0] * p[0]
        out[1][j] = e[1] * p[0] + e[0] * p[1]
        out[2][j] = e[2] * p[0] + 2 * e[1] * p[1] + e[0] * p[2]
    return out


def galerkin(beam: RectangularBeam, size: int) -> np.ndarray:
    """Return angular frequencies from the energies, with polynomials that meet the clamps."""
    x, weights = gauss(0.0, 1.0, size)
    length = beam.length
    if isinstance(beam, TimoshenkoCantilever):
        (w, dw, _), zero = polynomials(x, size, np.polynomial.Polynomial([0, 1])), np.zeros((size, len(x)))
        deflection, slope = np.vstack([w * length, zero]), np.vstack([dw, zero])  # [w; psi], psi = basis
        psi, curvature = np.vstack([zero, w]), np.vstack([zero, dw / length])
        shear = slope - psi
        mass = beam.line_density * (deflection * weights) @ deflection.T + beam.line_inertia * (psi * weights) @ psi.T
        stiffness = beam.rigidity * (curvature * weights) @ curvature.T
        stiffness += beam.shear_rigidity * (shear * weights) @ shear.T
        return np.sqrt(eigh(stiffness, mass, eigvals_only=True))
    both = isinstance(beam, ClampedClamped)
    envelope = np.polynomial.Polynomial([0, 0, 1, -2, 1] if both else [0, 0, 1])
    w, _, curvature = polynomials(x, size, envelope)
    mass = beam.mass * (w * weights) @ w.T
    if isinstance(beam, TipMassCantilever):
        tip = polynomials(np.ones(1), size, envelope)[0]
        mass += beam.tip_mass * tip @ tip.T
    stiffness = beam.rigidity / length**3 * (curvature * weights) @ curvature.T
    return np.sqrt(eigh(stiffness, mass, eigvals_only=True))


@pytest.mark.parametrize("beam", BEAMS, ids=NAMES)
def test_frequencies(beam: RectangularBeam) -> None:
    timoshenko = isinstance(beam, TimoshenkoCantilever)
    slender = beam.thickness < 1e-3
    size, modes = (60, 20 if slender else 40) if timoshenko else (28, 10)
    ours, theirs = beam.modes(modes).omega, galerkin(beam, size)
    # round-off of the polynomial basis: eps times the largest eigenvalue, on omega^2
    floor = 1e-15 * theirs[-1] ** 2 / theirs[:modes] ** 2
    assert np.all(np.abs(ours / theirs[:modes] - 1) < 1e-8 + floor)
    assert floor[1] < 1e-2  # the check bites from the second mode on at the latest
    if timoshenko and not slender:
        assert ours[-1] > 1.5 * beam.cutoff


@pytest.mark.parametrize("beam", BEAMS, ids=NAMES)
def test_modes_sum_to_the_static_compliance(beam: RectangularBeam) -> None:
    """The share left out by n modes falls like n^-3 (a force on an Euler-Bernoulli beam) or 1/n (shear)."""
    places = np.array([0.31, 0.5, 0.77, 1.0]) * beam.length
    exact = np.array([[beam.compliance(x, y) for y in places] for x in places])
    np.testing.assert_array_equal(exact, exact.T)
    shares = {}
    for n in (60, 240):
        modes = beam.modes(n)
        scaled = modes.deflection(places) / modes.omega[:, None]
        rest = exact - scaled.T @ scaled
        assert np.linalg.eigvalsh(rest)[0] > -1e-14 * np.trace(exact)
        shares[n] = np.trace(rest[:3, :3]) / np.trace(exact)  # without the tip, where a mass makes it fall faster
    if not isinstance(beam, TimoshenkoCantilever):
        assert shares[60] < 1e-5
        assert np.log(shares[60] / shares[240]) / np.log(4) == pytest.approx(3, abs=0.15)
    elif beam.thickness > 1e-3:  # the slender one is still below its cutoff, on its way from 3 to 1
        assert shares[60] < 2e-2
        assert np.log(shares[60] / shares[240]) / np.log(4) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("thickness", [25.4e-6, 0.305e-3, 2.54e-3, 25.4e-3, 254e-3])
def test_no_timoshenko_mode_is_missed(thickness: float) -> None:
    beam = TimoshenkoCantilever(**{**REED, "thickness": thickness})
    omega = beam.frequencies(200)
    assert np.all(np.diff(omega) > 0)
    between = np.sqrt(omega[:-1] * omega[1:])
    np.testing.assert_array_equal(beam.count_below(between), np.arange(1, 200))


@pytest.mark.parametrize("side", [-1e-3, -1e-9, -1e-13, 0.0, 1e-13, 1e-9, 1e-3])
def test_a_mode_at_the_cutoff_keeps_its_digits(side: float) -> None:
    """The thickness is tuned so that a mode stands at the cutoff, where one wave number vanishes."""
    low, high = 2.4e-3, 2.7e-3

    def below(thickness: float) -> int:
        beam = TimoshenkoCantilever(**{**REED, "thickness": thickness})
        return int(beam.count_below(np.array([beam.cutoff]))[0])

    start = below(low)
    assert start != below(high)
    while (middle := (low + high) / 2) not in (low, high):
        low, high = (middle, high) if below(middle) == start else (low, middle)
    beam = TimoshenkoCantilever(**{**REED, "thickness": middle * (1 + side)})
    modes = beam.modes(20)
    assert np.min(np.abs(modes.omega / beam.cutoff - 1)) < max(2 * abs(side), 1e-12)
    x, weights = gauss(0.0, beam.length, 40)
    w, psi = modes.deflection(x), modes.rotation(x)
    gram = beam.line_density * (w * weights) @ w.T + beam.line_inertia * (psi * weights) @ psi.T
    # next to the cutoff a wave number is known to the root of eps only, and with it the shape
    np.testing.assert_allclose(gram, np.eye(20), atol=1e-7)
    tight = TimoshenkoCantilever(**{**REED, "thickness": middle}).frequencies(20)
    np.testing.assert_allclose(modes.omega, tight, rtol=2 * abs(side) + 1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: TipMassCantilever(**REED, tip_mass=0.0), "cantilever tip_mass = 0"),
        (lambda: TimoshenkoCantilever(**REED, poisson=0.7), "poisson = 0.7 is outside"),
        (lambda: TimoshenkoCantilever(**REED, shear_factor=-1.0), "shear_factor = -1"),
        (lambda: ClampedClamped(**{**REED, "width": 0.0}), "clamped-clamped beam width = 0"),
        (lambda: TimoshenkoCantilever(**REED).modes(2).deflection(0.03), "position 0.03 m is outside"),
    ],
)
def test_impossible_beams_are_refused(make: object, words: str) -> None:
    with pytest.raises(GreensFunctionError, match=words):
        make()
