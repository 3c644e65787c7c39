"""The march over time, one step or many at a time, in the hands of the user.

At the end of each step

    gap = gap0 + free motion + sum over contacts of (g_striker + g_target) * N,   N = law(-gap) >= 0,

with N constant over the step and the convolutions exact for such N.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impact.brief import brief
from impact.greens.base import Array
from impact.greens.modal import ModalGreens
from impact.march import engines, history
from impact.march import loop as march
from impact.march.engines import Engine
from impact.march.flight import BLOCK as FLIGHT
from impact.march.flight import Flight, Flying, Pilot, parted
from impact.march.laws import BLENDED, CONSERVING, PASSIVE, PlainLaw, Signorini, no_user_law
from impact.march.motion import Discrete, LiveLoads
from impact.march.problem import ContactError, ContactProblem
from impact.march.strides import Strides

RULES = {"passive": PASSIVE, "conserving": CONSERVING, "blended": BLENDED}
FOLLOW = 32  # steps for which a load that depends on the opening keeps what it has in their middle
MOST_STEPS = 2e8  # histories of a run: some 10 arrays of this length


@dataclass(frozen=True)
class Prepared:
    """A contact problem at a fixed step, ready to march.

    Attributes:
        problem, dt, steps: what is solved, the step [s] and their number.
        bodies: the discretised bodies, striker first.
        free: (n + 1, p) gaps without contact forces beyond the preload [m].
        rest: (p,) contact forces carried since ever [N].
        poles: the poles that are marched, seen from the contacts.
        weights: (p, p, n) step weights of the gaps, or (p, p, 0) without.
        own: (p, p) W_0 [m/N].
        rules: (p,) codes of the contacts' step rules.
        plan: which engine remembers what.
        flight: free bodies under loads, if there are any.
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


@dataclass(frozen=True)
class StepState:
    """Where the march stands: time [s], force (p,) of the step just done [N], gap (p,) at its end [m]."""

    time: float
    force: Array
    gap: Array

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
    """Discretise the bodies and their free motion.

    Args:
        problem: what touches.
        dt: step [s].
        duration: of the run [s].
        rule: "passive", "conserving" or "blended", see `laws`; "auto": blended for elastic laws, else passive.
        engine: which remembers the past.
        block: steps summed directly by the blocked FFT.
        bodies: the problem's bodies where they are discretised already, at this step and over this duration: several
            problems may share them.

    Raises:
        ContactError: what cannot be marched; ``bodies`` of another problem, step or duration.
    """
    n, rules = step_count(dt, duration), _rules(problem, rule)
    _refuse_ill_posed(problem)
    if bodies is None:
        bodies = tuple(Discrete.of(body, dt, n) for body in problem.bodies)
    _refuse_other(problem, bodies, dt, n)
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
    flight = _flight(problem, parts, flying, turns, n)
    return Prepared(problem, dt, n, bodies, gaps, rest, poles, weights, own, rules, plan, flight)


def _free_gaps(problem: ContactProblem, bodies: tuple[Discrete, ...], turns: list[Array], n: int) -> Array:
    """(n + 1, p) gaps without contact forces beyond those at rest."""
    gaps = np.tile([c.gap for c in problem.contacts], (n + 1, 1))
    for body, turn in zip(bodies, turns, strict=True):
        if body.moves_by_itself:
            gaps += (turn.T @ body.free_motion()).T
    if (carried := problem.carried(np.asarray(bodies[0].dt * np.arange(n + 1), dtype=np.float64))) is not None:
        gaps += carried
    return gaps


def _flight(
    problem: ContactProblem, parts: tuple[Discrete, ...], flying: list[Flying], turns: list[Array], n: int
) -> Flight | None:
    """The loaded translations of all bodies, those that a contact sees, in the order of `_memory`."""
    seen = [np.any(part.free.shapes @ part.turn != 0, axis=1) for part in flying]
    if not any(np.any(here) for here in seen):
        return None
    each = list(zip(flying, seen, strict=True))
    return Flight(
        np.concatenate([(part.free.shapes @ part.turn)[here].T for part, here in each], axis=1),
        np.concatenate([part.start[:, here] for part, here in each], axis=1),
        np.concatenate([part.drive[here] for part, here in each]),
        _free_gaps(problem, parts, turns, n),
    )


def _memory(
    parts: tuple[Discrete, ...], flying: list[Flying], turns: list[Array], plan: engines.Plan, own: Array, n: int
) -> tuple[history.Poles, Array]:
    """The poles to march and the (p, p, n) step weights of all the rest; what flies is marched with every engine."""
    p, dt = len(own), parts[0].dt
    marched: list[tuple[ModalGreens, Array]] = []
    turned: list[tuple[ModalGreens, Array]] = []
    found: list[Array] = []
    for body, turn, by_poles in zip(parts, turns, plan.by_poles, strict=True):
        if body.kernel.modal is not None:
            (marched if by_poles else turned).append((body.kernel.modal, turn))
        if body.kernel.weights is not None:
            found.append(np.einsum("ic,ijn,jd->cdn", turn, body.kernel.weights, turn, optimize=True))
    if turned:
        found.append(history.Poles.of(turned, dt, p).weights(own, n))
    weights = np.ascontiguousarray(sum(found[1:], start=found[0])) if found else np.zeros((p, p, 0))
    if found:
        weights[:, :, 0] = own
    return history.Poles.of([*marched, *((part.free, part.turn) for part in flying)], dt, p), weights


class ContactStepper:
    """Marches a prepared problem, in the hands of the user; `impact.collect` makes a result of the steps done.

    `step` goes one step and takes forces that depend on what happened so far (co-simulation); `advance` goes many.
    The state (`checkpoint`) is all it takes to go on later: split runs equal single runs bit for bit.

    Attributes:
        prepared: the problem.
        done: steps marched.
        force: (n, p) force of each step [N], filled as it goes.
        gap: (n + 1, p) openings [m].
        film: (n, p) the films' part of the force [N]; (n, 0) where no contact has one.
        unsolved: steps (since a restart) whose several forces were not found to 1e-12.
    """

    def __init__(self, prepared: Prepared, *, flying: bool = False) -> None:
        """``flying``: take flight in long strides where all is marched by poles (`impact.march.strides`); the forces
        are the same to round-off, ``gap`` is exact at their ends and interpolated in between."""
        p, n = len(prepared.rest), prepared.steps
        self.prepared = prepared
        self.done = 0
        self.force = np.zeros((p, n)).T
        self.gap = np.zeros((n + 1, p))
        films = np.array([c.film_parameters for c in prepared.problem.contacts])
        self._films = films if np.any(films) else None
        self.film = np.zeros((0 if self._films is None else p, n)).T
        self.gap[0] = prepared.free[0]
        self.unsolved = 0
        striker = prepared.bodies[0]
        self.live = LiveLoads(striker, prepared.problem.directions(striker.body), n)
        self._free = prepared.free[1:].copy() if striker.body.loads else prepared.free[1:]
        self._pilot: Pilot | None = None
        if prepared.flight is not None:
            self._free = prepared.flight.others[1:].copy()
            self._pilot = Pilot(prepared.flight, prepared.dt, self._free)
        poles = prepared.poles
        self._rows, self._state = history.streams(poles.folded() if p == 1 else poles.steps)
        self._along = poles.along()
        self._strides = Strides.none()
        if flying and prepared.weights.size == 0 and not self.live.follows:
            self._strides = Strides.of(poles.folded() if p == 1 else poles.steps, _carried(prepared), n)
        self._past = history.BlockedSum(prepared.weights, prepared.plan.block)
        contacts = prepared.problem.contacts
        seats = np.array([c.side > 0 for c in contacts])
        seats = seats if np.any(seats) else ~seats
        self._seats = seats / np.count_nonzero(seats)
        self._user = next((c.law.compiled for c in contacts if hasattr(c.law, "compiled")), None) or no_user_law()
        self._laws = (
            np.array([c.law.code for c in contacts]),
            prepared.rules,
            np.array([c.law.parameters for c in contacts]),
        )

    def __repr__(self) -> str:
        s = self.prepared
        return f"ContactStepper, {self.done} of {s.steps} steps of {s.dt:g} s, {len(s.rest)} contacts; {s.plan.words}"

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.done * self.prepared.dt

    @property
    def state(self) -> StepState:
        """Where the march stands; before the first step the force is the preload."""
        force = self.force[self.done - 1] if self.done else self.prepared.rest
        return StepState(self.time, force.copy(), self.gap[self.done].copy())

    def step(self, loads: Array | None = None) -> StepState:
        """One step, during which ``loads`` (L,) [N] act beside the striker's own loads, constant over the step.

        ``loads[i]`` is added to the amplitude of ``striker.loads[i]``; for a force known only here, give the body
        ``Load(shape, numpy.zeros_like)``. The result's energy ledger counts its work.

        Raises:
            ContactError: the run is over; loads that are not L finite numbers.
        """
        if self.done == self.prepared.steps:
            raise ContactError(f"the run is over after {self.done} steps; prepare it with a longer duration")
        if loads is not None:
            self.live.record(self.done, loads)
        self.advance(1)
        return self.state

    def advance(self, steps: int = 1) -> None:
        """March up to ``steps`` steps (less at the end of the run)."""
        stop = min(self.done + steps, self.prepared.steps)
        while self.live.follows and self.done < stop:
            first = self.done - self.done % FOLLOW
            edge = min(first + FOLLOW, stop)
            self.live.follow(self.done, edge, self._foreseen(first), FOLLOW)
            self._advance(edge)
        self._advance(stop)

    @property
    def opening(self) -> Array:
        """(n + 1,) the seats' mean opening up to the steps done [m]."""
        return np.asarray(self.gap[: self.done + 1] @ self._seats)

    def _foreseen(self, step: int) -> float:
        """The seats' mean opening [m] in the middle of the `FOLLOW` steps from ``step`` on, at its present rate."""
        before, now = self.gap[[step - 1 if step else 0, step]] @ self._seats
        return float(now + FOLLOW / 2 * (now - before))

    def _advance(self, stop: int) -> None:
        """March up to step ``stop``, the amplitudes of all loads known."""
        if self.live.awake:
            self._free[self.done : stop] += self.live.advance(self.done, stop)
        block = self._past.block
        while self.done < stop:
            edge = stop if self.prepared.weights.size == 0 else min(stop, (self.done // block + 1) * block)
            if self._pilot is not None:
                edge = min(edge, (self.done // FLIGHT + 1) * FLIGHT)
            self._march(self.done, edge)
            self.done = edge
            if self._pilot is not None and edge % FLIGHT == 0:
                last = self.force[edge - 1] - self.prepared.rest
                self._pilot.turn(edge, self._state, last, folded=len(self.prepared.rest) == 1)
            if self.prepared.weights.size and edge % block == 0:
                self._past.fold(self.force.T, self.prepared.rest, edge // block)

    def _states(self, done: int) -> dict[str, Array]:
        """Everything that the future depends on after ``done`` steps, as arrays to read and to write into."""
        films = {"film": self.film[:done]} if self.film.size else {}
        return films | {
            "force": self.force[:done],
            "gap": self.gap[: done + 1],
            "memory": self._past.memory,
            "q": self._state[0],
            "p": self._state[1],
            "live_amplitudes": self.live.amplitudes,
            "live_state": self.live.state,
            "flight": self._base,
            **({"fed": self.live.fed} if self.live.fed.size else {}),
        }

    def checkpoint(self) -> dict[str, Array]:
        """Everything the future depends on, as arrays; `impact.storage.checkpoint` writes it to a file."""
        states = {name: values.copy() for name, values in self._states(self.done).items()}
        return {"done": np.array(self.done), **states}

    @property
    def _base(self) -> Array:
        return np.zeros((2, 0)) if self._pilot is None else self._pilot.base

    def restore(self, state: dict[str, Array]) -> None:
        """Continue a fresh stepper from a `checkpoint` of the same problem; `ContactError` if it does not fit."""
        if self.done:
            raise ContactError(f"this stepper has already done {self.done} steps; restore into a fresh one")
        if "done" not in state or state["done"].size != 1:
            raise ContactError("the checkpoint does not say how many steps are done")
        done = int(state["done"].item())
        mine = self._states(done)
        if missing := ", ".join(sorted(mine.keys() - state.keys())):
            raise ContactError(f"the checkpoint has no {missing}")
        if not 0 <= done <= self.prepared.steps:
            raise ContactError(f"the checkpoint has done {done} steps, this run has {self.prepared.steps}")
        for name, values in mine.items():
            if state[name].shape != values.shape:
                raise ContactError(
                    f"the checkpoint's {name} has shape {state[name].shape}, this run needs {values.shape}"
                )
        for name, values in mine.items():
            values[...] = state[name]
        self.done = done
        self.live.awake = bool(np.any(self.live.amplitudes))
        if self._pilot is not None and done >= FLIGHT:
            self._pilot.resume(done)

    def _march(self, start: int, stop: int) -> None:
        s, force = self.prepared, self.force.T
        memory, recent, block = self._past.memory, self._past.recent, self._past.block
        strides = (self._strides.lengths, self._strides.powers, self._strides.swing)
        codes, rules, numbers = self._laws
        if len(codes) == 1:
            law, film = (codes[0], rules[0], *numbers[0]), None if self._films is None else tuple(self._films[0])
            pulls = self.film.T[0] if self.film.size else np.zeros(0)
            march.march_one(
                start, stop, self._rows, self._state, self._free[:, 0], memory[0], recent[0, 0],
                block, s.own[0, 0], law, film, self._user, s.dt, s.rest[0], strides, force[0], self.gap[:, 0], pulls,
            )  # fmt: skip
        else:
            self.unsolved += march.march_many(
                start, stop, (self._rows, s.poles.psi, self._along), self._state, self._free, memory, recent,
                block, s.own, self._laws, self._films, self._user, s.dt, s.rest, strides, force, self.gap, self.film.T,
            )  # fmt: skip
        for contact in s.problem.contacts:
            if isinstance(contact.law, PlainLaw):
                contact.law.check()


def _carried(prepared: Prepared) -> Array:
    """(K,) what drives the poles while nothing touches: the force carried since ever, missing."""
    if len(prepared.rest) == 1:  # folded
        return np.full(prepared.poles.steps.shape[1], -prepared.rest[0])
    return np.asarray(-prepared.rest @ prepared.poles.psi)


def _preloaded(
    problem: ContactProblem, bodies: tuple[Discrete, ...], turns: list[Array]
) -> tuple[tuple[Discrete, ...], Array]:
    """Bodies in static equilibrium with their loads and each other at t = 0, and the contact forces of that state."""
    compliance = sum(t.T @ b.body.greens.static_compliance() @ t for b, t in zip(bodies, turns, strict=True))
    if not np.all(np.isfinite(compliance)):
        raise ContactError(
            "preload needs bodies that are held: one of them is free to move, nothing balances the force"
        )
    opening = np.array([c.gap for c in problem.contacts])
    at_rest = []
    for body, turn in zip(bodies, turns, strict=True):
        if body.body.is_deflected or body.body.velocity != 0.0:
            raise ContactError("preload starts from static equilibrium: give no initial state or velocity with it")
        amplitudes = np.array([float(load.amplitude(np.zeros(1))[0]) for load in body.body.loads])
        g = body.body.greens.modal if body.body.loads else None
        for load, amplitude in zip(body.body.loads, amplitudes, strict=True):
            assert g is not None
            opening = opening + turn.T @ (g.shapes.T @ (load.shape * amplitude / g.omega**2))
        at_rest.append(amplitudes)
    rest = np.zeros(len(opening))
    springs = [1.0 / c.law.parameters[0] if c.law.code == 1 else 0.0 for c in problem.contacts]
    if any(c.law.code > 1 for c in problem.contacts):
        raise ContactError(
            "preload is solved for rigid and linear-spring contacts; use impact.Signorini or LinearSpring"
        )
    march.active_set(compliance + np.diag(springs), -opening, rest)
    placed = tuple(
        Discrete(b.body, b.kernel, b.dt, b.loads, turn @ rest, amplitudes)
        for b, turn, amplitudes in zip(bodies, turns, at_rest, strict=True)
    )
    return placed, rest


def _rules(problem: ContactProblem, rule: str) -> NDArray[np.int64]:
    """(p,) codes."""
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
    """Steps of ``dt`` [s] that cover ``duration`` [s]; raises `ContactError` for too many, or none."""
    for name, value in (("dt", dt), ("duration", duration)):
        if not (value > 0 and math.isfinite(value)):
            raise ContactError(f"{name} = {value} s must be positive and finite")
    if duration < dt * (1 - 1e-9):
        raise ContactError(f"duration = {duration:g} s is shorter than one step, dt = {dt:g} s")
    count = duration / dt
    if count > MOST_STEPS:
        raise ContactError(
            f"dt = {dt:g} s makes {count:.3g} steps of {duration:g} s (limit {MOST_STEPS:g}, what can be stored); "
            f"use dt >= {duration / MOST_STEPS:.2g} s, or a shorter duration"
        )
    return math.ceil(count * (1 - 1e-12))


def _refuse_other(problem: ContactProblem, bodies: tuple[Discrete, ...], dt: float, n: int) -> None:
    same = len(bodies) == len(problem.bodies) and all(
        discrete.body is body and discrete.dt == dt and discrete.loads.shape[1] == n
        for discrete, body in zip(bodies, problem.bodies, strict=True)
    )
    if not same:
        raise ContactError(f"bodies: not those of the problem over {n} steps of {dt:g} s")


def _refuse_ill_posed(problem: ContactProblem) -> None:
    """Two bodies that both start like t, under a rigid law: the force of a step would grow like 1/dt."""
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
