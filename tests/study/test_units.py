"""Strings with units: right, or refused with a message that helps."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from seatfem.units import DIMENSIONS, UnitError, parse_fraction, parse_quantity


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("3 mm", "length", 3e-3), ("25.4mm", "length", 0.0254), ("1 inch", "length", 0.0254),
        ("0.305 mm", "length", 0.000305), (" -1e-3 m ", "length", -1e-3), (".5 um", "length", 5e-7),
        ("1 µs", "time", 1e-6), ("1 μs", "time", 1e-6), ("1 ns", "time", 1e-9), ("200 GPa", "pressure", 2e11),
        ("7850 kg/m^3", "density", 7850.0), ("7850 kg/m3", "density", 7850.0), ("7.85 g/cm^3", "density", 7850.0),
        ("4.17e-7 m^2", "area", 4.17e-7), ("20 N/um", "stiffness", 2e7), ("1 MHz", "frequency", 1e6),
        ("10 1/s", "rate", 10.0), ("0.5 1/us", "rate", 5e5), ("-2 m/s", "velocity", -2.0), ("5 g", "mass", 5e-3),
    ],
)  # fmt: skip
def test_values_are_the_nearest_float(text: str, dimension: str, value: float) -> None:
    assert parse_quantity(text, dimension) == value


@pytest.mark.parametrize(
    ("text", "dimension", "message"),
    [
        ("0,3 mm", "length", "comma"),
        ("1 500 rpm", "rate", "space inside the number"),
        ("3 mil", "length", "number.*'3 mm'"),
        ("25 degC", "length", "temperature.*length"),
        ("3 kg", "length", "'3 kg'.*'3 mm'"),
        ("3 N", "stiffness", "is a force"),
        ("3", "length", "no unit"),
        ("nan mm", "length", "does not start with a number"),
        ("3 mm + 1 mm", "length", "not one number and one unit"),
        ("3 furlogs", "length", "unknown unit 'furlogs'"),
        ("200 gpa", "pressure", "did you mean 'GPa'"),
        ("6000 rpm", "frequency", "'rpm'.*frequency"),
        ("6 Hz", "rate", "is in 'Hz'; a rate is needed"),
        ("", "length", "does not start with a number"),
        ("1e999 mm", "length", "beyond the largest number"),
        ("0x10 mm", "length", "length is needed"),
    ],
)
def test_what_is_refused(text: str, dimension: str, message: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_quantity(text, dimension)
    assert re.search(message, str(caught.value))


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(sorted(DIMENSIONS)))
def test_si_values_survive_writing_and_reading(value: float, dimension: str) -> None:
    read = parse_quantity(f"{value!r} {DIMENSIONS[dimension].si}", dimension)
    # the decimal context keeps 28 digits, more than a double holds
    assert read == value


@pytest.mark.slow
@given(st.text(max_size=12))
def test_any_text_is_a_finite_number_or_refused(text: str) -> None:
    try:
        value = parse_quantity(text, "length")
    except UnitError:
        return
    assert math.isfinite(value)


@pytest.mark.parametrize(("text", "value"), [("1 %", 0.01), ("10%", 0.1), ("0.03", 0.03), ("1e-2", 0.01)])
def test_fractions(text: str, value: float) -> None:
    assert parse_fraction(text) == value


@pytest.mark.parametrize("text", ["1 mm", "one", "0,1", "% 1", ""])
def test_fractions_refused(text: str) -> None:
    with pytest.raises(UnitError, match="pure number"):
        parse_fraction(text)
