"""Picture of a fit: each record with the computed history, and the residuals over the noise below."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from impact.pictures.drawing import BLUE, GREY, ORANGE, sheet, time_axis, zero_line
from impact.quantities import scaled
from seatfem import units
from seatfem.study.identify.record import DIMENSIONS

if TYPE_CHECKING:
    from seatfem.study.identify.fit import Identified

BAND = 1.96  # standard deviations that contain 95 % of the noise


def draw(result: Identified, path: Path) -> None:
    """Draw all records of a fit. Raises `PictureError`."""
    samples, fitted = result.model.samples, result.model.records_at(result.shares)
    count = len(samples)
    with sheet(path, 6.4, 0.4 + 3.0 * count) as page:
        page.suptitle(result.asked.heading)
        axes = page.subplots(2 * count, 1, height_ratios=[2.4, 1.0] * count, squeeze=False)[:, 0]
        for number, each in enumerate(samples):
            above, below = axes[2 * number], axes[2 * number + 1]
            dimension = DIMENSIONS[each.record.kind]
            rate, unit = scaled(float(np.abs(each.value).max()), units.DIMENSIONS[dimension or "length"].si)
            if not dimension:  # a strain, told as a length over one
                unit = f"{unit}/m"
            window = (float(each.time[0]), float(each.time[-1]))
            at = time_axis(below, window) * each.time
            above.set(xlim=below.get_xlim(), ylabel=f"{each.record.kind} [{unit}]")
            above.set_title(each.record.name.replace("_", " "))
            above.tick_params(labelbottom=False)
            above.plot(at, rate * each.value, ".", color=GREY, markersize=2.5, label="record")
            if result.spring:
                spring = rate * result.spring[number]
                above.plot(at, spring, "--", color=ORANGE, linewidth=1.0, label="on the seat's static stiffness")
            above.plot(at, rate * fitted[number], color=BLUE, label="fit")
            above.legend(loc="best")
            residuals = (each.value - fitted[number]) / each.noise
            zero_line(below)
            below.axhspan(-BAND, BAND, color=GREY, alpha=0.15, linewidth=0)
            below.plot(at, residuals, color=BLUE, linewidth=0.8)
            below.set(ylabel="over noise")
            below.set_title("record less fit, over the noise, 95 % of which lies in the band")
        page.align_ylabels(axes)
