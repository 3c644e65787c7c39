"""Faces of a solid with the properties by which they are selected, and planes in space."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array

Vector = tuple[float, float, float]
Colour = tuple[int, int, int, int]


@dataclass(frozen=True)
class Axis:
    """Axis of a cylinder or a cone: a point on it, its direction, and the cone's half angle (0: a cylinder;
    radians)."""

    point: Vector
    direction: Vector
    half_angle: float = 0.0


@dataclass(frozen=True, eq=False)
class Face:
    """One face of a solid, in metres.

    ``outline``: points on its boundary curves, (n, 3); ``curves``: tags of these curves. ``normal``: outward normal;
    None for a curved face. ``axis``: axis of a cylinder or cone. ``name``: name in the CAD file, or "". ``numbers``:
    positions in the file's order, from 1; a face shared by two solids has two, and pieces of one face have the same.
    ``distance``: function from a point to its distance from the face.
    """

    tag: int
    kind: str
    centre: Vector
    area: float
    outline: NDArray[np.float64]
    curves: frozenset[int]
    normal: Vector | None = None
    colour: Colour | None = None
    axis: Axis | None = None
    name: str = ""
    numbers: tuple[int, ...] = ()
    distance: Callable[[Vector], float] | None = None

    def radii(self, point: Vector, direction: Vector) -> NDArray[np.float64]:
        """Return the distances of the outline from an axis."""
        n = np.asarray(direction) / np.linalg.norm(direction)
        arm = self.outline - point
        return np.asarray(np.linalg.norm(arm - np.outer(arm @ n, n), axis=1))

    def __str__(self) -> str:
        x, y, z = (f"{1e3 * c:.4g}" for c in np.round(self.centre, 12) + 0.0)
        number = " = ".join(map(str, self.numbers)) or str(self.tag)
        text = f"face {number}: {self.kind}, centre ({x}, {y}, {z}) mm, area {1e6 * self.area:.4g} mm^2"
        if self.normal is not None:
            text += ", normal ({:.3g}, {:.3g}, {:.3g})".format(*(np.round(self.normal, 6) + 0.0))
        if self.axis is not None:
            radii = self.radii(self.axis.point, self.axis.direction)
            ends = dict.fromkeys(f"{1e3 * r:.4g}" for r in (radii.min(), radii.max()))
            text += f", radius {' to '.join(ends)} mm"
            text += ", axis ({:.3g}, {:.3g}, {:.3g})".format(*(np.round(self.axis.direction, 6) + 0.0))
        if self.axis is not None and self.axis.half_angle > 0.0:
            text += f", half angle {math.degrees(self.axis.half_angle):.4g} deg"
        if self.name:
            text += f", name {self.name!r}"
        return text + (", no colour" if self.colour is None else f", colour {self.colour}")


def connected(faces: Sequence[Face]) -> bool:
    """Return whether the faces form one patch, each sharing a curve with another."""
    reached, waiting = set(faces[0].curves), list(faces[1:])
    while touching := [face for face in waiting if face.curves & reached]:
        reached.update(*(face.curves for face in touching))
        waiting = [face for face in waiting if face not in touching]
    return not waiting


def listing(faces: Sequence[Face]) -> str:
    """Return one line per face, for error messages."""
    return "\n".join(f"  {face}" for face in faces)


@dataclass(frozen=True)
class Frame:
    """A plane in space: a point on it [m], and the unit vectors x and y in it."""

    origin: Vector
    x: Vector
    y: Vector

    @property
    def axes(self) -> Array:
        """Return the (2, 3) unit vectors."""
        return np.array([self.x, self.y])

    @property
    def normal(self) -> Array:
        """Return the (3,) normal x cross y."""
        return np.cross(self.x, self.y)

    def seen(self, points: Array) -> Array:
        """Return the coordinates x, y (..., 2) of points (..., 3) projected on the plane [m]."""
        return np.asarray((points - np.array(self.origin)) @ self.axes.T)

    def points(self, places: Array) -> Array:
        """Return the points (..., 3) with coordinates x, y (..., 2) on the plane [m]."""
        return np.asarray(np.array(self.origin) + places @ self.axes)
