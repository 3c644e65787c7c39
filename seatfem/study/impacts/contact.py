"""The contact of a scene: who strikes, how finely time is stepped, and one run of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

import impact
from impact.after.result import ImpactResult, as_one
from impact.after.stresses import ReedStress
from impact.greens.base import Array, GreensFunction
from impact.march.engines import Engine
from impact.march.motion import port_displacement
from impact.progress import Progress, silent
from impact.runs.budget import Values
from impact.runs.variations import with_body
from seatfem.machine.memory import available_memory
from seatfem.structures.build import Cache, build
from seatfem.structures.cache import key_of
from seatfem.structures.kinds import Structure
from seatfem.structures.rings import ring_shares, rings_of
from seatfem.study.impacts.measures import values_of
from seatfem.study.scene import Scene
from seatfem.study.scene.measures import any_needs_stress

STEPS_PER_RADIAN = 4  # of the highest rate in either body: a fortieth of a rod's transit
STEPS_PER_FILTER = 20
LEAST_STEPS_PER_FILTER = 2  # fewer do not resolve the filtered force
MAX_STEPS = 20_000_000
STEP_BYTES = 530  # of the histories that a run holds at once, for each step, and of their file while it is put together


class RunError(ValueError):
    """A scene that is well formed but cannot be run as asked; the message names key, limit and remedy."""


def striker_of(scene: Scene, n_modes: int | None = None) -> impact.Body:
    """The scene's striker; ``n_modes``: of a body known by its own modes, in place of the number that it states."""
    reed = scene.reed
    greens = _solved(_Asked(key_of(reed, reed.stated()), reed, scene.run.duration)) if reed.is_solved else None
    return reed.body(greens, n_modes, scene.contact.at)


@dataclass(frozen=True)
class _Asked:
    """A striker whose Green's function is computed: once in a process, for it is asked for again and again."""

    key: str
    structure: Structure = field(compare=False)
    duration: float


@lru_cache(maxsize=2)
def _solved(asked: _Asked) -> GreensFunction:
    cache = Cache(None) if asked.structure.is_meshed else None
    return build(asked.structure, asked.structure.stated(), asked.duration, cache).greens


def stress_of(
    scene: Scene, striker: impact.Body, force: Array, dt: float, *, coarsely: bool = False
) -> ReedStress | None:
    """The reed's largest bending stresses under a contact force (n + 1,); ``None`` for a rigid mass."""
    return scene.reed.stress(force, dt, striker, scene.contact.at, coarsely=coarsely)


def run_contact(
    scene: Scene,
    striker: impact.Body,
    seat: GreensFunction,
    dt: float,
    progress: Progress = silent,
    *,
    engine: Engine = "auto",
) -> ImpactResult:
    """One run: contact between striker and seat by the scene's law; of rings, their sum."""
    return whole_patch(solve_contact(scene, striker, seat, dt, progress, engine=engine))


def solve_contact(
    scene: Scene,
    striker: impact.Body,
    seat: GreensFunction,
    dt: float,
    progress: Progress = silent,
    *,
    engine: Engine = "auto",
) -> ImpactResult:
    """The same, ring by ring."""
    problem = problem_of(scene, striker, impact.Body(seat))
    return impact.solve(problem, dt=dt, duration=scene.run.duration, engine=engine, progress=progress)


def whole_patch(result: ImpactResult) -> ImpactResult:
    """The rings of a patch, seen as one contact."""
    return result if result.force.ndim == 1 else as_one(result, ring_shares(result.force.shape[1]))


def problem_of(scene: Scene, striker: impact.Body, seat: impact.Body) -> impact.ContactProblem:
    """Striker and seat by the scene's law: one contact, or one for each ring of the patch, which the striker's face
    presses as a rigid body."""
    gap, law, rings = scene.contact.gap, scene.contact.law, rings_of(seat.greens)
    if rings == 1:
        return impact.ContactProblem(striker, seat, gap=gap, law=law.law(), preload=scene.contact.preload)
    shares = ring_shares(rings)
    contacts = [impact.Contact(seat, port=k, gap=gap, law=law.law(float(shares[k]))) for k in range(rings)]
    return impact.ContactProblem(striker, contacts=contacts, preload=scene.contact.preload)


def run_for_measures(scene: Scene, striker: impact.Body, seat: GreensFunction, dt: float) -> Values:
    """`measures_of` striker and seat."""
    return measures_of(scene, problem_of(scene, striker, impact.Body(seat)), dt)


def measures_of(scene: Scene, problem: impact.ContactProblem, dt: float) -> Values:
    """The measures of a run alone, a fraction of its cost: no energies; stress only if asked for, coarsely."""
    bare = impact.Body(problem.target.greens.forces_only())
    striker, problem = problem.striker, with_body(problem, problem.target, bare)
    prepared = impact.prepare(problem, dt, scene.run.duration)
    stepper = impact.ContactStepper(prepared)
    stepper.advance(prepared.steps)
    force, displacement = force_of(stepper), displacement_of(stepper)
    wanted = any_needs_stress(scene.accuracy.measures)
    stress = stress_of(scene, striker, force, dt, coarsely=True) if wanted else None
    return values_of(force, dt, scene.run.filter_width, displacement, stress)


def force_of(stepper: impact.ContactStepper) -> Array:
    """(n + 1,) contact force of the whole patch at every step done [N]."""
    return np.concatenate([[stepper.prepared.rest.sum()], stepper.force[: stepper.done].sum(axis=1)])


def displacement_of(stepper: impact.ContactStepper) -> Array:
    """(n + 1,) displacement of the seat's patch, its mean [m]."""
    seat, force = stepper.prepared.bodies[1], stepper.force[: stepper.done]
    if force.shape[1] == 1:
        return port_displacement(seat, -force[:, 0])
    return np.asarray(ring_shares(force.shape[1]) @ seat.motion(-force.T).displacement)


def time_step(scene: Scene, reed: GreensFunction, seat: GreensFunction) -> float:
    """Step [s]: a quarter radian of the highest rate in either body, a twentieth of the filter."""
    limits = [scene.run.filter_width / STEPS_PER_FILTER, scene.run.duration / 200]
    limits += [1.0 / (STEPS_PER_RADIAN * rate) for rate in (reed.highest_rate, seat.highest_rate) if rate > 0]
    return min(limits)


def check_step(scene: Scene) -> None:
    """Refuse what cannot serve, before anything expensive happens: a given step, a seat that nothing holds."""
    if thick := scene.reed.too_thick():
        raise RunError(thick)
    if loose := scene.seat.loose:
        raise RunError(
            f"{loose}, so it has no static stiffness to compare with; clamp a face or add a support "
            "(foundation, bolted, absorbing with centre). seatfem modes shows the modes of a free body"
        )
    step, width = scene.run.time_step, scene.run.filter_width
    if width > scene.run.duration:
        raise RunError(
            f"run.filter_width = {width:g} s is longer than run.duration = {scene.run.duration:g} s: state a shorter "
            "run.filter_width, or watch longer"
        )
    check_length(scene, width / LEAST_STEPS_PER_FILTER if step is None else step)
    if step is not None and 2 * step > width:
        raise RunError(
            f"run.time_step = {step:g} s does not resolve filtered_peak_force_N: at most {width / 2:g} s "
            f"(half of run.filter_width = {width:g} s); use a shorter step or a wider filter"
        )


def check_length(scene: Scene, dt: float) -> None:
    """Refuse more steps than can be stored, or than memory holds."""
    steps = scene.run.duration / dt
    most = min(MAX_STEPS, available_memory() / STEP_BYTES)
    if steps > most:
        chosen = "run.time_step" if scene.run.time_step else "the step that both bodies and run.filter_width need"
        raise RunError(
            f"run.duration = {scene.run.duration:g} s takes {steps:.2g} steps of {dt:.2g} s ({chosen}), at most "
            f"{most:.2g} are stored: shorten run.duration, widen run.filter_width, keep fewer modes "
            "(reed.n_modes), or give a longer run.time_step"
        )
