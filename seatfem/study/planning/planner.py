"""Planner: the cheapest model of a scene that meets the required accuracy, its refinement after a run that missed the
target, and the number of rounds to expect."""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import tee
from pathlib import Path
from typing import Final

from impact.notices import Progress, silent
from impact.quantities import in_digits, in_time, percent
from impact.runs.variations import safety, times
from seatfem.machine.compiling import compilation
from seatfem.structures import cache
from seatfem.structures.cache import Store
from seatfem.structures.estimates.surrogate import ERRORS
from seatfem.structures.rings import ACROSS, MOST_PORTS, Division
from seatfem.study.impacts import contact, touches, validity
from seatfem.study.ladders.table import described, ladders
from seatfem.study.method import (
    BAND,
    CONTACT_SIZE,
    MODEL,
    PORTS,
    REED_BAND,
    RINGS,
    SIZE,
    TOLERANCE,
    RunMethod,
    chooses_one_port,
    is_given,
)
from seatfem.study.planning import costs
from seatfem.study.planning.costs import predict_cost
from seatfem.study.planning.deciding import Choices, Decision
from seatfem.study.planning.plan import Alternative, Plan
from seatfem.study.planning.reasons import WORDS, choices_of
from seatfem.study.prerun import context
from seatfem.study.prerun.lips import rings_refused
from seatfem.study.safety import LEAST_FINER, LONGEST, MEMORY, MOST_FINER, MOST_ROUNDS, STEP_UP, source_in_words
from seatfem.study.scene import Scene
from seatfem.study.scene.files import check_files
from seatfem.study.scene.measures import in_words

__all__ = ["plan_scene"]

RUNGS: Final = 10  # values of each key, from the wanted one to finer ones, for which a cached seat is searched


def plan_scene(
    scene: Scene,
    progress: Progress = silent,
    *,
    folder: Path | None = None,
    store: Store | None = None,
    without: tuple[str, ...] = (),
) -> Plan:
    """Return the plan of a scene: a value and a reason for every open key, and predicted cost and errors.

    Args:
        scene: the scene; the keys that it states are kept.
        folder: folder of the run, whose seat may be reused.
        store: cache of seats; default: the user's.
        without: excluded levels of the seat, or `ONE_PORT`, which a run has found too coarse.

    Raises:
        RunError: the stated time step cannot resolve the measures, or there are more steps than can be stored.
        LevelError: the stated level does not describe the seat.
        SceneError: a file cannot be read, or has no such face, group or region.
    """
    start = time.perf_counter()
    contact.check_step(scene)
    check_files(scene)
    target = scene.accuracy.target
    compiling = compilation()  # measured before the pre-runs, which compile
    surrogate = scene.seat.surrogate(scene.run.duration, scene.reed.face)
    progress("planning", 0.1)
    store = Store.default() if store is None else store
    choices = Choices(context.PlanningContext.from_scene(scene, surrogate, progress, without, store))
    wanted = decision = choices.cheapest(target)
    method, at_hand = _nearest_on_file(wanted, folder, store)
    if not at_hand:
        decision = choices.within_means(wanted, target)
        method = decision.method
    contact.check_length(scene, method.time_step or 0.0, method.seat.division.count)
    progress("planning", 0.9)
    planning = max(time.perf_counter() - start - compiling, 0.0)
    cost = predict_cost(scene, method, kept=bool(at_hand), planning=planning)
    plan = Plan(
        scene=scene,
        method=method,
        choices=choices_of(decision, method, at_hand),
        cost=cost.after("compilation", compiling),
        error=decision.error,
        alternatives=_alternatives(choices, decision, compiling, planning),
        shares=decision.shares,
        parts={key: errors for key, errors in decision.changes.items() if key in (PORTS, RINGS)},
        kept=bool(at_hand),
        without=without,
    )
    advice = map(str, validity.validity_advice(scene.geometry, scene.run.filter_width))
    return replace(plan, notes=(*_notes(plan, wanted, decision), *advice))


def _alternatives(choices: Choices, decision: Decision, compiling: float, planning: float) -> tuple[Alternative, ...]:
    """Return the plans for targets looser and tighter by `STEP_UP`."""
    seen, alternatives = choices.context, []
    for target in (STEP_UP * seen.scene.accuracy.target, seen.scene.accuracy.target / STEP_UP):
        if target < 1:
            other = choices.cheapest(target)
            if other.method != decision.method:
                cost = predict_cost(seen.scene, other.method, planning=planning)
                cost = cost.after("compilation", compiling)
                alternatives.append(Alternative(f"accuracy.target = {percent(target)}", cost, other.error))
    return tuple(alternatives)


def _nearest_on_file(decision: Decision, folder: Path | None, store: Store) -> tuple[RunMethod, str]:
    """Return the method with the nearest cached seat at least as fine as wanted, and its place in words, else ""."""
    seen = decision.context
    if decision.seat.elements is None or seen.patch is None:
        return decision.method, ""
    file = None if folder is None else folder / "seat.h5"
    on_file = cache.key_at(file) if file is not None and file.is_file() else ""
    if not (on_file or _holds_any(store.folder)):
        return decision.method, ""
    (methods, same), duration = tee(_methods_as_fine(decision)), seen.scene.run.duration
    for method, key in zip(methods, cache.keys_of(seen.scene.seat, (each.seat for each in same)), strict=True):
        if file is not None and on_file == key and cache.load_cached(file, key, duration) is not None:
            return method, f"in {file.name}"
        if cache.load_cached(store.path(key), key, duration) is not None:
            return method, "in the store"
    return decision.method, ""


def _methods_as_fine(decision: Decision) -> Iterator[RunMethod]:
    """Yield methods with a seat at least as fine as wanted in band, mesh and tolerance, the nearest first."""
    seen, seat, elements = decision.context, decision.seat.seat, decision.seat.elements
    band, mesh, tolerance = seat.bandwidth or 0.0, 0.0 if elements is None else elements.error, seat.tolerance
    bands = () if is_given(seen.scene, BAND) else context.BANDS
    tolerances = () if is_given(seen.scene, TOLERANCE) else context.TOLERANCES
    for wider in _nearest(band, [b for b in bands if b > band]):
        for denser in _nearest(mesh, [e for e in ERRORS if e < mesh] if seen.drawn else []):
            for stricter in _nearest(tolerance, [t for t in tolerances if t < tolerance]):
                finer = seen.elements(wider, stricter, denser)
                yield decision.with_seat(replace(finer, level=seat.level, rings=seat.rings))


def _nearest(wanted: float, finer: Sequence[float]) -> list[float]:
    return sorted({wanted, *finer}, key=lambda value: abs(value - wanted))[:RUNGS]


def _holds_any(folder: Path) -> bool:
    try:
        return any(folder.glob("*.h5"))
    except OSError:  # the folder is not readable
        return False


def _notes(plan: Plan, wanted: Decision, decision: Decision) -> tuple[str, ...]:
    """Return notes for the reader of a plan: targets out of reach, errors that are unknown, runs without contact."""
    notes, seen = [], decision.context
    target, surrogate = plan.scene.accuracy.target, seen.surrogate
    if wanted.seat != decision.seat:
        cost = predict_cost(plan.scene, wanted.method)
        meets = all(error <= target for error in wanted.error.values())
        aim = "accuracy.target" if meets else "to come as close as possible to accuracy.target"
        notes.append(
            f"{aim} = {percent(target)} would take {in_time(cost.seconds)} and {in_digits(cost.memory / 1e9, 2)} GB; "
            f"this is what {in_time(LONGEST)} and {percent(MEMORY)} of the available memory allow. To "
            "compute it nevertheless state seat.mesh.size"
        )
    missed = {name: error for name, error in plan.error.items() if error > target}
    if missed:
        words = ", ".join(f"{in_words(name)} {percent(error)}" for name, error in missed.items())
        notes.append(f"accuracy.target = {percent(target)} will be missed, predicted: {words}")
    if surrogate.patch is None and not surrogate.exact:
        notes.append(f"{surrogate.words}: this plan is rough; the run measures its errors")
    seat = plan.scene.seat
    if context.leaves_open(seat, plan.method.given) and surrogate.patch is not None and surrogate.band is None:
        notes.append(
            f"this plan rests on an estimate of the seat ({surrogate.words}): a coarse model of it takes longer than a "
            "plan may, has no modes, or cannot be made"
        )
    if seat.elastic is not None and seat.drawn is None:
        notes.append(
            f"the error of the mesh in {seat.files()[0].name} is not known and not part of the uncertainty; "
            "compare with a finer mesh of the seat"
        )
    scene = plan.scene
    notes.extend(validity.stopper_notes(scene.stopper))
    notes.extend(validity.dishing_notes(scene.reed, scene.seat, scene.load, scene.run.duration))
    notes.extend(validity.covered_notes(scene.geometry))
    notes.extend(validity.one_way_notes(scene))
    if seen.band is not None:
        notes.append("mesh error of the reed: known after the run")
    elif plan.scene.reed.traits.is_solved:
        notes.append(
            "errors of the reed's mesh, reduction and model, which are as [reed] states them: known after the run"
        )
    for model, changes in seen.simpler.items():
        if model == validity.ONE_PORT and not is_given(plan.scene, PORTS):  # the plan has decided on it
            continue
        errors = {name: safety(name) * changes[name] for name in plan.scene.accuracy.judged if name in changes}
        if len(errors) == len(plan.scene.accuracy.judged) and max(errors.values()) <= target:
            name = max(errors, key=lambda measure: errors[measure])
            notes.append(
                f"{WORDS[model]} would be enough: {percent(errors[name])} of {in_words(name)}, safety factor included"
            )
    if not seen.sensitivity.bench.window.touches:
        notes.append("a quick trial run saw no contact: the measures are zero unless run.duration is longer")
    elif surrogate.patch is not None:
        notes.extend(_hardly_counts(decision, target))
    return tuple(notes)


def _hardly_counts(decision: Decision, target: float) -> tuple[str, ...]:
    """Return a note if even a spring of roughly guessed stiffness meets the target."""
    seen = decision.context
    guessed = {name: safety(name) * seen.sensitivity.guessed[name] for name in seen.scene.accuracy.judged}
    if max(guessed.values(), default=0.0) > target:
        return ()
    name = max(guessed, key=lambda measure: guessed[measure])
    return (
        f"for this target the seat hardly matters: a spring (seat.kind = 'spring') with a stiffness wrong by a factor "
        f"of two would change {in_words(name)} by {percent(guessed[name])}",
    )


LEAST_WIDER: Final = 1.1  # least factor by which the band of a plate is widened
AGAIN: Final = (*costs.OF_THE_SEAT, "contact", "reed stress", "error budget")
"""Stages that every round repeats; the others happen once a run."""


def refine(plan: Plan, source: str, factor: float = 2.0) -> Plan | None:
    """Return ``plan`` refined such that the error of one ``source`` shrinks by about ``factor``.

    A simpler level (spring, rod) is replaced by the next one, and one contact point by arcs; otherwise the keys of the
    source get finer values.

    Args:
        plan: plan whose run missed the target.
        source: source of error: mesh, reduction, time_step, model, patch, striker or lip.
        factor: ratio of its error to the allowed one, clipped to `LEAST_FINER` ... `MOST_FINER`.

    Returns:
        ``None`` if the file states the keys of the source, or there are none.
    """
    if source in (touches.LIP, "patch") and chooses_one_port(plan.scene.contact, plan.method):
        return plan_scene(plan.scene, without=(*plan.without, validity.ONE_PORT))
    if source == "model" and plan.level in ("spring", "rod") and not plan.is_given(MODEL):
        return plan_scene(plan.scene, without=(*plan.without, plan.level))
    return _finer_keys(plan, source, factor)


def _finer_keys(plan: Plan, source: str, factor: float) -> Plan | None:
    """Return ``plan`` with finer values of the keys of ``source``; ``None`` if all are stated or at their limit."""
    factor = min(max(factor, LEAST_FINER), MOST_FINER)
    values = {
        ladder.key: finer
        for ladder in ladders()
        if ladder.source == source and plan.is_open(ladder.key) and (value := plan.method.value(ladder.key))
        if not (ladder.key == RINGS and plan.method.ports is not None)
        if (finer := ladder.finer(value, factor, plan.scene.run, plan.scene.reed)) is not None
    }
    if values.get(REED_BAND, math.inf) < LEAST_WIDER * (plan.method.reed.bandwidth or 0.0):
        return None
    if PORTS in values or (source == "patch" and plan.method.seat.in_arcs):
        return _in_more_parts(plan, factor)
    if BAND in values and plan.method.ports is not None:  # solved by modes: those of a wider band are shorter waves
        narrower = (plan.method.seat.bandwidth or 0.0) / values[BAND]
        values |= {
            key: float(f"{narrower * plan.method.value(key):.2g}")
            for key in (SIZE, CONTACT_SIZE)
            if plan.is_open(key) and plan.method.value(key)
        }
    if CONTACT_SIZE not in values and SIZE in values:
        values[SIZE] = max(values[SIZE], plan.method.seat.contact_size or 0.0)
    method = plan.method.replaced(values)
    if method == plan.method:
        return None
    reason = f"made finer: the error from {source_in_words(source)} was {in_digits(factor, 2)} times too large"
    choices = tuple(
        replace(choice, value=described(choice.key, values[choice.key]), reason=reason)
        if choice.key in values
        else choice
        for choice in plan.choices
    )
    shares = {
        s: {name: value / (factor if s == source else 1.0) for name, value in share.items()}
        for s, share in plan.shares.items()
    }
    whole = {name: sum(share.get(name, 0.0) for share in plan.shares.values()) for name in plan.error}
    reduced = {name: sum(share.get(name, 0.0) for share in shares.values()) for name in plan.error}
    error = {name: bar * reduced[name] / whole[name] if whole[name] else bar for name, bar in plan.error.items()}
    same_seat = source in ("time_step", "model")  # the seat of the round before is reused
    cost = costs.predict_cost(plan.scene, method, kept=same_seat)
    return replace(plan, method=method, choices=choices, shares=shares, error=error, cost=cost, kept=same_seat)


def _in_more_parts(plan: Plan, factor: float) -> Plan | None:
    """Return ``plan`` with more rings across the arcs of the lip, or twice as many arcs, whichever has the larger
    predicted error; ``None`` if its number is stated or at its limit."""
    division, measures = plan.method.seat.division, plan.scene.accuracy.judged
    more = {PORTS: Division(2 * division.arcs, division.rings)}
    if division.arcs > 1 and not rings_refused(plan.scene.seat, plan.scene.life):
        rings = next((number for number in ACROSS if number > division.rings), None)
        more |= {} if rings is None else {RINGS: Division(division.arcs, rings)}

    def error_by(key: str) -> float:
        return max((safety(name) * plan.parts.get(key, {}).get(name, 0.0) for name in measures), default=0.0)

    open_keys = [key for key, division in more.items() if plan.is_open(key) and division.count <= MOST_PORTS]
    key = max((PORTS, RINGS), key=error_by) if plan.parts else next(iter(open_keys), PORTS)
    if key not in open_keys:
        return None
    method = plan.method.along(plan.scene.geometry, more[key].arcs, more[key].rings)
    reason = f"made finer: the error from the contact face was {in_digits(factor, 2)} times too large"
    choices = tuple(
        replace(choice, value=described(key, method.value(key)), reason=reason) if choice.key == key else choice
        for choice in plan.choices
    )
    smaller = 0.5 if key == PORTS else (division.rings / more[key].rings) ** 2
    parts = {**plan.parts, key: times(smaller, plan.parts[key])} if key in plan.parts else plan.parts
    patch = times(0.5, plan.shares.get("patch", {}))
    if key in plan.parts:
        gain = {name: (1 - smaller) * value for name, value in plan.parts[key].items()}
        patch = {name: max(value - gain.get(name, 0.0), 0.0) for name, value in plan.shares["patch"].items()}
    cost = costs.predict_cost(plan.scene, method)
    shares = {**plan.shares, "patch": patch}
    return replace(plan, method=method, choices=choices, shares=shares, parts=parts, cost=cost, kept=False)


@dataclass(frozen=True)
class RoundsAhead:
    """Attributes:
    number: expected number of rounds.
    seconds: predicted wall time of the run with all of these rounds [s].
    further: predicted wall time of one more round [s]; ``None`` if nothing can be refined."""

    number: int
    seconds: float
    further: float | None


def rounds_ahead(plan: Plan) -> RoundsAhead:
    """Return the rounds expected: one if the predicted error meets the target, else as needed or allowed."""
    number, seconds, further = 1, plan.cost.seconds, _next(plan)
    while not plan.meets_target and further is not None and number < MOST_ROUNDS and _again(further) <= LONGEST:
        plan, number, seconds = further, number + 1, seconds + _again(further)
        further = _next(plan)
    return RoundsAhead(number, seconds, None if further is None else _again(further))


def _next(plan: Plan) -> Plan | None:
    """Return ``plan`` with the largest source of the largest error refined that can be; ``None`` if a source that
    cannot exceeds the target by itself."""
    worst = max(plan.error, key=lambda name: plan.error[name], default=None)
    if worst is None:
        return None
    contributions = {source: safety(worst) * share.get(worst, 0.0) for source, share in plan.shares.items()}
    order = sorted(contributions, key=lambda source: -contributions[source])
    finer = {source: _finer_keys(plan, source, LEAST_FINER) for source in order}
    if any(finer[source] is None and contributions[source] > plan.scene.accuracy.target for source in order):
        return None
    return next((option for option in finer.values() if option is not None), None)


def _again(plan: Plan) -> float:
    return sum(seconds for stage, seconds in plan.cost.parts.items() if stage in AGAIN)
