"""What a run's answer should be read with: contacts not resolved, bodies that overlap at the start or fly apart."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from impact.advice import Advice
from impact.after.measures import closed_steps
from impact.after.result import pressed_in
from impact.greens.base import Array
from impact.march.laws import Signorini
from impact.march.problem import ContactProblem

FEWEST_STEPS = 10  # of a contact that counts as resolved; the impulse of shorter ones is off by a per cent and more
UNRESOLVED_LIMIT = 0.1  # of the impulse
DIGITS_LIMIT = 1e-6  # of the way that a contact yields
GAIN_LIMIT = 1e-6  # of the energy that a law took: what round-off of the gap may pretend, as by `DIGITS_LIMIT`


def contact_advice(force: Array, dt: float) -> Iterator[Advice]:
    """Yield advice on the share of the impulse of ``force`` (n, p) [N] in contacts of fewer than `FEWEST_STEPS` steps.

    One that the record's end cuts counts by its steps so far: where a force rises over n steps, 1/n of it is the
    step's.
    """
    total = float(force.sum())
    short, shortest = 0.0, FEWEST_STEPS
    for column in force.T:
        first, end = closed_steps(column).T
        brief, running = end - first < FEWEST_STEPS, np.concatenate([[0.0], np.cumsum(column)])
        short += float((running[end] - running[first])[brief].sum())
        shortest = min(shortest, int((end - first)[brief].min(initial=FEWEST_STEPS)))
    share = short / total if total > 0 else 0.0
    if share <= UNRESOLVED_LIMIT:
        return
    yield Advice(
        f"share of the impulse in contacts of fewer than {FEWEST_STEPS} steps",
        share,
        UNRESOLVED_LIMIT,
        "the step does not resolve them: their force and rebound are set by the step",
        f"use dt <= {dt * shortest / (2 * FEWEST_STEPS):.2g} s",
    )


def gain_advice(problem: ContactProblem, force: Array, gap: Array) -> Iterator[Advice]:
    """Yield advice on contact laws that give back more work than they took; force (n, p), gap (n + 1, p).

    Left out are contacts closed at the start or at the end, of whose work a part is not in the record, and rigid ones.
    """
    for number, contact in enumerate(problem.contacts):
        if isinstance(contact.law, Signorini):
            continue
        work, inside = force[:, number] * np.diff(gap[:, number]), gap[:, number] < 0
        closed = closed_steps(inside[:-1] | inside[1:] | (force[:, number] > 0))
        whole = [(a, b) for a, b in closed if not (inside[a] or inside[b])]
        took = np.array([-np.minimum(work[a:b], 0.0).sum() for a, b in whole])
        gained = np.array([work[a:b].sum() for a, b in whole])
        if not np.any(gained > GAIN_LIMIT * took.max(initial=0.0)):
            continue
        worst = int(np.argmax(gained))
        yield Advice(
            f"energy that the law of contact {number} gave back over what it took",
            1 + gained[worst] / took[worst] if took[worst] > 0 else np.inf,
            1 + GAIN_LIMIT,
            f"it put {gained[worst]:.3g} J into the bodies in one touch, which no contact without a source of energy "
            "does; the ledger counts it as a negative loss",
            "at each penetration the law's force must not be larger while the bodies part than while they close; if it "
            "is not, make the force rise with the penetration, which keeps a step from gaining energy",
        )


def overlap_advice(problem: ContactProblem, force: Array, gap: Array, dt: float) -> Iterator[Advice]:
    """Yield advice on rigid contacts closed at t = 0 without a preload; force (n, p), gap (n + 1, p)."""
    if problem.preload:
        return
    rigid = np.array([isinstance(c.law, Signorini) for c in problem.contacts])
    overlap = float(np.max(-gap[0, rigid], initial=0.0))
    if overlap <= 1e-12 * float(np.abs(gap).max()):
        return
    put_in = float(pressed_in(problem, force, gap)[-1])
    yield Advice(
        "overlap of rigid contacts at t = 0 [m]",
        overlap,
        0.0,
        f"the first step of {dt:.3g} s drives them apart, with a force that grows like 1/dt and gives energy: "
        f"{put_in:.3g} J, counted as put in",
        "start with a gap >= 0, give preload=True, or a compliant contact law",
    )


def digits_advice(deflection: float, force: Array, gap: Array, own: Array) -> Iterator[Advice]:
    """Yield advice on what round-off of the bodies' ``deflection`` [m] at t = 0 leaves of a gap; W_0 is ``own``.

    A gap is known to eps times the largest displacement. What it must resolve is the way that a contact yields under
    its largest force, W_0 N and the penetration; without contact, the gap itself.
    """
    yields = np.diag(own) * force.max(axis=0, initial=0.0) + np.maximum(-gap, 0.0).max(axis=0)
    touched = force.any(axis=0)
    scale = float(np.min(np.where(touched, yields, np.abs(gap).max(axis=0))))
    unknown = float(np.finfo(float).eps) * deflection
    if unknown <= DIGITS_LIMIT * scale:
        return
    yield Advice(
        "round-off of the gap over what the contact yields",
        unknown / scale if scale > 0 else np.inf,
        DIGITS_LIMIT,
        f"a body is deflected by {deflection:.3g} m at the start, so that the gap is known to {unknown:.2g} m only",
        "check the units of loads and stiffnesses; measure displacements from the loaded state, or hold the body",
    )


def direction_advice(problem: ContactProblem, force: Array) -> Iterator[Advice]:
    """Yield advice on bodies that fly apart and never touch, ``force`` (n + 1, p) [N], as by a velocity's sign."""
    striker = problem.striker
    pushed = striker.state is not None or striker.loads or any(t.state is not None or t.loads for t in problem.targets)
    if pushed or force.any():
        return
    apart = [c.side * (striker.velocity - c.target.velocity) for c in problem.contacts]
    if striker.velocity == 0.0 or min(apart) <= 0.0:
        return
    yield Advice(
        "velocity of the striker [m/s]",
        striker.velocity,
        0.0,
        "it flies away from the target and never touches it",
        f"velocities are along the normal, from target to striker: towards the target write velocity = "
        f"{-striker.velocity:.3g}",
    )


def unsolved_advice(unsolved: int, steps: int) -> Iterator[Advice]:
    """Yield advice on steps whose several contact forces the iteration did not find."""
    if unsolved == 0:
        return
    yield Advice(
        "share of the steps whose contact forces were not found to 1e-12",
        unsolved / steps,
        0.0,
        "stiff contacts act almost at one place, and the forces of these steps are rough",
        "merge contacts that coincide, use a shorter step or a softer law",
    )
