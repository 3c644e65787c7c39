"""Runs of a contact problem: limits of its time step, marches, and what measures are taken from."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

import impact
from impact.after.landings import Landing
from impact.after.loads import without_springs
from impact.after.stresses import ReedStress
from impact.greens.base import Array, GreensFunction
from impact.march import history, motion
from impact.march.prepared import step_count
from impact.march.stepper import FOLLOW, with_recorded_loads
from impact.notices import Progress, silent
from impact.runs.variations import with_body
from seatfem.machine.resources import available_memory
from seatfem.structures.rings import Division
from seatfem.study.impacts import touches
from seatfem.study.impacts.bodies import check_base, problem_of
from seatfem.study.impacts.gas import lift_of
from seatfem.study.impacts.gauges import Strains, gauge_strains
from seatfem.study.impacts.landings import Landings, landings_of_march
from seatfem.study.scene import Run, Scene, lips, measures
from seatfem.study.scene.gas import CompressorGas
from seatfem.study.scene.waves import Gauged
from seatfem.units import write_quantity

STEPS_PER_RADIAN = 4  # steps per radian of the highest rate in either body: a fortieth of a rod's transit
STEPS_PER_FILTER = 20
GAS_PER_DEGREE = 2
LEAST_STEPS_PER_FILTER = 2  # fewest steps in the filter's width that resolve the filtered force
MAX_STEPS = 20_000_000
STEP_BYTES = 530  # bytes per step of all histories of a run, and of their file while it is put together
CONTACT_BYTES = 48  # bytes per step of each further contact
PAIR_TIME = 6e-9  # time [s] of a step for each pair of contacts, by spring laws; rigid ones take a quarter
LONGEST_MARCH = 86400.0  # longest predicted time of the march [s]

StressLook = Callable[[impact.ContactStepper, float | None], ReedStress | None]
"""Function that returns the largest stresses of a reed in a march, also before and after the begin of a landing [s]."""


class RunError(ValueError):
    """A scene that is well formed but cannot be run as asked; the message names key, limit and remedy."""


def stress_of(
    geometry: lips.ContactGeometry,
    striker: impact.Body,
    force: Array,
    dt: float,
    opening: Array,
    *,
    coarsely: bool = False,
    stopper: Array | None = None,
    since: float | None = None,
) -> ReedStress | None:
    """Return the reed's largest bending stresses under the contact forces of seat and stopper, (n + 1,) each; ``None``
    for a rigid mass. ``opening``: (n + 1,) the seats' mean, by which loads that follow the lift are as the march had
    them. ``since``: the time at which a landing begins, before and after which they are distinguished, too [s]."""
    if not geometry.reed.traits.has_stress:
        return None
    pushed = touches.pushes(striker, force, stopper)
    marched = without_springs(with_recorded_loads(striker, opening, dt), pushed, dt)
    stress = geometry.reed.stress(pushed, dt, marched, geometry.contact_at)
    return None if stress is None else stress.largest(coarsely=coarsely, since=since)


def stress_in_run(
    geometry: lips.ContactGeometry,
    striker: impact.Body,
    run: touches.Touches,
    *,
    coarsely: bool = False,
    since: float | None = None,
) -> ReedStress | None:
    """Return the reed's largest bending stresses in a run, as `stress_of` under its forces."""
    force, dt, lift, above = run.seat.force, run.seat.dt, lift_of(run), run.stopper_force
    return stress_of(geometry, striker, force, dt, lift, coarsely=coarsely, stopper=above, since=since)


def bending_look(geometry: lips.ContactGeometry) -> StressLook | None:
    """Return the look at the bending stress of a beam, coarsely; ``None`` of other reeds."""
    if not geometry.reed.traits.has_stress:
        return None

    def look(stepper: impact.ContactStepper, since: float | None) -> ReedStress | None:
        striker, dt, force = stepper.prepared.problem.striker, stepper.prepared.dt, touches.force_of(stepper)
        stopper, opening = touches.stopper_force_of(stepper), stepper.opening
        return stress_of(geometry, striker, force, dt, opening, coarsely=True, stopper=stopper, since=since)

    return look


@dataclass(frozen=True)
class Flights:
    """The striker of a run without contact, over ``duration`` [s] and with a ``preload`` or not: computed once for each
    step [s], and anew for any other striker."""

    striker: impact.Body
    duration: float
    preload: bool
    known: dict[float, motion.Discrete] = field(default_factory=dict)

    def __call__(self, striker: impact.Body, dt: float) -> motion.Discrete:
        """Return a striker, its motion without contact known; with a preload from equilibrium under its loads."""
        if striker is self.striker and dt in self.known:
            return self.known[dt]
        discrete = motion.Discrete.from_body(striker, dt, step_count(dt, self.duration))
        if self.preload:
            discrete = replace(discrete, rest_loads=striker.load_amplitudes(np.zeros(1))[:, 0])
        if discrete.moves_by_itself:
            discrete = replace(discrete, free=discrete.free_motion())
        if striker is self.striker:
            self.known[dt] = discrete
        return discrete


def run_contacts(
    scene: Scene,
    striker: impact.Body,
    seat: GreensFunction,
    dt: float,
    progress: Progress = silent,
    flights: Flights | None = None,
    *,
    engine: history.Engine = "auto",
) -> touches.Touches:
    """Run the scene once: contact between striker and seat, and with a stopper, by the scene's laws. ``flights``: of
    the striker, where several runs share them."""
    check_base(scene.mount("seat"), seat, scene.run.duration)
    problem, bodies = problem_of(scene, striker, impact.Body(seat)), None
    if flights is not None:
        flown = flights(striker, dt)
        bodies = (flown, *(motion.Discrete.from_body(body, dt, flown.loads.shape[1]) for body in problem.targets))
    result = impact.solve(problem, dt=dt, duration=scene.run.duration, engine=engine, bodies=bodies, progress=progress)
    met = touches.taken_apart(scene.geometry, problem, result, scene.run.filter_width)
    if not scene.gauge:
        return met
    force, above, lift = met.seat.force, met.stopper_force, lift_of(met)
    return replace(met, strains=gauge_strains(scene.gauged, striker, force, above, result.dt, lift))


def marched(
    problem: impact.ContactProblem,
    dt: float,
    duration: float,
    flight: Callable[[impact.Body, float], motion.Discrete] | None = None,
) -> impact.ContactStepper:
    """March a problem over a ``duration`` for its forces alone, a fraction of the cost of a run with energies.

    ``flight``: the striker without contact at a step [s], as `Flights` returns it, which several runs may share.
    """
    striker = problem.striker
    for body in problem.targets:
        if not body.loads:
            problem = with_body(problem, body, replace(body, greens=body.greens.forces_only()))
    flown = (flight or Flights(striker, duration, problem.preload))(striker, dt)
    targets = (motion.Discrete.from_body(body, dt, flown.loads.shape[1]) for body in problem.targets)
    prepared = impact.prepare(problem, dt, duration, bodies=(flown, *targets))
    stepper = impact.ContactStepper(prepared, flying=True)
    stepper.advance(prepared.steps)
    return stepper


def record_of(
    scene: Scene,
    problem: impact.ContactProblem,
    dt: float,
    flight: Callable[[impact.Body, float], motion.Discrete] | None = None,
    like: Landings | None = None,
    duration: float | None = None,
    *,
    stresses: bool = True,
    look: StressLook | None = None,
) -> touches.RunRecord:
    """Return the record of a run for its measures, from its forces as `marched`.

    ``stresses``: whether with those that are asked for; ``look``: at them, in place of `bending_look`.
    """
    stepper = marched(problem, dt, scene.run.duration if duration is None else duration, flight)
    landings = landings_of_march(stepper, scene.run.filter_width, None if like is None else like.static)
    others = None if like is None else like.seat
    stress_look = (look or bending_look(scene.geometry)) if stresses and scene.needs_stress else None
    blow = blow_of_march(scene, stepper, landings.seat, others, stress=stress_look)
    return touches.RunRecord(blow, landings, touches.stopper_force_of(stepper))


def blow_of_march(
    scene: Scene,
    stepper: impact.ContactStepper,
    landings: tuple[Landing, ...],
    like: Sequence[Landing] | None = None,
    *,
    displacement: bool = True,
    stress: StressLook | None = None,
) -> measures.ContactRecord:
    """Return what the measures of a march without energies are taken from, with its ``landings`` on the seat.

    ``like``: those of a neighbouring run, whose judged one is looked for; ``None``: of the march's own.
    ``displacement``: whether with that of the seat; ``stress``: the look at the reed's, if wanted.
    """
    prepared, choice, force = stepper.prepared, scene.accuracy.landing, touches.force_of(stepper)
    judged = measures.judged_landing(landings, choice, like)
    since = None if judged is None or stress is None else judged.start
    stresses = None if stress is None else stress(stepper, since)
    return measures.ContactRecord(
        force=force,
        dt=prepared.dt,
        filter_width=scene.run.filter_width,
        displacement=touches.displacement_of(stepper) if displacement else None,
        stress=stresses,
        line=scene.geometry.line(Division.from_greens(prepared.problem.target.greens), touches.parts_of(stepper)),
        film=touches.film_of(stepper),
        landings=landings,
        asked=choice,
        stress_since=since,
        strains=tuple(strains_of(scene.gauged, stepper).values()),
    )


def strains_of(gauged: Sequence[Gauged], stepper: impact.ContactStepper) -> Strains:
    """Return the strain at the gauges in a march."""
    striker, dt, stopper = stepper.prepared.problem.striker, stepper.prepared.dt, touches.stopper_force_of(stepper)
    return gauge_strains(gauged, striker, touches.force_of(stepper), stopper, dt, stepper.opening)


def fallback_step(run: Run, gas: CompressorGas | None, *bodies: GreensFunction) -> float:
    """Return the step of a method without one [s]: 1/4 rad of the highest rate, 1/20 of the filter, or `gas_step`."""
    limits = [run.filter_width / STEPS_PER_FILTER, run.duration / 200]
    limits += [1.0 / (STEPS_PER_RADIAN * rate) for rate in (body.highest_rate for body in bodies) if rate > 0]
    return min(*limits, gas_step(gas))


def gas_step(gas: CompressorGas | None) -> float:
    """Return the longest step for gas, `GAS_PER_DEGREE` times a degree of the crank [s]; inf without."""
    return math.inf if gas is None else gas.turn / 360 / GAS_PER_DEGREE / FOLLOW


def check_step(scene: Scene) -> None:
    """Raise `RunError` for a stated step or a seat that cannot serve, before anything expensive happens."""
    for role, body in (("reed", scene.reed), ("seat", scene.seat)):
        if body.slender is not None and (thick := body.slender.too_thick()):
            raise RunError(thick.replace("reed.", f"{role}."))
    if loose := scene.seat.loose:
        raise RunError(
            f"{loose}, so it has no static stiffness to compare with; clamp a face or add a support "
            "(foundation, bolted, absorbing with centre). seatfem modes shows the modes of a free body"
        )
    step, width = scene.run.time_step, scene.run.filter_width
    if width > scene.run.duration:
        raise RunError(
            f"run.filter_width = {write_quantity(width, 'time')} is longer than run.duration = "
            f"{write_quantity(scene.run.duration, 'time')}: state a shorter "
            "run.filter_width, or watch longer"
        )
    check_length(scene, width / LEAST_STEPS_PER_FILTER if step is None else step)
    if step is not None and step > (most := gas_step(scene.gas)):
        raise RunError(
            f"run.time_step = {write_quantity(step, 'time')} lets the gas follow the reed every "
            f"{write_quantity(FOLLOW * step, 'time')}, less than "
            f"{GAS_PER_DEGREE} times a degree of the crank at gas.rpm = {60 / scene.gas.turn if scene.gas else 0:g}: "
            f"use at most {write_quantity(most, 'time', 3)}"
        )
    if step is not None and 2 * step > width:
        raise RunError(
            f"run.time_step = {write_quantity(step, 'time')} does not resolve the mean peak force: at most "
            f"{write_quantity(width / 2, 'time')} "
            f"(half of run.filter_width = {write_quantity(width, 'time')}); use a shorter step or a wider filter"
        )


def check_length(scene: Scene, dt: float, parts: int | None = None) -> None:
    """Refuse more steps than can be stored, or than memory holds, and more contacts than these and time allow.

    ``parts``: of the seat's lip; ``None``: as far as the scene states them.
    """
    steps, room = scene.run.duration / dt, available_memory()
    contacts = parts or (scene.contact.ports or 1) * scene.contact.rings
    contacts += 0 if scene.stopper is None else scene.stopper.parts.count
    memory, seconds = CONTACT_BYTES * (contacts - 1) * steps, PAIR_TIME * contacts**2 * steps
    if contacts > 1 and (memory > room or seconds > LONGEST_MARCH):
        raise RunError(
            f"contact.ports and contact.rings with [stopper] make {contacts} contacts over {steps:.2g} steps: "
            f"predicted {memory / 1e9:.2g} GB of histories and {seconds / 3600:.2g} h, at most {room / 1e9:.2g} GB are "
            f"available and {LONGEST_MARCH / 3600:g} h are taken: state fewer contact.ports or contact.rings, shorten "
            "run.duration, or give a longer run.time_step"
        )
    most = min(MAX_STEPS, room / STEP_BYTES)
    if steps > most:
        chosen = "run.time_step" if scene.run.time_step else "the step that both bodies and run.filter_width need"
        raise RunError(
            f"run.duration = {write_quantity(scene.run.duration, 'time')} takes {steps:.2g} steps of "
            f"{write_quantity(dt, 'time', 2)} ({chosen}), at most "
            f"{most:.2g} are stored: shorten run.duration, widen run.filter_width, "
            f"{'' if scene.reed.slender is None else 'keep fewer reed.n_modes, '}or give a longer run.time_step"
        )
