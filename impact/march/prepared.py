"""A contact problem discretised at a fixed time step: bodies, their motion without contact, and the history engine.

If the fall of a free mass under its load and its lift by contact forces were integrated separately, both would grow
like t^2 and cancel: after n steps the gap would have an error of eps n^2 load h^2/m. Therefore rigid-body motion is
restarted from the sum of both at the end of every block of steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from impact.bodies.body import Body, ModalState
from impact.greens.base import Array
from impact.greens.modal import ModalGreens, Residual
from impact.march import history, laws, motion, replay
from impact.march.loop.marches import active_set
from impact.march.problem import ContactError, ContactProblem, RigidContactError
from impact.quantities import brief, check_numbers

BLOCK = 512  # steps of free flight that are computed at once


@dataclass(frozen=True)
class Flight:
    """The R rigid-body modes under loads that move a contact.

    ``psi`` (p, R): change of the gaps per unit of each modal coordinate; these modes are the last R poles of the time
    loop. ``start`` (2, R): coordinates and rates at t = 0; ``drive`` (R, n): modal forces of the loads, constant over
    each step; ``others`` (n + 1, p): gaps without contact and without these modes.
    """

    psi: Array
    start: Array
    drive: Array
    others: Array


@dataclass(frozen=True)
class Flying:
    """Rigid-body modes under loads of one body (``free``), with the directions ``turn`` (P, p) of the contacts."""

    free: ModalGreens
    turn: Array
    start: Array
    drive: Array


def split_rigid_modes(
    bodies: tuple[motion.DiscreteBody, ...], turns: list[Array]
) -> tuple[tuple[motion.DiscreteBody, ...], list[Flying]]:
    """Return the bodies without their rigid-body modes under loads, and these modes; ``turns``: (P, p) directions of
    the contacts on each body."""
    parts, flying = list(bodies), []
    for number, (discrete, turn) in enumerate(zip(bodies, turns, strict=True)):
        body, g = discrete.body, discrete.body.greens.modal if discrete.body.loads else None
        if g is None or not any(np.any(load.shape[g.omega == 0]) for load in body.loads):
            continue  # no load acts on a rigid-body mode
        rigid, start = g.omega == 0, body.modal_start()
        held, free = g.select_modes(~rigid, g.residual), g.select_modes(rigid, Residual.none(len(g.ports)))
        bends = bool(np.any(~rigid))
        state = ModalState(start.displacement[~rigid], start.velocity[~rigid]) if bends else None
        loads = tuple(replace(load, shape=load.shape[~rigid]) for load in body.loads if bends)
        kernel, amplitudes = held.step_kernel(discrete.dt, discrete.loads.shape[1]), discrete.loads[: len(loads)]
        rest_loads, still = np.zeros(len(loads)), Body(held, 0.0, state, loads)
        parts[number] = motion.DiscreteBody(still, kernel, discrete.dt, amplitudes, discrete.rest, rest_loads)
        drive = np.stack([load.shape[rigid] for load in body.loads], axis=1) @ discrete.loads
        if np.any(seen := np.any(free.shapes @ turn != 0, axis=1)):
            now = np.array([start.displacement[rigid], start.velocity[rigid]])
            flying.append(Flying(free.select_modes(seen, free.residual), turn, now[:, seen], drive[seen]))
    return tuple(parts), flying


class Pilot:
    """Adds the rigid-body motion of `Flight`, block by block, to the gaps without contact.

    Attributes:
        base: (2, R) modal coordinates and rates, contacts included, at the start of the present block.
    """

    def __init__(self, flight: Flight, dt: float, free: Array) -> None:
        self._flight, self._dt, self._free = flight, dt, free
        self.base = flight.start.copy()
        self._end = self._add_block(0)

    def resume(self, done: int) -> None:
        """Continue after ``base`` was replaced for the block with step ``done``."""
        self._end = self._add_block(done - done % BLOCK)

    def turn(self, done: int, state: tuple[Array, Array], last: Array, folded: bool) -> None:
        """Transfer, at the end of a block, the motion in the poles' ``state`` to a new base.

        The time loop applies the last forces ``last`` (p,) to the poles with the next step only; their effect is
        transferred too, and its negative left in the poles.
        """
        h, psi, count = self._dt, self._flight.psi, self.base.shape[1]
        q, p = (part[-count:] for part in state)
        scale = psi[0] if folded else np.ones(count)  # one contact: the poles hold psi times the coordinate
        push = last @ psi
        self.base = self._end + np.array([q / scale + h * h / 2 * push, p / (scale * h) + h * push])
        q[:], p[:] = -scale * h * h / 2 * push, -scale * h * h * push
        self._end = self._add_block(done)

    def _add_block(self, first: int) -> Array:
        """Add the rigid-body motion of the block from step ``first`` to the gaps; return its final state (2, R)."""
        h, drive = self._dt, self._flight.drive[:, first : first + BLOCK]
        if drive.shape[1] == 0:
            return self.base.copy()
        places, rates = np.empty_like(drive), np.empty_like(drive)
        for row in range(len(drive)):
            replay.translate(h, replay.rigid_state(*self.base[:, row]), drive[row], places[row], rates[row])
        self._free[first : first + drive.shape[1]] += (self._flight.psi @ places).T
        return np.array([places[:, -1], rates[:, -1]])


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
    bodies: tuple[motion.DiscreteBody, ...]
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
        flight: rigid-body modes under loads, if there are any.
    """

    free: Array
    poles: history.Poles
    weights: Array
    own: Array
    flight: Flight | None = None

    __repr__ = brief


def discretise(
    problem: ContactProblem,
    dt: float,
    duration: float,
    rule: str = "auto",
    engine: history.Engine = "auto",
    block: int = 0,
    bodies: tuple[motion.DiscreteBody, ...] = (),
) -> Discretised:
    """Discretise the bodies over a ``duration`` [s] at the step ``dt`` [s]; arguments and errors as in `prepare`."""
    n, rules = step_count(dt, duration), _rules(problem, rule)
    _refuse_ill_posed(problem)
    bodies = bodies or tuple(motion.DiscreteBody.from_body(body, dt, n) for body in problem.bodies)
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
    bodies: tuple[motion.DiscreteBody, ...] = (),
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
    parts, flying = split_rigid_modes(bodies, turns)
    poles, weights = _memory(parts, flying, turns, discretised.plan, own, n)
    flight = None
    if flying:  # in the order of `_memory`
        psi = np.concatenate([(part.free.shapes @ part.turn).T for part in flying], axis=1)
        start = np.concatenate([part.start for part in flying], axis=1)
        drive = np.concatenate([part.drive for part in flying])
        flight = Flight(psi, start, drive, _free_gaps(problem, parts, turns, n))
    return Prepared(**known, free=gaps, poles=poles, weights=weights, own=own, flight=flight)


def _free_gaps(problem: ContactProblem, bodies: tuple[motion.DiscreteBody, ...], turns: list[Array], n: int) -> Array:
    """Return the (n + 1, p) gaps without contact forces, apart from the static preload."""
    gaps = np.tile([c.gap for c in problem.contacts], (n + 1, 1))
    for body, turn in zip(bodies, turns, strict=True):
        if body.moves_by_itself:
            gaps += (turn.T @ body.free_motion()).T
    gaps += problem.find_base_gaps(np.asarray(bodies[0].dt * np.arange(n + 1), dtype=np.float64))
    return gaps


def _memory(
    parts: tuple[motion.DiscreteBody, ...],
    flying: list[Flying],
    turns: list[Array],
    plan: history.Plan,
    own: Array,
    n: int,
) -> tuple[history.Poles, Array]:
    """Return the poles of the recursion, rigid-body modes of `Flying` always among them, and the (p, p, n) step weights
    of all else."""
    p, dt = len(own), parts[0].dt
    recursive: list[tuple[ModalGreens, Array]] = []
    converted: list[tuple[ModalGreens, Array]] = []
    terms: list[Array] = []
    for body, turn, by_poles in zip(parts, turns, plan.by_poles, strict=True):
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
    return history.Poles.from_modes([*recursive, *((part.free, part.turn) for part in flying)], dt, p), weights


def _preloaded(
    problem: ContactProblem, bodies: tuple[motion.DiscreteBody, ...], turns: list[Array]
) -> tuple[tuple[motion.DiscreteBody, ...], Array]:
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
        placed.append(motion.DiscreteBody(b.body, b.kernel, b.dt, b.loads, turn @ rest, amplitudes, free))
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
