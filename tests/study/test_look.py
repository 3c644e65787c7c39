"""A look at a scene for some seconds, the run that goes on from there, and what begins where one met its target."""

import json
import math
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest

from seatfem.faces.plan_view import look_lines
from seatfem.machine.code import cache_folder
from seatfem.study.runs.converge import AIM
from seatfem.study.runs.kept import cached_plan, save_plan
from tests.gallery import LIP, REED_ON_SPRING, load_text, mass
from tests.steps import Limits, Plan, Scene, Stopwatch, begin_plan, converge, look_at, rounds, run_scene, silent
from tests.study.small_scenes import rounds_of

pytestmark = pytest.mark.slow
NO_TIME = 1e-3  # s: the first round alone
ON_LIP = f'[seat]\n{LIP}[reed]\n{mass(2, "-1 m/s")}[run]\nduration = "0.2 ms"\nfilter_width = "5 us"\n[accuracy]\n'
"""A rigid mass thrown at the lip of a seat that waves soften: a spring in its place is 40 % off."""


def lip_scene(folder: Path, target: str) -> Scene:
    return load_text(folder, ON_LIP, f'target = "{target}"\n')


def test_a_run_goes_on_from_a_look_that_met_its_target(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The run takes one round with the seat and the error bars of the look, and computes none again."""
    scene = lip_scene(tmp_path, "10 %")
    look = look_at(scene, 600.0)
    assert look.done.met
    assert look.done.number > 1
    assert (look.left.rounds, look.left.seconds, look.left.why) == (0, 0.0, "")
    reached, remaining, *_ = look_lines(look)
    assert reached.startswith("target reached: ")
    assert remaining.startswith("left to do: nothing more; a run repeats the contact")
    monkeypatch.setattr("seatfem.study.runs.rounds.error_budget", lambda *given: pytest.fail("computed again"))
    lines: list[str] = []
    outcome = run_scene(scene, tmp_path / "out", pictures=False, tell=lines.append)
    assert [line.partition(":")[0] for line in lines] == ["round 1"]
    assert outcome.met
    assert outcome.plan is not None
    assert outcome.plan.method == look.plan.method
    assert outcome.plan.choices == look.plan.choices
    assert outcome.summary["seat_reused"] is True
    assert outcome.summary["landing_impulse_Ns"] == look.done.budget.values["landing_impulse"]
    assert outcome.summary["error_bar_landing_impulse_Ns"] == look.done.budget.bar("landing_impulse")


def test_what_is_left_is_foretold_and_the_run_takes_the_same_way(tmp_path: Path) -> None:
    scene = lip_scene(tmp_path, "4 %")
    look = look_at(scene, NO_TIME)
    ahead, done = look.left, look.done
    assert (done.met, done.number, ahead.why) == (False, 1, "")
    assert ahead.rounds >= 1
    assert ahead.seconds > 0
    assert ahead.error.keys() == set(done.judged)
    for name, bar in ahead.error.items():
        if done.budget.relative(name) > 0.04:
            assert AIM * 0.04 <= bar <= 0.04
        else:
            assert bar == done.budget.relative(name)
    assert ahead.changes.startswith("seat.model spring -> axisymmetric, ")
    assert cached_plan(scene) is None  # it has not met its target
    lines: list[str] = []
    outcome = run_scene(scene, tmp_path / "out", pictures=False, tell=lines.append)
    assert outcome.met
    assert len(lines) > 1
    assert lines[1].startswith(f"round 2 ({ahead.changes}): ")  # what was foretold
    assert outcome.plan is not None
    assert converge(scene).plan.method == outcome.plan.method == look_at(scene, NO_TIME).plan.method


def test_the_lines_add_up_to_the_bars(tmp_path: Path) -> None:
    """The squares of the keys' parts, with the safety factor, add up to that of the bar, to the digits shown."""
    look = look_at(lip_scene(tmp_path, "4 %"), NO_TIME)
    matches = [re.match(r"(.*) \+-([\d.]+) % is left by: (.*)", line) for line in look_lines(look)]
    parts = {match[1]: (float(match[2]), match[3]) for match in matches if match}
    assert parts.keys() == {"impulse", "peak force"}
    for whole, keys in parts.values():
        shares = [float(share) for share in re.findall(r"([\d.]+) %", keys)]
        assert shares == sorted(shares, reverse=True)
        assert math.hypot(*shares) == pytest.approx(whole, rel=0.05)  # two digits, and parts below a hundredth
        assert keys.startswith("seat.model ")


@pytest.mark.parametrize("is_interrupted", [False, True])
def test_a_look_leaves_no_files(is_interrupted: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A look, even interrupted, leaves no files where it was started nor among temporary ones."""
    here, temporary = tmp_path / "here", tmp_path / "temporary"
    for folder in (here, temporary):
        folder.mkdir()
    scene = lip_scene(tmp_path, "4 %")
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    monkeypatch.chdir(here)
    seen: list[int] = []

    def progress(stage: str, done: float) -> None:
        seen.append(len(os.listdir(temporary)))
        if is_interrupted and stage == "stepping":
            raise KeyboardInterrupt

    if is_interrupted:
        with pytest.raises(KeyboardInterrupt):
            look_at(scene, NO_TIME, progress)
    else:
        look_at(scene, NO_TIME, progress)
    assert max(seen) > 0  # its seat, meanwhile
    assert [*here.iterdir(), *temporary.iterdir()] == []


FOR_TWO = REED_ON_SPRING + 'target = "2 %"\n'


def plan_of(folder: Path, text: str = FOR_TWO) -> Plan:
    return begin_plan(load_text(folder, text))


def too_coarse(plan: Plan) -> Plan:
    return replace(plan, method=plan.method.replaced({"run.time_step": 2e-6}))


def test_the_next_run_begins_with_the_last_ones_plan_and_meets_at_once(tmp_path):
    plan = too_coarse(plan_of(tmp_path))
    assert cached_plan(plan.scene) is None
    done = rounds_of(plan, tmp_path)[-1]
    assert done.met
    assert done.number > 1
    save_plan(done.plan.scene, done)
    again = cached_plan(plan.scene)
    assert again.method == done.plan.method
    assert again.choices == tuple(replace(choice, leaves="") for choice in done.plan.choices)
    assert (again.error, again.refined) == ({}, {})
    second = rounds_of(again, tmp_path)[-1]
    assert (second.met, second.number) == (True, 1)
    assert second.budget.values == done.budget.values  # the same numbers, without the rounds before
    save_plan(plan.scene, second)
    assert cached_plan(plan.scene) == again


def test_error_bars_are_found_again_but_not_in_studies(tmp_path, monkeypatch):
    """Bars on file come back bit by bit, and are computed if forces differ, in studies, or if the file was changed."""
    plan = plan_of(tmp_path)
    first, calls = rounds_of(plan, tmp_path)[-1], []
    monkeypatch.setattr("seatfem.study.runs.rounds.error_budget", lambda *args: calls.append(args) or first.budget)
    assert rounds_of(plan, tmp_path)[-1].budget == first.budget
    assert not calls
    rounds_of(replace(plan, method=plan.method.replaced({"run.time_step": first.result.dt / 2})), tmp_path)[-1]
    assert len(calls) == 1
    list(rounds(plan, tmp_path, Stopwatch(), silent, limits=Limits(steady=True)))
    assert len(calls) == 2
    for file in (cache_folder() / "numbers").glob("*.json"):
        file.write_text(file.read_text().replace('"values": {', '"values": {"reed": 0.0, '))
    assert rounds_of(plan, tmp_path)[-1].budget == first.budget
    assert len(calls) == 3


def test_other_questions_begin_anew(tmp_path):
    plan = plan_of(tmp_path)
    save_plan(plan.scene, rounds_of(too_coarse(plan), tmp_path)[-1])
    for other in (
        FOR_TWO.replace('"2 %"', '"3 %"'),
        FOR_TWO.replace('"1 mm"', '"1.1 mm"'),
        FOR_TWO.replace("duration", 'time_step = "50 ns"\nduration'),
    ):
        assert cached_plan(plan_of(tmp_path, other).scene) is None
    assert (
        cached_plan(plan_of(tmp_path, 'title = "another name"\n' + FOR_TWO).scene) is not None
    )  # that asks for nothing


HARM = {
    "a list": lambda kept: [],
    "level": lambda kept: {**kept, "values": {**kept["values"], "seat.model": "magic"}},
    "negative": lambda kept: {**kept, "values": {**kept["values"], "run.time_step": -1e-7}},
    "text": lambda kept: {**kept, "values": {**kept["values"], "reed.n_modes": "40"}},
    "a key less": lambda kept: {key: value for key, value in kept.items() if key != "choices"},
    "choices": lambda kept: {**kept, "choices": [{"key": 1}]},
    "large": lambda kept: {**kept, "more": "x" * 200_000},
}


def test_a_file_that_is_not_sound_changes_nothing(store_of_the_test, tmp_path):
    plan = too_coarse(plan_of(tmp_path))
    save_plan(plan.scene, rounds_of(plan, tmp_path)[-1])
    (path,) = (store_of_the_test / "ended").iterdir()
    whole = path.read_text()
    for harm, harmful in HARM.items():
        assert cached_plan(plan.scene) is not None
        path.write_text(json.dumps(harmful(json.loads(whole))))
        assert cached_plan(plan.scene) is None, harm
        path.write_text(whole)
