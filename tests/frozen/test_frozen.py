"""What the program answers stays: values of all examples and of further scenes, within their error bars."""

import pytest

from tests.frozen.recorded import CHEAP, moved, numbers_in, read_frozen, scenes, worth_telling
from tests.gallery import Gallery, read_summary

FROZEN = read_frozen()


def test_all_scenes_are_frozen() -> None:
    assert sorted(FROZEN) == sorted(scenes())
    assert all(len(numbers) >= 2 for numbers in FROZEN.values())  # impulse and peak, at least


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in CHEAP else pytest.mark.slow) for name in sorted(scenes())]
)
def test_values_stay_within_their_bars(name: str, gallery: Gallery) -> None:
    numbers = numbers_in(read_summary(gallery.run_of(scenes()[name])))
    assert moved(numbers, FROZEN[name]) == []


def test_a_value_that_moves_is_named() -> None:
    frozen = {"a": (1.0, 0.1), "landings.0.a": (2.0, 0.02), "exact": (3.0, 0.0)}
    assert moved({**frozen, "a": (1.09, 0.14)}, frozen) == []
    assert worth_telling({**frozen, "a": (1.009, 0.1)}, frozen) == []
    assert worth_telling({**frozen, "a": (1.09, 0.1)}, frozen) == ["a: moved by 0.90 of its bar"]
    assert moved({**frozen, "a": (1.11, 0.1)}, frozen) == ["a: 1 -> 1.11, error bar 0.1"]
    assert moved({**frozen, "a": (1.0, 0.16)}, frozen) == ["a: error bar 0.1 -> 0.16"]
    assert moved({**frozen, "a": (1.0, 0.06)}, frozen) == ["a: error bar 0.1 -> 0.06"]
    assert moved({**frozen, "landings.0.a": (1.97, 0.02)}, frozen) == ["landings.0.a: 2 -> 1.97, error bar 0.02"]
    assert moved({**frozen, "exact": (3.1, 0.0)}, frozen) == ["exact: 3 -> 3.1, error bar 0"]
    assert moved({**frozen, "landings.0.a": (2.0, 0.05)}, frozen) == ["landings.0.a: error bar 0.02 -> 0.05"]
    assert moved({"speed": (5e-13, 2e-12), "time": (2.0, 2e-4)}, {"speed": (5e-12, 2e-11), "time": (2.0, 1e-4)}) == []
    assert moved({"a": (1.0, 0.1)}, {"b": (1.0, 0.1)}) == ["b: is no longer there", "a: is new"]


def test_a_summary_gives_the_values_with_finite_bars() -> None:
    landing = {"impulse_Ns": 1.0, "error_bar_impulse_Ns": 0.1, "body": "seat"}
    summary = {"peak": 2, "error_bar_peak": 0.5, "error_bar_gone": 1.0, "wild": 1.0, "error_bar_wild": float("inf")}
    summary |= {"error_bar_cut": None, "cut": 1.0, "spring_peak": 3.0, "landings": [landing] * 5}
    expected = {"peak": (2, 0.5)} | {f"landings.{number}.impulse_Ns": (1.0, 0.1) for number in range(3)}
    assert numbers_in(summary) == expected
