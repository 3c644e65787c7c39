"""Landings of held and of free plates on whole regions of a rigid seat, and what is measured of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from points.gll import Array
from points.march import MarchRun, Modes, PointForces, filtered_peak, impulse, march_points
from points.mesh import mesh_blocks
from points.outlines import Outline, Ring
from points.plate import Material, Plate
from points.regions import Cells, Land, Region
from points.solid_seat import PointSeat

MERGED = 30e-6  # s, the longest opening within a landing
RIMS = 1440  # points of each rim on which the smallest opening is looked for
OF_THE_LINE = 1 / 8  # share of the lines along which forces per length are averaged
OF_A_WAVE = 6  # nodes of elements for each of the plate's shortest bending waves


@dataclass(frozen=True)
class Fall:
    """How a reed comes down, in SI units.

    Attributes:
        gap: the smallest opening on the region, its rims included [m].
        tilt, axis: of the region's plane about a direction from the reed's x axis [rad].
        speed: towards the seat: of a held reed in its first mode at the contact's centre, of all of a free one [m/s].
        stiffness: of a spring that all points share by area [N/m]; infinite of points that do not penetrate.
        duration, filter_width: [s].
        damping: ratio of every mode of the reed.
    """

    gap: float
    tilt: float
    axis: float
    speed: float
    stiffness: float
    duration: float
    filter_width: float
    damping: float = 0.0


@dataclass(frozen=True)
class Stop:
    """What limits a lift: a face, whose places count from the reed's contact, its openings (n,) [m] at places (n, 2),
    and the stiffness of a spring that all points share by area [N/m]; infinite of points that do not penetrate."""

    face: Land
    openings: Callable[[Array], Array]
    stiffness: float = math.inf


@dataclass(frozen=True)
class Fineness:
    """How fine a landing is computed.

    Attributes:
        around, across: points of each land.
        order, band: of the plate's elements, and up to which its modes are kept [Hz].
        dt: step [s]; on points that should not penetrate a plate of no stiffness would ring with it as period.
    """

    around: int
    across: int
    order: int
    band: float
    dt: float


GRIDS = (
    Fineness(48, 2, 6, 0.6e6, 40e-9),
    Fineness(64, 3, 6, 1.2e6, 20e-9),
    Fineness(96, 4, 7, 2.4e6, 10e-9),
    Fineness(128, 4, 7, 4.8e6, 5e-9),
)


@dataclass(frozen=True)
class Measured:
    """Measures of a landing; SI: all but ``closing_speed``, of the hardest landing, are of the whole time."""

    impulse: float
    filtered_peak: float
    closing_speed: float
    line_force: float


def openings(fall: Fall, region: Region, places: Array) -> Array:
    """Return the gaps (n,) of the undeformed bodies [m] at places (n, 2) from the centroid."""

    def height(points: Array) -> Array:
        x, y = points[..., 0], points[..., 1]
        return np.asarray(math.tan(fall.tilt) * (y * math.cos(fall.axis) - x * math.sin(fall.axis)))

    lowest = min(float(height(rim).min()) for rim in region.rims(RIMS))
    return np.asarray(fall.gap + height(places) - lowest)


@cache
def reed_modes(
    outline: Outline, material: Material, thickness: float, order: int, band: float
) -> tuple[Array, Array, Plate]:
    """Return circular frequencies, deflections at the nodes (n, k) and the plate, up to a band [Hz]."""
    speed = math.sqrt(material.young / (12 * (1 - material.poisson**2) * material.density)) * thickness
    size = order / OF_A_WAVE * math.sqrt(2 * math.pi * speed / band)
    mesh = mesh_blocks(outline.blocks(size), order)
    clamped = np.empty(0, dtype=int) if isinstance(outline, Ring) else np.flatnonzero(mesh.points[:, 0] < 1e-9)
    plate = Plate(mesh, material, thickness, (3 * clamped[:, None] + np.arange(3)).ravel())
    return *plate.modes_below(band), plate


def march_region(
    outline: Outline,
    material: Material,
    thickness: float,
    region: Region,
    fall: Fall,
    fine: Fineness,
    stop: Stop | None = None,
    seat: Callable[[list[Cells]], PointSeat] | None = None,
) -> tuple[MarchRun, list[Cells]]:
    """Return the forces at the points of all lands, one land after the other, then at those of a stop, and the cells of
    the lands. ``seat``: solved at the cells in the coordinates of the lands; ``None``: it is rigid."""
    cells = region.cells(fine.around, fine.across)
    places, areas = _points(cells)
    omega, nodal, plate = reed_modes(outline, material, thickness, fine.order, fine.band)
    centre = np.array(outline.centre)
    if isinstance(outline, Ring):
        mass = plate.matrices()[1][::3]
        rates = -fall.speed * (mass @ nodal)
    else:
        rates = np.zeros_like(omega)
        rates[0] = -fall.speed / plate.mesh.interpolate(centre[None], nodal[:, :1])[0, 0]
    shapes = plate.mesh.interpolate(centre + places, nodal)
    gaps = openings(fall, region, places)
    bed = material.density * thickness * (2 * np.pi / fine.dt) ** 2  # of points that do not penetrate
    stiffness = fall.stiffness * areas / areas.sum() if math.isfinite(fall.stiffness) else bed * areas
    rigid = math.isinf(fall.stiffness) and seat is None
    if stop is not None:
        above, shares = _points([stop.face.cells(fine.around, fine.across)])
        shapes = np.concatenate([shapes, -plate.mesh.interpolate(centre + above, nodal)])
        gaps = np.concatenate([gaps, stop.openings(above)])
        springs = math.isfinite(stop.stiffness)
        stiffness = np.concatenate([stiffness, stop.stiffness * shares / shares.sum() if springs else bed * shares])
        rigid = rigid or not springs
    beyond = np.zeros((len(gaps), len(gaps)))
    if seat is not None:
        solved = seat(region.drawn_cells(fine.around, fine.across))
        beyond[: len(areas), : len(areas)] = solved.residual
        of_seat = np.zeros((len(gaps), len(solved.omega)))
        of_seat[: len(areas)] = solved.shapes
        omega, shapes = np.concatenate([omega, solved.omega]), np.hstack([shapes, of_seat])
        rates = np.concatenate([rates, np.zeros_like(solved.omega)])
    modes = Modes(omega, np.full_like(omega, fall.damping), shapes)
    yields = beyond + modes.step_compliance(fine.dt) if rigid else beyond
    forces = PointForces(stiffness, yields if yields.any() else None, ahead=rigid)
    return march_points(modes, gaps, rates, forces, fine.dt, fall.duration), cells


def _points(cells: list[Cells]) -> tuple[Array, Array]:
    """Return places (n, 2) and areas (n,) of all cells."""
    return np.concatenate([each.places.reshape(-1, 2) for each in cells]), np.concatenate(
        [each.areas.ravel() for each in cells]
    )


def measure_region(marched: MarchRun, cells: list[Cells], fall: Fall, dt: float) -> Measured:
    """Return the measures of a landing."""
    total = marched.forces.sum(axis=1)
    first, _ = hardest_landing(total, dt, fall.filter_width)
    line = _line_force(marched.forces, cells, dt, fall.filter_width)
    return Measured(
        impulse(total, dt), filtered_peak(total, dt, fall.filter_width), marched.touches[first], line
    )  # fmt: skip


def hardest_landing(total: Array, dt: float, width: float) -> tuple[int, int]:
    """Return the first step with force, and the last, of the landing of the largest mean over a ``width`` [s]."""
    ends = list(zip(*_landings(total, dt), strict=True))
    peaks = [filtered_peak(total[a : b + 1], dt, width) for a, b in ends]
    return ends[int(np.argmax(peaks))]


def _landings(total: Array, dt: float) -> tuple[Array, Array]:
    """Return the first steps with force of each landing, and the last."""
    closed = np.flatnonzero(total > 0)
    breaks = np.flatnonzero(np.diff(closed) * dt > MERGED)
    return closed[np.concatenate([[0], breaks + 1])], closed[np.concatenate([breaks, [len(closed) - 1]])]


def _line_force(forces: Array, cells: list[Cells], dt: float, width: float) -> float:
    """Return the largest force per length [N/m], mean over `OF_THE_LINE` of all lines within a land and over a time."""
    part = OF_THE_LINE * sum(float(each.lengths.sum()) for each in cells)
    largest, at = 0.0, 0
    for each in cells:
        around, across = each.areas.shape
        own = forces[:, at : at + around * across].reshape(len(forces), around, across).sum(axis=2)
        at += around * across
        ends = np.concatenate([[0.0], np.cumsum(np.tile(each.lengths, 2))])
        borne = np.concatenate([np.zeros((len(own), 1)), np.cumsum(np.tile(own, 2), axis=1)], axis=1)
        work = dt * np.cumsum(borne, axis=0)
        late = max(1, round(width / dt))
        late_work = (work[late:] - work[:-late]) / width if len(work) > late else work[-1:] / width
        span = min(part, float(each.lengths.sum()))
        for start in range(around):
            end = ends[start] + span
            k = int(np.searchsorted(ends, end)) - 1
            share = (end - ends[k]) / (ends[k + 1] - ends[k])
            there = late_work[:, k] + share * (late_work[:, k + 1] - late_work[:, k])
            largest = max(largest, float((there - late_work[:, start]).max()) / span)
    return largest
