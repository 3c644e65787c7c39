"""Layout of the drawing of a scene: bodies in their places, what moves them, and words; lengths in metres.

x goes along the reed to its tip, y across it, z from the seat to the reed; the middle of the reed's contact is the
origin in plan, the seat's struck face z = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from impact.greens.base import Array
from seatfem.structures.outlines import BodyViews, covered_share

Way = Literal[-1, 0, 1]
"""Of an arrow: towards the seat, not known or both, away from the seat."""


@dataclass(frozen=True, eq=False)
class Placed:
    """A body in its place.

    Attributes:
        role: "seat", "reed" or "stopper".
        views: its outlines; those of a reed or a stopper are turned over already.
        at: (x, y) of its contact's middle [m].
        height: z of its struck face [m].
    """

    role: str
    views: BodyViews
    at: tuple[float, float] = (0.0, 0.0)
    height: float = 0.0


@dataclass(frozen=True)
class Action:
    """Load or motion of a body: its words, from where to where along x it acts [m], and which way.

    ``detail``: further words that are not in the picture.
    """

    words: str
    low: float
    high: float
    way: Way
    detail: str = ""


@dataclass(frozen=True, eq=False)
class Layout:
    """A scene, as it is drawn.

    Attributes:
        title: of the scene.
        seat, reed, stopper: the bodies; ``None``: there is no stopper.
        gap: opening between the undeformed bodies [m].
        lift: from the undeformed reed to the stopper [m]; ``None`` without one.
        start: (n, 2) x and deflection of the reed as it is released [m]; ``None``: undeformed.
        actions: loads and motions.
        springs: (n, 2) places of valve springs on the reed [m].
        arcs: (n, 2, 2) lines across the lip between its arcs [m].
        tilt: angle between lip and reed and the direction about which it is tilted [rad]; ``None``: parallel.
        notes: sentences for the drawing's foot.
    """

    title: str
    seat: Placed
    reed: Placed
    stopper: Placed | None
    gap: float
    lift: float | None
    start: Array | None
    actions: tuple[Action, ...]
    springs: Array
    arcs: Array
    tilt: tuple[float, float] | None
    notes: tuple[str, ...]

    @property
    def bodies(self) -> tuple[Placed, ...]:
        """Return the seat, the reed and, where there is one, the stopper."""
        return (self.seat, self.reed) if self.stopper is None else (self.seat, self.reed, self.stopper)

    @property
    def covered(self) -> float | None:
        """Return the share of the seat's struck face that lies below the reed in plan; ``None``: no outline."""
        return covered_share(self.seat.views, self.reed.views, self.seat.at)

    def top_of_reed(self) -> float:
        """Return z of the reed's upper side over the contact [m]."""
        return self.gap + max((float(loop[:, 1].max()) for loop in self.reed.views.section), default=0.0)
