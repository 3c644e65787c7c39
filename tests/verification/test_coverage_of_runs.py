"""Error bars of runs against runs with finer mesh, band, reed and step: benchmarks/coverage_of_runs.py.

Three cheap scenes are run here; those of the committed table are only read.
"""

from pathlib import Path
from typing import Any

import coverage_of_runs
import pytest

from seatfem.structures.store import VARIABLE

VERDICTS = coverage_of_runs.read()
HELD_OUT = coverage_of_runs.read(coverage_of_runs.HELD_OUT_FILE)


@pytest.mark.parametrize("index", [1, 3, 5])  # a reed on a rod, a mass on a spring, a reed on an annular seat
def test_the_true_error_is_inside_the_bar(index: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "restored afterwards")
    verdict = coverage_of_runs.judge(index)
    assert [name for name in verdict.values if not verdict.inside(name)] == []
    (kept,) = [each for each in VERDICTS if each.index == index]
    assert (verdict.seat, verdict.striker, verdict.target) == (kept.seat, kept.striker, kept.target)
    assert verdict.values["impulse"] == pytest.approx(kept.values["impulse"], rel=2 * kept.target)


def test_forty_scenes_and_more_were_run() -> None:
    """Of those drawn, some take too long: docs/coverage.md."""
    assert len(VERDICTS) >= 40
    assert {(verdict.seed, verdict.index) for verdict in VERDICTS} <= {(5, i) for i in range(coverage_of_runs.SCENES)}


SEEDS = {seed: [v for v in (*VERDICTS, *HELD_OUT) if v.seed == seed] for seed in (5, 211, 307, 405)}


@pytest.mark.parametrize("verdicts", SEEDS.values(), ids=map(str, SEEDS))
def test_true_errors_are_inside_the_bars(verdicts: list[Any]) -> None:
    assert coverage_of_runs.coverage(verdicts)[0] >= coverage_of_runs.COVERED


def test_every_kind_of_striker_is_among_the_held_out() -> None:
    kinds = {"cantilever", "timoshenko", "tip_mass", "clamped_clamped", "rigid_mass", "rod", "bar"}
    assert {verdict.striker for verdict in SEEDS[307]} == kinds


@pytest.mark.parametrize("verdicts", SEEDS.values(), ids=map(str, SEEDS))
def test_a_met_target_is_met_in_truth(verdicts: list[Any]) -> None:
    """Of all measures that were asked for and met, by bar: the true error is within the target."""
    met = [
        verdict.true[name] <= verdict.target * abs(verdict.values[name])
        for verdict in verdicts
        for name in verdict.values
        if verdict.bars[name] <= verdict.target * abs(verdict.values[name])
    ]
    assert len(met) > 70
    assert sum(met) >= coverage_of_runs.COVERED * len(met)


def test_the_table_is_of_the_scenes_drawn_today(tmp_path: Path) -> None:
    """A change of the draw without new runs must not pass."""
    for verdict in (*VERDICTS, *HELD_OUT):
        text = coverage_of_runs.draw_scene(verdict.index, verdict.seed)
        assert f'kind = "{verdict.seat}"' in text
        assert f'kind = "{verdict.striker}"' in text
        assert f"target = {verdict.target:.6f}" in text
