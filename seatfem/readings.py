"""Numbers of summary.json as people read them: value, unit and uncertainty, in letters that every terminal has."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from impact.quantities import html_table, in_digits, in_units, plain, scaled

Summary = Mapping[str, object]
"""The content of summary.json, or of a record in it."""

BAR, SPRING = "error_bar_", "spring_"
"""Prefixes of keys: of an error bar, of the spring baseline."""
MOST_UNCERTAIN: Final = 0.5
"""Share of a value that its error bar may be: with a larger one not even the first digit is known."""
WITHOUT_ZERO: Final = ("time_s", "contact_s", "_deg")
"""How keys of instants and places end: their zero is a convention, and no share of them says anything."""
NO_BAR: Final = math.nan
"""The bar of a number that should have one, and of which none is known."""
UNITS: Final[Mapping[str, str]] = {
    "m_per_s": "m/s", "N_per_m": "N/m", "Ns_per_m": "N s/m", "Ns": "N s", "N": "N", "Pa": "Pa", "J": "J", "s": "s",
    "m": "m", "deg": "deg", "kg": "kg", "Hz": "Hz",
}  # fmt: skip
"""Endings of keys, the longer ones first, and their units."""
DIGITS: Final = 6  # of a value, however small its bar
DEGREES: Final = "deg"


def as_number(value: object) -> float | None:
    """Return a finite number, or ``None`` of anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return value


@dataclass(frozen=True)
class Measured:
    """A number of a run [SI] with its error bar, and that of the spring baseline beside it.

    As text it has a unit of its size: "36.64 ± 0.47 N". ``float`` and formats such as ".3g" take the value.

    Attributes:
        key: name in summary.json, or of a landing in landings.csv.
        value: the number; nan if it is not known.
        bar: half-width of its error bar; nan if there is none, or if it is not known.
        unit: unit of both, without prefix: "N", "N s", "m/s"; "" of plain numbers.
        spring: the number of the spring baseline; nan if it has none.
        has_bar: whether the run states an error bar, be it unknown.
    """

    key: str
    value: float
    bar: float
    unit: str
    spring: float = math.nan
    has_bar: bool = True

    @property
    def is_known(self) -> bool:
        """Return whether the error bar, if there is one, is at most half of the value (`is_known`)."""
        return not self.has_bar or is_known(self.key, self.value, self.bar)

    def __str__(self) -> str:
        return write_with_bar(self.key, as_number(self.value), self.bar if self.has_bar else None, self.unit)

    def __float__(self) -> float:
        return self.value

    def __format__(self, spec: str) -> str:
        return format(self.value, spec) if spec else str(self)

    @property
    def spring_text(self) -> str:
        """Return the number of the spring baseline with its unit; "" if it has none."""
        return "" if math.isnan(self.spring) else write_with_bar(self.key, self.spring, None, self.unit)

    def _repr_html_(self) -> str:
        return html_table(self.key, ("seat", "spring baseline"), [(self, self.spring_text)])


def measured(numbers: Summary, key: str) -> Measured:
    """Return a number of a summary, or of a record in it, with its error bar and the spring's value."""
    values = (as_number(numbers.get(f"{prefix}{key}")) for prefix in ("", BAR, SPRING))
    value, bar, spring = (math.nan if each is None else each for each in values)
    return Measured(key, value, bar, unit_of(key), spring, f"{BAR}{key}" in numbers)


def all_measured(summary: Summary) -> Iterator[Measured]:
    """Yield the numbers of a run in the order of summary.json, each with its error bar and the spring's value."""
    for key, value in summary.items():
        if as_number(value) is not None and not key.startswith((SPRING, "error_", "plan_")):
            yield measured(summary, key)


def unit_of(key: str) -> str:
    """Return the unit at the end of a key [SI], "" of plain numbers."""
    return UNITS.get(ending_of(key).removeprefix("_"), "")


def ending_of(key: str) -> str:
    """Return the end of a key that names its unit, as "_Pa"; "" of plain numbers."""
    return next((f"_{ending}" for ending in UNITS if key.endswith(f"_{ending}")), "")


def is_known(key: str, value: float, bar: float | None) -> bool:
    """Return whether the value of a ``key`` is known: its error bar is a number, at most `MOST_UNCERTAIN` of it."""
    if bar is None or not math.isfinite(bar):
        return False
    return key.endswith(WITHOUT_ZERO) or bar <= MOST_UNCERTAIN * abs(value)


def bar_of(summary: Summary, key: str) -> float | None:
    """Return the error bar of a number; `NO_BAR` where the summary says that it is not known, or states one
    below zero, ``None`` without any.

    A zero that is zero in every run of the error budget, as of a contact that never was, has none.
    """
    stated = summary.get(f"{BAR}{key}", "")
    if stated == 0 and summary.get(key) == 0:  # of what never happened
        return None
    return None if stated == "" else NO_BAR if (bar := as_number(stated)) is None or bar < 0 else bar


def reading(summary: Summary, key: str, unit: str) -> str:
    """Return a number of the summary with unit and error bar, "-" of what is no number."""
    return write_with_bar(key, as_number(summary.get(key)), bar_of(summary, key), unit)


def write_with_bar(key: str, value: float | None, bar: float | None, unit: str, factor: float | None = None) -> str:
    """Return ``value`` [SI] with its bar and its unit: "50.0 ± 0.5 N"; with a ``factor`` times that, of a ``unit``
    that fits.

    A bar that is not known is a question mark; one above half of the value leaves it not known, and says so.
    """
    if value is None:
        return "-"
    if unit == "kg":  # its prefixes are those of the gram
        value, bar, unit = 1e3 * value, None if bar is None else 1e3 * bar, "g"
    known_bar = bar if bar is not None and math.isfinite(bar) else 0.0
    factor, prefixed = prefix_of(unit, value, known_bar) if factor is None else (factor, unit)
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
