"""Many scenes of the same two bodies at once: side by side in vector registers, groups of them on all cores."""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact import notices, quantities
from impact.after.histories import MERGE
from impact.bodies.body import Body
from impact.greens.base import Array
from impact.march.history import aligned
from impact.march.laws import DEEPEST, ROUGH, PlainLaw
from impact.march.loop.compiled import compiled
from impact.march.loop.marches import LANES, march_lanes
from impact.march.motion import DiscreteBody, PortForces
from impact.march.prepared import Prepared, prepare
from impact.march.problem import ContactError, ContactProblem
from impact.march.stepper import march_numbers


@dataclass(frozen=True)
class ImpactBatch:
    """Measures of S scenes, each (S,), defined as in `impact.measures`; ``nan`` without contact.

    Attributes:
        peak_force: largest force of a step [N].
        filtered_peak_force: largest moving average over the given width [N]; ``nan`` without a width.
        impulse: integral of the force [N s].
        first_contact: start of the first contact [s].
        contact_duration: duration of the first contact group, with openings below 30 us closed [s].
        contact_count: number of contact groups.
        impact_velocity: closing speed before the first contact [m/s].
        rebound_velocity: opening speed of the centres of mass at the end; ``nan`` for a held striker [m/s].
        in_contact: whether the record ends in contact.
        time: (n + 1,) times [s].
        force: (S, n + 1) forces [N]; (0, n + 1) if they are not recorded.
        gap: (S, n + 1) gaps [m]; (0, n + 1) if forces are not recorded.
    """

    peak_force: Array
    filtered_peak_force: Array
    impulse: Array
    first_contact: Array
    contact_duration: Array
    contact_count: NDArray[np.int64]
    impact_velocity: Array
    rebound_velocity: Array
    in_contact: NDArray[np.bool_]
    time: Array
    force: Array
    gap: Array

    __repr__ = quantities.brief


def solve_many(
    problem: ContactProblem,
    *,
    dt: float,
    duration: float,
    gaps: ArrayLike = (),
    velocities: ArrayLike = (),
    release_scales: ArrayLike = (),
    record: Literal["measures", "force"] = "measures",
    filter_width: float = 0.0,
    rule: str = "auto",
    workers: int = 0,
    progress: notices.Progress = notices.silent,
) -> ImpactBatch:
    """Solve ``problem`` for many gaps [m], striker velocities [m/s] and scales of the striker's initial state.

    The results equal those of `impact.solve` to round-off. Each argument is a number or (S,), by default the problem's
    own. ``filter_width``: as in `impact.measures.filtered_peak_force` [s]; 0: without. ``workers``: number of threads;
    0: all cores.

    Raises:
        ContactError: several contacts, a film, a preload, a body without poles, arrays of unequal length or not finite,
            velocities for a held striker, release scales without an initial state, a filter below two steps.
    """
    if filter_width and not filter_width >= 2 * dt * (1 - 1e-9):
        raise ContactError(f"filter_width = {filter_width:g} s is below two steps of {dt:g} s; use dt <= half of it")
    scales = _scales(problem, gaps, velocities, release_scales)
    prepared = _prepared(problem, dt, duration, rule)
    free = _free_motions(problem, prepared)
    count, n = scales.shape[1], prepared.steps
    results = np.empty((8, count))
    force, gap = np.zeros((2, count if record == "force" else 0, n + 1))
    rows = np.ascontiguousarray(prepared.poles.folded().T)
    contact = problem.contacts[0]
    numbers = march_numbers([contact.law.parameters] * LANES)
    reach = _in_translation(problem.striker).velocity_of(contact.striker_port)
    closing = contact.target.velocity_of(contact.port) - reach * scales[1]
    user, rough = getattr(contact.law, "compiled", None), True if contact.law.code >= ROUGH else None

    def run(scenes: NDArray[np.int64]) -> int:
        lanes = np.resize(scenes, LANES)  # the last group is filled by repeated scenes
        history, opening, out = np.empty((n, LANES)), np.empty((n + 1, LANES)), np.empty((8, LANES))
        s = np.ascontiguousarray(scales[:, lanes])
        out[6] = contact.side * closing[lanes]
        law = (contact.law.code, int(prepared.rules[0]), noted := numbers.copy())
        np.maximum(-(s[0] + free[0, 0] + free[1, 0] * s[1] + free[2, 0] * s[2]), 0.0, out=noted[:, DEEPEST])
        state = aligned((len(rows) + 1) * 2 * LANES).reshape(-1, 2, LANES)
        march_lanes(rows, state, free, s, float(prepared.own[0, 0]), law, user, rough, dt, history, opening, out[6])
        _measure(history, dt, MERGE, filter_width, out)
        results[:, scenes] = out[:, : len(scenes)]
        if len(force):
            force[scenes, 1:] = history[:, : len(scenes)].T
            gap[scenes] = opening[:, : len(scenes)].T
        return len(scenes)

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    groups, finished = [np.arange(count)[first : first + LANES] for first in range(0, count, LANES)], 0
    with ThreadPoolExecutor(workers or cores) as pool:  # the compiled march holds no interpreter lock
        for task in as_completed([pool.submit(run, group) for group in groups]):
            finished += task.result()
            progress("stepping", finished / count)
    peak, filtered, impulse, first_contact, durations, groups_of, approach, ends = results
    if isinstance(contact.law, PlainLaw):
        contact.law.check()
    pair, rebound = ((problem.striker, contact.striker_port), (contact.target, contact.port)), np.full(count, np.nan)
    if not math.isinf(problem.striker.mass):
        rebound = impulse * sum(1 / body.greens.mass(port) for body, port in pair) - contact.side * closing
    no_contact = groups_of == 0
    return ImpactBatch(
        peak_force=peak,
        filtered_peak_force=filtered if filter_width else np.full(count, np.nan),
        impulse=impulse,
        first_contact=first_contact,
        contact_duration=durations,
        contact_count=groups_of.astype(np.int64),
        impact_velocity=np.where(no_contact, np.nan, approach),
        rebound_velocity=np.where(no_contact, np.nan, rebound),
        in_contact=ends > 0,
        time=np.asarray(dt * np.arange(n + 1)),
        force=force,
        gap=gap,
    )


def _prepared(problem: ContactProblem, dt: float, duration: float, rule: str) -> Prepared:
    """Return the prepared problem with the striker at rest."""
    if len(problem.contacts) != 1 or problem.preload:
        raise ContactError("scenes are solved side by side for a single contact without preload; use impact.solve")
    if any(load.follows for load in problem.striker.loads):
        raise ContactError("a load that depends on the opening is marched scene by scene; use impact.solve")
    if problem.contacts[0].film is not None:
        raise ContactError("a contact with a film is marched scene by scene; use impact.solve")
    still = replace(problem.striker, velocity=0.0, state=None)
    return prepare(ContactProblem(still, contacts=problem.contacts), dt, duration, rule, engine="poles")


def _scales(problem: ContactProblem, gaps: ArrayLike, velocities: ArrayLike, release_scales: ArrayLike) -> Array:
    """Return the (3, S) gaps, velocities and release scales."""
    if np.size(velocities) and math.isinf(problem.striker.mass):
        raise ContactError("velocities are of a striker free to translate; this one is held: use release_scales")
    if np.size(release_scales) and problem.striker.state is None:
        raise ContactError("release_scales multiply the striker's initial state; give it one: Body(state=...)")
    inputs = {
        "gaps": gaps if np.size(gaps) else problem.contacts[0].gap,
        "velocities": velocities if np.size(velocities) else problem.striker.velocity,
        "release_scales": release_scales if np.size(release_scales) else 1.0,
    }
    arrays = {name: np.asarray(values, dtype=float) for name, values in inputs.items()}
    if any(a.ndim > 1 for a in arrays.values()) or len({a.size for a in arrays.values() if a.ndim}) > 1:
        sizes = ", ".join(f"{name} {a.shape}" for name, a in arrays.items())
        raise ContactError(f"gaps, velocities and release_scales must be numbers or (S,) of one length; got {sizes}")
    for name, values in arrays.items():
        if not np.all(np.isfinite(values)):
            raise ContactError(f"{name} must be finite, {np.sum(~np.isfinite(values))} values are not")
    return np.stack(np.broadcast_arrays(*map(np.atleast_1d, arrays.values())))


def _free_motions(problem: ContactProblem, prepared: Prepared) -> Array:
    """Return the (3, n + 1) gap without contact: common part, part per unit of velocity, part per unit of release."""
    striker, n = problem.striker, prepared.steps
    out = np.zeros((3, n + 1))
    out[0] = prepared.free[:, 0] - problem.contacts[0].gap
    for row, body in ((1, _in_translation(striker)), (2, replace(striker, velocity=0.0, loads=()))):
        discrete = DiscreteBody.from_body(body, prepared.dt, n)
        if discrete.moves_by_itself:
            forces = PortForces.at_ports(np.zeros((len(discrete.rest), n)), prepared.dt)
            out[row] = problem.directions(striker)[:, 0] @ discrete.motion(forces).displacement
    return out


def _in_translation(striker: Body) -> Body:
    """Return the striker in pure translation at 1 m/s; at rest if it is held."""
    return replace(striker, velocity=0.0 if math.isinf(striker.mass) else 1.0, state=None, loads=())


@compiled(nogil=True)
def _measure(force, dt, merge, width, out):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Fill rows of ``out`` (8, S) from force (n, S): peak, filtered peak, impulse, first contact, duration of the first
    group, number of groups, (not changed), force at the end."""
    steps, scenes = force.shape
    last, end = np.full(scenes, -1), np.full(scenes, -1)
    for row in (0, 1, 2, 5):
        out[row] = 0.0
    out[3:5] = np.nan
    out[7] = force[steps - 1]
    for n in range(steps):
        for s in range(scenes):
            f = force[n, s]
            if f > 0.0:
                out[0, s] = max(out[0, s], f)
                out[2, s] += f * dt
                if last[s] < 0:
                    out[3, s] = dt * n
                if last[s] < 0 or dt * n - dt * last[s] >= merge:
                    out[5, s] += 1.0
                if out[5, s] == 1.0:
                    end[s] = n + 1
                last[s] = n + 1
    for s in range(scenes):
        if end[s] > 0:
            out[4, s] = dt * end[s] - out[3, s]
    if width > 0.0:
        _filtered_peak(force, dt, width, out[1])


@compiled(nogil=True)
def _filtered_peak(force, dt, width, peak):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Return the largest (I(t + width) - I(t))/width where t or t + width is a recorded time, I linear between them."""
    steps, scenes = force.shape
    total = np.zeros((steps + 1, scenes))
    for n in range(steps):
        total[n + 1] = total[n] + force[n] * dt
    whole = int(width / dt)
    part = width / dt - whole
    for n in range(steps + 1):
        a, b = min(n + whole, steps), min(n + whole + 1, steps)
        c, d = max(n - whole, 0), max(n - whole - 1, 0)
        for s in range(scenes):
            begins = total[a, s] + part * (total[b, s] - total[a, s]) - total[n, s]
            ends = total[n, s] - total[c, s] - part * (total[d, s] - total[c, s])
            peak[s] = max(peak[s], begins / width, ends / width)
