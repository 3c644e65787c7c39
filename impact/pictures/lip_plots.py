"""Figures of a contact along a line, and marks of landings on a time axis."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from impact.after import histories, measures
from impact.after.histories import MOVING_AVERAGE, ClosedLine, averaged, best_plane, line_impulse, per_length
from impact.after.result import ImpactResult
from impact.greens.base import Array
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, load_matplotlib, sheet, time_axis, zero_line
from impact.quantities import scaled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOST_MARKS: Final = 10  # largest number of landings that are marked, the hardest
LEAST_VIEW: Final = 20  # least width of the view of an enlarged landing, in filter widths
COLOUR: Final = PURPLE
LEAST_DISTANCE: Final = 0.02  # of numbered marks over the width of axes; of closer ones the hardest is numbered
NUMBER_SPACE: Final = 0.12  # space for numbers above the curves, over their height
LEGEND_SPACE: Final = 0.3  # space for two lines of a legend above the curves, over their height
Body = Literal["seat", "stopper"]
BODIES: Final[tuple[Body, ...]] = ("seat", "stopper")
SHAPES: Final[Mapping[Body, str]] = {"seat": "v", "stopper": "^"}


@dataclass(frozen=True)
class LandingMark:
    """Landing in a figure, with its ``number`` among those on that body, from 1, and times [s].

    ``peak``: its largest averaged force [N]; ``hardest``: whether it exceeds the static load most, of all landings on
    this body.
    """

    body: Body
    number: int
    start: float
    end: float
    peak_time: float
    peak: float
    hardest: bool


def landing_marks(records: Sequence[Mapping[str, object]], body: Body = "seat") -> tuple[LandingMark, ...]:
    """Return the marks of the hardest landings on a body, the hardest first, from complete records of summary.json."""
    keys = ("excess_peak_force_N", "number", "time_s", "duration_s", "peak_time_s", "filtered_peak_force_N")
    rows = [[each.get(key) for key in keys] for each in records if each.get("body") == body]
    numbers = [[float(v) for v in row if isinstance(v, int | float) and not math.isnan(v)] for row in rows]
    complete = sorted((row for row in numbers if len(row) == len(keys)), key=lambda row: -row[0])
    return tuple(
        LandingMark(body, int(number), start, start + duration, peak_time, peak, rank == 0)
        for rank, (_, number, start, duration, peak_time, peak) in enumerate(complete[:MOST_MARKS])
    )


def shown_contact(
    runs: Sequence[ImpactResult], width: float, margin: float, landings: Sequence[Mapping[str, object]] = ()
) -> tuple[tuple[float, float], str]:
    """Return time window [s] and name of the enlarged contact: the hardest of the ``landings`` on the seat.

    Without landings it is the group of contacts of the first run with the largest mean force over ``width`` [s],
    together with simultaneous groups of the other runs, ``margin`` of it on either side; or the whole run.
    """
    last, marks = float(runs[0].time[-1]), landing_marks(landings)
    if (window := _landing_window(marks, margin, width)) is not None:
        words = f"landing {marks[0].number}, the hardest" if len(marks) > 1 else "the landing"
        return (window[0], min(window[1], last)), words
    number, (begin, end) = measures.hardest_group(runs[0], width)
    if math.isnan(begin):
        return (0.0, last), "no contact"
    for run in runs[1:]:
        solid = run.rows.solid.reshape(len(run.rows.ends), -1).sum(axis=1)
        groups = histories.merged(run.rows.time[histories.closed_steps(solid[1:])])
        simultaneous = groups[(groups[:, 0] <= end) & (groups[:, 1] >= begin)]
        begin, end = min([begin, *simultaneous[:, 0]]), max([end, *simultaneous[:, 1]])
    extra = margin * (end - begin) + 2 * runs[0].dt
    window = max(float(begin - extra), 0.0), min(float(end + extra), last)
    return window, "first contact" if number == 0 else f"contact {number + 1}, the hardest"


def _landing_window(marks: Sequence[LandingMark], margin: float, width: float) -> tuple[float, float] | None:
    """Return the window [s] of the hardest landing with ``margin`` of its duration, or filter widths, on either
    side."""
    mark = next((mark for mark in marks if mark.hardest), None)
    if mark is None:
        return None
    extra = max(margin * (mark.end - mark.start), (LEAST_VIEW * width - (mark.end - mark.start)) / 2, 2 * width)
    return max(mark.start - extra, 0.0), mark.end + extra


def draw_marks(axes: Axes, marks: Sequence[LandingMark], place: Callable[[LandingMark], tuple[float, float]]) -> None:
    """Draw the ``marks`` of one body, numbered, at their ``place`` in the units of the axes, with one legend entry."""
    label = {"seat": "landing (filled: the hardest)", "stopper": "landing on the stopper"}
    numbered: list[float] = []
    least = LEAST_DISTANCE * abs(axes.get_xlim()[1] - axes.get_xlim()[0])
    for mark in marks:
        filled, (along, above) = mark.hardest and mark.body == "seat", place(mark)
        shown, size, order = (COLOUR, 7.5, 5.1) if filled else ("white", 5.0, 5.0)
        style: dict[str, Any] = {"marker": SHAPES[mark.body], "markeredgecolor": COLOUR, "markerfacecolor": shown}
        name = label[mark.body] if mark.hardest else None
        axes.plot(along, above, linestyle="none", markersize=size, zorder=order, clip_on=False, label=name, **style)
        if all(abs(along - other) >= least for other in numbered):
            numbered.append(along)
            moved: dict[str, Any] = {"xytext": (0, 5), "textcoords": "offset points", "ha": "center", "va": "bottom"}
            moved |= {"fontsize": 8, "color": COLOUR, "fontweight": "bold" if filled else "normal", "zorder": 5.2}
            axes.annotate(f"{mark.number}", (along, above), **moved)
    if marks:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + NUMBER_SPACE * (high - low))


def value_at(run: ImpactResult, values: Array, time: float) -> float:
    """Return one of the ``values`` (n + 1,) of a run, at the step nearest to a ``time`` [s]."""
    return float(values[int(np.clip(np.searchsorted(run.time, time), 0, len(values) - 1))])


COLOURS = "viridis"
COLUMNS = 900  # number of columns of the map: times
SHOWN = 1e-3  # least force per length that is coloured, over the largest; the map is white below it
QUARTERS = (0.0, 0.25, 0.5, 0.75)
NAMES: Final = ("seat", "spring baseline")
STYLES: Final[tuple[tuple[str, Any], ...]] = ((BLUE, "solid"), (ORANGE, (0, (4, 2))))
"""Colour and line style of a run and of its baseline, dashed above it, so that both are visible if they coincide."""
OF_LANDS: Final = (GREEN, PURPLE, GREY)
"""Colours of the forces on the lands of a seat with several."""
_OF_QUARTERS = (BLUE, ORANGE, GREEN, PURPLE)


def plot_lip(
    result: ImpactResult,
    baseline: ImpactResult | None = None,
    path: str | os.PathLike[str] | None = None,
    *,
    radius: float | ClosedLine,
    share: float,
    filter_width: float = 1e-6,
    title: str = "Contact along the lip",
    landings: Sequence[Mapping[str, object]] = (),
) -> Figure:
    """Draw force per length over place and time, impulse per length, total force, gap at four places, tilt of the gap.

    Places are angles, or lengths along a line without angles. A local force is that of a moving front, which grows with
    the number of arcs: all curves are averages, and each panel states the interval.

    Args:
        result: impact with histories (n + 1, N) of N >= 3 arcs of the line.
        baseline: the same impact on springs without coupling, or ``None``.
        radius: radius of a circle in equal arcs [m]; or another line.
        share: fraction of the line over which the impulse is averaged.
        filter_width: width of the average in time [s].
        landings: records of summary.json, of which the hardest is shown; without any, the hardest contact.

    Returns the figure, written to a ``path`` by its suffix if one is given. Raises `PictureError` without matplotlib.
    """
    runs = [result] if baseline is None else [result, baseline]
    window, contact = shown_contact(runs, filter_width, 0.1, landings)
    line = radius if isinstance(radius, ClosedLine) else ClosedLine.circle(radius, result.rows.force.shape[1])
    with sheet(path, 7.2, 8.4) as figure:
        figure.suptitle(title)
        grid = figure.add_gridspec(3, 2, height_ratios=[1.15, 1.25, 1.0])
        _map(figure, figure.add_subplot(grid[0, :]), result, window, line, filter_width, contact)
        kind = "rectilinear" if not line.has_angles else "polar"
        _impulse(figure.add_subplot(grid[1, 0], projection=kind), runs, line, share)
        _force(figure.add_subplot(grid[1, 1]), runs, window, line, filter_width)
        _gaps(figure.add_subplot(grid[2, 0]), result, window, line)
        _tilt(figure.add_subplot(grid[2, 1]), result, window, line)
    return figure


def _within(run: ImpactResult, window: tuple[float, float], most: int) -> slice:
    """Return the recorded times of a window, at most ``most`` of them."""
    first, last = np.searchsorted(run.time, window)
    return slice(int(first), int(last) + 1, max(1, math.ceil((int(last) + 1 - int(first)) / most)))


def _gaps_in(run: ImpactResult, part: slice) -> Array:
    """Return the (m, N) gaps at some recorded times [m]."""
    return run.rows.find_motions(run.rows.gap, np.arange(part.start, min(part.stop, len(run.time)), part.step))


def _map(
    figure: Figure,
    axes: Axes,
    result: ImpactResult,
    window: tuple[float, float],
    line: ClosedLine,
    width: float,
    contact: str,
) -> None:
    part, arcs = _within(result, window, COLUMNS), result.rows.force.shape[1]
    reach, last = math.ceil(width / result.dt), len(result.time) - 1
    first = max(part.start - reach, 0)  # the average reaches beyond the window
    force = result.rows.spread_forces(result.rows.force, first, min(part.stop + reach, last))
    values = per_length(force, result.dt, width, line.lengths)[part.start - first : part.stop - first : part.step]
    (factor, unit), rate = scaled(values, "N/m"), time_axis(axes, window)
    times = rate * result.time[part]
    edges = np.append(times, 2 * times[-1] - times[-2]) - (times[1] - times[0]) / 2
    shown = np.ma.masked_less(factor * values.T, SHOWN * factor * float(values.max()))
    borders, words = _borders(line)
    drawn = axes.pcolormesh(edges, borders, shown, cmap=COLOURS, vmin=0.0, rasterized=True)
    figure.colorbar(drawn, ax=axes, pad=0.01, aspect=18).set_label(f"force per length [{unit}]")
    axes.set(ylim=(0.0, borders[-1]), ylabel=words)
    if line.rings:
        axes.set_yticks(_middles(line), _ports(line))
    elif line.has_angles:
        axes.set(yticks=range(0, 361, 90))
    for border in borders[np.cumsum([number for number, _ in line.pieces[:-1]], dtype=int)]:
        axes.axhline(border, color=GREY, linewidth=0.8)
    axes.grid(visible=False)
    axes.set_title("Force per length on the seat")
    note = f"{contact}: mean over {1e6 * width:g} µs, {arcs} segments"
    axes.set_title(note, loc="right", color=GREY, fontsize=8)


def _borders(line: ClosedLine) -> tuple[Array, str]:
    """Return the borders (N + 1,) between arcs, in degrees or mm, and their label."""
    if not line.has_angles:
        return 1e3 * line.borders, "along each land, from its x axis" if line.rings else "length along the lip [mm]"
    return np.degrees(line.edges), "angle from the x axis, anticlockwise [°]"


def _middles(line: ClosedLine) -> list[float]:
    """Return the places of the middles of the rings of a line, as its `_borders`."""
    return [float(1e3 * (line.borders[ring.start] + line.borders[ring.stop]) / 2) for ring in line.rings]


def _ports(line: ClosedLine) -> list[str]:
    """Return the names of the rings of a line of several; none of another line."""
    count = len(line.rings)
    return list(line.names[:count]) or [f"port {number}" for number in range(1, count + 1)]


def _impulse(axes: Axes, runs: list[ImpactResult], line: ClosedLine, share: float) -> None:
    length = float(line.borders[-1])
    impulses = [line_impulse(run.rows.force[1:], run.rows.time, line.lengths, share, line.pieces) for run in runs]
    factor, unit = scaled(np.concatenate([values for values, _ in impulses]), "N s/m")
    for (values, places), name, (colour, style) in zip(impulses, NAMES, STYLES, strict=False):
        x, around = length * places, values
        if not line.has_angles:
            ends = line.borders[[ring.start for ring in line.rings[1:]]]
            at = [np.searchsorted(x, end + 1e-9 * length) - np.any(np.abs(x - end) < 1e-9 * length) for end in ends]
            x, around = 1e3 * np.insert(x, at, np.nan), np.insert(around, at, np.nan)  # no line from port to port
        else:
            x, around = np.interp(np.append(x, x[0]), line.borders, line.edges), np.append(values, values[0])
        axes.plot(x, factor * around, color=colour, linestyle=style, label=name)
    axes.set_ylim(bottom=0.0)
    if not line.has_angles:
        axes.set(xlabel=_borders(line)[1], xlim=(0.0, 1e3 * length))
        if line.rings:
            axes.set_xticks(_middles(line), _ports(line))
    else:
        axes.set_yticks(load_matplotlib().ticker.MaxNLocator(4).tick_values(0.0, axes.get_ylim()[1])[1:-1])
        axes.set_rlabel_position(22.5)  # type: ignore[attr-defined]
        axes.tick_params(axis="x", pad=1)
    axes.set_title(f"Impulse per length [{unit}], over {1e3 * share * length:.2g} mm")


def _force(axes: Axes, runs: list[ImpactResult], window: tuple[float, float], line: ClosedLine, width: float) -> None:
    """Draw the total forces, and those on each ring of a line of several in the first run."""
    totals = [run.rows.spread_forces(run.rows.force.sum(axis=1))[1:] for run in runs]
    averages = [averaged(total, run.dt, width, MOVING_AVERAGE) for run, total in zip(runs, totals, strict=True)]
    (factor, unit), rate = scaled(np.concatenate(averages), "N"), time_axis(axes, window)
    for run, values, name, (colour, style) in zip(runs, averages, NAMES, STYLES, strict=False):
        part = _within(run, window, 4000)
        axes.plot(rate * run.time[part], factor * values[part], color=colour, linestyle=style, label=name)
    part, first = _within(runs[0], window, 4000), runs[0]
    for number, (ring, name) in enumerate(zip(line.rings, _ports(line), strict=True)):
        own = averaged(
            first.rows.spread_forces(first.rows.force[:, ring].sum(axis=1))[1:], first.dt, width, MOVING_AVERAGE
        )
        colour = OF_LANDS[number % len(OF_LANDS)]
        axes.plot(rate * first.time[part], factor * own[part], color=colour, linewidth=1.0, label=name)
    axes.set_ylabel(f"force [{unit}]")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="best")
    axes.set_title(f"{'Force by land' if line.rings else 'Total force'}, mean over {1e6 * width:g} µs")


def _gaps(axes: Axes, result: ImpactResult, window: tuple[float, float], line: ClosedLine) -> None:
    part, arcs = _within(result, window, 4000), result.rows.force.shape[1]
    gap = _gaps_in(result, part)
    rate, (factor, unit) = time_axis(axes, window), scaled(gap, "m")
    borders, _ = _borders(line)
    for share, colour in zip(QUARTERS, _OF_QUARTERS, strict=True):
        place = share * borders[-1]
        arc = min(int(np.searchsorted(borders, place + 1e-9 * borders[-1], side="right")) - 1, arcs - 1)
        beside = arc - 1 if line.has_angles and place - borders[arc] < 1e-9 * borders[-1] else arc
        name = f"{place:.3g} mm" if not line.has_angles else f"{place:.0f}°"
        if line.rings:
            number, angle = line.place_on_ring(arc)
            name = f"{_ports(line)[number - 1]}, {math.degrees(angle):.0f}°"
        height = (gap[:, arc] + gap[:, beside]) / 2  # at a border of two
        axes.plot(rate * result.time[part], factor * height, color=colour, label=name)
    zero_line(axes)
    axes.set_ylabel(f"gap [{unit}]")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + LEGEND_SPACE * (high - low))
    axes.legend(loc="upper center", ncols=2, fontsize=8, columnspacing=1.0, handlelength=1.2)
    even = line.has_angles and np.ptp(line.lengths) < 1e-9 * line.lengths.max()
    axes.set_title(f"Height over the lip, by {f'{360 / arcs:.3g}°' if even else f'1/{arcs} of it'}")


def _tilt(axes: Axes, result: ImpactResult, window: tuple[float, float], line: ClosedLine) -> None:
    part, rate = _within(result, window, 4000), time_axis(axes, window)
    slopes = np.degrees(np.arctan(best_plane(_gaps_in(result, part), line)[:, 1:]))
    for values, name, colour in ((slopes[:, 1], "roll, about x", BLUE), (-slopes[:, 0], "pitch, about y", ORANGE)):
        axes.plot(rate * result.time[part], values, color=colour, label=name)
    zero_line(axes)
    axes.set_ylabel("angle [°]")
    axes.legend(loc="best")
    axes.set_title("Tilt: plane fitted to all gaps")
