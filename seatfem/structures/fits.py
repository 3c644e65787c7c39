"""Reading of what a Green's function that was fitted to a record states of its fit."""

from __future__ import annotations

import math
from dataclasses import dataclass

from impact.greens.base import GreensFunction


@dataclass(frozen=True)
class Fit:
    """Quality of a fit to a measured response, as the fit states it.

    Attributes:
        highest: highest measured frequency [Hz]; ``None`` for a Green's function that is not fitted.
        unexplained: fraction of the response that the fit misses beyond the noise.
        allowed: limit of that fraction.
        ranges: frequency ranges in which the misfit exceeds the noise [Hz], the worst first.
        worst: largest misfit of neighbouring lines over their noise.
    """

    highest: float | None = None
    unexplained: float = 0.0
    allowed: float = math.inf
    ranges: tuple[tuple[float, float], ...] = ()
    worst: float = 0.0


def fit_of(greens: GreensFunction) -> Fit:
    """Return the quality of the fit that is recorded in a Green's function."""
    fit = greens.provenance.get("fit")
    if not isinstance(fit, dict):
        return Fit()
    band, ranges = fit.get("band_hz"), fit.get("unexplained_lines_hz")
    highest = float(band[1]) if isinstance(band, list | tuple) and len(band) == 2 else None
    lines = tuple((float(low), float(high)) for low, high in ranges) if isinstance(ranges, list | tuple) else ()
    missed, allowed, worst = (fit.get(key) for key in ("unexplained", "unexplained_allowed", "misfit_over_noise_worst"))
    if not (isinstance(missed, float) and isinstance(allowed, float) and isinstance(worst, float)):
        return Fit(highest)
    return Fit(highest, missed, allowed, lines, worst)
