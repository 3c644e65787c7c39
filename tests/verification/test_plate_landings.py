"""Plates land: against finite elements marched as they are, against beams, and the same on both sides."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import impact
from impact.after.histories import largest_average
from impact.beams.timoshenko import TimoshenkoCantilever
from impact.greens.modal import ModalGreens
from seatfem.structures.elements.mindlin import assemble_plate
from seatfem.structures.lip import Lip, Patch
from seatfem.structures.materials import Material
from seatfem.structures.method import Aims, bed
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.modal import with_modes
from seatfem.structures.reduction.modes import Modes, solve_modes
from seatfem.structures.rings import Division
from tests.brute_force import marched
from tests.plate_model import grid

STEEL = Material(206e9, 0.3, 7800.0)
SIDES, H = (18e-3, 12e-3), 0.4e-3
CENTRE = (12e-3, 6e-3)
LIP = Lip(4e-3, 0.8e-3, 8)
SPEED, GAP = 2.0, 1e-6
DT, DURATION = 5e-8, 2e-4
BED = 2e7


def plate(h: float = H, clamped: tuple[str, ...] = ("left",), material: Material = STEEL) -> SecondOrderModel:
    return assemble_plate(grid((9, 6), SIDES), material, h, clamped=clamped, ports=LIP.patches(CENTRE))


def seat() -> SecondOrderModel:
    return plate(1.5e-3, ("left", "right", "top", "bottom"))


@cache
def as_seat() -> ModalGreens:
    """Return the seat's response by modes up to 400 kHz."""
    return by_modes(seat(), 400e3, 130e3)[0]


def by_modes(model: SecondOrderModel, cutoff: float, band: float) -> tuple[ModalGreens, Modes]:
    """Return the response by modes up to a cutoff [Hz], and these modes."""
    modes = solve_modes(model, up_to_hz=cutoff)
    return with_modes(model, model.damping, modes, cutoff, Aims(band, 1e-4, 0.5), [0]), modes


@cache
def as_reed(cutoff: float) -> tuple[ModalGreens, Modes]:
    return by_modes(plate(), cutoff, cutoff / 3)


def openings(tilt: float, axis: float) -> np.ndarray:
    """Return the openings of a tilted lip [m] at the middles of its arcs."""
    rise = LIP.radius * math.tan(math.radians(tilt)) * np.sin(LIP.angles - axis)
    return np.asarray(GAP + rise - rise.min())


def by_greens(seat: ModalGreens, gaps: np.ndarray, cutoff: float, dt: float = DT):
    """Run the plate by modes up to a cutoff [Hz], released with the velocity of the first one."""
    greens, modes = as_reed(cutoff)
    rate = np.zeros(len(modes.omega))
    rate[0] = -SPEED / greens.shapes[0].mean()
    state = impact.ModalState(np.zeros_like(rate), rate)
    striker, target = impact.Body(greens, state=state), impact.Body(seat)
    contacts = [impact.Contact(target, port=k, gap=float(gap), striker_port=k) for k, gap in enumerate(gaps)]
    result = impact.solve(impact.ContactProblem(striker, contacts=contacts), dt=dt, duration=DURATION)
    return result, modes.shapes[:, 0] * rate[0]


def impulse_and_peak(force: np.ndarray, dt: float) -> tuple[float, float]:
    total = force.sum(axis=1)
    return float(total.sum() * dt), largest_average(total, dt, 5e-6)


TILTS = [(0.0, 0.0), (0.2, 0.0), (-0.2, math.pi / 2)]


def course(force: np.ndarray, dt: float) -> np.ndarray:
    """Return (400,) the impulse up to every half microsecond [N s]."""
    every = round(5e-7 / dt)
    return np.asarray(np.cumsum(force.sum(axis=1))[every - 1 :: every] * dt)


@pytest.mark.slow
@pytest.mark.parametrize(("tilt", "axis"), TILTS)
def test_a_landing_on_a_bed_of_springs_is_that_of_its_matrices(tilt: float, axis: float) -> None:
    """Modes up to 400 kHz and their residual have the impulse at all times and the mean force of 5 us of all unknowns
    to 0.3 % (measured), at a step ten times shorter. A plate 3 % heavier or stiffer lands otherwise by 0.8 % of the
    impulse and more."""
    gaps, dt = openings(tilt, axis), 1.25e-7
    landing, start = by_greens(bed(Division(8), 8 * BED), gaps, 400e3, dt / 10)
    computed, close = course(landing.force[1:], dt / 10), 0.005

    def by_matrices(material: Material) -> np.ndarray:
        return marched([plate(material=material)], start, gaps, dt, DURATION, BED)

    right = by_matrices(STEEL)
    assert np.abs(course(right, dt) - computed).max() < close * computed[-1]
    assert impulse_and_peak(landing.force[1:], dt / 10)[1] == pytest.approx(impulse_and_peak(right, dt)[1], rel=close)
    for other in (replace(STEEL, density=1.03 * STEEL.density), replace(STEEL, young=1.03 * STEEL.young)):
        assert np.abs(course(by_matrices(other), dt) - computed).max() > close * computed[-1]


@pytest.mark.slow
def test_two_plates_collide_as_their_matrices_do() -> None:
    """A reed and a clamped plate of 1.5 mm under Signorini's condition in each arc collide by modes as by all unknowns:
    impulses to 0.5 % (measured), means over 5 us to 1.6 %, as a step of 0.2 us does not resolve how a clamped plate
    answers at once."""
    gaps = openings(0.2, 0.0)
    landing, start = by_greens(as_seat(), gaps, 400e3)
    assert landing.energy.residual < 1e-9
    impulse, peak = impulse_and_peak(landing.force[1:], DT)
    right = impulse_and_peak(marched([plate(), seat()], start, gaps, 2e-7, DURATION), 2e-7)
    assert impulse == pytest.approx(right[0], rel=0.01)
    assert peak == pytest.approx(right[1], rel=0.025)


STRIP = {"length": 25.4e-3, "width": 2e-3, "thickness": 0.4e-3}


def test_a_strip_lands_as_a_beam() -> None:
    """A strip of L/13 without contraction across, nu = 0: with it, its root would be stiffer than a beam's. Struck on
    a line across its tip, it does not twist. 16 modes of bending lie below 400 kHz; on a spring that they resolve the
    force, averaged over 10 us, differs by 0.3 % of its largest."""
    material, length, width, h = Material(206e9, 0.0, 7800.0), *STRIP.values()
    beam = TimoshenkoCantilever(206e9, 7800.0, **STRIP, poisson=0.0)
    across, weights = np.polynomial.legendre.leggauss(6)
    line = Patch(np.stack([np.full(6, length), width / 2 * (1 + across)], axis=1), weights)
    model = assemble_plate(grid((100, 1), (length, width)), material, h, clamped="left", ports={"contact": line})
    greens, modes = by_modes(model, 400e3, 130e3)
    bends = np.abs(greens.shapes[:, 0]) > 1e-6 * np.abs(greens.shapes).max()
    assert modes.omega[bends] == pytest.approx(beam.frequencies(int(bends.sum())), rel=3e-4)
    rate = np.zeros(len(modes.omega))
    rate[0] = -SPEED / greens.shapes[0, 0]
    as_plate = impact.Body(greens, state=impact.ModalState(np.zeros_like(rate), rate))
    as_beam = impact.reed(beam, n_modes=int(bends.sum()), release=impact.ModeShape(1, velocity=-SPEED))
    one, other = (
        impact.solve(impact.ContactProblem(body, impact.spring(stiffness=2e5), gap=GAP), dt=1e-7, duration=1e-3).force[
            1:
        ]
        for body in (as_plate, as_beam)
    )
    assert one.sum() == pytest.approx(other.sum(), rel=1e-3)
    means = [np.convolve(force, np.full(100, 1 / 100), "same") for force in (one, other)]
    assert np.abs(means[0] - means[1]).max() < 0.01 * means[1].max()
