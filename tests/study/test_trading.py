"""The measured trade: ladder, journal, front, chart; one point in a process of its own."""

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

from impact import measures
from seatfem.faces.cli import BAD_INPUT, DONE, run_command
from seatfem.jobs.crew import Ask
from seatfem.study.impacts.validity import BEAM, ONE_PORT, simpler_models
from seatfem.study.ladders.ladder import RATIO
from seatfem.study.sweep.effects import pareto_front
from seatfem.study.trade import trade
from seatfem.study.trade.report import in_words, summary_of
from seatfem.study.trade.rungs import ALL_OPEN, BY_HAND, Point, Rungs, carry_out, centre_of
from seatfem.study.trade.trade import PLANNED, Trade, cost_excess, run_points
from tests.gallery import FLAPPER
from tests.steps import Outcome, SceneError, load_scene, seat_of, stated_method, striker_of

EXAMPLES = Path(__file__).parents[2] / "examples"
DRAWN = ("flapper_on_annular_seat", "flapper_on_arc", "flapper_on_stopper", "flapper_on_valve_plate", "mass_on_bar")
CLOSED = ("flapper_on_spring", "paper_table1_3mm_area")

SMALL = """
title = "Mass on a rod"
seat = { kind = "rod", young = "200 GPa", density = "7850 kg/m^3", length = "50 mm", area = "1 cm^2" }
reed = { kind = "rigid_mass", mass = "20 g", velocity = "-1 m/s" }
run = { duration = "0.1 ms", filter_width = "2 us" }
accuracy = { target = "2 %", measures = ["impulse", "filtered_peak", "contact_duration"] }
"""

TILTED = f"""
seat = {{ kind = "annular", bore_radius = "5 mm", lip_width = "1 mm", model = "spring", material = "steel", \
    mesh = {{ size = "2.5 mm", contact_size = "0.5 mm" }} }}
contact = {{ tilt = "0.3 deg", ports = 8 }}
run = {{ duration = "0.1 ms", time_step = "0.1 us" }}
accuracy = {{ measures = ["impulse", "line_force"] }}
[reed]
{FLAPPER}greens = {{ bandwidth = "40 kHz" }}
release = {{ velocity = "-2 m/s" }}
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(SMALL, encoding="utf-8")
    return path


def test_front_against_its_definition():
    """On a coarse grid, so that ties abound: on the front is whatever nothing beats, once for equal points."""
    rng = np.random.default_rng(7)
    for _ in range(50):
        points = rng.integers(0, 5, size=(12, 2)).astype(float)
        beaten = {
            i for i, p in enumerate(points) for j, q in enumerate(points) if (q <= p).all() and ((q < p).any() or j < i)
        }
        front = pareto_front(list(points[:, 0]), list(points[:, 1]))
        assert sorted(front) == sorted(set(range(12)) - beaten)
        assert list(points[list(front), 0]) == sorted(points[list(front), 0])


def test_excess_is_one_on_the_front_and_the_ratio_beyond_it():
    costs, errors = [1.0, 2.0, 5.0, math.nan], [0.5, 0.1, 0.1, math.nan]
    assert cost_excess(1.0, 0.5, costs, errors) == 1.0
    assert cost_excess(5.0, 0.1, costs, errors) == 2.5
    assert cost_excess(3.0, 0.05, costs, errors) == 1.0  # more accurate than all
    assert math.isnan(cost_excess(math.nan, 0.1, costs, errors))


@pytest.mark.parametrize("name", DRAWN + CLOSED)
def test_every_rung_is_a_scene_and_has_a_name_of_its_own(name: str):
    path = EXAMPLES / f"{name}.toml"
    scene = load_scene(path)
    points = Rungs(scene).points()
    assert len({p.name for p in points}) == len(points)
    for point in (*points, Rungs(scene).reference(2.0), Rungs(scene).reference(2.0, coarser=True)):
        load_scene(path, point.settings)
    assert {p.name for p in Rungs(scene).points(quick=True)} < {p.name for p in points}
    assert all(p.after in ("", *(q.name for q in points[:k])) for k, p in enumerate(points))


@pytest.mark.parametrize("name", DRAWN)
def test_every_level_that_describes_the_seat_is_on_the_ladder(name: str):
    scene = load_scene(EXAMPLES / f"{name}.toml")
    families = {p.family for p in Rungs(scene).points()}
    assert {a.level for a in scene.seat.levels() if a.applies} <= families
    assert "spring" in families
    assert "rod" in families
    varied = {p.varied for p in Rungs(scene).points()}
    assert varied >= {"by hand", "diagonal", "mesh", "order", "band", "tolerance", "time step", "history"}
    assert ("reed modes" in varied) == (name != "mass_on_bar")
    assert ("reduction" in varied) == (name != "flapper_on_arc")  # harmonics have one


def test_the_reductions_that_apply_are_tried():
    names = {
        p.name for p in Rungs(load_scene(EXAMPLES / "flapper_on_annular_seat.toml")).points() if p.varied == "reduction"
    }
    assert names == {"reduction krylov", "reduction modes", "reduction second_order"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tilted_landing", "slot_landing"])
def test_along_a_lip_there_is_what_serves_there(name: str):
    scene = load_scene(EXAMPLES / f"{name}.toml")
    points = {p.name: p for p in Rungs(scene).points(quick=True)}
    assert {"beam", "one port", "16 ports", "64 ports", "spring, statics, centre"} <= set(points)
    assert {p.family for p in points.values()} == {"spring", Rungs(scene).family}
    assert not {p.varied for p in Rungs(scene).points()} & {"by hand", "tolerance", "reduction"}


def test_the_reference_has_more_rings_than_the_plan():
    scene = load_scene(EXAMPLES / "mass_on_meshed_seat.toml")
    found = [Rungs(scene, 4).reference(2.0, coarser=coarser).settings["contact.rings"] for coarser in (0, 1)]
    assert found == [8, 4]
    assert "4 rings" in {p.name for p in Rungs(scene, 4).points()}
    assert "contact.rings" not in Rungs(scene).reference(2.0).settings


@pytest.mark.slow
def test_one_port_and_a_beam_are_those_of_a_run(tmp_path: Path):
    """A point with the plate's or the beam's one contact says what the run tells beside its arcs."""
    path = tmp_path / "scene.toml"
    path.write_text(TILTED, encoding="utf-8")
    scene = load_scene(path)
    method = stated_method(scene)
    seat, dt = seat_of(scene, method=method.seat, mesh_error=False), scene.run.time_step
    found = simpler_models(scene, striker_of(scene, method=method.reed), seat.greens, dt)
    for name in (ONE_PORT, BEAM):
        outcome = carry_out(path, Point(name, "spring", name, in_place=name))
        assert outcome.state == "done", outcome.message
        assert outcome.summary["impulse"] == pytest.approx(measures.impulse(found[name].seat), rel=5e-3)
        assert "line_force" not in outcome.summary


def test_closed_forms_have_time_steps_and_nothing_to_mesh():
    varied = {p.varied for p in Rungs(load_scene(EXAMPLES / "paper_table1_3mm_area.toml")).points()}
    assert varied == {"by hand", "diagonal", "reed modes", "time step", "history"}


def test_the_centre_is_what_the_file_states_and_else_what_the_filter_sees():
    sizes = {"seat.mesh.size": "1 mm", "seat.mesh.contact_size": "0.4 mm", "seat.greens.bandwidth": "1 MHz"}
    stated = centre_of(load_scene(EXAMPLES / "flapper_on_annular_seat.toml", sizes)).seat
    assert (stated.level, stated.size, stated.contact_size, stated.bandwidth) == ("axisymmetric", 1e-3, 0.4e-3, 1e6)
    scene = load_scene(EXAMPLES / "flapper_on_valve_plate.toml")
    open_ = centre_of(scene).seat
    assert open_.bandwidth == pytest.approx(0.5 / scene.run.filter_width)
    assert open_.size == pytest.approx(3e-3)  # the plate's thickness: less than a third of the shear wave, 4.1 mm
    assert open_.contact_size == pytest.approx(1e-3)  # the land


def test_the_column_of_the_annular_seat():
    """The flat top of the lip, 0.8 mm wide at a radius of 4.5 mm, over 8.5 mm of steel."""
    column = load_scene(EXAMPLES / "flapper_on_annular_seat.toml").seat.column()
    assert column.area == pytest.approx(2 * math.pi * 4.5e-3 * 0.8e-3)
    assert column.stiffness == pytest.approx(2e11 * column.area / 8.5e-3)
    arc = load_scene(EXAMPLES / "flapper_on_arc.toml").seat.column()
    assert arc.area == pytest.approx(column.area / 6)


@pytest.mark.parametrize("name", [*DRAWN, "paper_table1_3mm_area"])
def test_the_reference_is_finer_than_every_rung(name: str):
    path = EXAMPLES / f"{name}.toml"
    scene = load_scene(path)
    reference = load_scene(path, Rungs(scene).reference(1.0).settings)
    back = load_scene(path, Rungs(scene).reference(1.0, coarser=True).settings)
    for point in Rungs(scene).points():
        rung = load_scene(path, point.settings)
        if hasattr(reference.reed, "n_modes"):
            assert reference.reed.n_modes > max(rung.reed.n_modes, back.reed.n_modes)
        if hasattr(rung.seat, "mesh"):
            assert reference.seat.mesh.size < rung.seat.mesh.size * (1 - 1e-9)
            assert reference.seat.mesh.contact_size < rung.seat.mesh.contact_size * (1 - 1e-9)
            assert reference.seat.greens.bandwidth > rung.seat.greens.bandwidth * (1 + 1e-9)
            assert reference.seat.greens.tolerance < rung.seat.greens.tolerance
        if rung.run.time_step is not None:
            assert scene.run.filter_width / Rungs(scene).reference(1.0).least_steps < rung.run.time_step
    assert reference.run.time_step is None
    if hasattr(back.seat, "mesh"):
        assert back.seat.mesh.size == pytest.approx(RATIO * reference.seat.mesh.size)
        assert back.seat.greens.bandwidth == pytest.approx(reference.seat.greens.bandwidth / RATIO)


def test_settings_are_stated_and_taken_out(small: Path):
    sizes = {"seat.mesh.size": "2 mm", "seat.greens.bandwidth": "300 kHz", "run.time_step": "50 ns"}
    scene = load_scene(EXAMPLES / "flapper_on_annular_seat.toml", sizes)
    assert (scene.seat.mesh.size, scene.seat.greens.bandwidth, scene.run.time_step) == (2e-3, 3e5, 5e-8)
    assert "size" in scene.seat.mesh.model_fields_set
    free = load_scene(EXAMPLES / "flapper_on_annular_seat.toml", {**sizes, **ALL_OPEN})
    assert free.seat.mesh.size is None
    assert free.run.time_step is None
    assert "bandwidth" not in free.seat.greens.model_fields_set
    with pytest.raises(SceneError, match=r"run\.time_step"):
        load_scene(small, {"run.time_step": "1 mm"})


def run_point(scene: Path, point: Point, limit: float) -> Outcome:
    """One point in a process of its own."""
    return run_points(scene, [point], None, time_limit=limit)[point.name]


def carry_out_by(monkeypatch: pytest.MonkeyPatch, carry: Callable[[Path, Point, float], Outcome]) -> None:
    """Let ``carry`` answer the jobs, in this process."""

    def ask(jobs: Iterable[str], limit: float) -> Iterator[tuple[int, str]]:
        for number, job in enumerate(map(json.loads, jobs)):
            point = Point(**job["point"], settings=job["changed"])
            yield number, json.dumps(asdict(carry(Path(job["path"]), point, job["limit"])))

    @contextmanager
    def crew(*_: object, **__: object) -> Iterator[Ask]:
        yield ask

    monkeypatch.setattr(trade, "crew", crew)


@pytest.mark.slow
def test_a_point_in_a_process_of_its_own(small: Path, monkeypatch: pytest.MonkeyPatch):
    """Twice the step, the same impulse to the order of the step; its own memory and time."""
    monkeypatch.setenv("SEATFEM_STORE", "/nowhere")
    point = Point("coarse", "as given", "time step", {"run.time_step": "200 ns"})
    outcome = run_point(small, point, 120.0)
    assert (outcome.state, outcome.message) == ("done", "")
    fine = carry_out(small, replace(point, settings={"run.time_step": "20 ns"}))
    assert outcome.summary["impulse"] == pytest.approx(fine.summary["impulse"], rel=5e-3)
    assert outcome.summary["time_step_s"] == 2e-7
    assert 0 < outcome.summary["processor_s"] < 5
    assert 0 < outcome.summary["start_s"] < 120
    assert 5e7 < outcome.summary["memory_bytes"] < 2e9


@pytest.mark.slow
def test_what_fails_or_hangs_is_an_outcome(small: Path, monkeypatch: pytest.MonkeyPatch):
    failed = carry_out(small, Point("bad", "as given", "time step", {"run.time_step": "10 us"}))
    assert failed.state == "failed"
    assert "RunError: run.time_step" in failed.message
    assert "processor_s" not in failed.summary
    monkeypatch.setattr(trade, "PATIENCE", 5e-4)
    stopped = run_point(small, Point("slow", "as given", "diagonal"), 20.0)
    assert (stopped.state, stopped.message) == ("stopped", "no end within 0.01 s")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no limit of processor time")
def test_a_point_that_takes_too_much_processor_time_is_stopped(small: Path):
    """Ten million steps; loading the program alone takes more than the second that is allowed."""
    steps = {"run.duration": "0.1 s", "run.time_step": "10 ns"}
    stopped = run_point(small, Point("long", "as given", "time step", steps), 1.0)
    assert stopped.state == "stopped"
    assert "processor" in stopped.message or "10 s" in stopped.message


def test_a_process_that_dies_is_an_outcome(small: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("sys.executable", "/bin/false")
    died = run_point(small, Point("dies", "as given", "diagonal"), 10.0)
    assert died.state == "failed"
    assert "exit code 1" in died.message


def test_a_stopped_ladder_goes_on_after_a_line_that_was_cut_short(small: Path, monkeypatch: pytest.MonkeyPatch):
    ran: list[str] = []

    def pretend(scene: Path, point: Point, limit: float) -> Outcome:
        ran.append(point.name)
        return Outcome("done", "", 1.0, {"impulse": float(len(ran))})

    carry_out_by(monkeypatch, pretend)
    monkeypatch.setattr(trade, "code_version", lambda: "one")
    points = [Point(name, "rod", "diagonal") for name in "abc"]
    journal = small.parent / "deep" / "trade.jsonl"
    first = run_points(small, points, journal)
    whole = journal.read_bytes()
    journal.write_bytes(whole[: whole.rindex(b'"outcome"') + 20])  # killed while it wrote the third
    second = run_points(small, points, journal)
    assert ran == ["a", "b", "c", "c"]
    assert first["a"] == second["a"]
    assert run_points(small, points, journal) == second  # and the new line stands on its own
    assert ran == ["a", "b", "c", "c"]
    run_points(small, [replace(points[0], engine="fft")], journal)  # another point of the same name
    small.write_text(SMALL.replace("20 g", "21 g"), encoding="utf-8")  # another scene
    run_points(small, points[:1], journal)
    monkeypatch.setattr(trade, "code_version", lambda: "two")  # another program
    run_points(small, points[:1], journal)
    assert ran[4:] == ["a", "a", "a"]


def test_no_rung_is_tried_beyond_one_that_was_stopped(small: Path, monkeypatch: pytest.MonkeyPatch):
    limits: list[float] = []

    def hang(scene: Path, point: Point, limit: float) -> Outcome:
        limits.append(limit)
        return Outcome("stopped", "no end", summary={"processor_s": limit}) if limit < 50 else Outcome("done")

    carry_out_by(monkeypatch, hang)
    points = [Point("coarse", "3d", "diagonal"), Point("fine", "3d", "diagonal", after="coarse")]
    journal = small.parent / "trade.jsonl"
    found = run_points(small, points, journal, time_limit=10)
    assert [found[p.name].state for p in points] == ["stopped", "stopped"]
    assert "coarse stopped" in found["fine"].message
    assert limits == [10]
    found = run_points(small, points, journal, time_limit=60)  # more time: tried again
    assert [found[p.name].state for p in points] == ["done", "done"]


def test_what_is_predicted_to_take_far_too_long_is_not_tried(small: Path, monkeypatch: pytest.MonkeyPatch):
    carry_out_by(monkeypatch, lambda *given: Outcome("done"))
    points = [Point("short", "3d", "planned", predicted=15.0), Point("long", "3d", "planned", predicted=25.0)]
    found = run_points(small, points, small.parent / "trade.jsonl", time_limit=10)
    assert [found[p.name].state for p in points] == ["done", "stopped"]
    assert "25 s predicted" in found["long"].message


def trade_of(costs: list[float], impulses: list[float], peaks: list[float], floor: float = 1e-3) -> Trade:
    """Points "0", "1", ... and the planner's choice, the last, against the values 1."""
    names = [*(str(k) for k in range(len(costs) - 1)), PLANNED]
    outcomes = {
        name: Outcome("done", summary={"processor_s": cost, "impulse": i, "filtered_peak": p})
        for name, cost, i, p in zip(names, costs, impulses, peaks, strict=True)
    }
    outcomes["exact"] = Outcome("done", summary={"processor_s": 99.0, "impulse": 1.0, "filtered_peak": 1.0})
    outcomes["never"] = Outcome("stopped")
    points = tuple(Point(name, "rod", "diagonal") for name in (*names, "never"))
    floors = dict.fromkeys(("impulse", "filtered_peak"), floor)
    return Trade("", ("impulse", "filtered_peak"), 0.02, points, outcomes, "exact", floors)


def test_errors_below_the_floor_do_not_count():
    """A lucky coarse point does not beat its equals, and the planner is judged by the worst of its measures."""
    found = trade_of([1.0, 2.0, 4.0, 3.0], [1.1, 1.0, 1.0, 1.0001], [1.2, 1.05, 1.0, 1.0002])
    assert found.error(PLANNED, "filtered_peak") == pytest.approx(2e-4)
    assert found.trusted_error(PLANNED) == 1e-3
    assert found.front("impulse") == ("0", "1")
    assert found.front("filtered_peak") == ("0", "1", PLANNED)
    assert found.front() == ("0", "1", PLANNED)
    assert found.excess(PLANNED) == 1.0
    assert found.excess(PLANNED, "impulse") == pytest.approx(1.5)
    assert found.excess("2") == pytest.approx(4 / 3)
    assert found.excess_at_target("2") == pytest.approx(4 / 3)
    assert math.isnan(found.excess_at_target("1"))
    assert math.isnan(found.error("never", "impulse"))


def test_a_point_that_does_not_tell_a_measure_is_on_the_fronts_of_others_alone():
    found = trade_of([1.0, 2.0, 3.0], [1.0, 1.1, 1.2], [1.1, 1.1, 1.2])
    del found.outcomes["0"].summary["filtered_peak"]  # type: ignore[attr-defined]
    assert math.isnan(found.trusted_error("0"))
    assert "0" in found.front("impulse")
    assert "0" not in found.front()
    assert "0" not in found.front("filtered_peak")


def test_a_lucky_guess_is_no_rival_but_is_told():
    """A stiffness by hand that happens to be right: nobody could know before."""
    found = trade_of([1.0, 2.0, 3.0], [1.0, 1.015, 1.01], [1.0, 1.015, 1.01])
    guess = replace(found.points[0], varied=BY_HAND)
    found = replace(found, points=(guess, *found.points[1:]))
    assert found.front() == ("1", PLANNED)
    assert found.excess(PLANNED) == 1.0
    assert found.excess(PLANNED, guesses=True) == 3.0
    assert found.excess_at_target(PLANNED) == 1.5
    assert summary_of(found)["planner_excess_with_guesses"] == 3.0


def test_a_point_that_does_not_land_has_no_error_of_a_landing():
    """It is no rival of those that land, and the words count it; of the whole run it has one."""
    found = trade_of([1.0, 2.0, 3.0], [0.0, 1.1, 1.05], [0.0, 1.1, 1.05])
    found.outcomes["0"].summary["landing_status"] = "no landing"  # type: ignore[index]
    found.outcomes["1"].summary["landing_status"] = "landed"  # type: ignore[index]
    assert found.front() == ("0", "1", PLANNED)
    assert found.left_out_in_words() == ""
    of_landings = {
        name: replace(each, summary=each.summary | {f"landing_{key}": each.summary.get(key) for key in found.measures})
        for name, each in found.outcomes.items()
    }
    measures = tuple(f"landing_{name}" for name in found.measures)
    found = replace(found, measures=measures, outcomes=of_landings, floor=dict.fromkeys(measures, 1e-3))
    assert math.isnan(found.error("0", "landing_impulse"))
    assert found.front() == ("1", PLANNED)
    assert in_words(found).splitlines()[1] == "1 of 3 points left out: 1 no landing"


@pytest.mark.slow
@pytest.mark.parametrize(("duration", "status"), [("10 us", "cut off"), ("40 us", "no landing")])
def test_no_trade_without_a_landing(duration, status, small, monkeypatch, capsys):
    """Whether the run ends in it or before it; a part of a contact is compared where the whole run is asked of."""
    carry_out_by(monkeypatch, in_this_process)
    gap = 'contact = { gap = "0.1 mm" }\n' if status == "no landing" else ""
    text = SMALL.replace("0.1 ms", duration) + gap
    small.write_text(text, encoding="utf-8")
    assert run_command(["trade", str(small), "-o", str(small.parent / "out"), "--quick"]) == BAD_INPUT
    told = " ".join(capsys.readouterr().err.split())
    assert "no landing to compare" in told
    assert f"{status}; lengthen run.duration = {duration}" in told
    small.write_text(SMALL.replace("0.1 ms", "10 us").replace('"2 %",', '"2 %", landing = "run",'), encoding="utf-8")
    assert run_command(["trade", str(small), "-o", str(small.parent / "whole"), "--quick", "--quiet"]) == DONE


def in_this_process(scene: Path, point: Point, limit: float) -> Outcome:
    return carry_out(scene, point)


@pytest.mark.slow
def test_the_program_end_to_end(small: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """A rod: the spring is far off, every step converges, tables and picture agree, and a second call runs nothing."""
    carry_out_by(monkeypatch, in_this_process)
    monkeypatch.setattr(trade, "code_version", lambda: "this")
    folder = small.parent / "out"
    assert run_command(["trade", str(small), "-o", str(folder), "--quick"]) == 0
    told = capsys.readouterr().out
    assert "Pareto front" in told
    assert "planner's choice:" in told
    data = json.loads((folder / "trade.json").read_text(encoding="utf-8"))
    with (folder / "trade.csv").open(newline="", encoding="utf-8") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert {p["name"] for p in data["points"]} == set(rows)
    assert float(rows["spring, E A/L"]["error_landing_impulse"]) > 0.02  # waves count here: mass 20 g, rod 39 g
    coarse, fine = (float(rows[f"{n} steps per filter"]["error_landing_filtered_peak"]) for n in (2, 32))
    assert fine < coarse / 4  # first order or better over a factor of 16
    assert data["planner_state"] == "done"
    assert data["planner_excess"] >= 1.0
    assert 0 < data["floor"]["landing_filtered_peak"] < 0.02
    assert (folder / "trade.png").read_bytes().startswith(b"\x89PNG")
    assert not [p for p in folder.iterdir() if p.name.startswith(".")]

    def never(*given: object) -> Outcome:
        raise AssertionError("computed again")

    carry_out_by(monkeypatch, never)
    assert run_command(["trade", str(small), "-o", str(folder), "--quick", "--quiet", "--limit", "2 min"]) == 0
    assert capsys.readouterr().out == ""


@pytest.mark.slow
def test_a_point_tells_its_reduction_and_its_poles(tmp_path: Path):
    """Of a function by modes their number; of one that is convolved none."""
    path = tmp_path / "scene.toml"
    path.write_text(
        '[seat]\nkind = "annular"\nmodel = "axisymmetric"\nbore_radius = "4 mm"\nlip_width = "2 mm"\n'
        'rayleigh = { stiffness = "1 us" }\n'
        'lip_edge_radius = "0 mm"\nmesh = { size = "3 mm", contact_size = "1.5 mm" }\nmaterial = "steel"\n'
        'greens = { bandwidth = "100 kHz", tolerance = "3 %" }\n'
        '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n'
        '[run]\nduration = "30 us"\ntime_step = "0.1 us"\n'
    )
    found = {}
    for name in ("krylov", "transient"):
        outcome = carry_out(path, Point(name, "", "reduction", {"seat.greens.method": name}))
        assert outcome.state == "done", outcome.message
        found[outcome.summary["reduction"]] = outcome.summary["seat_poles"]
    assert found["krylov"] > 5
    assert found["transient"] == 0
