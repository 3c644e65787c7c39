"""The flat keys of summary.json, units in their names."""

import json
import math
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, get_args

import numpy as np
from numpy.typing import NDArray

from impact import measures
from impact.after.histories import UNKNOWN_STRESS, PeakStress, ReedStress, line_force_peak, line_impulse_peak
from impact.after.landings import Landing
from impact.after.regime import describe, regime
from impact.after.result import ImpactResult
from impact.bodies.body import Body
from impact.files.safe_files import whole_file
from impact.greens.base import Array, GreensFunction
from impact.quantities import finite_or_none
from impact.runs.variations import Budget
from seatfem.machine.resources import Stopwatch, peak_memory
from seatfem.readings import BAR
from seatfem.results import REED_STRESS, REED_STRESS_AFTER
from seatfem.structures import method, rings
from seatfem.study.impacts.landings import Face, Landings
from seatfem.study.impacts.touches import OF_A_LANDING, Touches, is_of_a_landing, landing_name, measured, stopper_values
from seatfem.study.plan import Plan
from seatfem.study.runs.round import Round
from seatfem.study.scene.contact import Stopper
from seatfem.study.scene.measures import FIRST, HARDEST, LandingChoice, Line, all_measures, key_of

JUDGED: Final[Mapping[str, str]] = {
    "filtered_peak_force_N": HARDEST + "filtered_peak",
    "excess_peak_force_N": HARDEST + "filtered_peak",
    "impulse_Ns": HARDEST + "impulse",
    "duration_s": HARDEST + "contact_duration",
    "restitution": HARDEST + "restitution",
}
"""Keys of the hardest landing, and the measures whose values they are."""
FREQUENCIES: Final = 10  # most natural frequencies of the striker in summary.json


def summarise(
    touches: Touches,
    filter_width: float,
    stress: ReedStress = UNKNOWN_STRESS,
    asked: LandingChoice = "hardest",
    *,
    driven: bool = False,
    filmed: bool = False,
) -> dict[str, object]:
    """Return the keys of the contact with the seat, those of its film if it is ``filmed``; values are ``None`` without
    contact, or for stress in a rigid mass.

    The restitution of a free striker follows from its impulses, unless a stopper threw it back, or it is ``driven``:
    loads or moving bases change its speed between contacts.
    """
    result, stopper, energy = touches.seat, touches.stopper, touches.seat.rows.energy
    raw, groups = measures.contact_intervals(result), measures.contact_groups(result)
    number, (start, end) = measures.hardest_group(result, filter_width)
    film: dict[str, object] = {}
    if filmed:
        film = {
            "film_force_peak_N": measures.film_force_peak(result),
            "stiction_force_peak_N": measures.stiction_force_peak(result),
            "film_loss_J": float(energy.film_loss[-1]),
        }
    touched = len(groups) > 0
    thrown_back = stopper is not None and bool(np.any(stopper.force))
    values = measured(touches, filter_width, stress, asked)
    restitution = None if thrown_back else values.get("restitution") if driven else _restitution(result)
    shown = {name: each for name, each in all_measures().items() if not each.judged_by}
    keys = {each.key: values.get(name) for name, each in shown.items() if name in values or not each.of_some}
    return (
        keys
        | landing_keys(touches.landings, values)
        | {
            "peak_force_N": measures.peak_force(result),
            "filtered_peak_force_N": measures.filtered_peak_force(result, filter_width),
            "filter_width_s": filter_width,
            "impulse_Ns": measures.impulse(result),
            "first_contact_s": _first_contact(touches, groups),
            "contact_duration_s": values["contact_duration"] if touched else None,
            **({"contact_cut_off": True} if measures.first_is_cut(result) else {}),
            "contact_count": len(groups),
            "contact_count_raw": len(raw),
            "restitution": _restitution(result) if math.isinf(result.striker_mass) else restitution,
            "peak_time_s": finite_or_none(measures.peak_time(result, filter_width)),
            "hardest_blow": None if math.isnan(start) else number + 1,
            "hardest_blow_start_s": finite_or_none(float(start)),
            "hardest_blow_duration_s": finite_or_none(float(end - start)),
            "hardest_blow_restitution": None if math.isfinite(result.striker_mass) else _restitution(result, number),
            "impact_velocity_m_per_s": finite_or_none(measures.impact_velocity(result)),
            "max_seat_displacement_m": float(np.max(np.abs(result.rows.make_displacement("target")))),
            **reed_stress_keys(stress),
            "energy_residual": energy.residual,
            "energy_by_work": ", ".join(energy.by_work),
            "contact_loss_J": float(energy.contact_loss[-1]),
            **film,
            "time_step_s": result.dt,
            "history_engine": result.engine,
            **_line_keys(touches, filter_width),
        }
    )


def _first_contact(touches: Touches, groups: Array) -> float | None:
    """Return the time of the first contact [s], that of a landing to a part of a step; ``None`` without contact."""
    if not len(groups):
        return None
    start = float(groups[0, 0])
    return next((each.touch for each in touches.landings.seat if abs(each.start - start) < touches.seat.dt / 2), start)


def landing_keys(landings: Landings, values: Mapping[str, float]) -> dict[str, object]:
    """Return the keys of the hardest landing on the seat, and of the first where its measures are among ``values``."""
    hard = landings.hardest
    of_hardest = {f"landing_{key}": hard and getattr(hard, field) for field, key in OF_A_LANDING.items()}
    of_measures = {
        key_of(prefix + name): values.get(prefix + name)
        for name, each in all_measures().items()
        for prefix in (HARDEST, FIRST)
        if each.landing_key and (prefix == HARDEST or prefix + name in values)
    }
    return {
        "landing_status": landings.status,
        "landing_count": len(landings.seat),
        "landing_number": None if hard is None else landings.seat.index(hard) + 1,
        **of_hardest,
        "landing_static_load_N": hard and hard.static_load,
        **of_measures,
        "pressed_on_time_s": landings.pressed_time,
        "pressed_on_largest_load_N": landings.pressed_load,
    }


def landing_records(touches: Touches, budget: Budget) -> list[dict[str, object]]:
    """Return records of all landings on seat and stopper in the order of time, with error bars.

    The place of a landing is the middle of the part of the seat's lip that touched first, and ``None`` without a lip.
    """
    records = [
        _landing_record(touches, face, number, landing, budget)
        for face in get_args(Face)
        for number, landing in enumerate(touches.landings.on(face))
    ]
    return sorted(records, key=lambda record: record["time_s"])  # type: ignore[arg-type, return-value]


def _landing_record(touches: Touches, face: Face, number: int, landing: Landing, budget: Budget) -> dict[str, object]:
    names = {key: landing_name(face, number, key) for key in OF_A_LANDING.values()}
    bars = {key: budget.bar(name) if name in budget.values else math.inf for key, name in names.items()}
    if face == "seat" and landing is touches.landings.hardest:
        for key, measure in JUDGED.items():  # their error bars include half the time step and jumps
            if measure in budget.values:
                bars[key] = max(bars[key], budget.bar(measure))
    place = (math.nan, math.nan)
    on_land: dict[str, object] = {}
    line, parts = touches.line, touches.parts
    if face == "seat" and line is not None and parts is not None:
        arc = landing.part * line.force.shape[1] // parts.rows.force.shape[1]
        place, on_land = _place(line, arc), _land_keys(line, arc)
    return {
        "body": face,
        "number": number + 1,
        **{key: getattr(landing, field) for field, key in OF_A_LANDING.items()},
        "static_load_N": landing.static_load,
        "peak_time_s": landing.peak_time,
        "place_deg": finite_or_none(place[0]),
        "place_m": finite_or_none(place[1]),
        **on_land,
        "pressed_on": landing.pressed_on,
        "cut_off": landing.cut_off,
        **{f"error_bar_{key}": finite_or_none(bar) for key, bar in bars.items()},
    }


def _land_keys(line: Line, arc: int) -> dict[str, object]:
    """Return the land of an arc, and the angle of its middle about that land's own centre; none on a single land."""
    name, angle = line.land_of(arc)
    return {"land": name, "land_deg": finite_or_none(angle)} if name else {}


def landing_bar_keys(records: Sequence[Mapping[str, object]], number: object) -> dict[str, object]:
    """Return the error bars of the hardest landing, whose ``number`` is given, from its record."""
    hard = next((each for each in records if each["body"] == "seat" and each["number"] == number), {})
    return {f"error_bar_landing_{key}": hard.get(f"error_bar_{key}") for key in OF_A_LANDING.values()}


def spring_bar_keys(budget: Budget) -> dict[str, object]:
    """Return error_bar_spring_KEY of each measure of the baseline whose errors were computed."""
    names = [name for name in budget.values if not is_of_a_landing(name)]
    return {f"error_bar_spring_{key_of(name)}": finite_or_none(budget.bar(name)) for name in names}


def _place(line: Line, arc: int) -> tuple[float, float]:
    """Return the angle [deg] and the arc length along the line [m] of the middle of an arc of a lip."""
    middle = float(np.cumsum(line.lengths)[arc] - line.lengths[arc] / 2)
    return line.degrees_at(middle / float(line.lengths.sum())), middle


def _line_keys(touches: Touches, width: float) -> dict[str, object]:
    """Return the keys of a contact along a lip: its arcs, the averaging length and time, and the places of the first
    touch and of the largest force and impulse per length, as angle and arc length from the start of the first arc."""
    if (line := touches.line) is None:
        return {}
    is_pressed = line.force - line.film > 0
    force, times = line.force[1:], line.grid.time
    places = {
        "line_force_peak": line_force_peak(force, times, width, line.length, line.share, line.pieces)[1],
        "line_impulse_peak": line_impulse_peak(force, times, line.length, line.share, line.pieces)[1],
    }
    length, keys, is_touched = float(line.lengths.sum()), dict[str, object](), bool(is_pressed.any())
    ends = np.cumsum(line.lengths)
    for name, place in places.items():
        arc = int(np.searchsorted(ends[:-1], place * length, side="right"))
        keys |= {f"{name}_{key}": value for key, value in _land_keys(line, arc).items() if is_touched}
        keys[f"{name}_at_deg"] = finite_or_none(line.degrees_at(place)) if is_touched else None
        keys[f"{name}_at_m"] = place * length if is_touched else None
    arcs_first = _first_arcs(touches, line, is_pressed)
    first = [_place(line, arc) for arc in arcs_first]
    lowest = min(first, key=lambda each: each[1] if math.isnan(each[0]) else each[0], default=(math.nan, math.nan))
    return keys | {
        "ports": line.force.shape[1],
        "lip_length_m": length,
        "line_force_arc_m": line.share * length,
        "line_force_width_s": width,
        "first_touch_at_deg": finite_or_none(lowest[0]),
        "first_touch_at_m": finite_or_none(lowest[1]),
        "first_touch_segments": len(first),
        **{f"first_touch_{key}": value for key, value in _land_keys(line, arcs_first[0] if arcs_first else 0).items()},
        "largest_share_of_lip_pressed": float(is_pressed.mean(axis=1).max()),
    }


def _first_arcs(touches: Touches, line: Line, is_pressed: NDArray[np.bool_]) -> list[int]:
    """Return the arcs that touch first at once: to a part of a step where a landing begins so, else in one step."""
    if not is_pressed.any():
        return []
    row = int(np.argmax(is_pressed.any(axis=1)))
    landings = touches.landings.seat
    begun = line.grid.time[max(row - 1, 0)]
    parts = None if touches.parts is None else touches.parts.rows.force.shape[1]
    if landings and parts and math.isclose(landings[0].start, begun, abs_tol=line.grid.dt / 2):
        return sorted({part * line.force.shape[1] // parts for part in landings[0].first_parts})
    return [int(arc) for arc in np.flatnonzero(is_pressed[row])]


def stopper_keys(touches: Touches, filter_width: float) -> dict[str, object]:
    """Return the keys of the stopper's contact, if there is one. ``stopper_peak_force_N`` is raw, of a single step."""
    if (result := touches.stopper) is None:
        return {}
    groups = measures.contact_groups(result)
    return {
        "stopper_landing_count": len(touches.landings.stopper),
        "stopper_peak_force_N": measures.peak_force(result),
        **stopper_values(result.force, result.dt, filter_width),
        "stopper_first_contact_s": float(groups[0, 0]) if len(groups) else None,
        "stopper_contact_count": len(groups),
    }


def stopper_face_keys(stopper: Stopper) -> dict[str, object]:
    """Return the kind of the stopper, its shape if it is curved and, if its face is divided, the number of arcs and the
    tilt."""
    keys: dict[str, object] = {"stopper_kind": stopper.body.kind}
    if stopper.profile is not None:
        keys["stopper_shape"] = "curved retainer"
    if stopper.parts == rings.Division():
        return keys
    return keys | {"stopper_arcs": stopper.parts.arcs, "stopper_tilt_deg": math.degrees(stopper.tilt)}


def _restitution(result: ImpactResult, group: int = 0) -> float | None:
    """Return the restitution of a contact; ``None`` if undefined: no contact, one that has not ended, no approach."""
    try:
        value = measures.restitution(result, group=group)
    except measures.MeasureError:
        return None
    return finite_or_none(value)


def regime_keys(striker: Body, seat: GreensFunction, result: ImpactResult) -> dict[str, object]:
    """Return the regime of the impact, in one line and in numbers; ``None`` for a number without meaning."""
    numbers = regime(striker, Body(seat), result)
    return {"regime": describe(numbers)} | {
        f"regime_{name}": finite_or_none(value)
        for name, value in (
            ("mass_ratio", numbers.mass_ratio),
            ("round_trips_per_contact", numbers.round_trips_per_contact),
            ("zener_lambda", numbers.zener_lambda),
            ("predicted_peak_error", numbers.predicted_peak_error),
        )
    }


def largest_stress_bar(summary: Mapping[str, object]) -> dict[str, object]:
    """Return the error bar of the largest stress in the reed where that is the one after the first contact."""
    largest, after, bar = (summary.get(key) for key in (REED_STRESS, REED_STRESS_AFTER, f"{BAR}{REED_STRESS_AFTER}"))
    return {f"{BAR}{REED_STRESS}": bar} if bar is not None and largest == after else {}


def reed_stress_keys(stress: ReedStress) -> dict[str, object]:
    """Return the largest stress in the reed: in all, before and after the first touch, at t = 0, and before the judged
    landing; ``None`` where it is unknown."""
    return {
        **_stress_keys("peak_reed_stress", stress.largest),
        **_stress_keys("peak_reed_stress_after_contact", stress.after_contact),
        **_stress_keys("initial_reed_stress", stress.initial),
        "reed_stress_at_start_Pa": finite_or_none(stress.at_start.value),
        "reed_stress_before_landing_Pa": finite_or_none(stress.before_landing.value),
    }


def front_of(result: ImpactResult, young: float, density: float) -> float:
    """Return rho c_0 v [Pa], c_0^2 = E/rho, v the closing speed of the first touch; nan if that is 0 or unknown."""
    return math.sqrt(young * density) * abs(measures.impact_velocity(result)) or math.nan


def _stress_keys(name: str, peak: PeakStress) -> dict[str, object]:
    value, at, time_of = map(finite_or_none, (peak.value, peak.at, peak.time))
    return {f"{name}_Pa": value, f"{name}_at_m": at, f"{name}_time_s": time_of}


def greens_error_keys(greens: GreensFunction) -> dict[str, object]:
    """Return the stated error of the seat's Green's function."""
    error = greens.error_estimate
    return {"greens_error_reduction": error.reduction, "greens_error_mesh": error.mesh, "greens_error": error.total}


def reed_keys(kind: str, striker: Body, reed: method.Solved | None) -> dict[str, object]:
    """Return the kind of the striker and its lowest natural frequencies (no Ritz values); for a reed that was solved,
    also whether it came from the cache, and the error estimates of its Green's function."""
    modal = striker.greens.modal if reed is None or reed.greens.provenance.get("method") == "modes" else None
    lowest = [] if modal is None else [float(f) for f in modal.frequencies_hz if f > 0][:FREQUENCIES]
    known: dict[str, object] = {"reed_kind": kind, **({"reed_frequencies_Hz": lowest} if lowest else {})}
    if reed is None:
        return known
    errors = {f"reed_{key}": value for key, value in greens_error_keys(reed.greens).items()}
    return {**known, "reed_reused": reed.reused, **errors, "reed_level_error": reed.level_error}


def accuracy_keys(done: Round) -> dict[str, object]:
    """Return the target, whether it was met, and in how many rounds."""
    accuracy = done.plan.scene.accuracy
    return {
        "accuracy_target": accuracy.target,
        "accuracy_measures": ", ".join(accuracy.measures),
        "accuracy_landing": accuracy.landing,
        "accuracy_judged_keys": ", ".join(map(key_of, accuracy.judged)),
        "accuracy_met": done.met,
        "accuracy_rounds": done.number,
        "accuracy_round_time_s": sum(done.spent.values()),
        "accuracy_stopped_because": done.stopped,
    }


def plan_keys(plan: Plan, seconds: float) -> dict[str, object]:
    """Return every choice of the plan of the last round; ``seconds``: wall time before the first round [s]."""
    return {
        "plan_wall_time_s": seconds,
        "plan_seat_level": plan.level,
        **{f"plan_{choice.key.replace('.', '_')}": choice.value for choice in plan.choices},
        "plan_given": ", ".join(choice.key for choice in plan.choices if choice.given),
    }


def timing_keys(watch: Stopwatch, start: float) -> dict[str, object]:
    """Return the time [s] since ``start`` (`time.perf_counter`), that of each stage, and the peak memory so far."""
    return {
        "peak_memory_bytes": finite_or_none(peak_memory()),
        "wall_time_s": time.perf_counter() - start,
        "stages_s": {stage: round(spent, 3) for stage, spent in watch.stages.items()},
    }


def write_json(path: Path, data: Mapping[str, object]) -> None:
    """Write a JSON file, whole or not at all."""
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(data, indent=2, default=str) + "\n", encoding="utf-8")
