"""A scene, carried out: seat, contact, spring baseline, measures, error bars, files and pictures."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import impact
from impact.greens import GreensFunction
from impact.progress import Progress, silent
from impact.storage import save_results
from seatfem.runs.budget import KEYS, Budget
from seatfem.runs.contact import RunError, check_length, check_step, peak_stress, run_contact, striker_of, time_step
from seatfem.runs.pictures import draw_modes, draw_run
from seatfem.runs.stopwatch import Stopwatch
from seatfem.runs.summary import greens_error_keys, summarise, write_json
from seatfem.runs.variations import error_budget
from seatfem.scene import Cantilever, Scene
from seatfem.scene.seats import ElasticSeat
from seatfem.seats.kept_seats import seat_of
from seatfem.seats.seat import build_seat

__all__ = ["RunError", "RunOutcome", "compute_greens", "run_scene", "write_modes"]


@dataclass(frozen=True)
class RunOutcome:
    """What a run left: numbers, warnings, files, and the seconds each stage took."""

    summary: Mapping[str, object]
    messages: tuple[str, ...]
    files: tuple[Path, ...]
    stages: Mapping[str, float] = field(default_factory=dict)


def run_scene(scene: Scene, folder: Path, progress: Progress = silent) -> RunOutcome:
    """Everything: seat, contact and its spring baseline, measures, summary.json, result.h5, seat.h5 and pictures.

    A seat computed before, in ``folder`` or in the store, is used again.

    Raises:
        RunError: a time step that cannot resolve the measures asked for, a striker nothing can stop.
        Also what the stages raise: MeshError, MeshingError, ModelError, GreensFunctionError, StorageError.
    """
    start, watch = time.perf_counter(), Stopwatch()
    check_step(scene)
    seat, reused = seat_of(scene, folder / "seat.h5", watch, progress)
    stiffness = _static_stiffness(seat.greens)
    striker = striker_of(scene)
    dt = scene.run.time_step or time_step(scene, striker.greens, seat.greens)
    check_length(scene, dt)
    with watch("contact"):
        result = run_contact(scene, striker, seat.greens, dt, progress)
    with watch("spring baseline"):
        baseline = run_contact(scene, striker, impact.spring(stiffness=stiffness), dt)
    with watch("reed stress"):
        stress = peak_stress(scene, striker, result.force, result.dt)
        spring_stress = peak_stress(scene, striker, baseline.force, baseline.dt)
    with watch("error budget"):
        left = error_budget(scene, seat, striker, result, None if stress is None else stress.value)
    summary: dict[str, object] = {
        "title": scene.title,
        **summarise(result, scene.run.filter_width, stress),
        **{f"spring_{k}": v for k, v in summarise(baseline, scene.run.filter_width, spring_stress).items()},
        "spring_wall_time_s": watch.stages["spring baseline"],
        "contact_wall_time_s": watch.stages["contact"],
        **left.keys(),
        "seat_static_stiffness_N_per_m": stiffness,
        **greens_error_keys(seat.greens),
        **seat.about,
        "seat_reused": reused,
        "regime": impact.regime_card(striker, impact.Body(seat.greens), result),
    }
    with watch("files"):
        save_results(folder / "result.h5", {"wave": result, "spring": baseline}, {"title": scene.title})
    with watch("pictures"):
        pictures, gaps = draw_run(scene, seat, result, baseline, folder, progress)
    summary["wall_time_s"] = time.perf_counter() - start
    summary["stages_s"] = {k: round(v, 3) for k, v in watch.stages.items()}
    write_json(folder / "summary.json", summary)
    advice = (*_assumed_reed(scene), *(str(a) for a in result.advice))
    files = (folder / "summary.json", folder / "result.h5", folder / "seat.h5", *pictures)
    return RunOutcome(summary, _accuracy_note(scene, left) + advice + gaps, files, watch.stages)


def compute_greens(scene: Scene, path: Path, progress: Progress = silent) -> RunOutcome:
    """Only the seat's Green's function, written to ``path``."""
    watch = Stopwatch()
    seat, reused = seat_of(scene, path, watch, progress)
    summary = {
        "seat_static_stiffness_N_per_m": _static_stiffness(seat.greens),
        **greens_error_keys(seat.greens),
        **seat.about,
        "seat_reused": reused,
    }
    return RunOutcome(summary, (), (path,), watch.stages)


def write_modes(scene: Scene, folder: Path, progress: Progress = silent) -> RunOutcome:
    """The seat's modes: modes.csv, pictures, one animation, and modes.vtu for ParaView."""
    watch = Stopwatch()
    if not isinstance(scene.seat, ElasticSeat):
        raise RunError(
            f"seat.kind = {scene.seat.kind!r} has no finite element modes; use annular, bar, block, cad or mesh"
        )
    seat = build_seat(scene, watch, progress, mesh_error=False)
    with watch("pictures"):
        files, gaps = draw_modes(scene, seat, folder, progress)
    frequencies = [] if seat.modes is None else [float(f) for f in seat.modes.frequencies_hz]
    return RunOutcome({"frequencies_hz": frequencies, **seat.about}, gaps, files, watch.stages)


def _static_stiffness(greens: GreensFunction) -> float:
    compliance = float(greens.static_compliance()[0, 0])
    if not np.isfinite(compliance) or compliance <= 0:
        raise RunError(
            "the seat has no static stiffness (it is free to move, or sampled without a rest), so there is no spring "
            "to compare with; hold the seat somewhere"
        )
    return 1.0 / compliance


def _accuracy_note(scene: Scene, left: Budget) -> tuple[str, ...]:
    """What misses the target, by how much, and what to refine."""
    target = scene.accuracy.target
    missed = [name for name in scene.accuracy.measures if left.relative(name) > target]
    remedies = {
        "mesh": "refine seat.mesh",
        "reduction": "raise seat.greens.bandwidth or lower seat.greens.tolerance",
        "time_step": "shorten run.time_step",
        "model": "keep more reed.n_modes",
    }
    return tuple(
        f"{KEYS[name]} has an error bar of {left.relative(name):.2g}, above accuracy.target = {target:g}; most of it "
        f"is the {left.dominant(name).replace('_', ' ')}'s: {remedies.get(left.dominant(name), 'see error_budget')}"
        for name in missed
    )


def _assumed_reed(scene: Scene) -> tuple[str, ...]:
    """What of the reed was not given and taken from the paper's."""
    assumed = [key for key in ("width", "thickness", "material") if key not in scene.reed.model_fields_set]
    if not isinstance(scene.reed, Cantilever) or not assumed:
        return ()
    return (f"not given, taken from the paper's reed: {', '.join(f'reed.{key}' for key in assumed)}",)
