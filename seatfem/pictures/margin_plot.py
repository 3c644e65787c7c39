"""The margin of a life against a key of the scene, with the value that it allows."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, sheet

ROUND = (0.1, 0.2, 0.3, 0.5, 0.7, 1, 1.5, 2, 3, 5, 7, 10, 20, 50, 100)
FINER = tuple(round(0.1 * number, 1) for number in range(1, 50))
"""Ticks, where fewer than three of the round ones are seen."""


def plot_margins(
    values: Sequence[float],
    margins: Sequence[float],
    bars: Sequence[float | None],
    path: str | os.PathLike[str],
    *,
    label: str,
    allowed: float | None = None,
    title: str = "Margin on stress over the design life",
) -> None:
    """Draw margins, each a ratio, with their error bars on a logarithmic scale, the limit 1, and the value allowed.

    Args:
        values, margins, bars: of `MarginCurve`; a margin without end is left out, a bar that is not known is not drawn.
        label: of the values, with their unit.

    Raises:
        PictureError: matplotlib is missing.
    """
    spare = np.asarray(margins, dtype=float)
    off = np.array([0.0 if bar is None else bar for bar in bars])
    shown = np.isfinite(spare) & (spare > 0)
    with sheet(path, 6.0, 3.8) as figure:
        figure.suptitle(title)
        axes = figure.add_subplot()
        where, height = np.asarray(values, dtype=float)[shown], spare[shown]
        below = np.minimum(off[shown], 0.99 * height)  # none reaches 0, which has no place on the scale
        axes.errorbar(where, height, np.vstack([below, off[shown]]), marker="o", markersize=4, capsize=2.5, color=BLUE)
        axes.axhline(1.0, color=ORANGE, linestyle=(0, (4, 2)))
        axes.annotate(
            "fails", (0.01, 1.0), (0, -3), axes.get_yaxis_transform(), "offset points", color=ORANGE, va="top"
        )
        if allowed is not None:
            axes.axvline(allowed, color=GREEN, linewidth=1.0)
            axes.plot([allowed], [1.0], marker="D", color=GREEN)
            place = (5, -4) if 2 * allowed < sum(axes.get_xlim()) else (-5, -4)
            side, top = "left" if place[0] > 0 else "right", axes.get_xaxis_transform()
            words = f"allowed: {allowed:.4g}"
            axes.annotate(words, (allowed, 1.0), place, top, "offset points", color=GREEN, va="top", ha=side)
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        rounded = ([tick for tick in each if low <= tick <= high] for each in (ROUND, FINER))
        ticks = next((each for each in rounded if len(each) > 2), [1.0])
        axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        axes.tick_params(colors="black", grid_color=GREY, grid_alpha=0.3)
        axes.set_xlabel(label)
        axes.set_ylabel("margin")
