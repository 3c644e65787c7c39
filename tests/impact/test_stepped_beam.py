"""Beams of varying width: against closed forms, against integration along the beam, by their order."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import impact
from impact.beams.stepped import SteppedCantilever
from impact.bodies.loads import Gravity, Pressure
from impact.bodies.reeds import reed
from impact.greens.base import GreensFunctionError
from seatfem.structures.shapes import Flapper
from tests.solids import Material, Sheet, plate_modes

MATERIAL = {"young": 206e9, "density": 7800.0}
L, H = 30e-3, 0.3e-3
UNIFORM = SteppedCantilever(**MATERIAL, thickness=H, widths=((0.0, 8e-3), (L, 8e-3)))
EXACT = impact.Cantilever(**MATERIAL, length=L, width=8e-3, thickness=H)
TAPERED = SteppedCantilever(**MATERIAL, thickness=H, widths=((0.0, 8e-3), (L, 2e-3)))
STEP = SteppedCantilever(**MATERIAL, thickness=H, widths=((0.0, 8e-3), (12e-3, 8e-3), (12e-3, 3e-3), (L, 3e-3)))
FLAPPER = Flapper(8e-3, 2e-3, 6e-3, 15e-3, 16e-3, H)


@pytest.mark.parametrize("n", [1, 40, 200])
def test_a_uniform_one_is_the_cantilever(n: int) -> None:
    """A uniform beam has the cantilever's frequencies to 1e-5, the first among 200 to 1e-12, and its reed the whole
    compliance."""
    assert UNIFORM.frequencies(n) == pytest.approx(EXACT.frequencies(n), rel=1e-5)
    assert UNIFORM.frequencies(n)[0] == pytest.approx(EXACT.frequencies(n)[0], rel=1e-12 if n > 1 else 1e-7)
    whole = reed(UNIFORM, damping_ratio=0.02, n_modes=n).greens.static_compliance()[0, 0]
    assert whole == pytest.approx(UNIFORM.compliance(L, L), rel=1e-6)


def shot(beam: SteppedCantilever, omega: float) -> float:
    """Return the determinant of moment and shear force at the free end of both motions that leave the clamp at rest."""
    rate = beam.density * beam.thickness * omega**2
    starts = np.array([[0, 0, 1, 0], [0, 0, 0, 1 / L]])
    ends = []
    for start in starts:
        y = start * beam.rigidity_at(0.0)
        for low, high in zip(beam.breaks, beam.breaks[1:], strict=False):
            span = high - low
            widths = beam.width_at(np.array([low + 1e-9 * span, high - 1e-9 * span]))

            def slope(x: float, y: np.ndarray, low: float = low, span: float = span, w: np.ndarray = widths) -> list:
                b = w[0] + (w[1] - w[0]) * (x - low) / span
                return [y[1], y[2] / (beam.young * beam.thickness**3 / 12 * b), y[3], rate * b * y[0]]

            y = solve_ivp(slope, (low, high), y, "DOP853", rtol=1e-11, atol=1e-14 * np.abs(y).max()).y[:, -1]
        ends.append(y)
    return float(ends[0][2] * ends[1][3] - ends[1][2] * ends[0][3])


@pytest.mark.parametrize("beam", [TAPERED, STEP])
def test_frequencies_by_integration_along_the_beam(beam: SteppedCantilever) -> None:
    """The free end's determinant by Runge-Kutta, without elements, vanishes within 1e-6 of each frequency."""
    for omega in beam.frequencies(3):
        root = brentq(lambda w: shot(beam, w), 0.98 * omega, 1.02 * omega, xtol=1e-9 * omega)
        assert omega == pytest.approx(root, rel=1e-6)


def wedge(square: float) -> float:
    """Return 0 where the pointed beam (x w'')'' = w^2 x w, x from its tip, is clamped at x = 1: power series in x,
    those that leave the tip without moment and force begin with 1 and with x."""
    value, slope = np.zeros(2), np.zeros(2)
    for k in (0, 1):
        term, power = 1.0, k
        while abs(term) > 1e-18 or power < 8:
            value[k] += term
            slope[k] += power * term
            term *= square / ((power + 4) * (power + 3) ** 2 * (power + 2))
            power += 4
    return float(value[0] * slope[1] - value[1] * slope[0])


def test_a_width_that_vanishes_at_the_tip() -> None:
    beam = SteppedCantilever(**MATERIAL, thickness=H, widths=((0.0, 8e-3), (L, 0.0)))
    for value in (beam.frequencies(3) / EXACT.frequency_scale) ** 2:
        assert value == pytest.approx(brentq(wedge, 0.97 * value, 1.03 * value), rel=1e-6)
    assert beam.mass == pytest.approx(EXACT.mass / 2)


def test_static_compliance_with_the_residual() -> None:
    """The compliance of contacts on both sides of the step is the beam's, by quadrature of M m/EI."""
    at = (5e-3, 12e-3, 20e-3, L)
    greens = reed(STEP, n_modes=8, contact_at=at).greens
    ds = L / 200000
    s = ds * (np.arange(200000) + 0.5)
    moments = np.maximum(np.array(at)[:, None] - s, 0)
    expected = moments @ (moments / STEP.rigidity_at(s) * ds).T
    assert greens.static_compliance() == pytest.approx(expected, rel=1e-4)
    assert np.linalg.eigvalsh(greens.residual.static())[0] >= 0


@pytest.mark.slow
@pytest.mark.parametrize("beam", [TAPERED, STEP])
def test_pressure_and_gravity_act_where_it_is_wide(beam: SteppedCantilever) -> None:
    """The tip's deflection under p b(x) and g rho h b(x), by modes, is the compliance's integral."""
    modes = beam.modes(20)
    s, ds = np.linspace(0, L, 2001)[:-1] + L / 4000, L / 2000
    per_width = sum(beam.compliance(L, float(x)) * float(beam.width_at(x)) * ds for x in s)
    tip = modes.deflection(L) / modes.omega**2
    for load, per_area in ((Pressure(lambda t: 100.0 + 0 * t), 100.0), (Gravity(-9.81), -9.81 * 7800.0 * H)):
        (part,) = load.modal(modes)
        amplitude = float(part.amplitude(np.zeros(1))[0])
        assert amplitude * float(tip @ part.shape) == pytest.approx(per_area * per_width, rel=1e-4)
    assert modes.project(lambda x: np.ones_like(x)) @ modes.project(lambda x: np.ones_like(x)) < beam.mass
    (half,) = Pressure(lambda t: 0 * t + 1, between=(0.0, 12e-3)).modal(modes)
    assert half.amplitude(np.zeros(1))[0] * half.shape @ modes.project(lambda x: x**2) > 0


@pytest.mark.slow
def test_the_beam_that_stands_for_a_flapper() -> None:
    """The beam has 195.7 Hz to 0.1 % (the plate, whose root cannot bow, 196.6 Hz); with a slot it agrees with the plate
    to 1.5 %."""
    beams = [SteppedCantilever(**MATERIAL, thickness=H, widths=FLAPPER.widths(n)) for n in (30, 60)]
    first = [beam.frequencies(10)[0] / (2 * np.pi) for beam in beams]
    assert first == pytest.approx([195.7, 195.7], rel=1e-3)
    assert beams[1].mass == pytest.approx(7800.0 * H * FLAPPER.area, rel=1e-4)
    slotted = Flapper(8e-3, 2e-3, 6e-3, 15e-3, 16e-3, H, slot_width=2e-3, slot_length=8e-3)
    plate = plate_modes(Sheet(slotted, Material(206e9, 0.3, 7800.0), 10e3)).modes.frequencies_hz[0]
    beam = SteppedCantilever(**MATERIAL, thickness=H, widths=slotted.widths(30)).frequencies(10)[0] / (2 * np.pi)
    assert beam == pytest.approx(plate, rel=0.015)


@pytest.mark.parametrize(
    ("widths", "message"),
    [
        (((0.0, 8e-3),), "give two finite pairs"),
        (((0.0, 8e-3), (np.nan, 8e-3)), "give two finite pairs"),
        (((1e-3, 8e-3), (L, 8e-3)), "positions must rise from 0"),
        (((0.0, 8e-3), (L, 8e-3), (20e-3, 8e-3)), "positions must rise from 0"),
        (((0.0, 8e-3), (L, 8e-3), (L, 4e-3)), "positions must rise from 0"),
        (((0.0, 8e-3), (9e-3, 8e-3), (9e-3, 4e-3), (9e-3, 2e-3), (L, 2e-3)), "three times"),
        (((0.0, 0.0), (L, 8e-3)), "positive.*0"),
        (((0.0, 8e-3), (L, -1e-3)), "positive.*0"),
    ],
)
def test_what_is_no_beam_is_refused(widths: tuple[tuple[float, float], ...], message: str) -> None:
    with pytest.raises(GreensFunctionError, match=message):
        SteppedCantilever(**MATERIAL, thickness=H, widths=widths)
    with pytest.raises(GreensFunctionError, match="outside the beam"):
        TAPERED.modes(3).deflection(np.array([0.0, 31e-3]))
