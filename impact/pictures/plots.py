"""Figures by matplotlib: force, motion, energy and strain of an impact, and a Green's function."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from impact.after import measures
from impact.after.result import ImpactResult
from impact.greens.base import Array, ErrorEstimate, GreensFunction
from impact.greens.modal import ModalGreens
from impact.greens.poles import receptance
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, sheet, time_axis, zero_line
from impact.pictures.lip_plots import BODIES, NAMES, STYLES, draw_marks, landing_marks, shown_contact, value_at
from impact.quantities import percent, scaled, text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_Curve = tuple[ImpactResult, Array, str, str, Any]  # run, values, name, colour and line style
SPIKES = 2.5  # top of the axis over the largest mean force; forces of single steps may exceed it


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

    def list_curves(history: str) -> list[_Curve]:
        each = zip(runs, names, STYLES, strict=False)
        return [(run, getattr(run, history), name, *style) for run, name, style in each]

    with sheet(path, 7.2, 7.2) as figure:
        figure.suptitle(title)
        grid = figure.add_gridspec(3, 2, height_ratios=[1.0, 1.0, 1.2])
        reed, seat = figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, :])
        close, gap = figure.add_subplot(grid[2, 0]), figure.add_subplot(grid[2, 1])
        _curves(reed, list_curves("striker_displacement"), (0.0, end))
        _curves(seat, list_curves("target_displacement"), (0.0, end))
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
        _curves(gap, list_curves("gap"), window, "gap")
        gap.set_title(f"Gap, {contact}")
        both = [(result, result.striker_displacement, "reed", GREEN, "solid")]  # they coincide during contact
        _curves(close, [*both, (result, result.target_displacement, "seat", BLUE, (0, (4, 1.5)))], window)
        close.legend(loc="best")
        close.set_title(f"Both bodies, {contact} ({names[0]})")
    return figure


def plot_opening(
    result: ImpactResult,
    baseline: ImpactResult | None = None,
    path: str | os.PathLike[str] | None = None,
    *,
    history: str = "gap",
    filter_width: float = 1e-6,
    title: str = "",
    names: tuple[str, str] = NAMES,
    landings: Sequence[Mapping[str, object]] = (),
) -> Figure:
    """Draw the gap between the contact points, or the lift of the striker's above the target's at rest, against time:
    the whole run, and the hardest contact or landing. ``history``: "gap" or "lift".

    ``landings``: records of summary.json; all are marked. Returns the figure, written to a ``path`` if one is given.
    Raises `PictureError` without matplotlib.
    """
    runs, end = _runs(result, baseline), float(result.time[-1])
    heights = [run.gap if history == "gap" else run.gap + run.target_displacement for run in runs]
    curves: list[_Curve] = [
        (run, height, name, *style) for run, height, name, style in zip(runs, heights, names, STYLES, strict=False)
    ]
    window, contact = shown_contact(runs, filter_width, 0.05, landings)
    with sheet(path, 7.2, 5.0) as figure:
        figure.suptitle(title or history.capitalize())
        whole, close = figure.subplots(2, 1)
        _curves(whole, curves, (0.0, end), history)
        _curves(close, curves, window, history)
        rate, factor = scaled(end, "s")[0], scaled(np.concatenate(heights), "m")[0]
        height = heights[0]
        for body in BODIES:
            marks = landing_marks(landings, body)
            draw_marks(whole, marks, lambda mark: (rate * mark.start, factor * value_at(result, height, mark.start)))
        _mark(whole, window, end)
        whole.set_title("Whole run")
        close.set_title(contact.capitalize())
        figure.legend(*whole.get_legend_handles_labels(), loc="outside lower center", ncols=2)
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
        colour, style = STYLES[k]
        axes.plot(time, run.force[part], color=colour, linewidth=0.5, alpha=0.55, zorder=2.9 - 0.1 * k)
        complete = (run.time[part] >= width / 2) & (run.time[part] <= run.time[-1] - width / 2)  # complete means
        mean = np.where(complete, filtered[k][part], np.nan)
        axes.plot(time, mean, color=colour, linestyle=style, label=names[k], zorder=order)
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
            cell.set_text_props(color=STYLES[row - 1][0], ha="left")


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


if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PER_PULSE = 48  # samples per pulse, with which the sampled convolution is exact to about 1e-4
EXCITED = 1e-3  # least compliance of a pole that counts as a mode, over the port's total compliance
_UNSEEN = 1e-9  # shape at a port below which it is round-off, over the largest
_WINDOW = math.log(100.0)  # exponent of the window of a sampled receptance at its end: 1 %
_LEGEND = 0.45  # space above the curves for the legend, over their height


def plot_greens(
    greens: GreensFunction,
    path: str | os.PathLike[str] | None = None,
    *,
    duration: float,
    width: float,
    title: str = "Driving-point Green's function",
    port: str | int = 0,
) -> Figure:
    """Draw g(t) just after the impulse and over ``duration`` [s], the step response and the receptance.

    The thick line is g after a Hann pulse of total ``width`` [s] (see `GreensFunction.filtered`). The receptance of a
    modal function is in closed form; otherwise it is the transform under an exponential window over ``duration``.
    Returns the figure, written to a ``path`` if one is given. Raises `PictureError` without matplotlib,
    `GreensFunctionError` for no such port, `ValueError` unless 0 < ``width`` <= ``duration``.
    """
    if not 0 < width <= duration < math.inf:
        raise ValueError(f"width = {width:g} s and duration = {duration:g} s must be finite with 0 < width <= duration")
    shown, number = _select_port(greens, greens.port_index(port))
    early = min(15 * width, duration)
    with sheet(path, 7.2, 5.6) as figure:
        figure.suptitle(title)
        axes = figure.subplots(2, 2)
        _impulse(axes[0, 0], shown, number, early, width)
        _impulse(axes[0, 1], shown, number, duration, width)
        axes[0, 0].set_title("Impulse response, first moments")
        axes[0, 1].set_title("Impulse response")
        low, high = axes[0, 0].get_ylim()
        axes[0, 0].set_ylim(low, high + _LEGEND * (high - low))
        axes[0, 0].legend(loc="upper right")
        _step(axes[1, 0], shown, number, duration)
        _receptance(axes[1, 1], shown, number, duration, width)
        figure.supxlabel(error_text(greens.error_estimate, width), fontsize=8, color=GREY)
    return figure


def _select_port(greens: GreensFunction, port: int) -> tuple[GreensFunction, int]:
    """Return modes at one port, without those of no amplitude there: most of those of a complete ring."""
    if (modal := greens.modal) is None:
        return greens, port
    alone = modal.combined(np.eye(len(modal.ports))[:, [port]], (modal.ports[port],))
    size = np.abs(alone.shapes[:, 0])
    visible = size > _UNSEEN * size.max(initial=0.0)
    return alone.select_modes(visible, alone.residual), 0


def error_text(error: ErrorEstimate, width: float) -> str:
    """Return the error estimate in one line."""
    if error.total is None:
        return f"error of g after a {1e6 * width:g} µs pulse: not known"
    if error.total == 0.0:
        return "closed form: no error of reduction or mesh"
    parts = [
        f"{name} {'not known' if value is None else percent(value)}"
        for name, value in (("reduction", error.reduction), ("mesh", error.mesh))
    ]
    return f"estimated error of g after a {1e6 * width:g} µs pulse, relative to its largest value: {', '.join(parts)}"


def sampled_filter(greens: GreensFunction, times: int, width: float, i: int = 0) -> tuple[Array, Array]:
    """Return (t, g after a unit Hann pulse), t = 0 ... ``times`` * width/48, by one convolution of the sampled step
    response.

    As `GreensFunction.filtered`, much cheaper on a uniform grid: integral of p'(s) S(t - s) ds by the trapezoidal rule,
    which is of second order across the start of S, because p' is a full period of a sine.
    """
    h = width / _PER_PULSE
    t = np.asarray(h * np.arange(times + 1), dtype=np.float64)
    step = greens.step_response(t, i, i)
    step[0] *= 0.5  # mean across the jump of a bare compliance
    phase = 2 * np.pi * np.arange(_PER_PULSE) / _PER_PULSE
    slope = 2 * np.pi / width**2 * np.sin(phase)
    return t, np.asarray(h * np.convolve(step, slope)[: len(t)])


def _impulse(axes: Axes, greens: GreensFunction, port: int, duration: float, width: float) -> None:
    rate, time_unit = scaled(duration, "s")
    time, curve = sampled_filter(greens, math.ceil(duration / width * _PER_PULSE), width, port)
    start, largest = float(greens.initial_value()[port, port]), float(np.abs(curve).max())
    if math.isfinite(start):
        largest = max(largest, abs(start))
    factor, unit = scaled(largest, "m/(N s)")
    t = np.linspace(0.0, duration, 3001)[1:]
    raw = factor * greens.impulse_response(t, port, port)
    axes.plot(rate * t, raw, color=BLUE, linewidth=0.5, alpha=0.55, label="g(t)")
    axes.plot(rate * time, factor * curve, color=BLUE, label=f"after a {1e6 * width:g} µs pulse")
    if math.isfinite(start) and start > 0:
        label = f"g(0+) = {text(start, 'm/(N s)')}"
        axes.plot(0.0, factor * start, "o", color=GREEN, markersize=5, clip_on=False, zorder=4, label=label)
    zero_line(axes)
    margin = 0.02 * duration
    axes.set(xlim=(-rate * margin, rate * duration), ylim=(-1.25 * factor * largest, 1.35 * factor * largest))
    if (low := float(curve.min())) > -0.3 * largest:
        axes.set_ylim(bottom=1.3 * factor * min(low, -0.08 * largest))
    axes.set(xlabel=f"time [{time_unit}]", ylabel=f"g [{unit}]")


def _step(axes: Axes, greens: GreensFunction, port: int, duration: float) -> None:
    t = np.linspace(0.0, duration, 3001)
    curve, static = greens.step_response(t, port, port), float(greens.static_compliance()[port, port])
    (rate, time_unit), (factor, unit) = scaled(duration, "s"), scaled(curve, "m/N")
    axes.plot(rate * t, factor * curve, color=BLUE)
    if math.isfinite(static):
        axes.axhline(factor * static, color=GREEN, linewidth=1.0, linestyle=(0, (5, 2)))
        note = f"static {text(static, 'm/N')} = 1/({text(1 / static, 'N/m')})"
        axes.set_title(note, loc="right", color=GREEN, fontsize=8)
    zero_line(axes)
    axes.set(xlim=(0.0, rate * duration), xlabel=f"time [{time_unit}]", ylabel=f"displacement per force [{unit}]")
    axes.set_title("Step response")


def _receptance(axes: Axes, greens: GreensFunction, port: int, duration: float, width: float) -> None:
    high, modal = 3 / width, _modal(greens, duration, 3 / width)
    modes = np.zeros(0) if modal is None else modal.frequencies_hz[modal.frequencies_hz > 0]
    low = min(1 / duration, 0.3 * float(modes.min())) if modes.size else 1 / duration
    if modal is None:
        f, h = _windowed(greens, port, low, high, duration)
    else:
        f = np.unique(np.concatenate([np.geomspace(low, high, 1200), modes[(modes > low) & (modes < high)]]))
        with np.errstate(divide="ignore", invalid="ignore"):
            h = np.abs(receptance(modal, f, port, port))
        f, h = f[np.isfinite(h)], h[np.isfinite(h)]
    (factor, unit), (rate, frequency_unit) = scaled(h, "m/N"), scaled(math.sqrt(low * high), "Hz")
    top = float(h.max())
    bottom = max(float(h.min()), 1e-9 * top)
    axes.set(xscale="log", yscale="log")
    axes.set(xlim=(rate * low, rate * high), ylim=(factor * bottom / 2, 2 * factor * top))
    axes.plot(rate * f, factor * h, color=BLUE, linewidth=1.1)
    static = float(greens.static_compliance()[port, port])
    if math.isfinite(static):
        axes.axhline(factor * static, color=GREEN, linewidth=1.0, linestyle=(0, (5, 2)))
    used = modes[(modes >= low) & (modes <= high)]
    axes.vlines(
        rate * used, 0.0, 0.04, transform=axes.get_xaxis_transform(), color=GREY, linewidth=0.6, zorder=3, label="poles"
    )
    axes.axvline(rate / width, color=GREY, linewidth=0.8, linestyle=":")
    axes.text(rate / width, 0.98, " 1/width", transform=axes.get_xaxis_transform(), va="top", color=GREY, fontsize=7)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
    axes.set(xlabel=f"frequency [{frequency_unit}]", ylabel=f"|receptance| [{unit}]")
    axes.set_title("Receptance" + (", windowed" if modal is None else ""))
    if modal is not None and used.size:
        first = lowest_excited(modal, port)
        lowest = "" if first is None else f", lowest excited {text(first, 'Hz')}"
        axes.set_title(f"{used.size} poles{lowest}", loc="right", color=GREY, fontsize=8)


def lowest_excited(greens: ModalGreens, port: int = 0) -> float | None:
    """Return the frequency [Hz] of the lowest oscillator with at least `EXCITED` of the port's compliance, since weaker
    ones may not be modes."""
    elastic = greens.omega > 0
    compliance = (greens.shapes[elastic, port] / greens.omega[elastic]) ** 2
    whole = float(np.sum(compliance)) + float(greens.residual.static()[port, port])
    excited = greens.frequencies_hz[elastic][compliance >= EXCITED * whole]
    return float(excited.min()) if excited.size else None


def _modal(greens: GreensFunction, duration: float, high: float) -> ModalGreens | None:
    """Return the function as modes, if it is modal or has all relevant modes up to ``high`` [Hz]; else ``None``."""
    if greens.modal is not None:
        return greens.modal
    dt = 1 / (8 * high)
    kernel = greens.step_kernel(dt, math.ceil(duration / dt))
    return kernel.modal if kernel.weights is None else None


def _windowed(greens: GreensFunction, port: int, low: float, high: float, duration: float) -> tuple[Array, Array]:
    """Return (frequencies [Hz], |receptance| [m/N]) from the step response under an exponential window."""
    n = math.ceil(8 * high * duration)
    h = duration / n
    t = h * np.arange(n + 1)
    weights = np.diff(greens.step_response(t, port, port), prepend=0.0) * np.exp(-_WINDOW * t / duration)
    f = np.asarray(np.fft.rfftfreq(4 * n, h), dtype=np.float64)
    inside = (f >= low) & (f <= high)
    return f[inside], np.abs(np.fft.rfft(weights, 4 * n))[inside]
