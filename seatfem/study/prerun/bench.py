"""Pre-runs of a plan: inexpensive runs on a coarse or surrogate seat, of only the impact that determines the measures.

The reed's free flight is known exactly, so a pre-run starts shortly before the first contact; it ends with the group of
contacts that contains the judged landing or the filtered peak.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Final

import numpy as np

from impact import measures
from impact.after.histories import MOVING_AVERAGE, averaged
from impact.after.landings import Landing
from impact.after.loads import StaticLoad
from impact.bodies.body import Body, ModalState
from impact.greens import oscillator
from impact.greens.base import Array, GreensFunction, GreensFunctionError
from impact.march.ladder import march
from impact.march.motion import Discrete
from impact.march.prepared import step_count
from impact.march.rows import Marched
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

FEW: Final = 16  # reed modes of the first run, which locates the contact
LOOK: Final = 20_000  # time steps of the first run ...
MOST_OF_LOOK: Final = 100_000  # ... and their limit, where the filter needs shorter ones
BEFORE: Final = 10e-6  # least time between the start of the window and the first contact [s]
MOST: Final = 60_000  # most time steps of a pre-run
RESOLVED: Final = 0.2  # largest phase of the highest mode per step [rad] at which the step resolves all modes
LEAST: Final = 8  # steps per filter width that every pre-run can afford


@dataclass(frozen=True)
class Window:
    """The part of the run that pre-runs compute.

    Attributes:
        start: start of the window in the time of the run [s].
        duration: length of the window [s].
        groups: number of contact groups in the whole run, by the first run.
        landing: start of the judged landing in the time of the run [s]; ``None`` if there is none, or the whole run
            is judged.
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
    """Return the Green's function of a striker in pre-runs of a ``duration`` [s]: a surrogate, or the one by ``method``
    for a plate and where no surrogate is exact; ``None`` for a striker in closed form.

    ``face``: contact face of the seat.
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
    """Return the window with the judged contact, from a coarse run with few modes over the whole duration.

    ``striker``: Green's function from `surrogate_striker`.
    """
    beam = scene.reed.slender
    body = striker_of(scene, None if beam is None else min(FEW, beam.n_modes), striker)
    width = scene.run.filter_width
    dt = min(max(scene.run.duration / LOOK, width / 10), width / 2, scene.run.duration / 200)
    if body.is_deflected and (g := body.greens.modal) is not None and np.any(g.omega):
        dt = min(dt, 1 / float(g.omega[g.omega > 0].min()))  # a deflected striker swings back at this frequency
    dt = max(dt, scene.run.duration / MOST_OF_LOOK)
    run = march(problem_of(scene, body, Body(seat.forces_only()), stopper), dt, scene.run.duration)
    landings = landings_of_march(run, width, rebound=False).seat
    return window_of(scene, body, force_of(run)[1:], dt, stopper_force_of(run), landings)


def window_of(
    scene: Scene,
    striker: Body,
    force: Array,
    dt: float,
    stopper: Array | None = None,
    landings: Sequence[Landing] = (),
) -> Window:
    """Return the window from shortly before the first contact to the end of the contact group of the judged landing.

    It begins at 0 if the flight of the ``striker`` is not free, or not known by modes. Where the whole run is judged,
    or nothing lands, the group is that of the filtered peak.

    Args:
        scene: the scene.
        striker: body in flight.
        force: (n,) contact force on the seat [N].
        dt: time step [s].
        stopper: (n + 1,) contact force on the stopper [N]; contacts with it before the seat belong to the window.
        landings: landings on the seat.
    """
    width = scene.run.filter_width
    longest = MOST * width / LEAST
    groups = measures.merged(dt * measures.closed_steps(force))
    if len(groups) == 0:
        return Window(0.0, min(scene.run.duration, longest), 0)
    choice = scene.accuracy.landing
    judged = None if choice == "run" else judged_landing(landings, choice)
    peak = dt * int(np.argmax(averaged(force, dt, width, MOVING_AVERAGE))) if judged is None else judged.peak_time
    group = int(np.searchsorted(groups[:, 0], peak + width, side="right")) - 1
    first = float(groups[0, 0])
    if stopper is not None and np.any(stopper):
        first = min(first, dt * (int(np.flatnonzero(stopper)[0]) - 1))
    start = max(0.0, first - max(BEFORE, 5 * dt, 2 * width))
    if scene.is_loaded or scene.contact.preload or scene.contact.film or striker.greens.modal is None:
        start = 0.0
    end = float(groups[max(group, 0), 1])
    if judged is not None and judged.pressed_on:  # the static load that keeps it closed afterwards does not count
        end = min(end, judged.end + judged.duration + judged.end_doubt)
    stop = min(scene.run.duration, end + max(BEFORE, 2 * width))
    return Window(start, min(stop - start, longest), len(groups), None if judged is None else judged.start)


@dataclass(frozen=True)
class Bench:
    """Pre-runs of one scene, which repeat the same window with one quantity changed at a time.

    Attributes:
        scene: the scene.
        seat: Green's function of the coarse or surrogate seat, unless a run passes another one.
        window: the part of the run that is computed.
        striker: Green's function from `surrogate_striker`; ``None`` for a closed form.
        stopper: the stopper, if the scene has one.
        other: body in place of the scene's striker.
        look: how a plate's stress is evaluated, if it is a measure; ``None``: at a few places.
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
        """Return the pre-runs with the lip of both bodies divided into fewer parts."""
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
        """Return whether all bodies have modes and a step ``dt`` [s] resolves the highest of them (`RESOLVED`)."""
        striker = self._striker(dt, n_modes).body
        bodies = (self.seat, striker.greens, *(() if self.stopper is None else (self.stopper.greens,)))
        modals = (greens.modal for greens in bodies)
        return all(g is not None and len(g.omega) and dt * g.omega.max() <= RESOLVED for g in modals)

    def measures(self, *, dt: float, n_modes: int | None = None, seat: GreensFunction | None = None) -> Values:
        """Return the measures in the window [SI], stress and displacement only if the scene asks for them; 0 for those
        of landings that do not happen."""
        wanted, landing = self.scene.accuracy.measures, self.scene.accuracy.landing
        striker, target = self._striker(dt, n_modes), self._target(dt, self.seat if seat is None else seat)
        stoppers = self._stopper_bodies(dt)
        problem = problem_of(self.scene, striker.body, target.body, *(each.body for each in stoppers))
        run = march(problem, dt, self.window.duration, bodies=(striker, target, *stoppers))
        displacement = any_needs_displacement(wanted)
        stress = self._look(dt) if any_needs_stress(wanted) else None
        landings = self._landings(run)
        record = contact.blow_of_march(self.scene, run, landings, displacement=displacement, stress=stress)
        values = values_of(record)
        names = [name for name, each in all_measures().items() if each.landing_key and name in {*values, *wanted}]
        prefixes = {HARDEST, PREFIXES[landing]}
        absent = dict.fromkeys((prefix + name for name in names for prefix in prefixes), 0.0)
        return {**absent, **values}

    def _landings(self, run: Marched) -> tuple[Landing, ...]:
        """Return the landing nearest to that for which the window was made; all landings if it was made for none."""
        if not self._loads:
            self._loads.append(static_load_of_march(run))
        rebound = "restitution" in self.scene.accuracy.measures
        landings = landings_of_march(run, self.scene.run.filter_width, self._loads[0], rebound=rebound).seat
        if self.window.landing is None or not landings:
            return landings
        begins = self.window.landing - self.window.start
        return (min(landings, key=lambda landing: abs(landing.start - begins)),)

    def _look(self, dt: float) -> contact.StressLook | None:
        """Return how the reed's stress is evaluated: along a beam, or at a few places of a plate."""
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
        """Return the striker with its motion without contact, cached for all runs of this time step."""
        if (dt, n_modes) not in self._strikers:
            start = dt * math.floor(self.window.start / dt)  # on the time grid of the run
            body = advanced(self.other or striker_of(self.scene, n_modes, self.striker), start)
            discrete = Discrete.from_body(body, dt, step_count(dt, self.window.duration))
            self._strikers[dt, n_modes] = replace(discrete, free=cache(discrete.free_motion))
        return self._strikers[dt, n_modes]

    def _target(self, dt: float, seat: GreensFunction) -> Discrete:
        """Return the seat, without energies; `seat` is cached, as step weights take longer than a pre-run."""
        cached = self._seats if seat is self.seat else {}
        if dt not in cached:
            body = on_its_base(self.scene.mount("seat"), Body(seat.forces_only()))
            cached[dt] = Discrete.from_body(body, dt, step_count(dt, self.window.duration))
        return cached[dt]

    def _stopper_bodies(self, dt: float) -> tuple[Discrete, ...]:
        """Return the stopper, if the scene has one, cached for all runs of this time step."""
        if self.stopper is None:
            return ()
        if dt not in self._stoppers:
            body = on_its_base(self.scene.mount("stopper"), self.stopper)
            self._stoppers[dt] = Discrete.from_body(body, dt, step_count(dt, self.window.duration))
        return (self._stoppers[dt],)


def prepare_bench(
    scene: Scene, reed: Method, seat: GreensFunction, stopper: Body | None, progress: Progress = silent
) -> Bench:
    """Return a scene's pre-runs, with the window of contact; ``reed``: method of a striker without surrogate."""
    striker = surrogate_striker(scene.reed, reed, scene.run.duration, scene.seat.face, progress)
    return Bench(scene, seat, locate_contact_window(scene, seat, striker, stopper), striker, stopper)


def advanced(body: Body, time: float) -> Body:
    """Return a modal body after free motion over ``time`` [s].

    Raises:
        GreensFunctionError: the body has no modes.
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
    """Return |other - one|/|one| of each measure: 0 if both are 0, infinite if one is 0 or the other has no value."""

    def change(value: float, changed: float) -> float:
        return abs(changed - value) / abs(value) if value else (0.0 if not changed else math.inf)

    return {name: change(value, other.get(name, math.inf)) for name, value in one.items()}
