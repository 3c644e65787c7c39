"""What scenes of a study begin with: the plan that one of the first with their seat has ended with."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from seatfem.study.sweep import runner as one
from seatfem.study.sweep.cases import PILOTS, begun, cases_of, chosen, start_of
from seatfem.study.sweep.runner import JOURNAL, carry_out, read_journal
from seatfem.study.sweep.study import load_study
from seatfem.study.sweep.sweep import run_study
from tests.steps import begin_plan, converge, load_scene
from tests.study.crew_at_hand import answer_here
from tests.study.test_studies import SPRING, study_file

MASSES = '[vary]\nreed.mass = ["1 g", "1.1 g", "1.2 g", "1 g", "1.3 g", "1.4 g", "1.5 g"]'


@pytest.mark.slow
def test_the_first_scenes_show_how_to_begin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first begins by rule, those after it as it ended, all others as the second dearest of these did; a
    study that goes on hands on the same."""
    jobs = answer_here(monkeypatch)
    path = study_file(tmp_path, MASSES)
    cases = cases_of(load_study(path))
    assert [case.leads for case in cases] == [True] * (PILOTS + 2) + [False]  # 1 g twice
    assert cases[3].key == cases[0].key
    assert cases[-1].guides == tuple(dict.fromkeys(case.key for case in cases[:-1]))
    run_study(load_study(path), tmp_path / "out")
    sent, journal = [json.loads(job) for job in jobs], read_journal(tmp_path / "out" / JOURNAL)
    first, *others = (journal[case.key].start for case in cases)
    assert sent[0]["start"] == {}
    assert [job["start"] for job in sent[1:-1]] == [first] * PILOTS
    ranked = sorted((first, *others[:2], *others[3:-1]), key=lambda start: float(start["work"]))
    assert sent[-1]["start"] == ranked[-2]
    assert journal[cases[-1].key].start == {}
    lines = (tmp_path / "out" / JOURNAL).read_text(encoding="utf-8").splitlines(keepends=True)
    (tmp_path / "out" / JOURNAL).write_text("".join(lines[:-1]), encoding="utf-8")
    jobs.clear()
    run_study(load_study(path), tmp_path / "out")
    assert [json.loads(job) for job in jobs] == sent[-1:]


@pytest.mark.slow
def test_a_start_that_is_too_coarse_is_refined(tmp_path: Path) -> None:
    """Each scene measures its own error: it meets its target from wherever it begins, or by rule."""
    path = study_file(tmp_path, MASSES, f'{SPRING}[accuracy]\ntarget = "0.1 %"\n').parent / "scene.toml"
    plan = converge(load_scene(path)).plan
    coarse = replace(plan, method=replace(plan.method, time_step=8 * plan.method.time_step))
    outcome = carry_out(path, {"reed.mass": "2 g"}, 4, start_of(coarse))
    assert outcome.state == "done"
    assert outcome.summary["accuracy_rounds"] in (2, 3)
    alone = carry_out(path, {"reed.mass": "2 g"}, 1, start_of(coarse), leads=True)
    assert alone.state == "done"  # by rule
    own = converge(load_scene(path, {"reed.mass": "2 g"})).plan
    assert alone.start["plan"]["values"] == start_of(own)["plan"]["values"]


def test_scenes_that_are_too_different_begin_by_rule(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = study_file(tmp_path, MASSES).parent / "scene.toml"
    start = start_of(begin_plan(load_scene(path)))
    assert begun(load_scene(path, {"reed.mass": "3 g"}), start) is not None
    for other in (
        {"run.duration": "0.3 ms"},
        {"accuracy.target": "1 %"},
        {"run.time_step": "10 ns"},
        {"contact.law": {"kind": "hertz", "stiffness": "1e9 N/m^1.5"}},
    ):
        assert begun(load_scene(path, other), start) is None
    assert begun(load_scene(path), {**start, "plan": {**start["plan"], "values": {}}}) is None  # a damaged journal
    assert chosen([]) == {}
    with pytest.raises(TypeError, match="no outcome"):
        one.Outcome("done", start={"work": "x"})
