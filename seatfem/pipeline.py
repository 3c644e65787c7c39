"""A scene, carried out: seat, contact, spring baseline, measures, files and pictures."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

import impact
from impact import measures
from impact.atomic import whole_file
from impact.closed_form import DelayRod
from impact.damped_rods import DampedFixedRod
from impact.greens import GreensFunction
from impact.modal import ModalGreens
from impact.progress import Progress, silent
from impact.result import ImpactResult
from impact.sampled import SampledGreens
from impact.storage import StorageError, load_greens, save_greens, save_results
from seatfem.pictures import draw_modes, draw_run
from seatfem.scene import Cantilever, GreensFile, Scene
from seatfem.scene.seats import ElasticSeat
from seatfem.seat import SeatAnswer, build_seat, memory
from seatfem.stopwatch import Stopwatch

STEPS_PER_RADIAN = 4  # of the highest frequency kept in either body
STEPS_PER_FILTER = 20
STEPS_PER_TRANSIT = 40  # of a closed-form rod
MAX_STEPS = 20_000_000  # some 4 GB of histories


class RunError(ValueError):
    """A scene that is well formed but cannot be run as asked; the message names key, limit and remedy."""


@dataclass(frozen=True)
class RunOutcome:
    """What a run left: numbers, warnings, files, and the seconds each stage took."""

    summary: Mapping[str, object]
    messages: tuple[str, ...]
    files: tuple[Path, ...]
    stages: Mapping[str, float] = field(default_factory=dict)


def run_scene(scene: Scene, folder: Path, progress: Progress = silent) -> RunOutcome:
    """Everything: seat, contact and its spring baseline, measures, summary.json, result.h5, seat.h5 and pictures.

    A seat.h5 in ``folder`` that was computed for the same seat is used again.

    Raises:
        RunError: a time step that cannot resolve the measures asked for, a striker nothing can stop.
        Also what the stages raise: MeshError, MeshingError, ModelError, GreensFunctionError, StorageError.
    """
    start, watch = time.perf_counter(), Stopwatch()
    _check_step(scene)
    seat, reused = _seat(scene, folder / "seat.h5", watch, progress)
    stiffness = _static_stiffness(seat.greens)
    striker = _striker(scene)
    dt = scene.run.time_step or time_step(scene, striker.greens, seat.greens)
    _check_length(scene, dt)
    with watch("contact"):
        result, wall = _impact(scene, striker, seat.greens, dt, progress)
    with watch("spring baseline"):
        baseline, spring_wall = _impact(scene, striker, impact.spring(stiffness=stiffness), dt, silent)
    summary: dict[str, object] = {
        "title": scene.title,
        **summarise(result, scene.run.filter_width),
        **{f"spring_{k}": v for k, v in summarise(baseline, scene.run.filter_width).items()},
        "spring_wall_time_s": spring_wall,
        "contact_wall_time_s": wall,
        "seat_static_stiffness_N_per_m": stiffness,
        **_error_keys(seat.greens),
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
    _write_json(folder / "summary.json", summary)
    advice = (*_assumed_reed(scene), *(str(a) for a in result.advice))
    files = (folder / "summary.json", folder / "result.h5", folder / "seat.h5", *pictures)
    return RunOutcome(summary, _accuracy_note(scene, seat.greens) + advice + gaps, files, watch.stages)


def compute_greens(scene: Scene, path: Path, progress: Progress = silent) -> RunOutcome:
    """Only the seat's Green's function, written to ``path``."""
    watch = Stopwatch()
    seat, reused = _seat(scene, path, watch, progress)
    summary = {
        "seat_static_stiffness_N_per_m": _static_stiffness(seat.greens),
        **_error_keys(seat.greens),
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


def summarise(result: ImpactResult, filter_width: float) -> dict[str, object]:
    """The flat keys of one contact, units in their names; ``None`` where there was no contact."""
    raw, groups = measures.contact_intervals(result), measures.contact_groups(result)
    touched = len(groups) > 0
    return {
        "peak_force_N": measures.peak_force(result),
        "filtered_peak_force_N": measures.filtered_peak_force(result, filter_width),
        "filter_width_s": filter_width,
        "impulse_Ns": measures.impulse(result),
        "first_contact_s": float(groups[0, 0]) if touched else None,
        "contact_duration_s": float(groups[0, 1] - groups[0, 0]) if touched else None,
        "contact_count": len(groups),
        "contact_count_raw": len(raw),
        "impact_velocity_m_per_s": measures.impact_velocity(result) if touched else None,
        "max_seat_displacement_m": float(np.max(np.abs(result.target_displacement))),
        "energy_residual": result.energy.residual,
        "energy_by_work": ", ".join(result.energy.by_work),
        "contact_loss_J": float(result.energy.contact_loss[-1]),
        "time_step_s": result.dt,
        "history_engine": result.engine,
    }


def time_step(scene: Scene, reed: GreensFunction, seat: GreensFunction) -> float:
    """Step [s]: a quarter radian of the highest frequency kept, a twentieth of the filter, a fortieth of a transit."""
    limits = [scene.run.filter_width / STEPS_PER_FILTER, scene.run.duration / 200]
    for greens in (reed, seat):
        if isinstance(greens, ModalGreens) and len(greens.omega) and greens.omega.max() > 0:
            limits.append(1.0 / (STEPS_PER_RADIAN * float(greens.omega.max())))
        if isinstance(greens, DampedFixedRod):
            limits.append(greens.transit / STEPS_PER_TRANSIT)
        elif isinstance(greens, DelayRod):
            limits.append(greens.round_trip / 2 / STEPS_PER_TRANSIT)
    return min(limits)


def _check_step(scene: Scene) -> None:
    """Refuse a given step that cannot serve, before anything expensive happens."""
    step, width = scene.run.time_step, scene.run.filter_width
    if step is not None:
        _check_length(scene, step)
    if step is not None and 2 * step > width:
        raise RunError(
            f"run.time_step = {step:g} s does not resolve filtered_peak_force_N: at most {width / 2:g} s "
            f"(half of run.filter_width = {width:g} s); use a shorter step or a wider filter"
        )


def _check_length(scene: Scene, dt: float) -> None:
    steps = scene.run.duration / dt
    if steps > MAX_STEPS:
        chosen = "run.time_step" if scene.run.time_step else "the step that both bodies need"
        raise RunError(
            f"run.duration = {scene.run.duration:g} s takes {steps:.2g} steps of {dt:.2g} s ({chosen}), at most "
            f"{MAX_STEPS:.0e} are stored: shorten run.duration, keep fewer modes (reed.n_modes), or give a longer "
            "run.time_step"
        )


def _seat(scene: Scene, path: Path, watch: Stopwatch, progress: Progress) -> tuple[SeatAnswer, bool]:
    """The seat, from ``path`` if that holds the same one, else computed and written there."""
    key = scene.seat_key()
    kept = _kept(path, key, scene)
    if kept is not None:
        return SeatAnswer(kept, about={"seat_model": f"kept in {path.name}"}), True
    answer = build_seat(scene, watch, progress)
    greens = answer.greens
    if isinstance(greens, ModalGreens | SampledGreens):  # a closed form costs nothing to make again
        greens = replace(greens, origin={**greens.origin, "seat_key": key, "valid_for_s": memory(scene)})
    if not (isinstance(scene.seat, GreensFile) and path.resolve() == scene.seat.file):
        save_greens(greens, path)
    return answer, False


def _kept(path: Path, key: str, scene: Scene) -> GreensFunction | None:
    """The Green's function at ``path`` if it belongs to this seat and lasts for this run, else ``None``."""
    try:
        greens = load_greens(path)
    except StorageError:
        return None
    lasts = float(str(greens.provenance.get("valid_for_s", 0.0))) >= memory(scene)
    return greens if greens.provenance.get("seat_key") == key and lasts else None


def _striker(scene: Scene) -> impact.Body:
    reed = scene.reed
    if isinstance(reed, Cantilever):
        return impact.cantilever_reed(
            young=reed.material.young,
            density=reed.material.density,
            length=reed.length,
            width=reed.width,
            thickness=reed.thickness,
            damping_ratio=reed.damping_ratio,
            n_modes=reed.n_modes,
            tip_deflection=reed.release.tip_deflection,
            contact_at=scene.contact.at,
        )
    return impact.rigid_mass(mass=reed.mass, velocity=reed.velocity)


def _impact(
    scene: Scene, striker: impact.Body, greens: GreensFunction, dt: float, progress: Progress
) -> tuple[ImpactResult, float]:
    start = time.perf_counter()
    problem = impact.ContactProblem(striker, impact.Body(greens), gap=scene.contact.gap, law=impact.Signorini())
    result = impact.solve(problem, dt=dt, duration=scene.run.duration, progress=progress)
    return result, time.perf_counter() - start


def _static_stiffness(greens: GreensFunction) -> float:
    compliance = float(greens.static_compliance()[0, 0])
    if not np.isfinite(compliance) or compliance <= 0:
        raise RunError(
            "the seat has no static stiffness (it is free to move, or sampled without a rest), so there is no spring "
            "to compare with; hold the seat somewhere"
        )
    return 1.0 / compliance


def _error_keys(greens: GreensFunction) -> dict[str, object]:
    error = greens.error_estimate
    return {"greens_error_reduction": error.reduction, "greens_error_mesh": error.mesh, "greens_error": error.total}


def _accuracy_note(scene: Scene, greens: GreensFunction) -> tuple[str, ...]:
    error, target = greens.error_estimate.total, scene.accuracy.target
    if error is None or error <= target:
        return ()
    return (
        f"the estimated error of the seat's Green's function is {error:.2g}, above accuracy.target = {target:g}: "
        "refine seat.mesh, or lower seat.greens.tolerance",
    )


def _assumed_reed(scene: Scene) -> tuple[str, ...]:
    """What of the reed was not given and taken from the paper's."""
    assumed = [key for key in ("width", "thickness", "material") if key not in scene.reed.model_fields_set]
    if not isinstance(scene.reed, Cantilever) or not assumed:
        return ()
    return (f"not given, taken from the paper's reed: {', '.join(f'reed.{key}' for key in assumed)}",)


def _write_json(path: Path, data: Mapping[str, object]) -> None:
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(data, indent=2, default=str) + "\n", encoding="utf-8")
