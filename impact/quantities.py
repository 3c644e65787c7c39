"""Numbers, quantities and objects as people read them: the one way for terminal, messages, reports and notebooks."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import fields
from html import escape
from numbers import Real
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

_PREFIXES: Final = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_FIXED: Final = {"": (1.0, ""), "rad": (180 / math.pi, "deg"), "kg": (1e3, "g"), "m^2": (1e6, "mm^2")}
"""Factor and unit for which no prefix is chosen: a prefix before a square is not one of the area."""


ROUND_OFF: Final = 1e-9
"""Share below which nothing but round-off is known."""


def scaled(values: ArrayLike, unit: str) -> tuple[float, str]:
    """Return factor and unit that bring the largest finite |value| into 0.99..990: ``(1e6, "µm")`` for 3e-5 m."""
    data = np.abs(np.asarray(values, dtype=float))
    largest = float(np.max(data[np.isfinite(data)], initial=0.0))
    if largest == 0.0:
        return 1.0, unit
    exponent = min(max(3 * math.floor(math.log10(largest * 1.01) / 3), -12), 9)
    return 10.0**-exponent, _PREFIXES[exponent] + unit


def text(value: float, unit: str, digits: int = 3) -> str:
    """Return a number with its prefixed unit, for pictures: ``"28.4 N"``; powers of ten beyond the prefixes."""
    if not math.isfinite(value):
        return "–"
    factor, prefixed = scaled(value, unit)
    number = value * factor
    if number == 0.0:
        return f"0 {unit}"
    if not 1e-3 <= abs(number) < 1e6:
        return f"{number:.{digits - 1}e} {prefixed}"
    decimals = max(digits - 1 - math.floor(math.log10(abs(number) * (1 + 1e-9))), 0)
    return f"{number:.{decimals}f} {prefixed}"


def in_units(value: float, unit: str, digits: int = 3) -> str:
    """Return a number [SI] with a unit of a fitting size, in letters that every terminal has: ``"0.2 us"``."""
    factor, prefixed = _FIXED[unit] if unit in _FIXED else scaled(value, unit)
    number = in_digits(factor * value, digits)
    return f"{number} {plain(prefixed)}" if prefixed else number


def in_digits(value: float, digits: int = 3) -> str:
    """Return a number of at most so many digits, from 1e-4 to 1e6 without powers of ten: "183", "4.5e9", never "-0"."""
    rounded = float(f"{value:.{digits}g}")
    if not math.isfinite(rounded) or rounded == 0.0:
        return f"{rounded + 0.0:g}"
    if 1e-4 <= abs(rounded) < 1e6:
        decimals = max(digits - 1 - math.floor(math.log10(abs(rounded))), 0)
        number = f"{rounded:.{decimals}f}"
        return number.rstrip("0").rstrip(".") if "." in number else number
    mantissa, exponent = f"{rounded:.{digits - 1}e}".split("e")
    return f"{mantissa.rstrip('0').rstrip('.') if '.' in mantissa else mantissa}e{int(exponent)}"


def percent(share: float, digits: int = 2, *, sign: bool = False) -> str:
    """Return a share in per cent: ``"0.44 %"``, ``"+120 %"`` with the ``sign``; a zero has none, nor has round-off."""
    if 0 < abs(share) < ROUND_OFF:
        return "0 %" if sign else f"< {in_digits(100 * ROUND_OFF)} %"
    number = in_digits(100 * share, digits)
    return f"{'+' if sign and share > 0 and number != '0' else ''}{number} %"


def in_time(seconds: float) -> str:
    """Return a time of computing in two figures: seconds, minutes from 100 s on, hours from 100 minutes on."""
    if not math.isfinite(seconds):
        return f"{seconds:g} s"
    for unit, size in (("s", 1.0), ("min", 60.0)):
        if seconds < 99.5 * size:
            return f"{in_digits(seconds / size, 2)} {unit}"
    return f"{in_digits(seconds / 3600)} h"


def plain(unit: str) -> str:
    """Return a unit in letters that every terminal has."""
    return unit.replace("µ", "u")


def check_numbers(error: type[Exception], **values: object) -> None:
    """Raise ``error`` for a value that is no number, as "200 kHz" is none: arguments are in SI units."""
    for name, value in values.items():
        if not isinstance(value, Real):
            raise error(f"{name} = {value!r} is no number; give one in SI units, without its unit")


def enumeration(words: Iterable[str]) -> str:
    """Return words as a list in a sentence: "a", "a and b", "a, b and c"; "" of none."""
    *first, last = (*words,) or ("",)
    return f"{', '.join(first)} and {last}" if first else last


def with_capital(words: str) -> str:
    """Return words with a capital letter at their beginning, the others as they are."""
    return words[:1].upper() + words[1:]


MOST_CHARACTERS = 70  # most characters of one value
MOST_ITEMS = 6  # most items of a sequence that are shown


def brief(thing: object) -> str:
    """Return ``Name(field=value, ...)`` of a dataclass, arrays by shape and range; set it as ``__repr__``."""
    shown = [f for f in fields(thing) if f.repr]  # type: ignore[arg-type]
    values = ", ".join(f"{f.name}={brief_value(getattr(thing, f.name))}" for f in shown)
    return f"{type(thing).__name__}({values})"


def as_html(thing: object) -> str:
    """Return ``str(thing)`` as a small table: its first line the caption, a row a line, split at ": "; for
    ``_repr_html_``."""
    caption, *lines = str(thing).splitlines() or [""]
    rows = "".join(f"<tr>{_cells(line.strip())}</tr>" for line in lines)
    return f"<table><caption style='text-align:left'><b>{escape(caption)}</b></caption>{rows}</table>"


def html_table(caption: str, heads: Iterable[object], rows: Iterable[Iterable[object]]) -> str:
    """Return a table in HTML with the texts of heads and cells, for ``_repr_html_``."""
    style = "style='text-align:left;white-space:nowrap'"
    head = "".join(f"<th {style}>{escape(str(each))}</th>" for each in heads)
    body = "".join(f"<tr>{''.join(f'<td {style}>{escape(str(cell))}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><caption style='text-align:left'><b>{escape(caption)}</b></caption><tr>{head}</tr>{body}</table>"


def _cells(line: str) -> str:
    name, colon, value = line.partition(": ")
    style = "style='text-align:left'"
    if not colon:
        return f"<td colspan='2' {style}>{escape(line)}</td>"
    return f"<th scope='row' {style}>{escape(name)}</th><td {style}>{escape(value)}</td>"


def brief_value(value: object) -> str:
    """Return one value in at most `MOST_CHARACTERS` characters."""
    if isinstance(value, np.ndarray):
        if value.size <= 1 or value.dtype.kind not in "fiu":
            return f"array {value.shape}" + (f" {value.ravel()[0]}" if value.size == 1 else "")
        return f"array {value.shape} {np.min(value):.4g} ... {np.max(value):.4g}"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, str):
        return cut(repr(value))
    if isinstance(value, Mapping):
        return f"{{{cut(some([f'{key}: {brief_value(item)}' for key, item in value.items()]))}}}"
    if isinstance(value, tuple | list):
        return f"({cut(some([brief_value(item) for item in value]))})"
    return cut(repr(value))


def some(items: Iterable[str], most: int = MOST_ITEMS) -> str:
    """Return the first ``most`` of them as text, and how many there are more."""
    listed = list(items)
    return ", ".join(listed[:most]) + (f", ... ({len(listed) - most} more)" if len(listed) > most else "")


def cut(text: str, width: int = MOST_CHARACTERS) -> str:
    """Return one line of at most ``width`` characters."""
    line = " ".join(text.split())
    return line if len(line) <= width else f"{line[: width - 4]} ..."


def finite_or_none(value: float) -> float | None:
    """Return a finite number, else ``None``: JSON knows no infinity."""
    return value if math.isfinite(value) else None
