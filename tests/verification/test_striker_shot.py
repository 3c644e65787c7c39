"""The set of a striker's shot: as it states, able to fail, and the waves of its bar against Pochhammer and Chree."""

import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from tests.known_answers.round_bars import bar_frequency
from tests.measured import striker_shot

DATA = tomllib.loads((Path(__file__).parents[1] / "measured" / "striker_shot.toml").read_text(encoding="utf-8"))
RECORD = SimpleNamespace(geometry=DATA["geometry"], fitted={}, data=DATA)
MEASURED = np.array([row["value"] for row in DATA["predicted"]])
KNOWN = np.array([row["uncertainty"] for row in DATA["predicted"]])


def test_the_waves_of_the_bar_are_those_of_pochhammer_and_chree() -> None:
    """At fourth order, to 1e-4 at three quarters of the wave numbers; 3 % more of Poisson's ratio is told apart."""
    rows = striker_shot.WAVES * 3 // 4
    errors = []
    for elements in (1, 2):
        known = striker_shot.speeds(RECORD, elements)
        number = known[rows, 0]
        exact = bar_frequency(number, DATA["geometry"]["poisson"]) / number
        errors.append(abs(known[rows, 1] - exact))
    assert np.log2(errors[0] / errors[1]) > 3.5
    assert errors[1] < 1e-4 < abs(bar_frequency(number, 1.03 * DATA["geometry"]["poisson"]) / number - exact)


def test_neither_a_bar_without_dispersion_nor_one_three_per_cent_faster_agrees() -> None:
    known = striker_shot.speeds(RECORD, 2)
    plain = known.copy()
    plain[:, 1] = 1.0
    for other in (striker_shot.crests(RECORD, plain), striker_shot.crests(RECORD, known, 1.03**2)):
        assert np.abs(other - MEASURED).max() > 3 * KNOWN.max()
