"""Error bars of stress against finer meshes, bands, modes and steps: benchmarks/coverage_of_stress.py.

Two cheap scenes are run here; those of the committed table are only read.
"""

import coverage_of_runs
import coverage_of_stress
import pytest

from seatfem.structures.store import VARIABLE

VERDICTS = coverage_of_runs.read(coverage_of_stress.FILE)


@pytest.mark.parametrize("index", [3, 0])  # a beam on a rod, and on an annular seat
def test_the_true_error_is_inside_the_bar(index: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "restored afterwards")
    verdict = coverage_of_stress.judge(index, coverage_of_stress.SEED)
    assert verdict.values
    assert [name for name in verdict.values if not verdict.inside(name)] == []
    (kept,) = [each for each in VERDICTS if each.index == index]
    assert (verdict.seat, verdict.striker, verdict.target) == (kept.seat, kept.striker, kept.target)
    assert verdict.values["stress"] == pytest.approx(kept.values["stress"], rel=2 * kept.target)


def test_true_errors_are_inside_the_bars() -> None:
    assert len(VERDICTS) >= 20
    assert coverage_of_runs.coverage(VERDICTS)[0] >= coverage_of_runs.COVERED


def test_the_table_is_of_the_scenes_drawn_today() -> None:
    """A change of the draw without new runs must not pass."""
    for verdict in VERDICTS:
        text = coverage_of_stress.draw_scene(verdict.index, verdict.seed)
        assert f'kind = "{verdict.seat}"' in text
        assert f'kind = "{verdict.striker}"' in text
        assert f"target = {verdict.target:.5f}" in text
