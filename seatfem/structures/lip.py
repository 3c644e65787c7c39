"""A ring-shaped contact: its arcs, each with a uniform pressure, and their patches, the same on both bodies.

Arcs have equal areas, cut by rays from the lip's centre; ring k of r across them has the share of
`seatfem.structures.rings.ring_shares`. Angles count from the x axis of the body, anticlockwise about the normal.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
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
POINTS: Final = 4096  # of the centre line, at least, on which openings are averaged


@dataclass(frozen=True)
class Patch:
    """A part of a surface by a quadrature rule: points (q, 2) [m] and weights (q,) that sum to its area [m^2]."""

    points: Array
    weights: Array


class AnyLip(ABC):
    """A flat face between two closed lines, each of which every ray from its centre crosses once.

    Places around it are shares of its area, from the x axis on. Its centre line runs half way between both.
    """

    @property
    @abstractmethod
    def arcs(self) -> int:
        """Of equal areas, the first begins on the x axis."""

    @property
    @abstractmethod
    def rings(self) -> int:
        """Across each arc."""

    @property
    @abstractmethod
    def offset(self) -> tuple[float, float]:
        """Of its centre from the body's own point of contact [m]."""

    @property
    @abstractmethod
    def content(self) -> Mapping[str, object]:
        """What it is, in short: another lip has another one."""

    @property
    def is_round(self) -> bool:
        """Whether it is the same all around."""
        return False

    @property
    @abstractmethod
    def area(self) -> float:
        """[m^2]."""

    @abstractmethod
    def radii(self, angles: Array) -> tuple[Array, Array]:
        """Distances of both lines from the centre at some angles [m]."""

    @abstractmethod
    def angles_at(self, shares: Array) -> Array:
        """(n,) angles [rad] at places (n,)."""

    @property
    def lengths(self) -> Array:
        """(arcs,) of the centre line in each arc [m]."""
        each = math.ceil(POINTS / self.arcs)
        angles = self.angles_at(np.arange(self.arcs * each + 1) / (self.arcs * each))
        steps = np.diff(self._half_way(angles), axis=0)
        return np.asarray(np.hypot(*steps.T).reshape(self.arcs, each).sum(axis=1))

    @property
    def length(self) -> float:
        """Of the centre line [m]."""
        return float(self.lengths.sum())

    @property
    def inner(self) -> float:
        """Least distance of the inner line from the centre [m]."""
        return float(self.radii(self.angles_at(np.arange(POINTS) / POINTS))[0].min())

    @property
    def outer(self) -> float:
        """Largest distance of the outer line from the centre [m]."""
        return float(self.radii(self.angles_at(np.arange(POINTS) / POINTS))[1].max())

    @property
    def angles(self) -> Array:
        """(arcs,) of their middles [rad]."""
        return self.angles_at((np.arange(self.arcs) + 0.5) / self.arcs)

    @property
    def edges(self) -> Array:
        """(arcs + 1,) angles at which they begin and end, from 0 to 2 pi [rad]."""
        return self.angles_at(np.arange(self.arcs + 1) / self.arcs)

    @property
    def division(self) -> Division:
        """Into ports."""
        return Division(self.arcs, self.rings)

    def line(self) -> tuple[Array, Array]:
        """(arcs, n, 2) points of the centre line in each arc, from the centre [m], and their angles (arcs, n)."""
        each = math.ceil(POINTS / self.arcs)
        angles = self.angles_at((np.arange(self.arcs * each) + 0.5) / (self.arcs * each))
        return self._half_way(angles).reshape(self.arcs, each, 2), angles.reshape(self.arcs, each)

    def _half_way(self, angles: Array) -> Array:
        inner, outer = self.radii(angles)
        return np.asarray(((inner + outer) / 2 * _rays(angles).T).T)

    def edge_lines(self, count: int) -> tuple[Array, Array]:
        """(count, 2) points of both lines from the centre, at equal steps of the area [m]."""
        angles = self.angles_at(np.arange(count) / count)
        inner, outer = ((radius * _rays(angles).T).T for radius in self.radii(angles))
        return inner, outer

    def cells(self, along: int, across: int) -> tuple[Array, Array]:
        """Middles (arcs, rings, along across, 2) of equal cells of each part, from the centre [m]; areas (rings,)."""
        angles = self.angles_at((np.arange(self.arcs * along) + 0.5) / (self.arcs * along))
        inner, outer = (radius[:, None, None] for radius in self.radii(angles))
        borders = ring_borders(self.rings)
        shares = borders[:-1, None] + np.diff(borders)[:, None] * (np.arange(across) + 0.5) / across
        radii = np.sqrt(inner**2 + shares * (outer**2 - inner**2))  # (around, rings, across)
        points = radii[..., None] * _rays(angles)[:, None, None]
        split = points.reshape(self.arcs, along, self.rings, across, 2).transpose(0, 2, 1, 3, 4)
        areas = self.area * np.diff(borders) / (self.arcs * along * across)
        return split.reshape(self.arcs, self.rings, along * across, 2), areas

    def patches(self, centre: tuple[float, float]) -> Mapping[str, Patch]:
        """By port; ``centre``: of the body's own contact, from which the lip is off by ``offset`` [m]."""
        x, gauss = np.polynomial.legendre.leggauss(ACROSS)
        each = max(OF_AN_ARC, math.ceil(AROUND / self.arcs))
        angles = self.angles_at((np.arange(self.arcs * each) + 0.5) / (self.arcs * each))
        inner, outer = self.radii(angles)
        turn = 2 * self.area / (self.arcs * each) / (outer**2 - inner**2)
        borders, found = ring_borders(self.rings), {}
        for arc, name in enumerate(self.division.arc_names):
            of = slice(arc * each, (arc + 1) * each)
            squares = inner[of] ** 2 + borders[:, None] * (outer[of] ** 2 - inner[of] ** 2)
            for k, port in enumerate(ring_names(name, self.rings)):
                low, high = np.sqrt(squares[k : k + 2])
                radii = (low + high) / 2 + (high - low) / 2 * x[:, None]
                points = np.asarray(centre) + self.offset + (radii[..., None] * _rays(angles[of])).reshape(-1, 2)
                found[port] = Patch(points, (gauss[:, None] * radii * (high - low) / 2 * turn[of]).ravel())
        return found


@dataclass(frozen=True)
class Lip(AnyLip):
    """A ring, or a disc where it is twice as wide as its mean radius, divided into arcs and rings.

    Attributes:
        radius: its mean [m].
        width: 0 < width <= 2 radius [m].
        arcs, rings, offset: as of `AnyLip`.

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
        check_parts(self)

    @staticmethod
    def disc(radius: float) -> Lip:
        """All of a disc."""
        return Lip(radius / 2, radius)

    @property
    def content(self) -> Mapping[str, object]:
        return vars(self)

    @property
    def is_round(self) -> bool:
        return True

    @property
    def inner(self) -> float:
        return max(0.0, self.radius - self.width / 2)

    @property
    def outer(self) -> float:
        return self.radius + self.width / 2

    @property
    def lengths(self) -> Array:
        return np.full(self.arcs, 2 * math.pi * self.radius / self.arcs)

    @property
    def area(self) -> float:
        return 2 * math.pi * self.radius * self.width

    def radii(self, angles: Array) -> tuple[Array, Array]:
        return np.full(angles.shape, self.inner), np.full(angles.shape, self.outer)

    def angles_at(self, shares: Array) -> Array:
        return np.asarray(2 * np.pi * shares)


def check_parts(lip: AnyLip) -> None:
    """Raise `ModelError` of numbers of parts below one, or above `MOST_PORTS` together."""
    if not (lip.arcs >= 1 and lip.rings >= 1 and lip.arcs * lip.rings <= MOST_PORTS):
        raise ModelError(
            f"a lip of {lip.arcs} arcs by {lip.rings} rings: each at least 1, together at most {MOST_PORTS}"
        )


def _rays(angles: Array) -> Array:
    """(n, 2) unit vectors."""
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)
