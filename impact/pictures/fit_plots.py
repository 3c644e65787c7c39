"""Pictures of a pole fit to a measured frequency response: the fit over the data, and the stabilisation diagram.

Source: Ewins, Modal Testing, 2nd ed., 4.5.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from impact.greens import base, modal
from impact.greens.poles import PoleGreens
from impact.measured import amplitudes, frf, pole_fit
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, sheet
from impact.quantities import percent, scaled

if TYPE_CHECKING:
    from matplotlib.axes import Axes


QUANTITIES: Final[dict[str, tuple[int, str]]] = {
    "receptance": (0, "m/N"),
    "mobility": (1, "m/(N s)"),
    "accelerance": (2, "1/kg"),
}
"""Order of the time derivative of the displacement, and unit, of each measured quantity."""
BEYOND: Final = 1.6  # factor by which the curve extends beyond the measured lines on either side
POINTS: Final = 1500


def plot_fit(
    response: frf.FrequencyResponse,
    fitted: modal.ModalGreens | PoleGreens,
    path: str | os.PathLike[str],
    *,
    width: float | None = None,
) -> None:
    """Draw magnitude and phase of the measured quantity, lines as dots, the fit as a curve, the band shaded; below, the
    misfit of each line over its noise, with the lines marked that the fit does not explain.

    ``width``: width of the run's filter [s]; a dotted line at 1/width shows whether the run needs frequencies beyond
    the measured ones.

    Raises:
        PictureError: matplotlib is missing.
    """
    low, high = float(response.frequency[0]), float(response.frequency[-1])
    last = BEYOND * (high if width is None else max(high, min(1 / width, 10 * high)))
    between = response.frequency[(response.frequency > low) & (response.frequency < high)]
    f = np.unique(np.concatenate([np.geomspace(low / BEYOND, last, POINTS), between]))
    order, _ = QUANTITIES[response.measured_as]
    s = response.shift + 2j * np.pi * f
    curve = fitted.transfer(s)[:, 0, 0] * s**order
    data = response.receptance[:, 0, 0] * response.per_receptance
    gaps = fitted.transfer(response.lines)[:, 0, 0] * response.per_receptance - data
    noise = pole_fit.noise_of(response) * np.abs(response.per_receptance)
    factor, unit = scaled_quantity(np.abs(data), response.measured_as)
    rate, frequency_unit = scaled(high, "Hz")
    with sheet(path, 7.2, 7.2) as figure:
        figure.suptitle("Poles fitted to the measured response")
        size, phase, misfit = figure.subplots(3, 1, sharex=True, height_ratios=[1.6, 0.8, 1.0])
        size.plot(rate * response.frequency, factor * np.abs(data), ".", color=ORANGE, markersize=3, label="measured")
        size.plot(rate * f, factor * np.abs(curve), color=BLUE, linewidth=1.1, label="fitted poles")
        phase.plot(rate * response.frequency, _degrees(data), ".", color=ORANGE, markersize=3)
        phase.plot(rate * f, _degrees(curve), color=BLUE, linewidth=1.1)
        _draw_misfit(misfit, fitted, rate, response.frequency, np.abs(gaps), noise)
        for axes in (size, phase, misfit):
            _mark(axes, rate * low, rate * high, None if width is None else rate / width)
        size.set(xscale="log", yscale="log", ylabel=f"|{response.measured_as}| [{unit}]")
        size.set_title("Magnitude")
        size.set_title(_misfit(fitted), loc="right", color=GREY, fontsize=8)
        phase.set(ylim=(-200, 200), yticks=(-180, -90, 0, 90, 180), ylabel="phase [°]")
        phase.set_title("Phase")
        misfit.set(xlabel=f"frequency [{frequency_unit}]", xlim=(rate * f[0], rate * f[-1]))
        misfit.xaxis.set_major_formatter("{x:g}")
        size.legend(loc="best")


def scaled_quantity(values: base.Array, kind: frf.Kind) -> tuple[float, str]:
    """Return factor and unit that make values [SI] of a measured quantity readable; accelerances in 1/kg or 1/g."""
    if kind == "accelerance":
        return (1e-3, "1/g") if np.median(values) > 1e3 else (1.0, "1/kg")
    return scaled(values, QUANTITIES[kind][1])


def _draw_misfit(
    axes: Axes, fitted: modal.ModalGreens | PoleGreens, rate: float, f: base.Array, gaps: base.Array, noise: base.Array
) -> None:
    """Draw |fit - measured|/noise of each line, a rule at 1, and ranges that the fit does not explain in colour."""
    smallest = float(noise.max()) * 1e-12
    axes.plot(rate * f, gaps / np.maximum(noise, smallest), ".", color=BLUE, markersize=2)
    axes.axhline(1.0, color=GREY, linewidth=0.9)
    fit = fitted.provenance.get("fit")
    ranges = fit.get("unexplained_lines_hz", []) if isinstance(fit, dict) else []
    for number, (low, high) in enumerate(ranges):
        axes.axvspan(rate * low, rate * high, color=ORANGE, alpha=0.3, label="beyond the noise" if not number else None)
    axes.set(yscale="log", ylabel="misfit / noise")
    axes.set_title("Misfit of each line over its noise")
    if ranges:
        axes.legend(loc="best")


def _mark(axes: Axes, low: float, high: float, limit: float | None) -> None:
    axes.axvspan(low, high, color=GREY, alpha=0.13, linewidth=0, label="measured band")
    if limit is not None:
        axes.axvline(limit, color=GREY, linewidth=0.9, linestyle=":", label="1/filter width")


def _degrees(values: np.ndarray) -> np.ndarray:
    """Return phase angles in -180..180 deg, with nan at jumps so that no line is drawn across them."""
    phase = np.asarray(np.degrees(np.angle(values)), dtype=float)
    jumps = np.flatnonzero(np.abs(np.diff(phase)) > 180)
    phase[jumps] = np.nan
    return phase


def _misfit(fitted: modal.ModalGreens | PoleGreens) -> str:
    """Return the errors of the fit as it states them, in words."""
    fit = fitted.provenance.get("fit")
    if not isinstance(fit, dict) or not isinstance(value := fit.get("misfit_rms"), float):
        return ""
    missed = fit.get("unexplained", 0.0)
    modes = f"{fit.get('pole_pairs')} modes in the band"
    return f"misfit {percent(value)} (rms), {percent(missed)} beyond the noise; {modes}"


SAME_FREQUENCY: Final = 0.01  # relative change of frequency from order to order below which it is stable
SAME_DAMPING: Final = 0.05  # relative change of the damping ratio below which it is stable
MARGIN: Final = 0.02  # margin of the axis on either side over the band, so that poles at its ends are visible
State = Literal["stable", "frequency", "new"]
MARKS: Final[dict[State, tuple[str, str, str]]] = {
    "stable": ("o", GREEN, "stable: frequency within 1 %, damping within 5 %"),
    "frequency": ("D", BLUE, "stable in frequency alone"),
    "new": ("x", ORANGE, "new, or moved"),
}
"""Marker, colour and words for a pole compared with those of the next lower order."""


@dataclass(frozen=True)
class Row:
    """Poles of one order: number of pairs, frequencies (K,) [Hz], the state of each, and the information criterion."""

    order: int
    frequency: base.Array
    states: tuple[State, ...]
    criterion: float


def rows_of(tried: Sequence[amplitudes.Candidate]) -> list[Row]:
    """Return a row for each order, ascending, of its candidate with the least criterion, poles compared with those of
    the order before; the first row is compared with the second, if there is one."""
    best: dict[int, amplitudes.Candidate] = {}
    for each in sorted(tried, key=lambda each: each.criterion, reverse=True):
        best[len(each.poles.pairs)] = each
    ordered = sorted(best.items())
    rows, before = list[Row](), ordered[min(1, len(ordered) - 1)][1].poles.pairs
    for order, candidate in ordered:
        pairs = candidate.poles.pairs
        states = tuple(_state(complex(pole), before) for pole in pairs)
        rows.append(Row(order, np.abs(pairs) / (2 * np.pi), states, candidate.criterion))
        before = pairs
    return rows


def plot_stabilisation(
    response: frf.FrequencyResponse, tried: Sequence[amplitudes.Candidate], path: str | os.PathLike[str]
) -> None:
    """Draw the poles of every order that was tried over the measured magnitude, and at the right the criterion by which
    the order is chosen; the order of least criterion is shaded.

    A pole is stable if the order before has one whose frequency is within `SAME_FREQUENCY` and whose damping ratio is
    within `SAME_DAMPING`; the first order is compared with the next.

    Raises:
        PictureError: matplotlib is missing.
    """
    rows = rows_of(tried)
    orders, costs = [row.order for row in rows], np.array([row.criterion for row in rows])
    least = orders[int(np.argmin(costs))]
    first, last = float(response.frequency[0]), float(response.frequency[-1])
    rate, frequency_unit = scaled(last, "Hz")
    with sheet(path, 7.6, 4.6) as figure:
        figure.suptitle("Stabilisation of the fitted poles")
        poles, order_axes = figure.subplots(1, 2, sharey=True, width_ratios=[4.2, 1.0])
        _draw_magnitude(poles, response, rate)
        for state, (marker, colour, words) in MARKS.items():
            places = [
                (rate * f, row.order)
                for row in rows
                for f, s in zip(row.frequency, row.states, strict=True)
                if s == state
            ]
            if places:
                size = 22 if state == "new" else 16
                poles.scatter(*zip(*places, strict=True), s=size, marker=marker, color=colour, label=words, zorder=3)
        for axes in (poles, order_axes):
            axes.axhspan(least - 0.4, least + 0.4, color=PURPLE, alpha=0.18, linewidth=0)
        poles.set(
            xlim=(rate * (first - MARGIN * (last - first)), rate * (last + MARGIN * (last - first))),
            ylim=(min(orders) - 0.8, max(orders) + 0.8),
            xlabel=f"frequency [{frequency_unit}]",
            ylabel="pole pairs in the band",
        )
        poles.yaxis.get_major_locator().set_params(integer=True)
        poles.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2, fontsize=7.5)
        order_axes.plot(costs - costs.min(), orders, "o-", color=PURPLE, markersize=4)
        order_axes.set(xscale="symlog", xlabel="criterion above least")
        order_axes.set_title(f"least: {least} pairs")


def _draw_magnitude(axes: Axes, response: frf.FrequencyResponse, rate: float) -> None:
    """Draw the measured magnitude behind the poles, with its own axis on the right."""
    data = np.abs(response.receptance[:, 0, 0] * response.per_receptance)
    factor, unit = scaled_quantity(data, response.measured_as)
    magnitude_axes = axes.twinx()
    magnitude_axes.plot(rate * response.frequency, factor * data, color=GREY, linewidth=0.8, alpha=0.7)
    magnitude_axes.set(yscale="log", ylabel=f"|{response.measured_as}| [{unit}]")
    magnitude_axes.grid(visible=False)
    axes.set_zorder(magnitude_axes.get_zorder() + 1)
    axes.patch.set_visible(False)


def _state(pole: complex, before: base.ComplexArray) -> State:
    """Return how a pole agrees with the nearest in frequency of the order before, as in `MARKS`."""
    if not len(before):
        return "new"
    size = abs(pole)
    nearest = complex(before[np.argmin(np.abs(np.abs(before) - size))])
    if abs(abs(nearest) / size - 1) > SAME_FREQUENCY:
        return "new"
    damping, earlier = -pole.real / size, -nearest.real / abs(nearest)
    return "stable" if abs(damping - earlier) <= SAME_DAMPING * abs(earlier) else "frequency"
