"""Beams against spectral Galerkin solutions, which share only the energies with closed forms; reeds made of them."""

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.linalg import eigh

import impact
from impact.beams.euler_bernoulli import Cantilever, ClampedClamped, RectangularBeam, TipMassCantilever, gauss
from impact.beams.timoshenko import TimoshenkoCantilever
from impact.bodies.reeds import GivenShape, ModeShape, StaticShape, cantilever_reed, reed
from impact.greens.base import GreensFunctionError
from impact.greens.modal import ModalGreens

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


L = REED["length"]
REEDS = [
    Cantilever(**REED),
    TipMassCantilever(**REED, tip_mass=2e-4),
    ClampedClamped(**REED),
    TimoshenkoCantilever(**REED),
    TimoshenkoCantilever(**SQUAT),
]
REED_NAMES = [f"{b.family} {i}" for i, b in enumerate(REEDS)]


@pytest.mark.parametrize("beam", REEDS, ids=REED_NAMES)
@pytest.mark.parametrize("at", [(0.4,), (0.3, 0.6, 0.9), (0.5, 0.500001), tuple(np.linspace(0.05, 0.95, 24))])
def test_contact_points_have_the_exact_static_compliance(beam: RectangularBeam, at: tuple[float, ...]) -> None:
    places = tuple(x * L for x in at)
    greens = reed(beam, n_modes=12, contact_at=places).greens
    assert greens.ports == (("contact",) if len(at) == 1 else tuple(f"contact_{i + 1}" for i in range(len(at))))
    exact = np.array([[beam.compliance(x, y) for y in places] for x in places])
    np.testing.assert_allclose(greens.static_compliance(), exact, atol=1e-9 * exact.max())
    left_out = greens.residual.static()
    np.testing.assert_allclose(left_out, left_out.T, atol=1e-16 * exact.max())
    assert np.linalg.eigvalsh(left_out)[0] >= -1e-16 * exact.max()


@pytest.mark.slow(but="0.1-0.6")
@pytest.mark.parametrize(("at", "waves"), [(1.0, 1), (0.6, 2)])
@pytest.mark.parametrize("zeta", [0.0, 0.1])
def test_timoshenko_starts_with_its_shear_wave_impedance(at: float, waves: int, zeta: float) -> None:
    """g(0+) is the continuum's, and that of 600 modes extrapolated to t = 0."""
    beam = TimoshenkoCantilever(**SQUAT)
    greens = reed(beam, contact_at=at * L, damping_ratio=zeta, n_modes=30).greens
    start = greens.initial_value()[0, 0]
    if zeta == 0.0:
        shear_modulus = 2e11 / 2.6
        assert start == pytest.approx(1 / (waves * beam.area * np.sqrt(5 / 6 * shear_modulus * 7850)), rel=1e-12)
    many = reed(beam, contact_at=at * L, damping_ratio=zeta, n_modes=600).greens
    # at these times the modes left out have followed statically, whatever way
    left_out = impact.Residual.spring(many.residual.static())
    bare = ModalGreens(many.omega, many.zeta, many.shapes, left_out)
    speed = np.sqrt(beam.shear_rigidity / beam.line_density)
    t = np.array([0.04, 0.08]) * L / speed
    seen = bare.step_response(t) / t  # mean of g over 0..t, linear in t before the first reflection
    # 600 modes and t^2 terms: 0.24 % seen
    assert 2 * seen[0] - seen[1] == pytest.approx(start, rel=5e-3)


def energies(body: impact.Body) -> tuple[float, float]:
    state, omega = body.state, body.greens.omega
    return 0.5 * float(np.sum((omega * state.displacement) ** 2)), 0.5 * float(np.sum(state.velocity**2))


@pytest.mark.parametrize("beam", REEDS, ids=REED_NAMES)
def test_static_release(beam: RectangularBeam) -> None:
    at = 0.7 * L
    body = reed(beam, n_modes=300, contact_at=(at, 0.4 * L), release=StaticShape(1e-3, at=at))
    compliance = beam.compliance(at, at)
    # the modes left out: n^-3 of an Euler-Bernoulli beam, 1/n with shear
    tolerance = 1e-2 if beam.thickness == SQUAT["thickness"] else 1e-6
    assert energies(body) == pytest.approx((0.5 * 1e-6 / compliance, 0.0), rel=tolerance)
    seen = body.greens.shapes.T @ body.state.displacement
    np.testing.assert_allclose(seen, [1e-3, 1e-3 * beam.compliance(0.4 * L, at) / compliance], rtol=tolerance)


@pytest.mark.parametrize("beam", REEDS, ids=REED_NAMES)
def test_a_given_mode_is_found_again(beam: RectangularBeam) -> None:
    """A mode's shape gives that mode, exactly without shear and to (h/L)^2 in a slender reed with shear."""
    modes = beam.modes(8)
    shape = GivenShape(shape=lambda x: modes.deflection(x)[2], velocity=lambda x: -3 * modes.deflection(x)[5])
    state = reed(beam, n_modes=8, release=shape).state
    error = max(abs(state.displacement - np.eye(8)[2]).max(), abs(state.velocity + 3 * np.eye(8)[5]).max())
    if not isinstance(beam, TimoshenkoCantilever):
        assert error < 1e-12
    elif beam.thickness < 1e-3:
        assert error < 1e-3


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: TimoshenkoCantilever(**REED, poisson=0.7), "poisson = 0.7 is outside"),
        (lambda: TimoshenkoCantilever(**REED, shear_factor=-1.0), "shear_factor = -1"),
        (lambda: ClampedClamped(**{**REED, "width": 0.0}), "clamped-clamped beam width = 0"),
        (lambda: TimoshenkoCantilever(**REED).modes(2).deflection(0.03), "position 0.03 m is outside"),
        (lambda: reed(ClampedClamped(**REED), contact_at=L), "at a clamp"),
        (lambda: reed(REEDS[0], contact_at=(0.01, 0.03)), "contact_at = 0.03 m"),
        (lambda: reed(REEDS[0], contact_at=(0.01, 0.01)), "names a point twice"),
        (lambda: reed(REEDS[0], contact_at=()), "contact_at is empty"),
        (lambda: reed(REEDS[0], contact_at=float("nan")), "off the reed"),
        (lambda: reed(REEDS[0], damping_ratio=-0.1), "damping_ratio = -0.1"),
        (lambda: reed(REEDS[0], release=ModeShape(41, 1e-3)), "mode 41:.*1..40"),
        (lambda: reed(REEDS[2], release=ModeShape(2, 1e-3)), "mode 2 has a node at 0.0127 m"),
        (lambda: reed(REEDS[0], release=StaticShape(float("nan"))), "deflection = nan"),
        (lambda: reed(REEDS[0], release=StaticShape(1e-3, at=-1.0)), "release.*-1 m"),
        (lambda: reed(REEDS[0], release=GivenShape(lambda x: np.nan * x)), "must be finite"),
        (lambda: cantilever_reed(**REED, tip_deflection=1e-3, release=ModeShape(1, 1e-3)), "not both"),
    ],
)
def test_impossible_beams_and_reeds_are_refused(call: object, words: str) -> None:
    with pytest.raises(GreensFunctionError, match=words):
        call()
