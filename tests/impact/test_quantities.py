"""Numbers as people read them."""

import pytest

from impact.quantities import enumeration, in_digits, in_time, in_units, percent


@pytest.mark.parametrize(
    ("value", "digits", "words"),
    [
        (1.2000000000000002, 3, "1.2"),
        (1.312e14, 2, "1.3e14"),
        (1e10, 2, "1e10"),
        (-0.0, 3, "0"),
        (-1e-9, 2, "-1e-9"),
        (999.96, 3, "1000"),
        (0.00012, 2, "0.00012"),
        (123456.0, 3, "123000"),
        (float("inf"), 3, "inf"),
    ],
)
def test_a_number_has_no_needless_digit(value: float, digits: int, words: str) -> None:
    assert in_digits(value, digits) == words


@pytest.mark.parametrize(
    ("share", "words"),
    [(-0.0, "0 %"), (1.0, "+100 %"), (-0.19, "-19 %"), (12.34, "+1200 %"), (7e-5, "+0.007 %"), (1.8e-15, "0 %")],
)
def test_a_share_in_per_cent(share: float, words: str) -> None:
    """A zero has no sign, a hundred no power of ten."""
    assert percent(share, sign=True) == words


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (2e-7, "s", "200 ns"),
        (3.05e-4, "m", "305 um"),
        (1183.0, "N", "1.18 kN"),
        (2e-5, "m^2", "20 mm^2"),
        (0.5, "", "0.5"),
    ],
)
def test_a_quantity_has_a_unit_of_its_size(value: float, unit: str, words: str) -> None:
    assert in_units(value, unit) == words


def test_times_of_computing() -> None:
    assert [in_time(t) for t in (0.083, 61.0, 100.0, 6000.0)] == ["0.083 s", "61 s", "1.7 min", "1.67 h"]


@pytest.mark.parametrize(
    ("words", "sentence"), [((), ""), (("a",), "a"), (("a", "b"), "a and b"), (("a", "b", "c"), "a, b and c")]
)
def test_words_in_a_sentence(words: tuple[str, ...], sentence: str) -> None:
    assert enumeration(iter(words)) == sentence
