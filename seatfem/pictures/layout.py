"""Layout of the drawing of a scene: positions of the bodies, and of the views on the sheet.

x runs along the reed to its tip, y across it, z from the seat to the reed; the origin in plan is the centre of the
reed's contact, z = 0 the struck face of the seat.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from impact.greens.base import Array
from impact.pictures.drawing import BLUE, GREEN, ORANGE, PURPLE
from impact.quantities import in_digits
from seatfem.structures.outlines import BodyViews, Size, View

Way = Literal[-1, 0, 1]
"""Direction of an arrow: -1 towards the seat, 0 unknown or both, 1 away from the seat."""


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
        role: "seat" or "stopper".
        body: that body.
        angle, axis: between the planes, and direction of the axis about which it is tilted [rad].
        corners: (n, 2) places on the rims of the face [m].
    """

    role: str
    body: BodyViews
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
        bodies: seat, reed and, if there is one, stopper, by these roles, in their places.
        gap: opening between the undeformed bodies [m].
        lift: distance from the undeformed reed to the stopper [m]; 0 without one.
        start: x and deflection (n, 2) of the reed at its release [m]; (0, 2): undeformed.
        actions: loads and motions.
        springs: positions (n, 2) of valve springs on the reed [m].
        arcs: lines (n, 2, 2) across the lip between its arcs [m].
        tilts: faces that are tilted.
        notes: sentences at the foot of the drawing.
        lands: names of ports beside each other, with x and y of their centres [m].
    """

    title: str
    bodies: Mapping[str, BodyViews]
    gap: float
    lift: float
    start: Array
    actions: tuple[Action, ...]
    springs: Array
    arcs: Array
    tilts: tuple[Tilt, ...]
    notes: tuple[str, ...]
    lands: tuple[tuple[str, float, float], ...] = ()

    @property
    def seat(self) -> BodyViews:
        """Return the seat."""
        return self.bodies["seat"]

    @property
    def reed(self) -> BodyViews:
        """Return the reed."""
        return self.bodies["reed"]

    @property
    def extent(self) -> tuple[Array, Array]:
        """Return the lowest and highest corner (2,) of the plan of all bodies; at least a few millimetres apart."""
        ends = np.array([body.extent for body in self.bodies.values()])
        low, high = ends[:, 0].min(axis=0), ends[:, 1].max(axis=0)
        least = max(0.15 * float((high - low).max()), 1e-3) / 2
        return np.minimum(low, -least), np.maximum(high, least)

    @property
    def top_of_reed(self) -> float:
        """Return z of the reed's upper side above the contact [m]."""
        return self.gap + NOMINAL if self.reed.symbol else self.reed.heights[1]

    def sizes(self, view: View, axis: int) -> list[Size]:
        """Return the dimensions of a view along an axis: in section the lengths of the seat alone, and the heights of
        all bodies and openings; in plan those of seat and reed."""
        roles = (
            ("seat",) if (view, axis) == ("section", 0) else ("seat", "reed") if view == "plan" else tuple(self.bodies)
        )
        sizes = [size for role in roles for size in self.bodies[role].sizes if (size.view, size.axis) == (view, axis)]
        if (view, axis) != ("section", 1):
            return sizes
        top = self.top_of_reed
        sizes.append(Size("section", 1, 0.0, self.gap, 0.0, "gap {}"))
        if "stopper" in self.bodies:
            sizes.append(Size("section", 1, top, top + self.lift, self.bodies["stopper"].origin[0], "stopper {}"))
        if len(self.start):
            x, rise = self.start[int(np.argmax(np.abs(self.start[:, 1])))].tolist()
            sizes.append(Size("section", 1, top, top + rise, x, "start {}"))
        return sizes


WIDTH: Final = 6.8  # width of the sheet [inch]: narrow, so that it is legible in a column of a page
LEFT, RIGHT = 1.3, 2.1  # margins beside the views for names and heights [inch]
DEEPEST, PLAN, TALLEST = 1.5, 3.0, 1.7  # largest heights [inch]: seat in section, plan, body above the seat
KEPT: Final = 0.75  # depth next to the contact [inch] that stays to scale if a deep body is shortened
THIN: Final = 0.075  # least drawn thickness of a reed [inch]
OPEN: Final = (0.13, 0.85)  # least and largest drawn height of an opening [inch]
SYMBOL: Final = 0.5  # height of a symbol [inch]
NOMINAL: Final = 1e-3  # height of a symbol in the section [m]
ROW: Final = 0.25  # distance between dimensions [inch]
LOADS: Final = 0.42  # distance between loads [inch]
LINE: Final = 0.19  # distance between lines of text [inch]
SMALL: Final = 10.0  # size of small letters [points]
LETTER: Final = 0.082  # their mean width [inch]
EDGE: Final = 0.15  # margin of the sheet [inch]
LOAD: Final = "#8C2D63"  # colour of loads and motions
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
    rows: Mapping[View, Sequence[Sequence[Size]]]
    top: float

    @staticmethod
    def from_layout(layout: Layout) -> Frame:
        low, high = layout.extent
        wide, deep = high - low
        scale = min((WIDTH - LEFT - RIGHT) / max(wide, 1e-9), PLAN / max(deep, 1e-9))
        reed = layout.top_of_reed - layout.gap
        if 0.2 * wide < reed < 2 * wide:
            scale = min(scale, TALLEST / reed)
        zones = tuple(_zones(layout, scale))
        x = LEFT + ((WIDTH - LEFT - RIGHT) - scale * wide) / 2 - scale * float(low[0])
        in_section, in_plan = (_rows(layout.sizes(view, 0), scale) for view in ("section", "plan"))
        notes = len(key_rows(layout)) + len(foot_lines(layout, zones, scale))
        plan = 0.5 + LINE * notes + ROW * len(in_plan) - scale * float(low[1])
        section = plan + scale * float(high[1]) + 0.62 + ROW * (len(in_section) + 0.5)
        section += sum(zone.inches for zone in zones if zone.high <= 0)
        top = section + sum(zone.inches for zone in zones if zone.low >= 0)
        if len(layout.springs):
            to_reed = sum(zone.inches for zone in zones if 0 <= zone.low < layout.top_of_reed)
            top = max(top, section + to_reed + SYMBOL + 0.1)
        height = top + LOADS * len(layout.actions) + 0.85
        return Frame(scale, x, plan, section, zones, height, {"section": in_section, "plan": in_plan}, top)

    def up(self, z: float | Array) -> Array:
        """Return the height on the sheet [inch] of a height z in the section [m]."""
        heights = [self.zones[0].low] + [zone.high for zone in self.zones]
        inches = np.concatenate([[0.0], np.cumsum([zone.inches for zone in self.zones])])
        zero = float(np.interp(0.0, heights, inches))
        return np.asarray(self.section - zero + np.interp(z, heights, inches))

    @property
    def bottom(self) -> float:
        """Return the lower end of the section."""
        return float(self.up(self.zones[0].low))

    def place(self, view: View, line: Array) -> Array:
        """Return the positions (n, 2) on the sheet [inch] of a line (n, 2) in a view."""
        heights = self.up(line[:, 1]) if view == "section" else self.plan + self.scale * line[:, 1]
        return np.column_stack([self.x + self.scale * line[:, 0], heights])


def _nice(factor: float) -> float:
    """Return the least of 1, 2, 5, 10, ... that is at least ``factor``."""
    power = 10.0 ** np.floor(np.log10(max(factor, 1.0)))
    return float(next(each * power for each in (*NICE, 10.0) if each * power >= factor * (1 - 1e-9)))


def _zones(layout: Layout, scale: float) -> Iterator[Zone]:
    """Yield the zones from below: seat, gap, reed, space up to the stopper, stopper."""
    depth = -layout.seat.heights[0]
    if layout.seat.symbol:
        yield Zone("seat", -NOMINAL, 0.0, SYMBOL + 0.2)
    elif depth * scale <= DEEPEST:
        yield Zone("seat", -depth, 0.0, depth * scale)
    else:
        yield Zone("depth", -depth, -KEPT / scale, DEEPEST - KEPT)
        yield Zone("seat", -KEPT / scale, 0.0, KEPT)
    if layout.gap > 0:
        yield Zone("gap", 0.0, layout.gap, _opened(layout.gap, scale))
    base, top = layout.gap, layout.top_of_reed
    if layout.reed.symbol:
        yield Zone("mass", base, top, SYMBOL)
    elif (top - base) * scale > TALLEST:
        yield Zone("reed", base, base + KEPT / scale, KEPT)
        yield Zone("height", base + KEPT / scale, top, TALLEST - KEPT)
    else:
        inches = (top - base) * scale
        yield Zone("reed", base, top, inches * _nice(THIN / inches))
    above = max(layout.lift, float(layout.start[:, 1].max(initial=0.0)))
    if above > 0:
        yield Zone("lift", top, top + above, _opened(above, scale))
    if (stopper := layout.bodies.get("stopper")) is not None:
        low, roof = top + above, stopper.heights[1]
        if stopper.symbol:
            yield Zone("stopper", low, low + NOMINAL, SYMBOL + 0.2)
        elif roof > low:
            yield Zone("stopper", low, roof, min((roof - low) * scale, DEEPEST))


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


def foot_lines(layout: Layout, zones: Sequence[Zone], scale: float) -> list[str]:
    """Return the lines at the foot of the sheet: breaks, the factors of exaggerated heights, and the notes."""
    words = ["bodies with a wavy break are shortened"] * any(zone.is_shortened for zone in zones)
    if factors := factors_of(zones, scale):
        words.append(f"heights not to scale: {factors}; lengths and the seat to scale")
    most = int((WIDTH - 2 * EDGE) / LETTER)
    return [line for sentence in (*words, *layout.notes) for line in textwrap.wrap(sentence, most)]


def key_rows(layout: Layout) -> list[list[tuple[float, str, str]]]:
    """Return the key of colours in rows as wide as the sheet: the place of each along its row, its colour and words."""
    rows, x = list[list[tuple[float, str, str]]]([[]]), EDGE
    for colour, words in _key(layout):
        end = x + 0.26 + LETTER * len(words)
        if rows[-1] and end > WIDTH - EDGE:
            rows.append([])
            x, end = EDGE, EDGE + end - x
        rows[-1].append((x, colour, words))
        x = end + 0.18
    return rows


def _key(layout: Layout) -> Iterator[tuple[str, str]]:
    yield ORANGE, "contact face"
    yield BLUE, "clamped"
    if layout.reed.contact:
        yield GREEN, "the reed's own face"
    tilted = [tilt.role for tilt in layout.tilts]
    if "seat" in tilted:
        yield GREEN, "axis of tilt, dot: smallest gap"
    if len(layout.start):
        yield GREEN, "reed at the start"
    if "stopper" in layout.bodies:
        yield PURPLE, "stopper, its axis of tilt" if "stopper" in tilted else "stopper"
    if layout.actions:
        yield LOAD, "load, spring, motion" if len(layout.springs) else "load, motion"


def _rows(sizes: Sequence[Size], scale: float) -> list[list[Size]]:
    """Return dimensions along x in rows without overlap, the shortest nearest to the body."""
    rows: list[tuple[list[Size], list[tuple[float, float]]]] = []
    for size in sorted(sizes, key=lambda size: size.value):
        low, high = scale * size.low, scale * size.high
        if (text := width_of(size.text)) >= high - low:
            low, high = low - 0.22, high + 0.22 + text
        free = (row for row in rows if all(high < a or low > b for a, b in row[1]))
        if (row := next(free, None)) is None:
            rows.append(row := ([], []))
        row[0].append(size)
        row[1].append((low, high))
    return [row for row, _ in rows]


def width_of(words: str) -> float:
    """Return the width that words of small letters need [inch]."""
    return LETTER * len(words) + 0.1
