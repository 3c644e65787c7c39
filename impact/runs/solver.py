"""Solve a contact problem: collect what the stepper does."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from impact.advice import Advice
from impact.after.advice import (
    contact_advice,
    digits_advice,
    direction_advice,
    gain_advice,
    overlap_advice,
    unsolved_advice,
)
from impact.after.result import EnergyLedger, ImpactResult, ledger
from impact.bodies.body import Body
from impact.greens.base import Array
from impact.march.engines import Engine
from impact.march.motion import Motion
from impact.march.prepared import Prepared, prepare
from impact.march.problem import ContactError, ContactProblem
from impact.march.stepper import ContactStepper
from impact.measured.reading import sampling_advice
from impact.progress import Progress, silent
from impact.quantities import percent

RESOLUTION_LIMIT = 0.5  # w_max h: above it the step's own damping is felt in the highest retained mode


def solve(
    problem: ContactProblem,
    *,
    dt: float,
    duration: float,
    rule: str = "auto",
    engine: Engine = "auto",
    block: int | None = None,
    progress: Progress = silent,
) -> ImpactResult:
    """March the contact problem over ``duration`` [s] with the step ``dt`` [s].

    ``rule`` is the step rule of `march.laws`: "auto" takes "blended" for laws with a potential, of second order while
    the contact is resolved, else "passive", of first order where the force jumps or the bodies part. Both never gain
    energy; "conserving" loses none in an elastic contact, and rings where the step does not resolve it.

    ``engine`` remembers the past: "poles" (exact recursion of modal bodies), "fft" (step weights of all bodies, in
    blocks), "direct" (the same weights summed term by term), or "auto", the cheapest mix by a measured cost model;
    ``result.engine`` says which. ``block`` is the number of steps that the FFT leaves to the direct sum.

    Raises:
        ContactError: a step or duration that is not positive; two bodies without any immediate response
            (no residual flexibility and no g(0+)) under a rigid law, whose force would grow like 1/dt; a rule that
            the law cannot follow; an engine that a body cannot be run by; a preload on bodies that nothing holds.
    """
    prepared = prepare(problem, dt, duration, rule, engine, block)
    stepper = ContactStepper(prepared, flying=True)
    chunk = max(512, -(-prepared.steps // 50))
    while stepper.done < prepared.steps:
        stepper.advance(chunk)
        progress("stepping", stepper.done / prepared.steps)
    return collect(stepper)


def collect(stepper: ContactStepper) -> ImpactResult:
    """Return the result of the steps marched so far; `ContactError` where numbers have left the range of floats."""
    s, n = stepper.prepared, stepper.done
    force = stepper.force[:n]
    striker = replace(s.bodies[0], loads=s.bodies[0].loads + stepper.live.amplitudes)
    bodies = (striker, *s.bodies[1:])
    motions = tuple(b.motion(s.problem.directions(b.body) @ force.T) for b in bodies)
    time = np.asarray(s.dt * np.arange(n + 1), dtype=np.float64)
    carried = s.problem.carried(time)
    gap = np.array([c.gap for c in s.problem.contacts]) + (0.0 if carried is None else carried)
    for body, motion in zip(bodies, motions, strict=True):
        gap = gap + (s.problem.directions(body.body).T @ motion.displacement).T
    deflection = max(float(np.abs(motion.displacement[:, 0]).max()) for motion in motions)
    if np.any(s.rest):  # or of what adds up to it: the contact forces at rest alone
        at_rest = [body.body.greens.static_compliance() @ body.rest for body in bodies]
        deflection = max(deflection, *(float(np.abs(moved).max()) for moved in at_rest))
    film = stepper.film[:n] if stepper.film.size else None
    energy = ledger(s.problem, motions, force, gap, film, carried)
    single = len(s.rest) == 1
    whole = np.concatenate([s.rest[None], force])
    pulls = None if film is None else np.concatenate([np.zeros((1, len(s.rest))), film])
    solid = force if film is None else force - film
    first = s.problem.contacts[0]
    for history in (whole, gap, *(motion.displacement.T for motion in motions), energy.stored, energy.dissipated):
        if np.any(bad := ~np.isfinite(history)):
            when = int(np.flatnonzero(bad.reshape(len(history), -1).any(axis=1))[0]) * s.dt
            raise ContactError(
                f"forces, motions or energies leave the range of numbers at {when:.3g} s: some mass, stiffness, "
                "shape or velocity is beyond all measure; check their units"
            )
    return ImpactResult(
        time=time,
        force=whole[:, 0] if single else whole,
        gap=gap[:, 0] if single else gap,
        striker_displacement=_at_contacts(s, motions, single, of_striker=True),
        target_displacement=_at_contacts(s, motions, single, of_striker=False),
        energy=energy,
        dt=s.dt,
        striker_mass=s.problem.striker.greens.mass(first.striker_port),
        target_mass=first.target.greens.mass(first.port),
        striker_velocity=_speed_at_start(s.problem.striker, first.striker_port, s.dt),
        target_velocity=_speed_at_start(first.target, first.port, s.dt),
        engine=s.plan.words,
        advice=(
            *unsolved_advice(stepper.unsolved, n),
            *_advice(s, energy),
            *overlap_advice(s.problem, solid, gap, s.dt),
            *digits_advice(deflection, force, gap, s.own),
            *gain_advice(s.problem, solid, gap),
            *contact_advice(solid, s.dt),
            *direction_advice(s.problem, whole),
        ),
        film=None if pulls is None else pulls[:, 0] if single else pulls,
    )


def _speed_at_start(body: Body, port: str | int, dt: float) -> float:
    """Return the initial translation of a port [m/s], and of the body's base over the first step."""
    start, end = body.carried(np.array([0.0, dt]))
    return body.velocity_of(port) + float(end - start) / dt


def _at_contacts(s: Prepared, motions: tuple[Motion, ...], single: bool, *, of_striker: bool) -> Array:
    """Return the (n + 1,) or (n + 1, p) displacements of the striker or of the targets at the contacts."""
    columns = []
    for contact in s.problem.contacts:
        body = s.problem.striker if of_striker else contact.target
        number = next(i for i, b in enumerate(s.bodies) if b.body is body)
        port = contact.striker_port if of_striker else contact.port
        moved = motions[number].displacement[body.greens.port_index(port)]
        times = np.asarray(s.dt * np.arange(len(moved)), dtype=np.float64)
        columns.append(moved if body.base is None else moved + body.carried(times))
    return columns[0] if single else np.stack(columns, axis=1)


def _advice(s: Prepared, energy: EnergyLedger) -> Iterator[Advice]:
    for number, body in enumerate(s.bodies):
        g = body.body.greens
        name = "striker" if number == 0 else "target"
        yield from sampling_advice(g, s.dt, s.steps, body=name)
        highest = 0.0 if g.modal is None else g.highest_rate
        if highest * s.dt > RESOLUTION_LIMIT:
            lost = float(energy.contact_loss[-1] / max(energy.input[-1], np.finfo(float).tiny))
            yield Advice(
                f"highest {name} frequency times step",
                highest * s.dt,
                RESOLUTION_LIMIT,
                f"the step damps the highest modes; contact and step together took {percent(lost)} of the energy",
                f"use dt <= {RESOLUTION_LIMIT / highest:.2g} s, or fewer modes",
            )
