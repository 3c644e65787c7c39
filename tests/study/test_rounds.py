"""Rounds measure what error is left, refine what dominates, and say where they stop short."""

import errno
import json
import re
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from impact.storage.hdf5 import load_greens, load_results
from seatfem.structures import cache
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.reduction.factorization import FactorizationError
from seatfem.study.runs import next_round, pipeline, rounds
from seatfem.study.runs.round import missed
from tests.gallery import REED_ON_SPRING, Patch, load_text, mass
from tests.steps import SAFETY, GreensFunctionError, Limits, Plan, Stopwatch, begin_plan, run_command, silent
from tests.study.small_scenes import rounds_of

SCENE = REED_ON_SPRING + 'landing = "run"\n'


def plan_of(text: str, folder: Path) -> Plan:
    return begin_plan(load_text(folder, text))


def key_of(plan: Plan) -> str:
    return cache.key_of(plan.scene.seat, plan.method.seat)


def with_step(plan: Plan, dt: float) -> Plan:
    """Return the same plan with a step it would not begin with; the key stays open."""
    return replace(plan, method=plan.method.replaced({"run.time_step": dt}))


KEYS = {"time_step": "run.time_step", "model": "reed.n_modes", "mesh": "seat.mesh.size"}


@pytest.mark.slow
def test_one_round_makes_all_sources_finer_that_must_be(tmp_path: Path) -> None:
    """The next plan refines both of two sources that leave too much, one where one suffices, and none where a source
    that stays is too large by itself, like the mesh of a spring."""
    plan = with_step(plan_of(SCENE + 'target = "2 %"\nmeasures = ["impulse"]\n', tmp_path), 2e-6)
    done = rounds_of(plan, tmp_path)[-1]
    value = abs(done.budget.values["impulse"])

    def following(**shares: float) -> tuple[Plan | None, str]:
        parts = {source: {"impulse": share * 0.02 * value / SAFETY} for source, share in shares.items()}
        by_key = {key: parts[source] for source, key in KEYS.items() if source in parts}
        budget = replace(done.budget, parts=parts, by_key=by_key, values={"impulse": done.budget.values["impulse"]})
        return next_round.next_plan(replace(done, budget=budget, number=1), Limits(), 1e9)

    def after(**shares: float) -> Plan:
        further, why = following(**shares)
        assert further is not None, why
        return further

    old = done.plan.method
    both = after(time_step=0.9, model=0.8).method
    assert both.time_step < old.time_step  # type: ignore[operator]
    assert both.reed.n_modes > old.reed.n_modes  # type: ignore[operator]
    alone = after(time_step=1.0, model=0.15).method
    assert alone.time_step < old.time_step  # type: ignore[operator]
    assert alone.reed.n_modes == old.reed.n_modes
    none, stuck = following(time_step=0.1, mesh=1.5)
    assert none is None
    assert stuck.startswith("mesh error (seat.mesh.size) leaves 3 % of impulse, and it cannot be made smaller")


def test_what_the_file_states_is_never_changed_and_that_is_told(tmp_path: Path) -> None:
    """Three stated modes and a stated step end after one round, with words that say why."""
    text = SCENE.replace("[run]", '[run]\ntime_step = "2 us"').replace("release", "n_modes = 3\nrelease")
    done = rounds_of(plan_of(text + 'target = "0.1 %"\n', tmp_path), tmp_path)[-1]
    assert not done.met
    assert done.number == 1
    assert (done.result.dt, done.plan.method.reed.n_modes) == (2e-6, 3)
    messages = missed(done)
    assert messages[0].startswith(
        ("impulse (impulse_Ns) has an uncertainty of", "peak force (filtered_peak_force_N) has an")
    )
    assert any("above accuracy.target = 0.1 %" in words for words in messages)
    words = r"after 1 round: simplified model of seat or reed \(reed\.n_modes\) leaves .*, and the file states it"
    assert re.search(words, messages[-1])


@pytest.mark.slow
@pytest.mark.parametrize("n_modes", [1, 2, 3, 5])
def test_few_modes_of_the_reed_miss_a_target(n_modes: int, tmp_path: Path) -> None:
    """One or few modes miss a target of 5 %, by an error of the model that holds what many modes change."""
    text = SCENE.replace("release", f"n_modes = {n_modes}\nrelease") + 'target = "5 %"\n'
    done, many = (rounds_of(plan_of(t, tmp_path), tmp_path)[-1] for t in (text, SCENE))
    assert not done.met
    assert done.budget.dominant("impulse") == "model"
    for name in ("impulse", "filtered_peak"):
        assert abs(done.budget.values[name] - many.budget.values[name]) <= done.budget.bar(name)


@pytest.mark.slow(but="factorization")
@pytest.mark.parametrize(
    ("failure", "words"),
    [
        (FactorizationError("a pivot is zero"), "a pivot is zero"),
        (MeshingError("gmsh crashed"), "gmsh crashed"),
        (MemoryError(), "out of memory"),
        (GreensFunctionError("rates must be positive"), "rates must be positive"),
        (OSError(errno.ENOSPC, "No space left on device", "seat.h5"), "No space left"),
    ],
    ids=["factorization", "meshing", "memory", "greens", "disk"],
)
def test_a_finer_round_that_fails_keeps_the_one_before(failure, words, tmp_path, monkeypatch):
    plan, calls = with_step(plan_of(SCENE + 'target = "2 %"\n', tmp_path), 2e-6), []
    run_contacts = rounds.run_contacts

    def failing(*given):
        calls.append(given)
        if len(calls) >= 2:
            raise failure
        return run_contacts(*given)

    monkeypatch.setattr(rounds, "run_contacts", failing)
    done = rounds_of(plan, tmp_path)[-1]
    assert (done.number, done.result.dt, done.met) == (1, 2e-6, False)
    assert done.stopped.startswith("a finer round ")
    assert words in done.stopped
    assert words in missed(done)[-1]


@pytest.mark.slow
def test_a_finer_round_that_fails_is_tried_half_as_far(tmp_path: Path, monkeypatch: Patch) -> None:
    """The error of the step was to be divided by f; then by the root of it."""
    plan, run_contacts, steps = with_step(plan_of(SCENE + 'target = "2 %"\n', tmp_path), 2e-6), rounds.run_contacts, []

    def failing(scene, striker, seat, dt, *given):
        steps.append(dt)
        if len(steps) == 2:
            raise MemoryError
        return run_contacts(scene, striker, seat, dt, *given)

    monkeypatch.setattr(rounds, "run_contacts", failing)
    done = rounds_of(plan, tmp_path, rounds=2)[-1]
    assert done.number == 2
    assert done.result.dt == steps[2]
    assert steps[0] / steps[2] == pytest.approx((steps[0] / steps[1]) ** 0.5, rel=0.02)  # steps fit the duration


@pytest.mark.slow
def test_the_seat_on_file_is_that_of_the_round_that_is_kept(tmp_path: Path, monkeypatch: Patch) -> None:
    """The finer seat was written already when its contact ran out of memory."""
    text = (
        '[seat]\nkind = "block"\nwidth = "8 mm"\ndepth = "8 mm"\nthickness = "8 mm"\npatch_width = "4 mm"\n'
        'patch_depth = "4 mm"\nmesh.size = "4 mm"\nmaterial = { young = "200 GPa", density = "7850 kg/m^3" }\n'
        f'greens.bandwidth = "100 kHz"\ngreens.tolerance = 0.05\n[reed]\n{mass(1, "-1 m/s")}[run]\nduration = "30 us"\n'
    )
    plan, run_contacts, written = plan_of(text, tmp_path), rounds.run_contacts, []
    finer = replace(plan, method=plan.method.replaced({"seat.mesh.size": 3e-3, "seat.mesh.contact_size": 3e-3}))

    def failing(*given):
        written.append(load_greens(tmp_path / "seat.h5").provenance["seat_key"])
        if len(written) >= 2:
            raise MemoryError
        return run_contacts(*given)

    monkeypatch.setattr(rounds, "run_contacts", failing)
    monkeypatch.setattr(rounds.Round, "met", property(lambda self: False))
    monkeypatch.setattr(rounds, "next_plan", lambda done, limits, left: (finer, ""))
    done = rounds_of(plan, tmp_path)[-1]
    assert re.fullmatch("a finer round .*out of memory", done.stopped)
    assert written[:2] == [key_of(plan), key_of(finer)]
    assert load_greens(tmp_path / "seat.h5").provenance["seat_key"] == key_of(plan)


@pytest.mark.slow
@pytest.mark.parametrize(("more", "code"), [("", 0), ("n_modes = 2\n", 1)])
def test_summary_and_exit_code_tell_whether_the_target_was_met(more, code, tmp_path):
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    text = SCENE.replace("release", f"{more}release") + 'level = "quick"\nmeasures = ["filtered_peak", "stress"]\n'
    scene.write_text(text, encoding="utf-8")
    assert run_command(["run", str(scene), "-o", str(out), "--quiet", "--no-pictures"]) == code
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert (out / "result.h5").is_file()
    assert summary["accuracy_target"] == 0.05
    assert summary["accuracy_met"] is (code == 0)
    assert summary["accuracy_measures"] == "filtered_peak, stress"
    assert (summary["accuracy_stopped_because"] == "") == (code == 0)
    assert ("reed.n_modes" in summary["plan_given"]) == bool(more)
    for key in ("filtered_peak_force_N", "peak_reed_stress_after_contact_Pa"):
        assert summary[f"error_bar_{key}"] <= 0.05 * summary[key] or code == 1
    # from rest at 1 mm: 3 E (h/2) d/L^2 = 142 MPa, a quarter more where the freely swinging reed bends back
    assert summary["peak_reed_stress_Pa"] == pytest.approx(1.25 * 142e6, rel=0.1)
    assert 0 <= summary["peak_reed_stress_at_m"] <= 25.4e-3
    assert summary["spring_peak_reed_stress_Pa"] == pytest.approx(summary["peak_reed_stress_Pa"], rel=1e-6)
    missing = 0.05 if more else 0.01  # of what modes leave out at the clamp: 2/(pi n)^2 of n
    assert summary["reed_stress_at_start_Pa"] == pytest.approx((1 - missing) * 142e6, rel=0.01)
    # the largest is before the first touch; what the blow adds is told apart
    assert summary["initial_reed_stress_Pa"] == summary["peak_reed_stress_Pa"]
    assert summary["initial_reed_stress_time_s"] < summary["first_contact_s"]
    assert summary["peak_reed_stress_after_contact_time_s"] > summary["first_contact_s"]
    assert 0 <= summary["peak_reed_stress_after_contact_at_m"] <= 25.4e-3
    assert "error_bar_peak_reed_stress_Pa" not in summary


@pytest.mark.slow
def test_a_round_that_outlasts_the_time_is_stopped_and_the_one_before_stays(tmp_path, monkeypatch):
    """A round that reports after the time limit is stopped, and the result is the one before."""
    monkeypatch.setattr(next_round, "expect_time", lambda done, plan: 0.0)
    plan, begun = with_step(plan_of(SCENE + 'target = "2 %"\n', tmp_path), 2e-6), time.perf_counter()
    seen: list[rounds.Round] = []
    for done in rounds.rounds(plan, tmp_path, Stopwatch(), silent, limits=Limits(seconds=3600), start=begun):
        seen.append(done)
        monkeypatch.setattr(rounds.time, "perf_counter", lambda: begun + 3601)
    assert [r.number for r in seen] == [1, 1]
    assert seen[0].stopped == "round 2 was begun and not finished"
    assert "--max-time is over (" in seen[1].stopped
    assert seen[1].result is seen[0].result


@pytest.mark.slow
def test_no_round_that_is_expected_to_outgrow_the_memory_is_begun(tmp_path: Path, monkeypatch: Patch) -> None:
    plan = with_step(plan_of(SCENE + 'target = "2 %"\n', tmp_path), 2e-6)
    monkeypatch.setattr(next_round, "own_memory", lambda: 1e8)
    monkeypatch.setattr(next_round, "available_memory", lambda: 2e7)
    done = rounds_of(plan, tmp_path)[-1]
    assert (done.number, done.met) == (1, False)
    assert re.fullmatch(r"the next round would need about \S+ GB of memory, 0\.12 GB are available", done.stopped)


@pytest.mark.slow
def test_a_run_that_nears_the_end_of_memory_ends_with_the_last_round_on_file(
    tmp_path: Path, monkeypatch: Patch
) -> None:
    """Memory goes while round 2 is under way, and smaller ones fail, too: the answer is that of a run of one round."""
    scene = plan_of(SCENE + 'target = "2 %"\n', tmp_path).scene
    plan, run_contacts = with_step(begin_plan(scene), 2e-6), rounds.run_contacts
    one = pipeline.run_scene(scene, tmp_path / "one", plan=plan, limits=Limits(1), pictures=False)
    calls: list[object] = []

    def counted(*given, **more):
        calls.append(given)
        return run_contacts(*given, **more)

    monkeypatch.setattr(rounds, "EVERY", 0.0)
    monkeypatch.setattr(rounds, "run_contacts", counted)
    monkeypatch.setattr(rounds, "available_memory", lambda: 1e8 if len(calls) >= 2 else 1e10)
    two = pipeline.run_scene(scene, tmp_path / "two", plan=plan, pictures=False)
    assert len(calls) >= 2
    assert (two.met, two.summary["accuracy_rounds"]) == (False, 1)
    words = r"a finer round is not possible: .* was stopped at \S+: 0\.1 GB of memory are left, at least 0\.3 GB"
    assert re.match(words, str(two.summary["accuracy_stopped_because"]))
    assert any("0.1 GB of memory are left" in note for note in two.messages)
    summary = json.loads((tmp_path / "two" / "summary.json").read_text(encoding="utf-8"))
    for key in ("impulse_Ns", "filtered_peak_force_N", "error_bar_impulse_Ns"):
        assert summary[key] == one.summary[key]
    alone, kept = (load_results(tmp_path / name / "result.h5")["wave"] for name in ("one", "two"))
    np.testing.assert_array_equal(alone.rows.force, kept.rows.force)
