"""Lands against the program on points: the table of benchmarks/coverage_of_lands.py."""

import math

import coverage_of_lands
from coverage_of_lands import KEYS, Row
from table import read_rows

ROWS = read_rows(Row, coverage_of_lands.FILE)


def test_bars_of_each_land_hold_the_other_program() -> None:
    """Every number of every land that has a bar, and most of the bars say something: below half of the value."""
    assert {row.measure for row in ROWS} == set(KEYS)
    for row in ROWS:
        within = abs(row.value - row.reference) <= row.bar + row.doubt
        assert row.inside == ("" if math.isnan(row.bar) else str(within))
    assert [row for row in ROWS if row.inside == "False"] == []
    told = [row for row in ROWS if row.bar <= 0.5 * abs(row.value)]
    assert len(told) > 0.8 * len([row for row in ROWS if row.inside])


def test_references_are_known_better_than_they_judge() -> None:
    assert all(row.doubt <= row.bar / 3 or row.bar == row.doubt == 0 for row in ROWS if row.inside)
