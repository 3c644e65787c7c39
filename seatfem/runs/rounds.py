"""A plan carried out, its error measured, and the plan refined until the target is met or cannot be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import impact
from impact.budget import Budget, Values, safety
from impact.progress import Progress
from impact.result import ImpactResult
from impact.storage import save_greens
from impact.stress import PeakStress
from seatfem.machine.memory import available_memory
from seatfem.planning.filling import replaced
from seatfem.planning.means import LONGEST, MEMORY
from seatfem.planning.options import TOLERANCE
from seatfem.planning.plan import Plan
from seatfem.planning.planner import refine
from seatfem.roads.modes import ConvergenceError
from seatfem.runs.budget import KEYS, SOURCES, Source
from seatfem.runs.contact import MAX_STEPS, check_length, peak_stress, run_contact, striker_of, time_step
from seatfem.runs.stopwatch import Stopwatch
from seatfem.runs.variations import error_budget
from seatfem.scene import ElasticSeat
from seatfem.seats.kept_seats import seat_of
from seatfem.seats.seat import SeatAnswer

MOST_ROUNDS: Final = 4
SEAT_FILE: Final = "seat.h5"
LOOSER: Final = (0.02, 0.05, 0.1)  # tolerances, where none was stated and the one planned cannot be had
FAILURES: Final = (ArithmeticError, MemoryError, OSError, RuntimeError, ValueError)
"""What a finer round may end with and cost no more than itself: all errors of the packages, of the factorizations and
of the disk. What else there is, is a bug."""
BY_PRE_RUNS: Final[tuple[Source, ...]] = ("time_step", "model")
REMEDIES: Final[Mapping[Source, str]] = {
    "mesh": "refine seat.mesh",
    "reduction": "raise seat.greens.bandwidth or lower seat.greens.tolerance",
    "time_step": "shorten run.time_step",
    "model": "keep more reed.n_modes, or a seat.model that leaves less out",
}


@dataclass(frozen=True)
class Round:
    """One plan, carried out.

    Attributes:
        plan: its scene was run.
        seat: its answer, and whether it was there before (``reused``).
        striker: of the run.
        result, stress: what came out, and the reed's peak stress.
        left: the errors in it.
        number: 1, 2, ...
        stopped: why no further round follows; "" where the target is met.
    """

    plan: Plan
    seat: SeatAnswer
    reused: bool
    striker: impact.Body
    result: ImpactResult
    stress: PeakStress | None
    left: Budget
    number: int = 1
    stopped: str = ""

    @property
    def met(self) -> bool:
        """Whether the bar of every measure asked for is within the target."""
        accuracy = self.plan.scene.accuracy
        return all(self.left.relative(name) <= accuracy.target for name in accuracy.measures)


def carry_out(plan: Plan, folder: Path, watch: Stopwatch, progress: Progress) -> Round:
    """Rounds of run, measured error and refinement, until the target is met or nothing more can be done.

    What dominates the error is made finer; keys that the file states are left alone, and no round is begun that would
    take more than `LONGEST` or `MEMORY` by prediction, or more steps than can be stored. Where a finer round fails,
    the one before is the answer, its seat on file again, and ``stopped`` tells why.
    """
    done = _first_round(plan, folder, watch, progress)
    while not done.met:
        further: Plan | None = None
        try:
            further, why = _next(done)
            if further is None:
                return replace(done, stopped=why)
            done = replace(_round(further, folder, watch, progress, done), number=done.number + 1)
        except FAILURES as problem:
            return _stopped_by(problem, done, further, folder)
    return done


def _stopped_by(problem: Exception, done: Round, further: Plan | None, folder: Path) -> Round:
    """The round before, with its own seat on file where the one that failed may have written a finer one."""
    told = str(problem) or ("out of memory" if isinstance(problem, MemoryError) else type(problem).__name__)
    stopped = f"a finer round is not possible: {told}"
    if further is not None and further.scene.seat_key() != done.plan.scene.seat_key():
        try:
            save_greens(done.seat.greens, folder / SEAT_FILE)
        except OSError as unwritten:
            stopped += f"; {SEAT_FILE} may be of the round that failed ({unwritten})"
    return replace(done, stopped=stopped)


def missed(done: Round) -> tuple[str, ...]:
    """What misses the target, by how much, because of what; and why the run stopped short."""
    target = done.plan.scene.accuracy.target
    found = []
    for name in done.plan.scene.accuracy.measures:
        if (bar := done.left.relative(name)) > target:
            source = done.left.dominant(name)
            remedy = next((words for known, words in REMEDIES.items() if known == source), "")
            found.append(
                f"{KEYS[name]} has an error bar of {bar:.2g}, above accuracy.target = {target:g}; most of it is the "
                f"{source.replace('_', ' ')}'s: {remedy}"
            )
    if found and done.stopped:
        found.append(f"stopped short of the target after {done.number} round{'s'[: done.number > 1]}: {done.stopped}")
    return tuple(found)


def _first_round(plan: Plan, folder: Path, watch: Stopwatch, progress: Progress) -> Round:
    """Where no Krylov space holds what was planned: at a looser tolerance, if none is stated; the bar tells."""
    if not any(choice.key == TOLERANCE and not choice.given for choice in plan.choices):
        return _round(plan, folder, watch, progress)
    for tolerance in (t for t in LOOSER if isinstance(plan.scene.seat, ElasticSeat)):
        try:
            return _round(plan, folder, watch, progress)
        except ConvergenceError:
            plan = replace(plan, scene=replaced(plan.scene, {TOLERANCE: tolerance}))
    return _round(plan, folder, watch, progress)


def _round(plan: Plan, folder: Path, watch: Stopwatch, progress: Progress, before: Round | None = None) -> Round:
    """``before``: the round whose seat serves again if nothing of it has become finer."""
    scene = plan.scene
    if before is not None and before.plan.scene.seat_key() == scene.seat_key():
        seat, reused = before.seat, before.reused
    else:
        seat, reused = seat_of(scene, folder / SEAT_FILE, watch, progress)
    striker = striker_of(scene)
    dt = scene.run.time_step or time_step(scene, striker.greens, seat.greens)
    check_length(scene, dt)
    with watch("contact"):
        result = run_contact(scene, striker, seat.greens, dt, progress)
    wanted = "stress" in scene.accuracy.measures
    with watch("reed stress"):
        stress = peak_stress(scene, striker, result.force, result.dt, coarsely=not wanted)
    with watch("error budget"):
        left = error_budget(scene, seat, striker, result, stress.value if wanted and stress is not None else None)
    return Round(plan, seat, reused, striker, result, stress, _at_least_planned(plan, left))


def _at_least_planned(plan: Plan, left: Budget) -> Budget:
    """No less of step and model than the plan's pre-runs say, which also know finer steps, more modes, and waves.

    A change between two steps may be small by accident, and a spring in place of the seat cannot tell of waves.
    """

    def at_least(source: Source, part: Values) -> Values:
        planned = plan.shares.get(source, {})
        return {name: max(value, planned.get(name, 0.0) * abs(left.values[name])) for name, value in part.items()}

    raised: dict[str, Values] = {
        source: at_least(source, left.parts[source]) for source in BY_PRE_RUNS if source in left.parts
    }
    return replace(left, parts={**left.parts, **raised})


def _next(done: Round) -> tuple[Plan | None, str]:
    """The refined plan, or why there is none."""
    if done.number == MOST_ROUNDS:
        return None, f"{MOST_ROUNDS} rounds at most"
    accuracy, left = done.plan.scene.accuracy, done.left
    missing = [name for name in accuracy.measures if left.relative(name) > accuracy.target]
    reasons = []
    for measure in sorted(missing, key=lambda name: -left.relative(name)):
        further, why = _finer_in(done, measure)
        if further is not None:
            return further, ""
        reasons.append(why)
    return None, reasons[0]


def _finer_in(done: Round, measure: str) -> tuple[Plan | None, str]:
    """For the sake of one measure."""
    left = done.left
    allowed = done.plan.scene.accuracy.target * abs(left.values[measure]) / safety(measure)
    if allowed == 0.0:
        return None, f"{KEYS[measure]} is zero, a relative error means nothing"
    stated = []
    for source in sorted((s for s in SOURCES if s in left.parts), key=lambda s: -left.parts[s][measure]):
        share = left.parts[source][measure]
        if share <= 0.2 * allowed:
            break
        plan = refine(done.plan, source, _too_large(left, source, measure, allowed))
        if plan is not None:
            why = _too_much(plan)
            return (None, why) if why else (plan, "")
        stated.append(source.replace("_", " "))
        if share > allowed:  # by itself: nothing else can help
            break
    return None, f"nothing finer is left to choose for the {' and the '.join(stated)} (stated in the file?)"


def _too_large(left: Budget, source: Source, measure: str, allowed: float) -> float:
    """By which factor one source is too large, the others left as they are and a fifth kept in reserve."""
    here = left.parts[source][measure]
    others = sum(part[measure] for part in left.parts.values()) - here
    return here / max(0.8 * allowed - others, 0.2 * allowed)


def _too_much(plan: Plan) -> str:
    """What of a further round would be too much; "" if nothing."""
    cost, there = plan.cost, available_memory()
    if cost.memory > MEMORY * there:
        return f"the next round would take {cost.memory / 1e9:.2g} GB, {there / 1e9:.2g} GB are available"
    if cost.seconds > LONGEST:
        return f"the next round would take about {cost.seconds:.2g} s; state a finer seat.mesh or step to insist"
    dt = plan.scene.run.time_step
    if dt is not None and plan.scene.run.duration / dt > MAX_STEPS:
        return f"the next round would take {plan.scene.run.duration / dt:.2g} steps, at most {MAX_STEPS:.0e} are stored"
    return ""
