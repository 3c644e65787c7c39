"""Reeds: contact points, what the modes leave out, release."""

import numpy as np
import pytest

import impact
from impact.beams.euler_bernoulli import Cantilever, ClampedClamped, RectangularBeam, TipMassCantilever
from impact.beams.timoshenko import TimoshenkoCantilever
from impact.bodies.reeds import GivenShape, ModeShape, StaticShape, cantilever_reed, reed
from impact.greens.base import GreensFunctionError
from impact.greens.modal import ModalGreens

REED = {"young": 2e11, "density": 7850.0, "length": 25.4e-3, "width": 10e-3, "thickness": 0.305e-3}
SQUAT = {**REED, "thickness": 25.4e-3}
L = REED["length"]
BEAMS = [
    Cantilever(**REED),
    TipMassCantilever(**REED, tip_mass=2e-4),
    ClampedClamped(**REED),
    TimoshenkoCantilever(**REED),
    TimoshenkoCantilever(**SQUAT),
]
NAMES = [f"{b.family} {i}" for i, b in enumerate(BEAMS)]


@pytest.mark.parametrize("beam", BEAMS, ids=NAMES)
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


@pytest.mark.parametrize("beam", BEAMS, ids=NAMES)
def test_static_release(beam: RectangularBeam) -> None:
    at = 0.7 * L
    body = reed(beam, n_modes=300, contact_at=(at, 0.4 * L), release=StaticShape(1e-3, at=at))
    compliance = beam.compliance(at, at)
    # the modes left out: n^-3 of an Euler-Bernoulli beam, 1/n with shear
    tolerance = 1e-2 if beam.thickness == SQUAT["thickness"] else 1e-6
    assert energies(body) == pytest.approx((0.5 * 1e-6 / compliance, 0.0), rel=tolerance)
    seen = body.greens.shapes.T @ body.state.displacement
    np.testing.assert_allclose(seen, [1e-3, 1e-3 * beam.compliance(0.4 * L, at) / compliance], rtol=tolerance)


def test_mode_release() -> None:
    beam = ClampedClamped(**REED)
    body = reed(beam, n_modes=5, contact_at=0.25 * L, release=ModeShape(2, -2e-4, at=0.25 * L))
    assert float(body.greens.shapes[:, 0] @ body.state.displacement) == pytest.approx(-2e-4, rel=1e-14)
    assert np.count_nonzero(body.state.displacement) == 1
    assert body.state.displacement[1] != 0


@pytest.mark.parametrize("beam", BEAMS, ids=NAMES)
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
        (lambda: reed(ClampedClamped(**REED), contact_at=L), "at a clamp"),
        (lambda: reed(BEAMS[0], contact_at=(0.01, 0.03)), "contact_at = 0.03 m"),
        (lambda: reed(BEAMS[0], contact_at=(0.01, 0.01)), "names a point twice"),
        (lambda: reed(BEAMS[0], contact_at=()), "contact_at is empty"),
        (lambda: reed(BEAMS[0], contact_at=float("nan")), "off the reed"),
        (lambda: reed(BEAMS[0], contact_at=0.0), "contact_at = 0 m.*reed"),
        (lambda: reed(BEAMS[0], n_modes=0), "n_modes = 0"),
        (lambda: reed(BEAMS[0], damping_ratio=-0.1), "damping_ratio = -0.1"),
        (lambda: reed(BEAMS[0], damping_ratio=float("inf")), "damping_ratio = inf"),
        (lambda: reed(BEAMS[0], release=ModeShape(41, 1e-3)), "mode 41:.*1..40"),
        (lambda: reed(BEAMS[2], release=ModeShape(2, 1e-3)), "mode 2 has a node at 0.0127 m"),
        (lambda: reed(BEAMS[0], release=StaticShape(float("nan"))), "deflection = nan"),
        (lambda: reed(BEAMS[0], release=StaticShape(1e-3, at=-1.0)), "release.*-1 m"),
        (lambda: reed(BEAMS[0], release=GivenShape(lambda x: np.nan * x)), "must be finite"),
        (lambda: cantilever_reed(**REED, tip_deflection=1e-3, release=ModeShape(1, 1e-3)), "not both"),
    ],
)
def test_impossible_reeds_are_refused(call: object, words: str) -> None:
    with pytest.raises(GreensFunctionError, match=words):
        call()
