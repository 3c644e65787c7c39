"""Runs of a contact problem: limits of the time step, time integration, and records for the measures, gauges and
springs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

import impact
from impact.after.histories import UNKNOWN_STRESS, ReedStress
from impact.after.landings import Landing, pair_landings
from impact.after.loads import spring_displacements, without_springs
from impact.bodies.body import Body
from impact.bodies.loads import SprungBody
from impact.files import csv_table
from impact.greens.base import Array, GreensFunction
from impact.march import motion
from impact.march.grid import TimeGrid
from impact.march.ladder import NO_STEPS, march
from impact.march.prepared import step_count
from impact.march.problem import RigidContactError
from impact.march.rows import MarchRun
from impact.march.stepper import with_recorded_loads
from impact.notices import Progress, SeatfemError, silent
from impact.runs.variations import Values, with_body
from seatfem.machine.resources import available_memory
from seatfem.structures.rings import Division
from seatfem.study.impacts import touches
from seatfem.study.impacts.bodies import check_base, problem_of
from seatfem.study.impacts.forces import Strike, known_stress
from seatfem.study.impacts.landings import Landings, landings_of_march, seat_contacts
from seatfem.study.impacts.touches import pushes
from seatfem.study.scene import Run, Scene, drives, lips, local, measures
from seatfem.study.scene.drives import Gauged
from seatfem.study.scene.wings import Drive, PortLift, longest_step
from seatfem.units import write_quantity

FILE: Final = "gauges.csv"
Strains = Mapping[str, Array]
"""The (n + 1,) strain of each gauge by its name, > 0 in tension, in the middle of the step that ends at each time."""


def gauge_strains(
    gauged: Sequence[Gauged], striker: Body, force: Array, stopper: Array | None, dt: float, opening: Array
) -> Strains:
    """Return the strain at gauges in a run, from the contact forces (n + 1,) of seat and stopper, if there is one [N],
    and the mean ``opening`` (n + 1,) at the seat [m], at time steps ``dt`` [s]."""
    if not gauged:
        return {}
    pushed = pushes(striker, force, stopper)
    marched = without_springs(with_recorded_loads(striker, opening, dt), pushed, dt)
    above = stopper if stopper is None else stopper.reshape(len(stopper), -1).sum(axis=1)
    forces = {"seat": force, "reed": pushed, "stopper": above}
    return {each.gauge.name: _strain(each, forces[each.gauge.of], dt, marched) for each in gauged}


def _strain(gauged: Gauged, force: Array | None, dt: float, striker: Body) -> Array:
    gauge, body, wave = gauged.gauge, gauged.mount.structure, gauged.mount.wave
    assert force is not None
    strain = body.strain_at(gauge.at, force, dt, striker, gauged.contact_at)
    if wave is not None and (speed := body.wave_speed):
        middle = np.asarray(dt * (np.arange(len(strain)) - 0.5), dtype=np.float64)
        return np.asarray(strain + wave.incoming(speed).strain_at(middle, gauge.at))
    return strain


def gauge_values(strains: Strains) -> Values:
    """Return the largest and the smallest strain of each gauge, by their keys in summary.json."""
    ends = (("largest", np.max), ("smallest", np.min))
    return {f"gauge_{name}_{word}_strain": float(end(strain)) for name, strain in strains.items() for word, end in ends}


def write_strains(folder: Path, strains: Strains, dt: float) -> Path:
    """Write gauges.csv, the histories of all gauges, one row a step at its middle; return its path."""
    columns: Sequence[Array] = list(strains.values())
    time = dt * (np.arange(1, len(columns[0])) - 0.5)
    heads = ["time [s]", *(f"{name} [m/m]" for name in strains)]
    csv_table.write_csv(folder / FILE, heads, np.column_stack([time, *(column[1:] for column in columns)]).tolist())
    return folder / FILE


def valve_spring_keys(springs: Sequence[drives.ValveSpring], strike: Strike) -> dict[str, object]:
    """Return the keys of the total force of the valve springs towards the seat: the largest, and that at the start of
    the hardest landing; none without springs."""
    striker, touches = strike.striker, strike.touches
    if not isinstance(striker, SprungBody):
        return {}
    marched, gap = with_recorded_loads(striker, touches.opening, strike.dt), strike.geometry.contact.gap
    (change,) = spring_displacements(marched, strike.pushes, strike.dt, striker.springs.stiffness[:, None])
    force = np.asarray(sum(spring.force_on_undeformed(gap) for spring in springs) + change)
    hard = touches.landings.hardest
    return {
        "valve_spring_force_max_N": float(force.max()),
        "valve_spring_force_at_landing_N": hard and float(np.interp(hard.start, touches.seat.time, force)),
    }


STEPS_PER_RADIAN = 4  # steps per radian of the highest rate in either body: a fortieth of a rod's transit
STEPS_PER_FILTER = 20  # steps in the filter's width of a method without a step
LEAST_STEPS_PER_FILTER = 2  # fewest steps in the filter's width that resolve the filtered force
MAX_STEPS = 20_000_000
STEP_BYTES = 530  # bytes per step of all histories of a run, and of their file while it is put together
CONTACT_BYTES = 48  # bytes per step of each further contact
LONG_BYTES = 0.12  # of these bytes where smooth motion takes long steps (docs/performance.md, "Long runs")
SHARED = 0.1  # largest part of the memory for the marches of the neighbours of a run, which several looks share
PAIR_TIME = 6e-9  # time [s] of a step for each pair of contacts, by spring laws; rigid ones take a quarter
LONGEST_MARCH = 86400.0  # longest predicted computing time of a run [s]

StressLook = Callable[[MarchRun, float], ReedStress]
"""Function that returns a reed's largest stresses in a run, also before and after the start of a landing [s]."""


def no_look(run: MarchRun, since: float) -> ReedStress:
    """Return what is known of a stress at which nobody looks."""
    return UNKNOWN_STRESS


RIGID: Final = (
    "contact.law is rigid, and neither the reed nor what it touches yields at once, or a measured record cannot tell: "
    "the force would grow without limit as run.time_step is shortened; state a compliant contact.law, as { kind = "
    '"hertz", stiffness = "1 GN/m^1.5" }, or a reed that yields where it is struck'
)


class RunError(SeatfemError, ValueError):
    """A scene that is well formed but cannot be run as asked; the message names key, limit and remedy."""


@contextmanager
def rewrite_rigid_errors() -> Iterator[None]:
    """Raise `RunError` with the keys of a scene in place of what impact says of a rigid law."""
    try:
        yield
    except RigidContactError:
        raise RunError(RIGID) from None


def bending_look(geometry: lips.ContactGeometry) -> StressLook:
    """Return the function that evaluates a beam's bending stress on a coarse grid; that of other reeds is unknown."""

    def look(run: MarchRun, since: float) -> ReedStress:
        force, stopper = touches.force_of(run), touches.stopper_forces_of(run)
        known = known_stress(_met_in(geometry, run), run.problem.striker, force, stopper, run.opening, run.dt)
        return UNKNOWN_STRESS if known is None else known.largest(coarsely=True, since=since)

    return look


@dataclass(frozen=True)
class Flights:
    """The striker over a ``duration`` [s], with or without a ``preload``: cached for each time step [s], but not for
    others; with its motion without contact, which is computed where equal steps first need it.

    ``keeps_runs``: whether the marches of neighbours are kept, as stress and life look at them later; ``varied``: the
    problem and its neighbours, once they are known; ``runs``: their marches so far, by problem, step and duration.
    """

    striker: impact.Body
    duration: float
    preload: bool
    keeps_runs: bool = False
    known: dict[float, motion.DiscreteBody] = field(default_factory=dict)
    varied: list[Any] = field(default_factory=list)
    runs: dict[tuple[int, float, float], tuple[impact.ContactProblem, MarchRun]] = field(default_factory=dict)

    def __call__(self, striker: impact.Body, dt: float) -> motion.DiscreteBody:
        """Return a discretised striker; under a preload it starts in equilibrium with its loads."""
        if striker is self.striker and dt in self.known:
            return self.known[dt]
        discrete = motion.DiscreteBody.from_body(striker, dt, step_count(dt, self.duration))
        if self.preload:
            discrete = replace(discrete, rest_loads=striker.load_amplitudes(np.zeros(1))[:, 0])
        if discrete.moves_by_itself:
            discrete = replace(discrete, free=cache(discrete.free_motion))
        if striker is self.striker:
            self.known[dt] = discrete
        return discrete


def run_contacts(
    scene: Scene,
    striker: impact.Body,
    seat: GreensFunction,
    dt: float,
    progress: Progress = silent,
    flights: Flights | None = None,
) -> touches.Touches:
    """Run the scene once: contact of the striker with seat and stopper by the scene's laws. ``flights``: the striker's
    motion without contact, if several runs share it."""
    check_base(scene.mount("seat"), seat, scene.run.duration)
    problem, bodies = problem_of(scene, striker, impact.Body(seat)), tuple[motion.DiscreteBody, ...]()
    if flights is not None:
        flight = flights(striker, dt)
        bodies = (flight, *(motion.DiscreteBody.from_body(body, dt, flight.loads.shape[1]) for body in problem.targets))
    with rewrite_rigid_errors():
        result = impact.solve(problem, dt=dt, duration=scene.run.duration, bodies=bodies, progress=progress)
    local.check_patches(scene.geometry, [each.law for each in problem.contacts], result.rows.force)
    run = touches.taken_apart(scene.geometry, problem, result, scene.run.filter_width)
    if not scene.gauge:
        return run
    force, above, lift = run.seat.force, run.stopper_forces, run.opening
    return replace(run, strains=gauge_strains(scene.gauged, striker, force, above, result.dt, lift))


def marched(
    problem: impact.ContactProblem,
    dt: float,
    duration: float,
    flights: Flights | None = None,
    *,
    like: TimeGrid = NO_STEPS,
) -> MarchRun:
    """Integrate a problem over a ``duration`` [s] for its forces only, far cheaper than a run with energies.

    ``flights``: the striker's motion without contact, if several runs share it; ``like``: as in
    `impact.march.ladder.begin_march`.
    """
    striker, asked = problem.striker, problem
    flights = flights or Flights(striker, duration, problem.preload)
    if (key := (id(asked), dt, duration)) in flights.runs:
        return flights.runs[key][1]
    for body in problem.targets:
        if not body.loads:
            problem = with_body(problem, body, replace(body, greens=body.greens.forces_only()))
    discrete = flights(striker, dt)
    targets = (motion.DiscreteBody.from_body(body, dt, discrete.loads.shape[1]) for body in problem.targets)
    with rewrite_rigid_errors():
        run = march(problem, dt, duration, bodies=(discrete, *targets), like=like)
    if flights.keeps_runs and (len(flights.runs) + 1) * 2 * run.rows.force.nbytes < SHARED * available_memory():
        flights.runs[key] = asked, run
    return run


def record_of(
    scene: Scene,
    problem: impact.ContactProblem,
    dt: float,
    flights: Flights | None = None,
    like: Landings | None = None,
    look: StressLook | None = None,
) -> touches.RunRecord:
    """Return the record of a run for its measures, from forces only (`marched`); arguments as `record_of_march`."""
    return record_of_march(scene, marched(problem, dt, scene.run.duration, flights), like, look=look)


def record_of_march(
    scene: Scene, run: MarchRun, like: Landings | None = None, *, stresses: bool = True, look: StressLook | None = None
) -> touches.RunRecord:
    """Return the record of a run without energies for its measures.

    ``stresses``: whether to include the stresses that the scene needs; ``look``: their function, in place of
    `bending_look`; ``like``: landings of a neighbouring run, whose partners are sought.
    """
    division, seats = Division.from_greens(run.problem.target.greens), seat_contacts(run.problem)
    lands = scene.geometry.lands(division)
    landings = landings_of_march(run, scene.run.filter_width, None if like is None else like.static, lands)
    stress_look = (look or bending_look(scene.geometry)) if stresses and scene.needs_stress else no_look
    blow = blow_of_march(scene, run, landings.seat, (like or landings).seat, stress=stress_look)
    ports = scene.geometry.lifts(division, run.rows.gap[:, :seats], run.rows) if scene.driven_by else ()
    strains = strains_of(scene.geometry, scene.gauged, run)
    further = other_values(scene.driven_by, strains, run.opening, run.dt, scene.run.duration, ports)
    return touches.RunRecord(blow, landings, touches.stopper_force_of(run), further)


def other_values(
    driven: Sequence[Drive], strains: Strains, opening: Array, dt: float, duration: float, ports: Sequence[PortLift]
) -> Values:
    """Return the values of a run that no contact has, as `RunRecord.others`: extreme strains at gauges, and those of
    what is ``driven``; ``opening``, ``dt``, ``duration``, ``ports``: as in `Drive.follow`."""
    by_wings = (each.follow(opening, dt, duration, ports).values() for each in driven)
    return {**gauge_values(strains), **{name: value for values in by_wings for name, value in values.items()}}


def blow_of_march(
    scene: Scene,
    run: MarchRun,
    landings: tuple[Landing, ...],
    like: Sequence[Landing],
    *,
    displacement: bool = True,
    stress: StressLook = no_look,
) -> measures.ContactRecord:
    """Return the record of a run without energies for its measures, with its ``landings`` on the seat.

    ``like``: these, or landings of a neighbouring run, the partner of whose judged one is judged.
    ``displacement``: whether to include the seat's; ``stress``: function of the reed's stress, if wanted.
    """
    choice, rows, seats = scene.accuracy.landing, run.rows, seat_contacts(run.problem)
    partners = zip(like, pair_landings(like, landings), strict=True)
    judged = measures.judged_landing(like, choice)
    since = next((own.start for one, own in partners if one is judged and own is not None), math.nan)
    return measures.ContactRecord(
        force=touches.force_of(run),
        dt=run.dt,
        filter_width=scene.run.filter_width,
        displacement=touches.displacement_of(run) if displacement else None,
        stress=stress(run, since),
        line=scene.geometry.line(Division.from_greens(run.problem.target.greens), rows.force[:, :seats], rows),
        film=rows.spread_forces(rows.film[:, :seats].sum(axis=1)),
        landings=landings,
        asked=choice,
        stress_since=since,
        strains=tuple(strains_of(scene.geometry, scene.gauged, run).values()),
    )


def strains_of(geometry: lips.ContactGeometry, gauged: Sequence[Gauged], run: MarchRun) -> Strains:
    """Return the strain at the gauges in a run without energies."""
    if not gauged:
        return {}
    striker, dt, stopper = run.problem.striker, run.dt, touches.stopper_forces_of(run)
    contact_at = _met_in(geometry, run).contact_at
    gauges = [replace(each, contact_at=contact_at) for each in gauged]
    return gauge_strains(gauges, striker, touches.force_of(run), stopper, dt, run.opening)


def _met_in(geometry: lips.ContactGeometry, run: MarchRun) -> lips.ContactGeometry:
    """Return the geometry with the stopper's face in the parts of a run."""
    parts = len(run.problem.contacts) - seat_contacts(run.problem)
    return geometry.with_stopper_in(Division(max(parts, 1))) if geometry.has_two_places else geometry


def fallback_step(run: Run, driven: tuple[Drive, ...], *bodies: GreensFunction) -> float:
    """Return the time step of a method without one [s]: the least of 1/4 rad of the highest rate, 1/20 of the filter's
    width, 1/200 of the run, and the `longest_step` of what is ``driven``."""
    limits = [run.filter_width / STEPS_PER_FILTER, run.duration / 200]
    limits += [1.0 / (STEPS_PER_RADIAN * rate) for rate in (body.highest_rate for body in bodies) if rate > 0]
    return min(*limits, longest_step(driven))


def check_step(scene: Scene) -> None:
    """Raise `RunError` for an unusable time step, reed or seat, before anything expensive is computed."""
    for role, body in (("reed", scene.reed), ("seat", scene.seat)):
        if thick := body.too_thick():
            raise RunError(thick.replace("reed.", f"{role}."))
    if loose := scene.seat.loose:
        raise RunError(
            f"{loose}, so it has no static stiffness to compare with; clamp a face or add a support "
            "(foundation, bolted, absorbing with centre). seatfem modes shows the modes of a free body"
        )
    step, width = scene.run.time_step, scene.run.filter_width
    if width > scene.run.duration:
        raise RunError(
            f"run.filter_width = {write_quantity(width, 'time')} is longer than run.duration = "
            f"{write_quantity(scene.run.duration, 'time')}: state a shorter "
            "run.filter_width, or watch longer"
        )
    check_length(scene, width / LEAST_STEPS_PER_FILTER if step is None else step)
    for drive in scene.driven_by:
        if step is not None and step > (most := drive.longest_step):
            why = f"run.time_step = {write_quantity(step, 'time')} {drive.describe_step(step)}"
            raise RunError(f"{why}: use at most {write_quantity(most, 'time', 3)}")
    if step is not None and 2 * step > width:
        raise RunError(
            f"run.time_step = {write_quantity(step, 'time')} does not resolve the mean peak force: at most "
            f"{write_quantity(width / 2, 'time')} "
            f"(half of run.filter_width = {write_quantity(width, 'time')}); use a shorter step or a wider filter"
        )


def check_length(scene: Scene, dt: float, parts: int | None = None) -> None:
    """Raise `RunError` for more steps or contacts than memory and computing time allow.

    ``parts``: number of parts of the seat's lip; ``None``: as the scene states it.
    """
    steps, room = scene.run.duration / dt, available_memory()
    contacts = parts or (scene.contact.ports or 1) * scene.contact.rings
    contacts += 0 if scene.stopper is None else scene.stopper.parts.count
    each = CONTACT_BYTES * (1.0 if scene.is_blown_by_lift else LONG_BYTES)
    memory, seconds = each * (contacts - 1) * steps, PAIR_TIME * contacts**2 * steps
    if contacts > 1 and (memory > room or seconds > LONGEST_MARCH):
        raise RunError(
            f"contact.ports and contact.rings with [stopper] make {contacts} contacts over {steps:.2g} steps: "
            f"predicted {memory / 1e9:.2g} GB of histories and {seconds / 3600:.2g} h, at most {room / 1e9:.2g} GB are "
            f"available and {LONGEST_MARCH / 3600:g} h are taken: state fewer contact.ports, contact.rings or "
            "stopper.arcs, shorten run.duration, or give a longer run.time_step"
        )
    most = min(MAX_STEPS, room / STEP_BYTES)
    if steps > most:
        fewer = "" if scene.reed.stated().n_modes is None else "keep fewer reed.n_modes, "
        chosen = "run.time_step" if scene.run.time_step else "the step that both bodies and run.filter_width need"
        raise RunError(
            f"run.duration = {write_quantity(scene.run.duration, 'time')} takes {steps:.2g} steps of "
            f"{write_quantity(dt, 'time', 2)} ({chosen}), at most "
            f"{most:.2g} are stored: shorten run.duration, widen run.filter_width, "
            f"{fewer}or give a longer run.time_step"
        )
