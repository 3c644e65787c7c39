"""Technical drawing of a scene: a section through the contact along the reed, and below it the plan.

Both views are above each other at the same scale along x, as in technical drawings. Heights of a thin reed and of small
openings are exaggerated, zone by zone, by factors that are written on the sheet.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from impact.greens.base import Array
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, load_matplotlib, sheet
from seatfem.pictures.layout import (
    EDGE,
    LETTER,
    LINE,
    LOAD,
    LOADS,
    ROW,
    SMALL,
    SYMBOL,
    WIDTH,
    Action,
    Frame,
    Layout,
    Tilt,
    Zone,
    foot_lines,
    key_rows,
    width_of,
)
from seatfem.structures.outlines import BodyViews, Loops, Size, View, closed
from seatfem.structures.shapes.loops import are_holes, polygon_area

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, PALE, HATCH = "#30343A", "#E4E6E9", "#9BA1A9"
BESIDE: Final = 0.45  # distance from a stopper's symbol within which a spring is drawn next to it [inch]
LEVEL: Final = 1e-6  # distance from the section's plane, over the springs' reach, within which a spring lies in it
COLOURS: Final = {"seat": "#D9DCE0", "reed": "#A9D3F0", "stopper": "#EBCFE0"}
HATCHES: Final = {"seat": "////", "reed": "", "stopper": "\\\\\\\\"}
NAMED: Final = {"seat": -0.3, "reed": 0.25, "stopper": 0.3}  # distance of a symbol's name from its struck side [inch]
BOX: Final = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
DOWN, UP = np.array([0.0, -1.0]), np.array([0.0, 1.0])


def draw_layout(layout: Layout, path: str | os.PathLike[str]) -> None:
    """Draw section and plan of a scene to a file: .png, .svg or .pdf.

    Raises:
        PictureError: matplotlib is missing, or cannot write this format.
    """
    frame = Frame.from_layout(layout)
    with sheet(path, WIDTH, frame.height) as figure:
        figure.set_layout_engine("none")
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0.0, WIDTH), ylim=(0.0, frame.height))
        axes.set_axis_off()
        _Sheet(axes, layout, frame).draw()


class _Sheet:
    """One layout drawn on axes in inches."""

    def __init__(self, axes: Axes, layout: Layout, frame: Frame) -> None:
        self._axes, self._layout, self._frame = axes, layout, frame
        self._left, self._right = (frame.x + frame.scale * float(end[0]) for end in layout.extent)

    def draw(self) -> None:
        """Draw both views, dimensions, loads and words."""
        self._title()
        self._plan()
        self._section()
        for view in ("section", "plan"):
            self._lengths(view)
            self._heights(view)
        self._names()
        for number, action in enumerate(self._layout.actions):  # one row each above the section
            self._action(action, self._frame.top + 0.28 + LOADS * number)
        self._foot()

    # Primitives

    def _fill(self, loops: Sequence[Array], **style: Any) -> None:
        """Fill the points that lie in an odd number of loops."""
        if not loops:
            return
        library = load_matplotlib()
        ways = zip(loops, are_holes(loops), strict=True)
        turned = closed(loop[:: 1 if (polygon_area(loop) > 0) != is_hole else -1] for loop, is_hole in ways)
        whole = library.path.Path.make_compound_path(*(library.path.Path(each, closed=True) for each in turned))
        self._axes.add_patch(library.patches.PathPatch(whole, **style))

    def _line(self, points: Array, colour: str = INK, width: float = 0.7, **style: Any) -> None:
        self._axes.plot(*np.asarray(points).T, color=colour, linewidth=width, **style)

    def _lines(self, lines: Iterable[Array], **style: Any) -> None:
        self._axes.add_collection(load_matplotlib().collections.LineCollection(list(lines), **style))

    def _text(self, x: float, y: float, words: str, **style: Any) -> None:
        self._axes.text(x, y, words, **{"fontsize": SMALL, "color": INK, "va": "center", **style})

    def _arrow(self, start: Sequence[float], end: Sequence[float], colour: str = GREY, style: str = "-|>") -> None:
        look = {"linewidth": 0.8, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8}
        arrow = {"arrowstyle": style, "color": colour, **look}
        self._axes.annotate("", (end[0], end[1]), (start[0], start[1]), arrowprops=arrow)

    def _measure(self, low: float, high: float, level: float, *, upright: bool, inside: bool) -> None:
        """Draw the line of a dimension, its arrows between its ends or, where these are close, outside."""
        outer = 0.12 if upright else 0.16
        a, b, c, d = ((level, end) if upright else (end, level) for end in (low - outer, low, high, high + outer))
        if inside:
            self._arrow(b, c, style="<|-|>")
        elif high > low:
            self._line(np.array([b, c]), GREY)
            self._arrow(a, b)
            self._arrow(d, c)

    def _ground(self, line: Array, away: Array) -> None:
        """Draw a clamped line with hatching on the side ``away`` from the body."""
        self._line(line, BLUE, 1.8, zorder=6, solid_capstyle="butt")
        line = line[::-1] if tuple(line[-1]) < tuple(line[0]) else line  # so that all strokes lean the same way
        steps = np.diff(line, axis=0)
        lengths = np.hypot(*steps.T)
        ends = np.append(0.0, np.cumsum(lengths))
        places = np.arange(0.04, ends[-1], 0.08)
        feet = np.column_stack([np.interp(places, ends, column) for column in line.T])
        along = (steps / np.maximum(lengths, 1e-12)[:, None])[np.searchsorted(ends[1:], places)]
        self._lines(np.stack([feet, feet + 0.085 * (away - 0.7 * along)], axis=1), colors=BLUE, linewidths=0.6)

    def _spring(self, x: float, low: float, high: float, colour: str = INK, **style: Any) -> None:
        """Draw a vertical zigzag between two heights."""
        shares = np.array([0.0, 0.15, *np.linspace(0.2, 0.8, 7), 0.85, 1.0])
        sides = np.array([0.0, 0.0, *(0.09 * (-1.0) ** np.arange(7)), 0.0, 0.0])
        self._line(np.column_stack([x + sides, low + shares * (high - low)]), colour, 1.0, **style)

    def _placed(self, view: View, lines: Iterable[Array]) -> Loops:
        return tuple(self._frame.place(view, line) for line in lines)

    # Views

    def _title(self) -> None:
        frame = self._frame
        title, small = self._layout.title, 1.1 * SMALL
        self._text(EDGE, frame.height - 0.2, title, fontsize=min(13.0, 700 / max(len(title), 1)), fontweight="bold")
        self._text(EDGE, frame.height - 0.47, "Section A–A along the reed through the contact", fontsize=small)
        y = frame.plan + frame.scale * float(self._layout.extent[1][1]) + 0.22
        self._text(EDGE, y, "Plan, seen from above", fontsize=small)

    def _section(self) -> None:
        frame, layout = self._frame, self._layout
        for role, body in layout.bodies.items():
            if body.symbol:
                self._symbol(role, body)
                continue
            loops = self._placed("section", map(_fine, body.section))
            hatched = {"hatch": HATCHES[role], "edgecolor": HATCH, "linewidth": 0.0, "zorder": 3}
            self._fill(loops, facecolor=COLOURS[role], **hatched)
            self._fill(loops, facecolor="none", edgecolor=INK, linewidth=0.9, zorder=3.2)
            middle = np.concatenate(loops).mean(axis=0)
            for line in self._placed("section", body.held):
                self._ground(line, _outward(line, middle))
            if body.bedded:
                self._bed(np.concatenate(self._placed("section", body.bedded)))
            for line in self._placed("section", body.struck):
                self._line(line, GREEN if role == "reed" else ORANGE, 2.4, zorder=7, solid_capstyle="butt")
            if role != "seat":
                self._root(body)
        if len(layout.start):  # underside of the reed at its release
            underside = frame.place("section", layout.start + np.array([0.0, layout.top_of_reed]))
            self._line(underside, GREEN, 1.2, linestyle=(0, (5, 2)), zorder=5)
        self._valve_springs()
        seat = layout.seat
        if any(loop[:, 0].min() < seat.origin[0] < loop[:, 0].max() for loop in seat.port):
            port = np.concatenate(self._placed("plan", seat.port))[:, 0]
            x, low = (port.min() + port.max()) / 2, float(frame.up(seat.heights[0])) - 0.1
            self._line(np.array([(x, low), (x, frame.section + 0.12)]), GREY, 0.7, linestyle="-.")
        for zone in frame.zones:
            if zone.is_shortened:
                self._break(zone)

    def _root(self, body: BodyViews) -> None:
        """Draw the clamps of a reed as jaws where its section is held."""
        for line in body.held:
            if len(line) > 2 or np.ptp(line[:, 0]) > 0:  # jaws are drawn at the end of a sheet only
                continue
            (x, low), (_, high) = self._frame.place("section", line)
            ends = np.array([(piece[:, 0].min(), piece[:, 0].max()) for piece in body.section])
            first, last = np.isclose(ends, line[0, 0], rtol=0, atol=1e-6 * float(np.ptp(ends))).any(axis=0)
            side = -0.2 if first or (not last and line[0, 0] < float(ends.mean())) else 0.2
            for y, way in ((min(low, high), -0.13), (max(low, high), 0.13)):
                jaw = np.array([(x, y), (x + side, y), (x + side, y + way), (x, y + way)])
                self._fill([jaw], facecolor="white", edgecolor=BLUE, linewidth=0.8, hatch="//////", zorder=4)

    def _symbol(self, role: str, body: BodyViews) -> None:
        """Draw the symbol of a body: a spring on the ground, a mass, or a box with the body's name."""
        x, y = self._frame.place("section", np.array([body.origin[::2]]))[0].tolist()
        way = DOWN if role == "seat" else UP
        end = y + SYMBOL * float(way[1])
        half = {"spring": 0.14, "mass": 0.3}.get(body.symbol, 0.75)
        self._line(np.array([(x - half, y), (x + half, y)]), ORANGE, 2.4, zorder=7)
        if body.symbol == "spring":
            self._spring(x, y, end)
            self._ground(np.array([(x - 0.22, end), (x + 0.22, end)]), way)
            return
        corners = np.array([(x - half, y), (x + half, y), (x + half, end), (x - half, end)])
        self._fill([corners], facecolor=COLOURS[role], edgecolor=INK, linewidth=0.8, zorder=3)
        self._text(x, (y + end) / 2, "m" if body.symbol == "mass" else body.name, ha="center", zorder=8)

    def _bed(self, points: Array) -> None:
        """Draw the springs of an elastic foundation between a face and the ground below."""
        low, high, y = float(points[:, 0].min()), float(points[:, 0].max()), float(points[:, 1].mean())
        for x in np.linspace(low, high, 7)[1:-1:2].tolist():
            self._spring(x, y, y - 0.2, BLUE)
        self._ground(np.array([(low, y - 0.2), (high, y - 0.2)]), DOWN)

    def _valve_springs(self) -> None:
        """Draw the valve springs in the plane of the section, or all if none is in it, each against the fixed guard."""
        frame, places, stopper = self._frame, self._layout.springs, self._layout.bodies.get("stopper")
        level = np.abs(places[:, 1]) <= LEVEL * max(float(np.abs(places).max(initial=0.0)), 1e-9)
        foot = float(frame.up(self._layout.top_of_reed))
        for place in np.unique(places[level if level.any() else ~level, 0].round(9)).tolist():
            x = frame.x + frame.scale * place
            if stopper is not None and stopper.symbol and frame.scale * abs(place - stopper.origin[0]) < BESIDE:
                x += BESIDE  # next to the symbol
            low, high = foot + 0.02, foot + SYMBOL  # the reed's outline remains visible
            pocket = np.array([(x - 0.12, low), (x + 0.12, low), (x + 0.12, high), (x - 0.12, high)])
            self._fill([pocket], facecolor="white", edgecolor="none", zorder=4)
            self._spring(x, foot, high, LOAD, zorder=6)
            self._ground(np.array([(x - 0.12, high), (x + 0.12, high)]), UP)

    def _break(self, zone: Zone) -> None:
        """Draw a wavy band where the height of a body is shortened."""
        body = self._layout.seat if zone.name == "depth" else self._layout.reed
        x = np.concatenate(self._placed("section", body.section))[:, 0]
        y = float(self._frame.up((zone.low + zone.high) / 2))
        along = np.linspace(x.min() - 0.06, x.max() + 0.06, 80)
        wave = y + 0.03 * np.sin(2 * np.pi * (along - along[0]) / 0.5)
        self._axes.fill_between(along, wave - 0.03, wave + 0.03, color="white", zorder=8, linewidth=0)
        for side in (-0.03, 0.03):
            self._line(np.column_stack([along, wave + side]), INK, 0.6, zorder=9)

    def _plan(self) -> None:
        seat, reed, stopper = self._layout.seat, self._layout.reed, self._layout.bodies.get("stopper")
        self._surface(seat, PALE, alpha=1.0, linewidth=0.7, zorder=1)
        self._lines(self._placed("plan", seat.edges), colors=GREY, linewidths=0.5, zorder=2)
        if stopper is not None:
            dashed = {"colors": PURPLE, "linestyles": (0, (6, 2)), "linewidths": 1.0, "zorder": 8}
            self._lines(self._placed("plan", (*stopper.edges, *closed(stopper.plan))), **dashed)
        self._fill(self._placed("plan", seat.contact), facecolor=ORANGE, edgecolor="none", zorder=3)
        self._lines(self._placed("plan", self._layout.arcs), colors="white", linewidths=0.7, zorder=3.5)
        self._lines(self._placed("plan", seat.clamp), colors=BLUE, linewidths=1.4, zorder=3.2)
        self._surface(reed, SKY, alpha=0.3, linewidth=1.1, zorder=5)
        self._lines(self._placed("plan", reed.edges), colors=INK, linewidths=0.7, zorder=5.5)
        for loop in closed(self._placed("plan", reed.contact)):
            self._line(loop, GREEN, 0.9, linestyle=(0, (2, 1.5)), zorder=6)
        middle = np.concatenate([np.array([reed.origin[:2]]), *reed.plan]).mean(axis=0)
        for line in reed.clamp:
            if np.array_equal(line[0], line[-1]):  # the edge of a hole
                self._line(self._frame.place("plan", line), BLUE, 1.8, zorder=6)
                continue
            self._ground(self._frame.place("plan", line), _outward(line, middle))
        for words, x, y in self._layout.lands:
            at = self._frame.place("plan", np.array([(x, y)]))[0]
            self._text(at[0], at[1] + 0.1, words, ha="center", zorder=7)
        self._marks()

    def _surface(self, body: BodyViews, colour: str, *, alpha: float, linewidth: float, zorder: float) -> None:
        """Fill a body in plan: its loops, or the triangles of its surface, of which only the edges have lines."""
        library = load_matplotlib()
        paint = library.colors.to_rgba(colour, alpha)
        if body.triangles is None:
            loops = self._placed("plan", body.plan)
            self._fill(loops, facecolor=paint, edgecolor=INK, linewidth=linewidth, zorder=zorder)
            return
        corners = self._frame.place("plan", body.triangles.reshape(-1, 2)).reshape(-1, 3, 2)
        seams = {"edgecolors": colour if alpha == 1 else "none", "linewidths": 0.3}
        self._axes.add_collection(
            library.collections.PolyCollection(corners, facecolors=[paint], zorder=zorder, **seams)
        )

    def _marks(self) -> None:
        """Draw the contact point, the line of the section, the position of the stopper and the axes of tilt."""
        frame, layout, low, high = self._frame, self._layout, self._left, self._right
        for x, align in ((low - 0.2, "right"), (high + 0.2, "left")):
            self._text(x, frame.plan, "A", ha=align, fontweight="bold", fontsize=1.1 * SMALL)
        self._line(np.array([(low - 0.17, frame.plan), (high + 0.17, frame.plan)]), GREY, 0.7, linestyle="-.", zorder=6)
        self._axes.plot(frame.x, frame.plan, "+", color=INK, markersize=7, markeredgewidth=1.0, zorder=9)
        if (stopper := layout.bodies.get("stopper")) is not None:
            place = frame.place("plan", np.array([stopper.origin[:2]]))
            self._axes.plot(*place.T, "x", color=PURPLE, markersize=7, markeredgewidth=1.4, zorder=9)
        for x, y in frame.place("plan", layout.springs):
            self._axes.plot(x, y, "o", color=LOAD, markersize=6, markerfacecolor="none", zorder=9)
        for tilt in layout.tilts:  # the axis about which a face is tilted, and the point of the smallest gap
            middle, colour = np.array(tilt.body.origin[:2]), _colour(tilt)
            along = 1.35 * np.hypot(*(tilt.corners - middle).T).max() * np.array([np.cos(tilt.axis), np.sin(tilt.axis)])
            *line, near = frame.place("plan", np.array([middle - along, middle + along, tilt.nearest]))
            self._line(np.array(line), colour, 1.2, linestyle=(0, (8, 2, 2, 2)), zorder=8)
            self._axes.plot(*near, "o", color=colour, markersize=5, markeredgecolor="white", zorder=10)

    # Words and numbers

    def _ends(self, size: Size) -> tuple[float, float, Array]:
        """Return where a dimension begins and ends along its axis on the sheet, and its ends (2,) on the other axis."""
        along, across = np.array([size.low, size.high]), np.array([size.at, size.at])
        line = np.column_stack([along, across] if size.axis == 0 else [across, along])
        placed = self._frame.place(size.view, line)
        low, high = placed[:, size.axis].tolist()
        return low, high, placed[:, 1 - size.axis]

    def _lengths(self, view: View) -> None:
        """Draw the dimensions along x, row by row below a view."""
        frame = self._frame
        below = (
            frame.plan + frame.scale * float(self._layout.extent[0][1]) - 0.12 if view == "plan" else frame.bottom - 0.3
        )
        for number, row in enumerate(frame.rows[view]):
            y = below - ROW * (number + 0.4)
            for size in row:
                low, high, starts = self._ends(size)
                for x, start in zip((low, high), starts, strict=True):
                    self._line(np.array([(x, start), (x, y - 0.03)]), GREY, 0.35, zorder=2 if view == "plan" else 3.5)
                inside = width_of(size.text) < high - low
                self._measure(low, high, y, upright=False, inside=inside)
                if inside:
                    self._text((low + high) / 2, y, size.text, ha="center", bbox=BOX, zorder=9)
                else:
                    self._text(high + 0.2, y, size.text, ha="left", zorder=9)

    def _heights(self, view: View) -> None:
        """Draw the dimensions across x, each in its own column, with their texts in one stack at the right, which in
        plan avoids the line of the section."""
        sizes = sorted(
            ((*self._ends(size), size.text) for size in self._layout.sizes(view, 1)), key=lambda size: size[0] + size[1]
        )
        middles = [(low + high) / 2 for low, high, *_ in sizes]
        places = middles[:1]
        for middle in middles[1:]:
            places.append(max(middle, places[-1] + LINE))
        shift = float(np.mean(places) - np.mean(middles)) if sizes else 0.0
        if view == "plan" and any(abs(y - self._frame.plan) < 0.5 * LINE for y in places):
            shift = -1.2 * LINE
        column = self._right + 0.38
        for number, ((low, high, starts, words), middle, y) in enumerate(zip(sizes, middles, places, strict=True)):
            x, text_at = column + 0.09 * (number % 4), column + 0.44
            for level in {low, high}:
                self._line(np.array([(starts[0], level), (x + 0.03, level)]), GREY, 0.35, zorder=2)
            self._measure(low, high, x, upright=True, inside=high - low > 0.22)
            self._line(np.array([(x, middle), (text_at - 0.03, y - shift)]), GREY, 0.35)
            self._text(text_at, y - shift, words, ha="left")

    def _names(self) -> None:
        """Write the names of the bodies at the left of the section, with lines to them."""
        places = []
        for role, body in self._layout.bodies.items():
            x, y = self._frame.place("section", np.array([body.origin[::2]]))[0] + (-0.25, NAMED[role])
            if body.section:
                points = np.concatenate(self._placed("section", body.section))
                x, y = points[:, 0].min(), (points[:, 1].min() + points[:, 1].max()) / 2
            places.append((y, x, f"{role}\n{body.name}"))
        last = -np.inf
        for y, x, words in sorted(places):
            last = max(y, last + 2.3 * LINE)
            self._text(EDGE, last, words, ha="left", linespacing=1.1)
            wide = LETTER * max(map(len, words.split("\n")))
            if EDGE + wide + 0.1 < x - 0.25:
                self._line(np.array([(0.2 + wide, last), (x - 0.24, last), (x, y)]), GREY, 0.35)

    def _action(self, action: Action, y: float) -> None:
        """Draw a load or a motion at a height of the sheet."""
        low, high = (self._frame.x + self._frame.scale * end for end in (action.low, action.high))
        count = 1 if high - low < 0.3 else int(np.clip((high - low) / 0.3, 3, 9))
        for x in np.linspace(low, high, count) if count > 1 else [(low + high) / 2]:
            ends = ((x, y + 0.11), (x, y - 0.11))
            self._arrow(*(ends if action.way <= 0 else ends[::-1]), LOAD, "-|>" if action.way else "<|-|>")
        if count > 1:
            self._line(np.array([(low, y + 0.11), (high, y + 0.11)]), LOAD, 0.8)
        wide = LETTER * len(action.words)
        right = max(high, low) + 0.1
        if right + wide < WIDTH - 0.05:
            self._text(right, y, action.words, ha="left", color=LOAD)
        elif low - wide > 0.15:
            self._text(low - 0.1, y, action.words, ha="right", color=LOAD)
        else:
            middle = float(np.clip((low + high) / 2, wide / 2 + EDGE, WIDTH - wide / 2 - EDGE))
            self._text(middle, y + 0.22, action.words, ha="center", color=LOAD, bbox=BOX, zorder=9)

    def _foot(self) -> None:
        """Write the key of colours and the lines below it."""
        lines = foot_lines(self._layout, self._frame.zones, self._frame.scale)
        rows = key_rows(self._layout)
        y = 0.12 + LINE * (len(lines) + len(rows) - 0.8)
        for number, row in enumerate(rows):
            for x, colour, words in row:
                self._line(np.array([(x, y - LINE * number), (x + 0.2, y - LINE * number)]), colour, 2.4)
                self._text(x + 0.26, y - LINE * number, words)
        for number, words in enumerate(lines, start=len(rows)):
            self._text(EDGE, y - LINE * number, words)


def _colour(tilt: Tilt) -> str:
    return PURPLE if tilt.role == "stopper" else GREEN


def _fine(loop: Array) -> Array:
    """Return a loop with points between its corners, since heights are scaled zone by zone."""
    ahead = np.roll(loop, -1, axis=0)
    shares = np.arange(8)[None, :, None] / 8
    return np.asarray((loop[:, None] + shares * (ahead - loop)[:, None]).reshape(-1, 2))


def _outward(line: Array, middle: Array) -> Array:
    """Return the unit normal of a line that points away from ``middle``."""
    along = line[-1] - line[0]
    normal = np.array([-along[1], along[0]])
    normal = normal / max(float(np.hypot(*normal)), 1e-12)
    return normal if (line.mean(axis=0) - middle) @ normal > 0 else -normal
