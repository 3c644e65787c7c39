"""Cheap runs before the run: a surrogate seat, and only the impact that the measures come from.

The reed's free flight is exact, so a pre-run starts shortly before the first contact and ends with the contact group
that carries the filtered peak.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

import impact
from impact import measures
from impact.after.histories import MOVING_AVERAGE, averaged
from impact.after.landings import Landing
from impact.after.loads import StaticLoad
from impact.bodies.body import Body, ModalState
from impact.greens import oscillator
from impact.greens.base import Array, GreensFunction, GreensFunctionError
from impact.march.motion import Discrete
from impact.march.prepared import Prepared, step_count
from impact.notices import Progress, silent
from impact.runs.variations import Values
from seatfem.structures.estimates.surrogate import Face
from seatfem.structures.kinds import Structure
from seatfem.structures.method import Method
from seatfem.structures.rings import Division, divided_less, parts_joined
from seatfem.study import impacts
from seatfem.study.impacts import contact
from seatfem.study.impacts.bodies import on_its_base, problem_of, solve_body, striker_of
from seatfem.study.impacts.landings import landings_of_march, static_load_of_march
from seatfem.study.impacts.touches import force_of, stopper_force_of
from seatfem.study.scene import Scene
from seatfem.study.scene.measures import (
    HARDEST,
    PREFIXES,
    all_measures,
    any_needs_displacement,
    any_needs_stress,
    judged_landing,
    values_of,
)
from seatfem.study.scene.problems import in_role

FEW: Final = 16  # reed modes of the first look
LOOK: Final = 20_000  # steps of the first look ...
MOST_OF_LOOK: Final = 100_000  # ... and at most, where the filter asks for more
BEFORE: Final = 10e-6  # start of the window before the first contact [s]
MOST: Final = 60_000  # steps of a pre-run at most
RESOLVED: Final = 0.2  # radians of the highest mode in a step that resolves it
LEAST: Final = 8  # steps per filter width that every pre-run can afford


@dataclass(frozen=True)
class Window:
    """The part of the run that pre-runs march.

    Attributes:
        start: [s] of the run.
        duration: [s].
        groups: contact groups in the whole run, at a first look.
        landing: [s] of the run, when the one that is judged begins; ``None``: there is none, or all of the run is.
    """

    start: float
    duration: float
    groups: int
    landing: float | None = None

    @property
    def touches(self) -> bool:
        """Return whether there is any contact."""
        return self.groups > 0


def surrogate_striker(
    reed: Structure, method: Method, duration: float, face: Face, progress: Progress = silent
) -> GreensFunction | None:
    """Return the Green's function that pre-runs of a ``duration`` [s] take for a striker that has to be computed: its
    own, by a method, only where nothing else describes it; ``None`` for a closed form.

    ``face``: of the seat.
    """
    if not reed.traits.is_solved:
        return None
    is_plate = reed.thin_plate is not None
    if not is_plate:
        with in_role("reed", reed):
            if reed.elastic is not None:
                return reed.elastic.stand_in(duration, face)
            surrogate = reed.surrogate(duration, face)
        if surrogate.exact:
            return surrogate.greens
    solved = solve_body("reed", reed, method, duration, progress, mesh_error=not is_plate)
    return None if solved is None else solved.greens


def locate_contact_window(
    scene: Scene, seat: GreensFunction, striker: GreensFunction | None = None, stopper: Body | None = None
) -> Window:
    """Return where the contact is that matters: a coarse run with few modes over the whole duration.

    ``striker``: what stands for one that has to be computed.
    """
    beam = scene.reed.slender
    few = striker_of(scene, None if beam is None else min(FEW, beam.n_modes), striker)
    width = scene.run.filter_width
    dt = min(max(scene.run.duration / LOOK, width / 10), width / 2, scene.run.duration / 200)
    if few.is_deflected and (g := few.greens.modal) is not None and np.any(g.omega):
        dt = min(dt, 1 / float(g.omega[g.omega > 0].min()))  # it may swing back as fast as that
    dt = max(dt, scene.run.duration / MOST_OF_LOOK)
    looked = _marched(impact.prepare(problem_of(scene, few, Body(seat.forces_only()), stopper), dt, scene.run.duration))
    landings = landings_of_march(looked, width, rebound=False).seat
    return window_of(scene, few, force_of(looked)[1:], dt, stopper_force_of(looked), landings)


def window_of(
    scene: Scene,
    striker: Body,
    force: Array,
    dt: float,
    stopper: Array | None = None,
    landings: Sequence[Landing] = (),
) -> Window:
    """Return the window from shortly before the first contact to the end of the group with the landing that is judged.

    From the start where the flight of the ``striker`` is not free, or has no modes that tell how far it has come. Where
    all of the run is judged, or nothing lands, the group is that of the filtered peak.

    Args:
        scene: what is asked.
        striker: that flies.
        force: (n,) on the seat [N].
        dt: step [s].
        stopper: (n + 1,) its force [N]; what it changes before the reed comes to the seat belongs to the window.
        landings: on the seat.
    """
    width = scene.run.filter_width
    longest = MOST * width / LEAST
    groups = measures.merged(dt * measures.closed_steps(force))
    if len(groups) == 0:
        return Window(0.0, min(scene.run.duration, longest), 0)
    choice = scene.accuracy.landing
    judged = None if choice == "run" else judged_landing(landings, choice)
    peak = dt * int(np.argmax(averaged(force, dt, width, MOVING_AVERAGE))) if judged is None else judged.peak_time
    carrying = int(np.searchsorted(groups[:, 0], peak + width, side="right")) - 1
    first = float(groups[0, 0])
    if stopper is not None and np.any(stopper):
        first = min(first, dt * (int(np.flatnonzero(stopper)[0]) - 1))
    start = max(0.0, first - max(BEFORE, 5 * dt, 2 * width))
    if scene.is_loaded or scene.contact.preload or scene.contact.film or striker.greens.modal is None:
        start = 0.0
    end = float(groups[max(carrying, 0), 1])
    if judged is not None and judged.pressed_on:  # the load that presses it on is no part of it
        end = min(end, judged.end + judged.duration + judged.end_doubt)
    stop = min(scene.run.duration, end + max(BEFORE, 2 * width))
    return Window(start, min(stop - start, longest), len(groups), None if judged is None else judged.start)


@dataclass(frozen=True)
class Bench:
    """Pre-runs of one scene: the same window again and again, one thing changed at a time.

    Attributes:
        scene: whose impact they march.
        seat: what is struck, or what stands for it, unless a run has another one.
        window: the part of the run that they march.
        striker: of a body that has to be computed, its Green's function or what stands for it; ``None`` of others.
        stopper: of a scene that has one.
        other: in place of the scene's striker.
        look: at the stress of a plate, where it is asked for; ``None``: at a few places.
    """

    scene: Scene
    seat: GreensFunction
    window: Window
    striker: GreensFunction | None = None
    stopper: Body | None = None
    other: Body | None = None
    look: impacts.plate_stress.PlateLook | None = None
    _strikers: dict[tuple[float, int | None], Discrete] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _seats: dict[float, Discrete] = field(default_factory=dict, init=False, repr=False, compare=False)
    _stoppers: dict[float, Discrete] = field(default_factory=dict, init=False, repr=False, compare=False)
    _loads: list[StaticLoad] = field(default_factory=list, init=False, repr=False, compare=False)
    _plates: list[impacts.plate_stress.PlateLook | None] = field(
        default_factory=list, init=False, repr=False, compare=False
    )

    def divided(self, division: Division) -> Bench:
        """Return the bench with the lip of both bodies in fewer parts."""
        own = Division.from_greens(self.seat)
        striker = None if self.striker is None else parts_joined(self.striker, own, division)
        return replace(self, seat=divided_less(self.seat, division), striker=striker)

    def affords(self, dt: float) -> bool:
        """Return whether a pre-run with this step [s] is cheap."""
        return self.window.duration <= MOST * dt * (1 + 1e-9)

    def affordable(self, dt: float) -> float:
        """Return ``dt``, or the shortest step that a pre-run can afford [s]."""
        return max(dt, self.window.duration / MOST)

    def resolves(self, dt: float, n_modes: int | None) -> bool:
        """Return whether a step [s] is short beside the oscillations of all modes of the bodies, which have modes."""
        striker = self._striker(dt, n_modes).body
        bodies = (self.seat, striker.greens, *(() if self.stopper is None else (self.stopper.greens,)))
        known = (greens.modal for greens in bodies)
        return all(g is not None and len(g.omega) and dt * g.omega.max() <= RESOLVED for g in known)

    def measures(self, *, dt: float, n_modes: int | None = None, seat: GreensFunction | None = None) -> Values:
        """Return the measures in the window [SI]; expensive ones only if the scene asks for them."""
        wanted, landing = self.scene.accuracy.measures, self.scene.accuracy.landing
        striker, target = self._striker(dt, n_modes), self._target(dt, self.seat if seat is None else seat)
        stoppers = self._beyond(dt)
        problem = problem_of(self.scene, striker.body, target.body, *(each.body for each in stoppers))
        prepared = impact.prepare(problem, dt, self.window.duration, bodies=(striker, target, *stoppers))
        stepper = _marched(prepared)
        displacement = any_needs_displacement(wanted)
        stress = self._look(dt) if any_needs_stress(wanted) else None
        landings = self._landings(stepper)
        record = contact.blow_of_march(self.scene, stepper, landings, displacement=displacement, stress=stress)
        values = values_of(record)
        names = [name for name, each in all_measures().items() if each.landing_key and name in {*values, *wanted}]
        prefixes = {HARDEST, PREFIXES[landing]}
        never = dict.fromkeys((prefix + name for name in names for prefix in prefixes), 0.0)
        return {**never, **values}

    def _landings(self, stepper: impact.ContactStepper) -> tuple[Landing, ...]:
        """Return the one landing of a pre-run that the window was made for; none where there is none."""
        if not self._loads:
            self._loads.append(static_load_of_march(stepper))
        rebound = "restitution" in self.scene.accuracy.measures
        landings = landings_of_march(stepper, self.scene.run.filter_width, self._loads[0], rebound=rebound).seat
        if self.window.landing is None or not landings:
            return landings
        begins = self.window.landing - self.window.start
        return (min(landings, key=lambda landing: abs(landing.start - begins)),)

    def _look(self, dt: float) -> contact.StressLook | None:
        """Return the look at the reed's stress: a beam's, or a plate's at a few places."""
        if (look := contact.bending_look(self.scene.geometry)) is not None:
            return look
        if self.scene.reed.thin_plate is None:
            return None
        if not self._plates:
            striker, division = striker_of(self.scene, None, self.striker), Division.from_greens(self.seat)
            self._plates.append(
                self.look or impacts.plate_stress.PlateLook.at_few_places(self.scene.geometry, striker, division)
            )
        if (plate := self._plates[0]) is None:
            return None
        start = dt * math.floor(self.window.start / dt)
        return replace(plate, field=replace(plate.field, body=advanced(plate.field.body, start)))

    def _striker(self, dt: float, n_modes: int | None) -> Discrete:
        """Return the striker with its free motion, which all runs of this step share."""
        if (dt, n_modes) not in self._strikers:
            start = dt * math.floor(self.window.start / dt)  # on the run's own grid: contact falls into the same step
            body = advanced(self.other or striker_of(self.scene, n_modes, self.striker), start)
            discrete = Discrete.from_body(body, dt, step_count(dt, self.window.duration))
            self._strikers[dt, n_modes] = replace(discrete, free=discrete.free_motion())
        return self._strikers[dt, n_modes]

    def _target(self, dt: float, seat: GreensFunction) -> Discrete:
        """Return the seat without energies; the bench's own is kept, as its step weights take longer than the march."""
        known = self._seats if seat is self.seat else {}
        if dt not in known:
            body = on_its_base(self.scene.mount("seat"), Body(seat.forces_only()))
            known[dt] = Discrete.from_body(body, dt, step_count(dt, self.window.duration))
        return known[dt]

    def _beyond(self, dt: float) -> tuple[Discrete, ...]:
        """Return the stopper, where there is one."""
        if self.stopper is None:
            return ()
        if dt not in self._stoppers:
            body = on_its_base(self.scene.mount("stopper"), self.stopper)
            self._stoppers[dt] = Discrete.from_body(body, dt, step_count(dt, self.window.duration))
        return (self._stoppers[dt],)


def prepare_bench(
    scene: Scene, reed: Method, seat: GreensFunction, stopper: Body | None, progress: Progress = silent
) -> Bench:
    """Return the bench on which the pre-runs of a scene run: its striker, by the method ``reed`` where it has to be
    computed, and the window of its contact."""
    striker = surrogate_striker(scene.reed, reed, scene.run.duration, scene.seat.face, progress)
    return Bench(scene, seat, locate_contact_window(scene, seat, striker, stopper), striker, stopper)


def advanced(body: Body, time: float) -> Body:
    """Return a modal body after free motion over ``time`` [s]; a translation stays in its velocity.

    Raises:
        GreensFunctionError: a body without modes to be moved.
    """
    if time == 0.0:
        return body
    if (g := body.greens.modal) is None:
        raise GreensFunctionError("a body without modes cannot be moved on: the window of a pre-run must begin at 0")
    start = body.modal_start()
    a, _ = oscillator.transition(time, g.omega, g.zeta)
    q = a[0, 0] * start.displacement + a[0, 1] * start.velocity
    v = a[1, 0] * start.displacement + a[1, 1] * start.velocity
    return replace(body, state=ModalState(q, v), velocity=0.0)


def relative_changes(one: Values, other: Values) -> Mapping[str, float]:
    """Return |other - one|/|one|, measure by measure; 0 where both are 0, infinite where the other has no value."""

    def change(value: float, changed: float) -> float:
        return abs(changed - value) / abs(value) if value else (0.0 if not changed else math.inf)

    return {name: change(value, other.get(name, math.inf)) for name, value in one.items()}


def _marched(prepared: Prepared) -> impact.ContactStepper:
    stepper = impact.ContactStepper(prepared, flying=True)
    stepper.advance(prepared.steps)
    return stepper
