"""A scene that met its target begins there when it is run again, and only then."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from seatfem.machine.code import cache_folder
from seatfem.study.runs.kept import cached_plan, save_plan
from seatfem.study.runs.next_round import Limits
from seatfem.study.runs.round import Round
from seatfem.study.runs.rounds import rounds
from tests.gallery import REED_ON_SPRING, load_text
from tests.steps import Plan, Stopwatch, begin_plan, silent

SCENE = REED_ON_SPRING + 'target = "2 %"\n'


def plan_of(folder: Path, text: str = SCENE) -> Plan:
    return begin_plan(load_text(folder, text))


def too_coarse(plan: Plan) -> Plan:
    return replace(plan, method=plan.method.replaced({"run.time_step": 2e-6}))


def last_of(plan: Plan, folder: Path) -> Round:
    *_, done = rounds(plan, folder, Stopwatch(), silent)
    return done


@pytest.mark.slow
def test_the_next_run_begins_with_the_last_ones_plan_and_meets_at_once(tmp_path):
    plan = too_coarse(plan_of(tmp_path))
    assert cached_plan(plan.scene) is None
    done = last_of(plan, tmp_path)
    assert done.met
    assert done.number > 1
    save_plan(done.plan.scene, done)
    again = cached_plan(plan.scene)
    assert again.method == done.plan.method
    assert again.choices == tuple(replace(choice, leaves="") for choice in done.plan.choices)
    assert (again.error, again.refined) == ({}, {})
    second = last_of(again, tmp_path)
    assert (second.met, second.number) == (True, 1)
    assert second.left.values == done.left.values  # the same numbers, without the rounds before
    save_plan(plan.scene, second)
    assert cached_plan(plan.scene) == again


@pytest.mark.slow
def test_error_bars_are_found_again_but_not_in_studies(tmp_path, monkeypatch):
    """Bars on file come back bit by bit, and are computed if forces differ, in studies, or if the file was changed."""
    plan = plan_of(tmp_path)
    first, calls = last_of(plan, tmp_path), []
    monkeypatch.setattr("seatfem.study.runs.rounds.error_budget", lambda *args: calls.append(args) or first.left)
    assert last_of(plan, tmp_path).left == first.left
    assert not calls
    last_of(replace(plan, method=plan.method.replaced({"run.time_step": first.result.dt / 2})), tmp_path)
    assert len(calls) == 1
    list(rounds(plan, tmp_path, Stopwatch(), silent, limits=Limits(steady=True)))
    assert len(calls) == 2
    for file in (cache_folder() / "numbers").glob("*.json"):
        file.write_text(file.read_text().replace('"values": {', '"values": {"reed": 0.0, '))
    assert last_of(plan, tmp_path).left == first.left
    assert len(calls) == 3


@pytest.mark.slow
def test_other_questions_begin_anew(tmp_path):
    plan = plan_of(tmp_path)
    save_plan(plan.scene, last_of(too_coarse(plan), tmp_path))
    for other in (
        SCENE.replace('"2 %"', '"3 %"'),
        SCENE.replace('"1 mm"', '"1.1 mm"'),
        SCENE.replace("duration", 'time_step = "50 ns"\nduration'),
    ):
        assert cached_plan(plan_of(tmp_path, other).scene) is None
    assert cached_plan(plan_of(tmp_path, 'title = "another name"\n' + SCENE).scene) is not None  # that asks for nothing


HARM = {
    "no JSON": lambda kept: "no JSON",
    "a list": lambda kept: "[]",
    "empty": lambda kept: "{}",
    "level": lambda kept: {**kept, "values": {**kept["values"], "seat.model": "magic"}},
    "reduction": lambda kept: {**kept, "values": {**kept["values"], "seat.greens.method": "magic"}},
    "negative": lambda kept: {**kept, "values": {**kept["values"], "run.time_step": -1e-7}},
    "infinite": lambda kept: {**kept, "values": {**kept["values"], "run.time_step": math.inf}},
    "text": lambda kept: {**kept, "values": {**kept["values"], "reed.n_modes": "40"}},
    "a key less": lambda kept: {key: value for key, value in kept.items() if key != "choices"},
    "a value less": lambda kept: {**kept, "values": {"run.time_step": 1e-7}},
    "choices": lambda kept: {**kept, "choices": [{"key": 1}]},
    "large": lambda kept: {**kept, "more": "x" * 200_000},
}


@pytest.mark.slow
def test_a_file_that_is_not_sound_changes_nothing(store_of_the_test, tmp_path):
    plan = too_coarse(plan_of(tmp_path))
    save_plan(plan.scene, last_of(plan, tmp_path))
    (path,) = (store_of_the_test / "ended").iterdir()
    whole = path.read_text()
    for harm, harmful in HARM.items():
        assert cached_plan(plan.scene) is not None
        harmed = harmful(json.loads(whole))
        path.write_text(harmed if isinstance(harmed, str) else json.dumps(harmed))
        assert cached_plan(plan.scene) is None, harm
        path.write_text(whole)
