"""error_bars = "sampled": scenes marched side by side have the numbers of runs by themselves, and bars of a sample."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from seatfem.faces.study_verbs import study_ahead
from seatfem.study.sweep.answers import bars_in_words
from seatfem.study.sweep.runner import JOURNAL, Outcome, carry_out
from seatfem.study.sweep.study import load_study
from seatfem.study.sweep.sweep import Ahead, run_study, scenes_of
from seatfem.study.sweep.table import BAR, SAFETY, TIGHTER, StudyTable, add_sampled_bars
from tests.gallery import refusal
from tests.study.test_studies import SPRING, rows, study_file

THROWN = """design = "latin_hypercube"
number = 48
error_bars = "sampled"
vary = { reed.velocity = { from = "-2 m/s", to = "-1 m/s" }, contact.gap = { from = "0 mm", to = "0.01 mm" } }
"""
REED = """seat = { kind = "spring", stiffness = "1 N/um" }
reed = { kind = "cantilever", length = "25 mm", width = "10 mm", thickness = "0.3 mm", material = "steel", \
    damping_ratio = 0.02, release = { tip_deflection = "1 mm" } }
run = { duration = "0.8 ms", filter_width = "20 us" }
accuracy = { target = "10 %" }
"""
RELEASED = (
    'design = "zip"\nerror_bars = "sampled"\n[vary]\nreed.release.tip_deflection = {}\n[outputs]\n'
    'measures = ["impulse_Ns", "max_seat_displacement_m", "peak_reed_stress_after_contact_Pa", "peak_force_N"]\n'
)


def sampled(table: StudyTable) -> np.ndarray:  # type: ignore[type-arg]
    return np.array(table.columns["error_bars"]) == "sampled"


@pytest.mark.slow
def test_masses_thrown_on_a_spring(tmp_path: Path, jobs: list[str]) -> None:
    """2 m v and v sqrt(k m) lie within the bars of every scene; those of others are the largest of the sample."""
    path, out = study_file(tmp_path, THROWN), tmp_path / "out"
    table = run_study(load_study(path), out)
    expected = study_ahead(path)
    others, speed = sampled(table), -table.numbers("reed.velocity [m/s]")
    assert 10 < others.sum() < 30
    assert isinstance(expected, Ahead)
    assert (expected.scenes, expected.beside) == (48 - others.sum(), others.sum())
    assert set(table.columns["status"]) == {"done"}
    for name, exact in (
        ("landing_impulse_Ns", 2e-3 * speed),
        ("landing_filtered_peak_force_N", speed * np.sqrt(1e6 * 1e-3)),
    ):
        value, bar = table.numbers(name), table.numbers(BAR + name)
        assert np.all(np.abs(value - exact) <= bar + 1e-9)
        of_sample = (bar / value)[~others][5:]
        assert (bar / value)[others] == pytest.approx(SAFETY * max(of_sample), rel=0.3)
        assert np.ptp((bar / value)[others]) < 1e-12
    beside = [json.loads(job) for job in jobs if "others" in json.loads(job)]
    assert sum(len(job["others"]) for job in beside) == others.sum()
    place = int(np.flatnonzero(others)[3])
    changed = {**beside[0]["changed"], **beside[0]["others"][3]}
    alone = carry_out(path.parent / "scene.toml", changed, 1, beside[0]["start"], once=True)
    for name in table.measures:
        assert table.numbers(name)[place] == pytest.approx(float(str(alone.summary[name])), rel=1e-9)
    before, count = rows(out), len(jobs)
    lines = (out / JOURNAL).read_text(encoding="utf-8").splitlines(keepends=True)
    (out / JOURNAL).write_text("".join(lines[:-7]), encoding="utf-8")  # as a kill leaves it
    run_study(load_study(path), out)
    assert rows(out) == before
    assert [len(json.loads(job)["others"]) for job in jobs[count:]] == [7]


@pytest.mark.slow
def test_reeds_let_go(tmp_path: Path, jobs: list[str]) -> None:
    """Seat displacement and stress of those side by side are those of full runs; another plan is no excuse."""
    deflections = [f"{value:.3f} mm" for value in np.linspace(0.9, 1.1, 27)]
    path = study_file(tmp_path, RELEASED.format(json.dumps(deflections)), REED)
    table = run_study(load_study(path), tmp_path / "out")
    others = sampled(table)
    assert others.any()
    job = json.loads(jobs[-1])
    alone = carry_out(path.parent / "scene.toml", {**job["changed"], **job["others"][0]}, 1, job["start"], once=True)
    for name in table.measures:
        if not name.startswith(BAR):
            beside = table.numbers(name)[int(np.flatnonzero(others)[0])]
            assert beside == pytest.approx(float(str(alone.summary[name])), rel=1e-7)


FILM = '[contact.film]\nviscosity = "18 uPa s"\nfloor = "1 um"\nwidth = "1 mm"\nlength = "9 mm"\n'


@pytest.mark.slow
@pytest.mark.parametrize("scene", [SPRING, SPRING + FILM])
def test_scenes_that_differ_by_more_than_contact_data(scene: str, tmp_path: Path, jobs: list[str]) -> None:
    """Every tenth scene and those at the ends run in full; the others have a run's numbers, 2 m v and v sqrt(k m)
    within their bars, and say whose these are."""
    text = f'below = {{ landing_filtered_peak_force_N = "57 N" }}\n{THROWN}'.replace("contact.gap", "reed.mass")
    text = text.replace("0 mm", "1 g").replace("0.01 mm", "2 g").replace("number = 48", "number = 60")
    path = study_file(tmp_path, text, scene)
    table = run_study(load_study(path), tmp_path / "out")
    others = sampled(table)
    assert 20 < others.sum() < 50
    assert set(table.columns["status"]) == {"done"}
    carried = [job for job in map(json.loads, jobs) if job["carried"]]
    assert len(carried) == others.sum()
    full = carry_out(path.parent / "scene.toml", carried[0]["changed"], 1, carried[0]["start"], once=True)
    place = int(np.flatnonzero(others)[0])
    for name in table.measures:
        assert table.numbers(name)[place] == full.summary[name]
    peak, bar = (
        table.numbers(key) for key in ("landing_filtered_peak_force_N", "error_bar_landing_filtered_peak_force_N")
    )
    of_sample = (bar / peak)[~others][5:]
    assert (bar / peak)[others] == pytest.approx(SAFETY * max(of_sample), rel=0.3)
    if scene == SPRING:
        speed, mass = -table.numbers("reed.velocity [m/s]"), 1e-3 * table.numbers("reed.mass [g]")
        assert np.all(np.abs(peak - speed * np.sqrt(1e6 * mass)) <= bar)
        verdicts = np.array(table.columns["verdict"])
        assert np.all(np.abs(peak - 57)[verdicts == "undecided"] <= bar[verdicts == "undecided"])
        assert set(verdicts[others]) >= {"holds", "does not hold"}
    assert bars_in_words(table).startswith(f"error bars: {len(table) - others.sum()} scenes have their own")


@pytest.mark.slow
def test_bars_of_a_sample_are_judged_by_the_target(tmp_path: Path) -> None:
    """The largest relative bar of the sample counts; above the target all others miss; without one there is none."""
    path = study_file(tmp_path, THROWN)
    cases = scenes_of(load_study(path))[0]
    bars = {case.key: 1e-3 for case in cases}
    bars[next(case.key for case in cases if case.way == "sample")] = 0.04

    def judged_by(target: float, unknown: str = "", what: Outcome | None = None) -> dict[str, Outcome]:
        common = {"impulse_Ns": -2.0}
        full = {"accuracy_met": True, "accuracy_target": TIGHTER * target, "accuracy_judged_keys": "impulse_Ns"}
        outcomes = {
            case.key: Outcome("done", "", 1.0, {**common, **full, f"{BAR}impulse_Ns": 2 * bars[case.key]})
            if case.way != "beside"
            else Outcome("done", "", 1.0, common)
            for case in cases
        }
        if unknown:
            outcomes[unknown] = what or Outcome("done", "", 1.0, common | full)
        return {
            case.key: add_sampled_bars(cases, outcomes, ["impulse_Ns"])[case.key]
            for case in cases
            if case.way == "beside"
        }

    assert {each.state for each in judged_by(0.051).values()} == {"done"}
    assert {each.summary[f"{BAR}impulse_Ns"] for each in judged_by(0.051).values()} == {SAFETY * 0.08}
    assert {each.state for each in judged_by(0.049).values()} == {"missed"}
    sample = [case.key for case in cases if case.way == "sample"]
    without = judged_by(0.051, sample[-1]).values()  # nobody knows whether the target is met
    assert {(each.state, f"{BAR}impulse_Ns" in each.summary) for each in without} == {("missed", False)}
    lost = judged_by(0.051, sample[-1], Outcome("stopped", "no end within 1 s", 1.0)).values()
    assert {(each.state, f"{BAR}impulse_Ns" in each.summary) for each in lost} == {("missed", False)}
    assert all("of the sample was not carried out" in each.message for each in lost)


@pytest.mark.parametrize(
    ("text", "scene", "message"),
    [
        ('error_bars = "sampled"\n[vary]\nreed.mass = ["1 g", "2 g"]\n[outputs]\nmeasures = ["spring_impulse_Ns"]',
         SPRING, r"study\.toml:6: outputs\.measures: 'spring_impulse_Ns' takes a run in full"),
        ('error_bars = "sampled"\n[vary]\nreed.velocity = { from = "-2 m/s", to = "-1 m/s" }\n[optimise]\n'
         'minimise = "impulse_Ns"', SPRING, r"study\.toml:2: error_bars: 'sampled'"),
    ],
)  # fmt: skip
def test_what_it_is_not_for(text: str, scene: str, message: str, tmp_path: Path) -> None:
    path = study_file(tmp_path, text, scene)
    answer = refusal(lambda: run_study(load_study(path), tmp_path / "out"))
    assert re.search(message, answer), answer
