"""Time integration of a contact problem by equal steps, one at a time or many.

At the end of each step

    gap = gap0 + free motion + sum over contacts of (g_striker + g_target) * N,   N = law(-gap) >= 0,

with N constant over the step and the convolutions exact for such N.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from impact.bodies.body import Body, Load
from impact.greens.base import Array
from impact.march import history, laws, motion
from impact.march.grid import FOLLOW, extrapolate_openings
from impact.march.loop.marches import linear_laws, march_many, march_one
from impact.march.prepared import BLOCK as FLIGHT
from impact.march.prepared import Pilot, Prepared
from impact.march.problem import Contact, ContactError
from impact.march.rows import MarchRun, Rows, find_seats
from impact.quantities import brief


@dataclass(frozen=True)
class StepState:
    """State of a run: time [s], force (p,) of the last step [N], gap (p,) at its end [m]."""

    time: float
    force: Array
    gap: Array

    __repr__ = brief


class ContactStepper:
    """Time integration of a prepared problem by the user's steps; `impact.collect` makes a result of those done.

    `step` takes one step under forces that may depend on the past (co-simulation); `advance` takes many. A run can be
    continued from its state (`checkpoint`), bit for bit as if it had not been interrupted.

    Attributes:
        prepared: the problem.
        done: number of steps done.
        force: (n, p) force of each step done [N].
        gap: (n + 1, p) gaps [m].
        film: (n, p) part of the force by films [N]; (n, 0) without films.
        unsolved: number of steps (since a restart) whose coupled forces were not solved to 1e-12.
    """

    def __init__(self, prepared: Prepared) -> None:
        """Begin at t = 0."""
        p, n = len(prepared.rest), prepared.steps
        self.prepared = prepared
        self.done = 0
        self.force = np.zeros((p, n)).T
        self.gap = np.zeros((n + 1, p))
        self._laws = LoopLaws.from_contacts(prepared.problem.contacts, prepared.rules)
        self.film = np.zeros((0 if self._laws.films is None else p, n)).T
        self.gap[0] = prepared.free[0]
        self.unsolved = 0
        striker = prepared.bodies[0]
        self.live = motion.LiveLoads(striker, prepared.problem.directions(striker.body), n)
        self._free = prepared.free[1:].copy() if striker.body.loads else prepared.free[1:]
        self._pilot: Pilot | None = None
        if prepared.flight is not None:
            self._free = prepared.flight.others[1:].copy()
            self._pilot = Pilot(prepared.flight, prepared.dt, self._free)
        poles = prepared.poles
        self._rows, self._state = history.streams(poles.folded() if p == 1 else poles.steps)
        self._along = poles.along()
        self._past = history.BlockedSum(prepared.weights, prepared.plan.block)
        self._seats = find_seats(prepared.problem)
        self._shifted = self._laws.shift(prepared.own)
        self._swept = self._shifted is None or None
        self._deepest = self._laws.numbers[:, laws.DEEPEST]
        np.maximum(-self.gap[0], 0.0, out=self._deepest)

    def __repr__(self) -> str:
        s = self.prepared
        return f"ContactStepper, {self.done} of {s.steps} steps of {s.dt:g} s, {len(s.rest)} contacts; {s.plan.words}"

    @property
    def steps(self) -> int:
        """Return the steps of the whole run."""
        return self.prepared.steps

    @property
    def time(self) -> float:
        """Return the time reached [s]."""
        return self.done * self.prepared.dt

    @property
    def state(self) -> StepState:
        """Return where the march stands; before the first step the force is the preload."""
        force = self.force[self.done - 1] if self.done else self.prepared.rest
        return StepState(self.time, force.copy(), self.gap[self.done].copy())

    def step(self, loads: Sequence[float] | Array = ()) -> StepState:
        """Take one step, during which ``loads`` (L,) [N] act beside the striker's own loads, constant over the step.

        ``loads[i]`` is added to the amplitude of ``striker.loads[i]``; for a force known only here, give the body
        ``Load(shape, numpy.zeros_like)``. Raises `ContactError`: the run is over; loads that are not L finite numbers.
        """
        if self.done == self.prepared.steps:
            raise ContactError(f"the run is over after {self.done} steps; prepare it with a longer duration")
        if len(loads):
            self.live.record(self.done, np.asarray(loads))
        self.advance(1)
        return self.state

    def advance(self, steps: int = 1) -> None:
        """Take ``steps`` steps, or fewer up to the end of the run."""
        stop = min(self.done + steps, self.prepared.steps)
        while self.live.follows and self.done < stop:
            first = self.done - self.done % FOLLOW
            edge = min(first + FOLLOW, stop)
            before, now = self.gap[[max(first - 1, 0), first]] @ self._seats
            self.live.follow(self.done, edge, float(now + FOLLOW / 2 * (now - before)), FOLLOW)
            self._advance(edge)
        self._advance(stop)

    def advance_far(self) -> None:
        """Take a fiftieth of the run's steps."""
        self.advance(max(512, -(-self.steps // 50)))

    @property
    def opening(self) -> Array:
        """Return the (n + 1,) mean gap of the seats up to the present step [m]."""
        return np.asarray(self.gap[: self.done + 1] @ self._seats)

    def _advance(self, stop: int) -> None:
        """Integrate up to step ``stop``, with the amplitudes of all loads known."""
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
        """Return the complete state after ``done`` steps, as arrays to read from and to write into."""
        films = {"film": self.film[:done]} if self.film.size else {}
        if self._laws.rough:
            films["deepest"] = self._deepest
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

    def record_run(self) -> MarchRun:
        """Return the run up to the present step."""
        s, n = self.prepared, self.done
        force = np.concatenate([s.rest[None], self.force[:n]])
        film = np.concatenate([np.zeros((1, len(s.rest))), self.film[:n]]) if self.film.size else np.zeros((n + 1, 0))
        striker = replace(s.bodies[0], loads=s.bodies[0].loads[:, :n] + self.live.amplitudes[:, :n])
        others = (replace(body, loads=body.loads[:, :n]) for body in s.bodies[1:])
        rows = Rows(s.dt, np.arange(n + 1), force, self.gap[: n + 1], film)
        return MarchRun(s.problem, (striker, *others), s.own, rows, s.plan.words, self.unsolved)

    def checkpoint(self) -> dict[str, Array]:
        """Return the complete present state as arrays; `impact.storage.hdf5` writes it to a file."""
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
        known = self._laws
        if len(known.codes) == 1:
            law = known.codes[0], known.rules[0], known.numbers
            film = None if known.films is None else tuple(known.films[0])
            pulls = self.film.T[0] if self.film.size else np.zeros(0)
            march_one(
                start, stop, self._rows, self._state, self._free[:, 0], memory[0], recent[0, 0],
                block, s.own[0, 0], law, film, known.user, known.rough, s.dt, s.rest[0], force[0],
                self.gap[:, 0], pulls,
            )  # fmt: skip
        else:
            self.unsolved += march_many(
                start, stop, (self._rows, s.poles.psi, self._along), self._state, self._free, memory, recent,
                block, s.own, (known.codes, known.rules, known.numbers), self._shifted, self._swept, known.films,
                known.user, known.rough, s.dt, s.rest, force, self.gap, self.film.T,
            )  # fmt: skip
        known.check()


@dataclass(frozen=True)
class LoopLaws:
    """Laws and films of p contacts as the compiled loops take them; ``None`` keeps what is not needed from being
    compiled.

    Attributes:
        codes, rules: (p,) codes of the laws and of their step rules.
        numbers: (p, k) parameters, as of `march_numbers`.
        user: the compiled law of the user's own, if there is one.
        films: (p, 3) parameters of the films; ``None`` without films.
        rough: whether any law remembers the deepest closure, or else ``None``.
        plain: laws in Python, whose errors wait in them.
    """

    codes: NDArray[np.int64]
    rules: NDArray[np.int64]
    numbers: Array
    user: Callable[[float, float, float], float] | None
    films: Array | None
    rough: bool | None
    plain: tuple[laws.PlainLaw, ...]

    @staticmethod
    def from_contacts(contacts: Sequence[Contact], rules: NDArray[np.int64]) -> LoopLaws:
        """Return the laws of the contacts, with their step ``rules`` (p,)."""
        codes, films = np.array([c.law.code for c in contacts]), np.array([c.film_parameters for c in contacts])
        return LoopLaws(
            codes,
            rules,
            march_numbers([c.law.parameters for c in contacts]),
            next((c.law.compiled for c in contacts if hasattr(c.law, "compiled")), None),
            films if np.any(films) else None,
            bool(np.any(codes >= laws.ROUGH)) or None,
            tuple(c.law for c in contacts if isinstance(c.law, laws.PlainLaw)),
        )

    def shift(self, own: Array) -> Array | None:
        """Return W_0 = ``own`` (p, p) with what linear laws yield; ``None`` where forces are found in another way: of
        one contact, with films, by other laws."""
        linear = len(self.codes) > 1 and self.films is None
        return linear_laws(self.codes, self.rules, self.numbers, own) if linear else None

    def check(self) -> None:
        """Raise `ContactError` where a law in Python has failed."""
        for law in self.plain:
            law.check()


def march_numbers(parameters: Sequence[laws.Parameters]) -> Array:
    """Return the (p, k) parameters of the laws for the time loop, which writes to the column `laws.DEEPEST`."""
    widest = max(laws.FIRST_KNOT, *map(len, parameters))
    numbers = np.zeros((len(parameters), widest))
    for row, values in zip(numbers, parameters, strict=True):
        row[: len(values)] = values
    return numbers


def with_recorded_loads(body: Body, opening: Array, dt: float) -> Body:
    """Return the striker of a run with steps ``dt`` [s], its loads that depend on the mean ``opening`` (n + 1,) of the
    seats [m] replaced by their histories in the run."""
    if not any(load.follows for load in body.loads):
        return body
    first, ahead = extrapolate_openings(opening)
    times = np.asarray(dt * first, dtype=np.float64)
    return replace(body, loads=tuple(_recorded_load(load, times, ahead, FOLLOW * dt) for load in body.loads))


def _recorded_load(load: Load, times: Array, ahead: Array, span: float) -> Load:
    """Return the load with the opening fixed to each of the values ``ahead`` from one of the ``times`` on [s]."""
    amplitude, factors = load.amplitude, np.ones(len(ahead))
    if load.feedback is not None:
        state = load.feedback.start()
        fed = [load.feedback.advance(state, float(t), span, float(lift)) for t, lift in zip(times, ahead, strict=True)]
        amplitude = hold_course(np.array(fed), span)
    if load.by_opening is not None:
        factors = np.array([load.by_opening(float(lift)) for lift in ahead])
    factor = hold_course(factors, span)
    return Load(load.shape, lambda t: np.asarray(amplitude(t)) * factor(t))


def hold_course(values: Array, span: float) -> Callable[[Array], Array]:
    """Return the function of time that keeps each of the values for a ``span`` [s]."""
    return lambda t: values[np.clip((np.asarray(t) / span).astype(np.int64), 0, len(values) - 1)]
