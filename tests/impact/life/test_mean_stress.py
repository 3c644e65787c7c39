"""Mean stress: values by hand, limits of each criterion, ratios of S-N curves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from impact.life.damage import Gerber, Goodman, MeanStress, Morrow, SmithWatsonTopper, Walker, mean_stress
from impact.life.strength import LifeError, Strength

MPA = 1e6
INVENTED = Strength("invented for tests", ultimate=1800e6, fatigue_strength=2000e6, walker_exponent=0.65)
NAMES = ("goodman", "gerber", "swt", "walker", "morrow")


def one(judge: MeanStress, amplitude: float, mean: float) -> float:
    """In MPa."""
    return float(judge.equivalent(np.array([amplitude * MPA]), np.array([mean * MPA]))[0] / MPA)


def test_compression_is_no_benefit_unless_asked_for() -> None:
    for judge in (Goodman(1800e6), Gerber(1800e6), Morrow(2000e6)):
        assert one(judge, 300, -200) == 300
    assert one(Goodman(1800e6, compression=True), 300, -200) == pytest.approx(300 / (1 + 1 / 9))
    assert one(Morrow(2000e6, compression=True), 300, -200) == pytest.approx(300 / 1.1)


@pytest.mark.parametrize("judge", [SmithWatsonTopper(), Walker(0.65), Walker(1.0)])
def test_nothing_opens_under_compression(judge: MeanStress) -> None:
    assert one(judge, 300, -300) == 0
    assert one(judge, 300, -500) == 0
    assert one(judge, 300, -299.9) > 0


@pytest.mark.parametrize("judge", [Goodman(1800e6), Gerber(1800e6), Morrow(1800e6)])
def test_a_mean_at_the_limit_breaks(judge: MeanStress) -> None:
    assert one(judge, 1, 1800) == one(judge, 1, 2500) == np.inf
    assert one(judge, 1, 1799) < np.inf


@given(st.sampled_from(NAMES), st.floats(1, 600), st.floats(-2.0, 0.9))
def test_a_curve_at_another_ratio_is_the_same_point(name: str, amplitude: float, ratio: float) -> None:
    """The amplitude at R that is equivalent to a cycle of that R is its own."""
    slant = (1 + ratio) / (1 - ratio)
    judge, own = mean_stress(name, INVENTED), np.array([amplitude * MPA])
    equivalent = judge.equivalent(own, slant * own)
    if np.all(np.isfinite(equivalent)) and equivalent[0] > 0:
        np.testing.assert_allclose(judge.at_ratio(equivalent, slant), own, rtol=1e-9)


def test_messages_name_what_is_missing() -> None:
    with pytest.raises(LifeError, match=r"goodman needs ultimate of the material \(a data sheet\)"):
        mean_stress("goodman", Strength("a data sheet"))
    with pytest.raises(LifeError, match=r"no criterion named 'godman'; did you mean 'goodman'\?"):
        mean_stress("godman", INVENTED)


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"source": " "}, "source is empty"),
        ({"ultimate": -1.0}, "ultimate = -1 must be positive"),
        ({"walker_exponent": 1.2}, "must not be above 1"),
        ({"loading_ratio": 1.0}, "below 1"),
        ({"torsion_limit": float("nan")}, "torsion_limit = nan"),
    ],
)
def test_strength_refuses(fields: dict[str, object], told: str) -> None:
    with pytest.raises(LifeError, match=told):
        Strength(**{"source": "invented", **fields})  # type: ignore[arg-type]
