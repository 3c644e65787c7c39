"""Figures of an impact by matplotlib: force, motion, energy, strain, and the gas of a reed valve."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from impact.after import measures
from impact.after.result import ImpactResult
from impact.gas.compressor import Compressor, GasHistory, Prescribed
from impact.gas.flow import BACK, FORWARD, OTHER
from impact.greens.base import Array
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, sheet, time_axis, zero_line
from impact.pictures.lip_plots import BODIES, draw_marks, landing_marks, shown_contact, value_at
from impact.quantities import percent, scaled, text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


NAMES = ("elastic seat", "spring of equal static stiffness")
_Curve = tuple[ImpactResult, Array, str, str, Any]  # run, values, name, colour and line style
SPIKES = 2.5  # top of the axis over the largest mean force; forces of single steps may exceed it
_COLOURS = (BLUE, ORANGE)
_STYLES = ("solid", (0, (4, 2)))  # dashes above the solid curve, so that both are visible if they coincide


def plot_force(
    result: ImpactResult,
    baseline: ImpactResult | None = None,
    path: str | os.PathLike[str] | None = None,
    *,
    filter_width: float = 1e-6,
    title: str = "Contact force",
    names: tuple[str, str] = NAMES,
    landings: Sequence[Mapping[str, object]] = (),
) -> Figure:
    """Draw contact force against time: the whole run, the hardest contact, its highest pulse, a table of the numbers.

    Thin lines are forces of single steps, thick ones centred moving averages over ``filter_width`` [s]. ``baseline``:
    the same impact on a spring, or ``None``. ``landings``: records of summary.json; those on the seat are marked, and
    the hardest is enlarged in place of the hardest contact. Returns the figure, written to a ``path`` if one is given.
    Raises `PictureError` without matplotlib, `MeasureError` if the steps do not resolve the filter.
    """
    runs = _runs(result, baseline)
    filtered = [measures.filtered_force(run, filter_width) for run in runs]
    factor, unit = scaled([measures.peak_force(run) for run in runs], "N")
    marks = landing_marks(landings)
    group, contact = shown_contact(runs, filter_width, 0.05, landings)
    part, last = _within(result, *group), float(result.time[-1])
    peak = float(result.time[part][int(np.argmax(filtered[0][part]))])
    highest = max(peak - 5 * filter_width, 0.0), min(peak + 11 * filter_width, last)
    with sheet(path, 7.2, 6.6) as figure:
        figure.suptitle(title)
        grid = figure.add_gridspec(3, 2, height_ratios=[1.0, 1.4, 0.18 + 0.12 * len(runs)], width_ratios=[1.7, 1.0])
        whole, zoom, pulse = (figure.add_subplot(place) for place in (grid[0, :], grid[1, 0], grid[1, 1]))
        leave = False
        for axes, window, heading in (
            (whole, (0.0, last), "Whole run"),
            (zoom, group, contact.capitalize()),
            (pulse, highest, "Its highest pulse"),
        ):
            leave |= _forces(axes, runs, filtered, window, names, filter_width)
            axes.set_ylabel(f"force [{unit}]")
            axes.set_title(heading)
            axes.yaxis.set_major_formatter(lambda value, _: f"{factor * value:g}")
        pulse.set_ylabel("")
        rate = scaled(last, "s")[0]
        draw_marks(whole, marks, lambda mark: (rate * mark.peak_time, mark.peak))
        _mark(whole, group, last)
        note = f"thin: steps{' (cut off)' if leave else ''}, thick: {1e6 * filter_width:g} µs mean"
        zoom.set_title(note, loc="right", color=GREY, fontsize=8)
        whole.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
        _table(figure.add_subplot(grid[2, :]), runs, filtered, names, group if marks else None)
    return figure


def plot_motion(
    result: ImpactResult,
    baseline: ImpactResult | None = None,
    path: str | os.PathLike[str] | None = None,
    *,
    filter_width: float = 1e-6,
    title: str = "Motion of the contact points",
    names: tuple[str, str] = NAMES,
    landings: Sequence[Mapping[str, object]] = (),
    crank: tuple[float, float] | None = None,
) -> Figure:
    """Draw displacements of striker and target against time, and both with the gap during the hardest contact.

    That is the contact with the largest mean force over ``filter_width`` [s]; with ``landings``, records of
    summary.json, the hardest landing on the seat. All landings are marked, also those on a stopper. With ``crank``, its
    speed [1/min] and its angle at t = 0 [rad], a second axis shows the angle. Returns the figure, written to a ``path``
    if one is given. Raises `PictureError` without matplotlib.
    """
    runs, end = _runs(result, baseline), float(result.time[-1])

    def of_runs(history: str) -> list[_Curve]:
        return [(run, getattr(run, history), names[k], _COLOURS[k], _STYLES[k]) for k, run in enumerate(runs)]

    with sheet(path, 7.2, 7.2) as figure:
        figure.suptitle(title)
        grid = figure.add_gridspec(3, 2, height_ratios=[1.0, 1.0, 1.2])
        reed, seat = figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, :])
        close, gap = figure.add_subplot(grid[2, 0]), figure.add_subplot(grid[2, 1])
        _curves(reed, of_runs("striker_displacement"), (0.0, end))
        _curves(seat, of_runs("target_displacement"), (0.0, end))
        reed.set_title("Reed, contact point")
        seat.set_title("Seat, contact point")
        reed.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0 if crank is None else 1.24), ncols=2)
        if crank is not None:
            first, per_unit = math.degrees(crank[1]), 6 * crank[0] / scaled(end, "s")[0]
            turns = (lambda time: first + per_unit * time, lambda angle: (angle - first) / per_unit)
            reed.secondary_xaxis("top", functions=turns).set_xlabel("crank angle [deg]")
        _mark_motion(reed, seat, runs, landings)
        little = 0.01 if not landings else 0.05  # of the approach, which would dwarf the gaps
        window, contact = shown_contact(runs, filter_width, little, landings)
        for axes in (reed, seat):
            _mark(axes, window, end)
        _curves(gap, of_runs("gap"), window, "gap")
        gap.set_title(f"Gap, {contact}")
        both = [(result, result.striker_displacement, "reed", GREEN, "solid")]  # they coincide during contact
        _curves(close, [*both, (result, result.target_displacement, "seat", BLUE, (0, (4, 1.5)))], window)
        close.legend(loc="best")
        close.set_title(f"Both bodies, {contact} ({names[0]})")
    return figure


def plot_energy(
    result: ImpactResult,
    path: str | os.PathLike[str] | None = None,
    *,
    title: str = "Energy",
    targets: str = "seat",
) -> Figure:
    """Draw the energy balance: terms stacked up to the energy input, the same on a logarithmic scale, and its error
    [J].

    ``targets``: name of the struck bodies, whose energies are one term. Returns the figure, written to a ``path`` if
    one is given. Raises `PictureError` without matplotlib.
    """
    energy, grid = result.rows.energy, result.rows
    received = ["work on " if name in energy.by_work else "" for name in ("striker", "target")]
    terms = {
        f"{received[0]}reed": (energy.striker, BLUE),
        f"{received[1]}{targets}": (energy.target, GREEN),
        "contact law": (energy.contact, PURPLE),
        "damping": (energy.dissipated - energy.contact_loss, SKY),
        "lost in the contact": (energy.contact_loss, ORANGE),
    }
    terms = {name: (values, colour) for name, (values, colour) in terms.items() if np.any(values != 0.0)}
    imbalance = np.abs(energy.input - energy.stored - energy.dissipated)
    largest = float(np.max(energy.input))
    factor, unit = scaled(largest, "J")
    rate, time_unit = scaled(float(grid.time[-1]), "s")
    shown = np.arange(0, grid.ends[-1] + 1, max(int(grid.ends[-1] + 1) // 6000, 1))
    time = rate * grid.dt * shown
    with sheet(path, 7.2, 6.2) as figure:
        figure.suptitle(title)
        stack, log = figure.subplots(2, 1, sharex=True)
        layers = [factor * np.maximum(grid.find_motions(values, shown), 0.0) for values, _ in terms.values()]
        colours = [colour for _, colour in terms.values()]
        stack.stackplot(time, layers, colors=colours, labels=list(terms), linewidth=0, alpha=0.85)
        stack.plot(
            time, factor * grid.find_motions(energy.input, shown), color="black", linewidth=1.0, label="energy input"
        )
        stack.set(ylabel=f"energy [{unit}]", ylim=(0.0, 1.08 * factor * largest))
        stack.set_title("Stacked terms")
        stack.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        for name, (values, colour) in {**terms, "balance error": (imbalance, GREY)}.items():
            at, thick = grid.find_motions(values, shown), 0.7 if name == "balance error" else 0.9
            log.plot(time, np.where(at > 0, at, np.nan), color=colour, linewidth=thick, label=name)
        lowest = min(1e-9 * largest, max(0.1 * float(imbalance.max()), 1e-18 * largest))
        log.set(yscale="log", ylim=(lowest, 3 * largest), xlim=(0.0, time[-1]))
        log.set(xlabel=f"time [{time_unit}]", ylabel="energy [J]")
        log.set_title(f"Each term; energy balance error {percent(energy.residual)}")
        log.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _runs(result: ImpactResult, baseline: ImpactResult | None) -> list[ImpactResult]:
    return [result] if baseline is None else [result, baseline]


def _within(run: ImpactResult, first: float, last: float) -> slice:
    """Return the recorded times in first..last, with one more on either side."""
    a, b = np.searchsorted(run.time, [first, last])
    return slice(max(int(a) - 1, 0), int(b) + 2)


def _mark_motion(reed: Axes, seat: Axes, runs: list[ImpactResult], landings: Sequence[Mapping[str, object]]) -> None:
    """Mark the landings on the reed's displacement, and name them above that of the seat."""
    rate, moved = scaled(float(runs[0].time[-1]), "s")[0], runs[0].striker_displacement
    factor = scaled(np.concatenate([run.rows.make_displacement("striker") for run in runs]), "m")[0]
    for body in BODIES:
        marks = landing_marks(landings, body)
        draw_marks(reed, marks, lambda mark: (rate * mark.start, factor * value_at(runs[0], moved, mark.start)))
    handles, labels = reed.get_legend_handles_labels()
    if named := handles[len(runs) :]:
        seat.legend(named, labels[len(runs) :], loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)


def _mark(axes: Axes, window: tuple[float, float], end: float) -> None:
    """Shade the window that another panel enlarges."""
    rate = scaled(end, "s")[0]
    axes.axvspan(rate * window[0], rate * window[1], color=GREY, alpha=0.18, linewidth=0)


def _forces(
    axes: Axes,
    runs: list[ImpactResult],
    filtered: list[Array],
    window: tuple[float, float],
    names: tuple[str, str],
    width: float,
) -> bool:
    """Draw the forces of each step and their means over ``width`` [s] where the run contains the whole interval.

    Return whether forces of single steps exceed the axis.
    """
    rate, raw, means = time_axis(axes, window), 0.0, 0.0
    for k, run in enumerate(runs):
        part = _within(run, *window)
        raw = max(raw, float(run.force[part].max(initial=0.0)))
        means = max(means, float(filtered[k][part].max(initial=0.0)))
        time, order = rate * run.time[part], 3 + 0.1 * k
        axes.plot(time, run.force[part], color=_COLOURS[k], linewidth=0.5, alpha=0.55, zorder=2.9 - 0.1 * k)
        complete = (run.time[part] >= width / 2) & (run.time[part] <= run.time[-1] - width / 2)  # complete means
        mean = np.where(complete, filtered[k][part], np.nan)
        axes.plot(time, mean, color=_COLOURS[k], linestyle=_STYLES[k], label=names[k], zorder=order)
    top = SPIKES * means
    leave = raw > top > 0
    axes.set_ylim(0.0, top if leave else None)
    return leave


def _table(
    axes: Axes,
    runs: list[ImpactResult],
    filtered: list[Array],
    names: tuple[str, str],
    landing: tuple[float, float] | None,
) -> None:
    """Write the numbers of each run below the panels; those of the first contact, or the peak in a ``landing`` [s]."""
    axes.axis("off")
    begin = ["first contact", "duration"] if landing is None else ["peak, landing"]
    heads = ["", *begin, "peak, mean", "peak, step", "impulse, all", "contacts (touches)"]
    rows = []
    for run, mean, name in zip(runs, filtered, names, strict=False):
        groups = measures.contact_groups(run)
        if landing is not None:
            first = [text(float(mean[_within(run, *landing)].max()), "N")]
        else:
            first = [text(groups[0, 0], "s"), text(groups[0, 1] - groups[0, 0], "s")] if len(groups) else ["none", "–"]
        of_all = [text(float(mean.max()), "N"), text(measures.peak_force(run), "N"), text(measures.impulse(run), "N s")]
        rows.append([name, *first, *of_all, f"{len(groups)} ({len(measures.contact_intervals(run))})"])
    widths = [0.25, *([0.23 / len(begin)] * len(begin)), 0.11, 0.11, 0.11, 0.19]
    table = axes.table(rows, colLabels=heads, colWidths=widths, loc="center", edges="horizontal", cellLoc="right")
    table.auto_set_font_size(False)
    table.set_fontsize(8.0)
    for (row, column), cell in table.get_celld().items():
        cell.set_edgecolor("#BBBBBB")
        cell.set_linewidth(0.6)
        cell.set_height(1.0 / (len(rows) + 1))
        if row == 0:
            cell.set_text_props(color=GREY)
        elif column == 0:
            cell.set_text_props(color=_COLOURS[row - 1], ha="left")


def _curves(axes: Axes, curves: Sequence[_Curve], window: tuple[float, float], quantity: str = "displacement") -> None:
    parts = [_within(run, *window) for run, *_ in curves]
    factor, unit = scaled(np.concatenate([curve[1][part] for curve, part in zip(curves, parts, strict=True)]), "m")
    rate = time_axis(axes, window)
    for (run, values, name, colour, style), part in zip(curves, parts, strict=True):
        ends, last = run.rows.ends, min(part.stop, len(values)) - 1
        at = np.unique([part.start, *ends[(ends > part.start) & (ends < last)], last])  # lines between ends of steps
        axes.plot(rate * run.dt * at, factor * values[at], color=colour, linestyle=style, label=name)
    zero_line(axes)
    axes.set_ylabel(f"{quantity} [{unit}]")


def plot_strains(
    strains: Mapping[str, Array], dt: float, path: str | os.PathLike[str] | None = None, *, title: str = "Strain"
) -> Figure:
    """Plot the strain (n + 1,) at each gauge, by name, against time; the value at ``dt`` m [s] belongs to the middle of
    the step that ends there. Returns the figure, written to a ``path``. Raises `PictureError` without matplotlib."""
    colours = (BLUE, ORANGE, GREEN, PURPLE, SKY)
    with sheet(path, 7.2, 3.6) as figure:
        axes = figure.add_subplot()
        for number, (name, strain) in enumerate(strains.items()):
            middle = dt * (np.arange(1, len(strain)) - 0.5)
            rate = time_axis(axes, (0.0, dt * (len(strain) - 1)))
            axes.plot(rate * middle, 1e6 * strain[1:], color=colours[number % len(colours)], label=name)
        zero_line(axes)
        axes.set(title=title, ylabel="strain [10⁻⁶], tension positive")
        axes.legend()
    return figure


def plot_gas(
    drive: Compressor | Prescribed,
    history: GasHistory,
    angle: Array,
    volume: Array | None,
    path: str | os.PathLike[str],
    *,
    stop: float | None = None,
    title: str = "Reed valve in its compressor",
) -> None:
    """Plot cylinder pressure, mean lift and mass flow against the crank angle; p over V if the volume is known.

    ``angle`` (n + 1,) [deg] and ``volume`` (n + 1,) [m^3] of the cylinder at the times of the gas's ``history``;
    ``stop``: lift at which the reed meets the stopper [m]. Raises `PictureError` without matplotlib.
    """
    other = "discharge" if drive.side == "suction" else "suction"
    with sheet(path, 7.2, 8.4 if volume is not None else 6.0) as figure:
        figure.suptitle(title)
        rows = [1.0, 1.0, 1.0] + ([1.3] if volume is not None else [])
        grid = figure.add_gridspec(len(rows), 1, height_ratios=rows)
        pressure, lift, flow = (figure.add_subplot(grid[k, 0]) for k in range(3))
        pressure.plot(angle, 1e-5 * history.pressure, color=BLUE, label="cylinder")
        for name, plenum, style in (("suction", drive.suction, "--"), ("discharge", drive.discharge, ":")):
            pressure.axhline(1e-5 * plenum.pressure, color=GREY, linestyle=style, linewidth=1.0, label=f"{name} plenum")
        pressure.set(title="Pressure in the cylinder", ylabel="p [bar]")
        lift.plot(angle, 1e3 * history.lift, color=GREEN, label=f"reed ({drive.side} valve)")
        if stop is not None:
            lift.axhline(1e3 * stop, color=GREY, linestyle="--", linewidth=1.0, label="stopper")
        lift.set(title="Mean lift of the reed", ylabel="lift [mm]")
        flow.plot(angle, 1e3 * history.flow(FORWARD, BACK), color=ORANGE, label=f"reed ({drive.side} valve)")
        if np.any(history.states[:, OTHER]):
            flow.plot(angle, 1e3 * history.flow(OTHER), color=BLUE, linestyle="--", label=f"ideal {other} valve")
        flow.set(title="Mass flow, forward positive", ylabel="flow [g/s]", xlabel="crank angle [deg]")
        for axes in (pressure, lift, flow):
            first, last = float(angle[0]), float(angle[-1])
            axes.set_xlim(first, last)
            step = next(
                (s for s in (15, 30, 45, 90, 180) if (last - first) / s <= 10), 360 * np.ceil((last - first) / 3600)
            )
            axes.set_xticks(np.arange(np.ceil(first / step) * step, last + 1e-6 * step, step))
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
        for axes in (lift, flow):
            zero_line(axes)
        if volume is not None:
            diagram = figure.add_subplot(grid[3, 0])
            diagram.plot(1e6 * volume, 1e-5 * history.pressure, color=BLUE)
            for plenum, style in ((drive.suction, "--"), (drive.discharge, ":")):
                diagram.axhline(1e-5 * plenum.pressure, color=GREY, linestyle=style, linewidth=1.0)
            diagram.set(title="Indicator diagram", xlabel="V [cm³]", ylabel="p [bar]")
