"""Frames of plane faces in space: where the coordinates of a sheet lie in its file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from impact.greens.base import Array
from seatfem.structures.shapes.faces import Vector


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
        """Return the places (..., 2) of points (..., 3), seen along the normal [m]."""
        return np.asarray((points - np.array(self.origin)) @ self.axes.T)

    def points(self, places: Array) -> Array:
        """Return the points (..., 3) of places (..., 2) on the plane [m]."""
        return np.asarray(np.array(self.origin) + places @ self.axes)
