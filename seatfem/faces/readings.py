"""Numbers of summary.json as people read them: value, unit and uncertainty, in letters that every terminal has."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from impact.quantities import in_digits, in_units, plain, scaled
from seatfem.study.runs.outcome import as_number, is_known

__all__ = ["NO_BAR", "as_number", "bar_of", "duration", "in_text", "reading", "with_unit"]

DIGITS: Final = 6  # of a value, however small its bar
DEGREES: Final = "deg"
KILOGRAM: Final = "kg"  # its prefixes are those of the gram
NO_BAR: Final = math.nan
"""The bar of a number that should have one, and of which none is known."""


def bar_of(summary: Mapping[str, object], key: str) -> float | None:
    """Return the error bar of a number; `NO_BAR` where the summary says that it is not known, or states one
    below zero, ``None`` without any.

    A zero that is zero in every run of the error budget, as of a contact that never was, has none.
    """
    stated = summary.get(f"error_bar_{key}", "")
    if stated == 0 and summary.get(key) == 0:  # of what never happened
        return None
    return None if stated == "" else NO_BAR if (bar := as_number(stated)) is None or bar < 0 else bar


def reading(summary: Mapping[str, object], key: str, unit: str) -> str:
    """Return a number of the summary with unit and error bar, "-" of what is no number."""
    return in_text(key, as_number(summary.get(key)), bar_of(summary, key), unit)


def in_text(key: str, value: float | None, bar: float | None, unit: str, factor: float | None = None) -> str:
    """Return ``value`` [SI] with its bar and its unit: "50.0 ± 0.5 N"; with a ``factor`` times that, of a ``unit``
    that fits.

    A bar that is not known is a question mark; one above half of the value leaves it not known, and says so.
    """
    if value is None:
        return "-"
    if unit == KILOGRAM:
        value, bar, unit = 1e3 * value, None if bar is None else 1e3 * bar, "g"
    factor, prefixed = prefix_of(unit, value) if factor is None else (factor, unit)
    number = factor * value
    if bar is None:
        return with_unit(rounded(number, None), prefixed)
    if not math.isfinite(bar):
        return with_unit(f"{rounded(number, None)} ± ?", prefixed)
    places = places_of(number, factor * bar)
    fine = bar == 0 or (places is not None and factor * bar < 10.0**-places)
    text = f"{rounded(number, places)} ± {in_digits(factor * bar, 2) if fine else rounded(factor * bar, places)}"
    return with_unit(text, prefixed) if is_known(key, value, bar) else f"not known ({with_unit(text, prefixed)})"


def prefix_of(unit: str, *values: float) -> tuple[float, str]:
    """Return factor and unit that make the first of ``values`` that is not zero easy to read."""
    if unit in ("", DEGREES):  # plain numbers and angles take no prefix
        return 1.0, unit
    return scaled([value for value in values if value][:1], unit)


def places_of(number: float, bar: float | None) -> int | None:
    """Return the decimals that the bar leaves known, and one more, at most `DIGITS` in all; ``None``: no bar tells."""
    if not bar or not math.isfinite(bar):
        return None
    known = 1 - math.floor(math.log10(bar))
    return min(max(known, 0), max(DIGITS - 1 - math.floor(math.log10(abs(number) or 1.0)), 0))


def rounded(number: float, places: int | None) -> str:
    """Return a number with so many decimals; where that is not known with four digits, with two in powers of ten."""
    return in_digits(number, 4 if 1e-4 <= abs(number) < 1e6 else 2) if places is None else f"{number:.{places}f}"


def with_unit(number: str, unit: str) -> str:
    """Return a number before its unit, which may be none."""
    return f"{number} {plain(unit)}" if unit else number


def duration(value: object) -> str:
    """Return seconds with their unit, in plain letters."""
    number = as_number(value)
    return "?" if number is None else in_units(number, "s")
