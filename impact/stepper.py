"""The march over time, one step or many at a time, in the hands of the user.

At the end of each step

    gap = gap0 + free motion + sum over contacts of (g_striker + g_target) * N,   N = law(-gap) >= 0,

with N constant over the step and the convolutions exact for such N.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from impact import history, march
from impact.greens import Array
from impact.laws import CONSERVING, PASSIVE, Signorini, no_user_law
from impact.modal import ModalGreens
from impact.motion import Discrete
from impact.problem import ContactError, ContactProblem

RULES = {"passive": PASSIVE, "conserving": CONSERVING}


@dataclass(frozen=True)
class Prepared:
    """A contact problem at a fixed step, ready to march.

    Attributes:
        problem, dt, steps: what is solved, the step [s] and their number.
        bodies: the discretised bodies, striker first.
        free: (n + 1, p) gaps without contact forces beyond the preload [m].
        rest: (p,) contact forces carried since ever [N].
        poles: all poles seen from the contacts.
        weights: (n, p, p) step weights of the gaps, or (0, p, p) without.
        own: (p, p) W_0 [m/N].
        rule: code of the step rule.
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
    rule: int


def prepare(problem: ContactProblem, dt: float, duration: float, rule: str = "passive") -> Prepared:
    """Discretise the bodies and their free motion; raises `ContactError` for what cannot be marched."""
    n, code = _steps(dt, duration), _rule(problem, rule)
    _refuse_ill_posed(problem)
    bodies = tuple(Discrete.of(body, dt, n) for body in problem.bodies)
    turns = [problem.directions(b.body) for b in bodies]
    rest = np.zeros(len(problem.contacts))
    if problem.preload:
        bodies, rest = _preloaded(problem, bodies, turns)
    p = len(problem.contacts)
    gaps = np.tile([c.gap for c in problem.contacts], (n + 1, 1))
    for body, turn in zip(bodies, turns, strict=True):
        if body.moves_by_itself:
            held = np.repeat(body.rest[:, None], n, axis=1)
            gaps += (turn.T @ body.motion(held).displacement).T
    modal = [(b.kernel.modal, t) for b, t in zip(bodies, turns, strict=True) if b.kernel.modal is not None]
    weights = np.zeros((0, p, p))
    own = np.zeros((p, p))
    for body, turn in zip(bodies, turns, strict=True):
        own += turn.T @ body.kernel.self_weight(dt) @ turn
        if body.kernel.weights is not None:
            if weights.size == 0:
                weights = np.zeros((n, p, p))
            weights += np.einsum("ic,ijn,jd->ncd", turn, body.kernel.weights, turn, optimize=True)
    return Prepared(
        problem, dt, n, bodies, gaps, rest, history.Poles.of(modal, dt, p), np.ascontiguousarray(weights), own, code
    )


class ContactStepper:
    """Marches a prepared problem; the arrays `force` (n, p) and `gap` (n + 1, p) fill as it goes.

    The state (`checkpoint`) is all it takes to go on later: split runs equal single runs bit for bit.
    """

    def __init__(self, prepared: Prepared, block: int = history.BLOCK) -> None:
        p, n = len(prepared.rest), prepared.steps
        self.prepared = prepared
        self.block = block
        self.done = 0
        self.force = np.zeros((n, p))
        self.gap = np.zeros((n + 1, p))
        self.gap[0] = prepared.free[0]
        poles = prepared.poles
        self._state = (np.zeros(poles.steps.shape[1]), np.zeros(poles.steps.shape[1]), np.zeros(len(poles.decay)))
        self._memory = np.zeros((n if prepared.weights.size else 0, p))

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.done * self.prepared.dt

    def advance(self, steps: int = 1) -> None:
        """March up to ``steps`` steps (less at the end of the run)."""
        stop = min(self.done + steps, self.prepared.steps)
        while self.done < stop:
            edge = stop if self.prepared.weights.size == 0 else min(stop, (self.done // self.block + 1) * self.block)
            self._march(self.done, edge)
            self.done = edge
            if self.prepared.weights.size and edge % self.block == 0:
                self._fold(edge // self.block)

    def checkpoint(self) -> dict[str, Array]:
        """Everything the future depends on, as arrays."""
        q, p, y = self._state
        return {
            "done": np.array(self.done),
            "force": self.force[: self.done].copy(),
            "gap": self.gap[: self.done + 1].copy(),
            "memory": self._memory.copy(),
            "q": q.copy(),
            "p": p.copy(),
            "y": y.copy(),
        }

    def restore(self, state: dict[str, Array]) -> None:
        """Continue from a `checkpoint` of the same problem; raises `ContactError` if it does not fit."""
        done = int(state["done"])
        for name, mine in zip(("q", "p", "y", "memory"), (*self._state, self._memory), strict=True):
            if state[name].shape != mine.shape or done > self.prepared.steps:
                raise ContactError(
                    f"the checkpoint's {name} has shape {state[name].shape}, this run needs {mine.shape}"
                )
            mine[...] = state[name]
        self.force[:done], self.gap[: done + 1], self.done = state["force"], state["gap"], done

    def _march(self, start: int, stop: int) -> None:
        s = self.prepared
        contacts = s.problem.contacts
        user = next((c.law.compiled for c in contacts if hasattr(c.law, "compiled")), no_user_law)
        free = s.free[1:]
        if len(contacts) == 1:
            law = (contacts[0].law.code, s.rule, *contacts[0].law.parameters)
            march.march_one(
                start, stop, s.poles.folded(), self._state, free[:, 0], self._memory[:, 0], s.weights[:, 0, 0],
                self.block, s.own[0, 0], law, user, s.dt, s.rest[0], self.force[:, 0], self.gap[:, 0],
            )  # fmt: skip
            return
        laws = (
            np.array([c.law.code for c in contacts]),
            np.full(len(contacts), s.rule),
            np.array([c.law.parameters for c in contacts]),
        )
        poles = (s.poles.steps, s.poles.psi, s.poles.decay, s.poles.gain, s.poles.rho)
        march.march_many(
            start, stop, poles, self._state, free, self._memory, s.weights, self.block,
            s.own, laws, user, s.dt, s.rest, self.force, self.gap,
        )  # fmt: skip

    def _fold(self, done: int) -> None:
        s = self.prepared
        for c in range(len(s.rest)):
            for d in range(len(s.rest)):
                past = self.force[:, d] - s.rest[d]
                history.fold_block(self._memory[:, c], past, s.weights[:, c, d], done, self.block)


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
        if body.body.state is not None or body.body.velocity != 0.0:
            raise ContactError("preload starts from static equilibrium: give no initial state or velocity with it")
        amplitudes = np.array([float(load.amplitude(np.zeros(1))[0]) for load in body.body.loads])
        g = body.body.greens
        for load, amplitude in zip(body.body.loads, amplitudes, strict=True):
            assert isinstance(g, ModalGreens)
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


def _rule(problem: ContactProblem, rule: str) -> int:
    if rule not in RULES:
        raise ContactError(f"step rule {rule!r} is unknown; choose from {', '.join(RULES)}")
    if rule == "conserving":
        for contact in problem.contacts:
            if contact.law.code not in (1, 2):
                raise ContactError(
                    f"the conserving step needs a contact law with a potential, {type(contact.law).__name__} has none; "
                    "use LinearSpring or Hertz, or the passive step"
                )
    return RULES[rule]


def _steps(dt: float, duration: float) -> int:
    for name, value in (("dt", dt), ("duration", duration)):
        if not (value > 0 and math.isfinite(value)):
            raise ContactError(f"{name} = {value} s must be positive and finite")
    if duration < dt * (1 - 1e-9):
        raise ContactError(f"duration = {duration:g} s is shorter than one step, dt = {dt:g} s")
    return math.ceil(duration / dt * (1 - 1e-12))


def _refuse_ill_posed(problem: ContactProblem) -> None:
    """Two bodies that both start like t, under a rigid law: the force of a step would grow like 1/dt."""
    for number, contact in enumerate(problem.contacts):
        if not isinstance(contact.law, Signorini):
            continue
        pair = ((problem.striker, contact.striker_port), (contact.target, contact.port))
        if all(isinstance(b.greens, ModalGreens) and _starts_at_zero(b.greens, port) for b, port in pair):
            raise ContactError(
                f"contact {number}: neither body yields at once (no residual flexibility, g(0+) = 0) and the law is "
                "rigid: the force would grow like 1/dt; add a residual (impact.Residual) or use a compliant law"
            )


def _starts_at_zero(greens: ModalGreens, port: str | int) -> bool:
    i = greens.port_index(port)
    return bool(greens.initial_value()[i, i] == 0.0)
