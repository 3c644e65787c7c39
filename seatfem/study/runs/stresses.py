"""Stress of a run in both bodies, with bars that know what is left in the contact force.

The force of every run of the error budget is replayed on the same fields, at the places where the stress is largest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

import impact
from impact.life.places import margin_error
from impact.march.problem import ContactProblem
from impact.notices import Progress, silent
from impact.quantities import percent
from impact.runs.variations import Values, budget_of, changes, times
from seatfem.structures.fields.recovery import Largest, largest
from seatfem.structures.rings import Division
from seatfem.study.accuracy.error_budget import sources_of
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import marched
from seatfem.study.impacts.plate_stress import Forces, pushes_of
from seatfem.study.impacts.touches import force_of, stress_since
from seatfem.study.ladders.ladder import ComputedRun
from seatfem.study.planning.plan import Plan
from seatfem.study.runs import kept, reed_stress
from seatfem.study.runs.round import Round
from seatfem.study.runs.seat_stress import SeatStress, left_by_mesh, peaks_under, seat_stress

STAGE: Final = "runs for the error bar of stress"


def error_bars_of(
    done: Round,
    look: Callable[[impact.ContactStepper], Values],
    at_half: Callable[[impact.ContactStepper], Values] | None = None,
    progress: Progress = silent,
    is_judged: Callable[[Values], bool] = lambda half: True,
) -> tuple[Values, Values]:
    """Return the error bars of ``look``, as those of the measures are found, with twice what half the step changes; and
    the values at half the step.

    ``at_half``: the look at a run of half the step, ``None``: as at others; ``progress``: hears of each run;
    ``is_judged``: whether the values at half the step leave any bar to be found: no further run is made without.
    """
    scene, dt = done.plan.scene, done.result.dt
    problem = problem_of(scene, done.striker, impact.Body(done.seat.greens))

    sources, _ = sources_of(ComputedRun(scene, done.plan.method, done.seat, problem, done.reed))
    runs, count = 2 + sum(len(term) for terms in sources.values() for term in terms or ()), 0

    def run(varied: ContactProblem, step: float, look: Callable[[impact.ContactStepper], Values] = look) -> Values:
        nonlocal count
        count += 1
        progress(STAGE, min(count / runs, 1.0))
        return look(marched(varied, step, scene.run.duration, done.flights))

    half = run(problem, dt / 2, at_half or look)
    if not is_judged(half):
        return dict.fromkeys(half, math.nan), half
    values = run(problem, dt)
    budget = budget_of(run, problem, values, dt, sources, finer=times(2.0, changes(values, half)))
    return {name: budget.bar(name) for name in values}, half


def contact_margin_bar(done: Round, margin: float) -> float:
    """Return the error bar of a margin below a contact of Hertz, whose stress is as the cube root of its largest force,
    by what is left in that; ``inf`` where that is all of it."""
    errors, _ = error_bars_of(done, lambda stepper: {"force": float(force_of(stepper).max())})
    share = errors["force"] / float(done.result.force.max())
    return margin_error(margin, 1 - (1 - share) ** (1 / 3) if share < 1 else 1.0)


RAW: Final = 0.1
REED, SEAT, TENSION = "stress", "seat_stress", "seat_tension"


def stresses(done: Round, progress: Progress = silent) -> tuple[SeatStress | None, reed_stress.PlateReedStress | None]:
    """Return the stress in the seat, and in a plate that strikes, if the scene needs them. Raises as `seat_stress`.

    What mesh and modes leave in the recovery is in their bars, and what is left in the force: its error budget again,
    with these stresses for measures. A stress in the seat that half the step changes by more than `RAW` follows the raw
    force of a first touch, which has no limit without a law of contact that yields: no bar is known of it, and no
    coarser mesh is looked at for it.
    """
    since = stress_since(done.touches, done.plan.scene.accuracy.landing)
    seat, reed = seat_stress(done, progress), done.plate
    if reed is None:
        reed = reed_stress.plate_reed_stress(done, since)
    elif REED in done.left.values:  # a measure of the round, which has its bar there
        bar = done.left.bar(REED)
        reed = replace(reed, bar=bar if math.isfinite(bar) else math.nan)
    of_seat = seat if np.any(done.result.force) else None
    of_reed = reed if done.plate is None and reed is not None and reed.found.after_contact is not None else None
    if seat is not None and of_seat is None:
        seat = replace(
            seat, bar=seat.bar + (of_mesh := left_by_mesh(seat, done)), tension_bar=seat.tension_bar + of_mesh
        )
    if of_seat is None and of_reed is None:
        return seat, reed

    def look(stepper: impact.ContactStepper) -> Values:
        forces, values = Forces.from_march(stepper), dict[str, float]()
        if of_seat is not None:
            values |= _peaks_of(largest(of_seat.largest_at, -forces.by(of_seat.division), forces.dt).after_contact)
        if of_reed is not None:
            division = Division.from_greens(done.seat.greens) if done.touches.parts is not None else Division()
            pushes = pushes_of(of_reed.largest_at.body.greens, forces.by(division), division, forces.stopper)
            values[REED] = float(largest(of_reed.largest_at, pushes, forces.dt).after_contact.von_mises.max())
        return values

    def look_everywhere(stepper: impact.ContactStepper) -> Values:
        values, forces = dict(look(stepper)), Forces.from_march(stepper)
        if of_seat is not None:
            values |= _peaks_of(peaks_under(of_seat, -forces.by(of_seat.division), forces.dt))
        return values

    own = {} if of_seat is None else _peaks_of(of_seat.peak)

    def is_raw(half: Values) -> list[bool]:
        return [abs(half[name] - own[name]) > RAW * own[name] for name in own]

    def is_judged(half: Values) -> bool:
        return of_reed is not None or not all(is_raw(half))

    judged = {REED: of_reed, SEAT: of_seat}
    what = f"errors left in {', '.join(sorted(name for name, each in judged.items() if each is not None))}"
    bars_and_half = kept.cached_numbers(
        done,
        done.touches,
        what,
        lambda: dict(
            zip(("bars", "half"), error_bars_of(done, look, look_everywhere, progress, is_judged), strict=True)
        ),
    )
    errors, raw = bars_and_half["bars"], is_raw(bars_and_half["half"])
    if of_seat is not None:
        of_mesh = math.nan if all(raw) else left_by_mesh(of_seat, done)
        bars = np.array([of_seat.bar, of_seat.tension_bar]) + of_mesh + [errors[name] for name in own]
        bar, tension_bar = (float(each) for each in np.where(raw, math.nan, bars))
        seat = replace(of_seat, bar=bar, tension_bar=tension_bar)
    if of_reed is not None:
        reed = replace(of_reed, bar=of_reed.bar + errors[REED])
    return seat, reed


def stress_notes(plan: Plan, seat: SeatStress | None) -> tuple[str, ...]:
    """Return in sentences what the stress of a seat leaves out, and why it has no bar."""
    sentences: list[str] = []
    if seat is None:
        return ()
    if plan.level == "spring":
        change = max(plan.shares.get("model", {}).values(), default=0.0)
        words = f", predicted to change by {percent(change)} at most with them" if change else ""
        sentences.append(
            "stress in the seat: the contact force behind it is that on the seat's static stiffness, without waves in "
            f"the seat{words}; the stress has the waves that this force sends in. To have them in the force, too, "
            "state seat.model"
        )
    bars = {"peak_seat_stress_Pa": seat.bar, "peak_seat_principal_stress_Pa": seat.tension_bar}
    if names := [name for name, bar in bars.items() if math.isnan(bar)]:
        sentences.append(
            f"uncertainty of {' and '.join(names)} not known: half the time step changes it by more than "
            f"{100 * RAW:g} %, as for the raw force of a first touch, or there is no coarser mesh to compare with; "
            "state a compliant contact.law, or a shorter run.time_step"
        )
    return tuple(sentences)


def _peaks_of(peaks: Largest) -> dict[str, float]:
    """Return the largest stresses in the seat."""
    return {SEAT: float(peaks.von_mises.max()), TENSION: float(peaks.principal.max())}
