"""Cycles by rainflow, S-N curves, mean stress, lives and margins, rules of closing speeds. Strengths are invented."""

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rainflow import extract_cycles

from impact.life.damage import (
    Cycles,
    Gerber,
    Goodman,
    MeanStress,
    Morrow,
    SmithWatsonTopper,
    Walker,
    damage,
    from_peak,
    life,
    margin,
    mean_stress,
    rainflow,
    reversals,
)
from impact.life.strength import Curve, LifeError, Strength, basquin, speed_margin, tabled

CLOSINGS = 25_000 * 60 * 3000.0
"""25 000 h at 3000 rpm."""
KNEE = basquin(400e6, 1e7, 12.0, scatter=0.25)
INVENTED = Strength("invented for tests", ultimate=1800e6, fatigue_strength=2000e6, walker_exponent=0.65, curve=KNEE)
blocks_of_stress = arrays(
    np.float64, st.integers(2, 40), elements=st.integers(-300 * 10**6, 400 * 10**6).map(float)
).filter(np.ptp)


def reversed_cycles(amplitude: float, count: float = 1.0) -> Cycles:
    """Return cycles without a mean."""
    return Cycles(np.array([2 * amplitude]), np.zeros(1), np.array([count]))


ONE = reversed_cycles(1e8)


@pytest.mark.parametrize(("share", "z"), [(0.9, 1.28155), (0.977, 1.99539), (0.99, 2.32635), (0.999, 3.09023)])
def test_survival_by_the_normal_distribution(share: float, z: float) -> None:
    """Quantiles of life are those of tables of the normal distribution."""
    assert math.log10(KNEE.life(450e6) / KNEE.life(450e6, share)) / 0.25 == pytest.approx(z, abs=5e-6)


def test_slopes_on_both_sides_of_the_knee() -> None:
    lives = KNEE.life([800e6, 400e6, 200e6, 0.0, math.inf])
    np.testing.assert_allclose(lives[:3], [1e7 * 2.0**-12, 1e7, 1e7 * 2.0**23], rtol=1e-12)
    assert lives[3:].tolist() == [math.inf, 0.0]
    assert basquin(400e6, 1e7, 12.0, 5.0).life(200e6) == pytest.approx(1e7 * 32)
    limit = basquin(400e6, 1e7, 12.0, math.inf)
    assert limit.life(400e6) == pytest.approx(1e7)
    assert limit.life(399.9e6) == math.inf
    assert limit.stress(1e12) == pytest.approx(400e6)


def test_a_table_goes_through_its_points() -> None:
    points = [(600e6, 1e5), (450e6, 1e6), (400e6, 1e7)]
    curve = tabled(points)
    for stress, cycles in points:
        assert curve.life(stress) == pytest.approx(cycles)
        assert curve.stress(cycles) == pytest.approx(stress)
    assert curve.life(math.sqrt(600e6 * 450e6)) == pytest.approx(math.sqrt(1e5 * 1e6))
    assert curve.life(200e6) == pytest.approx(1e7 * 2 ** (math.log(10) / math.log(450 / 400)))


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: tabled([(400e6, 1e5), (420e6, 1e6)]), r"4e\+08 Pa.*100000 cycles.*4.2e\+08 Pa"),
        (lambda: tabled([(400e6, 1e5), (300e6, 1e5)]), "points rise"),
        (lambda: tabled([(400e6, 1e5)]), "two points or more"),
        (lambda: tabled([(400e6, 1e5), (-300e6, 1e6)]), "must be positive"),
        (lambda: basquin(400e6, 1e7, 1 / 12), "is it 1/k"),
        (lambda: basquin(400e6, 1e7, 12.0, scatter=-0.1), "scatter = -0.1"),
        (lambda: basquin(400e6, 1e7, 12.0, survival=1.0), "survival = 1 must lie between"),
        (lambda: basquin(400e6, 1e7, 12.0).life(1e8, 0.99), "needs the scatter"),
        (lambda: KNEE.life([1e8, -1e8]), "amplitude of -1e\\+08 Pa"),
        (lambda: KNEE.stress(0.0), "cycles = 0 must be positive"),
        (lambda: Curve((), (), 1.0, 1.0), "needs points"),
        (lambda: damage(ONE, Strength("a data sheet"), SmithWatsonTopper()), r"'curve' .*\(a data sheet\)"),
        (lambda: margin(ONE, INVENTED, SmithWatsonTopper(), blocks=0.0), "blocks = 0"),
        (lambda: mean_stress("goodman", Strength("a data sheet")), r"goodman .*'ultimate' .*\(a data sheet\)"),
        (lambda: mean_stress("godman", INVENTED), r"'godman'.*'goodman'\?"),
    ],
)
def test_curves_and_lives_that_are_refused(build: object, words: str) -> None:
    with pytest.raises(LifeError, match=words):
        build()  # type: ignore[operator]


def test_miner_adds_up_cycles() -> None:
    both = Cycles(np.array([800e6, 1600e6]), np.zeros(2), np.array([10.0, 2.0]))
    assert damage(both, INVENTED, SmithWatsonTopper()) == pytest.approx(10 / 1e7 + 2 * 4096 / 1e7)


def test_a_life_by_hand() -> None:
    """300 about 200 MPa is 337.5 MPa for Goodman: N = 1e7 (400/337.5)^23."""
    result = life(Cycles(np.array([600e6]), np.array([200e6]), np.ones(1)), INVENTED, Goodman(1800e6), blocks=CLOSINGS)
    assert result.blocks == pytest.approx(1e7 * (400 / 337.5) ** 23)
    stress = KNEE.stress(CLOSINGS) / 1e6  # f 300/(1 - f 200/1800) = stress
    assert result.margin == pytest.approx(stress / (300 + stress / 9), rel=1e-9)
    assert result.damage == pytest.approx(1 / result.blocks)
    assert (result.survival, result.advice) == (0.5, ())


@pytest.mark.slow
@settings(deadline=None)
@given(blocks_of_stress, st.sampled_from(("goodman", "gerber", "swt", "walker", "morrow")), st.floats(0.3, 3.0))
def test_a_margin_scales_with_stress_and_uses_up_the_part(history: np.ndarray, name: str, factor: float) -> None:
    judge, cycles = mean_stress(name, INVENTED), rainflow(history)
    life_margin = margin(cycles, INVENTED, judge, blocks=1e6)
    scaled = margin(rainflow(factor * history), INVENTED, judge, blocks=1e6)
    assert scaled == pytest.approx(life_margin / factor, rel=1e-6)
    if math.isfinite(life_margin):
        at_it = Cycles(life_margin * cycles.ranges, life_margin * cycles.means, cycles.counts)
        # smax of 1 Pa: 1e-7 off, to the 12th power
        assert damage(at_it, INVENTED, judge) * 1e6 == pytest.approx(1, rel=1e-4)


def test_a_margin_at_a_jump() -> None:
    """The margin is exact at an endurance limit, and where the mean breaks the part before cycles do."""
    limited = Strength("invented", curve=basquin(400e6, 1e7, 12.0, math.inf))
    assert margin(reversed_cycles(200e6), limited, SmithWatsonTopper(), blocks=1e9) == pytest.approx(2.0, rel=1e-9)
    steady = Cycles(np.array([2.0]), np.array([900e6]), np.ones(1))
    assert margin(steady, INVENTED, Goodman(1800e6), blocks=1.0) == pytest.approx(2.0, rel=1e-6)


def test_nothing_to_bear() -> None:
    none = rainflow([5.0])
    assert life(none, INVENTED, Goodman(1800e6), blocks=1.0).blocks == math.inf
    assert margin(none, INVENTED, Goodman(1800e6), blocks=1.0) == math.inf
    pressed = Cycles(np.array([100e6]), np.array([-500e6]), np.ones(1))
    assert margin(pressed, INVENTED, SmithWatsonTopper(), blocks=1e9) == math.inf


def test_a_part_that_breaks_says_so() -> None:
    broken = Cycles(np.array([100e6]), np.array([2100e6]), np.ones(1))
    result = life(broken, INVENTED, Morrow(2000e6), blocks=1e6)
    assert (result.damage, result.blocks) == (math.inf, 0.0)
    assert [each.name for each in result.advice] == ["mean_stress", "largest_stress"]
    assert "limit 2e+09): no cycle survives" in str(result.advice[0])


def test_a_curve_of_pulsating_stress() -> None:
    """S-N at R = 0: cycles with that ratio read the curve directly, whatever the criterion that has a mean there."""
    pulsating = Strength("invented", ultimate=1800e6, curve=KNEE, loading_ratio=0.0)
    cycles = Cycles(np.array([700e6]), np.array([350e6]), np.ones(1))
    for judge in (Goodman(1800e6), SmithWatsonTopper()):
        assert damage(cycles, pulsating, judge) == pytest.approx(1 / KNEE.life(350e6), rel=1e-9)
    lower = damage(reversed_cycles(350e6), pulsating, SmithWatsonTopper())
    assert lower == pytest.approx(1 / KNEE.life(350e6 / math.sqrt(2)), rel=1e-9)


@pytest.mark.slow
@settings(deadline=None)
@given(
    st.floats(1e-3, 1e18),
    st.floats(1e-300, 1e300),
    st.floats(1, 1000),
    st.floats(0, 1e6),
    blocks_of_stress,
    st.sampled_from(("goodman", "gerber", "swt", "walker", "morrow")),
    st.floats(-1e6, 0.999),
)
def test_extreme_strengths_give_a_number(
    knee: float, cycles: float, slope: float, scatter: float, history: np.ndarray, name: str, ratio: float
) -> None:
    """Any accepted curve gives a damage >= 0 and a margin >= 0, which is less for more survivors."""
    curve = basquin(knee, cycles, slope, scatter=scatter)
    ultimate = 2.1 * knee / (1 - ratio)  # little above the largest stress at the knee
    extreme = Strength(
        "invented", ultimate=ultimate, fatigue_strength=2 * knee, walker_exponent=0.5, curve=curve, loading_ratio=ratio
    )
    judge = mean_stress(name, extreme)
    lives = [life(rainflow(history), extreme, judge, blocks=1e6, survival=share) for share in (0.5, 0.999)]
    assert 0 <= lives[0].damage <= lives[1].damage
    assert lives[0].margin >= lives[1].margin * (1 - 1e-6) >= 0


def test_the_rule_of_a_closing_speed() -> None:
    allowed = Strength("invented: at most 8 m/s", impact_velocity=8.0)
    result = speed_margin(-5.0, allowed)
    assert (result.margin, result.speed, result.source) == (1.6, 5.0, "invented: at most 8 m/s")
    assert speed_margin(0.0, allowed).margin == math.inf
    with pytest.raises(LifeError, match="'impact_velocity'"):
        speed_margin(5.0, INVENTED)
    with pytest.raises(LifeError, match="must be finite"):
        speed_margin(math.nan, allowed)


MPA = 1e6
NAMES = ("goodman", "gerber", "swt", "walker", "morrow")


def one(judge: MeanStress, amplitude: float, mean: float) -> float:
    """Return the equivalent of one amplitude and mean, all in MPa."""
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
        np.testing.assert_allclose(judge.convert_to_ratio(equivalent, slant), own, rtol=1e-9)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"source": " "}, "source is empty"),
        ({"ultimate": -1.0}, "ultimate = -1 must be positive"),
        ({"walker_exponent": 1.2}, "must not be above 1"),
        ({"loading_ratio": 1.0}, "below 1"),
        ({"torsion_limit": float("inf")}, "torsion_limit = inf"),
    ],
)
def test_strength_refuses(fields: dict[str, object], words: str) -> None:
    with pytest.raises(LifeError, match=words):
        Strength(**{"source": "invented", **fields})  # type: ignore[arg-type]


ASTM = [-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0]
"""ASTM E1049-85, figure 6: the history of its example of rainflow counting."""


few_levels = arrays(np.float64, st.integers(1, 60), elements=st.integers(-5, 5).map(float))
milli = st.floats(-1e9, 1e9).map(lambda value: round(value, 3))  # products of smaller differences underflow
histories = few_levels | arrays(np.float64, st.integers(1, 60), elements=milli)


def rows(cycles: Cycles) -> list[tuple[float, float, float]]:
    """Return (range, mean, count), sorted."""
    return sorted(zip(cycles.ranges.tolist(), cycles.means.tolist(), cycles.counts.tolist(), strict=True))


def test_the_example_of_the_standard() -> None:
    """The counts are those of the standard's table; the means were found by hand."""
    cycles = rainflow(ASTM, repeated=False)
    expected = [(3, -0.5, 0.5), (4, -1, 0.5), (4, 1, 1), (6, 1, 0.5), (8, 0, 0.5), (8, 1, 0.5), (9, 0.5, 0.5)]
    assert rows(cycles) == expected
    by_range = Counter[float]()
    for size, _, count in rows(cycles):
        by_range[size] += count
    assert by_range == {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}


@pytest.mark.slow
@settings(deadline=None)
@given(histories)
def test_the_loop_counts_as_the_package(history: np.ndarray) -> None:
    """The package counts the same cycles from the highest peak on, where its half cycles come in pairs."""
    counts = Counter[tuple[float, float]]()
    for size, mean, count, *_ in extract_cycles(from_peak(history)):
        counts[size, mean] += count
    assert counts == Counter((size, mean) for size, mean, _ in rows(rainflow(history)))


def test_turning_points_alone() -> None:
    assert reversals([1, 1, 2, 3, 3, 2, 2, 2, 4, 4]).tolist() == [1, 3, 2, 4]
    assert reversals([7, 7, 7]).tolist() == [7]
    for history in ([3.0], [7.0, 7.0]):
        assert rows(rainflow(history)) == rows(rainflow(history, repeated=False)) == []


@pytest.mark.parametrize("history", [[], [[1.0, 2.0]], [1.0, np.nan], [np.inf, 0.0]])
def test_what_is_no_history(history: list[float]) -> None:
    with pytest.raises(LifeError, match=r"one row|must be finite"):
        rainflow(history)


@pytest.mark.slow
@settings(deadline=None)
@given(histories, st.integers(1, 5))
def test_plateaus_do_not_count(history: np.ndarray, samples: int) -> None:
    """Repeated values and values between two turning points add no cycles."""
    held = np.repeat(history, samples)
    between = np.insert(history, 1, (history[0] + history[min(1, len(history) - 1)]) / 2)
    assert rows(rainflow(held)) == rows(rainflow(history))
    np.testing.assert_allclose(np.sort(rainflow(between).ranges), np.sort(rainflow(history).ranges), rtol=1e-12)
