"""A look at a scene: rounds for a few seconds, what they leave, and the run that goes on from there."""

import math
import os
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from seatfem.faces.plan_view import look_lines
from seatfem.faces.study_verbs import study_ahead
from seatfem.study.runs.converge import AIM
from seatfem.study.runs.forecast import USUAL, Look, converge, forecast, look_at
from seatfem.study.runs.kept import cached_plan
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.runs.round import Round
from seatfem.study.sweep import sweep
from seatfem.study.sweep.cases import cases_of
from seatfem.study.sweep.study import load_study
from tests.gallery import LIP, REED_ON_SPRING, load_text, mass
from tests.steps import BAD_INPUT, Scene, run_command

NO_TIME = 1e-3  # s: the first round alone
ON_LIP = f'[seat]\n{LIP}[reed]\n{mass(2, "-1 m/s")}[run]\nduration = "0.2 ms"\nfilter_width = "5 us"\n[accuracy]\n'
"""A rigid mass thrown at the lip of a seat that waves soften: a spring in its place is 40 % off."""


def lip_scene(folder: Path, target: str) -> Scene:
    return load_text(folder, ON_LIP, f'target = "{target}"\n')


def beam_scene(folder: Path, target: str, duration: str = "0.75 ms", step: str = "") -> Scene:
    text = REED_ON_SPRING.replace('"0.75 ms"', f'"{duration}"' + (f'\ntime_step = "{step}"' if step else ""))
    return load_text(folder, text, f'target = "{target}"\n')


def tell(look: Look) -> list[str]:
    return list(look_lines(look))


@pytest.mark.slow
def test_a_run_goes_on_from_a_look_that_met_its_target(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The run takes one round with the seat and the error bars of the look, and computes none again."""
    scene = lip_scene(tmp_path, "10 %")
    look = look_at(scene, 600.0)
    assert look.done.met
    assert look.done.number > 1
    assert (look.left.rounds, look.left.seconds, look.left.why) == (0, 0.0, "")
    assert tell(look)[0].startswith("target reached: ")
    assert tell(look)[1].startswith("left to do: nothing more; a run repeats the contact")
    monkeypatch.setattr("seatfem.study.runs.rounds.error_budget", lambda *given: pytest.fail("computed again"))
    lines: list[str] = []
    outcome = run_scene(scene, tmp_path / "out", pictures=False, tell=lines.append)
    assert [line.partition(":")[0] for line in lines] == ["round 1"]
    assert outcome.met
    assert outcome.plan is not None
    assert outcome.plan.method == look.plan.method
    assert outcome.plan.choices == look.plan.choices
    assert outcome.summary["seat_reused"] is True
    assert outcome.summary["landing_impulse_Ns"] == look.done.left.values["landing_impulse"]
    assert outcome.summary["error_bar_landing_impulse_Ns"] == look.done.left.bar("landing_impulse")


@pytest.mark.slow
def test_what_is_left_is_foretold_and_the_run_takes_the_same_way(tmp_path: Path) -> None:
    scene = lip_scene(tmp_path, "4 %")
    look = look_at(scene, NO_TIME)
    ahead, done = look.left, look.done
    assert (done.met, done.number, ahead.why) == (False, 1, "")
    assert ahead.rounds >= 1
    assert ahead.seconds > 0
    assert ahead.error.keys() == set(done.judged)
    for name, bar in ahead.error.items():
        if done.left.relative(name) > 0.04:
            assert AIM * 0.04 <= bar <= 0.04
        else:
            assert bar == done.left.relative(name)
    assert ahead.changes.startswith("seat.model spring -> axisymmetric, ")
    assert cached_plan(scene) is None  # it has not met its target
    lines: list[str] = []
    outcome = run_scene(scene, tmp_path / "out", pictures=False, tell=lines.append)
    assert outcome.met
    assert len(lines) > 1
    assert lines[1].startswith(f"round 2 ({ahead.changes}): ")  # what was foretold
    assert outcome.plan is not None
    assert converge(scene).plan.method == outcome.plan.method == look_at(scene, NO_TIME).plan.method


@pytest.mark.slow
def test_the_lines_add_up_to_the_bars(tmp_path: Path) -> None:
    """The squares of the keys' parts, with the safety factor, add up to that of the bar, to the digits shown."""
    look = look_at(lip_scene(tmp_path, "4 %"), NO_TIME)
    matches = [re.match(r"(.*) \+-([\d.]+) % is left by: (.*)", line) for line in tell(look)]
    parts = {match[1]: (float(match[2]), match[3]) for match in matches if match}
    assert parts.keys() == {"impulse", "peak force"}
    for whole, keys in parts.values():
        shares = [float(share) for share in re.findall(r"([\d.]+) %", keys)]
        assert shares == sorted(shares, reverse=True)
        assert math.hypot(*shares) == pytest.approx(whole, rel=0.05)  # two digits, and parts below a hundredth
        assert keys.startswith("seat.model ")


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_forecast_grows_with_the_rounds_that_the_error_needs(tmp_path: Path) -> None:
    """Each round is expected to reduce the largest error ninefold: 5.6 % of the peak for 2 %, 0.5 % and 0.04 %."""
    done = look_at(beam_scene(tmp_path, "2 %"), NO_TIME).done
    worst = max(done.left.relative(name) for name in done.judged)
    counts = []
    for target in (0.02, 0.002, 0.0004):
        accuracy = done.plan.scene.accuracy.model_copy(update={"target": target})
        scene = done.plan.scene.model_copy(update={"accuracy": accuracy})
        counts.append(forecast(asked_again(done, scene)).rounds)
    assert counts == [math.ceil(math.log(worst / target, USUAL)) for target in (0.02, 0.002, 0.0004)]
    assert counts[0] == 1 < counts[1] < counts[2]


def asked_again(done: Round, scene: Scene) -> Round:
    return replace(done, plan=replace(done.plan, scene=scene))


def test_a_study_is_priced_by_looks_at_three_of_its_scenes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first, last and middle one: the mean of their contacts, the dearest of their seats and memories."""
    beam_scene(tmp_path, "2 %")
    study = tmp_path / "study.toml"
    study.write_text('scene = "scene.toml"\n[vary]\nreed.length = ["25 mm", "26 mm", "27 mm", "28 mm", "29 mm"]\n')
    cases, looked = cases_of(load_study(study)), []

    def look(scene: Scene, seconds: float) -> SimpleNamespace:
        looked.append(scene.reed.length)
        remaining = SimpleNamespace(
            seat={25e-3: 5.0, 27e-3: 1.0}.get(scene.reed.length, 3.0), contact=1e3 * scene.reed.length
        )
        done = SimpleNamespace(memory=1e9 * scene.reed.length, plan=SimpleNamespace(scene=scene))
        return SimpleNamespace(left=remaining, done=done)

    monkeypatch.setattr(sweep, "look_at", look)
    price = sweep.ahead(load_study(study), cases)
    assert looked == pytest.approx([25e-3, 29e-3, 27e-3])
    assert (price.each, price.seat, price.memory) == pytest.approx((27.0, 5.0, 29e6))
    assert (price.scenes, price.beside) == (5, 0)
    assert price.seconds(1) == pytest.approx(sweep.START + price.seats * 5.0 + 5 * 27.0)
    assert "expected with 1 worker (27 s a scene, 5 s a seat" in price.in_words(1)


@pytest.mark.slow
def test_the_plan_of_a_study_refuses_a_measure_that_no_summary_has(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The message names file, line, key, value and remedy."""
    beam_scene(tmp_path, "5 %")
    study, vary = tmp_path / "study.toml", 'scene = "scene.toml"\n[vary]\nreed.length = ["25.4 mm", "26 mm"]\n'
    study.write_text(f'{vary}[outputs]\nmeasures = ["impulse_Ns", "seat_static_stiffness_N_per_m"]\n')
    assert study_ahead(study).scenes == 2
    for key, table in {
        "outputs.measures": 'outputs.measures = ["landing_stress"]',
        "outputs.pareto": 'outputs.pareto = ["impulse_Ns", "max landing_stress"]',
        "optimise.minimise": 'optimise.minimise = "landing_stress"',
    }.items():
        values = vary.replace('["25.4 mm", "26 mm"]', '{ from = "25.4 mm", to = "26 mm" }') if "opt" in key else vary
        study.write_text(f"{table}\n{values}")
        assert run_command(["plan", str(study)]) == BAD_INPUT
        said = " ".join(capsys.readouterr().err.split())
        assert re.search(rf"{study}:1: {key}: .*'landing_stress'; state 'landing_", said)
    study.write_text(f'outputs.measures = ["life_margin"]\n{vary}')  # a key of scenes that have [life]
    assert run_command(["plan", str(study)]) == BAD_INPUT
    assert "'life_margin'" in capsys.readouterr().err
