"""Sets of bars can fail: laws without a memory, a longer pulse, a faster bar; waves against Pochhammer and Chree."""

import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import impact
from tests.known_answers.round_bars import bar_frequency
from tests.measured import bar_on_bar, striker_shot

DATA = tomllib.loads((Path(__file__).parents[1] / "measured" / "bar_on_bar.toml").read_text(encoding="utf-8"))


def test_a_pulse_three_per_cent_longer_is_told_apart() -> None:
    coming, time = bar_on_bar.incident(DATA), DATA["incident"]["time_us"]
    longer = {"incident": {**DATA["incident"], "time_us": [time[0] + 1.03 * (each - time[0]) for each in time]}}
    law, name = impact.RoughJoint(0.0516, 2.0, 0.67), "width of what is passed on, at half height"
    own, other = (bar_on_bar.look(each, law).values[name] for each in (coming, bar_on_bar.incident(longer)))
    assert other - own > 3.0
    row = next(each for each in DATA["predicted"] if each["name"] == name)
    assert abs(other - row["value"]) > 2 * row["uncertainty"]


def test_laws_without_a_memory_throw_back_too_much_when_the_joint_opens() -> None:
    """Laws fitted to the first blip miss the second by more than three times its uncertainty."""
    coming, (closing, opening) = bar_on_bar.incident(DATA), (DATA["fitted"][key] for key in ("closure", "recovery"))
    for law in (lambda k: impact.LinearSpring(k), lambda k: impact.Hertz(k)):
        stiffness = bar_on_bar.stiffness_for(coming, law, closing["value"])
        second = bar_on_bar.look(coming, law(stiffness)).blips[1]
        assert second - opening["value"] > 3 * opening["uncertainty"]


SHOT = tomllib.loads((Path(__file__).parents[1] / "measured" / "striker_shot.toml").read_text(encoding="utf-8"))
RECORD = SimpleNamespace(geometry=SHOT["geometry"], fitted={}, data=SHOT)
MEASURED = np.array([row["value"] for row in SHOT["predicted"]])
KNOWN = np.array([row["uncertainty"] for row in SHOT["predicted"]])


@pytest.mark.slow
def test_the_waves_of_the_bar_are_those_of_pochhammer_and_chree() -> None:
    """The bar's waves converge at fourth order, to 1e-4 at 3/4 of the wave numbers; 3 % of Poisson's ratio show."""
    rows = striker_shot.WAVES * 3 // 4
    errors = []
    for elements in (1, 2):
        speeds = striker_shot.speeds(RECORD, elements)
        number = speeds[rows, 0]
        exact = bar_frequency(number, SHOT["geometry"]["poisson"]) / number
        errors.append(abs(speeds[rows, 1] - exact))
    assert np.log2(errors[0] / errors[1]) > 3.5
    assert errors[1] < 1e-4 < abs(bar_frequency(number, 1.03 * SHOT["geometry"]["poisson"]) / number - exact)


def test_neither_a_bar_without_dispersion_nor_one_three_per_cent_faster_agrees() -> None:
    speeds = striker_shot.speeds(RECORD, 2)
    plain = speeds.copy()
    plain[:, 1] = 1.0
    for other in (striker_shot.crests(RECORD, plain), striker_shot.crests(RECORD, speeds, 1.03**2)):
        assert np.abs(other - MEASURED).max() > 3 * KNOWN.max()
