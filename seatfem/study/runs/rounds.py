"""The rounds of a run: a plan is computed, its error estimated, and the plan refined, until the target is met or no
further refinement is possible."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

from impact.after.histories import UNKNOWN_STRESS
from impact.notices import ROUND, Progress, SeatfemError, Tell, ignore, silent
from impact.quantities import in_time
from impact.runs.variations import Budget, combined
from seatfem.jobs.folders import private_folder
from seatfem.machine.resources import Stopwatch, available_memory, forget_peak, peak_memory
from seatfem.structures.cache import Cache, build, key_of
from seatfem.structures.mesh.gmsh_process import gmsh_session
from seatfem.structures.reduction import lip_modes, modes
from seatfem.study.error_budget import error_budget
from seatfem.study.impacts import contact
from seatfem.study.impacts.bodies import solve_body, stopper_of, striker_of
from seatfem.study.impacts.contact import run_contacts
from seatfem.study.impacts.touches import STRIKER
from seatfem.study.ladders.mesh import TOLERANCES
from seatfem.study.method import BAND, TOLERANCE
from seatfem.study.plan import Plan
from seatfem.study.runs import reed_stress
from seatfem.study.runs.converge import attempts, limit_band, with_measured_errors
from seatfem.study.runs.kept import cached_numbers
from seatfem.study.runs.next_round import Limits, expect_time, next_plan
from seatfem.study.runs.round import UNFINISHED, Round, describe_round
from seatfem.study.safety import FAILURES
from seatfem.study.scene.measures import Stress, any_needs, asked_name

NO_LIMITS: Final = Limits()
SEAT_FILE: Final = "seat.h5"


def rounds(
    plan: Plan,
    folder: Path,
    watch: Stopwatch,
    progress: Progress,
    *,
    limits: Limits = NO_LIMITS,
    tell: Tell = ignore,
    start: float | None = None,
) -> Iterator[Round]:
    """Yield rounds of run, error estimate and refinement, until the target is met or nothing more can be refined.

    The keys with the largest errors are refined; keys that the file states are kept. No round begins that is expected
    to exceed the ``limits`` or the number of steps that can be stored. If a finer round fails, the round before is the
    result: its seat is written again, and it is yielded again with the reason in ``stopped``.

    Args:
        tell: function that receives a line on each round: refined keys, errors, time, memory, time of the next round.
        start: `time.perf_counter` at the start of the run, from which ``limits.seconds`` count.

    Yields:
        Each finished round before the next one begins; ``stopped`` says whether a further one follows.
    """
    begun = time.perf_counter() if start is None else start
    deadline = begun + limits.seconds
    memory_before = forget_peak()
    listen = within_limits(progress, begun + limits.first)
    progress(ROUND, 0.0)
    latest = _round(plan, folder, watch, listen, limits, memory_before)
    before: Plan | None = None
    while True:
        left = deadline - time.perf_counter()
        try:
            further, why = next_plan(latest, limits, left) if latest.met is False else (None, "")
        except FAILURES as problem:
            further, why = None, _failure_words(problem)
        line = describe_round(latest, before)
        if further is None:
            tell(line)
            yield with_stress(replace(latest, stopped=why), limits, watch)
            return
        tell(f"{line}; the next about {in_time(expect_time(latest, further))}")
        number, before, stopped = latest.number + 1, latest.plan, ""
        if _seat_key(further) != _seat_key(latest.plan):
            latest = replace(latest, seat=latest.seat.functions)
        yield replace(latest, stopped=f"round {number} {UNFINISHED}")
        progress(ROUND, 0.0)
        try:
            for finer, left_out in attempts(latest, further):
                attempt = replace(finer, refused={**finer.refused, **dict.fromkeys(left_out, stopped)})
                try:
                    listen = within_limits(progress, deadline)
                    latest = _round(attempt, folder, watch, listen, limits, memory_before, latest)
                    break
                except FAILURES as problem:
                    stopped = _failure_words(problem) + _restore_seat(latest, attempt, folder)
                    if isinstance(problem, OutOfTime):
                        break
            if latest.number < number:
                yield with_stress(replace(latest, stopped=stopped), limits, watch)
                return
        except KeyboardInterrupt:
            _restore_seat(latest, further, folder)
            raise


def rounds_in_temporary_folder(
    plan: Plan, watch: Stopwatch, limits: Limits = NO_LIMITS, progress: Progress = silent, tell: Tell = ignore
) -> Iterator[Round]:
    """Yield the `rounds` of a plan with their files in a temporary folder."""
    with private_folder("look") as folder, gmsh_session():
        yield from rounds(plan, folder, watch, progress, limits=limits, tell=tell)


def last_round(
    plan: Plan, watch: Stopwatch, limits: Limits = NO_LIMITS, progress: Progress = silent, tell: Tell = ignore
) -> Round:
    """Return the last round of `rounds_in_temporary_folder`."""
    *_, done = rounds_in_temporary_folder(plan, watch, limits, progress, tell)
    return done


class OutOfTime(SeatfemError, RuntimeError):
    """A round has exceeded the time allowed; the message names its stage."""


LEAST_FREE: Final = 3e8
"""Memory that must remain available during a run [bytes]."""
EVERY: Final = 0.5  # least time between two checks of the available memory [s]


def within_limits(progress: Progress, deadline: float = math.inf) -> Progress:
    """Return ``progress`` that raises `OutOfTime` at a report after the deadline, and `MemoryError` at one with less
    than `LEAST_FREE` available, before the system kills the run."""
    last = -math.inf

    def listen(stage: str, done: float) -> None:
        nonlocal last
        now = time.perf_counter()
        if now > deadline:
            raise OutOfTime(f"--max-time is over ({stage}, {done:.0%}); allow more")
        if now - last > EVERY:
            last = now
            if (free := available_memory()) < LEAST_FREE:
                raise MemoryError(
                    f"{stage} was stopped at {done:.0%}: {free / 1e9:.2g} GB of memory are left, at least "
                    f"{LEAST_FREE / 1e9:g} GB are needed to go on; shorten run.duration, state a longer run.time_step "
                    "or fewer contact.ports, or end other programs"
                )
        progress(stage, done)

    return listen


def _failure_words(problem: Exception) -> str:
    if isinstance(problem, OutOfTime):
        return f"the next round was stopped: {problem}"
    reason = str(problem) or ("out of memory" if isinstance(problem, MemoryError) else type(problem).__name__)
    return f"a finer round is not possible: {reason}"


def _restore_seat(done: Round, further: Plan, folder: Path) -> str:
    """Write the seat of ``done`` again, as a failed round may have written another; return why this failed, or ""."""
    if _seat_key(further) == (key := _seat_key(done.plan)):
        return ""
    try:
        Cache(folder / SEAT_FILE).write(done.seat.greens, key, done.seat.in_rings)
    except OSError as unwritten:
        return f"; {SEAT_FILE} may be of the round that failed ({unwritten})"
    return ""


def _seat_key(plan: Plan) -> str:
    """Return the key by which the plan's seat is cached."""
    return key_of(plan.scene.seat, plan.method.seat)


def solve(
    plan: Plan,
    watch: Stopwatch,
    progress: Progress = silent,
    *,
    before: Round | None = None,
    cache: Cache | None = None,
    mesh_error: bool = True,
) -> Round:
    """Return the results of a plan without their errors.

    Args:
        before: a round whose seat and reed are reused if their methods are unchanged.
        cache: cache of the seat; ``None``: the seat is computed.
        mesh_error: whether bodies are also solved on coarser meshes, for the error estimate.
    """
    scene, method = plan.scene, plan.method
    reed = None if before is None or before.plan.method.reed != method.reed else before.reed
    if reed is None and scene.reed.traits.is_solved:
        with watch(STRIKER):
            reed = solve_body("reed", scene.reed, method.reed, scene.run.duration, progress, mesh_error=mesh_error)
    if before is not None and _seat_key(before.plan) == _seat_key(plan):
        seat = before.seat
    else:
        arguments = (scene.seat, method.seat, scene.run.duration, cache)
        seat = build(*arguments, watch=watch, progress=progress, mesh_error=mesh_error)
    striker = striker_of(scene, method.reed.n_modes, None if reed is None else reed.greens)
    bodies = [striker.greens, seat.greens]
    if scene.stopper is not None:
        with watch("stopper"):  # solved once for all runs of this process
            bodies += [body.greens for body in (stopper_of(scene),) if body is not None]
    dt = method.time_step or contact.fallback_step(scene.run, scene.driven_by, *bodies)
    contact.check_length(scene, dt, method.seat.division.count)
    progress("stepping", 0.0)
    with watch("contact"):
        needs_runs = scene.needs_stress or scene.stress is not None or bool(scene.assessments)
        flights = contact.Flights(striker, scene.run.duration, scene.contact.preload, keeps_runs=needs_runs)
        touches = run_contacts(scene, striker, seat.greens, dt, progress, flights)
    computed = Round(plan, seat, striker, touches, UNKNOWN_STRESS, Budget({}), reed, flights=flights)
    if not scene.needs_stress:
        return computed
    progress("reed stress", 0.0)
    with watch("reed stress"):
        plate = reed_stress.plate_stress(computed) if any_needs(scene.accuracy.measures, "stress") else None
        stress = computed.strike.largest_stress(since=computed.since) if plate is None else plate.largest
    progress("reed stress", 1.0)
    return replace(computed, plate=plate, stress=stress)


def with_stress(done: Round, limits: Limits, watch: Stopwatch) -> Round:
    """Return the last round with the reed's largest stresses, if ``limits`` or the scene ask for them."""
    scene = done.plan.scene
    if done.stress.is_known or not (limits.stress or scene.stress or scene.assessments):
        return done
    with watch("reed stress"):
        return replace(done, stress=done.strike.largest_stress(since=done.since))


def _round(
    plan: Plan,
    folder: Path,
    watch: Stopwatch,
    progress: Progress,
    limits: Limits,
    memory_before: float,
    before: Round | None = None,
) -> Round:
    """Return a round with its errors, number, time and memory, including those of reused results.

    If no Krylov space reaches the tolerance of the first round, the next looser one is taken; a band with too many
    modes is replaced by the widest one with few enough; unless the file states either. ``memory_before``: memory before
    the run [bytes]; ``before``: the round before, if any.
    """
    scene, cache, stages = plan.scene, Cache(folder / SEAT_FILE), dict(watch.stages)
    while True:
        try:
            computed = solve(plan, watch, progress, before=before, cache=cache)
            break
        except lip_modes.BandError as crowded:
            if not plan.is_open(BAND):
                raise
            plan = limit_band(plan, crowded.band)
        except modes.ConvergenceError:
            looser = [each for each in TOLERANCES if each > (plan.method.seat.tolerance or math.inf)]
            if before is not None or not looser or not plan.is_open(TOLERANCE):
                raise
            plan = replace(plan, method=plan.method.replaced({TOLERANCE: looser[0]}))
    seat, touches = computed.seat, computed.touches
    with watch("error budget"):
        wanted_stress = computed.stress if scene.needs_stress else UNKNOWN_STRESS
        options = (wanted_stress, computed.look, computed.flights)
        compute = partial(error_budget, computed.build_computed_run(progress), touches, *options)
        if limits.steady:  # scenes of a study are kept by its journal
            budget = compute()
        else:
            missing = [each is None for each in (seat.coarser, seat.in_rings)]  # comparisons of the seat that lack
            stored = cached_numbers(computed, touches, f"error budget {missing}", lambda: vars(compute()))
            budget = Budget(stored["values"], stored["parts"], tuple(stored["sources"]), stored["by_key"])
    memory, number = peak_memory(), 1 if before is None else before.number + 1
    budget = _with_recovery(budget, computed.plate)
    computed = replace(computed, budget=budget, number=number, memory_before=memory_before)
    spent = {stage: s - stages.get(stage, 0.0) for stage, s in watch.stages.items() if s > stages.get(stage, 0.0)}
    price: Mapping[str, float] = spent
    if before is not None:
        price = {**before.price, **spent}
        computed = replace(computed, before=(before.plan.method, before.price))
    if not limits.steady:
        measured = {"stages": price, "memory": memory - memory_before}
        stored = cached_numbers(computed, touches, "price", lambda: measured)
        price, memory = stored["stages"], max(memory, memory_before + stored["memory"])
    return replace(computed, plan=with_measured_errors(computed), spent=spent, price=price, memory=memory)


def _with_recovery(budget: Budget, plate: reed_stress.PlateStress | None) -> Budget:
    """Return the budget with the errors of a plate's stress recovery, by mesh and modes, added to those of the reed."""
    names = [name for name in budget.values if asked_name(name) == Stress.name]
    if plate is None or not names or not budget.parts:
        return budget
    of_recovery = dict.fromkeys(budget.values, 0.0) | dict.fromkeys(names, plate.bar)
    of_reed = budget.parts.get(STRIKER, dict.fromkeys(budget.values, 0.0))
    return replace(budget, parts={**budget.parts, STRIKER: combined(of_reed, of_recovery)})
