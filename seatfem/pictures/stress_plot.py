"""Stress over time at the hot spots of a run."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import Final

import numpy as np

from impact.greens.base import Array
from impact.pictures.drawing import BLUE, GREY, ORANGE, sheet, zero_line
from impact.quantities import text

Curve = tuple[str, str, Array, Array | None, float]
"""Place; name and history (n,) of its leading component, von Mises stress (n,) [Pa]; time of its largest value [s]."""
MEGA: Final = 1e6
WIDTH, HEIGHT = 9.6, 1.75


def plot_stress_histories(
    time: Array, curves: Sequence[Curve], path: str | os.PathLike[str], *, touch: float, title: str
) -> None:
    """Draw one axes per place, MPa over ms, the first ``touch`` [s] dotted and the largest value since it ringed.

    Raises:
        PictureError: matplotlib is missing.
    """
    columns = 1 if len(curves) < 4 else 2
    rows = math.ceil(len(curves) / columns)
    with sheet(path, WIDTH, 0.8 + HEIGHT * rows) as figure:
        figure.suptitle(title)
        words = "blue: the component named; grey: von Mises; dotted: first touch; ring: the largest since"
        figure.supxlabel(words, fontsize=8)
        grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
        for axes, (place, component, leading, mises, peak_time) in zip(grid.flat, curves, strict=False):
            zero_line(axes)
            if mises is not None:
                axes.plot(1e3 * time, mises / MEGA, color=GREY, linewidth=0.7)
            axes.plot(1e3 * time, leading / MEGA, color=BLUE, linewidth=0.8)
            if math.isfinite(touch):
                axes.axvline(1e3 * touch, color=ORANGE, linestyle=":", linewidth=1.0)
            shown = leading if mises is None else mises
            peak = float(shown[int(np.argmin(np.abs(time - peak_time)))])
            axes.plot(1e3 * peak_time, peak / MEGA, "o", mfc="none", mec=ORANGE, ms=6)
            axes.set_title(f"{place}: {component}")
            note = f"{text(abs(peak), 'Pa')} at {text(peak_time, 's', 4)}"
            axes.text(0.99, 0.97, note, ha="right", va="top", color=GREY, fontsize=8, transform=axes.transAxes)
            axes.set_ylabel("stress [MPa]")
        for axes in grid.flat[len(curves) :]:
            axes.axis("off")
        for column in range(columns):
            last = (len(curves) - 1 - column) // columns
            grid[last, column].set_xlabel("time [ms]")
            grid[last, column].tick_params(labelbottom=True)
