"""Parallel integration, in one worker, of scenes that differ in contact data only, with the final plan of one of them.

Each has the requested measures, from the same force up to round-off as in a run by itself, and no error bars.
"""

import json
import math
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import impact
from impact.after.histories import UNKNOWN_STRESS
from impact.bodies.body import Body
from impact.greens.base import Array
from impact.march.motion import DiscreteBody, PortForces, find_mean_displacement
from impact.march.problem import ContactError, ContactProblem
from impact.runs.batch import ImpactBatch
from seatfem.jobs.folders import private_folder
from seatfem.structures import cache, rings
from seatfem.study.impacts.bodies import problem_of, solve_body, striker_of
from seatfem.study.impacts.contact import fallback_step
from seatfem.study.impacts.forces import known_stress
from seatfem.study.impacts.landings import landings_of_one_contact
from seatfem.study.plan import Plan
from seatfem.study.runs.rounds import SEAT_FILE
from seatfem.study.runs.summary import landing_keys, reed_stress_keys
from seatfem.study.scene import Scene, load_scene
from seatfem.study.scene.measures import ContactRecord, judged_landing, key_of, values_of
from seatfem.study.sweep.cases import begun
from seatfem.study.sweep.runner import Changes, Outcome, carry_out

SAME = 1e-9  # largest relative deviation of an initial state from a multiple of another


@dataclass(frozen=True)
class _Scene:
    """One scene: its contact problem, and its initial state as a multiple of that of the first scene."""

    scene: Scene
    problem: ContactProblem
    release: float


def side_by_side(
    path: Path,
    changed: Changes,
    others: Sequence[Changes],
    rounds: int,
    start: Mapping[str, Any],
    needs: Collection[str],
) -> list[Outcome]:
    """Return the outcomes of the scenes at ``path`` with each of the ``others`` changed besides ``changed``.

    ``start``: plan of all. ``needs``: "stress" or "displacement" if these are requested. Scenes that cannot be
    integrated in parallel with the scene with ``changed`` only are run by themselves, with error bars.
    """
    begin, why = time.perf_counter(), "it differs from the first by more than contact data"
    summaries: list[dict[str, Any] | None] = [None] * len(others)
    try:
        summaries = _marched(path, changed, others, start, needs)
    except (ArithmeticError, LookupError, MemoryError, OSError, RuntimeError, ValueError) as error:
        why = str(error)
    wall = (time.perf_counter() - begin) / len(others)

    def alone(other: Changes) -> Outcome:
        outcome = carry_out(path, {**changed, **other}, rounds, start, stress="stress" in needs)
        return replace(outcome, message=outcome.message or f"run by itself: {why}")

    return [
        alone(other) if summary is None else Outcome("done", "", wall, summary)
        for other, summary in zip(others, summaries, strict=True)
    ]


def _marched(
    path: Path, changed: Changes, others: Sequence[Changes], start: Mapping[str, Any], needs: Collection[str]
) -> list[dict[str, Any] | None]:
    """Return a summary of each scene; ``None`` for those that cannot be integrated in parallel."""
    base = load_scene(path, changed)
    if base.wave or base.gauge:
        raise ContactError("scenes with [[wave]] or [[gauge]] are marched one by one: run them by themselves")
    plan = begun(base, start)
    if plan is None:
        raise ContactError("no plan to march by; give the plan that a scene of the sample ended with")
    with private_folder("sweep") as folder:
        seat = cache.build(base.seat, plan.method.seat, base.run.duration, cache.Cache(folder / SEAT_FILE))
    problem = _problem(base, plan, impact.Body(seat.greens))
    dt = plan.method.time_step or fallback_step(base.run, base.driven_by, problem.striker.greens, seat.greens)
    parallel = list[_Scene | None]()
    for other in others:
        scene = load_scene(path, {**changed, **other})
        other_problem = _problem(scene, plan, problem.target)
        release = _release_over(problem, other_problem)
        parallel.append(None if release is None else _Scene(scene, other_problem, release))
    chosen = [each for each in parallel if each is not None]
    if not chosen:
        return [None] * len(others)
    gaps = [each.problem.contacts[0].gap for each in chosen]
    velocities, releases = ([each.problem.striker.velocity for each in chosen], [each.release for each in chosen])
    is_fixed = np.isinf(problem.striker.mass)
    batch = impact.solve_many(
        problem, dt=dt, duration=base.run.duration, gaps=gaps, velocities=() if is_fixed else velocities,
        release_scales=() if problem.striker.state is None else releases, record="force",
        filter_width=base.run.filter_width, workers=1,
    )  # fmt: skip
    summaries = iter(_summary(each, batch, place, dt, needs) for place, each in enumerate(chosen))
    return [None if each is None else next(summaries) for each in parallel]


def _problem(scene: Scene, plan: Plan, target: Body) -> ContactProblem:
    reed = solve_body("reed", scene.reed, plan.method.reed, scene.run.duration)  # once in a process
    striker = striker_of(scene, plan.method.reed.n_modes, None if reed is None else reed.greens)
    return problem_of(scene, striker, target)


def _release_over(base: ContactProblem, problem: ContactProblem) -> float | None:
    """Return the multiple of the initial state of ``base`` that a problem has; ``None`` if more than gap, velocity and
    size of that state differ."""
    own, reference = problem.striker, base.striker
    if len(problem.contacts) > 1 or problem.contacts[0].law != base.contacts[0].law or not _alike(own, reference):
        return None
    if own.state is None or reference.state is None:
        return 1.0
    mine, first = (np.concatenate([b.state.displacement, b.state.velocity]) for b in (own, reference) if b.state)
    release = float(mine @ first / (first @ first)) if np.any(first) else np.nan
    return release if np.abs(mine - release * first).max() <= SAME * np.abs(mine).max() else None


def _alike(one: Body, other: Body) -> bool:
    """Return whether two bodies have the same modes, and both an initial state or none."""
    first, second = one.greens.modal, other.greens.modal
    if first is None or second is None or (one.state is None) != (other.state is None):
        return False
    return all(np.array_equal(getattr(first, name), getattr(second, name)) for name in ("omega", "zeta", "shapes"))


def _summary(each: _Scene, batch: ImpactBatch, place: int, dt: float, needs: Collection[str]) -> dict[str, Any]:
    """Return the keys of summary.json that a parallel integration provides."""
    force, problem, width = batch.force[place], each.problem, each.scene.run.filter_width
    landings = landings_of_one_contact(problem, force, batch.gap[place], dt, width)
    choice = each.scene.accuracy.landing
    judged = judged_landing(landings.seat, choice)
    since = math.nan if judged is None else judged.start
    stress = UNKNOWN_STRESS
    if "stress" in needs:
        known = known_stress(each.scene.geometry, problem.striker, force, None, np.zeros(0), dt)
        stress = UNKNOWN_STRESS if known is None else known.largest(coarsely=False, since=since)
    moved = _displacement(problem.target, force, dt) if "displacement" in needs else None
    record = ContactRecord(force, dt, width, moved, stress, landings=landings.seat, asked=choice, stress_since=since)
    values = values_of(record, landings.seat)
    touched = batch.contact_count[place] > 0
    return {
        **(reed_stress_keys(stress) if "stress" in needs else {}),
        **{key_of(name): value for name, value in values.items()},
        **landing_keys(landings, values),
        "peak_force_N": float(batch.peak_force[place]),
        "first_contact_s": float(batch.first_contact[place]) if touched else None,
        "contact_duration_s": float(batch.contact_duration[place]) if touched else None,
        "contact_count": int(batch.contact_count[place]),
        "time_step_s": dt,
    }


def _displacement(target: Body, force: Array, dt: float) -> Array:
    """Return the displacement (n + 1,) of the seat's patch [m]."""
    discrete = DiscreteBody.from_body(target, dt, len(force) - 1)
    shares = rings.Division.from_greens(target.greens).shares
    moved = find_mean_displacement(discrete, PortForces.at_ports(-force[None, 1:], dt), shares)
    return (
        moved if target.base is None else moved + target.find_base_displacement(np.asarray(dt * np.arange(len(moved))))
    )


def reply(text: str) -> str:
    """Return the outcome of one job, or those of several scenes side by side."""
    job = json.loads(text)
    path = Path(job.pop("path"))
    if "others" not in job:
        return json.dumps(asdict(carry_out(path, **job)))
    return json.dumps([asdict(each) for each in side_by_side(path, **job)])
