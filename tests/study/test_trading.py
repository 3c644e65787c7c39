"""The measured trade: states, journal, front, chart; one point in a process of its own."""

import csv
import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from seatfem.jobs.crew import Ask
from seatfem.study.plan import Plan
from seatfem.study.runs.converge import begin_method
from seatfem.study.sweep.effects import pareto_front
from seatfem.study.sweep.runner import Outcome
from seatfem.study.trade import trade
from seatfem.study.trade.trade import ALL_OPEN, OWN_CHOICE, Point, Trade, carry_out, finer_in_all, run_points
from tests.gallery import write_scene
from tests.steps import BAD_INPUT, DONE, load_scene, run_command

EXAMPLES = Path(__file__).parents[2] / "examples"
DRAWN = ("flapper_on_annular_seat", "flapper_on_arc", "flapper_on_stopper", "flapper_on_valve_plate", "mass_on_bar")

SMALL = """
title = "Mass on a rod"
seat = { kind = "rod", young = "200 GPa", density = "7850 kg/m^3", length = "50 mm", area = "1 cm^2" }
reed = { kind = "rigid_mass", mass = "20 g", velocity = "-1 m/s" }
run = { duration = "0.1 ms", filter_width = "2 us" }
accuracy = { target = "2 %", measures = ["impulse", "filtered_peak", "contact_duration"] }
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    return write_scene(tmp_path, SMALL, name="small.toml")


def test_front_against_its_definition():
    """The front on a coarse grid, where ties abound, has what nothing beats, and equal points once."""
    rng = np.random.default_rng(7)
    for _ in range(50):
        points = rng.integers(0, 5, size=(12, 2)).astype(float)
        beaten = {
            i for i, p in enumerate(points) for j, q in enumerate(points) if (q <= p).all() and ((q < p).any() or j < i)
        }
        front = pareto_front(list(points[:, 0]), list(points[:, 1]))
        assert sorted(front) == sorted(set(range(12)) - beaten)
        assert list(points[list(front), 0]) == sorted(points[list(front), 0])


@pytest.mark.slow
@pytest.mark.parametrize("name", [*DRAWN, "flapper_on_spring", "paper_table1_3mm_area"])
def test_around_the_converged_state_each_key_is_varied_once(name: str):
    """The points around a state have a name each, and none has the values of the state itself."""
    scene = load_scene(EXAMPLES / f"{name}.toml", ALL_OPEN)
    start = begin_method(scene)
    plan = finer_in_all(finer_in_all(Plan(scene, start, ())))
    points = list(trade.around(plan, start))
    assert len({point.name for point in points}) == len(points) > 0
    assert all(point.values != plan.method.values for point in points)


def carry_out_by(monkeypatch: pytest.MonkeyPatch, carry: Callable[[Path, Point, float], Outcome]) -> None:
    """Let ``carry`` answer the jobs, in this process."""

    def ask(jobs: Iterable[str], limit: float) -> Iterator[tuple[int, str]]:
        for number, job in enumerate(map(json.loads, jobs)):
            yield number, json.dumps(asdict(carry(Path(job["path"]), Point(**job["point"]), job["limit"])))

    @contextmanager
    def crew(*_: object, **__: object) -> Iterator[Ask]:
        yield ask

    monkeypatch.setattr(trade, "crew", crew)


@pytest.mark.slow
def test_a_point_in_a_process_of_its_own(small: Path, monkeypatch: pytest.MonkeyPatch):
    """A point in its own process has the impulse to the order of its step, and its own memory and time."""
    monkeypatch.setenv("SEATFEM_STORE", "/nowhere")
    point = Point("coarse", "run.time_step", {"run.time_step": 200e-9})
    outcome = run_points(small, [point], None, time_limit=120.0)["coarse"]
    assert (outcome.state, outcome.message) == ("done", "")
    fine = carry_out(small, replace(point, values={"run.time_step": 20e-9}))
    assert outcome.summary["impulse"] == pytest.approx(fine.summary["impulse"], rel=5e-3)
    assert outcome.summary["time_step_s"] == 2e-7
    assert 0 < outcome.summary["processor_s"] < 5
    assert 5e7 < outcome.summary["memory_bytes"] < 2e9


@pytest.mark.slow
def test_what_fails_or_hangs_is_an_outcome(small: Path, monkeypatch: pytest.MonkeyPatch):
    failed = carry_out(small, Point("bad", "run.time_step"), changed={"run.time_step": "10 us"})
    assert failed.state == "failed"
    assert "RunError: run.time_step" in failed.message
    assert "processor_s" not in failed.summary
    monkeypatch.setattr(trade, "PATIENCE", 5e-4)
    stopped = run_points(small, [Point("slow", "all keys")], None, time_limit=20.0)["slow"]
    assert (stopped.state, stopped.message) == ("stopped", "no end within 0.01 s")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no limit of processor time")
def test_a_point_that_takes_too_much_processor_time_is_stopped(small: Path):
    """A point of ten million steps is stopped after the one second that is allowed."""
    small.write_text(SMALL.replace("0.1 ms", "0.1 s"), encoding="utf-8")
    point = Point("long", "run.time_step", {"run.time_step": 1e-8})
    stopped = run_points(small, [point], None, time_limit=1.0)["long"]
    assert stopped.state == "stopped"
    assert "processor" in stopped.message or "10 s" in stopped.message


def trade_of(costs: list[float], impulses: list[float], peaks: list[float], floor: float = 1e-3) -> Trade:
    """Return points "0", "1", ... and the converged one, the last, against the values 1."""
    names = [*(str(k) for k in range(len(costs) - 1)), OWN_CHOICE]
    outcomes = {
        name: Outcome("done", summary={"processor_s": cost, "impulse": i, "filtered_peak": p})
        for name, cost, i, p in zip(names, costs, impulses, peaks, strict=True)
    }
    outcomes["exact"] = Outcome("done", summary={"processor_s": 99.0, "impulse": 1.0, "filtered_peak": 1.0})
    outcomes["never"] = Outcome("stopped")
    points = tuple(Point(name, "all keys") for name in (*names, "never"))
    floors = dict.fromkeys(("impulse", "filtered_peak"), floor)
    return Trade("", ("impulse", "filtered_peak"), 0.02, points, outcomes, "exact", floors)


def test_errors_below_the_floor_do_not_count():
    """A lucky coarse point does not beat its equals, and the converged one is judged by the worst of its measures."""
    points = trade_of([1.0, 2.0, 4.0, 3.0], [1.1, 1.0, 1.0, 1.0001], [1.2, 1.05, 1.0, 1.0002])
    assert points.error(OWN_CHOICE, "filtered_peak") == pytest.approx(2e-4)
    assert points.trusted_error(OWN_CHOICE) == 1e-3
    assert points.front("impulse") == ("0", "1")
    assert points.front("filtered_peak") == ("0", "1", OWN_CHOICE)
    assert points.front() == ("0", "1", OWN_CHOICE)
    assert points.excess(OWN_CHOICE) == 1.0
    assert points.excess("2") == pytest.approx(4 / 3)
    assert points.excess("2", error=0.02) == pytest.approx(4 / 3)
    assert math.isnan(points.excess("1", error=0.02))
    assert math.isnan(points.excess("never"))
    assert math.isnan(points.error("never", "impulse"))


@pytest.mark.slow
@pytest.mark.parametrize(("duration", "status"), [("10 us", "cut off"), ("40 us", "no landing")])
def test_no_trade_without_a_landing(duration, status, small, monkeypatch, capsys):
    """Runs that end in a landing or before it are refused; the whole run is compared if a measure asks for it."""
    carry_out_by(monkeypatch, in_this_process)
    gap = 'contact = { gap = "0.1 mm" }\n' if status == "no landing" else ""
    text = SMALL.replace("0.1 ms", duration) + gap
    small.write_text(text, encoding="utf-8")
    assert run_command(["trade", str(small), "-o", str(small.parent / "out"), "--quick"]) == BAD_INPUT
    message = " ".join(capsys.readouterr().err.split())
    assert "no landing to compare" in message
    assert f"{status}; lengthen run.duration = {duration}" in message
    whole = SMALL.replace("0.1 ms", "10 us").replace('"2 %",', '"2 %", landing = "run",')
    small.write_text(whole.replace(', "contact_duration"', ""), encoding="utf-8")  # which the end cuts
    assert run_command(["trade", str(small), "-o", str(small.parent / "whole"), "--quick", "--quiet"]) == DONE


def in_this_process(scene: Path, point: Point, limit: float) -> Outcome:
    return carry_out(scene, point)


@pytest.mark.slow
def test_the_program_end_to_end(small: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """A rod: the step converges, tables and picture agree, and a second call runs nothing."""
    carry_out_by(monkeypatch, in_this_process)
    monkeypatch.setattr(trade, "code_version", lambda: "this")
    folder = small.parent / "out"
    assert run_command(["trade", str(small), "-o", str(folder), "--quick"]) == 0
    output = capsys.readouterr().out
    assert "Pareto front" in output
    assert f"{OWN_CHOICE}:" in output
    data = json.loads((folder / "trade.json").read_text(encoding="utf-8"))
    with (folder / "trade.csv").open(newline="", encoding="utf-8") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert {p["name"] for p in data["points"]} == set(rows)
    coarse, fine = (float(rows[name]["error_landing_filtered_peak"]) for name in ("state 1", "all keys one rung finer"))
    assert fine < coarse / 3  # of first order or better over a factor of four of the step
    assert data["reference"] == "all keys two rungs finer"
    assert rows[OWN_CHOICE]["state"] == "done"
    assert data["choice_excess"] >= 1.0
    assert data["choice_error"]["landing_impulse"] == pytest.approx(float(rows[OWN_CHOICE]["error_landing_impulse"]))
    assert 0 < data["floor"]["landing_filtered_peak"] < 0.02
    assert (folder / "trade.png").read_bytes().startswith(b"\x89PNG")
    assert not [p for p in folder.iterdir() if p.name.startswith(".")]

    def never(*given: object) -> Outcome:
        raise AssertionError("computed again")

    carry_out_by(monkeypatch, never)
    assert run_command(["trade", str(small), "-o", str(folder), "--quick", "--quiet", "--limit", "2 min"]) == 0
    assert capsys.readouterr().out == ""
