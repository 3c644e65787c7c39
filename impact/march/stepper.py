"""The march over time, one step or many at a time, in the hands of the user.

At the end of each step

    gap = gap0 + free motion + sum over contacts of (g_striker + g_target) * N,   N = law(-gap) >= 0,

with N constant over the step and the convolutions exact for such N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from impact.brief import brief
from impact.greens.base import Array
from impact.march import history
from impact.march.flight import BLOCK as FLIGHT
from impact.march.flight import Pilot
from impact.march.laws import PlainLaw, no_user_law
from impact.march.loop.marches import march_many, march_one
from impact.march.motion import LiveLoads
from impact.march.prepared import Prepared
from impact.march.problem import ContactError
from impact.march.strides import Strides

FOLLOW = 32  # steps for which a load that depends on the opening keeps what it has in their middle


@dataclass(frozen=True)
class StepState:
    """State of the march: time [s], force (p,) of the step just done [N], gap (p,) at its end [m]."""

    time: float
    force: Array
    gap: Array

    __repr__ = brief


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
        """Begin at t = 0; ``flying``: take flight in long strides where all is marched by poles
        (`impact.march.strides`); the forces are the same to round-off, ``gap`` is exact at their ends and interpolated
        in between."""
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
        steps, psi = (poles.folded(), np.ones((1, poles.psi.shape[1]))) if p == 1 else (poles.steps, poles.psi)
        self._rows, self._state = history.streams(steps)
        self._along = poles.along()
        self._strides = Strides.none()
        if flying and prepared.weights.size == 0 and not self.live.follows:
            carried = np.asarray(-prepared.rest @ psi)  # drives the poles while nothing touches: the preload, missing
            self._strides = Strides.from_poles(steps, carried, n)
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
        """Return the time reached [s]."""
        return self.done * self.prepared.dt

    @property
    def state(self) -> StepState:
        """Return where the march stands; before the first step the force is the preload."""
        force = self.force[self.done - 1] if self.done else self.prepared.rest
        return StepState(self.time, force.copy(), self.gap[self.done].copy())

    def step(self, loads: Array | None = None) -> StepState:
        """Take one step, during which ``loads`` (L,) [N] act beside the striker's own loads, constant over the step.

        ``loads[i]`` is added to the amplitude of ``striker.loads[i]``; for a force known only here, give the body
        ``Load(shape, numpy.zeros_like)``. Raises `ContactError`: the run is over; loads that are not L finite numbers.
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
            before, now = self.gap[[max(first - 1, 0), first]] @ self._seats
            self.live.follow(self.done, edge, float(now + FOLLOW / 2 * (now - before)), FOLLOW)
            self._advance(edge)
        self._advance(stop)

    @property
    def opening(self) -> Array:
        """Return the seats' (n + 1,) mean opening up to the steps done [m]."""
        return np.asarray(self.gap[: self.done + 1] @ self._seats)

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
        """Return everything that the future depends on after ``done`` steps, as arrays to read and to write into."""
        films = {"film": self.film[:done]} if self.film.size else {}
        return films | {
            "force": self.force[:done],
            "gap": self.gap[: done + 1],
            "memory": self._past.memory,
            "q": self._state[0],
            "p": self._state[1],
            "live_amplitudes": self.live.amplitudes,
            "live_state": self.live.state,
            "flight": np.zeros((2, 0)) if self._pilot is None else self._pilot.base,
            **({"fed": self.live.fed} if self.live.fed.size else {}),
        }

    def checkpoint(self) -> dict[str, Array]:
        """Return everything the future depends on, as arrays; `impact.storage.checkpoint` writes it to a file."""
        states = {name: values.copy() for name, values in self._states(self.done).items()}
        return {"done": np.array(self.done), **states}

    def restore(self, state: dict[str, Array]) -> None:
        """Continue a fresh stepper from a `checkpoint` of the same problem; `ContactError` if it does not fit."""
        if self.done:
            raise ContactError(f"this stepper has already done {self.done} steps; restore into a fresh one")
        if "done" not in state or state["done"].size != 1:
            raise ContactError("the checkpoint must say how many steps are done: its 'done' is missing or no number")
        steps = int(state["done"].item())
        mine = self._states(steps)
        if missing := ", ".join(sorted(mine.keys() - state.keys())):
            raise ContactError(f"the checkpoint has no {missing}: take one of the same problem")
        if not 0 <= steps <= self.prepared.steps:
            raise ContactError(f"the checkpoint has done {steps} steps, of at most {self.prepared.steps} in this run")
        for name, values in mine.items():
            if state[name].shape != values.shape:
                raise ContactError(
                    f"the checkpoint's {name} has shape {state[name].shape}, this run needs {values.shape}"
                )
        for name, values in mine.items():
            values[...] = state[name]
        self.done = steps
        self.live.awake = bool(np.any(self.live.amplitudes))
        if self._pilot is not None and steps >= FLIGHT:
            self._pilot.resume(steps)

    def _march(self, start: int, stop: int) -> None:
        s, force = self.prepared, self.force.T
        memory, recent, block = self._past.memory, self._past.recent, self._past.block
        strides = (self._strides.lengths, self._strides.powers, self._strides.swing)
        codes, rules, numbers = self._laws
        if len(codes) == 1:
            law, film = (codes[0], rules[0], *numbers[0]), None if self._films is None else tuple(self._films[0])
            pulls = self.film.T[0] if self.film.size else np.zeros(0)
            march_one(
                start, stop, self._rows, self._state, self._free[:, 0], memory[0], recent[0, 0],
                block, s.own[0, 0], law, film, self._user, s.dt, s.rest[0], strides, force[0], self.gap[:, 0], pulls,
            )  # fmt: skip
        else:
            self.unsolved += march_many(
                start, stop, (self._rows, s.poles.psi, self._along), self._state, self._free, memory, recent,
                block, s.own, self._laws, self._films, self._user, s.dt, s.rest, strides, force, self.gap, self.film.T,
            )  # fmt: skip
        for contact in s.problem.contacts:
            if isinstance(contact.law, PlainLaw):
                contact.law.check()
