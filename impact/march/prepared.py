"""A contact problem discretised at a fixed time step: bodies, their motion without contact, and the history engine."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.greens.modal import ModalGreens
from impact.march import history, laws, motion
from impact.march.loop.marches import active_set
from impact.march.problem import ContactError, ContactProblem, RigidContactError
from impact.quantities import brief, check_numbers

RULES = {"passive": laws.PASSIVE, "conserving": laws.CONSERVING, "blended": laws.BLENDED}
MOST_WEIGHTS = 8e9  # most bytes of the step weights between all contacts
MOST_STEPS = 200_000_000  # most steps of a run, which has some 10 arrays of this length


@dataclass(frozen=True)
class Discretised:
    """A contact problem at a fixed step ``dt`` [s]: its bodies in their state at t = 0.

    Attributes:
        bodies: the discretised bodies, striker first, in equilibrium with a preload.
        rest: (p,) contact forces of the static preload before t = 0 [N].
        rules: (p,) codes of the contacts' step rules.
        plan: history engines of the bodies.
    """

    problem: ContactProblem
    dt: float
    steps: int
    bodies: tuple[motion.Discrete, ...]
    rest: Array
    rules: NDArray[np.int64]
    plan: history.Plan

    __repr__ = brief

    def find_own(self, length: int = 1) -> Array:
        """Return W_0 (p, p), the displacement by a unit force at the end of its step of ``length`` dt [m/N]; that of
        bare springs for 0."""
        turns = (self.problem.directions(body.body) for body in self.bodies)
        parts = (t.T @ b.kernel.self_weight(length * self.dt) @ t for b, t in zip(self.bodies, turns, strict=True))
        return np.asarray(sum(parts))


@dataclass(frozen=True)
class Prepared(Discretised):
    """A discretised contact problem with its motion without contact, ready for equal steps.

    Attributes:
        free: (n + 1, p) gaps under the preload only [m].
        poles, weights: poles of the recursion, and (p, p, n) step weights of all else, (p, p, 0) if there is nothing
            else.
        own: (p, p) displacement by a unit force at the end of its own step, W_0 [m/N].
    """

    free: Array
    poles: history.Poles
    weights: Array
    own: Array

    __repr__ = brief


def discretise(
    problem: ContactProblem,
    dt: float,
    duration: float,
    rule: str = "auto",
    engine: history.Engine = "auto",
    block: int = 0,
    bodies: tuple[motion.Discrete, ...] = (),
) -> Discretised:
    """Discretise the bodies over a ``duration`` [s] at the step ``dt`` [s]; arguments and errors as in `prepare`."""
    n, rules = step_count(dt, duration), _rules(problem, rule)
    _refuse_ill_posed(problem)
    bodies = bodies or tuple(motion.Discrete.from_body(body, dt, n) for body in problem.bodies)
    stated = [(id(discrete.body), discrete.dt, discrete.loads.shape[1]) for discrete in bodies]
    if stated != [(id(body), dt, n) for body in problem.bodies]:
        raise ContactError(f"bodies must be those of the problem over {n} steps of {dt:g} s")
    rest = np.zeros(len(problem.contacts))
    if problem.preload:
        bodies, rest = _preloaded(problem, bodies, [problem.directions(b.body) for b in bodies])
    plan = history.choose([b.kernel for b in bodies], len(rest), n, engine, block)
    return Discretised(problem, dt, n, bodies, rest, rules, plan)


def prepare(
    problem: ContactProblem,
    dt: float,
    duration: float,
    rule: str = "auto",
    engine: history.Engine = "auto",
    block: int = 0,
    bodies: tuple[motion.Discrete, ...] = (),
) -> Prepared:
    """Discretise the bodies and their free motion over a ``duration`` [s] at the step ``dt`` [s].

    ``rule``: "passive", "conserving" or "blended", see `laws`; "auto": blended for elastic laws, else passive.
    ``engine``: history engine; ``block``: steps summed directly by the blocked FFT, 0: chosen. ``bodies``: the
    problem's bodies, if discretised already at this step and over this duration: several problems may share them.
    Raises `ContactError` for a problem that cannot be integrated, or ``bodies`` of another problem, step or duration.
    """
    return find_free_motion(discretise(problem, dt, duration, rule, engine, block, bodies))


def find_free_motion(discretised: Discretised) -> Prepared:
    """Return the problem with its gaps without contact, ready for equal steps."""
    known = {field.name: getattr(discretised, field.name) for field in fields(Discretised)}
    problem, bodies, n, own = discretised.problem, discretised.bodies, discretised.steps, discretised.find_own()
    turns = [problem.directions(b.body) for b in bodies]
    gaps = _free_gaps(problem, bodies, turns, n)
    poles, weights = _memory(bodies, turns, discretised.plan, own, n)
    return Prepared(**known, free=gaps, poles=poles, weights=weights, own=own)


def _free_gaps(problem: ContactProblem, bodies: tuple[motion.Discrete, ...], turns: list[Array], n: int) -> Array:
    """Return the (n + 1, p) gaps without contact forces, apart from the static preload."""
    gaps = np.tile([c.gap for c in problem.contacts], (n + 1, 1))
    for body, turn in zip(bodies, turns, strict=True):
        if body.moves_by_itself:
            gaps += (turn.T @ body.free_motion()).T
    gaps += problem.carried(np.asarray(bodies[0].dt * np.arange(n + 1), dtype=np.float64))
    return gaps


def _memory(
    bodies: tuple[motion.Discrete, ...], turns: list[Array], plan: history.Plan, own: Array, n: int
) -> tuple[history.Poles, Array]:
    """Return the poles of the recursion, and the (p, p, n) step weights of all else."""
    p, dt = len(own), bodies[0].dt
    recursive: list[tuple[ModalGreens, Array]] = []
    converted: list[tuple[ModalGreens, Array]] = []
    terms: list[Array] = []
    for body, turn, by_poles in zip(bodies, turns, plan.by_poles, strict=True):
        if body.kernel.modal is not None:
            (recursive if by_poles else converted).append((body.kernel.modal, turn))
        if body.kernel.weights is not None:
            terms.append(np.einsum("ic,ijn,jd->cdn", turn, body.kernel.weights, turn, optimize=True))
    if (converted or terms) and (need := 8.0 * p**2 * n) > MOST_WEIGHTS:
        raise ContactError(
            f"{p} contacts over {n} steps of {dt:g} s take {need / 1e9:.3g} GB of step weights (limit "
            f"{MOST_WEIGHTS / 1e9:g} GB): use fewer contacts or longer steps, or bodies that are sums of poles"
        )
    if converted:
        terms.append(history.Poles.from_modes(converted, dt, p).weights(own, n))
    weights = np.ascontiguousarray(sum(terms[1:], start=terms[0])) if terms else np.zeros((p, p, 0))
    if terms:
        weights[:, :, 0] = own
    return history.Poles.from_modes(recursive, dt, p), weights


def _preloaded(
    problem: ContactProblem, bodies: tuple[motion.Discrete, ...], turns: list[Array]
) -> tuple[tuple[motion.Discrete, ...], Array]:
    """Return bodies in static equilibrium with their loads and each other at t = 0, and the (p,) contact forces."""
    compliance = sum(t.T @ b.body.greens.static_compliance() @ t for b, t in zip(bodies, turns, strict=True))
    if not np.all(np.isfinite(compliance)):
        raise ContactError(
            "preload needs bodies that are held: one of them is free to move, nothing balances the force"
        )
    opening = np.array([c.gap for c in problem.contacts])
    at_rest = [body.body.load_amplitudes(np.zeros(1))[:, 0] for body in bodies]
    for body, turn, amplitudes in zip(bodies, turns, at_rest, strict=True):
        if body.body.is_deflected or body.body.velocity != 0.0:
            raise ContactError("preload starts from static equilibrium: give no initial state or velocity with it")
        g = body.body.greens.modal if body.body.loads else None
        for load, amplitude in zip(body.body.loads, amplitudes, strict=True):
            assert g is not None
            opening = opening + turn.T @ (g.shapes.T @ (load.shape * amplitude / g.omega**2))
    rest = np.zeros(len(opening))
    springs = [1.0 / c.law.parameters[0] if c.law.code == 1 else 0.0 for c in problem.contacts]
    if any(c.law.code > 1 for c in problem.contacts):
        raise ContactError(
            "preload is solved for rigid and linear-spring contacts; use impact.Signorini or LinearSpring"
        )
    active_set(compliance + np.diag(springs), -opening, rest)
    placed = []
    for b, turn, amplitudes in zip(bodies, turns, at_rest, strict=True):
        free = None
        if b.free is not None and np.array_equal(b.rest_loads, amplitudes):
            free = partial(_moved_on, b.free, b.body.greens.static_compliance() @ (turn @ rest))
        placed.append(motion.Discrete(b.body, b.kernel, b.dt, b.loads, turn @ rest, amplitudes, free))
    return tuple(placed), rest


def _moved_on(free: Callable[[], Array], moved: Array) -> Array:
    """Return the free motion with the static displacement ``moved`` (P,) by contact forces [m]."""
    return free() + moved[:, None]


def _rules(problem: ContactProblem, rule: str) -> NDArray[np.int64]:
    """Return the (p,) codes of the step rules."""
    if rule == "auto":
        return np.array([laws.BLENDED if contact.law.elastic else laws.PASSIVE for contact in problem.contacts])
    if rule not in RULES:
        raise ContactError(f"step rule {rule!r} is unknown; choose from auto, {', '.join(RULES)}")
    if rule != "passive":
        for contact in problem.contacts:
            if not contact.law.elastic:
                raise ContactError(
                    f"the {rule} step needs a contact law with a potential, {type(contact.law).__name__} has none; "
                    'use LinearSpring, Hertz, HertzOnPatch or HuntCrossley, the passive step, or rule="auto"'
                )
    return np.full(len(problem.contacts), RULES[rule])


def step_count(dt: float, duration: float) -> int:
    """Return the steps of ``dt`` [s] that cover ``duration`` [s]; raises `ContactError` for too many, or none."""
    check_numbers(ContactError, dt=dt, duration=duration)
    for name, value in (("dt", dt), ("duration", duration)):
        if not (value > 0 and math.isfinite(value)):
            raise ContactError(f"{name} = {value} s must be positive and finite")
    if duration < dt * (1 - 1e-9):
        raise ContactError(f"duration = {duration:g} s must be at least one step, dt = {dt:g} s")
    count = duration / dt
    if count > MOST_STEPS:
        raise ContactError(
            f"dt = {dt:g} s makes {count:.3g} steps of {duration:g} s (limit {MOST_STEPS:g}, what can be stored); "
            f"use dt >= {duration / MOST_STEPS:.2g} s, or a shorter duration"
        )
    return math.ceil(count * (1 - 1e-12))


def _refuse_ill_posed(problem: ContactProblem) -> None:
    """Raise `RigidContactError` for a rigid law between bodies with g(0+) = 0: its force would grow like 1/dt."""
    initial_values = {
        id(body): np.full(len(body.greens.ports), np.inf)
        if body.greens.modal is None
        else np.diag(body.greens.initial_value())
        for body in problem.bodies
    }
    for number, contact in enumerate(problem.contacts):
        if not isinstance(contact.law, laws.Signorini):
            continue
        pair = ((problem.striker, contact.striker_port), (contact.target, contact.port))
        if all(initial_values[id(body)][body.greens.port_index(port)] == 0.0 for body, port in pair):
            raise RigidContactError(
                f"contact {number}: neither body yields at once (no residual flexibility, g(0+) = 0) and the law is "
                "rigid: the force would grow like 1/dt; add a residual (impact.Residual) or use a compliant law"
            )
