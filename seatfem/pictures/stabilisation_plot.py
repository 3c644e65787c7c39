"""The stabilisation diagram of poles fitted to a measured response: which of them stay as their number grows.

Source: Ewins, Modal Testing, 2nd ed., 4.5.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from impact.greens.base import Array, ComplexArray
from impact.measured.frf import FrequencyResponse
from impact.measured.pole_choice import Candidate
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, sheet
from impact.quantities import scaled
from seatfem.pictures.fit_plot import scaled_quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SAME_FREQUENCY: Final = 0.01  # change of a frequency from one order to the next, below which a pole is stable
SAME_DAMPING: Final = 0.05  # likewise of a damping ratio
MARGIN: Final = 0.02  # of the band, on either side, so that poles at its ends are whole
State = Literal["stable", "frequency", "new"]
MARKS: Final[dict[State, tuple[str, str, str]]] = {
    "stable": ("o", GREEN, "stable: frequency within 1 %, damping within 5 %"),
    "frequency": ("D", BLUE, "stable in frequency alone"),
    "new": ("x", ORANGE, "new, or moved"),
}
"""Marker, colour and words of a pole against those of the order before."""


@dataclass(frozen=True)
class Row:
    """One order: number of pole pairs, their frequencies (K,) [Hz], what each is, and the information criterion."""

    order: int
    frequency: Array
    states: tuple[State, ...]
    criterion: float


def rows_of(tried: Sequence[Candidate]) -> list[Row]:
    """Return the orders from the least on, of each the candidate of least criterion, its poles against those of the
    order before; of the first one against those of the next, where there is one."""
    best: dict[int, Candidate] = {}
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
    response: FrequencyResponse,
    tried: Sequence[Candidate],
    path: str | os.PathLike[str],
) -> None:
    """Draw the poles of every order that was tried over the magnitude of what was measured, with the criterion by which
    the order is chosen on the right; the order of least criterion is shaded.

    A pole is stable where the order before has one whose frequency is within `SAME_FREQUENCY` and whose damping ratio
    is within `SAME_DAMPING`; those of the first order are held against the next.

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


def _draw_magnitude(axes: Axes, response: FrequencyResponse, rate: float) -> None:
    """Draw what was measured behind the poles, by an axis of its own on the right."""
    data = np.abs(response.receptance[:, 0, 0] * response.per_receptance)
    factor, unit = scaled_quantity(data, response.measured_as)
    behind = axes.twinx()
    behind.plot(rate * response.frequency, factor * data, color=GREY, linewidth=0.8, alpha=0.7)
    behind.set(yscale="log", ylabel=f"|{response.measured_as}| [{unit}]")
    behind.grid(visible=False)
    axes.set_zorder(behind.get_zorder() + 1)
    axes.patch.set_visible(False)


def _state(pole: complex, before: ComplexArray) -> State:
    """Return what a pole is against those of the order before: by the nearest of them in frequency."""
    if not len(before):
        return "new"
    size = abs(pole)
    nearest = complex(before[np.argmin(np.abs(np.abs(before) - size))])
    if abs(abs(nearest) / size - 1) > SAME_FREQUENCY:
        return "new"
    damping, earlier = -pole.real / size, -nearest.real / abs(nearest)
    return "stable" if abs(damping - earlier) <= SAME_DAMPING * abs(earlier) else "frequency"
