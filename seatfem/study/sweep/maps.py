"""Pictures of where the limits of a study hold, over one key or two, and the marks of scenes in all charts."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import scipy
from numpy.typing import NDArray

from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, sheet
from impact.quantities import in_digits, plain
from seatfem.readings import BAR
from seatfem.study.sweep.answers import Axis, axis_of, name_ticks, verdicts
from seatfem.study.sweep.effects import varying
from seatfem.study.sweep.limits import (
    CUT_OFF,
    FAILED,
    FAILS,
    HOLDS,
    NEVER_OPENED,
    NO_LANDING,
    NO_VALUE,
    STOPPED,
    UNDECIDED,
    VERDICTS,
)
from seatfem.study.sweep.table import StudyTable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


Array = NDArray[np.float64]
INSIDE, OUTSIDE, DOUBT = "#D9F0E5", "#FBE3D3", "#DCEBF7"
"""Colours of areas where limits hold, where they do not, and where error bars leave it undecided."""
STYLES: Final = ("-", "--", ":", "-.")
FAR: Final = 1e30  # a margin that no scene has
FINE: Final = 240  # points of the grid on which boundaries are drawn, along each side


def draw_map(table: StudyTable, path: Path) -> None:
    """Draw every scene over the two varied keys by its verdict, and the boundary of each limit, interpolated linearly
    between the scenes with values.

    Raises `PictureError` if matplotlib is missing, as does `draw_limits`.
    """
    across, up = (axis_of(table, name) for name in varying(table))
    with sheet(path, 5.4, 5.0) as figure:
        figure.suptitle(table.study.heading, fontsize=9.5)
        axes = figure.add_subplot()
        x, y = _abscissae(axes.xaxis, table, across), _abscissae(axes.yaxis, table, up)
        if not (table.is_text(across.name) or table.is_text(up.name)):
            _areas(axes, table, x, y)
        _marks(axes, np.array(verdicts(table)), x, y)
        axes.set_xlabel(across.label)
        axes.set_ylabel(up.label)
        axes.use_sticky_edges = False
        axes.margins(0.06)
        axes.grid(visible=False)
        _legend(figure, axes)


def draw_limits(table: StudyTable, path: Path) -> None:
    """Draw each limited result over the one varied key: every scene with its error bar and verdict, and the limit."""
    [key] = (axis_of(table, name) for name in varying(table))
    limits = table.study.limits
    with sheet(path, 5.4, 1.4 + 2.8 * len(limits)) as figure:
        figure.suptitle(table.study.heading, fontsize=9.5)
        panels = figure.subplots(len(limits), 1, squeeze=False, sharex=True)[:, 0]
        for axes, limit in zip(panels, limits, strict=True):
            result = axis_of(table, limit.measure)
            x = _abscissae(axes.xaxis, table, key)
            y, bars = (result.factor * table.values(name) for name in (limit.measure, BAR + limit.measure))
            axes.errorbar(x, y, np.nan_to_num(bars), linestyle="", color=GREY, capsize=2, elinewidth=0.9, zorder=1.8)
            at = result.factor * limit.limit
            axes.axhline(at, color="black", linewidth=1.0)
            words = f"limit {in_digits(at, 6)} {result.unit}".rstrip()
            axes.annotate(words, (0.01, at), (0, 2), axes.get_yaxis_transform(), "offset points", fontsize=7.5)
            _marks(axes, np.array(verdicts(table, limit)), x, y)
            low, high = axes.get_ylim()
            low, high = min(low, at - 0.08 * (high - low)), max(high, at + 0.08 * (high - low))
            axes.axhspan(*((low, at) if limit.sign > 0 else (at, high)), color=OUTSIDE, linewidth=0, zorder=0)
            axes.set_ylim(low, high)
            axes.set_ylabel(result.label, fontsize=8)
        panels[-1].set_xlabel(key.label)
        _legend(figure, *panels)


def _abscissae(axis: Any, table: StudyTable, key: Axis) -> Array:
    """Return the places (scenes,) of a key's values on an axis, whose ticks are named for a key of names."""
    if not table.is_text(key.name):
        variation = table.study.vary.get(key.name.partition(" [")[0])
        if getattr(variation, "scale", "linear") == "log":
            axis.axes.set(**{f"{axis.axis_name}scale": "log"})
        return table.numbers(key.name)
    names = list(dict.fromkeys(map(str, table.columns[key.name])))
    axis.set_ticks(range(len(names)), name_ticks(names))
    return np.array([names.index(str(value)) for value in table.columns[key.name]], dtype=float)


def _marks(axes: Axes, of_scenes: NDArray[np.str_], x: Array, y: Array) -> None:
    """Mark each scene by its verdict; those without a place along y at the foot of the panel."""
    for verdict in [each for each in VERDICTS if each in of_scenes]:
        rows = of_scenes == verdict
        axes.plot([], [], label=verdict, **look_of(verdict, 6))
        placed = rows & np.isfinite(y)
        axes.plot(x[placed], y[placed], **look_of(verdict, 6))
        mark_foot(axes, x[rows & ~placed], verdict)


def _areas(axes: Axes, table: StudyTable, x: Array, y: Array) -> None:
    """Shade where all limits hold, where one does not and where it is undecided, and draw the boundary of each.

    Margins are over their limits, so that those of several can be compared.
    """
    logs = axes.get_xscale() == "log", axes.get_yscale() == "log"
    u, v = (np.log10(values) if is_log else values for values, is_log in zip((x, y), logs, strict=True))
    fine = [np.linspace(values.min(), values.max(), FINE) for values in (u, v)]
    across, up = (10**values if is_log else values for values, is_log in zip(fine, logs, strict=True))
    margins = np.array([limit.sign * (table.values(limit.measure) - limit.limit) for limit in table.study.limits])
    bars = np.array([np.nan_to_num(table.values(BAR + limit.measure)) for limit in table.study.limits])
    scales = np.array([[abs(limit.limit) or 1.0] for limit in table.study.limits])
    fields = [spread(u, v, (values / scales).T, fine) for values in (margins, margins - bars, margins + bars)]
    areas = ((-FAR, FAR), DOUBT), ((0.0, FAR), INSIDE), ((-FAR, 0.0), OUTSIDE)
    for field, (levels, colour) in zip(fields, areas, strict=True):
        if field.size:
            axes.contourf(across, up, field.min(axis=-1), levels, colors=[colour], zorder=0)
    for number, (limit, style) in enumerate(zip(table.study.limits, cycle(STYLES), strict=False)):
        result = axis_of(table, limit.measure)
        words = f"limit: {limit.in_words(result.factor, plain(result.unit))}"
        axes.plot([], [], color="black", linewidth=1.1, linestyle=style, label=words)
        if np.nanmin(margins[number]) < 0 < np.nanmax(margins[number]) and fields[0].size:
            field = fields[0][..., number]
            axes.contour(across, up, field, [0.0], colors="black", linewidths=1.1, linestyles=style, zorder=2)


def spread(u: Array, v: Array, values: Array, fine: Sequence[Array]) -> Array:
    """Return values (scenes, n) at places u, v on a fine grid (rows, columns, n), linear between neighbouring scenes.

    It is nan beside scenes without a value; the array is empty if the places are on one line.
    """
    columns, rows = np.unique(u), np.unique(v)
    mesh = tuple(np.meshgrid(*fine))
    if len(columns) * len(rows) == len(u) and min(len(columns), len(rows)) > 1:
        grid = np.full((len(columns), len(rows), values.shape[1]), np.nan)
        grid[np.searchsorted(columns, u), np.searchsorted(rows, v)] = values
        return np.asarray(scipy.interpolate.RegularGridInterpolator((columns, rows), grid)(mesh))
    try:
        return np.asarray(scipy.interpolate.LinearNDInterpolator(np.stack([u, v], axis=1), values, rescale=True)(*mesh))
    except scipy.spatial.QhullError:
        return np.empty(0)


def _legend(figure: Figure, *panels: Axes) -> None:
    """Write one legend beside all panels, each mark once."""
    handles = {
        label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3)


MARKS: Final[dict[str, tuple[str, str, bool]]] = {
    HOLDS: ("o", GREEN, True),
    UNDECIDED: ("D", BLUE, False),
    FAILS: ("X", ORANGE, True),
    CUT_OFF: ("s", PURPLE, False),
    NO_LANDING: ("v", GREY, False),
    NEVER_OPENED: ("^", GREY, False),
    NO_VALUE: ("d", GREY, False),
    STOPPED: ("_", "black", True),
    FAILED: ("x", "black", True),
}
"""Mark of each verdict, its colour, and whether it is filled; scenes without a landing have hollow ones."""
SIGNS: Final[dict[str, str]] = {
    HOLDS: "●", UNDECIDED: "◇", FAILS: "✖", CUT_OFF: "□", NO_LANDING: "▽", NEVER_OPENED: "△", STOPPED: "–", FAILED: "×",
}  # fmt: skip
"""The same marks in text."""
NAMES: Final[dict[str, str]] = {
    CUT_OFF: "square", NO_LANDING: "triangle", NEVER_OPENED: "upright triangle", STOPPED: "dash", FAILED: "cross",
}  # fmt: skip
"""Words for the marks of scenes without a complete landing."""
FOOT: Final = 0.04  # height of the marks of scenes without a value, over that of the panel


def look_of(verdict: str, size: float) -> dict[str, Any]:
    """Return how the mark of a verdict is drawn."""
    marker, colour, is_filled = MARKS[verdict]
    face = colour if is_filled else "white"
    return {
        "linestyle": "", "marker": marker, "color": colour, "markersize": size, "zorder": 3, "markerfacecolor": face,
    }  # fmt: skip


def mark_foot(axes: Axes, x: np.ndarray, verdict: str, size: float = 6) -> None:
    """Mark scenes at their abscissae at the foot of a panel, as they have no value."""
    axes.plot(x, np.full(len(x), FOOT), transform=axes.get_xaxis_transform(), **look_of(verdict, size))
