"""Decisions of the planner against what is true: benchmarks/decisions.py.

Three cheap decisions are judged here, chosen so that a plan that always takes a spring, or waves, or one contact point
is wrong in one of them; those of the committed table are only read.
"""

import csv
from dataclasses import replace
from pathlib import Path

import decisions
import pytest
from coverage_of_scenes import stored
from decision_options import ONE_POINT, REED_MODES, TIME_STEP, WAVES, finest_of
from decisions import Judged, Record, judge, price_again
from decisions_page import document, is_caution, is_courage, price, table
from drawn_scenes import DrawnScene, draw_scene

from seatfem.structures.method import Method
from seatfem.study.method import MODEL, PORTS, STEP, RunMethod
from seatfem.study.planning.planner import plan_scene
from seatfem.study.scene import load_scene

RECORDS = decisions.read_records()
SCENE = Record(1, 0, "annular", "cantilever", "thrown", False, "judged", target=0.05, met=True)
ENOUGH = Judged(WAVES, True, False, "", "spring", 0.01, "impulse", "", float("nan"), False)
NEEDED = Judged(WAVES, True, False, "", "", 0.0, "impulse", "spring", 0.2, False)


TILTED = DrawnScene(
    """[seat]
kind = "annular"
bore_radius = "3 mm"
lip_width = "1 mm"
lip_height = "0.5 mm"
outer_radius = "7 mm"
thickness = "4 mm"
material = "steel"
damping_ratio = 0.05
[reed]
kind = "rigid_mass"
mass = "1 g"
velocity = "-1 m/s"
[contact]
gap = "1 um"
tilt = "0.05 deg"
[run]
duration = "0.03 ms"
filter_width = "5 us"
[accuracy]
target = 0.1
measures = ["filtered_peak"]
""",
    "annular",
    "rigid_mass",
    "tilted",
    stated=False,
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("drawn", "decision", "enough"),
    [
        (draw_scene(7, decisions.SEED), WAVES, True),
        (draw_scene(19, decisions.SEED), WAVES, False),
        (TILTED, ONE_POINT, False),
    ],
    ids=["spring", "waves", "segments"],
)
def test_the_plan_decides_as_a_finer_run_finds(drawn: DrawnScene, decision: str, enough: bool) -> None:
    """The cheaper option is taken where it is enough in truth, and where it is not the dearer one."""
    record = judge(drawn, 0, decisions.SEED, only=(decision,))
    assert record.outcome == "judged", record.reason
    [found] = record.decisions
    assert bool(found.chosen) == enough
    change = found.chosen_change if enough else found.cheaper_change
    assert change < record.target / 5 if enough else change > 1.1 * record.target
    assert not is_courage(record, found)
    assert not is_caution(record, found)


@pytest.mark.slow
def test_a_duration_that_two_marches_share_is_no_proof_of_a_spring() -> None:
    """A contact of 16 steps of the pre-runs lasts as long on a spring to within a step, in truth a fifth longer."""
    with stored() as folder:
        plan = plan_scene(load_scene(draw_scene(73, decisions.SEED).write(folder)))
    assert plan.level == "sector"
    assert "without waves: 19 % change of contact duration (measured" in plan.choice(MODEL).reason


@pytest.mark.slow
def test_a_restitution_that_not_every_pre_run_has_ends_no_plan() -> None:
    """With few modes of the reed a landing may have none; which is told of the whole run, too."""
    with stored() as folder:
        plan = plan_scene(load_scene(draw_scene(118, decisions.SEED).write(folder)))
    assert plan.meets_target


def test_wrong_statements_are_told_apart() -> None:
    bold = replace(ENOUGH, chosen_change=0.06)
    cautious = replace(NEEDED, cheaper_change=0.04, enough=True, seconds=3.0, cheaper_seconds=2.0)
    assert [is_courage(SCENE, each) for each in (ENOUGH, NEEDED, bold, cautious)] == [False, False, True, False]
    assert [is_caution(SCENE, each) for each in (ENOUGH, NEEDED, bold, cautious)] == [False, False, False, True]
    assert not is_courage(replace(SCENE, promised=False), bold)  # it says that it will miss
    assert not is_caution(SCENE, replace(cautious, said_enough=True))
    assert is_courage(SCENE, replace(NEEDED, said_enough=True))
    assert price(cautious) == 1.5
    [_, _, row] = table([replace(SCENE, decisions=(each,)) for each in (ENOUGH, NEEDED, bold, cautious)])
    assert row.startswith(f"| {WAVES} | 4 | 1 | 1 | 1 | 1 | 1.50, 1.50 | 1 (25%) | 1 | missed |")


@pytest.mark.slow
def test_the_price_of_a_cheaper_option_is_that_of_a_run_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """The option is known by its name in the record, and the same run as chosen costs what it costs: only what is left
    out of the march may be saved."""
    record = judge(draw_scene(58, decisions.SEED), 58, decisions.SEED, only=(TIME_STEP,))
    [step] = record.decisions
    assert is_caution(record, step)
    monkeypatch.setattr(decisions, "costs_more", lambda _: True)
    [again] = price_again(record).decisions
    assert replace(again, seconds=0.0, cheaper_seconds=0.0) == replace(step, seconds=0.0, cheaper_seconds=0.0)
    assert 0 < again.cheaper_seconds < 3 * step.cheaper_seconds
    assert decisions._setting(replace(step, cheaper="592 ns")) == (STEP, pytest.approx(592e-9))
    assert decisions._setting(replace(ENOUGH, cheaper="spring")) == (MODEL, "spring")
    assert decisions._setting(replace(step, decision=ONE_POINT, cheaper="one point")) == (PORTS, 1)


def test_a_number_of_modes_makes_two_statements() -> None:
    modes = Judged(REED_MODES, True, False, "", "20 modes", 0.01, "impulse", "14 modes", 0.2, False)
    [_, _, row] = table([replace(SCENE, decisions=(modes,))])
    assert row.startswith(f"| {REED_MODES} | 1 | 1 | 0 | 1 | 0 |")


def test_a_truth_is_made_of_the_finest_of_all_methods() -> None:
    """A spring's coarse band and mesh are none of its keys where another method is finer."""
    spring = RunMethod(Method("spring", 5e3, 0.1, size=2e-3, contact_size=1e-4), Method(n_modes=9), 1e-8)
    waves = RunMethod(Method("axisymmetric", 2e5, 0.02, size=1e-3, contact_size=5e-4), Method(n_modes=20), 4e-8)
    seat = Method("axisymmetric", 2e5, 0.02, size=1e-3, contact_size=1e-4)
    assert finest_of([spring, waves]) == RunMethod(seat, Method(n_modes=20), 1e-8)


@pytest.mark.skipif(not RECORDS, reason="the table is being made: benchmarks/decisions.py")
def test_the_page_says_what_was_counted(tmp_path: Path) -> None:
    """`python benchmarks/decisions.py --document` writes both."""
    page, rows = tmp_path / "decisions.md", tmp_path / "decisions.csv"
    page.write_text(decisions.PAGE.read_text(encoding="utf-8"), encoding="utf-8")
    document(RECORDS, rows, page)
    assert page.read_text(encoding="utf-8") == decisions.PAGE.read_text(encoding="utf-8")
    assert rows.read_text(encoding="utf-8") == decisions.FILE.with_suffix(".csv").read_text(encoding="utf-8")
    with rows.open(encoding="utf-8", newline="") as file:
        assert len(list(csv.DictReader(file))) == sum(len(record.decisions) for record in RECORDS)
    assert sum(record.outcome == "judged" for record in RECORDS) >= 120
