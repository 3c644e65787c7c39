"""The rounds of a run: a plan is computed, its error estimated, and it is refined until the target is met or cannot
be."""

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
from seatfem.study.runs.converge import attempts, in_widest_band, with_measured_errors
from seatfem.study.runs.kept import cached_numbers
from seatfem.study.runs.next_round import Limits, expect_time, next_plan
from seatfem.study.runs.round import UNFINISHED, Round, in_words
from seatfem.study.safety import FAILURES
from seatfem.study.scene.measures import Stress, any_needs, asked_name

ANY: Final = Limits()
SEAT_FILE: Final = "seat.h5"


def rounds(
    plan: Plan,
    folder: Path,
    watch: Stopwatch,
    progress: Progress,
    *,
    limits: Limits = ANY,
    tell: Tell = ignore,
    start: float | None = None,
) -> Iterator[Round]:
    """Yield rounds of run, error estimate and refinement, until the target is met or nothing more can be refined.

    The keys with the largest errors are refined; those that the file states are kept, and no round is begun that is
    expected to exceed the ``limits`` or the number of steps that can be stored. If a finer round fails, its predecessor
    is the answer: its seat is written again, and it is yielded again with the reason in ``stopped``.

    Args:
        tell: receives a line on each round: what was refined, errors, time, memory, and the time that the next takes.
        start: `time.perf_counter` at the start of the run, from which ``limits.seconds`` count.

    Yields:
        Each finished round, before the next begins; ``stopped`` of one that is not the last says so.
    """
    begun = time.perf_counter() if start is None else start
    deadline = begun + limits.seconds
    held = forget_peak()
    listen = within_limits(progress, begun + limits.first)
    progress(ROUND, 0.0)
    latest = _round(plan, folder, watch, listen, limits, held)
    before: Plan | None = None
    while True:
        left = deadline - time.perf_counter()
        try:
            further, why = next_plan(latest, limits, left) if latest.met is False else (None, "")
        except FAILURES as problem:
            further, why = None, _failure_words(problem)
        line = in_words(latest, before)
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
                    latest = _round(attempt, folder, watch, listen, limits, held, latest)
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


def rounds_apart(
    plan: Plan, watch: Stopwatch, limits: Limits = ANY, progress: Progress = silent, tell: Tell = ignore
) -> Iterator[Round]:
    """Yield the `rounds`, whose files are temporary."""
    with private_folder("look") as folder, gmsh_session():
        yield from rounds(plan, folder, watch, progress, limits=limits, tell=tell)


def last_round(
    plan: Plan, watch: Stopwatch, limits: Limits = ANY, progress: Progress = silent, tell: Tell = ignore
) -> Round:
    """Return the last of `rounds_apart`."""
    *_, done = rounds_apart(plan, watch, limits, progress, tell)
    return done


class OutOfTime(SeatfemError, RuntimeError):
    """A round has exceeded the time allowed; the message names its stage."""


LEAST_FREE: Final = 3e8
"""Memory that must remain available while a run goes on [bytes]."""
EVERY: Final = 0.5  # least time between two looks at the memory [s]


def within_limits(progress: Progress, deadline: float = math.inf) -> Progress:
    """Return ``progress`` that raises, in words, `OutOfTime` at a report after the deadline, and `MemoryError` at one
    with less than `LEAST_FREE` available: the run ends before the system ends it."""
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
    """Write the seat of ``done`` again, as a failed round may have written a finer one; return why it cannot, or ""."""
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
    """Return a plan's results without their errors.

    Args:
        before: a round whose seat and reed are reused if their methods are unchanged.
        cache: cache of the seat; ``None``: it is computed.
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
        looked_at = scene.needs_stress or scene.stress is not None or bool(scene.assessments)
        flights = contact.Flights(striker, scene.run.duration, scene.contact.preload, keeps_runs=looked_at)
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
    """Return the last round with the reed's largest stresses, if they are wanted or the scene asks for more of them."""
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
    held: float,
    before: Round | None = None,
) -> Round:
    """Return a round with its errors, number, time and memory, those of what was reused included.

    ``held``: memory before the run [bytes]; ``before``: the round before, if any. If no Krylov space reaches the
    tolerance of the first one, it has a looser one, and a band with too many modes becomes the widest that has few
    enough, unless the file states them.
    """
    scene, cache, stages = plan.scene, Cache(folder / SEAT_FILE), dict(watch.stages)
    while True:
        try:
            computed = solve(plan, watch, progress, before=before, cache=cache)
            break
        except lip_modes.BandError as crowded:
            if not plan.is_open(BAND):
                raise
            plan = in_widest_band(plan, crowded.band)
        except modes.ConvergenceError:
            looser = [each for each in TOLERANCES if each > (plan.method.seat.tolerance or math.inf)]
            if before is not None or not looser or not plan.is_open(TOLERANCE):
                raise
            plan = replace(plan, method=plan.method.replaced({TOLERANCE: looser[0]}))
    seat, touches = computed.seat, computed.touches
    with watch("error budget"):
        wanted_stress = computed.stress if scene.needs_stress else UNKNOWN_STRESS
        looks = (wanted_stress, computed.look, computed.flights)
        compute = partial(error_budget, computed.as_computed(progress), touches, *looks)
        if limits.steady:  # scenes of a study are kept by its journal
            budget = compute()
        else:
            beside = [each is None for each in (seat.coarser, seat.in_rings)]  # which comparisons of the seat there are
            left = cached_numbers(computed, touches, f"error budget {beside}", lambda: vars(compute()))
            budget = Budget(left["values"], left["parts"], tuple(left["sources"]), left["by_key"])
    memory, number = peak_memory(), 1 if before is None else before.number + 1
    computed = replace(computed, left=_with_recovery(budget, computed.plate), number=number, held=held)
    spent = {stage: s - stages.get(stage, 0.0) for stage, s in watch.stages.items() if s > stages.get(stage, 0.0)}
    price: Mapping[str, float] = spent
    if before is not None:
        price = {**before.price, **spent}
        computed = replace(computed, before=(before.plan.method, before.price))
    if not limits.steady:
        first = {"stages": price, "memory": memory - held}
        kept = cached_numbers(computed, touches, "price", lambda: first)
        price, memory = kept["stages"], max(memory, held + kept["memory"])
    return replace(computed, plan=with_measured_errors(computed), spent=spent, price=price, memory=memory)


def _with_recovery(left: Budget, plate: reed_stress.PlateStress | None) -> Budget:
    """Return the budget with errors of a plate's stress recovery, by its mesh and modes, combined with the reed's."""
    names = [name for name in left.values if asked_name(name) == Stress.name]
    if plate is None or not names or not left.parts:
        return left
    of_recovery = dict.fromkeys(left.values, 0.0) | dict.fromkeys(names, plate.bar)
    known = left.parts.get(STRIKER, dict.fromkeys(left.values, 0.0))
    return replace(left, parts={**left.parts, STRIKER: combined(known, of_recovery)})
