"""The set of two bars: as it states, able to fail, and beyond laws without a memory."""

import tomllib
from pathlib import Path

import impact
from tests.measured import bar_on_bar

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
    """Their stiffness fitted to the first blip: the second one is off by more than three times its uncertainty."""
    coming, (closing, opening) = bar_on_bar.incident(DATA), (DATA["fitted"][key] for key in ("closure", "recovery"))
    for law in (lambda k: impact.LinearSpring(k), lambda k: impact.Hertz(k)):
        stiffness = bar_on_bar.stiffness_for(coming, law, closing["value"])
        second = bar_on_bar.look(coming, law(stiffness)).blips[1]
        assert second - opening["value"] > 3 * opening["uncertainty"]
