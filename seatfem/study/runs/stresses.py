"""Stress of a run in both bodies, with bars that know what is left in the contact force.

The force of every run of the error budget is replayed on the same fields, at the places where the stress is largest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

import impact
from impact.life.places import margin_error
from impact.march.problem import ContactProblem
from impact.notices import Progress, silent
from impact.quantities import percent
from impact.runs.variations import Values, budget_of, changes, times
from seatfem.structures.fields.recovery import StressField, largest
from seatfem.structures.rings import Division
from seatfem.study.accuracy.error_budget import sources_of
from seatfem.study.impacts.contact import marched, problem_of, run_contacts
from seatfem.study.impacts.plate_stress import Forces, pushes_of
from seatfem.study.impacts.touches import force_of, stress_since
from seatfem.study.planning.plan import Plan
from seatfem.study.runs.kept import cached_numbers
from seatfem.study.runs.reed_stress import PlateReedStress, plate_reed_stress
from seatfem.study.runs.round import Round
from seatfem.study.runs.seat_stress import SeatStress, seat_stress

STAGE: Final = "runs for the error bar of stress"


def error_bars_of(
    done: Round,
    look: Callable[[impact.ContactStepper], Values],
    also: Values | None = None,
    progress: Progress = silent,
) -> Values:
    """Return the error bars of ``look``, as those of the measures are found, with twice what half the step changes.

    ``also``: values known better at half the step than from its forces; ``progress``: hears of each run.
    """
    scene, dt = done.plan.scene, done.result.dt
    problem = problem_of(scene, done.striker, impact.Body(done.seat.greens))

    sources, _ = sources_of(scene, done.plan.method, done.seat, problem, done.reed)
    runs, count = 2 + sum(len(term) for terms in sources.values() for term in terms or ()), 0

    def run(varied: ContactProblem, step: float) -> Values:
        nonlocal count
        count += 1
        progress(STAGE, min(count / runs, 1.0))
        return look(marched(scene, varied, step))

    values, half = run(problem, dt), {**run(problem, dt / 2), **(also or {})}
    budget = budget_of(run, problem, values, dt, sources, finer=times(2.0, changes(values, half)))
    return {name: budget.bar(name) for name in values}


def contact_margin_bar(done: Round, margin: float) -> float:
    """Return the error bar of a margin below a contact of Hertz, whose stress is as the cube root of its largest force,
    by what is left in that; ``inf`` where that is all of it."""
    errors = error_bars_of(done, lambda stepper: {"force": float(force_of(stepper).max())})
    share = errors["force"] / float(done.result.force.max())
    return margin_error(margin, 1 - (1 - share) ** (1 / 3) if share < 1 else 1.0)


RAW: Final = 0.1
REED, SEAT, TENSION = "stress", "seat_stress", "seat_tension"


def stresses(done: Round, progress: Progress = silent) -> tuple[SeatStress | None, PlateReedStress | None]:
    """Return the stress in the seat, and in a plate that strikes, if the scene needs them. Raises as `seat_stress`.

    What mesh and modes leave in the recovery is in their bars, and what is left in the force: its error budget again,
    with these stresses for measures. A stress in the seat that half the step changes by more than `RAW` follows the raw
    force of a first touch, which has no limit without a law of contact that yields: no bar is known of it.
    """
    since = stress_since(done.touches, done.plan.scene.accuracy.landing)
    seat = seat_stress(done, progress)
    reed = plate_reed_stress(done, since) if done.plate is None else _with_its_bar(done)
    looks: dict[str, Callable[[Forces], Values]] = {}
    if seat is not None and np.any(done.result.force):
        looks[SEAT] = partial(_in_the_seat, seat)
    if reed is not None and done.plate is None and reed.found.after_contact is not None:
        looks[REED] = partial(_in_the_reed, done, reed.largest_at)
    if not looks:
        return seat, reed

    def look(stepper: impact.ContactStepper) -> Values:
        forces = Forces.from_march(stepper)
        return {name: value for each in looks.values() for name, value in each(forces).items()}

    own, finer = _told(seat), _told(None)
    if seat is not None and SEAT in looks:
        finer = cached_numbers(done, done.touches, "stress in the seat at half the step", partial(_at_half, done))
    what = f"errors left in {', '.join(sorted(looks))}"
    errors = cached_numbers(done, done.touches, what, lambda: error_bars_of(done, look, finer, progress))
    if seat is not None and SEAT in looks:
        raw = [math.nan if abs(finer[name] - own[name]) > RAW * own[name] else errors[name] for name in (SEAT, TENSION)]
        seat = replace(seat, bar=seat.bar + raw[0], tension_bar=seat.tension_bar + raw[1])
    if REED in looks and reed is not None:
        reed = replace(reed, bar=reed.bar + errors[REED])
    return seat, reed


def stress_notes(plan: Plan, seat: SeatStress | None) -> tuple[str, ...]:
    """Return in sentences what the stress of a seat leaves out, and why it has no bar."""
    if seat is None:
        return ()
    return (*_without_waves(plan), *_without_bar(seat))


def _without_waves(plan: Plan) -> tuple[str, ...]:
    """Return what the stress of a seat leaves out whose contact was computed on its static stiffness."""
    if plan.level != "spring":
        return ()
    change = max(plan.shares.get("model", {}).values(), default=0.0)
    words = f", predicted to change by {percent(change)} at most with them" if change else ""
    return (
        "stress in the seat: the contact force behind it is that on the seat's static stiffness, without waves in the "
        f"seat{words}; the stress has the waves that this force sends in. To have them in the force, too, state "
        "seat.model",
    )


def _without_bar(seat: SeatStress) -> tuple[str, ...]:
    """Return why a stress of the seat has no error bar; nothing where both have one."""
    if not (math.isnan(seat.bar) or math.isnan(seat.tension_bar)):
        return ()
    bars = {"peak_seat_stress_Pa": seat.bar, "peak_seat_principal_stress_Pa": seat.tension_bar}
    names = [name for name, bar in bars.items() if math.isnan(bar)]
    return (
        f"uncertainty of {' and '.join(names)} not known: half the time step changes it by more than "
        f"{100 * RAW:g} %, as for the raw force of a first touch, or there is no coarser mesh to compare with; state a "
        "compliant contact.law, or a shorter run.time_step",
    )


def _at_half(done: Round) -> Values:
    """Return the largest stresses in the seat at half the step, whose faster pairs answer a sharper blow."""
    touches = run_contacts(done.plan.scene, done.striker, done.seat.greens, done.result.dt / 2)
    return _told(seat_stress(replace(done, touches=touches)))


def _with_its_bar(done: Round) -> PlateReedStress | None:
    """Return the stress of a plate that was a measure of the round, with the bar that it has there."""
    if done.plate is None or REED not in done.left.values:
        return done.plate
    bar = done.left.bar(REED)
    return replace(done.plate, bar=bar if math.isfinite(bar) else math.nan)


def _in_the_seat(seat: SeatStress, forces: Forces) -> Values:
    peaks = largest(seat.largest_at, -forces.by(seat.division), forces.dt).after_contact
    return {SEAT: float(peaks.von_mises.max()), TENSION: float(peaks.principal.max())}


def _in_the_reed(done: Round, field: StressField, forces: Forces) -> Values:
    division = Division.from_greens(done.seat.greens) if done.touches.parts is not None else Division()
    pushes = pushes_of(field.body.greens, forces.by(division), division, forces.stopper)
    return {REED: float(largest(field, pushes, forces.dt).after_contact.von_mises.max())}


def _told(seat: SeatStress | None) -> Values:
    """Return the largest stresses in the seat."""
    if seat is None:
        return {}
    return {SEAT: float(seat.peak.von_mises.max()), TENSION: float(seat.peak.principal.max())}
