"""A run follows its plan, measures what error is left, refines what dominates, and says where it stops short."""

import errno
import json
from dataclasses import replace
from pathlib import Path

import pytest

from impact.greens import GreensFunctionError
from impact.progress import silent
from impact.storage import load_greens
from seatfem.cli import run_command
from seatfem.mesh.gmsh_process import MeshingError
from seatfem.planning.filling import replaced
from seatfem.planning.plan import Plan
from seatfem.planning.planner import plan_scene
from seatfem.roads.factorization import FactorizationError
from seatfem.runs import pipeline, rounds
from seatfem.runs.rounds import carry_out, missed
from seatfem.runs.stopwatch import Stopwatch
from seatfem.scene import Cantilever, load_scene

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
"""


def plan_of(text: str, folder: Path) -> Plan:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return plan_scene(load_scene(path))


def with_step(plan: Plan, dt: float) -> Plan:
    """The same plan with a step it would not have chosen; the key stays open."""
    return replace(plan, scene=replaced(plan.scene, {"run.time_step": dt}))


def test_a_missed_target_is_reached_by_refining(tmp_path: Path) -> None:
    """A step far too long: its share shrinks, all else stays."""
    plan = with_step(plan_of(SCENE + 'target = "2 %"\n', tmp_path), 2e-6)
    done = carry_out(plan, tmp_path, Stopwatch(), silent)
    assert done.met
    assert done.number > 1
    assert done.result.dt < 2e-6
    assert missed(done) == ()
    assert done.left.relative("filtered_peak") <= 0.02


def test_what_the_file_states_is_never_changed_and_that_is_told(tmp_path: Path) -> None:
    """Three modes, and a step that cannot do: one round, because nothing else can help."""
    text = SCENE.replace("[run]", '[run]\ntime_step = "2 us"').replace("release", "n_modes = 3\nrelease")
    done = carry_out(plan_of(text + 'target = "0.1 %"\n', tmp_path), tmp_path, Stopwatch(), silent)
    assert not done.met
    assert done.number == 1
    assert isinstance(done.plan.scene.reed, Cantilever)
    assert (done.result.dt, done.plan.scene.reed.n_modes) == (2e-6, 3)
    told = missed(done)
    assert any("above accuracy.target = 0.001" in words for words in told)
    assert told[-1].startswith("stopped short of the target after 1 round: nothing finer is left to choose")


@pytest.mark.parametrize("n_modes", [1, 3])
def test_few_modes_of_the_reed_miss_a_target(n_modes: int, tmp_path: Path) -> None:
    """What leaving out some of them does not tell: a single one has none to leave out."""
    text = SCENE.replace("release", f"n_modes = {n_modes}\nrelease") + 'target = "5 %"\n'
    done, many = (carry_out(plan_of(t, tmp_path), tmp_path, Stopwatch(), silent) for t in (text, SCENE))
    assert not done.met
    assert done.left.dominant("impulse") == "model"
    for name in ("impulse", "filtered_peak"):
        assert abs(done.left.values[name] - many.left.values[name]) <= done.left.bar(name)


def test_no_round_beyond_the_memory_or_the_number(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = with_step(plan_of(SCENE + 'target = "0.5 %"\n', tmp_path), 4e-6)
    monkeypatch.setattr(rounds, "MOST_ROUNDS", 2)
    two = carry_out(plan, tmp_path, Stopwatch(), silent)
    assert (two.number, two.stopped) == (2, "2 rounds at most")
    monkeypatch.setattr(rounds, "available_memory", lambda: 1e6)
    one = carry_out(plan, tmp_path, Stopwatch(), silent)
    assert one.number == 1
    assert "GB, 0.001 GB are available" in one.stopped


@pytest.mark.parametrize(
    ("failure", "told"),
    [
        (FactorizationError("a pivot is zero"), "a pivot is zero"),
        (MeshingError("gmsh crashed"), "gmsh crashed"),
        (MemoryError(), "out of memory"),
        (GreensFunctionError("rates must be positive"), "rates must be positive"),
        (OSError(errno.ENOSPC, "No space left on device", "seat.h5"), "No space left"),
    ],
    ids=["factorization", "meshing", "memory", "greens", "disk"],
)
def test_a_finer_round_that_fails_keeps_the_one_before(
    failure: Exception, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan, run_contact, calls = with_step(plan_of(SCENE + 'target = "2 %"\n', tmp_path), 2e-6), rounds.run_contact, []

    def failing(*given):
        calls.append(given)
        if len(calls) == 2:
            raise failure
        return run_contact(*given)

    monkeypatch.setattr(rounds, "run_contact", failing)
    done = carry_out(plan, tmp_path, Stopwatch(), silent)
    assert (done.number, done.result.dt, done.met) == (1, 2e-6, False)
    assert done.stopped.startswith("a finer round is not possible: ")
    assert told in done.stopped
    assert told in missed(done)[-1]


def test_the_seat_on_file_is_that_of_the_round_that_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The finer seat was written already when its contact ran out of memory."""
    seat = 'kind = "block"\nwidth = "8 mm"\ndepth = "8 mm"\nthickness = "8 mm"\npatch_width = "4 mm"\n'
    seat += 'patch_depth = "4 mm"\nmesh = { size = "4 mm" }\n'
    seat += 'material = { young = "200 GPa", density = "7850 kg/m^3" }\n'
    reed = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "30 us"\n'
    text = f'[seat]\n{seat}[seat.greens]\nbandwidth = "100 kHz"\ntolerance = 0.05\n{reed}[accuracy]\n'
    plan, run_contact, written = plan_of(text, tmp_path), rounds.run_contact, []
    finer = replace(plan, scene=replaced(plan.scene, {"seat.mesh.size": 3e-3, "seat.mesh.contact_size": 3e-3}))

    def failing(*given):
        written.append(load_greens(tmp_path / "seat.h5").provenance["seat_key"])
        if len(written) == 2:
            raise MemoryError
        return run_contact(*given)

    monkeypatch.setattr(rounds, "run_contact", failing)
    monkeypatch.setattr(rounds.Round, "met", property(lambda self: False))
    monkeypatch.setattr(rounds, "_next", lambda done: (finer, ""))
    done = carry_out(plan, tmp_path, Stopwatch(), silent)
    assert done.stopped == "a finer round is not possible: out of memory"
    assert written == [plan.scene.seat_key(), finer.scene.seat_key()]
    assert load_greens(tmp_path / "seat.h5").provenance["seat_key"] == plan.scene.seat_key()


def test_waves_that_a_spring_leaves_out_count_as_an_error_of_the_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the plan saw them: 3 % of the peak."""
    monkeypatch.setattr(rounds, "MOST_ROUNDS", 1)
    plan = replace(
        plan_of(SCENE + 'target = "4 %"\n', tmp_path), level="spring", shares={"model": {"filtered_peak": 0.03}}
    )
    done = carry_out(plan, tmp_path, Stopwatch(), silent)
    peak = done.left.values["filtered_peak"]
    assert done.left.parts["model"]["filtered_peak"] == pytest.approx(0.03 * peak)
    assert not done.met  # 1.5 times 3 %


@pytest.mark.parametrize(("more", "code"), [("", 0), ("n_modes = 2\n", 1)])
def test_summary_and_exit_code_tell_whether_the_target_was_met(
    more: str, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pipeline, "draw_run", lambda *given: ((), ()))
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    text = SCENE.replace("release", f"{more}release") + 'level = "quick"\nmeasures = ["filtered_peak", "stress"]\n'
    scene.write_text(text, encoding="utf-8")
    assert run_command(["run", str(scene), "-o", str(out), "--quiet"]) == code
    found = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert (out / "result.h5").is_file()
    assert found["accuracy_target"] == 0.05
    assert found["accuracy_met"] is (code == 0)
    assert found["accuracy_measures"] == "filtered_peak, stress"
    assert (found["accuracy_stopped_because"] == "") == (code == 0)
    assert found["plan_seat_level"] == "closed form"
    assert ("reed.n_modes" in found["plan_given"]) == bool(more)
    assert found["plan_run_time_step"].endswith("s")
    assert 0 < found["plan_wall_time_s"] < 60
    assert set(found) >= {"plan_predicted_error_filtered_peak_force_N", "plan_predicted_time_s", "accuracy_rounds"}
    for key in ("filtered_peak_force_N", "peak_reed_stress_Pa"):
        within = found[f"error_bar_{key}"] <= 0.05 * found[key]
        assert within or code == 1
    # from rest at 1 mm: 3 E (h/2) d/L^2 = 142 MPa, a quarter more where the freely swinging reed bends back
    assert found["peak_reed_stress_Pa"] == pytest.approx(1.25 * 142e6, rel=0.1)
    assert 0 <= found["peak_reed_stress_at_m"] <= 25.4e-3
    assert found["spring_peak_reed_stress_Pa"] == pytest.approx(found["peak_reed_stress_Pa"], rel=1e-6)
