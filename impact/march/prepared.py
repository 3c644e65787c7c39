"""A contact problem made ready to march: bodies and their free motion at a fixed step, what is refused beforehand."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impact.brief import brief
from impact.greens.base import Array
from impact.greens.modal import ModalGreens
from impact.march import engines, history
from impact.march.engines import Engine
from impact.march.flight import Flight, Flying, parted
from impact.march.laws import BLENDED, CONSERVING, PASSIVE, Signorini
from impact.march.loop.complementarity import active_set
from impact.march.motion import Discrete
from impact.march.problem import ContactError, ContactProblem

RULES = {"passive": PASSIVE, "conserving": CONSERVING, "blended": BLENDED}
MOST_WEIGHTS = 8e9  # bytes of the step weights between all contacts
MOST_STEPS = 2e8  # histories of a run: some 10 arrays of this length


@dataclass(frozen=True)
class Prepared:
    """A contact problem at a fixed step ``dt`` [s], ready to march.

    Attributes:
        bodies: the discretised bodies, striker first.
        free: (n + 1, p) gaps without contact forces beyond the preload [m].
        rest: (p,) contact forces carried since ever [N].
        poles, weights: the poles that are marched, and the (p, p, n) step weights of the rest, (p, p, 0) of nothing.
        own: (p, p) W_0 [m/N].
        rules: (p,) codes of the contacts' step rules.
        plan, flight: which engine remembers what; free bodies under loads, if there are any.
    """

    problem: ContactProblem
    dt: float
    steps: int
    bodies: tuple[Discrete, ...]
    free: Array
    rest: Array
    poles: history.Poles
    weights: Array
    own: Array
    rules: NDArray[np.int64]
    plan: engines.Plan
    flight: Flight | None = None

    __repr__ = brief


def prepare(
    problem: ContactProblem,
    dt: float,
    duration: float,
    rule: str = "auto",
    engine: Engine = "auto",
    block: int | None = None,
    bodies: tuple[Discrete, ...] | None = None,
) -> Prepared:
    """Discretise the bodies and their free motion over a ``duration`` [s] at the step ``dt`` [s].

    ``rule``: "passive", "conserving" or "blended", see `laws`; "auto": blended for elastic laws, else passive.
    ``engine``: which remembers the past; ``block``: steps summed directly by the blocked FFT. ``bodies``: the
    problem's, where they are discretised already at this step and over this duration: several problems may share them.
    Raises `ContactError`: what cannot be marched; ``bodies`` of another problem, step or duration.
    """
    n, rules = step_count(dt, duration), _rules(problem, rule)
    _refuse_ill_posed(problem)
    if bodies is None:
        bodies = tuple(Discrete.from_body(body, dt, n) for body in problem.bodies)
    stated = [(id(discrete.body), discrete.dt, discrete.loads.shape[1]) for discrete in bodies]
    if stated != [(id(body), dt, n) for body in problem.bodies]:
        raise ContactError(f"bodies must be those of the problem over {n} steps of {dt:g} s")
    turns = [problem.directions(b.body) for b in bodies]
    rest = np.zeros(len(problem.contacts))
    if problem.preload:
        bodies, rest = _preloaded(problem, bodies, turns)
    p = len(rest)
    own = np.zeros((p, p))
    for body, turn in zip(bodies, turns, strict=True):
        own += turn.T @ body.kernel.self_weight(dt) @ turn
    gaps = _free_gaps(problem, bodies, turns, n)
    plan = engines.choose([b.kernel for b in bodies], p, n, engine, block)
    parts, flying = parted(bodies, turns)
    poles, weights = _memory(parts, flying, turns, plan, own, n)
    flight = None
    if flying:  # in the order of `_memory`
        psi = np.concatenate([(part.free.shapes @ part.turn).T for part in flying], axis=1)
        start = np.concatenate([part.start for part in flying], axis=1)
        drive = np.concatenate([part.drive for part in flying])
        flight = Flight(psi, start, drive, _free_gaps(problem, parts, turns, n))
    return Prepared(problem, dt, n, bodies, gaps, rest, poles, weights, own, rules, plan, flight)


def _free_gaps(problem: ContactProblem, bodies: tuple[Discrete, ...], turns: list[Array], n: int) -> Array:
    """Return the (n + 1, p) gaps without contact forces beyond those at rest."""
    gaps = np.tile([c.gap for c in problem.contacts], (n + 1, 1))
    for body, turn in zip(bodies, turns, strict=True):
        if body.moves_by_itself:
            gaps += (turn.T @ body.free_motion()).T
    if (carried := problem.carried(np.asarray(bodies[0].dt * np.arange(n + 1), dtype=np.float64))) is not None:
        gaps += carried
    return gaps


def _memory(
    parts: tuple[Discrete, ...], flying: list[Flying], turns: list[Array], plan: engines.Plan, own: Array, n: int
) -> tuple[history.Poles, Array]:
    """Return poles to march and the (p, p, n) step weights of all the rest; what flies is marched with every engine."""
    p, dt = len(own), parts[0].dt
    marched: list[tuple[ModalGreens, Array]] = []
    turned: list[tuple[ModalGreens, Array]] = []
    terms: list[Array] = []
    for body, turn, by_poles in zip(parts, turns, plan.by_poles, strict=True):
        if body.kernel.modal is not None:
            (marched if by_poles else turned).append((body.kernel.modal, turn))
        if body.kernel.weights is not None:
            terms.append(np.einsum("ic,ijn,jd->cdn", turn, body.kernel.weights, turn, optimize=True))
    if (turned or terms) and (need := 8.0 * p**2 * n) > MOST_WEIGHTS:
        raise ContactError(
            f"{p} contacts over {n} steps of {dt:g} s take {need / 1e9:.3g} GB of step weights (limit "
            f"{MOST_WEIGHTS / 1e9:g} GB): use fewer contacts or longer steps, or bodies that are sums of poles"
        )
    if turned:
        terms.append(history.Poles.from_modes(turned, dt, p).weights(own, n))
    weights = np.ascontiguousarray(sum(terms[1:], start=terms[0])) if terms else np.zeros((p, p, 0))
    if terms:
        weights[:, :, 0] = own
    return history.Poles.from_modes([*marched, *((part.free, part.turn) for part in flying)], dt, p), weights


def _preloaded(
    problem: ContactProblem, bodies: tuple[Discrete, ...], turns: list[Array]
) -> tuple[tuple[Discrete, ...], Array]:
    """Return bodies in static equilibrium with their loads and each other at t = 0, and the contact forces then."""
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
    placed = tuple(
        Discrete(b.body, b.kernel, b.dt, b.loads, turn @ rest, amplitudes)
        for b, turn, amplitudes in zip(bodies, turns, at_rest, strict=True)
    )
    return placed, rest


def _rules(problem: ContactProblem, rule: str) -> NDArray[np.int64]:
    """Return the (p,) codes."""
    if rule == "auto":
        return np.array([BLENDED if contact.law.elastic else PASSIVE for contact in problem.contacts])
    if rule not in RULES:
        raise ContactError(f"step rule {rule!r} is unknown; choose from auto, {', '.join(RULES)}")
    if rule != "passive":
        for contact in problem.contacts:
            if not contact.law.elastic:
                raise ContactError(
                    f"the {rule} step needs a contact law with a potential, {type(contact.law).__name__} has none; "
                    'use LinearSpring, Hertz or HuntCrossley, the passive step, or rule="auto"'
                )
    return np.full(len(problem.contacts), RULES[rule])


def step_count(dt: float, duration: float) -> int:
    """Return the steps of ``dt`` [s] that cover ``duration`` [s]; raises `ContactError` for too many, or none."""
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
    """Raise `ContactError` for a rigid law between two bodies that start like t: its force would grow like 1/dt."""
    modes = [body for body in problem.bodies if body.greens.modal is not None]
    at_once = {id(body): np.diag(body.greens.initial_value()) for body in modes}
    for number, contact in enumerate(problem.contacts):
        if not isinstance(contact.law, Signorini):
            continue
        pair = ((problem.striker, contact.striker_port), (contact.target, contact.port))
        if all(id(body) in at_once and at_once[id(body)][body.greens.port_index(port)] == 0.0 for body, port in pair):
            raise ContactError(
                f"contact {number}: neither body yields at once (no residual flexibility, g(0+) = 0) and the law is "
                "rigid: the force would grow like 1/dt; add a residual (impact.Residual) or use a compliant law"
            )
