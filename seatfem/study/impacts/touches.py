"""The results of one run by contact (seat, its parts, stopper), and the measures taken from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final, Literal, get_args

import numpy as np

import impact
from impact import measures
from impact.after import histories
from impact.after.histories import UNKNOWN_STRESS, ReedStress
from impact.after.landings import pair_landings
from impact.after.result import ImpactResult, join_contacts, select_contacts
from impact.bodies.body import Body
from impact.greens.base import Array, GreensFunction
from impact.march.motion import PortForces, find_mean_displacement
from impact.march.rows import MarchRun
from impact.quantities import finite_or_none
from impact.runs.variations import Budget, Values
from seatfem.structures.rings import Division
from seatfem.study.impacts.landings import Face, Landings, landings_of_result, seat_contacts, values_of_lands
from seatfem.study.scene import ContactGeometry
from seatfem.study.scene.measures import ContactRecord, LandingChoice, Line, judged_landing, key_of, values_of
from seatfem.study.scene.wings import CYCLE, PortLift


@dataclass(frozen=True)
class Touches:
    """Results of one run by contact; the energies in each are those of the whole run.

    Attributes:
        seat: contact with the seat, all parts of its patch joined to one.
        landings: landings of the run.
        parts: the parts of the seat's patch, if it is divided into arcs and rings.
        stopper: contact with the stopper, if there is one, all parts joined to one.
        stopper_parts: the parts of the stopper's patch, if it is divided.
        line: force along the lip, if it has several arcs.
        strains: (n + 1,) strain at each gauge, by its name.
    """

    seat: ImpactResult
    landings: Landings
    parts: ImpactResult | None = None
    stopper: ImpactResult | None = None
    line: Line | None = None
    stopper_parts: ImpactResult | None = None
    strains: Mapping[str, Array] = field(default_factory=dict)

    @property
    def touch(self) -> float:
        """Return the time of the first touch of the seat [s]; nan without one."""
        groups = measures.contact_groups(self.seat)
        return float(groups[0][0]) if len(groups) else math.nan

    @property
    def opening(self) -> Array:
        """Return the (n + 1,) mean gap of the contacts at the seat, which loads and gas see as the lift [m]."""
        if self.parts is None:
            return self.seat.gap
        return self.parts.rows.spread_motions(self.parts.rows.gap.mean(axis=1))

    @property
    def stopper_force(self) -> Array | None:
        """Return the (n + 1,) contact force on the stopper [N]; ``None`` without one."""
        return None if self.stopper is None else self.stopper.force

    @property
    def stopper_forces(self) -> Array | None:
        """Return the contact force on the stopper [N], (n + 1,), or on its parts (n + 1, parts); ``None`` without
        one."""
        return self.stopper_force if self.stopper_parts is None else self.stopper_parts.force


def taken_apart(
    geometry: ContactGeometry, problem: impact.ContactProblem, result: ImpactResult, filter_width: float
) -> Touches:
    """Return the result of a problem by contact; the seat's columns come first, the stopper's last.

    ``filter_width``: averaging time of the forces that separate landings [s].
    """
    division = Division.from_greens(problem.target.greens)
    landings = landings_of_result(problem, result, filter_width, geometry.lands(division))
    if result.rows.force.ndim == 1:
        return Touches(result, landings)
    of_seat = seat_contacts(problem)
    stopper = on_stopper = None
    if geometry.stopper is not None:
        above, parts_above = select_contacts(result, slice(of_seat, None)), geometry.stopper.parts
        stopper, on_stopper = join_contacts(above, parts_above.shares), None if parts_above == Division() else above
    if of_seat == 1:
        return Touches(measures.select_contact(result, 0), landings, stopper=stopper, stopper_parts=on_stopper)
    parts = select_contacts(result, slice(of_seat))
    line = geometry.line(division, parts.rows.force, parts.rows, parts.rows.film)
    seat = join_contacts(parts, division.shares)
    mass = _mass_that_moves(problem, np.asarray(parts.rows.spans @ parts.rows.force[1:]), division.shares)
    return Touches(replace(seat, striker_mass=mass or seat.striker_mass), landings, parts, stopper, line, on_stopper)


def lifts_of(geometry: ContactGeometry, touches: Touches, seat: GreensFunction) -> tuple[PortLift, ...]:
    """Return the lift over each land of a seat with several, whose Green's function has ports for their parts."""
    result = touches.seat if touches.parts is None else touches.parts
    gap = result.rows.gap.reshape(len(result.rows.ends), -1)
    return geometry.lifts(Division.from_greens(seat), gap, result.rows)


def _mass_that_moves(problem: impact.ContactProblem, pushed: Array, shares: Array) -> float:
    """Return the striker's effective mass [kg]: the sum of forces ``pushed`` over the mean acceleration of contacts.

    It is the mass of a free striker that does not rotate, and less if it does; 0 for one that is held, or
    without force.
    """
    inverse = problem.striker.greens.inverse_mass()
    seen = problem.directions(problem.striker)[:, : len(shares)]
    moved = float(shares @ seen.T @ np.where(np.isfinite(inverse), inverse, 0.0) @ seen @ pushed)
    return float(pushed.sum()) / moved if moved > 0 else 0.0


def stopper_in(problem: impact.ContactProblem) -> Body | None:
    """Return the stopper of a problem, or ``None``."""
    return next((contact.target for contact in problem.contacts if contact.side < 0), None)


def force_of(run: MarchRun) -> Array:
    """Return the (n + 1,) contact force on the seat's whole patch [N]."""
    return run.force_on(slice(seat_contacts(run.problem)))


def stopper_force_of(run: MarchRun) -> Array | None:
    """Return the (n + 1,) contact force on the stopper [N]; ``None`` without one."""
    seat = seat_contacts(run.problem)
    return None if seat == len(run.problem.contacts) else run.force_on(slice(seat, None))


def stopper_forces_of(run: MarchRun) -> Array | None:
    """Return the contact force on the stopper, as `Touches.stopper_forces`; ``None`` without one."""
    seat, several = seat_contacts(run.problem), len(run.problem.striker.greens.ports) > 2
    return run.rows.spread_forces(run.rows.force[:, seat:]) if several else stopper_force_of(run)


def displacement_of(run: MarchRun) -> Array:
    """Return the (n + 1,) mean displacement of the seat's patch [m]."""
    seat, shares, rows = run.bodies[1], Division.from_greens(run.bodies[1].body.greens).shares, run.rows
    turn = run.problem.directions(seat.body)
    moved = rows.spread_motions(find_mean_displacement(seat, PortForces(rows, rows.force[1:].T, turn), shares))
    if seat.body.base is None:
        return moved
    return moved + seat.body.find_base_displacement(np.asarray(seat.dt * np.arange(len(moved)), dtype=np.float64))


def pushes(striker: Body, force: Array, stopper: Array | None) -> Array:
    """Return the forces of the seat and of the ``stopper`` or its parts on the striker [N]: (n + 1,), or (n + 1, ports)
    if each has its own port."""
    if stopper is None:
        return force
    forces = np.column_stack([force, -stopper])
    return forces if len(striker.greens.ports) == forces.shape[1] else np.asarray(forces.sum(axis=1))


Source = Literal["mesh", "reduction", "time_step", "model", "patch", "striker", "stopper", "lip", "record"]
SOURCES: Final[tuple[Source, ...]] = ("mesh", "reduction", "time_step", "model", "patch")
STRIKER: Final = "striker"
"""Source of error: mesh, reduction, band and level of a striker that is not in closed form."""
STOPPER: Final = "stopper"
"""Source of error: a stopper that is not exact."""
LIP: Final = "lip"
"""Source of error: one contact point in place of the arcs of a lip, if the plan has chosen it."""

RECORD: Final = "record"
"""Source of error: the noise of a measured seat's record, and a misfit beyond it."""


def measured(
    touches: Touches, filter_width: float, stress: ReedStress = UNKNOWN_STRESS, asked: LandingChoice = "hardest"
) -> Values:
    """Return the measures of a run by name [SI]; ``stress``: the reed's, if wanted; ``asked``: the landing to judge."""
    return values_of(contact_record_of(touches, filter_width, stress, asked), touches.landings.seat)


def contact_record_of(
    touches: Touches, filter_width: float, stress: ReedStress = UNKNOWN_STRESS, asked: LandingChoice = "hardest"
) -> ContactRecord:
    """Return the record of a run from which its measures are taken."""
    result, landings = touches.seat, touches.landings.seat
    force, moved, film, line = result.force, result.target_displacement, result.film, touches.line
    since = stress_since(touches, asked)
    strains = tuple(touches.strains.values())
    return ContactRecord(force, result.dt, filter_width, moved, stress, line, film, landings, asked, since, strains)


def stress_since(touches: Touches, asked: LandingChoice) -> float:
    """Return the start of the judged landing [s], before and after which stress is reported; nan without one."""
    landing = judged_landing(touches.landings.seat, asked)
    return math.nan if landing is None else landing.start


OF_A_LANDING: Final[Mapping[str, str]] = {
    "touch": "time_s",
    "closing_speed": "closing_speed_m_per_s",
    "filtered_peak": "filtered_peak_force_N",
    "excess_peak": "excess_peak_force_N",
    "impulse": "impulse_Ns",
    "duration": "duration_s",
    "restitution": "restitution",
}
"""Fields of `impact.after.landings.Landing` that have an error bar, and their keys in a record of summary.json."""


def landing_name(place: str, number: int, key: str) -> str:
    """Return the name of a landing's key among the values of a run; landings are numbered from 0. ``place``: as of
    `Landings.places`."""
    return f"{place} {number} {key}"


def is_of_a_landing(name: str) -> bool:
    """Return whether the name of a value is one of `landing_name`."""
    return name.startswith(tuple(f"{face} " for face in get_args(Face)))


def is_time(name: str) -> bool:
    """Return whether the name of a value is that of the start of a landing."""
    return is_of_a_landing(name) and name.endswith(f" {OF_A_LANDING['touch']}")


def values_of_landings(landings: Landings, like: Landings) -> dict[str, float]:
    """Return the numbers of each landing that have error bars.

    ``like``: as of `values_of_record`; a landing without partner has infinite values.
    """
    values: dict[str, float] = {}
    for place, asked in like.places.items():
        for number, landing in enumerate(pair_landings(asked, landings.places.get(place, ()))):
            for name, key in OF_A_LANDING.items():
                value = math.inf if landing is None else getattr(landing, name)
                if value is not None:
                    values[landing_name(place, number, key)] = value
    return values


def stopper_values(force: Array | None, dt: float, filter_width: float) -> dict[str, float]:
    """Return the numbers of the stopper's contact that have error bars, by their keys in summary.json, from its force
    (n + 1,) [N] at steps ``dt`` [s]; none without a stopper."""
    if force is None:
        return {}
    return {
        "stopper_filtered_peak_force_N": histories.largest_average(force[1:], dt, filter_width),
        "stopper_impulse_Ns": float(np.sum(force[1:])) * dt,
    }


@dataclass(frozen=True)
class RunRecord:
    """Histories and results of one run, from which its values are taken.

    Attributes:
        blow: histories of the contact with the seat.
        landings: landings of the run.
        stopper: (n + 1,) force on the stopper [N]; ``None`` without one.
        others: strains at gauges, and values of wings, by their keys in summary.json or `cycle_name`.
    """

    blow: ContactRecord
    landings: Landings
    stopper: Array | None = None
    others: Values = field(default_factory=dict)


def values_of_record(record: RunRecord, like: Landings) -> Values:
    """Return all values of a run that have error bars, by name.

    ``like``: the run's own landings, or those of a neighbouring run, whose partners are taken.
    """
    blow, landings = record.blow, record.landings
    return {
        **values_of(blow, like.seat),
        **values_of_landings(landings, like),
        **values_of_lands(blow.line, landings, blow.filter_width, like),
        **stopper_values(record.stopper, blow.dt, blow.filter_width),
        **record.others,
    }


def bar_keys(budget: Budget) -> dict[str, object]:
    """Return the error bars for summary.json: error_bar_KEY of each measure, or a list of them for a value in each
    cycle, and error_SOURCE_KEY of each source."""
    names = [name for name in budget.values if not is_of_a_landing(name) and CYCLE not in name]
    bars: dict[str, object] = {f"error_bar_{key_of(name)}": finite_or_none(budget.bar(name)) for name in names}
    by_cycle: dict[str, list[float | None]] = {}
    for name in budget.values:
        if CYCLE in name:
            by_cycle.setdefault(f"error_bar_{name.partition(CYCLE)[0]}", []).append(finite_or_none(budget.bar(name)))
    shares = {
        f"error_{source}_{key_of(name)}": finite_or_none(part[name])
        for source, part in budget.parts.items()
        for name in names
        if name in part
    }
    return bars | by_cycle | shares | {"error_unknown": ", ".join(budget.unknown)}
