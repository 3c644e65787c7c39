"""Regions of contact against the program on points: benchmarks/coverage_of_regions.py, its tables and its pages."""

import math
from dataclasses import replace
from statistics import median

import numpy as np
import pytest
from coverage_of_regions import KEYS, KINDS, LAND_KEYS, NARROW, judge, rows_of
from drawn_regions import KINDS as DRAWN
from drawn_regions import SCENES, SEED, draw_region
from valves import NOT_STATED

from seatfem.study.scene import load_scene

ROWS = {name: rows_of(name) for name in KINDS}
TRIED = 4  # a free ring on one land with a spring: seconds by both programs


def test_tables_hold_every_scene() -> None:
    assert {row.seed for row in ROWS["drawn"]} == {SEED}
    drawn = sorted((row.index, row.measure) for row in ROWS["drawn"])
    assert drawn == sorted((i, name) for i in range(SCENES) for name in KEYS)
    assert {row.measure for row in ROWS["lands"]} == set(LAND_KEYS)
    for name, kinds in KINDS.items():  # valves that are not in the table are still to be run
        assert {row.index for row in ROWS[name]} <= set(range(kinds.count))


@pytest.mark.parametrize("name", KINDS)
def test_inside_is_what_value_bar_and_reference_say(name: str) -> None:
    for row in ROWS[name]:
        assert row.inside == ("" if math.isnan(row.bar) else str(abs(row.value - row.reference) <= row.bar))


@pytest.mark.parametrize("name", ["lands", "valves"])
def test_every_bar_holds_the_reference_and_most_say_something(name: str) -> None:
    """As far as the reference is sure; bars are at most half of the value."""
    barred = [row for row in ROWS[name] if row.inside]
    assert [(row.kind, row.measure) for row in barred if row.inside == "False" and not row.is_in_doubt] == []
    assert len([row for row in barred if row.bar <= 0.5 * abs(row.value)]) >= 0.8 * len(barred)


def test_a_contact_that_is_stated_by_hand_gives_the_same_numbers() -> None:
    """Within both bars; nine in ten bars of impulse and peak are narrow, or the run says that it missed."""
    stated = {(row.index, row.measure): row for row in ROWS["valves"] if row.part != NOT_STATED}
    for row in ROWS["valves"]:
        if (other := stated.get((row.index, row.measure))) is not None:
            assert not abs(row.value - other.value) > row.bar + other.bar
    asked = [row for row in ROWS["valves"] if row.measure in NARROW and row.inside]
    assert sum(row.is_narrow for row in asked) >= 0.9 * len(asked)


def test_references_are_known_better_than_they_judge() -> None:
    """A doubt of impulse or peak above the bar would judge nothing; at the median it is below a third of that."""
    shares = [row.doubt / row.bar for row in ROWS["drawn"] if row.measure in NARROW and row.inside]
    assert max(shares) < 1
    assert median(shares) < 1 / 3
    assert all(row.doubt <= row.bar / 3 or row.bar == row.doubt == 0 for row in ROWS["lands"] if row.inside)


@pytest.mark.slow
def test_a_scene_of_the_table_again() -> None:
    """The other program and the product give what the table has; both within what they state."""
    kept = {row.measure: row for row in ROWS["drawn"] if row.index == TRIED}
    for row in judge(KINDS["drawn"], TRIED, []):
        assert row.reference == pytest.approx(kept[row.measure].reference, rel=1e-5)
        assert abs(row.value - kept[row.measure].value) <= kept[row.measure].bar


def test_draws_are_the_same_each_time_and_differ() -> None:
    texts = [draw_region(index).text for index in range(SCENES)]
    assert texts == [draw_region(index).text for index in range(SCENES)]
    assert len(set(texts)) == SCENES
    assert draw_region(0).text != draw_region(0, seed=1).text


@pytest.mark.slow
@pytest.mark.parametrize("index", range(len(DRAWN)))
def test_region_is_the_struck_face(index, tmp_path) -> None:
    """The land that the product finds on the seat has the area and the reach of the other program's region."""
    drawn, path = draw_region(index), tmp_path / "scene.toml"
    path.write_text(drawn.text, encoding="utf-8")
    lip = replace(load_scene(path).seat.region(), arcs=64)
    cells = drawn.region.cells(720, 4)
    assert sum(each.areas.sum() for each in cells) == pytest.approx(lip.area, rel=1e-3)
    far = max(np.hypot(*each.places.reshape(-1, 2).T).max() for each in cells)
    assert far == pytest.approx(lip.outer, rel=0.02)
