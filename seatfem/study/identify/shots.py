"""The scene of a record file as a function of its fitted keys: computed records, and their derivatives."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

import impact
from impact.greens.base import Array
from impact.march import motion
from impact.march.prepared import step_count
from impact.march.problem import ContactProblem
from impact.runs.sensitivity import Neighbours, force_sensitivities, touches, why_no_derivative
from seatfem.fields import Value
from seatfem.structures.cache import Cache, build
from seatfem.study.identify.record import OWN, Identification, Samples, is_own, number_of
from seatfem.study.impacts.bodies import check_base, problem_of, solve_body, striker_of
from seatfem.study.impacts.contact import check_step, fallback_step, gauge_strains
from seatfem.study.method import stated_method
from seatfem.study.runs.afterwards import spring_for, static_stiffness
from seatfem.study.scene import Scene, load_scene
from seatfem.study.scene.problems import scene_error

WIDTH: Final = 1e-4
"""Half width of central differences of data, over the bounds of a key: errors are its square, 1e-8, and eps over it."""
OF_THE_CONTACT: Final = ("contact.law", "contact.gap")  # keys that change no body
MOST_BODIES: Final = 64  # largest number of bodies kept from the last evaluations
Values = Mapping[str, float]  # numbers of the fitted keys, each in the unit of its bounds
Course = tuple[Array, Array]  # computed times [s] and values [SI]


@dataclass(frozen=True)
class Shot:
    """Shot: changes to the scene's keys, and the numbers of its records."""

    changes: Mapping[str, Value]
    records: tuple[int, ...]


@dataclass(frozen=True)
class MarchRun:
    """Shot at given values of the keys: its scene, problem and time integration."""

    scene: Scene
    problem: ContactProblem
    stepper: impact.ContactStepper


@dataclass
class Model:
    """Residuals of the records: computed minus recorded, over the noise.

    Attributes:
        asked: record file.
        samples: recorded samples.
        finer: factor by which the time step is finer than the scene's.
        steps: time step of each shot [s].
        marches: number of time integrations so far.
        notes: reasons for derivatives by differences of runs, and on the search.
    """

    asked: Identification
    samples: tuple[Samples, ...]
    finer: int = 1
    steps: dict[int, float] = field(default_factory=dict)
    marches: int = 0
    notes: list[str] = field(default_factory=list)
    _bodies: dict[str, impact.Body] = field(default_factory=dict)
    _kernels: dict[tuple[int, float, int], motion.DiscreteBody] = field(default_factory=dict)
    _touches: dict[int, int] = field(default_factory=dict)
    _last: tuple[tuple[float, ...], list[MarchRun]] | None = None

    def __post_init__(self) -> None:
        groups: dict[str, list[int]] = {}
        for number, each in enumerate(self.asked.record):
            groups.setdefault(repr(sorted(each.set.items())), []).append(number)
        self.shots = tuple(Shot(self.asked.record[numbers[0]].set, tuple(numbers)) for numbers in groups.values())

    @property
    def keys(self) -> tuple[str, ...]:
        """Return the fitted keys."""
        return tuple(self.asked.fit)

    def values(self, shares: Array) -> dict[str, float]:
        """Return the numbers of the keys at positions (P,) within their bounds."""
        pairs = zip(self.asked.fit.items(), shares, strict=True)
        return {key: fitted.value(float(share)) for (key, fitted), share in pairs}

    def residuals(self, shares: Array) -> Array:
        """Return the residuals (N,), computed minus recorded, over the noise, at positions within the bounds."""
        pairs = zip(self.records_at(shares), self.samples, strict=True)
        return np.concatenate([(course - each.value) / each.noise for course, each in pairs])

    def at_finer_step(self, times: int) -> Model:
        """Return the model with a time step that is ``times`` finer, and the same bodies."""
        return replace(self, finer=times * self.finer, notes=[], steps={}, _touches={}, _last=None)

    def predicted(self, marched: Sequence[MarchRun]) -> dict[int, Course]:
        """Return the computed history of each record, by its number, without gain and delay."""
        return {
            number: course
            for shot, each in zip(self.shots, marched, strict=True)
            for number, course in self._courses(shot, each, each.stepper.force)
        }

    def records_at(self, shares: Array, *, spring: bool = False) -> list[Array]:
        """Return each record as computed at positions within the bounds; ``spring``: with a static seat."""
        values = self.values(shares)
        marched = [self._march(k, values, spring=True) for k in range(len(self.shots))] if spring else None
        predicted = self.predicted(marched or self._marched(shares))
        return [self._sample_record(values, number, predicted[number]) for number in range(len(self.samples))]

    def jacobian(self, shares: Array) -> Array:
        """Return the derivatives (N, P) of the residuals by the positions within the bounds."""
        values, marched = self.values(shares), self._marched(shares)
        predicted = self.predicted(marched)
        moved = [np.zeros((len(each.time), len(self.keys))) for each in self.samples]
        of_scene = [column for column, key in enumerate(self.keys) if not is_own(key)]
        for k, shot in enumerate(self.shots):
            for column, number, slope in self._slopes(k, shot, shares, marched[k], of_scene):
                moved[number][:, column] = self._sample_record(values, number, slope)
        for column, key in enumerate(self.keys):
            quantity, _, record_name = key.partition(".")
            if quantity not in OWN:
                continue
            per_share = self._per_share(shares, column) * number_of(self.asked.fit[key].written(1.0))
            for number, each in enumerate(self.samples):
                if record_name in ("", each.record.name):
                    moved[number][:, column] = per_share * self._differentiate_record(
                        values, number, predicted[number], quantity
                    )
        return np.concatenate([part / each.noise for part, each in zip(moved, self.samples, strict=True)])

    def _per_share(self, shares: Array, column: int) -> float:
        """Return the derivative of a key's number by its position."""
        fitted = self.asked.fit[self.keys[column]]
        low, high, value = fitted.low[0], fitted.high[0], fitted.value(float(shares[column]))
        return value * float(np.log(high / low)) if fitted.by_logarithm else high - low

    def _own(self, values: Values, number: int) -> tuple[float, float]:
        """Return gain and delay [s] of a record."""
        record = self.asked.record[number]
        own_values = {"gain": record.gain, "delay": record.delay}
        for quantity in OWN:
            for key in (quantity, f"{quantity}.{record.name}"):
                if key in values:
                    own_values[quantity] = number_of(self.asked.fit[key].written(values[key]))
        return own_values["gain"], own_values["delay"]

    def _sample_record(self, values: Values, number: int, course: Course) -> Array:
        """Return a history with the gain and delay of its record, interpolated linearly at its samples."""
        gain, delay = self._own(values, number)
        return np.asarray(gain * np.interp(self.samples[number].time - delay, *course))

    def _differentiate_record(self, values: Values, number: int, course: Course, quantity: str) -> Array:
        """Return the derivative of `_sample_record` by the gain, or by the delay: minus the interpolation's slope."""
        gain, delay = self._own(values, number)
        time, value = course
        times = self.samples[number].time - delay
        if quantity == "gain":
            return np.asarray(np.interp(times, time, value))
        piece = np.clip(np.searchsorted(time, times, side="right") - 1, 0, len(time) - 2)
        slope = (value[piece + 1] - value[piece]) / (time[piece + 1] - time[piece])
        return np.where((times < time[0]) | (times > time[-1]), 0.0, -gain * slope)

    def _slopes(
        self, k: int, shot: Shot, shares: Array, marched: MarchRun, columns: Sequence[int]
    ) -> Iterator[tuple[int, int, Course]]:
        """Yield (column, number of record, derivative of its history by the position) for each of the ``columns``."""
        stepper, force, sides = marched.stepper, marched.stepper.force, []
        for column in columns:
            low, high = (np.clip(shares[column] + sign * WIDTH, 0.0, 1.0) for sign in (-1, 1))
            below, above = shares.copy(), shares.copy()
            below[column], above[column] = low, high
            sides.append((float(low - shares[column]), float(high - shares[column]), below, above))
        met = touches(force)
        why = why_no_derivative(stepper)
        if not why and self._touches.get(k, met) != met:
            why = "the contact closes more or less often than an iteration before"
        self._touches[k] = met
        if why:
            note = f"derivatives by differences of marches: {why}"
            self.notes += [note] if note not in self.notes else []
            pairs = [(self._march(k, self.values(a)), self._march(k, self.values(b))) for _, _, a, b in sides]
            forces = [(one.stepper.force, other.stepper.force) for one, other in pairs]
        else:
            pairs = [(self._posed(k, self.values(a)), self._posed(k, self.values(b))) for _, _, a, b in sides]
            near = [
                Neighbours(one.stepper.prepared, other.stepper.prepared, high - low)
                for (one, other), (low, high, _, _) in zip(pairs, sides, strict=True)
            ]
            slopes = force_sensitivities(stepper, near) if near else np.zeros((0, *force.shape))
            reached = zip(slopes, sides, strict=True)
            forces = [(force + low * slope, force + high * slope) for slope, (low, high, _, _) in reached]
        for column, pair, pushed, (low, high, _, _) in zip(columns, pairs, forces, sides, strict=True):
            both = [dict(self._courses(shot, each, acts, marched)) for each, acts in zip(pair, pushed, strict=True)]
            for number in shot.records:
                time, below = both[0][number]
                yield column, number, (time, (both[1][number][1] - below) / (high - low))

    def _marched(self, shares: Array) -> list[MarchRun]:
        """Return all shots at positions within the bounds; the last ones are stored."""
        place = tuple(map(float, shares))
        if self._last is None or self._last[0] != place:
            self._last = place, [self._march(k, self.values(shares)) for k in range(len(self.shots))]
        return self._last[1]

    def _march(self, k: int, values: Values, *, spring: bool = False) -> MarchRun:
        posed = self._posed(k, values, spring=spring)
        posed.stepper.advance(posed.stepper.prepared.steps)
        self.marches += 1
        return posed

    def _posed(self, k: int, values: Values, *, spring: bool = False) -> MarchRun:
        """Return a shot before its time integration."""
        shot = self.shots[k]
        keys = {key: self.asked.fit[key].written(value) for key, value in values.items() if not is_own(key)}
        scene = load_scene(self.asked.scene, {**shot.changes, **keys})
        self._check(shot, [gauge.name for gauge in scene.gauge], scene.run.duration)
        striker, seat = self._bodies_of(scene, {**shot.changes, **keys})
        if k not in self.steps:
            check_step(scene)
            step = scene.run.time_step or fallback_step(scene.run, scene.driven_by, striker.greens, seat.greens)
            self.steps[k] = step / self.finer
        if spring:
            seat = impact.Body(spring_for(seat.greens, static_stiffness(seat.greens, scene.seat.endless_stiffness)))
        problem, dt = problem_of(scene, striker, seat), self.steps[k]
        bodies = tuple(self._discrete(body, dt, step_count(dt, scene.run.duration)) for body in problem.bodies)
        prepared = impact.prepare(problem, dt, scene.run.duration, bodies=bodies)
        return MarchRun(scene, problem, impact.ContactStepper(prepared))

    def _bodies_of(self, scene: Scene, changes: Mapping[str, Value]) -> tuple[impact.Body, impact.Body]:
        """Return striker and seat, reusing bodies of earlier evaluations whose keys are the same."""
        bodies = []
        for role, other in (("reed", "seat."), ("seat", "reed.")):
            relevant = {key: each for key, each in changes.items() if not key.startswith((*OF_THE_CONTACT, other))}
            place = repr((role, sorted(relevant.items())))
            if place not in self._bodies:
                while len(self._bodies) >= MOST_BODIES:
                    del self._bodies[next(iter(self._bodies))]
                method, duration = stated_method(scene), scene.run.duration
                if role == "seat":
                    seat = build(scene.seat, method.seat, duration, Cache(None), mesh_error=False).greens
                    check_base(scene.mount("seat"), seat, duration)
                    self._bodies[place] = impact.Body(seat)
                else:
                    reed = solve_body("reed", scene.reed, method.reed, duration)
                    self._bodies[place] = striker_of(scene, greens=None if reed is None else reed.greens)
            bodies.append(self._bodies[place])
        return bodies[0], bodies[1]

    def _discrete(self, body: impact.Body, dt: float, n: int) -> motion.DiscreteBody:
        """Return a discretised body, with the kernel of an earlier evaluation if its Green's function is the same."""
        place = (id(body.greens), dt, n)
        if (like := self._kernels.get(place)) is None:
            while len(self._kernels) >= MOST_BODIES:
                del self._kernels[next(iter(self._kernels))]
            self._kernels[place] = like = motion.DiscreteBody.from_body(body, dt, n)
        if like.body is body:
            return like
        return replace(like, body=body, loads=body.load_amplitudes(motion.find_middle_times(dt, n)))

    def _check(self, shot: Shot, gauges: Sequence[str], duration: float) -> None:
        """Raise `SceneError` for records that a scene with these gauges, of this duration [s], cannot produce."""
        for number in shot.records:
            each = self.samples[number]
            if each.record.kind == "strain" and each.record.of not in gauges:
                listed = f"has {', '.join(gauges)}" if gauges else "has none"
                words = f"{each.record.of!r} is no [[gauge]] of the scene, which {listed}: add it there"
                raise scene_error(f"record.{number}.of", f"{each.record.name}: {words}")
            if each.time[-1] - each.record.delay > duration * (1 + 1e-9) or each.time[0] < 0:
                words = (
                    f"samples from {each.time[0]:g} to {each.time[-1]:g} s are compared, the scene runs from 0 to "
                    f"run.duration = {duration:g} s: state from and to, or a longer run.duration"
                )
                raise scene_error(f"record.{number}.to", f"{each.record.name}: {words}")

    def _courses(
        self, shot: Shot, marched: MarchRun, force: Array, like: MarchRun | None = None
    ) -> Iterator[tuple[int, Course]]:
        """Yield (number, history) of each record of a shot under contact forces (n, p) [N].

        ``like``: run with the openings on which loads depend; ``None``: this one.
        """
        problem, dt = marched.problem, marched.stepper.prepared.dt
        n = len(force)
        ends: Array = np.asarray(dt * np.arange(n + 1), dtype=np.float64)
        middles = ends[1:] - dt / 2
        seats = np.array([contact.side > 0 for contact in problem.contacts])
        whole = np.concatenate([np.zeros((1, force.shape[1])), force])
        on_seat, others = whole[:, seats].sum(axis=1), whole[:, ~seats].sum(axis=1)
        kinds = {self.asked.record[number].kind for number in shot.records}
        strains: Mapping[str, Array] = {}
        if "strain" in kinds:
            opening = (like or marched).stepper.opening
            rolls = len(problem.striker.greens.ports) > 2  # each part of a retainer has a port of its own
            stopper = None if seats.all() else whole[:, ~seats] if rolls else others
            strains = gauge_strains(marched.scene.gauged, problem.striker, on_seat, stopper, dt, opening)
        for number in shot.records:
            record = self.asked.record[number]
            if record.kind == "force":
                yield number, (middles, on_seat[1:])
            elif record.kind == "strain":
                yield number, (middles, strains[record.of][1:])
            else:
                moved = _displacement(problem, record.of, dt, force, ends)
                yield (
                    number,
                    ((ends, moved) if record.kind == "displacement" else (middles, np.asarray(np.diff(moved) / dt))),
                )


def _displacement(problem: ContactProblem, role: str, dt: float, force: Array, times: Array) -> Array:
    """Return the displacement (n + 1,) of a body at the contact with the seat, averaged over its ports [m]."""
    first = next((contact for contact in problem.contacts if contact.side > 0), problem.contacts[0])
    body = first.target if role == "seat" else problem.striker
    parts = [contact for contact in problem.contacts if contact.target is first.target]
    ports = sorted({body.greens.port_index(each.port if role == "seat" else each.striker_port) for each in parts})
    discrete = motion.DiscreteBody.from_body(body, dt, len(force))
    moved = discrete.motion(motion.PortForces.at_ports(problem.directions(body) @ force.T, discrete.dt)).displacement
    return np.asarray(moved[ports].mean(axis=0) + body.find_base_displacement(times))
