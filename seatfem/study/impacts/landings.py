"""Landings of a scene's run, on seat and stopper, with their status; the scenes in which the reed lands on its seat.

A scene without a landing, or one that the end of the run cuts off in its landing, has numbers, but no answer: an
impulse of zero, or the part of a peak that there was time for. Beside others they would bend every mean. They count for
what needs no landing on the seat: numbers of the stopper, of the gas, of the static load, and the count of landings.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

import impact
from impact.after.landings import (
    ContactRecord,
    Landing,
    Stored,
    closing_speeds,
    find_landings,
    hardest,
    pressed_on,
    restitutions,
)
from impact.after.loads import StaticLoad, static_load
from impact.after.result import ImpactResult
from impact.greens.base import Array
from impact.march.motion import Discrete, mid_steps
from impact.march.problem import ContactProblem
from impact.march.stepper import with_recorded_loads
from impact.quantities import brief

Face = Literal["seat", "stopper"]
Status = Literal["landed", "no landing", "cut off", "never opened"]


@dataclass(frozen=True)
class Landings:
    """All landings of one run.

    Attributes:
        seat, stopper: on each of the two, in the order of time.
        static: the quasi-static load.
        pressed_time: how long the seat is touched outside all landings [s].
        pressed_load: largest averaged force meanwhile [N].
        opened: whether the seat is free of contact at any time.
    """

    seat: tuple[Landing, ...]
    stopper: tuple[Landing, ...]
    static: StaticLoad
    pressed_time: float = 0.0
    pressed_load: float = 0.0
    opened: bool = True

    __repr__ = brief

    @property
    def hardest(self) -> Landing | None:
        """Return the hardest landing on the seat; ``None`` where there is none."""
        return hardest(self.seat)

    @property
    def status(self) -> Status:
        """Return whether the seat was landed on, and whether the end of the run cuts the landing that counts.

        Cut off is the hardest landing, or one that closed at least half as fast as it: it might have become harder.
        """
        if (hard := self.hardest) is None:
            return "no landing" if self.opened else "never opened"
        fast = (one.closing_speed >= 0.5 * hard.closing_speed for one in self.seat if one.cut_off)
        return "cut off" if hard.cut_off or any(fast) else "landed"

    def on(self, face: Face) -> tuple[Landing, ...]:
        """Return the landings on the seat or on the stopper."""
        return self.seat if face == "seat" else self.stopper


def landings_of_result(problem: ContactProblem, result: ImpactResult, width: float) -> Landings:
    """Return the landings of a run with its energies; ``width``: of the filter [s]."""
    force, solid, gap = (values.reshape(len(result.time), -1) for values in (result.force, result.solid, result.gap))
    striker = with_recorded_loads(problem.striker, np.asarray(gap[:, _seats(problem)].mean(axis=1)), result.dt)
    march = _March(problem, force, solid, gap, result.dt, width)
    load = static_load(_with_striker(problem, striker), result.dt * (len(force) - 1))
    pushed = striker.load_amplitudes(mid_steps(result.dt, len(force) - 1))
    return march.landings(load, lambda steps: result.energy.striker[list(steps)], pushed)


def landings_of_march(
    stepper: impact.ContactStepper, width: float, load: StaticLoad | None = None, *, rebound: bool = True
) -> Landings:
    """Return the landings of a march without energies, as far as it has come; ``width``: of the filter [s].

    ``load``: the quasi-static load, where it is known already; ``rebound``: whether restitution is wanted, which
    replays the striker.
    """
    prepared, n = stepper.prepared, stepper.done
    problem, dt = prepared.problem, prepared.dt
    force = np.concatenate([prepared.rest[None], stepper.force[:n]])
    solid = force.copy()
    if stepper.film.size:
        solid[1:] -= stepper.film[:n]
    load = static_load_of_march(stepper) if load is None else load
    pushed = prepared.bodies[0].loads[:, :n] + stepper.live.amplitudes[:, :n]
    striker = replace(prepared.bodies[0], loads=pushed)

    def stored(steps: Sequence[int]) -> Array | None:
        return striker.stored_after(problem.directions(problem.striker) @ force[1:].T, steps) if rebound else None

    return _March(problem, force, solid, stepper.gap[: n + 1], dt, width).landings(load, stored, pushed)


def landings_of_one_contact(problem: ContactProblem, force: Array, gap: Array, dt: float, width: float) -> Landings:
    """Return the landings of a run with one contact, without film or preload, by its force [N] and gap [m], (n + 1,).

    Loads must not depend on the opening; ``width``: of the filter [s].
    """
    n = len(force) - 1
    pushed = problem.striker.load_amplitudes(mid_steps(dt, n))

    def stored(steps: Sequence[int]) -> Array | None:
        striker = Discrete.from_body(problem.striker, dt, n)
        return striker.stored_after(problem.directions(problem.striker) @ force[None, 1:], steps)

    march = _March(problem, force[:, None], force[:, None], gap[:, None], dt, width)
    return march.landings(static_load(problem, dt * n), stored, pushed)


def static_load_of_march(stepper: impact.ContactStepper) -> StaticLoad:
    """Return the quasi-static load of a march as far as it has come, loads that follow the opening as it had them."""
    prepared = stepper.prepared
    striker = with_recorded_loads(prepared.problem.striker, stepper.opening, prepared.dt)
    return static_load(_with_striker(prepared.problem, striker), prepared.dt * stepper.done)


def _with_striker(problem: ContactProblem, striker: impact.Body) -> ContactProblem:
    if striker is problem.striker:
        return problem
    return ContactProblem(striker, contacts=problem.contacts, preload=problem.preload)


def _seats(problem: ContactProblem) -> NDArray[np.bool_]:
    """Return (p,) which contacts are the seat's."""
    return np.array([contact.side > 0 for contact in problem.contacts])


@dataclass(frozen=True)
class _March:
    """Forces, what of them is solid [N], and gaps [m] of all contacts, (n + 1, p) each; step and filter [s]."""

    problem: ContactProblem
    force: Array
    solid: Array
    gap: Array
    dt: float
    width: float

    def landings(self, load: StaticLoad, stored: Stored, pushed: Array) -> Landings:
        """Return the landings of the march; ``pushed`` (L, n): amplitudes of the striker's loads [N]."""
        seats = _seats(self.problem)
        on_seat = self._record(seats, load)
        on_stopper = self._record(~seats, load) if not np.all(seats) else None
        landed = find_landings(on_seat) if np.any(seats) else ()
        stopped = () if on_stopper is None else find_landings(on_stopper)
        landed, stopped = (
            tuple(replace(one, restitution=value) for one, value in zip(each, rebounds, strict=True))
            for each, rebounds in (
                (each, restitutions(self.problem, self.force[1:], self.dt, each, stored, pushed, side=side))
                for each, side in ((landed, 1), (stopped, -1))
            )
        )
        time, largest = pressed_on(on_seat, landed) if np.any(seats) else (0.0, 0.0)
        opened = not bool(np.all(np.any(on_seat.solid[1:] > 0, axis=1)))
        return Landings(landed, stopped, load, time, largest, opened)

    def _record(self, face: NDArray[np.bool_], load: StaticLoad) -> ContactRecord:
        stopper = bool(np.any(face)) and self.problem.contacts[int(np.argmax(face))].side < 0
        time = np.asarray(self.dt * np.arange(len(self.force)), dtype=np.float64)
        return ContactRecord(
            force=self.force[:, face].sum(axis=1),
            solid=self.solid[:, face],
            gap=self.gap[:, face],
            static=load.course(time, stopper=stopper),
            dt=self.dt,
            width=max(self.width, self.dt),
            closing=closing_speeds(self.problem, self.dt)[face],
        )


STATUS: Final = "landing_status"
LANDED: Final = "landed"
BAR: Final = "error_bar_"
NO_LANDING_NEEDED: Final = ("stopper_", "gas_", "gauge_", "peak_gauge_strain", "pressed_on_", "landing_count", STATUS)
"""Prefixes of the keys of summary.json that need no landing on the seat."""


def has_landed(summary: Mapping[str, object]) -> bool:
    """Return whether the reed landed, and the end of the run did not cut that off; a summary that has no status did."""
    return summary.get(STATUS, LANDED) == LANDED


def needs_landing(key: str) -> bool:
    """Return whether a key of summary.json, or its error bar, speaks of a landing on the seat."""
    return not key.removeprefix(BAR).removeprefix("spring_").startswith(NO_LANDING_NEEDED)


def counts(summary: Mapping[str, object], key: str) -> bool:
    """Return whether a scene with this summary counts for a measure."""
    return has_landed(summary) or not needs_landing(key)


def left_out_in_words(statuses: Iterable[object], what: str = "scenes") -> str:
    """Return how many of the ``what`` with these landing statuses are left out, and why; "" of none."""
    every = list(statuses)
    why = Counter(str(status) for status in every if status != LANDED)
    if not why:
        return ""
    reasons = ", ".join(f"{count} {status}" for status, count in sorted(why.items(), key=lambda each: -each[1]))
    return f"{why.total()} of {len(every)} {what} left out: {reasons}"
