"""A scene, carried out: plan, seat, contact, spring baseline, measures, error bars, files and pictures."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from impact.after.stresses import ReedStress
from impact.files.atomic import check_writable
from impact.files.table import write_csv
from impact.progress import Progress, Tell, silent, untold
from impact.storage.hdf5 import save_results
from seatfem.machine.stopwatch import Stopwatch
from seatfem.pictures.apart import Painter
from seatfem.results import LANDINGS_FILE
from seatfem.structures.cache import Cache
from seatfem.structures.rings import as_a_whole
from seatfem.study.impacts.contact import RunError, check_step, seat_of
from seatfem.study.impacts.gas import GasRun, gas_keys, write_gas
from seatfem.study.impacts.measures import bar_keys
from seatfem.study.impacts.simpler import simpler_keys
from seatfem.study.impacts.springs import valve_spring_keys
from seatfem.study.impacts.touches import Touches
from seatfem.study.planning.plan import Plan
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.afterwards import afterwards
from seatfem.study.runs.baseline import Baseline, baseline_of, static_stiffness
from seatfem.study.runs.drawing import drawing_picture
from seatfem.study.runs.ended import ended_plan, remember
from seatfem.study.runs.lip_pictures import lip_pictures
from seatfem.study.runs.outcome import RunOutcome
from seatfem.study.runs.pictures import ahead, draw_modes, draw_run, gas_pictures
from seatfem.study.runs.round import remarks
from seatfem.study.runs.rounds import ANY, SEAT_FILE, Limits, Round, missed, rounds
from seatfem.study.runs.seat_fields import check_stress
from seatfem.study.runs.summary import (
    accuracy_keys,
    greens_error_keys,
    landing_bar_keys,
    landing_records,
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
from seatfem.study.scene import Scene
from seatfem.study.scene.files import check_files

__all__ = ["RunError", "RunOutcome", "compute_greens", "run_scene", "write_modes"]


SUMMARY_FILE: Final = "summary.json"
RESULT_FILE: Final = "result.h5"
GAS_FILE: Final = "gas.csv"


def run_scene(
    scene: Scene,
    folder: Path,
    progress: Progress = silent,
    *,
    tell: Tell = untold,
    limits: Limits = ANY,
    pictures: bool = True,
    plan: Plan | None = None,
    histories: bool = True,
    painter: Painter | None = None,
) -> RunOutcome:
    """Run everything: plan, seat, contact and its spring baseline, measures with their errors, files, then pictures.

    The plan fills what the scene leaves open; the run measures the error left in it, and refines what dominates while
    the target of accuracy is missed. A seat computed before, in ``folder`` or in the store, is used again. The numbers
    of each round are on file before the next begins, marked as not the last, and all of them before the first
    picture; one that cannot be drawn is told, and named in summary.json.

    Args:
        tell: hears of each round what it left and took, and the price of the next.
        limits: number of rounds and time.
        pictures: whether to draw.
        plan: of the scene, where there is one already.
        histories: whether result.h5 is written.
        painter: a process that draws bodies while the run goes on; ``None``: one that is started afterwards.

    Raises:
        OutputError: ``folder`` cannot be written to.
        RunError: a time step that cannot resolve the measures asked for, a striker nothing can stop.
        Also what the stages raise: LevelError, MeshError, MeshingError, ModelError, GreensFunctionError, StorageError.
    """
    start, watch = time.perf_counter(), Stopwatch()
    check_step(scene)
    check_writable(*(folder / name for name in (RESULT_FILE, SUMMARY_FILE, SEAT_FILE, LANDINGS_FILE)))
    with watch("plan"):
        plan = plan or ended_plan(scene)
        if plan is None and painter is not None and scene.seat.elastic is not None:  # the seat is likely to be new
            painter.begin()
        plan = plan or plan_scene(scene, progress=progress, folder=folder)
        check_stress(plan, progress)
    baseline: Baseline | None = None
    for latest in rounds(plan, folder, watch, progress, limits=limits, tell=tell, start=start):
        if painter is not None:
            ahead(scene, latest.plan.method, latest.seat, painter)
        if baseline is None or baseline.beside is not latest.result:  # a round comes again where the next one failed
            baseline = baseline_of(latest, watch)
        summary = _summary(scene, latest, baseline, watch)
        with watch("files"):
            touches, parts = latest.touches, "rings" if latest.touches.line is None else "lip"
            others = {
                parts: touches.parts,
                "stopper": touches.stopper,
                "stopper_lip": touches.stopper_parts,
                "spring_stopper": baseline.touches.stopper,
            }
            all_of_them = {"wave": latest.result, "spring": baseline.result}
            all_of_them |= {name: result for name, result in others.items() if result is not None}
            if histories:
                save_results(folder / RESULT_FILE, all_of_them, {"title": scene.title, "round": latest.number})
            write_json(folder / SUMMARY_FILE, {**summary, **timing_keys(watch, start)})
            gas = () if scene.gas is None else (write_gas(GasRun.of(scene, latest.touches), folder / GAS_FILE),)
            write_landings(folder / LANDINGS_FILE, summary["landings"])
    remember(latest)
    assert baseline is not None

    def keep(keys: Mapping[str, object]) -> None:
        write_json(folder / SUMMARY_FILE, {**summary, **keys, **timing_keys(watch, start)})

    later = afterwards(latest, baseline, folder, watch, progress, tell=tell, histories=histories, keep=keep)
    notes = (*missed(latest), *remarks(latest), *later.notes(latest.plan))
    met = not later.margin_missed(scene) if latest.met else latest.met
    summary |= {**later.keys, "accuracy_met": met, "notes": list(notes)}
    keep({})
    drawn: tuple[Path, ...] = ()
    gaps: tuple[str, ...] = ()
    if pictures:
        with watch("pictures"):  # whatever becomes of them, all numbers are on file
            of_lip = lip_pictures(latest, baseline.touches, summary["landings"])
            drawing = drawing_picture(scene, latest.plan.method.seat.division)
            more = [drawing, *of_lip, *gas_pictures(scene, latest.touches), *later.pictures(latest)]
            results = (latest.result, baseline.result)
            drawn, gaps = draw_run(
                scene,
                latest.plan.method,
                latest.seat,
                *results,
                folder,
                progress,
                more,
                painter,
                summary["landings"],
            )
        summary |= {**timing_keys(watch, start), "pictures_missing": "; ".join(gaps)}
        try:
            write_json(folder / SUMMARY_FILE, summary)
        except OSError as problem:
            gaps = (*gaps, f"{SUMMARY_FILE} does not list the pictures: {problem}")
    tables = (folder / SUMMARY_FILE, folder / LANDINGS_FILE)
    written = (*tables, *((folder / RESULT_FILE,) if histories else ()), folder / SEAT_FILE)
    files = (*written, *gas, *later.files, *drawn)
    summary |= timing_keys(watch, start)
    return RunOutcome(summary, (*notes, *gaps), files, watch.stages, met, plan=latest.plan)


def _summary(scene: Scene, done: Round, baseline: Baseline, watch: Stopwatch) -> dict[str, Any]:
    width, records = scene.run.filter_width, landing_records(done.touches, done.left, done.without_bar)
    measured, bar = _measured(scene, done.touches, done.stress), baseline.stiffness_bar
    return {
        "title": scene.title,
        **measured,
        **{f"spring_{k}": v for k, v in _measured(scene, baseline.touches, baseline.stress).items()},
        **simpler_keys(baseline.simpler, width),
        **({} if done.touches.line is None else {"tilt_deg": math.degrees(scene.contact.tilt)}),
        "spring_wall_time_s": watch.stages["spring baseline"],
        "contact_wall_time_s": watch.stages["contact"],
        **landing_bar_keys(records, measured["landing_number"]),
        **bar_keys(done.left, done.without_bar),
        **spring_bar_keys(baseline.left),
        "landings": records,
        **accuracy_keys(done),
        **plan_keys(done.plan, watch.stages["plan"]),
        "seat_static_stiffness_N_per_m": baseline.stiffness,
        **({} if bar is None else {"error_bar_seat_static_stiffness_N_per_m": bar}),
        **greens_error_keys(done.seat.greens),
        **done.seat.about,
        "seat_reused": done.seat.reused,
        "seat_kind": scene.seat.kind,
        **({} if scene.gas is None else gas_keys(scene, done.touches, GasRun.of(scene, done.touches))),
        **({} if scene.stopper is None else stopper_face_keys(scene.stopper)),
        **valve_spring_keys(scene, done.striker, done.seat.greens, done.touches),
        **reed_keys(scene.reed.kind, done.striker, done.reed),
        **regime_keys(done.striker, as_a_whole(done.seat.greens), done.result),
    }


def write_landings(path: Path, landings: Sequence[Mapping[str, object]]) -> None:
    """Write the records of landings, a column for each of their keys; of none the first ones."""
    heads = list(dict.fromkeys(key for record in landings for key in record)) or ["body", "number", "time_s"]
    write_csv(path, heads, ([record.get(key) for key in heads] for record in landings))


def _measured(scene: Scene, touches: Touches, stress: ReedStress | None) -> dict[str, object]:
    """Return the keys of the seat and of the stopper."""
    width = scene.run.filter_width
    return {**summarise(touches, width, stress, scene.accuracy.landing), **stopper_keys(touches, width)}


def compute_greens(scene: Scene, path: Path, progress: Progress = silent) -> RunOutcome:
    """Compute only the seat's Green's function, as a run of the scene would plan it, and write it to ``path``."""
    watch = Stopwatch()
    check_writable(path)
    with watch("plan"):
        plan = plan_scene(scene, progress=progress)
    seat = seat_of(scene, Cache(path), method=plan.method.seat, watch=watch, progress=progress)
    summary = {
        "seat_static_stiffness_N_per_m": static_stiffness(seat.greens),
        **greens_error_keys(seat.greens),
        **seat.about,
        "seat_reused": seat.reused,
    }
    return RunOutcome(summary, (), (path,), watch.stages)


def write_modes(
    scene: Scene,
    folder: Path,
    progress: Progress = silent,
    *,
    count: int | None = None,
    up_to_hz: float | None = None,
) -> RunOutcome:
    """Compute all modes of the seat [the 20 lowest]; write modes.csv, pictures, an animation, modes.vtu (ParaView)."""
    from seatfem.structures.natural_modes import Wanted  # of no run

    check_writable(folder / "modes.csv")
    watch = Stopwatch()
    check_files(scene)
    natural = scene.seat.natural_modes(Wanted.of(count, up_to_hz), watch, progress)
    if natural is None:
        raise RunError(
            f"seat.kind = {scene.seat.kind!r} has neither finite elements nor matrices to take modes from; use a "
            "geometry (annular, bar, block, cad, ...), mesh or matrices"
        )
    with watch("pictures"):
        files, gaps = draw_modes(natural, folder, progress)
    counted = "as many as inertia counts" if natural.complete else "NOT counted: some may be missing"
    note = f"{len(natural.modes)} modes of {natural.searched}, {natural.dof} unknowns, {counted}"
    summary = {
        "frequencies_hz": [float(f) for f in natural.frequencies_hz],
        "complete": natural.complete,
        "seat_dof": natural.dof,
    }
    return RunOutcome(summary, (note, *gaps), files, watch.stages, modes=natural.modes)
