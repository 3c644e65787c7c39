"""Contact along a lip: its arcs, each with a uniform pressure, and their patches, the same on both bodies.

Arcs have equal areas, between cuts straight across the lip; ring k of r across them has the share of
`seatfem.structures.rings.ring_shares`. Angles count from the x axis of the body, anticlockwise about the normal.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from impact.after.histories import Pieces
from impact.greens.base import Array
from seatfem.structures.errors import ModelError
from seatfem.structures.rings import MOST_PORTS, Division, ring_borders, ring_names
from seatfem.structures.shapes.loops import cross

ACROSS: Final = 8  # Gauss points over the width of a patch
AROUND: Final = 96  # fewest points around a whole ring
OF_AN_ARC: Final = 6  # fewest points of each arc
WITHIN: Final = 1e-6  # share of a part by which its ends are moved inwards, where faces end
POINTS: Final = 4096  # fewest points of the centre line over which openings are averaged


def tilted(points: Array, tilt: float, axis: float) -> Array:
    """Return the heights at points (..., 2) of a plane tilted about a direction [m]."""
    return np.asarray(math.tan(tilt) * (points[..., 1] * math.cos(axis) - points[..., 0] * math.sin(axis)))


def turned_over(points: Array) -> Array:
    """Return points (..., 2) of a face that looks down, in its own axes, in those of what lies below, or the reverse: y
    changes its sign."""
    return points * (1.0, -1.0)


@dataclass(frozen=True)
class Patch:
    """A part of a surface by a quadrature rule: points (q, 2) [m] and weights (q,) that sum to its area [m^2]."""

    points: Array
    weights: Array


class AnyLip(ABC):
    """Flat faces between two lines each. Places along them are shares of their area, one face after the other.

    Its centre line runs half way between both lines, along cuts across.

    Attributes:
        arcs: of equal areas.
        rings: across each arc.
        offset: of its centre from the body's own point of contact [m].
        side: what the names of its ports begin with; "" of the seat's. Others are above the plate, turned over.
        is_part: whether the faces have more beside it, where no reed lies over them.
    """

    arcs: int
    rings: int
    offset: tuple[float, float]
    side: str
    is_part: bool = False

    def __post_init__(self) -> None:
        """Raise `ModelError` of numbers of parts below one, or above `MOST_PORTS` together."""
        if not (self.arcs >= 1 and self.rings >= 1 and self.arcs * self.rings <= MOST_PORTS):
            raise ModelError(
                f"a lip of {self.arcs} segments by {self.rings} rings: each at least 1, together at most {MOST_PORTS}: "
                "take fewer contact.ports or contact.rings"
            )

    @property
    @abstractmethod
    def content(self) -> Mapping[str, object]:
        """Return a short text that identifies the lip: another lip has another one."""

    @property
    def is_round(self) -> bool:
        """Return whether the lip is the same all around."""
        return False

    @property
    def is_disc(self) -> bool:
        """Return whether it is all of a disc, which has no line along which it could be divided."""
        return False

    @property
    @abstractmethod
    def area(self) -> float:
        """Return the area [m^2]."""

    @property
    @abstractmethod
    def lengths(self) -> Array:
        """Return the (arcs,) lengths of the centre line in each arc [m]."""

    @property
    def pieces(self) -> Pieces:
        """Return the pieces of the centre line: the arcs of each face, and whether it is closed."""
        return ((self.arcs, True),)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the name of each of the `pieces`."""
        return ("lip",)

    def whole(self, arcs: int) -> int:
        """Return the least number of arcs, from ``arcs`` up, of which each face has whole ones; itself where there is
        none."""
        return arcs

    @abstractmethod
    def cuts(self, shares: Array) -> tuple[Array, Array]:
        """Return the (n, 2) ends of the cuts at places (n,) on the inner, or left, line and on the other, from the
        centre [m]."""

    @abstractmethod
    def turns(self, shares: Array) -> Array:
        """Return the (n,) angles of the centre line about the centre at places (n,), from 0 on [rad]; none of a lip
        that is not one closed line which each ray from there crosses once."""

    @property
    def length(self) -> float:
        """Return the length of the centre line [m]."""
        return float(self.lengths.sum())

    @property
    def inner(self) -> float:
        """Return the least distance of its lines from the centre [m]."""
        return float(min(np.hypot(*line.T).min() for line in self.cuts(_middles(POINTS))))

    @property
    def outer(self) -> float:
        """Return the largest distance of its lines from the centre [m]."""
        return float(max(np.hypot(*line.T).max() for line in self.cuts(_middles(POINTS))))

    @property
    def edges(self) -> Array:
        """Return the (arcs + 1,) angles at which they begin and end, from 0 to 2 pi [rad]; none as of `turns`."""
        return self.turns(np.arange(self.arcs + 1) / self.arcs)

    @property
    def division(self) -> Division:
        """Return the division into ports."""
        return Division(self.arcs, self.rings)

    def line(self) -> Array:
        """Return the (arcs, n, 2) points of the centre line in each arc, from the centre [m]."""
        return self.lines_across(3)[:, 1]

    def lines(self) -> Array:
        """Return the (arcs, rings, n, 2) points of the centre lines of the parts, from the centre [m]: of one ring, of
        the lip."""
        left_ends, right_ends = self.cuts(self.places_in_arcs.ravel())
        inner, outer = self.edge_lines(len(left_ends))
        borders = _find_cut_shares(ring_borders(self.rings)[:, None], widening(inner, outer))  # (rings + 1, n)
        points = left_ends + ((borders[:-1] + borders[1:]) / 2)[..., None] * (right_ends - left_ends)
        return points.reshape(self.rings, self.arcs, -1, 2).transpose(1, 0, 2, 3)

    def lines_across(self, count: int) -> Array:
        """Return the (arcs, count, n, 2) points of equally spaced lines from the inner, or left, rim to the other, from
        the centre [m]; two are the rims."""
        left_ends, right_ends = self.cuts(self.places_in_arcs.ravel())
        points = left_ends + np.linspace(0, 1, count)[:, None, None] * (right_ends - left_ends)
        return points.reshape(count, self.arcs, -1, 2).transpose(1, 0, 2, 3)

    @property
    def places_in_arcs(self) -> Array:
        """Return the (arcs, n) places of `line`."""
        return _middles(self.arcs * math.ceil(POINTS / self.arcs)).reshape(self.arcs, -1)

    def edge_lines(self, count: int) -> tuple[Array, Array]:
        """Return both (count, 2, 2) ends of equal parts of both lines, from the centre [m]."""
        borders = np.arange(count)[:, None] + (WITHIN, 1 - WITHIN)
        left_ends, right_ends = self.cuts(borders.ravel() / count)
        return left_ends.reshape(count, 2, 2), right_ends.reshape(count, 2, 2)

    def _slices(self, count: int) -> tuple[Array, Array, Array]:
        """Return the (count, 2) left ends of the cuts in the middle of equal slices, (count, 2) what leads from there
        to the right ones, and (count,) how much the slices widen to the right: between the shares v of a cut and of the
        area on its left lies g = (1 - b) v + b v^2."""
        (left_ends, right_ends), (inner, outer) = self.cuts(_middles(count)), self.edge_lines(count)
        return left_ends, right_ends - left_ends, widening(inner, outer)

    def cells(self, along: int, across: int) -> tuple[Array, Array]:
        """Return the middles (arcs, rings, along across, 2) of equal cells of each part, from the centre [m]; areas
        (rings,)."""
        left_ends, cut, widening = self._slices(self.arcs * along)
        borders = ring_borders(self.rings)
        shares = borders[:-1, None] + np.diff(borders)[:, None] * (np.arange(across) + 0.5) / across
        at = _find_cut_shares(shares, widening[:, None, None])  # (around, rings, across)
        points = left_ends[:, None, None] + at[..., None] * cut[:, None, None]
        split = points.reshape(self.arcs, along, self.rings, across, 2).transpose(0, 2, 1, 3, 4)
        areas = self.area * np.diff(borders) / (self.arcs * along * across)
        return split.reshape(self.arcs, self.rings, along * across, 2), areas

    def patches(self, centre: tuple[float, float]) -> Mapping[str, Patch]:
        """Return the patches by port; ``centre``: that of the body's own contact, from which the lip is off by
        ``offset`` [m]."""
        x, gauss = np.polynomial.legendre.leggauss(ACROSS)
        each = max(OF_AN_ARC, math.ceil(AROUND / self.arcs))
        way = turned_over if self.side else np.asarray
        left_ends, cut, widening = self._slices(self.arcs * each)
        borders, patches = ring_borders(self.rings), {}
        for arc, name in enumerate(self.division.arc_names):
            of = slice(arc * each, (arc + 1) * each)
            at = _find_cut_shares(borders[:, None], widening[of])
            for k, port in enumerate(ring_names(name, self.rings)):
                low, high = at[k : k + 2]
                shares = (low + high) / 2 + (high - low) / 2 * x[:, None]
                own = (left_ends[of] + shares[..., None] * cut[of]).reshape(-1, 2)
                points = np.asarray(centre) + self.offset + way(own)
                density = 1 + widening[of] * (2 * shares - 1)
                weights = gauss[:, None] * (high - low) / 2 * density * self.area / (self.arcs * each)
                patches[self.side + port] = Patch(points, weights.ravel())
        return patches


@dataclass(frozen=True)
class Lip(AnyLip):
    """A ring, or a disc where it is twice as wide as its mean radius, divided into arcs and rings.

    Attributes:
        radius: its mean [m].
        width: 0 < width <= 2 radius [m].
        arcs, rings, offset, side: as of `AnyLip`.

    Raises:
        ModelError: a width outside its range, numbers of parts below one or above `MOST_PORTS` together.
    """

    radius: float
    width: float
    arcs: int = 1
    rings: int = 1
    offset: tuple[float, float] = (0.0, 0.0)
    side: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius) and 0 < self.width <= 2 * self.radius * (1 + 1e-12)):
            raise ModelError(
                f"ring of mean radius {1e3 * self.radius:g} mm: a width of {1e3 * self.width:g} mm must be positive "
                f"and at most {2e3 * self.radius:g} mm"
            )
        super().__post_init__()

    @staticmethod
    def disc(radius: float) -> Lip:
        """Return all of a disc."""
        return Lip(radius / 2, radius)

    @property
    def content(self) -> Mapping[str, object]:
        return {name: value for name, value in vars(self).items() if name != "side"}

    @property
    def is_round(self) -> bool:
        return True

    @property
    def is_disc(self) -> bool:
        return self.inner == 0

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
    def angles(self) -> Array:
        """Return the (arcs,) angles of their middles [rad]."""
        return self.turns(_middles(self.arcs))

    @property
    def area(self) -> float:
        return 2 * math.pi * self.radius * self.width

    def cuts(self, shares: Array) -> tuple[Array, Array]:
        angles = self.turns(shares)
        rays = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        return self.inner * rays, self.outer * rays

    def turns(self, shares: Array) -> Array:
        return np.asarray(2 * np.pi * shares)


def _middles(count: int) -> Array:
    """Return the (count,) middles of equal parts."""
    return np.asarray((np.arange(count) + 0.5) / count)


def _find_cut_shares(areas: Array, widening: Array) -> Array:
    """Return the shares of a cut at shares of the area on its left, where it widens as `AnyLip._slices` has it."""
    straight = 1 - widening
    return np.asarray(2 * areas / np.maximum(straight + np.sqrt(straight**2 + 4 * widening * areas), 1e-300))


def widening(inner: Array, outer: Array) -> Array:
    """Return (n,) widening as of `AnyLip._slices`, of slices between (n, 2, 2) ends of their inner and outer edges."""
    cuts, ways = outer - inner, np.diff(inner + outer, axis=1)[:, 0] / 2
    mean, more = (cuts[:, 0] + cuts[:, 1]) / 2, cuts[:, 1] - cuts[:, 0]
    whole = np.abs(cross(mean, ways))
    ratio = np.divide(cross(mean, more), 2 * whole, out=np.zeros(len(whole)), where=whole > 0)
    return np.asarray(np.clip(ratio, -1.0, 1.0))
