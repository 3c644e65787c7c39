"""Landings: a reed, a seat, how it lies and how it starts; the force on a grid, and its doubt by two coarser grids."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from points.gll import Array
from points.march import Law, Modes, PointForces, filtered_peak, impulse, march_landing
from points.mesh import mesh_blocks
from points.outlines import Outline
from points.plate import Material, Plate
from points.seat import Meridian, Seat

RIGID = 1e13  # N/m of all points together, for a contact without a law of its own on a seat that yields
RIGID_ON_RIGID = 5e9  # N/m, where the seat is rigid, too
TUMBLING = 2 * math.pi * 3e3  # rad/s, shift below the modes of a free plate
FLIGHT = 30e-6  # s, that a reed flies for a landing to be over
COARSER = 1.5  # bands of grids, over those of coarser ones
LIP_LINE = 4096  # points of the centre line on which the smallest opening is looked for


@dataclass(frozen=True)
class Landing:
    """A plate at ``gap`` [m] over a lip, tilted by ``tilt`` about ``tilt_axis`` from x [rad], moving towards it.

    A clamped plate moves in its first mode with ``speed`` [m/s] at its contact's centre, a free one as a rigid body.
    The seat is rigid where it is ``None``; ``law`` is "signorini", "spring" [N/m] or "hertz" [N/m^1.5].
    """

    outline: Outline
    material: Material
    thickness: float
    lip_radius: float
    lip_width: float
    seat: Seat | None
    law: str
    stiffness: float
    gap: float
    tilt: float
    tilt_axis: float
    speed: float
    duration: float
    filter_width: float


@dataclass(frozen=True)
class Grid:
    """How fine a landing is computed.

    Attributes:
        around, across: points of the lip.
        order, size: of the plate's elements [m].
        band: up to which the plate's modes are kept [Hz].
        seat_order, seat_size, seat_band: of the seat's [m], [Hz].
        dt: step [s].
        joined: whether points across move as their mean, one contact a radius.
        level: whether points across an arc share the opening of its centre line.
    """

    around: int
    across: int
    order: int
    size: float
    band: float
    seat_order: int
    seat_size: float
    seat_band: float
    dt: float
    joined: bool = False
    level: bool = False


@dataclass(frozen=True)
class Points:
    """Of a lip: places (n, 2) from its centre [m], shares (n,) of its area, and borders of the cells across [m]."""

    places: Array
    shares: Array
    borders: Array


def lip_points(radius: float, width: float, around: int, across: int) -> Points:
    """Return points at Gauss' places across the land and at equal angles, those across fastest."""
    x, weights = np.polynomial.legendre.leggauss(across)
    radii = radius + width / 2 * x
    borders = radius - width / 2 + width / 2 * np.concatenate([[0.0], np.cumsum(weights)])
    angles = 2 * np.pi * np.arange(around) / around
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    shares = np.diff(borders**2) / (borders[-1] ** 2 - borders[0] ** 2) / around
    return Points((rays[:, None] * radii[:, None]).reshape(-1, 2), np.tile(shares, around), borders)


def openings(landing: Landing, places: Array) -> Array:
    """Return the gaps (n,) of the undeformed bodies [m]: ``gap`` is the smallest on the lip's centre line."""

    def height(points: Array) -> Array:
        x, y = points.T
        slope = math.tan(landing.tilt)
        return np.asarray(slope * (y * math.cos(landing.tilt_axis) - x * math.sin(landing.tilt_axis)))

    angles = 2 * np.pi * np.arange(LIP_LINE) / LIP_LINE
    line = landing.lip_radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return np.asarray(landing.gap + height(places) - height(line).min())


@cache
def plate_modes(
    outline: Outline, material: Material, thickness: float, order: int, size: float, band: float
) -> tuple[Array, Array, Plate]:
    """Return circular frequencies, deflections at the nodes (n, k) and the plate, up to a band [Hz]."""
    mesh = mesh_blocks(outline.blocks(size), order)
    clamped = np.flatnonzero(mesh.points[:, 0] < 1e-9) if outline.clamped else np.empty(0, dtype=np.int64)
    plate = Plate(mesh, material, thickness, (3 * clamped[:, None] + np.arange(3)).ravel())
    count, complete = plate.count_modes(band), False
    while not complete:
        omega, shapes = plate.modes(count, below=0.0 if outline.clamped else TUMBLING)
        inside = omega <= 2 * np.pi * band
        complete, count = not inside.all(), math.ceil(1.2 * count)
    return np.where(omega < 1e-3 * TUMBLING, 0.0, omega)[inside], shapes[:, inside], plate


def total_force(landing: Landing, grid: Grid, flight: float = math.inf) -> Array:
    """Return the force on the lip (steps,) [N] at steps of ``grid.dt``, up to so long a flight after a contact [s]."""
    points = lip_points(landing.lip_radius, landing.lip_width, grid.around, grid.across)
    omega, nodal, plate = plate_modes(
        landing.outline, landing.material, landing.thickness, grid.order, grid.size, grid.band
    )
    centre = np.array(landing.outline.centre)
    shapes = plate.mesh.interpolate(centre + points.places, nodal)
    gaps, shares = openings(landing, _levelled(points, landing, grid)), points.shares
    rates, damping = _start(landing, plate, nodal, centre), np.zeros_like(omega)
    residual = None
    if landing.seat is not None:
        meridian = Meridian(landing.seat, grid.seat_order, grid.seat_size)
        seat = meridian.response(points.borders, grid.around, grid.seat_band)
        omega, shapes = np.concatenate([omega, seat.omega]), np.concatenate([shapes, seat.shapes], axis=1)
        rates = np.concatenate([rates, np.zeros_like(seat.omega)])
        damping = np.concatenate([damping, np.full_like(seat.omega, landing.seat.damping)])
        residual = seat.residual
    if grid.joined:
        join = np.kron(np.eye(grid.around), grid.around * shares[: grid.across])
        shapes, gaps, shares = join @ shapes, join @ gaps, np.full(grid.around, 1 / grid.around)
        residual = None if residual is None else join @ residual @ join.T
    forces = PointForces(_law(landing, shares), residual)
    modes = Modes(omega, damping, shapes)
    return march_landing(modes, gaps, rates, forces, grid.dt, landing.duration, flight)


def _levelled(points: Points, landing: Landing, grid: Grid) -> Array:
    """Return the places (n, 2) whose openings count."""
    if not grid.level:
        return points.places
    return np.asarray(points.places / np.linalg.norm(points.places, axis=1)[:, None] * landing.lip_radius)


def _start(landing: Landing, plate: Plate, nodal: Array, centre: Array) -> Array:
    """Return the rates (k,) of the plate's modes."""
    if landing.outline.clamped:
        rates = np.zeros(nodal.shape[1])
        rates[0] = -landing.speed / plate.mesh.interpolate(centre[None], nodal[:, :1])[0, 0]
        return rates
    _, mass = plate.matrices()
    return np.asarray(-landing.speed * (mass[::3] @ nodal))


def _law(landing: Landing, shares: Array) -> Law:
    """Return the law of points that have these shares of the land."""
    if landing.law == "signorini":
        return Law((RIGID_ON_RIGID if landing.seat is None else RIGID) * shares)
    return Law(landing.stiffness * shares, 1.5 if landing.law == "hertz" else 1.0)


@dataclass(frozen=True)
class Doubted:
    """A landing's measures, each with its doubt, and when the first contact's end lets the run end [s]."""

    duration: float
    impulse: float
    impulse_doubt: float
    filtered_peak: float
    filtered_peak_doubt: float


def solve_with_doubt(landing: Landing, grid: Grid, *, until_flight: bool = True) -> Doubted:
    """Compute a landing by a grid and by two coarser ones.

    The doubt is the sum of what fewer points on a coarser seat change, and what a coarser plate and longer steps do.
    The run ends as ``landing.duration`` says, or earlier in the first flight that lasts `FLIGHT` if asked to.
    """
    fewer = replace(
        grid,
        around=2 * grid.around // 3,
        across=grid.across - 1,
        seat_order=grid.seat_order - 1,
        seat_band=grid.seat_band / COARSER,
    )
    coarser = replace(grid, order=grid.order - 1, band=grid.band / COARSER, dt=2 * grid.dt)
    fine = total_force(landing, grid, FLIGHT if until_flight else math.inf)
    duration = min(landing.duration, _middle_of_flight(fine, grid.dt)) if until_flight else landing.duration
    cut = replace(landing, duration=duration)
    forces = [(fine[: round(duration / grid.dt) + 1], grid.dt)]
    forces += [(total_force(cut, each), each.dt) for each in (fewer, coarser)]
    impulses = np.array([impulse(*each) for each in forces])
    peaks = np.array([filtered_peak(*each, landing.filter_width) for each in forces])
    doubts = [float(np.abs(values[1:] - values[0]).sum()) for values in (impulses, peaks)]
    return Doubted(duration, float(impulses[0]), doubts[0], float(peaks[0]), doubts[1])


def _middle_of_flight(force: Array, dt: float) -> float:
    """Return the middle of the flight of `FLIGHT` that a march ends with, to the microsecond; infinite of none."""
    flying = (len(force) - 1 - np.flatnonzero(force > 0).max(initial=-1)) * dt
    return math.inf if flying < FLIGHT * (1 - 1e-9) else math.floor(((len(force) - 1) * dt - FLIGHT / 2) * 1e6) * 1e-6
