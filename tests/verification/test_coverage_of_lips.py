"""Error bars of contacts along a lip against runs with more arcs, modes, band, mesh and steps.

benchmarks/coverage_of_lips.py; its committed table is read here.
"""

import coverage_of_lips
import coverage_of_runs
import pytest

VERDICTS = coverage_of_runs.read(coverage_of_lips.FILE)
SEEDS = sorted({verdict.seed for verdict in VERDICTS})


@pytest.mark.parametrize("seed", SEEDS)
def test_true_errors_are_inside_the_bars(seed: int) -> None:
    verdicts = [verdict for verdict in VERDICTS if verdict.seed == seed]
    assert len(verdicts) >= 25
    assert coverage_of_runs.coverage(verdicts)[0] >= coverage_of_runs.COVERED


def test_a_met_target_is_met_in_truth() -> None:
    met = [
        verdict.true[name] <= verdict.target * abs(verdict.values[name])
        for verdict in VERDICTS
        for name in verdict.values
        if verdict.bars[name] <= verdict.target * abs(verdict.values[name])
    ]
    assert len(met) > 70
    assert sum(met) >= coverage_of_runs.COVERED * len(met)


def test_the_table_is_of_the_scenes_drawn_today() -> None:
    """A change of the draw without new runs must not pass."""
    for verdict in VERDICTS:
        text = coverage_of_lips.draw_scene(verdict.index, verdict.seed)
        assert f"target = {verdict.target:.5f}" in text
