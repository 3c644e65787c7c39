"""Strings with units, at the edges of the program: `"3 mm"` -> 0.003.

The number is split from the unit by a strict pattern, because pint alone reads "0,3 mm" as 0 m and "1 500 rpm" as
500 rpm. The usual units are in a table; only others go to pint, which is slow to load. Inside the program every
quantity is an SI float; `write_quantity` goes back.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from decimal import Decimal
from difflib import get_close_matches
from functools import cache
from itertools import product
from math import inf
from typing import TYPE_CHECKING, Final

from impact.notices import SeatfemError
from impact.quantities import in_digits

if TYPE_CHECKING:
    import pint

_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3}(?!\d))?")
_UNIT = re.compile(r"(?:1\s*/\s*)?[A-Za-zµμ%]+(?:\^-?\d(?:\.5)?|\d)?(?:\s*[*/ ]\s*[A-Za-zµμ]+(?:\^-?\d(?:\.5)?|\d)?)*")
_POWER = re.compile(r"(?<=[A-Za-zµμ])(?=\d)")  # "kg/m3" means "kg/m^3"

_READABLE: Final = (0.1, 1e4)
_OTHERS: Final = {"Pa": (1.0, 1e3), "Hz": (1.0, 1e3), "s": (0.1, 1e3)}  # 310 MPa, 250 kHz, 1 s
LONGEST: Final = 80  # characters: an unlucky text takes the cube of its length


class UnitError(SeatfemError, ValueError):
    """A string is not a quantity of the dimension that is needed."""


@dataclass(frozen=True)
class Dimension:
    """What a key may hold: its name in words, its SI unit, an example for error messages, and two ranges [SI]."""

    name: str
    si: str
    example: str
    usual: Mapping[str, str]
    """Values in SI units, as decimal text, of the units that need no pint."""
    sane: tuple[float, float]
    """Range beyond which a value is an error."""
    usual_range: tuple[float, float]
    """Range beyond which a scene is warned, and by which a number without a unit is given one."""
    made_of: tuple[str, ...] = ()
    """The only base names allowed; keeps hertz, 1/s and rad/s apart, which have one dimension."""


_PSI: Final = "6894.757293168361336722673443"
_PER_MM: Final = "31622.77660168379331998893544"
_PASCALS: Final = f"GPa 1e9, MPa 1e6, kPa 1e3, Pa 1, bar 1e5, psi {_PSI}"
_DEGREES: Final = "deg 0.01745329251994329576923690768, rad 1"
_TABLE: Final = (
    # name, SI unit, example, usual units with their values, sane range, usual range, the only base names
    ("length", "m", "3 mm", "mm 1e-3, um 1e-6, m 1, cm 1e-2, inch 0.0254", (1e-9, 1e4), (1e-6, 2.0)),
    ("area", "m^2", "4 mm^2", "mm^2 1e-6, m^2 1, um^2 1e-12", (1e-18, 1e8), (1e-9, 0.1)),
    ("volume", "m^3", "5 cm^3", "cm^3 1e-6, mm^3 1e-9, m^3 1, ml 1e-6", (1e-18, 1e6), (1e-9, 10.0)),
    ("molar mass", "kg/mol", "29 g/mol", "g/mol 1e-3, kg/mol 1", (1e-6, 1e3), (1e-3, 0.5)),
    ("time", "s", "3 ms", "ms 1e-3, us 1e-6, ns 1e-9, s 1", (1e-15, 1e9), (1e-11, 10.0)),
    ("mass", "kg", "5 g", "g 1e-3, kg 1, mg 1e-6", (1e-18, 1e12), (1e-7, 1e3)),
    ("velocity", "m/s", "2 m/s", "m/s 1, mm/s 1e-3, mm/us 1e3", (1e-12, 1e5), (1e-4, 200.0)),
    ("acceleration", "m/s^2", "9.81 m/s^2", "m/s^2 1, mm/s^2 1e-3", (1e-12, 1e9), (1e-2, 1e6)),
    ("force", "N", "2 N", "N 1, mN 1e-3, kN 1e3", (1e-15, 1e12), (1e-5, 1e6)),
    ("density", "kg/m^3", "7850 kg/m^3", "kg/m^3 1, g/cm^3 1e3", (1e-6, 1e5), (20.0, 23e3)),
    ("pressure", "Pa", "0.2 bar", _PASCALS, (1e-3, 1e18), (1.0, 1e9)),
    ("modulus", "Pa", "200 GPa", _PASCALS, (1e-3, 1e18), (1e9, 1.3e12)),
    ("strength", "Pa", "600 MPa", _PASCALS, (1e-3, 1e11), (1e6, 1e10)),
    ("stiffness", "N/m", "20 N/um", "N/m 1, N/mm 1e3, N/um 1e6, kN/mm 1e6", (1e-12, 1e21), (1.0, 1e12)),
    ("frequency", "Hz", "1 MHz", "MHz 1e6, kHz 1e3, Hz 1, GHz 1e9", (1e-6, 1e15), (1e3, 2e7), ("hertz",)),
    ("bedding", "N/m^3", "2 GPa/mm", "GPa/mm 1e12, MPa/mm 1e9, N/mm^3 1e9, N/m^3 1", (1e-6, 1e24), (1e6, 1e18)),
    ("area damping", "N s/m^3", "4e7 N*s/m^3", "N*s/m^3 1, N*s/mm^3 1e9, Pa*s/m 1", (1e-6, 1e21), (1.0, 1e12)),
    ("angle", "rad", "60 deg", _DEGREES, (1e-9, 1e3), (1e-7, 13.0), ("degree", "radian")),
    ("tilt", "rad", "0.3 deg", _DEGREES, (1e-9, 1e3), (1e-7, 0.0872664626), ("degree", "radian")),
    (
        *("Hertz stiffness", "N/m^1.5", "5 GN/m^1.5", f"N/m^1.5 1, GN/m^1.5 1e9, N/mm^1.5 {_PER_MM}"),
        *((1e-12, 1e24), (1e6, 1e13)),
    ),
    ("slowness", "s/m", "0.1 s/m", "s/m 1, s/mm 1e3, us/mm 1e-3", (1e-9, 1e9), (1e-6, 1e3)),
    (
        *("viscosity", "Pa s", "18 uPa s"),
        *("uPa s 1e-6, uPa*s 1e-6, mPa s 1e-3, mPa*s 1e-3, Pa s 1, Pa*s 1", (1e-9, 1e6), (1e-6, 100.0)),
    ),
    ("rate", "1/s", "10 1/s", "1/s 1, 1/ms 1e3, 1/us 1e6", (1e-9, 1e18), (1e-6, 1e9), ("second", "minute", "hour")),
)
DIMENSIONS: Final = {
    name: Dimension(name, si, example, dict(unit.rsplit(" ", 1) for unit in usual.split(", ")), *bounds)
    for name, si, example, usual, *bounds in _TABLE
}
_OTHER_NAMES: Final = (
    ("temperature", "K"),
    ("impulse", "N s"),
    ("damping coefficient", "N s/m"),
    ("compliance", "m/N"),
    ("energy", "J"),
    ("current", "A"),
)


def parse_quantity(text: str, dimension: str) -> float:
    """Return the SI value of `text`, a number and a unit such as "25.4 mm".

    dimension: a name in `DIMENSIONS`.
    Raises `UnitError` (ValueError) where the text is no number with a unit, or has another dimension. A decimal comma,
    a thousands separator, temperatures, and rpm or rad/s in place of Hz are refused, never guessed at.
    """
    wanted = DIMENSIONS[dimension]
    number, unit = _split(text, wanted)
    value = float(number * _in_si(text, unit, wanted))
    if not math.isfinite(value):
        raise UnitError(f"{text!r} is beyond the largest number; {_need(wanted)}")
    return value


def parse_in(text: str, si: str) -> float:
    """Return the value of `text`, a number and a unit such as "2 mN s", in the SI unit of a result, or in degrees.

    Raises `UnitError` as `parse_quantity`.
    """
    names = {unit: name for name, unit in _OTHER_NAMES} | {"deg": "angle"}
    unnamed = Dimension(names.get(si, f"quantity in {si}"), si, f"2 {si}", {si: "1"}, (0.0, inf), (0.0, inf))
    of_results = (DIMENSIONS["strength"], *DIMENSIONS.values())  # those in Pa are stresses
    wanted = next((each for each in of_results if each.si == si), unnamed)
    number, unit = _split(text, wanted)
    return float(number * _in_si(text, unit, wanted))


def parse_rpm(text: str) -> float:
    """Return a speed of a crank in turns a minute: "3000 1/min", "3000 rpm", "50 1/s". Raises `UnitError`."""
    wanted = DIMENSIONS["rate"]
    try:
        number, unit = _split(text, wanted)
        return float(number if unit == "rpm" else 60 * number * _in_si(text, unit, wanted))
    except UnitError:
        raise UnitError(f"{text!r} is no speed of a crank; write 3000 or '3000 1/min'") from None


def write_quantity(value: float, dimension: str, digits: int = 5) -> str:
    """Return an SI value as a scene has it: in the first of the usual units in which it is easily read.

    dimension: a name in `DIMENSIONS`, "temperature", or "" of a plain number.
    """
    if dimension == "temperature":
        return f"{in_digits(value - 273.15, 6)} degC"
    if not dimension:
        return in_digits(value, 6)
    units = {unit: parse_quantity(f"1 {unit}", dimension) for unit in DIMENSIONS[dimension].usual}
    least, most = _OTHERS.get(DIMENSIONS[dimension].si, _READABLE)
    readable = (unit for unit, size in units.items() if least <= abs(value / size) < most)
    fallback = next(iter(units)) if value == 0 else (min if abs(value) < 1 else max)(units, key=units.__getitem__)
    unit = next(readable, fallback)
    return f"{in_digits(value / units[unit], digits)} {unit}"


def with_unit(number: float, dimension: str) -> str:
    """Return a number with a unit in which it has a usual size, first that of the example: 0.3 -> "0.3 mm"."""
    wanted = DIMENSIONS[dimension]
    (_, first), (least, most) = number_and_unit(wanted.example), wanted.usual_range
    units = (first, *wanted.usual)
    fitting = (unit for unit in units if least <= abs(number) * float(wanted.usual[unit]) <= most)
    return f"{number:g} {next(fitting, first)}"


def ask_for_prefix(value: float, dimension: str, usual: tuple[float, float] | None = None) -> str:
    """Return a question for a ``value`` [SI] that is usual only with another prefix of its unit, as "; did you mean
    '210 GPa'?" for 210 MPa; "" if no prefix makes it usual.

    ``usual``: range [SI]; that of the dimension if ``None``.
    """
    least, most = usual or DIMENSIONS[dimension].usual_range
    sizes = [float(size) for size in DIMENSIONS[dimension].usual.values()]
    ratios = (size / written for size, written in product(sizes, sizes))
    meant = (value * ratio for ratio in ratios if round(math.log10(ratio), 9) % 3 == 0)
    near = next((each for each in meant if least <= abs(each) <= most), None)
    return "" if near is None else f"; did you mean {write_quantity(near, dimension)!r}?"


def parse_fraction(text: str) -> float:
    """Return the value of a pure number, "0.1" or "10 %" -> 0.1. Raises `UnitError`."""
    match = re.fullmatch(rf"({_NUMBER.pattern})\s*(%?)", _bounded(text))
    if match is None:
        raise UnitError(f"{text!r} is not a pure number; write 0.1 or '10 %'")
    return float(Decimal(match[1]) * (Decimal("0.01") if match[2] else 1))


def number_and_unit(value: str | float) -> tuple[float, str]:
    """Return number and unit as they are written: "0.3 mm" -> (0.3, "mm"), 0.1 -> (0.1, ""). Raises `UnitError`."""
    text = _bounded(str(value))
    match = _NUMBER.match(text)
    if match is None:
        raise UnitError(f"{value!r} must start with a number")
    return float(match[0]), text[match.end() :].strip()


def _bounded(text: str) -> str:
    """Return the text without blanks around it."""
    stripped = text.strip()
    if len(stripped) > LONGEST:
        raise UnitError(f"{stripped[:20] + ' ...'!r} has {len(stripped)} characters; a quantity has at most {LONGEST}")
    return stripped


def _split(text: str, wanted: Dimension) -> tuple[Decimal, str]:
    stripped = _bounded(text)
    if (match := _NUMBER.match(stripped)) is None:
        raise UnitError(f"{text!r} does not start with a number; {_need(wanted)}")
    rest = stripped[match.end() :].strip()
    if not rest:
        raise UnitError(f"{text!r} has no unit; write {with_unit(float(match[0]), wanted.name)!r}; {_need(wanted)}")
    if rest.startswith(","):
        raise UnitError(f"{text!r} has a comma; write a decimal point and no separators, e.g. {wanted.example!r}")
    if rest[0].isdigit() and not re.match(r"1\s*/", rest):
        raise UnitError(f"{text!r} has a space inside the number; write it without, e.g. {wanted.example!r}")
    if _UNIT.fullmatch(rest) is None:
        raise UnitError(f"{text!r} is not one number and one unit; {_need(wanted)}")
    return Decimal(match[0]), rest


def _in_si(text: str, unit: str, wanted: Dimension) -> Decimal:
    """Return one ``unit`` in the SI unit of the dimension."""
    if (usual := wanted.usual.get(_POWER.sub("^", unit))) is not None:
        return Decimal(usual)
    parsed = _parse_unit(text, unit, wanted)
    names = [_registry().parse_unit_name(name)[0][1] for name in parsed._units]  # without prefixes: kilohertz -> hertz
    if not _has_dimension(parsed, wanted.si) or (wanted.made_of and not set(names) <= set(wanted.made_of)):
        advice = _need(wanted)
        if wanted.si == "Hz" and set(names) == {"radian", "second"}:
            turns = number_and_unit(text)[0] * float(_factor(str(parsed), "rad/s")) / math.tau
            advice = f"write {write_quantity(turns, wanted.name)!r}, divided by 2 pi"
        raise UnitError(f"{text!r} is {_describe(parsed, unit)}; {advice}")
    return _factor(str(parsed), wanted.si)


def _parse_unit(text: str, unit: str, wanted: Dimension) -> pint.Unit:
    import pint

    try:
        return _registry().parse_units(_POWER.sub("^", unit))
    except (pint.PintError, ValueError, TypeError, AttributeError):
        in_full = {str(_registry().parse_units(known)).lower(): known for known in wanted.usual}
        names = in_full | {known.lower(): known for known in wanted.usual}
        close = [name for name in in_full if len(unit) >= len("mic") and name.startswith(unit.lower())]
        close = close or get_close_matches(unit.lower(), names, cutoff=0.5)
        close.sort(key=lambda known: (abs(len(known) - len(unit)), known[:1] != unit[:1].lower()))  # one wrong letter
        advice = f"did you mean {names[close[0]]!r}?" if close else _need(wanted)
        raise UnitError(f"{text!r}: unknown unit {unit!r}; {advice}") from None


def _has_dimension(unit: pint.Unit, si: str) -> bool:
    return bool(unit.dimensionality == _registry().parse_units(si).dimensionality)


def _describe(unit: pint.Unit, written: str) -> str:
    if unit.dimensionless:
        return "an angle or a pure number"
    names = [(each.name, each.si, each.made_of) for each in DIMENSIONS.values()]
    for name, si, made_of in (*names, *((*other, ()) for other in _OTHER_NAMES)):
        if _has_dimension(unit, si):
            return f"in {written!r}" if made_of else _with_article(name)
    return f"of dimension {unit.dimensionality}"


def _need(wanted: Dimension) -> str:
    return f"{_with_article(wanted.name)} is needed, e.g. {wanted.example!r}"


def _with_article(name: str) -> str:
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


@cache
def _factor(unit: str, si: str) -> Decimal:
    registry = _registry()
    return Decimal(registry.Quantity(Decimal(1), registry.parse_units(unit)).to(si).magnitude)


@cache
def _registry() -> pint.UnitRegistry[Decimal]:
    """Return a registry with decimal factors: "25.4 mm" is the float nearest to 0.0254, not a rounded product."""
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)


def axes_of(place: Collection[float], body: str) -> tuple[str, ...]:
    """Return the names of the coordinates of a place in a body: of a seat's section r and z."""
    return ("r", "z") if len(place) == 2 and body == "seat" else ("x", "y", "z")[: len(place)]


def place_words(place: Collection[float], body: str) -> str:
    """Return a place with its axes, in millimetres: ``"(r, z) = (4.62, 6) mm"``."""
    axes, values = ", ".join(axes_of(place, body)), ", ".join(f"{1e3 * x:.3g}" for x in place)
    return f"({axes}) = ({values}) mm" if len(place) > 1 else f"{axes} = {values} mm"
