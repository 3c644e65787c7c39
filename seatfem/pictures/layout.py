"""Layout of the drawing of a scene: positions of the bodies, and of the views on the sheet.

x runs along the reed to its tip, y across it, z from the seat to the reed; the origin in plan is the centre of the
reed's contact, z = 0 the struck face of the seat.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from impact.greens.base import Array
from impact.quantities import in_digits
from seatfem.structures.outlines import BodyViews, Size, View, covered_share

Way = Literal[-1, 0, 1]
"""Direction of an arrow: -1 towards the seat, 0 unknown or both, 1 away from the seat."""


@dataclass(frozen=True, eq=False)
class Placed:
    """Body with its position.

    Attributes:
        role: "seat", "reed" or "stopper".
        views: outlines; those of a reed or a stopper are already turned upside down.
        at: (x, y) of the centre of its contact [m].
        height: z of its struck face [m].
    """

    role: str
    views: BodyViews
    at: tuple[float, float] = (0.0, 0.0)
    height: float = 0.0


@dataclass(frozen=True)
class Action:
    """Load or motion of a body: its words, the range of x on which it acts [m], and its direction.

    ``detail``: further words that are not in the picture.
    """

    words: str
    low: float
    high: float
    way: Way
    detail: str = ""


@dataclass(frozen=True, eq=False)
class Tilt:
    """Tilt of a face over the undeformed reed.

    Attributes:
        body: the seat or the stopper.
        angle, axis: between the planes, and direction of the axis about which it is tilted [rad].
        corners: (n, 2) places on the rims of the face [m].
    """

    body: Placed
    angle: float
    axis: float
    corners: Array

    @property
    def nearest(self) -> Array:
        """Return the (2,) corner with the smallest gap [m]."""
        across = np.array([-np.sin(self.axis), np.cos(self.axis)])
        return np.asarray(self.corners[int(np.argmin(np.sign(self.angle) * (self.corners @ across)))])


@dataclass(frozen=True, eq=False)
class Layout:
    """Bodies, dimensions, loads and words of the drawing of a scene.

    Attributes:
        title: title of the scene.
        seat, reed, stopper: the bodies; ``None``: there is no stopper.
        gap: opening between the undeformed bodies [m].
        lift: distance from the undeformed reed to the stopper [m]; ``None`` without one.
        start: x and deflection (n, 2) of the reed at its release [m]; ``None``: undeformed.
        actions: loads and motions.
        springs: positions (n, 2) of valve springs on the reed [m].
        arcs: lines (n, 2, 2) across the lip between its arcs [m].
        tilts: faces that are tilted.
        notes: sentences at the foot of the drawing.
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
    tilts: tuple[Tilt, ...]
    notes: tuple[str, ...]

    @property
    def bodies(self) -> tuple[Placed, ...]:
        """Return the seat, the reed and, if present, the stopper."""
        return (self.seat, self.reed) if self.stopper is None else (self.seat, self.reed, self.stopper)

    @property
    def covered(self) -> float | None:
        """Return the share of the seat's struck face below the reed in plan; ``None``: a body has no outline."""
        return covered_share(self.seat.views, self.reed.views, self.seat.at)

    def top_of_reed(self) -> float:
        """Return z of the reed's upper side above the contact [m]."""
        return self.gap + max((float(loop[:, 1].max()) for loop in self.reed.views.section), default=0.0)


WIDTH: Final = 8.2  # width of the sheet [inch]
LEFT, RIGHT = 1.35, 1.75  # margins beside the views for names and heights [inch]
DEEPEST, PLAN, TALLEST = 1.5, 3.0, 1.7  # largest heights [inch]: seat in section, plan, body above the seat
KEPT: Final = 0.75  # depth next to the contact [inch] that stays to scale if a deep body is shortened
THIN: Final = 0.075  # least drawn thickness of a reed [inch]
OPEN: Final = (0.13, 0.85)  # least and largest drawn height of an opening [inch]
SYMBOL: Final = 0.5  # height of a symbol [inch]
ROW: Final = 0.2  # distance between dimensions [inch]
LOADS: Final = 0.36  # distance between loads [inch]
LINE: Final = 0.145  # distance between lines of text [inch]
LETTER: Final = 0.062  # mean width of a letter of 7.5 points [inch]
NICE: Final = (1.0, 2.0, 5.0)


@dataclass(frozen=True)
class Zone:
    """Range of heights drawn with its own factor: name, ends [m], and height on the sheet [inch]."""

    name: str
    low: float
    high: float
    inches: float

    @property
    def is_shortened(self) -> bool:
        """Return whether a long body is shortened in this zone."""
        return self.name in ("depth", "height")


@dataclass(frozen=True, eq=False)
class Frame:
    """Positions of the parts of a drawing on its sheet [inch].

    Attributes:
        scale: inch per metre along x and in plan.
        x: position of the contact; plan, section: heights of the contact in both views.
        zones: ranges of heights, the lowest first.
        height: height of the sheet.
        rows: dimensions below the section, and below the plan, row by row.
        top: upper end of the section.
    """

    scale: float
    x: float
    plan: float
    section: float
    zones: tuple[Zone, ...]
    height: float
    rows: dict[View, tuple[tuple[tuple[Placed, Size], ...], ...]]
    top: float

    @staticmethod
    def from_layout(layout: Layout) -> Frame:
        low, high = extent_of(layout)
        wide, deep = high - low
        scale = min((WIDTH - LEFT - RIGHT) / max(wide, 1e-9), PLAN / max(deep, 1e-9))
        reed = layout.top_of_reed() - layout.gap
        if 0.2 * wide < reed < 2 * wide:
            scale = min(scale, TALLEST / reed)
        zones = tuple(_zones(layout, scale))
        x = LEFT + ((WIDTH - LEFT - RIGHT) - scale * wide) / 2 - scale * float(low[0])
        rows: dict[View, tuple[tuple[tuple[Placed, Size], ...], ...]] = {
            "section": _rows(layout, "section", scale), "plan": _rows(layout, "plan", scale),
        }  # fmt: skip
        notes = 1 + len(layout.notes) + bool(factors_of(zones, scale)) + any(zone.is_shortened for zone in zones)
        plan_low = 0.2 + LINE * notes + ROW * len(rows["plan"]) + 0.3
        plan = plan_low - scale * float(low[1])
        section_low = plan + scale * float(high[1]) + 0.42 + ROW * (len(rows["section"]) + 0.5) + 0.12
        below = sum(zone.inches for zone in zones if zone.high <= 0)
        section = section_low + below
        top = section + sum(zone.inches for zone in zones if zone.low >= 0)
        if len(layout.springs):
            to_reed = sum(zone.inches for zone in zones if 0 <= zone.low < layout.top_of_reed())
            symbol_height = SYMBOL if layout.reed.views.symbol else 0.0
            top = max(top, section + to_reed + symbol_height + SYMBOL + 0.1)
        height = top + LOADS * len(layout.actions) + 0.75
        return Frame(scale, x, plan, section, zones, height, rows, top)

    def up(self, z: float | Array) -> Array:
        """Return the height on the sheet [inch] of a height z in the section [m]."""
        heights = [self.zones[0].low] + [zone.high for zone in self.zones]
        inches = np.concatenate([[0.0], np.cumsum([zone.inches for zone in self.zones])])
        zero = float(np.interp(0.0, heights, inches))
        return np.asarray(self.section - zero + np.interp(z, heights, inches))

    def place(self, view: View, line: Array, body: Placed) -> Array:
        """Return the positions (n, 2) on the sheet [inch] of a line (n, 2) of a body in a view."""
        x = self.x + self.scale * (line[:, 0] + body.at[0])
        if view == "section":
            return np.column_stack([x, self.up(line[:, 1] + body.height)])
        return np.column_stack([x, self.plan + self.scale * (line[:, 1] + body.at[1])])


def extent_of(layout: Layout) -> tuple[Array, Array]:
    """Return the lowest and highest corner (2,) of the plan of all bodies; at least a few millimetres apart."""
    ends = [np.array(body.views.extent) + body.at for body in layout.bodies]
    low, high = np.min([each[0] for each in ends], axis=0), np.max([each[1] for each in ends], axis=0)
    least = max(0.15 * float((high - low).max()), 1e-3) / 2
    return np.minimum(low, -least), np.maximum(high, least)


def _nice(factor: float) -> float:
    """Return the least of 1, 2, 5, 10, ... that is at least ``factor``."""
    power = 10.0 ** np.floor(np.log10(max(factor, 1.0)))
    return float(next(each * power for each in (*NICE, 10.0) if each * power >= factor * (1 - 1e-9)))


def _zones(layout: Layout, scale: float) -> Iterator[Zone]:
    """Yield the zones from below: seat, gap, reed, space up to the stopper, stopper."""
    depth = layout.seat.views.depth
    if depth == 0:
        yield Zone("seat", -1e-3, 0.0, SYMBOL + 0.2)
    elif depth * scale <= DEEPEST:
        yield Zone("seat", -depth, 0.0, depth * scale)
    else:
        yield Zone("depth", -depth, -KEPT / scale, DEEPEST - KEPT)
        yield Zone("seat", -KEPT / scale, 0.0, KEPT)
    if layout.gap > 0:
        yield Zone("gap", 0.0, layout.gap, _opened(layout.gap, scale))
    base, top = layout.gap, layout.top_of_reed()
    if top == base:
        top = base + 1e-3
        yield Zone("mass", base, top, SYMBOL)
    elif (top - base) * scale > TALLEST:
        yield Zone("reed", base, base + KEPT / scale, KEPT)
        yield Zone("height", base + KEPT / scale, top, TALLEST - KEPT)
    else:
        inches = (top - base) * scale
        yield Zone("reed", base, top, inches * _nice(THIN / inches))
    rise = 0.0 if layout.start is None else float(layout.start[:, 1].max())
    above = max(layout.lift or 0.0, rise)
    if above > 0:
        yield Zone("lift", top, top + above, _opened(above, scale))
    if layout.stopper is not None:
        roof = max((float(loop[:, 1].max()) for loop in layout.stopper.views.section), default=0.0)
        over = top + (layout.lift or 0.0) + roof
        low = top + above
        if roof == 0:
            yield Zone("stopper", low, low + 1e-3, SYMBOL + 0.2)
        elif over > low:
            yield Zone("stopper", low, over, min((over - low) * scale, DEEPEST))


def _opened(height: float, scale: float) -> float:
    """Return the drawn height of an opening [inch], exaggerated by a factor of `_nice` or to the limit of `OPEN`."""
    inches = height * scale
    return min(inches * _nice(OPEN[0] / inches), OPEN[1])


def factors_of(zones: Sequence[Zone], scale: float) -> str:
    """Return the factors by which heights are exaggerated, in words."""
    words = {"gap": "gap", "reed": "reed", "lift": "lift above the reed"}
    factors = []
    for zone in zones:
        factor = zone.inches / ((zone.high - zone.low) * scale)
        if zone.name in words and abs(factor - 1) > 0.02:
            factors.append(f"{words[zone.name]} x {in_digits(factor, 2)}")
    return ", ".join(factors)


def _rows(layout: Layout, view: View, scale: float) -> tuple[tuple[tuple[Placed, Size], ...], ...]:
    """Return the dimensions along x in rows without overlap, the shortest nearest to the body."""
    sizes = [
        (body, size)
        for body in layout.bodies
        for size in body.views.sizes
        if size.axis == 0 and size.view == view and body.role in (("seat", "reed") if view == "plan" else ("seat",))
    ]
    rows: list[list[tuple[Placed, Size]]] = []
    occupied: list[list[tuple[float, float]]] = []
    for body, size in sorted(sizes, key=lambda each: each[1].value):
        low, high = _room(body, size, scale)
        for row, ranges in zip(rows, occupied, strict=True):
            if all(high < a or low > b for a, b in ranges):
                row.append((body, size))
                ranges.append((low, high))
                break
        else:
            rows.append([(body, size)])
            occupied.append([(low, high)])
    return tuple(tuple(row) for row in rows)


def _room(body: Placed, size: Size, scale: float) -> tuple[float, float]:
    """Return the range along x that a dimension occupies with its text [inch]."""
    low, high = (scale * (end + body.at[0]) for end in (size.low, size.high))
    text = LETTER * len(size.text) + 0.1
    if text < high - low:
        return low, high
    return low - 0.22, high + 0.22 + text
