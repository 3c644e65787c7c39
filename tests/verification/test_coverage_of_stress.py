"""Error bars of stress against finer meshes, bands, modes and steps: benchmarks/coverage_of_stress.py.

Two cheap scenes are run here; those of the committed table are only read.
"""

import tomllib

import coverage_of_stress
import pytest
from coverage_of_scenes import Row
from scenes_summary import is_inside, share
from table import read_rows

ROWS = read_rows(Row, coverage_of_stress.FILE)


@pytest.mark.slow(but="3")
@pytest.mark.parametrize("index", [3, 5])  # a beam on a rod, and on a conical seat
def test_the_true_error_is_inside_the_bar(index: int) -> None:
    rows = coverage_of_stress.judge(index)
    assert {row.outcome for row in rows} == {"judged"}
    assert [row.measure for row in rows if not is_inside(row)] == []
    on_file = {row.measure: row for row in ROWS if (row.seed, row.index) == (coverage_of_stress.SEED, index)}
    assert {row.measure for row in rows} == {*on_file}
    [stress] = [row for row in rows if row.measure == "stress"]
    assert (stress.seat, stress.reed) == (on_file["stress"].seat, on_file["stress"].reed)
    assert stress.value == pytest.approx(on_file["stress"].value, rel=2 * stress.target)


def test_true_errors_are_inside_the_bars() -> None:
    with_bar = [row for row in ROWS if row.bar == row.bar]
    assert len({(row.seed, row.index) for row in ROWS}) >= 44
    assert share(with_bar, is_inside) >= 0.97


def test_bars_of_the_seat_decide_where_the_target_is_met() -> None:
    """Nine of ten scenes that met their target with an open seat mesh have bars below a quarter of the stress."""
    met = [row for row in ROWS if row.measure == "seat_stress" and row.met == "True" and not row.stated]
    with_bar = [row for row in met if row.bar == row.bar]
    assert len(with_bar) >= 14
    assert share(with_bar, lambda row: row.bar < 0.25 * row.value) >= 0.9


def test_the_table_is_of_the_scenes_drawn_today() -> None:
    """A change of the draw without new runs must not pass."""
    for row in ROWS:
        tables = tomllib.loads(coverage_of_stress.draw_scene(row.index, row.seed))
        assert (tables["seat"]["kind"], tables["reed"]["kind"]) == (row.seat, row.reed)
        assert tables["accuracy"]["target"] == pytest.approx(row.target, abs=1e-5)
