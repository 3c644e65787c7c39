"""Landings in a contact force: impacts are separated from the static load on a closed reed; their rebound is measured.

A *landing* begins at the first touch after an approach, which includes a release at zero gap with a velocity, but not a
preload. It ends when the bodies part for `MERGE`, or when the force averaged over the filter first stays within `BAND`
of the quasi-static load for one contact time: the time for which the force around its peak exceeds that load by more.
The rest of the contact is *pressed on*, as is all contact without an approach.

The times of touch and opening are interpolated. The gap closes on the line through the last two open steps. It opens on
the line from the penetration at the end of the last closed step to the gap after it. Under a rigid law, whose
penetration is zero, the displacement by the step's own force takes its place, at the centroid of g over the step. The
error is of second order in the step; where the force jumps to zero, it is up to `JUMP` of a step. With a film, the
times are those of whole steps.

A contact whose averaged force never exceeds the quasi-static load by `BAND` of that load is the vibration of a pressed
reed and no landing. Neither is one below `FAINT` of the record's largest force, which may be an artefact of the step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from impact.after import histories
from impact.bodies.body import Body
from impact.greens.base import Array
from impact.march.grid import TimeGrid
from impact.march.laws import Signorini
from impact.march.problem import Contact, ContactProblem
from impact.quantities import brief

BAND: Final = (
    0.1  # half width of the band about the quasi-static load, over this load, within which a reed is pressed on
)
DOUBT: Final = 0.2  # relative change of the band by which the uncertainty of a landing's end is estimated
NEAR: Final = 0.25  # largest shift of a landing between two runs, over the time to the next landing
JUMP: Final = 0.125
"""Largest error of the time of an opening at which the force jumps [steps]: 3/2 - sqrt(2) = 0.09 where the wave in a
rod returns, 0.12 with the error of the first touch (`tests/impact/test_landings.py`)."""
TOGETHER: Final = 1e-6  # largest time between touches that count as one [steps]
FAINT: Final = 1e-3  # least averaged force of a landing, over the largest of the record


@dataclass(frozen=True)
class ContactRecord:
    """The contacts of one face in p parts over n steps, from which its landings are determined.

    Attributes:
        force: (n + 1,) total force of all parts, films included [N]; ``force[0]`` is a preload.
        closed: (n + 1,) whether any part is in contact.
        grid: steps of the run.
        solid: (N + 1, p) contact force of each part without films, in the steps of ``grid`` [N].
        gap: (N + 1, p) gaps [m].
        static: (n + 1,) quasi-static load [N].
        width: width of the filter, at least a step [s].
        closing: (p,) closing speeds at the start, before any contact [m/s].
        step_responses: (2, p) displacements under a unit force after half a fine step and after a whole one [m/N],
            zeros under a law that lets the bodies penetrate; (2, 0): touches and openings are known to whole steps
            only.
    """

    force: Array
    closed: NDArray[np.bool_]
    grid: TimeGrid
    solid: Array
    gap: Array
    static: Array
    width: float
    closing: Array
    step_responses: Array = field(default_factory=lambda: np.zeros((2, 0)))

    __repr__ = brief

    @property
    def dt(self) -> float:
        """Return the fine step [s]."""
        return self.grid.dt


def find_pressed_contact(record: ContactRecord, landings: Sequence[Landing]) -> tuple[float, float]:
    """Return the total time of contact outside all landings [s], and the largest averaged force in this time [N]."""
    if not np.any(record.closed):
        return 0.0, 0.0
    closed = record.closed.copy()
    closed[0] = False
    times = record.dt * np.arange(len(closed))
    for landing in landings:
        closed &= ~((times > landing.start - record.dt / 2) & (times < landing.end + record.dt / 2))
    if not np.any(closed):
        return 0.0, 0.0
    mean = histories.averaged(record.force[1:], record.dt, record.width, histories.MOVING_AVERAGE)
    margin = max(1, round(record.width / record.dt))  # averages within this many steps contain a part of a landing
    away = closed.copy()  # from all landings
    for landing in landings:
        first, last = round(landing.start / record.dt) - margin, round(landing.end / record.dt) + margin
        away[max(first, 0) : last + 1] = False
    return record.dt * float(closed.sum()), float(mean[away if np.any(away) else closed].max())


@dataclass(frozen=True)
class Landing:
    """Start, end, force and rebound of one landing on one face.

    Attributes:
        start, end: start and end of the landing in whole steps [s].
        peak_time: time at which the excess of the averaged force over the quasi-static load is largest [s].
        part: number of the part that touches first.
        closing_speed: closing speed of that part over the step before [m/s].
        filtered_peak: largest force averaged over the filter [N].
        static_load: quasi-static load at ``peak_time`` [N].
        excess_peak: largest excess of the averaged force over the quasi-static load [N].
        impulse: integral of the force above the quasi-static load from ``start`` to ``end`` [N s].
        pressed_on: whether it ends in contact, pressed on by the quasi-static load.
        cut_off: whether the record ends during the landing.
        end_doubt: change of the end if the band is `DOUBT` wider or narrower [s]; 0 if the bodies part.
        restitution: coefficient of restitution (`find_restitutions`); ``None`` if unknown or if the bodies do not part.
        to_touch, to_opening: time from ``start`` to the touch, and from ``end`` to the opening [s].
        is_resolved: whether this is one unbroken contact, and its touch and opening are interpolated within a step.
        first_parts: numbers of all parts that touch at the same first time, ``part`` among them.
    """

    start: float
    end: float
    peak_time: float
    part: int
    closing_speed: float
    filtered_peak: float
    static_load: float
    excess_peak: float
    impulse: float
    pressed_on: bool
    cut_off: bool
    end_doubt: float = 0.0
    restitution: float | None = None
    to_touch: float = 0.0
    to_opening: float = 0.0
    is_resolved: bool = False
    first_parts: tuple[int, ...] = ()

    @property
    def touch(self) -> float:
        """Return the time of the first touch [s]."""
        return self.start + self.to_touch

    @property
    def duration(self) -> float:
        """Return the time from the first touch to the opening, or to the end of a landing that stays closed [s]."""
        return self.end + self.to_opening - self.touch

    @property
    def has_rebound(self) -> bool:
        """Return whether the bodies part at the end of the landing, within the run."""
        return not (self.pressed_on or self.cut_off)

    def find_edges(self, grid: TimeGrid) -> tuple[int, int]:
        """Return the last fine step before the landing and the first one after it, at both of which the gap is open."""
        return round(self.start / grid.dt), min(round(self.end / grid.dt) + 1, int(grid.ends[-1]))


def find_landings(record: ContactRecord) -> tuple[Landing, ...]:
    """Return the landings of one face, in the order of time."""
    groups = list(_find_groups(record))
    if not groups:
        return ()
    mean = histories.averaged(record.force[1:], record.dt, record.width, histories.MOVING_AVERAGE)
    static = record.static
    if np.any(static):
        static = histories.averaged(record.static[1:], record.dt, record.width, histories.MOVING_AVERAGE)
    faint = FAINT * float(mean.max())
    pressed = (group for group in groups if np.any(mean[group[0] : group[1] + 1] > static[group[0] : group[1] + 1]))
    each = (_measure_landing(record, mean, static, *group) for group in pressed)
    return tuple(one for one in each if one.excess_peak > max(BAND * one.static_load, faint))


def find_hardest(landings: Sequence[Landing]) -> Landing | None:
    """Return the landing with the largest excess of the averaged force over the quasi-static load, or ``None``."""
    return max(landings, key=lambda landing: landing.excess_peak, default=None)


def pair_landings(landings: Sequence[Landing], others: Sequence[Landing]) -> tuple[Landing | None, ...]:
    """Return, for each of ``landings``, the same landing of a neighbouring run among ``others``, or ``None``.

    Each start of a pair is the nearest one to the other. Both are no farther apart than the longer of the two
    durations, `MERGE`, or `NEAR` times the time to the next landing of the run, whichever is largest.
    """
    if not others:
        return (None,) * len(landings)
    apart, pairs = np.abs(np.subtract.outer([one.start for one in landings], [other.start for other in others])), []
    for number, one in enumerate(landings):
        nearest = int(apart[number].argmin())
        other, mutual = others[nearest], int(apart[:, nearest].argmin()) == number
        beside = min((abs(each.start - one.start) for each in landings if each is not one), default=0.0)
        near = apart[number, nearest] <= max(histories.MERGE, one.duration, other.duration, NEAR * beside)
        pairs.append(other if mutual and near else None)
    return tuple(pairs)


def find_closing_speeds(problem: ContactProblem, dt: float) -> Array:
    """Return the (p,) speeds at which the contacts close at t = 0 [m/s], with the mean speed of moving bases over the
    first step."""
    opening = np.zeros(len(problem.contacts))
    for body in problem.bodies:
        ports = np.zeros(len(body.greens.ports))
        if body.velocity:
            ports = ports + [body.velocity_of(port) for port in range(len(ports))]
        if body.state is not None and body.greens.modal is not None:
            ports = ports + body.greens.modal.shapes.T @ body.state.velocity
        opening += problem.directions(body).T @ ports
    return np.asarray(-opening - np.diff(problem.find_base_gaps(np.array([0.0, dt])), axis=0)[0] / dt)


def find_step_responses(contacts: Sequence[Contact], striker: Body, dt: float) -> Array:
    """Return `ContactRecord.step_responses` (2, p) of some contacts of a striker for steps of ``dt`` [s].

    Each is the sum of the driving-point responses of both bodies; (2, 0) if any contact has a film.
    """
    if any(contact.film is not None for contact in contacts):
        return np.zeros((2, 0))
    responses, times = np.zeros((2, len(contacts))), np.array([dt / 2, dt])
    of_ports: dict[int, Array] = {}  # by Green's function, as contacts share bodies
    for column, contact in enumerate(contacts):
        for body, port in ((striker, contact.striker_port), (contact.target, contact.port)):
            if isinstance(contact.law, Signorini):
                if id(body.greens) not in of_ports:
                    of_ports[id(body.greens)] = body.greens.own_step_responses(times)
                responses[:, column] += of_ports[id(body.greens)][:, body.greens.port_index(port)]
    return responses


def _find_groups(record: ContactRecord) -> Iterator[tuple[int, int, _Touch]]:
    """Yield the first step, the step after the last one and the first touch of each contact group that begins with an
    approach."""
    steps = histories.closed_steps(record.closed[1:])
    if not len(steps):
        return
    preloaded = bool(record.closed[0])
    for first, last in np.rint(histories.merged(record.dt * steps) / record.dt).astype(np.int64).tolist():
        if not (preloaded and first == 0) and (touch := _find_first_touch(record, first)).speed > 0:
            yield first, last, touch


class _Touch(NamedTuple):
    """The part that touches first, its closing speed over the step before [m/s], and the time of its touch [s].

    ``first_parts``: all parts that touch at that time; ``part`` is the fastest of them.
    """

    part: int
    speed: float
    time: float
    first_parts: tuple[int, ...]


def _find_first_touch(record: ContactRecord, first: int) -> _Touch:
    """Return the first touch in the step number ``first``; with a film, all touches in that step count as one."""
    row = int(np.searchsorted(record.grid.ends, first + 1))
    touching = np.flatnonzero(record.solid[row] > 0)
    if first == 0:
        speeds = record.closing[touching]
    else:
        before, now = record.grid.spread_motions(record.gap, first - 1, first)[:, touching]
        speeds = (before - now) / record.dt
    times = np.full(len(touching), record.dt * first)
    if record.step_responses.size:
        times = np.array([_find_touch_time(record, row, int(part)) for part in touching])
    together = times <= times.min() + TOGETHER * record.dt
    fastest = int(np.argmax(np.where(together, speeds, -np.inf)))
    return _Touch(
        int(touching[fastest]), float(speeds[fastest]), float(times.min()), tuple(touching[together].tolist())
    )


def _find_touch_time(record: ContactRecord, row: int, part: int) -> float:
    """Return the time at which the gap of a part closes in its first closed step, the number ``row`` [s]."""
    time = record.dt * record.grid.ends[max(row - 2, 0) : row + 1]
    gap = record.gap[max(row - 2, 0) : row, part]
    speed = record.closing[part] if row == 1 else (gap[0] - gap[1]) / (time[1] - time[0])
    return float(time[-2] + (min(max(gap[-1], 0.0) / speed, time[-1] - time[-2]) if speed > 0 else 0.0))


def _find_opening_time(record: ContactRecord, row: int, part: int) -> float:
    """Return the time at which a part opens after its last closed step, the number ``row`` [s]; nan where only the
    step is known."""
    half, whole = record.step_responses[:, part] if record.step_responses.size else (0.0, 0.0)
    if not whole and record.gap[row, part] > 0:  # the gap has opened before the end of that step
        row -= 1
    if not record.step_responses.size or row + 2 > len(record.gap):
        return math.nan
    (start, end), (now, after) = record.dt * record.grid.ends[row : row + 2], record.gap[row : row + 2, part]
    depth, span = whole * record.solid[row, part] - now, end - start
    if not depth > 0 <= after or (whole and span > record.dt * (1 + 1e-9)):
        return math.nan
    return float(start - (span * (1 - half / whole) if whole else 0.0) + span * depth / (depth + after))


def _measure_landing(
    record: ContactRecord, mean: Array, static: Array, first: int, last: int, touch: _Touch
) -> Landing:
    """Return the landing of one contact group, from step ``first`` to before ``last``.

    ``mean``, ``static``: (n,) averages over the filter of the force and of the quasi-static load [N].
    """
    dt, reach = record.dt, max(1, round(record.width / (2 * record.dt)))
    above = mean - static
    peak = first + int(np.argmax(above[first : last + 1]))
    whole = slice(first, last + 1)
    ends = [
        _find_calm_step(mean[whole], static[whole], peak - first, reach, band * BAND)
        for band in (1.0, 1 - DOUBT, 1 + DOUBT)
    ]
    presses = ends[0] <= last - first
    steps = [min(end, last - first) for end in ends]
    end = first + steps[0]
    opening = math.nan
    if not presses:
        row = int(np.searchsorted(record.grid.ends, last))
        opening = max(_find_opening_time(record, row, int(each)) for each in np.flatnonzero(record.solid[row] > 0))
    if presses:  # contact after the end belongs to the static load
        largest = float(mean[first : end + 1].max())
    else:
        spread = 2 * reach + 1
        largest = histories.largest_average(record.force[1:][max(first - spread, 0) : end + spread], dt, record.width)
    return Landing(
        start=dt * first,
        end=dt * end,
        peak_time=dt * peak,
        part=touch.part,
        closing_speed=touch.speed,
        first_parts=touch.first_parts,
        filtered_peak=largest,
        static_load=float(static[peak]),
        excess_peak=float(above[peak]) if static[peak] else largest,
        impulse=dt * float(np.sum(record.force[first + 1 : end + 1] - record.static[first + 1 : end + 1])),
        pressed_on=presses,
        cut_off=not presses and last >= len(record.force) - 1,
        end_doubt=dt * max(abs(step - steps[0]) for step in steps) if presses else 0.0,
        to_touch=touch.time - dt * first,
        to_opening=0.0 if math.isnan(opening) else opening - dt * end,
        is_resolved=not math.isnan(opening) and bool(np.all(record.closed[first + 1 : last + 1])),
    )


def _find_calm_step(mean: Array, static: Array, peak: int, reach: int, band: float) -> int:
    """Return the first step after the ``peak`` from which ``mean`` stays within ``band`` of the static load for one
    contact time; the number of all steps if there is none. ``reach``: half the filter width [steps]."""
    if not np.any(static > 0):
        return len(mean)
    above = mean > (1 + BAND) * static
    before, after = np.flatnonzero(~above[:peak]), np.flatnonzero(~above[peak:])
    start = int(before[-1]) + 1 if before.size else 0
    stop = peak + int(after[0]) if after.size else len(mean)
    contact_time = max(stop - start, 2 * reach)
    within = (np.abs(mean - static) <= band * static) & (static > 0)
    runs = histories.closed_steps(within[peak:])
    return next((peak + int(first) for first, last in runs if last - first >= contact_time), len(mean))


Stored = Callable[[Sequence[int]], Array]
"""Function that returns the striker's energy after given numbers of steps, which increase [J]; nan if unknown."""


def find_restitutions(
    problem: ContactProblem,
    force: Array,
    grid: TimeGrid,
    landings: Sequence[Landing],
    stored: Stored,
    loads: Array,
    *,
    side: int = 1,
) -> tuple[float | None, ...]:
    """Return the coefficient of restitution of each landing, in order of time, on the contacts of one ``side``.

    For a held striker it is sqrt(E'/E) of its energies after and before the landing, by ``stored``; they include the
    work of other contacts and of loads during the landing. For a free striker it is the ratio of the opening to the
    closing speed of the bodies' translations, moving bases included, as the mean over the contacts. ``None`` if the
    bodies do not part, or if the energy is unknown. ``force`` (N, p): forces of all contacts in the steps of ``grid``
    [N]; ``loads`` (L, n): amplitudes of the striker's loads [N].
    """
    have_rebound, is_held = [landing.has_rebound for landing in landings], math.isinf(problem.striker.mass)
    if not any(have_rebound):
        return (None,) * len(landings)
    edges = [landing.find_edges(grid) for landing in landings]
    if is_held:
        steps = sorted({step for pair in edges for step in pair})
        values = np.zeros(int(grid.ends[-1]) + 1)
        values[steps] = stored(steps)
    else:
        values = _find_mean_closing_speeds(problem, force, grid, loads, side)
    coefficients: list[float | None] = []
    for (before, after), rebounds in zip(edges, have_rebound, strict=True):
        ratio = float(values[after] / values[before]) if rebounds and values[before] > 0 else None
        coefficients.append(None if ratio is None else math.sqrt(max(ratio, 0.0)) if is_held else -ratio)
    return tuple(coefficients)


def _find_mean_closing_speeds(problem: ContactProblem, force: Array, grid: TimeGrid, loads: Array, side: int) -> Array:
    """Return the (n + 1,) mean closing speed of the bodies' translations at the contacts of one side [m/s]."""
    face = np.array([contact.side == side for contact in problem.contacts])
    start_speed, change, dt = 0.0, np.zeros(len(force) + 1), grid.dt
    for body in problem.bodies:
        signs = problem.directions(body)
        weights = signs[:, face].mean(axis=1)
        start = np.array([body.velocity_of(port) for port in range(len(weights))])
        inverse = body.greens.inverse_mass()
        start_speed += float(weights @ start)
        acceleration = force @ (signs.T @ np.where(np.isfinite(inverse), inverse, 0.0) @ weights)
        change[1:] += np.cumsum(acceleration * grid.spans)
    speed = start_speed + grid.spread_motions(change)
    modal = problem.striker.greens.modal
    if modal is not None and len(loads):
        rigid, weights = modal.omega == 0, problem.directions(problem.striker)[:, face].mean(axis=1)
        for load, amplitude in zip(problem.striker.loads, loads, strict=True):
            inverse_mass = float((modal.shapes[rigid] @ weights) @ load.shape[rigid])
            speed[1:] += inverse_mass * dt * np.cumsum(amplitude)
    if problem.has_moving_base:
        carried = problem.find_base_gaps(np.asarray(dt * np.arange(len(speed)), dtype=np.float64))
        speed += np.gradient(carried[:, face].mean(axis=1), dt)
    return -speed
