"""Marks of landings in figures along time: a numbered triangle for each of the hardest, the very hardest filled."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from impact.after import measures
from impact.after.result import ImpactResult
from impact.greens.base import Array
from impact.pictures.drawing import PURPLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST: Final = 10  # that are marked, the hardest
FEW: Final = 20  # filter widths, the least that an enlarged landing shows
COLOUR: Final = PURPLE
APART: Final = 0.02  # of the width of axes: of marks that are closer the hardest has its number
ROOM: Final = 0.12  # of the height of axes, above which numbers stand
Body = Literal["seat", "stopper"]
BODIES: Final[tuple[Body, ...]] = ("seat", "stopper")
SHAPES: Final[Mapping[Body, str]] = {"seat": "v", "stopper": "^"}


@dataclass(frozen=True)
class LandingMark:
    """One landing in a figure, with its ``number`` among those on that body, from 1 on, and times [s].

    ``peak``: its largest averaged force [N]; ``hardest``: whether that exceeds the static load most, of all on this
    body.
    """

    body: Body
    number: int
    start: float
    end: float
    peak_time: float
    peak: float
    hardest: bool


def landing_marks(records: Sequence[Mapping[str, object]], body: Body = "seat") -> tuple[LandingMark, ...]:
    """Return the marks of the hardest landings on a body, the hardest first, by complete records as in summary.json."""
    keys = ("excess_peak_force_N", "number", "time_s", "duration_s", "peak_time_s", "filtered_peak_force_N")
    rows = [[each.get(key) for key in keys] for each in records if each.get("body") == body]
    known = [[float(v) for v in row if isinstance(v, int | float) and not math.isnan(v)] for row in rows]
    complete = sorted((row for row in known if len(row) == len(keys)), key=lambda row: -row[0])
    return tuple(
        LandingMark(body, int(number), start, start + lasting, peak_time, peak, rank == 0)
        for rank, (_, number, start, lasting, peak_time, peak) in enumerate(complete[:MOST])
    )


def shown_contact(
    runs: Sequence[ImpactResult], width: float, margin: float, landings: Sequence[Mapping[str, object]] = ()
) -> tuple[tuple[float, float], str]:
    """Return time window [s] and name of what is enlarged: the hardest of the ``landings`` on the seat.

    Without any, the group of contacts of the first run in which the mean force over ``width`` [s] is largest, and
    groups of the others at that time, ``margin`` of it on either side; or the whole run.
    """
    last, marks = float(runs[0].time[-1]), landing_marks(landings)
    if (window := _landing_window(marks, margin, width)) is not None:
        words = f"landing {marks[0].number}, the hardest" if len(marks) > 1 else "the landing"
        return (window[0], min(window[1], last)), words
    number, (begin, end) = measures.hardest_group(runs[0], width)
    if math.isnan(begin):
        return (0.0, last), "no contact"
    for run in runs[1:]:
        solid = run.solid[1:].reshape(len(run.solid) - 1, -1).sum(axis=1)
        groups = measures.merged(run.dt * measures.closed_steps(solid))
        beside = groups[(groups[:, 0] <= end) & (groups[:, 1] >= begin)]
        begin, end = min([begin, *beside[:, 0]]), max([end, *beside[:, 1]])
    extra = margin * (end - begin) + 2 * runs[0].dt
    window = max(float(begin - extra), 0.0), min(float(end + extra), last)
    return window, "first contact" if number == 0 else f"contact {number + 1}, the hardest"


def _landing_window(marks: Sequence[LandingMark], margin: float, width: float) -> tuple[float, float] | None:
    """Return the window [s] of the hardest landing with ``margin`` of its duration, or filter widths, on either
    side."""
    mark = next((mark for mark in marks if mark.hardest), None)
    if mark is None:
        return None
    beside = max(margin * (mark.end - mark.start), (FEW * width - (mark.end - mark.start)) / 2, 2 * width)
    return max(mark.start - beside, 0.0), mark.end + beside


def draw_marks(axes: Axes, marks: Sequence[LandingMark], place: Callable[[LandingMark], tuple[float, float]]) -> None:
    """Draw the ``marks`` of one body, numbered, at their ``place`` in the units of the axes; one is in the legend."""
    label = {"seat": "landing (filled: the hardest)", "stopper": "landing on the stopper"}
    numbered: list[float] = []
    least = APART * abs(axes.get_xlim()[1] - axes.get_xlim()[0])
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
        axes.set_ylim(low, high + ROOM * (high - low))


def value_at(run: ImpactResult, values: Array, time: float) -> float:
    """Return one of the ``values`` (n + 1,) of a run, at the step nearest to a ``time`` [s]."""
    return float(values[int(np.clip(np.searchsorted(run.time, time), 0, len(values) - 1))])
