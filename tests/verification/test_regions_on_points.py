"""Landings on whole regions by the independent program, benchmarks/points, against closed forms."""

import math

import numpy as np
import pytest
from points.march import Modes, PointForces, march_points
from points.outlines import Ring
from points.plate import Material
from points.region_landing import Fall, Fineness, march_region, measure_region, openings, reed_modes
from points.regions import KidneyLand, Region, RoundLand

STEEL = Material(206e9, 0.3, 7800.0)
STIFF = Material(206e13, 0.3, 7800.0)
KIDNEY = KidneyLand(4.5e-3, math.radians(75), 1.2e-3, 2.2e-3)


@pytest.mark.slow
def test_lowest_frequency_of_a_free_disc() -> None:
    """A thin disc's lowest pair has k^2 a^2 = 5.358 at nu = 0.3 (Leissa, Vibration of Plates, table 2.5)."""
    radius, h = 10e-3, 0.1e-3
    omega, _, _ = reed_modes(Ring(0.0, radius), STEEL, h, 6, 20e3)
    rigidity = math.sqrt(STEEL.young * h**2 / (12 * (1 - STEEL.poisson**2) * STEEL.density))
    assert np.all(omega[:3] < 1e-2 * omega[3])  # up and down, and two ways to tumble
    assert omega[3] == pytest.approx(5.358 * rigidity / radius**2, rel=1e-3)
    assert omega[4] == pytest.approx(omega[3], rel=1e-4)  # its pair


@pytest.mark.slow
@pytest.mark.parametrize("hole", [0.0, 1e-3])
def test_a_stiff_ring_rebounds_from_a_spring_like_a_mass(hole) -> None:
    """The ring has the impulse 2 m v and the peak v sqrt(k m), spread evenly along the land."""
    h, outer, speed, stiffness = 1e-3, 4e-3, 2.0, 1e7
    mass = STEEL.density * h * math.pi * (outer**2 - hole**2)
    period = 2 * math.pi * math.sqrt(mass / stiffness)
    land = RoundLand((0.0, 0.0), 2e-3, 3e-3)
    fall = Fall(1e-6, 0.0, 0.0, speed, stiffness, period, period / 500)
    fine = Fineness(16, 2, 4, 50e6, period / 4000)  # no elastic mode lies below this band
    marched, cells = march_region(Ring(hole, outer), STIFF, h, Region([land]), fall, fine)
    measured = measure_region(marched, cells, fall, fine.dt)
    peak = speed * math.sqrt(stiffness * mass)
    assert measured.impulse == pytest.approx(2 * mass * speed, rel=1e-4)
    assert measured.filtered_peak == pytest.approx(peak, rel=1e-4)
    assert measured.closing_speed == pytest.approx(speed, rel=1e-6)
    assert measured.line_force == pytest.approx(peak / (math.pi * 5e-3), rel=1e-3)


def test_a_mass_stays_on_a_rigid_point() -> None:
    """Forces ahead take all of its momentum and throw nothing back."""
    modes = Modes(np.zeros(1), np.zeros(1), np.array([[1 / math.sqrt(2.0)]]))  # of 2 kg
    forces = PointForces(np.array([1e14]), modes.step_compliance(1e-4), ahead=True)
    marched = march_points(modes, np.array([1e-3]), np.array([-math.sqrt(2.0)]), forces, 1e-4, 3e-3)
    assert marched.forces.sum() * 1e-4 == pytest.approx(2.0, rel=1e-5)  # 2/(k dt^2) = 2e-6 of it is thrown back
    assert list(marched.touches.values()) == pytest.approx([1.0])


def test_smallest_opening_is_on_a_rim() -> None:
    """The lowest place of two lands under a pitch is at an outer rim, by the tilt times its distance."""
    lands = [RoundLand((x, 0.0), 1e-3, 2e-3) for x in (-3e-3, 3e-3)]
    fall = Fall(2e-6, 1e-3, math.pi / 2, 1.0, math.inf, 1e-4, 1e-6)  # h = -x tan(tilt)
    gaps = openings(fall, Region(lands), np.array([[5e-3, 0.0], [0.0, 0.0], [-5e-3, 0.0]]))
    assert gaps == pytest.approx(2e-6 + math.tan(1e-3) * np.array([0.0, 5e-3, 10e-3]), rel=1e-5)


def test_kidney_has_the_area_and_the_line_of_its_offsets() -> None:
    """An offset by d of an arc of length l encloses 2 d l + pi d^2 and is 2 l + 2 pi d long."""
    length = 2 * KIDNEY.half * KIDNEY.bend
    cells = KIDNEY.cells(40, 2)
    ring = math.pi * (KIDNEY.outer**2 - KIDNEY.inner**2)
    assert cells.areas.sum() == pytest.approx(2 * (KIDNEY.outer - KIDNEY.inner) * length + ring, rel=1e-12)
    assert cells.lengths.sum() == pytest.approx(2 * length + math.pi * (KIDNEY.inner + KIDNEY.outer), rel=1e-12)
    steps = np.linalg.norm(np.diff(KIDNEY.cells(4000, 1).places[:, 0], axis=0, append=np.nan), axis=1)[:-1]
    assert steps.max() < 1.05 * cells.lengths.sum() / 4000  # places follow each other around
