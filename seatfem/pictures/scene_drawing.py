"""Technical drawing of a scene: a section through the contact along the reed, and below it the plan.

Both views are above each other at the same scale along x, as in technical drawings. Heights of a thin reed and of small
openings are exaggerated, zone by zone, by factors that are written on the sheet.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from impact.greens.base import Array
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, load_matplotlib, sheet
from seatfem.pictures.layout import (
    LETTER,
    LINE,
    LOADS,
    ROW,
    SYMBOL,
    WIDTH,
    Action,
    Frame,
    Layout,
    Placed,
    Tilt,
    Zone,
    extent_of,
    factors_of,
)
from seatfem.structures.outlines import Loops, View, length_text
from seatfem.structures.shapes.loops import holds, polygon_area

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SMALL: Final = 7.5  # size of small letters [points]
INK, PALE, HATCH = "#30343A", "#E4E6E9", "#9BA1A9"
LOAD: Final = "#8C2D63"
BESIDE: Final = 0.45  # distance from a stopper's symbol within which a spring is drawn next to it [inch]
LEVEL: Final = 1e-6  # distance from the section's plane, over the springs' reach, within which a spring lies in it
COLOURS: Final = {"seat": "#D9DCE0", "reed": "#A9D3F0", "stopper": "#EBCFE0"}
HATCHES: Final = {"seat": "////", "reed": "", "stopper": "\\\\\\\\"}


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

    def draw(self) -> None:
        """Draw both views, dimensions, loads and words."""
        self._title()
        self._plan()
        self._section()
        for view in ("section", "plan"):
            self._lengths(view)
        self._heights()
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
        path = library.path.Path
        corners = [np.concatenate([loop, loop[:1]]) for loop in loops]
        codes = [[path.MOVETO, *[path.LINETO] * (len(loop) - 2), path.CLOSEPOLY] for loop in corners]
        turned = [loop if polygon_area(loop) > 0 else loop[::-1] for loop in corners]
        inner = [sum(holds(other, loop[0]) for other in turned if other is not loop) % 2 for loop in turned]
        ways = [loop[::-1] if hole else loop for loop, hole in zip(turned, inner, strict=True)]
        self._axes.add_patch(library.patches.PathPatch(path(np.concatenate(ways), np.concatenate(codes)), **style))

    def _line(self, points: Array, colour: str = INK, width: float = 0.7, **style: Any) -> None:
        self._axes.plot(*np.asarray(points).T, color=colour, linewidth=width, **style)

    def _lines(self, lines: Sequence[Array], **style: Any) -> None:
        self._axes.add_collection(load_matplotlib().collections.LineCollection(list(lines), **style))

    def _triangles(self, body: Placed, triangles: Array, **style: Any) -> None:
        """Fill triangles of a body in plan."""
        middle = np.array([self._frame.x, self._frame.plan]) + self._frame.scale * np.array(body.at)
        self._axes.add_collection(
            load_matplotlib().collections.PolyCollection(list(middle + self._frame.scale * triangles), **style)
        )

    def _text(self, x: float, y: float, words: str, **style: Any) -> None:
        usual: dict[str, Any] = {"fontsize": SMALL, "color": INK, "va": "center"}
        self._axes.text(x, y, words, **{**usual, **style})

    def _arrow(self, start: Sequence[float], end: Sequence[float], colour: str = INK, style: str = "-|>") -> None:
        arrow = {
            "arrowstyle": style,
            "color": colour,
            "linewidth": 0.8,
            "shrinkA": 0,
            "shrinkB": 0,
            "mutation_scale": 6,
        }
        self._axes.annotate("", (end[0], end[1]), (start[0], start[1]), arrowprops=arrow)

    def _ground(self, line: Array, away: Array) -> None:
        """Draw a clamped line with hatching on the side ``away`` from the body."""
        self._line(line, BLUE, 1.8, zorder=6, solid_capstyle="butt")
        line = line[::-1] if tuple(line[-1]) < tuple(line[0]) else line  # so that all strokes lean the same way
        steps = np.diff(line, axis=0)
        lengths = np.hypot(*steps.T)
        total = float(lengths.sum())
        if total == 0:
            return
        for distance in np.arange(0.04, total, 0.08):
            k = int(np.searchsorted(np.cumsum(lengths), distance))
            k = min(k, len(steps) - 1)
            share = (distance - float(lengths[:k].sum())) / max(float(lengths[k]), 1e-12)
            foot = line[k] + share * steps[k]
            along = steps[k] / max(float(lengths[k]), 1e-12)
            self._line(np.array([foot, foot + 0.085 * (away - 0.7 * along)]), BLUE, 0.6)

    def _spring(self, low: Array, high: Array, colour: str = INK, **style: Any) -> None:
        """Draw a vertical zigzag between two points."""
        shares = np.array([0.0, 0.15, *np.linspace(0.2, 0.8, 7), 0.85, 1.0])
        sides = np.array([0.0, 0.0, *(0.09 * (-1.0) ** np.arange(7)), 0.0, 0.0])
        self._line(
            low + shares[:, None] * (high - low) + np.column_stack([sides, np.zeros(len(sides))]), colour, 1.0, **style
        )

    # Views

    def _title(self) -> None:
        frame = self._frame
        self._text(0.15, frame.height - 0.2, self._layout.title, fontsize=10.5, fontweight="bold")
        self._text(0.15, frame.height - 0.42, "Section A–A along the reed through the contact", fontsize=8.5)
        y = frame.plan + frame.scale * float(extent_of(self._layout)[1][1]) + 0.22
        self._text(0.15, y, "Plan, seen from above", fontsize=8.5)

    def _section(self) -> None:
        frame, layout = self._frame, self._layout
        for body in layout.bodies:
            views = body.views
            loops = [frame.place("section", _fine(loop), body) for loop in views.section]
            if views.symbol:
                self._symbol(body)
                continue
            hatched = {"hatch": HATCHES[body.role], "edgecolor": HATCH, "linewidth": 0.0, "zorder": 3}
            self._fill(loops, facecolor=COLOURS[body.role], **hatched)
            self._fill(loops, facecolor="none", edgecolor=INK, linewidth=0.9, zorder=3.2)
            middle = np.concatenate(loops).mean(axis=0)
            for line in views.held:
                self._ground(placed := frame.place("section", line, body), _outward(placed, middle))
            if views.bedded:
                self._bed(np.concatenate([frame.place("section", line, body) for line in views.bedded]))
            for line in views.struck:
                colour = GREEN if body.role == "reed" else ORANGE
                self._line(frame.place("section", line, body), colour, 2.4, zorder=7, solid_capstyle="butt")
            self._root(body)
        if layout.start is not None:  # underside of the reed at its release
            underside = frame.up(layout.top_of_reed() + layout.start[:, 1])
            line = np.column_stack([frame.x + frame.scale * layout.start[:, 0], underside])
            self._line(line, GREEN, 1.2, linestyle=(0, (5, 2)), zorder=5)
        self._valve_springs()
        if any(loop[:, 0].min() < 0 < loop[:, 0].max() for loop in layout.seat.views.port):
            port = np.concatenate(layout.seat.views.port)[:, 0]
            x = frame.x + frame.scale * (layout.seat.at[0] + float(port.min() + port.max()) / 2)
            low = float(frame.up(-layout.seat.views.depth)) - 0.1
            self._line(np.array([(x, low), (x, frame.section + 0.12)]), GREY, 0.7, linestyle="-.")
        for zone in frame.zones:
            if zone.is_shortened:
                self._break(zone)

    def _root(self, body: Placed) -> None:
        """Draw the clamps of a reed as jaws where its section is held."""
        if body.role == "seat":
            return
        frame = self._frame
        for line in body.views.held:
            if len(line) > 2 or np.ptp(line[:, 0]) > 0:  # jaws are drawn at the end of a sheet only
                continue
            (x, low), (_, high) = frame.place("section", line, body)
            ends = np.array([(piece[:, 0].min(), piece[:, 0].max()) for piece in body.views.section])
            first, last = np.isclose(ends, line[0, 0], rtol=0, atol=1e-6 * float(np.ptp(ends))).any(axis=0)
            side = -1.0 if first or (not last and line[0, 0] < float(ends.mean())) else 1.0
            for y, way in ((min(low, high), -1.0), (max(low, high), 1.0)):
                jaw = np.array([(x, y), (x + 0.2 * side, y), (x + 0.2 * side, y + 0.13 * way), (x, y + 0.13 * way)])
                self._fill([jaw], facecolor="white", edgecolor=BLUE, linewidth=0.8, hatch="//////", zorder=4)

    def _symbol(self, body: Placed) -> None:
        """Draw the symbol of a body: a spring on the ground, a mass, or a box with the body's name."""
        frame, views = self._frame, body.views
        x, y = frame.x + frame.scale * body.at[0], float(frame.up(body.height))
        way = -1.0 if body.role == "seat" else 1.0
        if views.symbol == "spring":
            plate = np.array([(x - 0.14, y), (x + 0.14, y)])
            self._line(plate, ORANGE, 2.4, zorder=7)
            self._spring(np.array([x, y]), np.array([x, y + SYMBOL * way]))
            ground = np.array([(x - 0.22, y + SYMBOL * way), (x + 0.22, y + SYMBOL * way)])
            self._ground(ground, np.array([0.0, way]))
            return
        half = 0.3 if views.symbol == "mass" else 0.75
        corners = np.array([(x - half, y), (x + half, y), (x + half, y + SYMBOL * way), (x - half, y + SYMBOL * way)])
        self._fill([corners], facecolor=COLOURS[body.role], edgecolor=INK, linewidth=0.8, zorder=3)
        self._line(corners[:2], ORANGE, 2.4, zorder=7)
        words = "m" if views.symbol == "mass" else views.name
        self._text(x, y + SYMBOL * way / 2, words, ha="center", zorder=8)

    def _bed(self, points: Array) -> None:
        """Draw the springs of an elastic foundation between a face and the ground below."""
        low, high, y = float(points[:, 0].min()), float(points[:, 0].max()), float(points[:, 1].mean())
        for x in np.linspace(low, high, 7)[1:-1:2]:
            self._spring(np.array([x, y]), np.array([x, y - 0.2]), BLUE)
        self._ground(np.array([(low, y - 0.2), (high, y - 0.2)]), np.array([0.0, -1.0]))

    def _valve_springs(self) -> None:
        """Draw the valve springs in the plane of the section, or all if none is in it, each against the fixed guard."""
        frame, places = self._frame, self._layout.springs
        level = np.abs(places[:, 1]) <= LEVEL * max(float(np.abs(places).max(initial=0.0)), 1e-9)
        foot = float(frame.up(self._layout.top_of_reed())) + (SYMBOL if self._layout.reed.views.symbol else 0.0)
        stopper = self._layout.stopper
        for place in np.unique(places[level if level.any() else ~level, 0].round(9)):
            x = frame.x + frame.scale * float(place)
            if stopper is not None and stopper.views.symbol and abs(x - frame.x - frame.scale * stopper.at[0]) < BESIDE:
                x += BESIDE  # next to the symbol
            low, high = foot + 0.02, foot + SYMBOL  # the reed's outline remains visible
            pocket = np.array([(x - 0.12, low), (x + 0.12, low), (x + 0.12, high), (x - 0.12, high)])
            self._fill([pocket], facecolor="white", edgecolor="none", zorder=4)
            self._spring(np.array([x, foot]), np.array([x, foot + SYMBOL]), LOAD, zorder=6)
            self._ground(np.array([(x - 0.12, foot + SYMBOL), (x + 0.12, foot + SYMBOL)]), np.array([0.0, 1.0]))

    def _break(self, zone: Zone) -> None:
        """Draw a wavy band where the height of a body is shortened."""
        frame = self._frame
        body = self._layout.seat if zone.name == "depth" else self._layout.reed
        x = frame.x + frame.scale * (np.concatenate(body.views.section)[:, 0] + body.at[0])
        y = float(frame.up((zone.low + zone.high) / 2))
        along = np.linspace(x.min() - 0.06, x.max() + 0.06, 80)
        wave = 0.03 * np.sin(2 * np.pi * (along - along[0]) / 0.5)
        self._axes.fill_between(along, y - 0.03 + wave, y + 0.03 + wave, color="white", zorder=8, linewidth=0)
        for side in (-0.03, 0.03):
            self._line(np.column_stack([along, y + side + wave]), INK, 0.6, zorder=9)

    def _plan(self) -> None:
        frame, layout = self._frame, self._layout

        def placed(lines: Loops, body: Placed) -> list[Array]:
            return [frame.place("plan", line, body) for line in lines]

        seat, reed = layout.seat, layout.reed
        for body, order in ((seat, 1), (layout.stopper, 7)):
            if body is None:
                continue
            views = body.views
            dashed = body is not seat
            if views.triangles is not None and not dashed:
                self._triangles(body, views.triangles, facecolors=PALE, edgecolors=PALE, linewidths=0.3, zorder=order)
            elif not dashed:
                self._fill(placed(views.plan, body), facecolor=PALE, edgecolor=INK, linewidth=0.7, zorder=order)
            lines = placed((*views.edges, *(_closed(views.plan) if dashed else ())), body)
            style = {"colors": PURPLE, "linestyles": (0, (6, 2))} if dashed else {"colors": GREY}
            self._lines(lines, linewidths=1.0 if dashed else 0.5, zorder=order + 1, **style)
        self._fill(placed(seat.views.contact, seat), facecolor=ORANGE, edgecolor="none", zorder=3)
        if len(layout.arcs):
            lines = [frame.place("plan", line, seat) for line in layout.arcs]
            self._lines(lines, colors="white", linewidths=0.7, zorder=3.5)
        self._lines(placed(seat.views.clamp, seat), colors=BLUE, linewidths=1.4, zorder=3.2)
        if reed.views.triangles is not None:
            self._triangles(reed, reed.views.triangles, facecolors=SKY, edgecolors="none", alpha=0.25, zorder=5)
            self._lines(placed(reed.views.edges, reed), colors=INK, linewidths=0.7, zorder=5.5)
        else:
            loops = placed(reed.views.plan, reed)
            self._fill(loops, facecolor=(0.34, 0.71, 0.91, 0.32), edgecolor=INK, linewidth=1.1, zorder=5)
        for loop in _closed(tuple(placed(reed.views.contact, reed))):
            self._line(loop, GREEN, 0.9, linestyle=(0, (2, 1.5)), zorder=6)
        middle = np.concatenate([np.zeros((1, 2)), *reed.views.plan]).mean(axis=0)
        for line in reed.views.clamp:
            if np.array_equal(line[0], line[-1]):  # the edge of a hole
                self._line(frame.place("plan", line, reed), BLUE, 1.8, zorder=6)
                continue
            self._ground(frame.place("plan", line, reed), _outward(line, middle))
        self._marks()

    def _marks(self) -> None:
        """Draw the contact point, the line of the section, the position of the stopper and the axes of tilt."""
        frame, layout = self._frame, self._layout
        low, high = (frame.x + frame.scale * float(end[0]) for end in extent_of(layout))
        for x, align in ((low - 0.2, "right"), (high + 0.2, "left")):
            self._text(x, frame.plan, "A", ha=align, fontweight="bold", fontsize=8.5)
        self._line(np.array([(low - 0.17, frame.plan), (high + 0.17, frame.plan)]), GREY, 0.7, linestyle="-.", zorder=6)
        self._axes.plot(frame.x, frame.plan, "+", color=INK, markersize=7, markeredgewidth=1.0, zorder=9)
        if layout.stopper is not None:
            x, y = frame.x + frame.scale * layout.stopper.at[0], frame.plan + frame.scale * layout.stopper.at[1]
            self._axes.plot(x, y, "x", color=PURPLE, markersize=7, markeredgewidth=1.4, zorder=9)
        for x, y in (frame.x, frame.plan) + frame.scale * layout.springs:
            self._axes.plot(x, y, "o", color=LOAD, markersize=6, markerfacecolor="none", zorder=9)
        for tilt in layout.tilts:
            self._tilt_axis(tilt)

    def _tilt_axis(self, tilt: Tilt) -> None:
        """Draw the axis about which a face is tilted, and the point of the smallest gap."""
        reach, colour = 1.35 * float(np.hypot(*tilt.corners.T).max()), _colour(tilt)
        along = reach * np.array([np.cos(tilt.axis), np.sin(tilt.axis)])
        line = self._frame.place("plan", np.array([-along, along]), tilt.body)
        self._line(line, colour, 1.2, linestyle=(0, (8, 2, 2, 2)), zorder=8)
        place = self._frame.place("plan", tilt.nearest[None], tilt.body)[0]
        self._axes.plot(*place, "o", color=colour, markersize=5, markeredgecolor="white", zorder=10)

    # Words and numbers

    def _lengths(self, view: View) -> None:
        frame = self._frame
        low = extent_of(self._layout)[0][1] * frame.scale + frame.plan
        base = low if view == "plan" else frame.section - sum(z.inches for z in frame.zones if z.high <= 0)
        base -= 0.12 if view == "plan" else 0.3
        for number, row in enumerate(frame.rows[view]):
            for body, size in row:
                y = base - ROW * (number + 0.4)
                ends = np.array([(size.low, size.at), (size.high, size.at)])
                (a, from_a), (b, from_b) = frame.place(view, ends, body)
                for x, start in ((a, from_a), (b, from_b)):
                    self._line(np.array([(x, start), (x, y - 0.03)]), GREY, 0.35, zorder=2 if view == "plan" else 3.5)
                self._dimension(a, b, y, size.text)

    def _dimension(self, a: float, b: float, y: float, words: str) -> None:
        """Draw a dimension along x."""
        if LETTER * len(words) + 0.1 < b - a:
            self._arrow((a, y), (b, y), GREY, "<|-|>")
            box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
            self._text((a + b) / 2, y, words, ha="center", bbox=box, zorder=9)
            return
        self._line(np.array([(a, y), (b, y)]), GREY, 0.7)
        self._arrow((a - 0.16, y), (a, y), GREY)
        self._arrow((b + 0.16, y), (b, y), GREY)
        self._text(b + 0.2, y, words, ha="left", zorder=9)

    def _heights(self) -> None:
        """Draw the dimensions across x, each in its own column, with their texts in one stack at the right."""
        frame, layout = self._frame, self._layout
        upright: list[tuple[float, float, float, str]] = []
        for body in layout.bodies:
            for size in body.views.sizes:
                if size.axis == 1 and size.view == "section":
                    start = np.array([(size.at, size.low), (size.at, size.high)])
                    (x, low), (_, high) = frame.place("section", start, body)
                    upright.append((low, high, x, size.text))
        end = frame.x + frame.scale * float(extent_of(layout)[1][0])
        if layout.gap > 0:
            upright.append(
                (float(frame.up(0.0)), float(frame.up(layout.gap)), frame.x, f"gap {length_text(layout.gap)}")
            )
        else:
            upright.append((frame.section, frame.section, frame.x, "gap 0"))
        top = layout.top_of_reed()
        if layout.stopper is not None and layout.lift is not None:
            x = frame.x + frame.scale * layout.stopper.at[0]
            ends = float(frame.up(top)), float(frame.up(top + layout.lift))
            upright.append((*ends, x, f"stopper {length_text(layout.lift)}"))
        if layout.start is not None:
            k = int(np.argmax(np.abs(layout.start[:, 1])))
            x, rise = frame.x + frame.scale * float(layout.start[k, 0]), float(layout.start[k, 1])
            ends = float(frame.up(top)), float(frame.up(top + rise))
            upright.append((*ends, x, f"start {length_text(rise)}"))
        self._stack(upright, end)
        across = [
            (*frame.place("plan", np.array([(size.at, size.low), (size.at, size.high)]), body)[:, 1].tolist(),
             float(frame.place("plan", np.array([(size.at, size.low)]), body)[0, 0]), size.text)
            for body in (layout.seat, layout.reed) for size in body.views.sizes if (size.axis, size.view) == (1, "plan")
        ]  # fmt: skip
        self._stack([(low, high, x, text) for low, high, x, text in across], end, beside=frame.plan)

    def _stack(self, sizes: list[tuple[float, float, float, str]], end: float, beside: float | None = None) -> None:
        """Draw vertical dimensions (low, high, x, text); the texts avoid ``beside``, the height of the section's
        line."""
        sizes = sorted(sizes, key=lambda size: (size[0] + size[1]) / 2)
        places = [(size[0] + size[1]) / 2 for size in sizes]
        for k in range(1, len(places)):
            places[k] = max(places[k], places[k - 1] + LINE)
        shift = float(np.mean(places)) - float(np.mean([(size[0] + size[1]) / 2 for size in sizes])) if sizes else 0.0
        if beside is not None and any(abs(y - beside) < 0.5 * LINE for y in places):
            shift = -1.2 * LINE
        column = end + 0.38
        for number, ((low, high, x, words), y) in enumerate(zip(sizes, places, strict=True)):
            line_x, text_at = column + 0.09 * (number % 4), column + 0.44
            for level in {low, high}:
                self._line(np.array([(x, level), (line_x + 0.03, level)]), GREY, 0.35, zorder=2)
            if high - low > 0.22:
                self._arrow((line_x, low), (line_x, high), GREY, "<|-|>")
            elif high > low:
                self._line(np.array([(line_x, low), (line_x, high)]), GREY, 0.8)
                self._arrow((line_x, low - 0.12), (line_x, low), GREY)
                self._arrow((line_x, high + 0.12), (line_x, high), GREY)
            self._line(np.array([(line_x, (low + high) / 2), (text_at - 0.03, y - shift)]), GREY, 0.35)
            self._text(text_at, y - shift, words, ha="left")

    def _names(self) -> None:
        """Write the names of the bodies at the left of the section, with lines to them."""
        frame, places = self._frame, []
        for body in self._layout.bodies:
            loops = [frame.place("section", loop, body) for loop in body.views.section]
            x, y = frame.x + frame.scale * body.at[0] - 0.25, float(frame.up(body.height))
            y += {"seat": -0.3, "reed": 0.25, "stopper": 0.3}[body.role]
            if loops:
                points = np.concatenate(loops)
                x = float(points[:, 0].min())
                y = float((points[:, 1].min() + points[:, 1].max()) / 2)
            places.append((y, x, f"{body.role}\n{body.views.name}"))
        last = -np.inf
        for y, x, words in sorted(places):
            level = max(y, last + 2.3 * LINE)
            last = level
            self._text(0.15, level, words, ha="left", linespacing=1.1)
            wide = LETTER * max(map(len, words.split("\n")))
            if 0.15 + wide + 0.1 < x - 0.25:
                self._line(np.array([(0.2 + wide, level), (x - 0.24, level), (x, y)]), GREY, 0.35)

    def _action(self, action: Action, y: float) -> None:
        """Draw a load or a motion at a height of the sheet."""
        frame = self._frame
        low, high = (frame.x + frame.scale * end for end in (action.low, action.high))
        count = 1 if high - low < 0.3 else int(np.clip((high - low) / 0.3, 3, 9))
        style: Literal["<|-|>", "-|>"] = "-|>" if action.way else "<|-|>"
        for x in np.linspace(low, high, count) if count > 1 else [(low + high) / 2]:
            ends = ((x, y + 0.11), (x, y - 0.11))
            self._arrow(*(ends if action.way <= 0 else ends[::-1]), LOAD, style)
        if count > 1:
            self._line(np.array([(low, y + 0.11), (high, y + 0.11)]), LOAD, 0.8)
        wide = LETTER * len(action.words)
        right = max(high, low) + 0.1
        if right + wide < WIDTH - 0.05:
            self._text(right, y, action.words, ha="left", color=LOAD)
        elif low - wide > 0.15:
            self._text(low - 0.1, y, action.words, ha="right", color=LOAD)
        else:
            box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
            self._text((low + high) / 2, y + 0.2, action.words, ha="center", color=LOAD, bbox=box, zorder=9)

    def _foot(self) -> None:
        """Write the key of colours, the factors of exaggerated heights, and the notes."""
        frame, layout = self._frame, self._layout
        lines = [f"{note}" for note in layout.notes]
        if factors := factors_of(frame.zones, frame.scale):
            lines.insert(0, f"heights not to scale: {factors}; lengths and the seat to scale")
        if any(zone.is_shortened for zone in frame.zones):
            lines.insert(0, "bodies with a wavy break are shortened")
        y = 0.12 + LINE * (len(lines) + 0.2)
        x = 0.15
        for colour, words in _key(layout):
            self._line(np.array([(x, y), (x + 0.2, y)]), colour, 2.4)
            self._text(x + 0.26, y, words)
            x += 0.26 + LETTER * len(words) + 0.18
        for number, words in enumerate(lines):
            self._text(0.15, y - LINE * (number + 1), words)


def _key(layout: Layout) -> Iterator[tuple[str, str]]:
    yield ORANGE, "contact face"
    yield BLUE, "clamped"
    if layout.reed.views.contact:
        yield GREEN, "the reed's own face"
    tilted = [tilt.body.role for tilt in layout.tilts]
    if "seat" in tilted:
        yield GREEN, "axis of tilt, dot: smallest gap"
    if layout.start is not None:
        yield GREEN, "reed at the start"
    if layout.stopper is not None:
        yield PURPLE, "stopper, its axis of tilt" if "stopper" in tilted else "stopper"
    if layout.actions:
        yield LOAD, "load, spring, motion" if len(layout.springs) else "load, motion"


def _colour(tilt: Tilt) -> str:
    return PURPLE if tilt.body.role == "stopper" else GREEN


def _fine(loop: Array) -> Array:
    """Return a loop with points between its corners, since heights are scaled zone by zone."""
    ahead = np.roll(loop, -1, axis=0)
    shares = np.arange(8)[None, :, None] / 8
    return np.asarray((loop[:, None] + shares * (ahead - loop)[:, None]).reshape(-1, 2))


def _closed(loops: Loops) -> Loops:
    return tuple(np.concatenate([loop, loop[:1]]) for loop in loops)


def _outward(line: Array, middle: Array) -> Array:
    """Return the unit normal of a line that points away from ``middle``."""
    along = line[-1] - line[0]
    normal = np.array([-along[1], along[0]])
    normal = normal / max(float(np.hypot(*normal)), 1e-12)
    return normal if (line.mean(axis=0) - middle) @ normal > 0 else -normal
