"""The run of a scene: plan, seat, contact, spring baseline, measures, error bars, files."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from impact.after.measures import contact_groups
from impact.after.result import ImpactResult
from impact.files import csv_table, safe_files
from impact.notices import Progress, Tell, ignore, silent
from impact.storage.hdf5 import save_results
from seatfem.jobs.folders import private_folder
from seatfem.machine.resources import Stopwatch
from seatfem.pictures import rendering, scene_drawing
from seatfem.results import LANDINGS_FILE
from seatfem.structures import cache, natural_modes, rings
from seatfem.structures.mesh.gmsh_process import gmsh_session
from seatfem.study.answers.decision import decide
from seatfem.study.impacts import contact, layout
from seatfem.study.impacts.contact import RunError
from seatfem.study.impacts.touches import bar_keys, lifts_of
from seatfem.study.plan import Plan
from seatfem.study.runs import pictures as run_pictures
from seatfem.study.runs import seat_fields, stress_wave
from seatfem.study.runs.afterwards import Baseline, afterwards, baseline_of, static_stiffness
from seatfem.study.runs.converge import begin_plan
from seatfem.study.runs.kept import cached_plan, save_plan
from seatfem.study.runs.land_records import land_keys
from seatfem.study.runs.next_round import Limits
from seatfem.study.runs.outcome import RunOutcome, RunResult
from seatfem.study.runs.round import Round, missed, not_modelled, remarks, stress_not_modelled
from seatfem.study.runs.rounds import NO_LIMITS, SEAT_FILE, last_round, rounds
from seatfem.study.runs.summary import (
    accuracy_keys,
    greens_error_keys,
    landing_bar_keys,
    landing_records,
    largest_stress_bar,
    plan_keys,
    reed_keys,
    regime_keys,
    spring_bar_keys,
    stopper_face_keys,
    stopper_keys,
    summarise,
    timing_keys,
    write_json,
)
from seatfem.study.safety import MOST_ROUNDS
from seatfem.study.scene import Scene, SceneError, located
from seatfem.study.scene.files import check_files
from seatfem.study.scene.load import AnyScene, take_scene
from seatfem.study.scene.tables import UNCHANGED, is_text, path_from
from seatfem.study.scene.wings import NO_STOPS, DriveRun
from seatfem.units import parse_quantity

__all__ = [
    "RunError",
    "RunOutcome",
    "compute_greens",
    "run",
    "run_scene",
    "summarise_own_run",
    "summarise_round",
    "write_modes",
]


SUMMARY_FILE: Final = "summary.json"
RESULT_FILE: Final = "result.h5"


def run(
    scene: AnyScene,
    folder: Path | str | None = None,
    *,
    changed: Mapping[str, object] = UNCHANGED,
    target: float | str | None = None,
    rounds: int = MOST_ROUNDS,
    max_time: float | str = math.inf,
    pictures: bool = True,
    progress: Progress = silent,
    tell: Tell = ignore,
) -> RunResult:
    """Run a scene, as ``seatfem run`` does, and return its numbers with error bars, landings and histories.

        result = seatfem.run("scene.toml", changed={"reed.thickness": "0.2 mm"}, target="2 %")
        print(result.measures["filtered_peak"], result.landings)

    Args:
        scene: path of the scene's file, its text (a string of several lines), or a `Scene`.
        folder: where files and pictures are written, as by the command; ``None``: nothing is kept on file.
        changed: values by dotted keys that replace those of the file, in the same form; ``None`` removes a key.
        target: relative accuracy of the measures asked for, in place of the scene's: 0.02 or "2 %".
        rounds: largest number of rounds of refinement, the first included.
        max_time: wall time after which no round begins and a running one is stopped, in seconds or as "1 min".
        pictures: whether to draw into the ``folder``.
        progress: function that is called with the stage and the fraction done.
        tell: function that is called with a line on each round.

    Raises:
        SeatfemError: `SceneError` for the scene, its keys and the target; `OutputError` for the folder; `RunError` for
            a scene that cannot be run; and the errors of the stages (`run_scene`).
    """
    checked = take_scene(scene, changed)
    if target is not None:
        checked = checked.with_target(target)
    seconds = parse_quantity(max_time, "time") if isinstance(max_time, str) else max_time
    try:
        return run_scene(checked, folder, progress, tell=tell, limits=Limits(rounds, seconds), pictures=pictures)
    except SceneError as error:
        raise error if isinstance(scene, Scene) or is_text(scene) else located(error, Path(scene)) from None


@gmsh_session()
def run_scene(
    scene: AnyScene,
    folder: Path | str | None = None,
    progress: Progress = silent,
    *,
    tell: Tell = ignore,
    limits: Limits = NO_LIMITS,
    pictures: bool = True,
    plan: Plan | None = None,
    histories: bool = True,
) -> RunResult:
    """Run a scene: seat, contact and its spring baseline, measures with their errors, files, then pictures.

    Keys that the scene does not state begin with coarse values by rule; the run measures their errors, and refines the
    largest in further rounds while the target is missed. A seat computed before, in ``folder`` or in the store, is
    reused. The numbers of each round are on file before the next begins, marked as not the last ones, and all numbers
    before the first picture. A picture that cannot be drawn is reported, and named in summary.json.

    Args:
        scene: the scene, the path of its file, or its text.
        folder: folder of all files, created if needed; ``None``: nothing is kept on file or drawn.
        progress: function that is called with the stage and the fraction done.
        tell: function that receives a line on each round: refined keys, errors, time, memory, time of the next round.
        limits: limits on the number of rounds and on time.
        pictures: whether to draw.
        plan: plan of the first round; by default that of the scene's last run that met its target, else by rule.
        histories: whether to write result.h5.

    Raises:
        SceneError: the file of the scene has errors.
        OutputError: ``folder`` cannot be written to.
        RunError: the time step cannot resolve the measures asked for, or nothing can stop the striker.
        Errors of the stages: LevelError, MeshError, MeshingError, ModelError, GreensFunctionError, StorageError.
    """
    scene = take_scene(scene)
    if folder is None:
        with private_folder("run") as place:
            run = partial(run_scene, scene, place, progress, tell=tell, limits=limits, plan=plan)
            return replace(run(pictures=False, histories=False), files=())
    folder = path_from(folder)
    safe_files.check_writable(*(folder / name for name in (RESULT_FILE, SUMMARY_FILE, SEAT_FILE, LANDINGS_FILE)))
    with rendering.drawing_apart() as painter:
        return _run(scene, folder, progress, tell, limits, plan, painter, pictures=pictures, histories=histories)


def _run(
    scene: Scene, folder: Path, progress: Progress, tell: Tell, limits: Limits, plan: Plan | None,
    painter: rendering.Painter, *, pictures: bool, histories: bool,
) -> RunResult:  # fmt: skip
    """Carry out `run_scene`; the ``painter`` draws bodies in another process during the run."""
    start, watch, has_own_plan = time.perf_counter(), Stopwatch(), plan is None
    with watch("plan"):
        earlier = plan or cached_plan(scene)
        plan = earlier or begin_plan(scene)
        if earlier is None and pictures and not plan.method.seat.exact:  # the seat is likely to be drawn
            painter.begin()
        if scene.stress is not None:
            seat_fields.check_stress(plan, progress)
    baseline: Baseline | None = None
    for latest in rounds(plan, folder, watch, progress, limits=limits, tell=tell, start=start):
        if pictures:
            run_pictures.ahead(latest, painter)
        if baseline is None or baseline.beside is not latest.result:  # a round is yielded again if the next one fails
            baseline = baseline_of(latest, watch)
        drive_runs = _follow_drives(latest)
        summary = _summarise(latest, baseline, drive_runs, watch)
        with watch("files"):
            if histories:
                about = {"title": scene.title, "round": latest.number}
                save_results(folder / RESULT_FILE, _collect_results(latest, baseline), about)
            write_json(folder / SUMMARY_FILE, {**summary, **timing_keys(watch, start)})
            drive_files = [each.write(folder) for each in drive_runs]
            write_landings(folder / LANDINGS_FILE, summary["landings"])
        if latest.is_followed:
            baseline = None  # frees the memory of its histories for the next round
    if has_own_plan or latest.number > 1:
        save_plan(scene, latest)
    scene = latest.plan.scene
    assert baseline is not None

    def write_summary(keys: Mapping[str, object]) -> None:
        write_json(folder / SUMMARY_FILE, {**summary, **keys, **timing_keys(watch, start)})

    later = afterwards(latest, baseline, folder, watch, progress, tell=tell, histories=histories, keep=write_summary)
    effects = not_modelled(latest)
    notes = (*missed(latest), *remarks(latest, effects), *later.notes(latest.plan))
    met = not later.bars_missed(scene.accuracy) if latest.met else latest.met
    summary |= {**later.keys, "accuracy_met": met, "notes": list(notes), "not_modelled": list(effects)}
    summary |= largest_stress_bar(summary)
    summary["stress_not_modelled"] = list(stress_not_modelled(latest))
    summary |= decide(summary).keys()
    write_summary({})
    drawn: tuple[Path, ...] = ()
    missing: tuple[str, ...] = ()
    if pictures:
        with watch("pictures"):  # if they fail, all numbers are on file
            lip = stress_wave.lip_pictures(latest, baseline.touches, summary["landings"]) if latest.touches.line else []
            division = latest.plan.method.seat.division
            drawing = layout.DRAWING, lambda path: scene_drawing.draw_layout(layout.layout_of(scene, division), path)
            geometry = scene.geometry
            lift = geometry.stopper_gap_at_contact + scene.contact.gap if scene.stopper else math.nan
            of_drives = [each.picture(scene.title, lift) for each in drive_runs]
            strains = run_pictures.gauge_pictures(latest.touches, scene.title)
            stopper = run_pictures.stopper_pictures(latest.touches, scene.run.filter_width, scene.title)
            more = [drawing, *stopper, *lip, *of_drives, *strains, *later.pictures(latest)]
            landings = summary["landings"]
            drawn, missing = run_pictures.draw_run(latest, baseline.result, folder, progress, painter, more, landings)
        summary |= {**timing_keys(watch, start), "pictures_missing": "; ".join(missing)}
        try:
            write_json(folder / SUMMARY_FILE, summary)
        except OSError as problem:
            missing = (*missing, f"{SUMMARY_FILE} does not list the pictures: {problem}")
    tables = (folder / SUMMARY_FILE, folder / LANDINGS_FILE)
    seats = (folder / SEAT_FILE, *filter(Path.is_file, (cache.coarser_file(folder / SEAT_FILE),)))
    files = (*tables, *((folder / RESULT_FILE,) if histories else ()), *seats, *drive_files, *later.files, *drawn)
    summary |= timing_keys(watch, start)
    outcome = summary, (*notes, *missing), files, watch.stages, met
    return RunResult(*outcome, histories=latest.result, spring=baseline.result, plan=latest.plan)


def _collect_results(done: Round, baseline: Baseline) -> dict[str, ImpactResult]:
    """Return the histories of a round and of its baseline by their names in result.h5."""
    touches, parts = done.touches, "rings" if done.touches.line is None else "lip"
    results = {
        "wave": done.result,
        "spring": baseline.result,
        parts: touches.parts,
        "stopper": touches.stopper,
        "stopper_lip": touches.stopper_parts,
        "spring_stopper": baseline.touches.stopper,
    }
    return {name: result for name, result in results.items() if result is not None}


def summarise_round(done: Round) -> tuple[dict[str, Any], ImpactResult]:
    """Return the keys of summary.json of a round without those of stress, assessments and gauges, and the histories of
    its spring baseline."""
    watch = Stopwatch({"contact": 0.0, "plan": 0.0})
    baseline = baseline_of(done, watch)
    return _summarise(done, baseline, _follow_drives(done), watch), baseline.result


def summarise_own_run(done: Round) -> dict[str, Any]:
    """Return the keys of summary.json of a round's own run, without error bars and spring baseline."""
    scene, width = done.plan.scene, done.plan.scene.run.filter_width
    known = {"driven": scene.is_loaded, "filmed": scene.contact.film is not None}
    return {
        **summarise(done.touches, width, done.stress, scene.accuracy.landing, **known),
        **stopper_keys(done.touches, width),
        **{key: value for each in _follow_drives(done) for key, value in each.keys().items()},
        **contact.valve_spring_keys(scene.spring, done.strike),
    }


def _follow_drives(done: Round) -> tuple[DriveRun, ...]:
    """Return the histories in a round of the drives, loads with a state such as the gas of a valve."""
    scene, touches = done.plan.scene, done.touches
    ports = lifts_of(scene.geometry, touches, done.seat.greens) if scene.driven_by else ()
    stops = NO_STOPS if touches.stopper is None else contact_groups(touches.stopper)[:, 0]
    run = touches.opening, touches.seat.dt, scene.run.duration, ports, stops
    return tuple(each.follow(*run) for each in scene.driven_by)


def _summarise(done: Round, baseline: Baseline, drive_runs: tuple[DriveRun, ...], watch: Stopwatch) -> dict[str, Any]:
    """Return the keys of summary.json of a round and its spring baseline, with error bars."""
    scene, width = done.plan.scene, done.plan.scene.run.filter_width
    records, bar = landing_records(done.touches, done.budget), baseline.stiffness_bar
    landing, known = scene.accuracy.landing, {"driven": scene.is_loaded, "filmed": scene.contact.film is not None}
    measured, on_spring = (
        summarise(each.touches, width, each.stress, landing, **known) | stopper_keys(each.touches, width)
        for each in (done, baseline)
    )
    return {
        "title": scene.title,
        **measured,
        **{f"spring_{k}": v for k, v in on_spring.items()},
        **baseline.simpler,
        **({} if done.touches.line is None else {"tilt_deg": math.degrees(scene.contact.tilt)}),
        "spring_wall_time_s": watch.stages["spring baseline"],
        "contact_wall_time_s": watch.stages["contact"],
        **landing_bar_keys(records, measured["landing_number"]),
        **bar_keys(done.budget),
        **spring_bar_keys(baseline.budget),
        "landings": records,
        **land_keys(done.touches, done.budget),
        **accuracy_keys(done),
        **plan_keys(done.plan, watch.stages["plan"]),
        "seat_static_stiffness_N_per_m": baseline.stiffness,
        **({} if math.isnan(bar) else {"error_bar_seat_static_stiffness_N_per_m": bar}),
        **greens_error_keys(done.seat.greens),
        **done.seat.about,
        "seat_reused": done.seat.reused,
        "run_duration_s": scene.run.duration,
        "seat_kind": scene.seat.kind,
        **{key: value for each in drive_runs for key, value in each.keys().items()},
        **({} if scene.stopper is None else stopper_face_keys(scene.stopper)),
        **contact.valve_spring_keys(scene.spring, done.strike),
        **reed_keys(scene.reed.kind, done.striker, done.reed),
        **regime_keys(done.striker, rings.join_all_parts(done.seat.greens), done.result),
    }


def write_landings(path: Path, landings: Sequence[Mapping[str, object]]) -> None:
    """Write the records of landings with a column for each key, of no landings the first three column heads."""
    heads = list(dict.fromkeys(key for record in landings for key in record)) or ["body", "number", "time_s"]
    csv_table.write_csv(path, heads, ([record.get(key) for key in heads] for record in landings))


@gmsh_session()
def compute_greens(scene: Scene, path: Path, progress: Progress = silent) -> RunOutcome:
    """Compute the seat's Green's function of the last round of a run, and write it to ``path``."""
    watch = Stopwatch()
    safe_files.check_writable(path)
    with watch("rounds"):
        done = last_round(begin_plan(scene), watch, progress=progress)
    seat, key = done.seat, cache.key_of(scene.seat, done.plan.method.seat)
    cache.Cache(path).write(seat.greens, key, seat.in_rings)
    summary = {
        "seat_static_stiffness_N_per_m": static_stiffness(seat.greens, scene.seat.endless_stiffness),
        **greens_error_keys(seat.greens),
        **seat.about,
        "seat_reused": seat.reused,
    }
    return RunOutcome(summary, (), (path,), watch.stages)


def write_modes(
    scene: Scene, folder: Path, progress: Progress = silent, *, count: int | None = None, up_to_hz: float | None = None
) -> RunOutcome:
    """Compute the ``count`` lowest modes of the seat, or all ``up_to_hz``, by default 20; write modes.csv, pictures, an
    animation and modes.vtu (ParaView)."""
    safe_files.check_writable(folder / "modes.csv")
    watch = Stopwatch()
    check_files(scene)
    natural = natural_modes.modes_of(scene.seat, natural_modes.Wanted.from_limits(count, up_to_hz), watch, progress)
    if natural is None:
        raise RunError(
            f"seat.kind = {scene.seat.kind!r} has neither finite elements nor matrices to take modes from; use a "
            "geometry (annular, bar, block, cad, ...), mesh or matrices"
        )
    with watch("pictures"):
        files, gaps = run_pictures.draw_modes(natural, folder, progress)
    note = f"{len(natural.modes)} modes of {natural.searched}, {natural.dof} unknowns; the inertia count confirms this"
    summary = {
        "frequencies_hz": [float(f) for f in natural.frequencies_hz],
        "complete": True,  # otherwise there is an error
        "seat_dof": natural.dof,
    }
    return RunOutcome(summary, (note, *gaps), files, watch.stages, modes=natural.modes)
