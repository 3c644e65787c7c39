"""A scene that was refined until it met its target begins there when it is run again, and only then."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from impact.progress import silent
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.store import VARIABLE
from seatfem.study.planning.plan import Plan
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.ended import WORDS, begun_where_it_ended, remember
from seatfem.study.runs.rounds import Round, rounds
from seatfem.study.scene import load_scene

SCENE = """
[seat]
kind = "spring"
stiffness = "27.8 N/um"
[reed]
kind = "cantilever"
length = "25.4 mm"
damping_ratio = 0.03
release = { tip_deflection = "1 mm" }
[run]
duration = "0.75 ms"
filter_width = "8 us"
[accuracy]
target = "2 %"
"""


@pytest.fixture
def store(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv(VARIABLE, str(tmp_path / "store"))
    return tmp_path / "store"


def plan_of(folder: Path, text: str = SCENE) -> Plan:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return plan_scene(load_scene(path))


def too_coarse(plan: Plan) -> Plan:
    return replace(plan, method=plan.method.replaced({"run.time_step": 2e-6}))


def last_of(plan: Plan, folder: Path) -> Round:
    *_, done = rounds(plan, folder, Stopwatch(), silent)
    return done


def test_the_next_run_begins_with_the_last_ones_numbers_and_meets_at_once(store, tmp_path):
    plan = too_coarse(plan_of(tmp_path))
    done = last_of(plan, tmp_path)
    assert done.met
    assert done.number > 1
    remember(done)
    again = begun_where_it_ended(plan)
    assert again.method == done.plan.method
    assert again.choice("run.time_step").reason == WORDS
    second = last_of(again, tmp_path)
    assert (second.met, second.number) == (True, 1)
    assert second.left.values == done.left.values  # the same numbers, without the rounds before


def test_other_questions_begin_as_planned(store, tmp_path):
    remember(last_of(too_coarse(plan_of(tmp_path)), tmp_path))
    for other in (
        SCENE.replace('"2 %"', '"3 %"'),
        SCENE.replace('"1 mm"', '"1.1 mm"'),
        SCENE.replace("duration", 'time_step = "50 ns"\nduration'),
    ):
        plan = plan_of(tmp_path, other)
        assert begun_where_it_ended(plan) is plan
    named = plan_of(tmp_path, 'title = "another name"\n' + SCENE)
    assert begun_where_it_ended(too_coarse(named)).method != too_coarse(named).method  # a title asks for nothing


def test_what_met_in_one_round_or_missed_is_not_kept(store, tmp_path):
    done = last_of(plan_of(tmp_path), tmp_path)
    assert done.number == 1
    remember(done)
    missed = last_of(
        plan_of(tmp_path, SCENE.replace('"2 %"', '"0.1 %"').replace("[run]", '[run]\ntime_step = "2 us"')), tmp_path
    )
    assert not missed.met
    remember(replace(missed, number=2))
    assert not (store / "ended").exists()


@pytest.mark.parametrize(
    "text",
    [
        "no JSON",
        "[]",
        "{}",
        '{"level": "closed form", "values": 3}',
        '{"level": "rod", "values": {"run.time_step": 1e-7}}',
        '{"level": "closed form", "values": {"run.time_step": -1e-7, "reed.n_modes": 10.5}}',
        '{"level": "closed form", "values": {"run.time_step": NaN, "reed.n_modes": "40"}}',
        "x" * 20_000,
    ],
)
def test_a_file_that_is_not_sound_changes_nothing(store, tmp_path, text):
    done = last_of(too_coarse(plan_of(tmp_path)), tmp_path)
    remember(done)
    (path,) = (store / "ended").iterdir()
    assert json.loads(path.read_text())["level"] == "closed form"
    path.write_text(text)
    plan = too_coarse(plan_of(tmp_path))
    assert begun_where_it_ended(plan) is plan
