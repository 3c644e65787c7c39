"""A ring-shaped contact: its arcs, each with a uniform pressure, and their patches, the same on both bodies.

Arcs are equal, ring k of r across them has the share of `seatfem.structures.rings.ring_shares`. Angles count from the
x axis of the body, anticlockwise about the normal.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from impact.greens.base import Array
from seatfem.structures.errors import ModelError
from seatfem.structures.rings import MOST_PORTS, Division, ring_borders, ring_names

ACROSS: Final = 8  # Gauss points over the width of a patch
AROUND: Final = 96  # points around a whole ring, at least
OF_AN_ARC: Final = 6  # and of each arc


@dataclass(frozen=True)
class Patch:
    """A part of a surface by a quadrature rule: points (q, 2) [m] and weights (q,) that sum to its area [m^2]."""

    points: Array
    weights: Array


@dataclass(frozen=True)
class Lip:
    """A ring, or a disc where it is twice as wide as its mean radius, divided into arcs and rings.

    Attributes:
        radius: its mean [m].
        width: 0 < width <= 2 radius [m].
        arcs: equal ones, the first begins on the x axis.
        rings: across each arc.
        offset: of its centre from the body's own point of contact [m].

    Raises:
        ModelError: a width outside its range, numbers of parts below one or above `MOST_PORTS` together.
    """

    radius: float
    width: float
    arcs: int = 1
    rings: int = 1
    offset: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius) and 0 < self.width <= 2 * self.radius * (1 + 1e-12)):
            raise ModelError(
                f"ring of mean radius {1e3 * self.radius:g} mm: a width of {1e3 * self.width:g} mm must be positive "
                f"and at most {2e3 * self.radius:g} mm"
            )
        if not (self.arcs >= 1 and self.rings >= 1 and self.arcs * self.rings <= MOST_PORTS):
            raise ModelError(
                f"a lip of {self.arcs} arcs by {self.rings} rings: each at least 1, together at most {MOST_PORTS}"
            )

    @staticmethod
    def disc(radius: float) -> Lip:
        """All of a disc."""
        return Lip(radius / 2, radius)

    @property
    def inner(self) -> float:
        """Radius [m]."""
        return max(0.0, self.radius - self.width / 2)

    @property
    def outer(self) -> float:
        """Radius [m]."""
        return self.radius + self.width / 2

    @property
    def length(self) -> float:
        """Of the centre line [m]."""
        return 2 * math.pi * self.radius

    @property
    def area(self) -> float:
        """[m^2]."""
        return self.length * self.width

    @property
    def angles(self) -> Array:
        """(arcs,) of their middles [rad]."""
        return 2 * np.pi * (np.arange(self.arcs) + 0.5) / self.arcs

    @property
    def division(self) -> Division:
        """Into ports."""
        return Division(self.arcs, self.rings)

    def patches(self, centre: tuple[float, float]) -> Mapping[str, Patch]:
        """By port; ``centre``: of the body's own contact, from which the lip is off by ``offset`` [m]."""
        x, gauss = np.polynomial.legendre.leggauss(ACROSS)
        squares = self.inner**2 + ring_borders(self.rings) * (self.outer**2 - self.inner**2)
        each = max(OF_AN_ARC, math.ceil(AROUND / self.arcs))
        step = 2 * np.pi / (self.arcs * each)
        turns = (np.arange(each) + 0.5) * step - np.pi / self.arcs
        found = {}
        for arc, middle in zip(self.division.arc_names, self.angles, strict=True):
            around = np.stack([np.cos(middle + turns), np.sin(middle + turns)], axis=1)
            for k, name in enumerate(ring_names(arc, self.rings)):
                low, high = np.sqrt(squares[k : k + 2])
                radii = (low + high) / 2 + (high - low) / 2 * x
                points = np.asarray(centre) + self.offset + (radii[:, None, None] * around).reshape(-1, 2)
                found[name] = Patch(points, np.repeat(gauss * radii * (high - low) / 2 * step, each))
        return found
