"""Landings of a scene's run on seat and stopper, their status, and the scenes that count in statistics.

A run without a landing, or one that ends during it, has numbers without meaning: an impulse of zero, or a part of a
peak. In statistics over many scenes it counts only for what needs no landing on the seat: numbers of the stopper, of
wings, of the static load, and the count of landings.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from impact.after.landings import (
    ContactRecord,
    Landing,
    Stored,
    closing_speeds,
    find_landings,
    find_own_yield,
    hardest,
    pressed_on,
    restitutions,
)
from impact.after.loads import StaticLoad, static_load
from impact.after.result import ImpactResult
from impact.greens.base import Array
from impact.march.grid import TimeGrid
from impact.march.motion import Discrete, PortForces, find_middle_times
from impact.march.problem import ContactProblem
from impact.march.rows import MarchRun
from impact.march.stepper import with_recorded_loads
from impact.quantities import brief
from seatfem.study.scene.wings import drives

Face = Literal["seat", "stopper"]
Status = Literal["landed", "no landing", "cut off", "never opened"]


@dataclass(frozen=True)
class Landings:
    """All landings of one run.

    Attributes:
        seat, stopper: landings on each of the two, in the order of time.
        static: the quasi-static load that presses the striker on either.
        pressed_time: total time of contact with the seat outside all landings [s].
        pressed_load: largest averaged force in this time [N].
        opened: whether the seat is free of contact at any time.
        lands: landings on each land of a seat with several, as if it were alone.
    """

    seat: tuple[Landing, ...]
    stopper: tuple[Landing, ...]
    static: StaticLoad
    pressed_time: float = 0.0
    pressed_load: float = 0.0
    opened: bool = True
    lands: tuple[tuple[Landing, ...], ...] = ()

    __repr__ = brief

    @property
    def hardest(self) -> Landing | None:
        """Return the hardest landing on the seat; ``None`` without landings."""
        return hardest(self.seat)

    @property
    def status(self) -> Status:
        """Return whether there are landings on the seat, and whether the end of the run cuts one that counts: the
        hardest, or one with at least half its closing speed, which might have become harder."""
        if (hard := self.hardest) is None:
            return "no landing" if self.opened else "never opened"
        fast = (one.closing_speed >= 0.5 * hard.closing_speed for one in self.seat if one.cut_off)
        return "cut off" if hard.cut_off or any(fast) else "landed"

    @property
    def by_place(self) -> Mapping[str, tuple[Landing, ...]]:
        """Return the landings on seat, stopper and each land of the seat, by the names of these places."""
        lands = {land_place(number): each for number, each in enumerate(self.lands)}
        return {"seat": self.seat, "stopper": self.stopper, **lands}

    def on(self, face: Face) -> tuple[Landing, ...]:
        """Return the landings on the seat or on the stopper."""
        return self.seat if face == "seat" else self.stopper


def land_place(number: int) -> str:
    """Return the name of a land among the places of landings; lands are numbered from 0."""
    return f"seat land {number + 1}"


def landings_of_result(
    problem: ContactProblem, result: ImpactResult, width: float, lands: Sequence[slice] = ()
) -> Landings:
    """Return the landings of a run with energies; ``width``: width of the filter [s]; ``lands``: contacts of each land
    of a seat with several."""
    rows, steps = result.rows, int(result.rows.ends[-1])
    force, solid, gap = (values.reshape(len(rows.ends), -1) for values in (rows.force, rows.solid, rows.gap))
    opening = rows.spread_motions(gap[:, _seats(problem)].mean(axis=1))
    striker = with_recorded_loads(problem.striker, opening, result.dt)
    march = _March(problem, rows, force, solid, gap, width, lands)
    load = static_load(replace(problem, striker=striker), result.dt * steps, lands)

    def stored(numbers: Sequence[int]) -> Array:
        return np.asarray(rows.energy.striker[np.searchsorted(rows.ends, numbers)])

    return march.landings(load, stored, striker.load_amplitudes(find_middle_times(result.dt, steps)))


def landings_of_march(
    run: MarchRun, width: float, load: StaticLoad | None = None, lands: Sequence[slice] = (), *, rebound: bool = True
) -> Landings:
    """Return the landings of a run without energies; ``width``: width of the filter [s].

    ``load``: the quasi-static load, if it is known already; ``lands``: contacts of each land of a seat with several,
    left out unless the load has as many groups; ``rebound``: whether to compute restitution, for which the striker's
    motion is computed again.
    """
    problem, rows, striker = run.problem, run.rows, run.bodies[0]
    force = rows.force
    load = static_load_of_march(run, lands) if load is None else load

    def stored(steps: Sequence[int]) -> Array:
        if not rebound:
            return np.full(len(steps), np.nan)
        return striker.stored_after(PortForces(rows, force[1:].T, problem.directions(problem.striker)), steps)

    lands = lands if len(lands) == load.groups.shape[1] else ()
    return _March(problem, rows, force, rows.solid, rows.gap, width, lands).landings(load, stored, striker.loads)


def landings_of_one_contact(problem: ContactProblem, force: Array, gap: Array, dt: float, width: float) -> Landings:
    """Return the landings of a run with one contact, without film or preload, from its force [N] and gap [m], (n + 1,).

    Loads must not depend on the opening; ``width``: width of the filter [s].
    """
    n = len(force) - 1
    pushed = problem.striker.load_amplitudes(find_middle_times(dt, n))

    grid = TimeGrid.of_equal_steps(dt, n)

    def stored(steps: Sequence[int]) -> Array:
        striker = Discrete.from_body(problem.striker, dt, n)
        return striker.stored_after(PortForces(grid, force[None, 1:], problem.directions(problem.striker)), steps)

    march = _March(problem, grid, force[:, None], force[:, None], gap[:, None], width)
    return march.landings(static_load(problem, dt * n), stored, pushed)


def static_load_of_march(run: MarchRun, lands: Sequence[slice] = ()) -> StaticLoad:
    """Return the quasi-static load of a run, with the loads that depended on the opening, also on each of the
    ``lands``."""
    striker = with_recorded_loads(run.problem.striker, run.opening, run.dt)
    return static_load(replace(run.problem, striker=striker), run.dt * run.steps, lands)


def _seats(problem: ContactProblem) -> slice:
    """Return the contacts with the seat, which are the first ones."""
    return slice(sum(contact.side > 0 for contact in problem.contacts))


@dataclass(frozen=True)
class _March:
    """Forces with and without the film [N], and gaps [m] of all contacts, (N + 1, p) each, in the steps of a grid;
    filter [s]; contacts of each land of a seat with several."""

    problem: ContactProblem
    grid: TimeGrid
    force: Array
    solid: Array
    gap: Array
    width: float
    lands: Sequence[slice] = ()

    def landings(self, load: StaticLoad, stored: Stored, pushed: Array) -> Landings:
        """Return the landings; ``stored``: striker's energy after steps; ``pushed`` (L, n): amplitudes of its
        loads [N]."""
        seats, count = _seats(self.problem), len(self.problem.contacts)
        times = np.asarray(self.grid.dt * np.arange(self.grid.ends[-1] + 1), dtype=np.float64)
        on_seat = self._record(seats, load.course(times))
        above = slice(seats.stop, count)
        on_stopper = self._record(above, load.course(times, stopper=True)) if seats.stop < count else None
        on_lands = tuple(
            find_landings(self._record(land, load.of_group(number, times))) for number, land in enumerate(self.lands)
        )
        on_seat_landings = find_landings(on_seat) if seats.stop else ()
        on_stopper_landings = () if on_stopper is None else find_landings(on_stopper)
        on_seat_landings, on_stopper_landings = (
            tuple(replace(one, restitution=value) for one, value in zip(each, rebounds, strict=True))
            for each, rebounds in (
                (each, restitutions(self.problem, self.force[1:], self.grid, each, stored, pushed, side=side))
                for each, side in ((on_seat_landings, 1), (on_stopper_landings, -1))
            )
        )
        time, largest = pressed_on(on_seat, on_seat_landings) if seats.stop else (0.0, 0.0)
        opened = not bool(np.all(on_seat.closed[1:]))
        return Landings(on_seat_landings, on_stopper_landings, load, time, largest, opened, on_lands)

    def _record(self, face: slice, static: Array) -> ContactRecord:
        grid, dt = self.grid, self.grid.dt
        return ContactRecord(
            force=grid.spread_forces(self.force[:, face].sum(axis=1)),
            closed=np.asarray(grid.spread_forces(np.any(self.solid[:, face] > 0, axis=1)), dtype=bool),
            grid=grid,
            solid=self.solid[:, face],
            gap=self.gap[:, face],
            static=static,
            width=max(self.width, dt),
            closing=closing_speeds(self.problem, dt)[face],
            own=find_own_yield(self.problem.contacts[face], self.problem.striker, dt),
        )


STATUS: Final = "landing_status"
LANDED: Final = "landed"
BAR: Final = "error_bar_"
NO_LANDING_NEEDED: Final = ("stopper_", "gauge_", "peak_gauge_strain", "pressed_on_", "landing_count", STATUS)
"""Prefixes of the keys of summary.json that need no landing on the seat, as those of wings do not."""


def has_landed(summary: Mapping[str, object]) -> bool:
    """Return whether the reed has landed without being cut off; a summary without a status counts as landed."""
    return summary.get(STATUS, LANDED) == LANDED


def needs_landing(key: str) -> bool:
    """Return whether a key of summary.json, or its error bar, has a meaning only with a landing on the seat."""
    needless = (*NO_LANDING_NEEDED, *(f"{each.table}_" for each in drives()))
    return not key.removeprefix(BAR).removeprefix("spring_").startswith(needless)


def counts(summary: Mapping[str, object], key: str) -> bool:
    """Return whether a scene with this summary counts for a measure."""
    return has_landed(summary) or not needs_landing(key)


def left_out_in_words(statuses: Iterable[object], what: str = "scenes") -> str:
    """Return in words how many of the ``what`` with these landing statuses are left out, and why; "" if none."""
    all_statuses = list(statuses)
    excluded = Counter(str(status) for status in all_statuses if status != LANDED)
    if not excluded:
        return ""
    reasons = ", ".join(f"{count} {status}" for status, count in sorted(excluded.items(), key=lambda each: -each[1]))
    return f"{excluded.total()} of {len(all_statuses)} {what} left out: {reasons}"
