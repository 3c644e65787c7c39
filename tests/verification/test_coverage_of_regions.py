"""Whole regions of contact against the program on points: benchmarks/coverage_of_regions.py, its table and its page."""

import math
from statistics import median

import coverage_of_regions
import pytest
from coverage_of_regions import KEYS, NARROW, Row, judge
from drawn_regions import SCENES, SEED
from table import read_rows

ROWS = read_rows(Row, coverage_of_regions.FILE)
TRIED = 4  # a free ring on one land with a spring: seconds by both programs


def test_table_holds_every_scene_of_the_seed() -> None:
    assert {row.seed for row in ROWS} == {SEED}
    assert sorted((row.index, row.measure) for row in ROWS) == sorted((i, name) for i in range(SCENES) for name in KEYS)


def test_inside_is_what_value_bar_and_reference_say() -> None:
    for row in ROWS:
        assert row.inside == ("" if math.isnan(row.bar) else str(abs(row.value - row.reference) <= row.bar))


def test_references_are_known_better_than_they_judge() -> None:
    """A doubt of impulse or peak above the bar would judge nothing; at the median it is below a third of that."""
    shares = [row.doubt / row.bar for row in ROWS if row.measure in NARROW and row.inside]
    assert max(shares) < 1
    assert median(shares) < 1 / 3


@pytest.mark.slow
def test_a_scene_of_the_table_again() -> None:
    """The other program and the product give what the table has; both within what they state."""
    kept = {row.measure: row for row in ROWS if row.index == TRIED}
    for row in judge(TRIED, []):
        assert row.reference == pytest.approx(kept[row.measure].reference, rel=1e-5)
        assert abs(row.value - kept[row.measure].value) <= kept[row.measure].bar
