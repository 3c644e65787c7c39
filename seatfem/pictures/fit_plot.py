"""The picture of poles fitted to a measured frequency response: the fit over the data."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Final

import numpy as np

from impact.greens.modal import ModalGreens
from impact.greens.poles import PoleGreens
from impact.measured.frf import FrequencyResponse
from impact.pictures.drawing import BLUE, GREY, ORANGE, sheet
from impact.quantities import percent, scaled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEYOND: Final = 1.6  # by which the curve goes on beyond the measured lines, on either side
POINTS: Final = 1500


def plot_fit(
    response: FrequencyResponse,
    fitted: ModalGreens | PoleGreens,
    path: str | os.PathLike[str],
    *,
    width: float | None = None,
    title: str = "Poles fitted to the measured response",
) -> None:
    """Magnitude and phase of the receptance: measured lines as dots, the fitted poles as a curve, the band shaded.

    ``width``: of the run's filter [s]; a dotted line at 1/width shows whether the run looks beyond the data.

    Raises:
        PictureError: matplotlib is missing.
    """
    low, high = float(response.frequency[0]), float(response.frequency[-1])
    last = BEYOND * (high if width is None else max(high, min(1 / width, 10 * high)))
    between = response.frequency[(response.frequency > low) & (response.frequency < high)]
    f = np.unique(np.concatenate([np.geomspace(low / BEYOND, last, POINTS), between]))
    curve = fitted.transfer(response.shift + 2j * np.pi * f)[:, 0, 0]
    data = response.receptance[:, 0, 0]
    factor, unit = scaled(np.abs(data), "m/N")
    rate, frequency_unit = scaled(high, "Hz")
    with sheet(path, 7.2, 5.4) as figure:
        figure.suptitle(title)
        size, phase = figure.subplots(2, 1, sharex=True, height_ratios=[1.6, 1.0])
        size.plot(rate * response.frequency, factor * np.abs(data), ".", color=ORANGE, markersize=3, label="measured")
        size.plot(rate * f, factor * np.abs(curve), color=BLUE, linewidth=1.1, label="fitted poles")
        phase.plot(rate * response.frequency, _degrees(data), ".", color=ORANGE, markersize=3)
        phase.plot(rate * f, _degrees(curve), color=BLUE, linewidth=1.1)
        for axes in (size, phase):
            _mark(axes, rate * low, rate * high, None if width is None else rate / width)
        size.set(xscale="log", yscale="log", ylabel=f"|receptance| [{unit}]")
        size.set_title("Magnitude")
        size.set_title(_misfit(fitted), loc="right", color=GREY, fontsize=8)
        phase.set(ylim=(-200, 200), yticks=(-180, -90, 0, 90, 180), ylabel="phase [°]")
        phase.set(xlabel=f"frequency [{frequency_unit}]", xlim=(rate * f[0], rate * f[-1]))
        phase.set_title("Phase")
        phase.xaxis.set_major_formatter("{x:g}")
        size.legend(loc="best")


def _mark(axes: Axes, low: float, high: float, seen: float | None) -> None:
    axes.axvspan(low, high, color=GREY, alpha=0.13, linewidth=0, label="measured band")
    if seen is not None:
        axes.axvline(seen, color=GREY, linewidth=0.9, linestyle=":", label="1/filter width")


def _degrees(values: np.ndarray) -> np.ndarray:
    """In -180 .. 180; without the strokes of jumps between these."""
    found = np.asarray(np.degrees(np.angle(values)), dtype=float)
    jumps = np.flatnonzero(np.abs(np.diff(found)) > 180)
    found[jumps] = np.nan
    return found


def _misfit(fitted: ModalGreens | PoleGreens) -> str:
    """What the fit says of itself."""
    fit = fitted.provenance.get("fit")
    value = fit.get("misfit_weighted_rms") if isinstance(fit, dict) else None
    return f"misfit {percent(value)} (rms, weighted by |receptance|^-1/2)" if isinstance(value, float) else ""
