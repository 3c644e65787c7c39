"""Landings of a scene's run on seat, stopper and each land of a seat, their status, and the scenes that count.

A landing on a land is what `impact.after.landings` makes of the forces on that land alone. Those that begin during the
hardest landing on the seat say in which order this landing closes the lands.

A run without a landing, or one that ends during it, has numbers without meaning: an impulse of zero, or a part of a
peak. In statistics over many scenes it counts only for what needs no landing on the seat: numbers of the stopper, of
wings, of the static load, and the count of landings.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Final, Literal

import numpy as np

from impact.after.histories import line_force_peak
from impact.after.landings import (
    ContactRecord,
    Landing,
    Stored,
    find_closing_speeds,
    find_hardest,
    find_landings,
    find_pressed_contact,
    find_restitutions,
    find_step_responses,
    pair_landings,
)
from impact.after.loads import StaticLoad, find_static_load
from impact.after.result import ImpactResult
from impact.greens.base import Array
from impact.march.grid import TimeGrid
from impact.march.motion import DiscreteBody, PortForces, find_middle_times
from impact.march.problem import ContactProblem
from impact.march.rows import MarchRun
from impact.march.stepper import with_recorded_loads
from impact.quantities import brief
from seatfem.readings import BAR, SPRING
from seatfem.study.scene.measures import Line
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
        return find_hardest(self.seat)

    @property
    def status(self) -> Status:
        """Return whether there are landings on the seat, and whether the end of the run cuts one that counts: the
        hardest, or one with at least half its closing speed, which might have become harder."""
        if (hard := self.hardest) is None:
            return "no landing" if self.opened else "never opened"
        fast = (one.closing_speed >= 0.5 * hard.closing_speed for one in self.seat if one.cut_off)
        return "cut off" if hard.cut_off or any(fast) else "landed"

    @property
    def places(self) -> Mapping[str, tuple[Landing, ...]]:
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
    opening = rows.spread_motions(gap[:, : seat_contacts(problem)].mean(axis=1))
    striker = with_recorded_loads(problem.striker, opening, result.dt)
    march = _March(problem, rows, force, solid, gap, width, lands)
    load = find_static_load(replace(problem, striker=striker), result.dt * steps, lands)

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

    grid = TimeGrid.from_equal_steps(dt, n)

    def stored(steps: Sequence[int]) -> Array:
        striker = DiscreteBody.from_body(problem.striker, dt, n)
        return striker.stored_after(PortForces(grid, force[None, 1:], problem.directions(problem.striker)), steps)

    march = _March(problem, grid, force[:, None], force[:, None], gap[:, None], width)
    return march.landings(find_static_load(problem, dt * n), stored, pushed)


def static_load_of_march(run: MarchRun, lands: Sequence[slice] = ()) -> StaticLoad:
    """Return the quasi-static load of a run, with the loads that depended on the opening, also on each of the
    ``lands``."""
    striker = with_recorded_loads(run.problem.striker, run.opening, run.dt)
    return find_static_load(replace(run.problem, striker=striker), run.dt * run.steps, lands)


def seat_contacts(problem: ContactProblem) -> int:
    """Return the number of contacts with the seat, which are the first ones."""
    return sum(contact.side > 0 for contact in problem.contacts)


def _stored_at_edges(faces: Sequence[Sequence[Landing]], grid: TimeGrid, stored: Stored) -> Stored:
    """Return the same function for the edges of the landings on all faces, which one pass through the run finds."""

    @cache
    def energies() -> Mapping[int, float]:
        rebounding = (face for face in faces if any(landing.has_rebound for landing in face))
        edges = sorted({edge for face in rebounding for landing in face for edge in landing.find_edges(grid)})
        return dict(zip(edges, stored(edges).tolist(), strict=True))

    return lambda numbers: np.array([energies()[number] for number in numbers])


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
        seats, count = slice(seat_contacts(self.problem)), len(self.problem.contacts)
        times = np.asarray(self.grid.dt * np.arange(self.grid.ends[-1] + 1), dtype=np.float64)
        on_seat = self._record(seats, load.course(times))
        above = slice(seats.stop, count)
        on_stopper = self._record(above, load.course(times, stopper=True)) if seats.stop < count else None
        on_lands = tuple(
            find_landings(self._record(land, load.find_group_force(number, times)))
            for number, land in enumerate(self.lands)
        )
        on_seat_landings = find_landings(on_seat) if seats.stop else ()
        on_stopper_landings = () if on_stopper is None else find_landings(on_stopper)
        sides = ((on_seat_landings, 1), (on_stopper_landings, -1))
        stored = _stored_at_edges([each for each, _ in sides], self.grid, stored)
        on_seat_landings, on_stopper_landings = (
            tuple(replace(one, restitution=value) for one, value in zip(each, rebounds, strict=True))
            for each, rebounds in (
                (each, find_restitutions(self.problem, self.force[1:], self.grid, each, stored, pushed, side=side))
                for each, side in sides
            )
        )
        time, largest = find_pressed_contact(on_seat, on_seat_landings) if seats.stop else (0.0, 0.0)
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
            closing=find_closing_speeds(self.problem, dt)[face],
            step_responses=find_step_responses(self.problem.contacts[face], self.problem.striker, dt),
        )


STATUS: Final = "landing_status"
LANDED: Final = "landed"
NO_LANDING_NEEDED: Final = ("stopper_", "gauge_", "peak_gauge_strain", "pressed_on_", "landing_count", STATUS)
"""Prefixes of the keys of summary.json that need no landing on the seat, as those of wings do not."""


def has_landed(summary: Mapping[str, object]) -> bool:
    """Return whether the reed has landed without being cut off; a summary without a status counts as landed."""
    return summary.get(STATUS, LANDED) == LANDED


def needs_landing(key: str) -> bool:
    """Return whether a key of summary.json, or its error bar, has a meaning only with a landing on the seat."""
    needless = (*NO_LANDING_NEEDED, *(f"{each.table}_" for each in drives()))
    return not key.removeprefix(BAR).removeprefix(SPRING).startswith(needless)


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


SHARE: Final = "impulse_share"
LINE_FORCE: Final = "line_force_peak_N_per_m"
DELAY: Final = "after_first_s"
TOGETHER: Final = 1e-6  # fraction of a step, or of a landing, within which times count as one


def landings_of_lands(landings: Landings) -> tuple[Landing | None, ...]:
    """Return the hardest landing on each land that begins during the hardest one on the seat; ``None`` for a land that
    is not touched in it."""
    if (whole := landings.hardest) is None:
        return (None,) * len(landings.lands)
    early = TOGETHER * max(whole.duration, 1e-9)
    return tuple(
        find_hardest([one for one in each if whole.start - early <= one.start < whole.end]) for each in landings.lands
    )


def values_of_lands(line: Line | None, landings: Landings, width: float, like: Landings) -> dict[str, float]:
    """Return, by name, the largest force per length on each land during the hardest landing [N/m], the time from the
    first touch of any land to its own [s], and its share of the impulse on all lands during the hardest landing.

    Args:
        line: contact along the lips; ``None``, or of a single land: there are no values.
        landings: landings of the run.
        width: width of the filter [s].
        like: those, or landings of a neighbouring run, whose partners are taken; infinite values for one without any.
    """
    if line is None or len(line.lands) != len(landings.lands):
        return {}
    of_lands = landings_of_lands(like)
    own = tuple(_partner(one, like.lands[k], landings.lands[k]) for k, one in enumerate(of_lands))
    first = min((one.touch for one in own if one is not None), default=math.nan)
    values, shares = {}, _shares(line, _hardest(landings, like))
    for k, (asked, one) in enumerate(zip(of_lands, own, strict=True)):
        if asked is not None:
            place = land_place(k)
            delay = math.inf if one is None else one.touch - first
            values[f"{place} {DELAY}"] = delay if delay > TOGETHER * line.grid.dt else 0.0
            values[f"{place} {SHARE}"] = shares[k]
            values[f"{place} {LINE_FORCE}"] = math.inf if one is None else largest_line_force(line, k, one, width)
    return values


def _hardest(landings: Landings, like: Landings) -> Landing | None:
    """Return the partner of the hardest landing on the seat in a neighbouring run."""
    if like.hardest is None:
        return landings.hardest
    return _partner(like.hardest, like.seat, landings.seat)


def _shares(line: Line, landing: Landing | None) -> list[float]:
    """Return the share of each land in the impulse of a landing, loads included; infinite without one."""
    if landing is None:
        return [math.inf] * len(line.lands)
    rows = _rows_of(line, landing)
    impulses = np.diff(line.grid.time)[rows] @ line.force[1:][rows]
    return [float(impulses[land].sum() / impulses.sum()) for land in line.lands]


def _rows_of(line: Line, landing: Landing) -> slice:
    """Return the steps of the grid during a landing."""
    begins, ends = line.grid.time[:-1], line.grid.time[1:]
    rows = np.flatnonzero((ends > landing.start) & (begins < landing.end + line.grid.dt / 2))
    return slice(int(rows[0]), int(rows[-1]) + 1)


def _partner(one: Landing | None, landings: tuple[Landing, ...], others: tuple[Landing, ...]) -> Landing | None:
    pairs = zip(landings, pair_landings(landings, others), strict=True)
    return next((other for each, other in pairs if each is one), None)


def largest_line_force(line: Line, number: int, landing: Landing, width: float) -> float:
    """Return the largest force per length on a land during a landing on it [N/m], as a mean over the ``width`` [s] and
    over the length of line over which all forces along the lip are averaged; lands are numbered from 0."""
    arcs, lengths = line.lands[number], line.lengths
    own, span = lengths[arcs], _rows_of(line, landing)
    share = min(1.0, line.share * float(lengths.sum()) / float(own.sum()))
    times = line.grid.time[span.start : span.stop + 1]
    piece = (len(own), line.pieces[number][1])
    return line_force_peak(line.force[1:][span, arcs], times, width, own, share, (piece,))[0]


def closed_all_round(line: Line, number: int, landing: Landing) -> float | None:
    """Return the time by which every segment of a land has touched during a landing on it [s]; ``None`` if one has not.

    It is known to whole steps."""
    pressed = (line.force - line.film)[:, line.lands[number]] > 0
    during = (line.grid.time > landing.start) & (line.grid.time <= landing.end + line.grid.dt / 2)
    touched = pressed & during[:, None]
    if not touched.any(axis=0).all():
        return None
    begins = np.concatenate([[0.0], line.grid.time[:-1]])
    return max(landing.touch, float(begins[touched.argmax(axis=0)].max()))
