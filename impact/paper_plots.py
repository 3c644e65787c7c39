"""Figures of the paper's case and of the regime map, in the common style."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from impact import measures
from impact.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, scaled, sheet, zero_line
from impact.greens import Array
from impact.paper import AREAS, CASES, FILTER_WIDTH, LENGTHS, Case, Numbers
from impact.result import ImpactResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Runs = Mapping[Case, ImpactResult]
_COLOURS = dict(zip(LENGTHS, (BLUE, ORANGE), strict=True))
_READINGS = {"strip": "strip, A = 4.17e-9 m²", "area": "area, A = 4.17e-7 m²"}


def plot_contact_forces(runs: Runs, path: str | os.PathLike[str], *, title: str) -> None:
    """Force against time for both rod lengths; one row for each reading: the whole run, the first contact.

    Thin: force of each step; thick: mean over 1 µs.

    Raises:
        PictureError: matplotlib is missing.
    """
    with sheet(path, 7.2, 5.0) as figure:
        figure.suptitle(title)
        for row, reading in zip(figure.subplots(2, 2, width_ratios=[1.35, 1.0]), AREAS, strict=True):
            chosen = {case: run for case, run in runs.items() if case.reading == reading}
            group = max(measures.contact_groups(run)[0, 1] for run in chosen.values())
            begin = min(measures.contact_groups(run)[0, 0] for run in chosen.values())
            for axes, window in zip(row, ((0.0, 3e-3), (begin - 8e-6, group + 8e-6)), strict=True):
                for case, run in reversed(chosen.items()):
                    _force(axes, run, window, _COLOURS[case.length], f"rod of {1e3 * case.length:g} mm")
                axes.set_ylabel("force [N]")
            row[0].set_title(_READINGS[reading])
            row[1].set_title("first contact")
            row[0].legend(loc="upper center")


def plot_comparison(wave: Runs, spring: Runs, path: str | os.PathLike[str], *, title: str) -> None:
    """First contact, one column for each case: force on rod and on spring, then reed tip and seat.

    Raises:
        PictureError: matplotlib is missing.
    """
    with sheet(path, 10.2, 5.2) as figure:
        figure.suptitle(title)
        panels = figure.subplots(2, len(wave), sharex="col")
        for (force, motion), case in zip(panels.T, wave, strict=True):
            run, other = wave[case], spring[case]
            groups = [measures.contact_groups(r)[0] for r in (run, other)]
            window = (groups[0][0] - 4e-6, max(g[1] for g in groups) + 8e-6)
            _force(force, other, window, ORANGE, "spring K = EA/l")
            _force(force, run, window, BLUE, "rod with waves")
            force.set_title(f"{_READINGS[case.reading].split(',')[0]}, {1e3 * case.length:g} mm")
            force.set_xlabel("")
            _motions(motion, run, other, window)
        panels[0, 0].set_ylabel("force [N]")
        panels[1, 0].set_ylabel("displacement [µm]")
        panels[0, 0].legend(loc="best")
        panels[1, 0].legend(loc="best", fontsize=7)


def plot_stiffness_sweep(
    stiffness: Array,
    springs: Sequence[Numbers],
    waves: Mapping[Case, Numbers],
    path: str | os.PathLike[str],
) -> None:
    """Peak, filtered peak and impulse on a constant stiffness, beside the answers of the rods with waves (points).

    Raises:
        PictureError: matplotlib is missing.
    """
    colours = dict(zip(CASES, (SKY, BLUE, PURPLE, ORANGE), strict=True))
    with sheet(path, 7.2, 6.4) as figure:
        figure.suptitle("“Completely different by selecting a different K”")
        panels = figure.subplots(3, 1, sharex=True)
        for axes, name, label in zip(
            panels,
            ("peak", "filtered_peak", "impulse"),
            ("peak of a step [N]", "peak, mean over 1 µs [N]", "impulse of 3 ms [mN s]"),
            strict=True,
        ):
            factor = 1e3 if name == "impulse" else 1.0
            values = [factor * getattr(numbers, name) for numbers in springs]
            axes.plot(stiffness, values, color="black", marker=".", markersize=3, label="constant stiffness K")
            for case, numbers in waves.items():
                answer = factor * getattr(numbers, name)
                axes.axhline(answer, color=colours[case], linewidth=0.8, linestyle=(0, (4, 2)))
                note = f"rod with waves, {case.reading}, {1e3 * case.length:g} mm"
                axes.plot(case.stiffness, answer, "o", color=colours[case], label=note, zorder=4)
            axes.set(xscale="log", ylabel=label)
        for axes in panels[:2]:
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter("{x:g}")
        panels[2].set_ylim(bottom=0.0)
        panels[2].set_xlabel("K [N/m]; a rod stands at its EA/l")
        panels[2].legend(loc="lower right", ncols=2, fontsize=7)


def _force(axes: Axes, run: ImpactResult, window: tuple[float, float], colour: str, label: str) -> None:
    seen = (run.time >= window[0]) & (run.time <= window[1])
    rate, unit = scaled(window[1], "s")
    axes.plot(rate * run.time[seen], run.force[seen], color=colour, linewidth=0.5, alpha=0.5)
    axes.plot(rate * run.time[seen], measures.filtered_force(run, FILTER_WIDTH)[seen], color=colour, label=label)
    top = max(1.05 * float(run.force[seen].max()), axes.get_ylim()[1])
    axes.set(xlim=(rate * window[0], rate * window[1]), ylim=(0.0, top), xlabel=f"time [{unit}]")


def _motions(axes: Axes, wave: ImpactResult, spring: ImpactResult, window: tuple[float, float]) -> None:
    seen = (wave.time >= window[0]) & (wave.time <= window[1])
    rate, unit = scaled(window[1], "s")
    time = rate * wave.time[seen]
    for run, tip, end, style, name in ((wave, GREEN, BLUE, "-", "waves"), (spring, GREY, ORANGE, (0, (4, 2)), "K")):
        axes.plot(time, 1e6 * run.striker_displacement[seen], color=tip, linestyle=style, label=f"reed tip, {name}")
        axes.plot(
            time, 1e6 * run.target_displacement[seen], color=end, linestyle=style, linewidth=0.9, label=f"seat, {name}"
        )
    zero_line(axes)
    low = 1e6 * min(float(np.min(r.target_displacement[seen])) for r in (wave, spring))
    axes.set(xlim=(time[0], time[-1]), ylim=(1.25 * low, -0.9 * low), xlabel=f"time [{unit}]")
