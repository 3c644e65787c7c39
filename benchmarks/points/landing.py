"""Landings: a reed, a seat, how it lies and how it starts; the force on a grid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from points.gll import Array
from points.march import Modes, PointForces, march_landing
from points.mesh import mesh_blocks
from points.outlines import Outline
from points.plate import Material, Plate
from points.seat import Meridian, Seat

LIP_LINE = 4096  # points of the centre line on which the smallest opening is looked for


@dataclass(frozen=True)
class Landing:
    """A clamped plate at ``gap`` [m] over a lip, tilted by ``tilt`` about ``tilt_axis`` from x [rad].

    It moves towards the lip in its first mode with ``speed`` [m/s] at its contact's centre; the law is a spring of
    ``stiffness`` [N/m], shared by area.
    """

    outline: Outline
    material: Material
    thickness: float
    lip_radius: float
    lip_width: float
    seat: Seat
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
    clamped = np.flatnonzero(mesh.points[:, 0] < 1e-9)
    plate = Plate(mesh, material, thickness, (3 * clamped[:, None] + np.arange(3)).ravel())
    return *plate.modes_below(band), plate


def total_force(landing: Landing, grid: Grid) -> Array:
    """Return the force on the lip (steps,) [N] at steps of ``grid.dt``."""
    points = lip_points(landing.lip_radius, landing.lip_width, grid.around, grid.across)
    omega, nodal, plate = plate_modes(
        landing.outline, landing.material, landing.thickness, grid.order, grid.size, grid.band
    )
    centre = np.array(landing.outline.centre)
    shapes, rates = plate.mesh.interpolate(centre + points.places, nodal), np.zeros_like(omega)
    rates[0] = -landing.speed / plate.mesh.interpolate(centre[None], nodal[:, :1])[0, 0]
    seat = Meridian(landing.seat, grid.seat_order, grid.seat_size).response(points.borders, grid.around, grid.seat_band)
    damping = np.concatenate([np.zeros_like(omega), np.full_like(seat.omega, landing.seat.damping)])
    modes = Modes(np.concatenate([omega, seat.omega]), damping, np.concatenate([shapes, seat.shapes], axis=1))
    rates = np.concatenate([rates, np.zeros_like(seat.omega)])
    forces = PointForces(landing.stiffness * points.shares, seat.residual)
    return march_landing(modes, openings(landing, points.places), rates, forces, grid.dt, landing.duration)
