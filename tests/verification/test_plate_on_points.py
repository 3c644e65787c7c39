"""The independent program for tilted landings, benchmarks/points: its plate, seat and march against closed forms."""

import ast
import math
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import points
import pytest
from points.gll import Array
from points.march import Modes, PointForces, filtered_peak, impulse, march_landing, march_points
from points.mesh import Block, mesh_blocks
from points.outlines import Ring, Sheet
from points.plate import SHEAR_FACTOR, Material, Plate
from points.region_landing import Fall, Fineness, march_region, measure_region, openings, reed_modes
from points.regions import KidneyLand, Rectangle, Region, RoundLand
from points.seat import Meridian, Seat, modes_below
from points.solid_seat import SolidSeat

SIDE, THICKNESS = 1.0, 0.2
STUFF = Material(1e9, 0.3, 1000.0)


def supported_frequency() -> float:
    """Return a square Mindlin plate's lowest circular frequency on simple supports that hold rotation along the edge.

    w = W sin sin and a = A grad(sin sin)/k with k^2 = 2 (pi/a)^2 leave two equations for W and A.
    """
    wave = math.sqrt(2) * math.pi / SIDE
    shear, inertia = SHEAR_FACTOR * STUFF.shear * THICKNESS, STUFF.density * THICKNESS**3 / 12
    rigidity = STUFF.young * THICKNESS**3 / (12 * (1 - STUFF.poisson**2))
    mass = STUFF.density * THICKNESS
    matrix = [[shear * wave**2 / mass, -shear * wave / mass], [-shear * wave / inertia, 0.0]]
    matrix[1][1] = (rigidity * wave**2 + shear) / inertia
    return math.sqrt(np.linalg.eigvals(np.array(matrix)).min())


@pytest.mark.parametrize("order", [2, 3])
def test_frequencies_of_a_supported_plate_converge_with_twice_the_order(order: int) -> None:
    exact, errors = supported_frequency(), []
    for ends in (np.linspace(0, 1, parts + 1) for parts in (4, 8)):
        mesh = mesh_blocks([Block(lambda s, t: np.stack([SIDE * s, SIDE * (t - 0.5)], axis=-1), ends, ends)], order)
        x, y = mesh.points.T
        sides = np.flatnonzero((x < 1e-9) | (x > SIDE - 1e-9))
        ends_of_y = np.flatnonzero(np.abs(y) > SIDE / 2 - 1e-9)
        held = np.unique(np.concatenate([3 * sides, 3 * sides + 2, 3 * ends_of_y, 3 * ends_of_y + 1]))
        errors.append(abs(Plate(mesh, STUFF, THICKNESS, held).modes(2)[0][0] / exact - 1))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2 * order, abs=0.35)
    assert errors[1] < 2e-4


@pytest.mark.slow
def test_a_thin_cantilever_has_the_frequencies_of_kirchhoff() -> None:
    """Frequencies agree with graded Argyris elements, good to 2e-4; a thousandth in thickness changes 5e-4."""
    mesh = mesh_blocks(Sheet(1.0, 1.0, 0.5).blocks(0.25), 7)
    clamped = np.flatnonzero(mesh.points[:, 0] < 1e-9)
    plate = Plate(mesh, STUFF, 1e-3, (3 * clamped[:, None] + np.arange(3)).ravel())
    values = plate.modes(6)[0] * math.sqrt(STUFF.density * 1e-3 / plate.rigidity)
    np.testing.assert_allclose(values, [3.4710, 8.5066, 21.285, 27.199, 30.956, 54.186], rtol=3e-4)


COLUMN = Seat(3e-3, 1e-3, 0.0, 4e-3, 2.5e-3, Material(1e9, 0.0, 1000.0), 0.0)


@pytest.mark.parametrize("order", [2, 3])
def test_a_seat_without_lateral_strain_is_a_rod(order: int) -> None:
    """Its statics are l/(E A); its second longitudinal mode, at 3 c/(4 l), converges with twice the order."""
    length, area = COLUMN.thickness + COLUMN.lip_height, math.pi * (4e-3**2 - 3e-3**2)
    errors = []
    for size in (0.5e-3, 0.25e-3):
        meridian = Meridian(COLUMN, order, size)
        stiffness, mass = meridian.harmonic(0)
        mean = meridian.means(np.array([3e-3, 4e-3]), 0)
        static = (mean.T @ np.linalg.solve(stiffness.toarray(), mean))[0, 0] / (2 * math.pi)
        assert static == pytest.approx(length / (1e9 * area), rel=1e-9)
        squares, vectors = modes_below(stiffness, mass, 2 * math.pi * 320e3)
        amplitudes = np.abs(mean.T @ vectors)[0]
        second = squares[amplitudes > 0.9 * amplitudes.max()].max()
        errors.append(math.sqrt(second) / (2 * math.pi) / (0.75 * 1e3 / length) - 1)
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2 * order, abs=0.35)
    assert abs(errors[1]) < 1e-3


SPRINGS, YIELDING, STRIKER, SPEED = np.full(4, 2e6), np.diag(np.full(4, 1e-7)), 2e-4, 1.5


def bounce(dt: float, duration: float) -> np.ndarray:
    """Return the force of a rigid mass on four points of a yielding bed."""
    modes = Modes(np.zeros(1), np.zeros(1), np.full((4, 1), 1 / math.sqrt(STRIKER)))
    forces = PointForces(SPRINGS, YIELDING)
    return march_landing(modes, np.full(4, 1e-6), np.array([-SPEED * math.sqrt(STRIKER)]), forces, dt, duration)


def test_a_mass_on_springs_bounces_with_second_order() -> None:
    """Its largest mean over T is v sqrt(k m) sin(x)/x, x = sqrt(k/m) T/2, 1/k that of law and bed together."""
    stiffness, width = 4 / (1 / 2e6 + 1e-7), 5e-6
    mean = np.sinc(math.sqrt(stiffness / STRIKER) * width / 2 / math.pi)
    exact = SPEED * math.sqrt(stiffness * STRIKER) * mean
    errors = [abs(filtered_peak(bounce(dt, 2e-4), dt, width) / exact - 1) for dt in (8e-7, 1e-7)]
    assert math.log(errors[0] / errors[1], 8) > 1.7
    assert errors[1] < 1e-4


def test_a_mass_leaves_as_fast_as_it_came() -> None:
    assert impulse(bounce(1e-7, 2e-4), 1e-7) == pytest.approx(2 * STRIKER * SPEED, rel=1e-5)


def test_forces_and_penetrations_of_points_agree() -> None:
    """x + R N(x) = -opening at every point, closed or not, N(x) = k max(x, 0); both occur."""
    rng = np.random.default_rng(3)
    root = rng.normal(size=(12, 12))
    residual, stiffness = 1e-8 * root @ root.T + 1e-8 * np.eye(12), rng.uniform(1e6, 1e8, 12)
    openings = rng.normal(size=12) * 1e-6
    force = PointForces(stiffness, residual).solve(openings)
    own = -openings - residual @ force
    assert 0 < (force > 0).sum() < 12
    np.testing.assert_allclose(force, stiffness * np.maximum(own, 0), rtol=1e-6, atol=1e-9 * force.max())


def modules() -> list[Path]:
    return sorted(Path(points.__file__).parent.glob("*.py"))


@pytest.mark.parametrize("module", modules(), ids=lambda path: path.stem)
def test_the_reference_imports_numpy_and_scipy_alone(module: Path) -> None:
    names = set()
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level
            names.add((node.module or "").partition(".")[0])
    mesher = {"gmsh"} if module.stem == "solid_seat" else set()  # whose matrices are those of CalculiX
    assert names - set(sys.stdlib_module_names) <= {"numpy", "scipy", "points"} | mesher


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


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_a_column_yields_and_rings_by_the_matrices_of_calculix() -> None:
    """A column of 2 x 2 x 20 mm without lateral contraction, held at its foot, yields by L/(E A) under a pressure.
    It rings at c/(4 L) with sqrt(2/m) at its top, and in bending .6 % (Timoshenko) below Euler and Bernoulli."""
    side, length, steel = 2e-3, 20e-3, Material(200e9, 0.0, 7850.0)
    land = Rectangle((-side / 2, -side / 2), (side / 2, side / 2))

    def draw(occ: Any) -> None:
        occ.addBox(-1, -1, 0, 2, 2, 20)

    def every(middles: Array) -> Array:
        return np.full(len(middles), True)

    seat = SolidSeat(draw, lambda nodes: nodes[:, 2] < 1e-6, every, 20, [(0, 0, 0.5)], steel, (0.5, 1.0), 12)
    solved = seat([land.cells(2, 2)])
    mean = solved.shapes.mean(axis=0)
    yields = solved.residual.mean() + ((mean / solved.omega) ** 2).sum()
    assert yields == pytest.approx(length / (steel.young * side**2), rel=0.01)
    axial = np.abs(mean).argmax()
    assert solved.omega[axial] == pytest.approx(math.pi / 2 * math.sqrt(steel.young / steel.density) / length, rel=5e-3)
    assert abs(mean[axial]) == pytest.approx(math.sqrt(2 / (steel.density * side**2 * length)), rel=0.01)
    slender = 1.8751**2 * math.sqrt(steel.young * side**2 / 12 / steel.density) / length**2
    assert solved.omega[:2] == pytest.approx(0.994 * slender, rel=8e-3)
    assert np.linalg.eigvalsh(solved.residual)[0] > 0
