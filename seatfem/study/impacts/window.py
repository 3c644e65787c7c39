"""The part of a run with the judged impact, marched again with other time steps.

The reed's free flight is known exactly, so that the window starts shortly before the first contact; it ends with the
group of contacts that contains the judged landing or the filtered peak.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from impact.after import histories
from impact.after.histories import MOVING_AVERAGE, averaged
from impact.after.landings import Landing
from impact.after.loads import StaticLoad
from impact.bodies.body import Body, ModalState
from impact.greens import oscillator
from impact.greens.base import Array, GreensFunction, GreensFunctionError
from impact.march.ladder import march
from impact.march.motion import DiscreteBody
from impact.march.prepared import step_count
from impact.march.rows import MarchRun
from impact.runs.variations import Values
from seatfem.study.impacts import contact
from seatfem.study.impacts.bodies import mount_on_base, problem_of
from seatfem.study.impacts.landings import landings_of_march, static_load_of_march
from seatfem.study.impacts.plate_stress import PlateLook
from seatfem.study.scene import Scene
from seatfem.study.scene.measures import HARDEST, PREFIXES, all_measures, any_needs, judged_landing, values_of

BEFORE: Final = 10e-6  # least time between the start of the window and the first contact [s]
MOST: Final = 7500.0  # longest window, over the filter's width


@dataclass(frozen=True)
class Window:
    """A part of a run.

    Attributes:
        start: start of the window in the time of the run [s].
        duration: length of the window [s].
        groups: number of contact groups in the whole run, by the first run.
        landing: start of the judged landing in the time of the run [s]; nan if there is none, or the whole run
            is judged.
    """

    start: float
    duration: float
    groups: int
    landing: float = math.nan

    @property
    def touches(self) -> bool:
        """Return whether there is any contact."""
        return self.groups > 0


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
    longest = MOST * width
    groups = histories.merged(dt * histories.closed_steps(force))
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
    return Window(start, min(stop - start, longest), len(groups), math.nan if judged is None else judged.start)


@dataclass(frozen=True)
class Excerpt:
    """A window of a run, which can be marched again.

    Attributes:
        scene: the scene.
        window: the part of the run that is computed.
        seat, striker: the two bodies; the striker at the start of the run.
        stopper: the stopper, if the scene has one.
        look: how a plate's stress is evaluated, if it is a measure.
    """

    scene: Scene
    window: Window
    seat: GreensFunction
    striker: Body
    stopper: Body | None = None
    look: PlateLook | None = None

    def measures(self, steps: Sequence[float]) -> list[Values]:
        """Return the measures in the window [SI] by each of some time ``steps`` [s], stress and displacement only if
        the scene asks for them; 0 for those of landings that do not happen.

        The static load without contact is that of the first.
        """
        load: StaticLoad | None = None
        values = []
        for dt in steps:
            run = self._marched(dt)
            load = static_load_of_march(run) if load is None else load
            values.append(self._values(run, dt, load))
        return values

    def _marched(self, dt: float) -> MarchRun:
        striker = advanced(self.striker, self._start(dt))
        seat, stopper = (
            None if body is None else mount_on_base(self.scene.mount(name), body)
            for name, body in (("seat", Body(self.seat.forces_only())), ("stopper", self.stopper))
        )
        assert seat is not None
        bodies = [
            DiscreteBody.from_body(body, dt, step_count(dt, self.window.duration))
            for body in (striker, seat, stopper)
            if body is not None
        ]
        problem = problem_of(self.scene, *(each.body for each in bodies))
        return march(problem, dt, self.window.duration, bodies=tuple(bodies))

    def _start(self, dt: float) -> float:
        """Return the start of the window on the time grid of the run [s]."""
        return dt * math.floor(self.window.start / dt)

    def _values(self, run: MarchRun, dt: float, load: StaticLoad) -> Values:
        wanted, landing = self.scene.accuracy.measures, self.scene.accuracy.landing
        displacement = any_needs(wanted, "displacement")
        stress = self._stress_look(dt) if any_needs(wanted, "stress") else contact.no_look
        landings = self._landings(run, load)
        record = contact.blow_of_march(self.scene, run, landings, landings, displacement=displacement, stress=stress)
        values = values_of(record, landings)
        names = [name for name, each in all_measures().items() if each.landing_key and name in {*values, *wanted}]
        prefixes = {HARDEST, PREFIXES[landing]}
        absent = dict.fromkeys((prefix + name for name in names for prefix in prefixes), 0.0)
        return {**absent, **values}

    def _landings(self, run: MarchRun, load: StaticLoad) -> tuple[Landing, ...]:
        """Return the landing nearest to that for which the window was made; all landings if it was made for none."""
        rebound = "restitution" in self.scene.accuracy.measures
        landings = landings_of_march(run, self.scene.run.filter_width, load, rebound=rebound).seat
        if math.isnan(self.window.landing) or not landings:
            return landings
        begins = self.window.landing - self.window.start
        return (min(landings, key=lambda landing: abs(landing.start - begins)),)

    def _stress_look(self, dt: float) -> contact.StressLook:
        """Return how the reed's stress is evaluated: along a beam, or at the places of a plate's `look`."""
        if self.look is None:
            return contact.bending_look(self.scene.geometry)
        field = self.look.field
        return replace(self.look, field=replace(field, body=advanced(field.body, self._start(dt))))


def advanced(body: Body, time: float) -> Body:
    """Return a modal body after free motion over ``time`` [s].

    Raises:
        GreensFunctionError: the body has no modes.
    """
    if time == 0.0:
        return body
    if (g := body.greens.modal) is None:
        raise GreensFunctionError("a body without modes cannot be moved on: its window must begin at 0")
    start = body.modal_start()
    a, _ = oscillator.transition(time, g.omega, g.zeta)
    q = a[0, 0] * start.displacement + a[0, 1] * start.velocity
    v = a[1, 0] * start.displacement + a[1, 1] * start.velocity
    return replace(body, state=ModalState(q, v), velocity=0.0)
