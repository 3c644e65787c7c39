"""Stress of a run in the seat and in a plate that strikes, with error bars that include the errors of the contact
force.

The forces of each run of the error budget are applied to the same stress fields, at the points of the largest stress.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from impact.greens.base import Array
from impact.march.rows import MarchRun
from impact.notices import Progress, silent
from impact.quantities import percent
from impact.runs.variations import SAFETY, Budget, Values
from seatfem.structures.fields.recovery import largest
from seatfem.study.impacts.forces import Forces
from seatfem.study.ladders.table import ladder_of, source_of
from seatfem.study.method import MODEL
from seatfem.study.plan import Plan
from seatfem.study.runs import kept
from seatfem.study.runs.error_bars import error_bars_of
from seatfem.study.runs.reed_stress import PlateStress, plate_stress
from seatfem.study.runs.round import Round, remedy_by_source, remedy_of
from seatfem.study.runs.seat_stress import SeatStress, judged_under, left_by_mesh, seat_stress
from seatfem.study.safety import source_in_words
from seatfem.units import place_words, write_quantity

RAW: Final = 0.1  # relative change of stress by half the time step above which no error bar is given
AT_LIMIT: Final = 1.5  # distance of a hot spot at the limit of where stress is reported, over stress.distance
REED, SEAT, TENSION = "stress", "seat_stress", "seat_tension"
LARGE: Final = 0.25  # relative error bar of the largest stress in a seat from which on its largest source is named
RECOVERY, WAVES = "recovery", "waves"
"""Errors of a stress under given forces: by the mesh, and by what a reduction leaves out."""
OF_MESH: Final = "mesh at its place", "state a smaller seat.mesh.contact_size, or of a file a smaller seat.mesh.size"
OF_WAVES: Final = "waves that its mesh and band leave out"
OF_EDGES: Final = ("mesh near a sharp edge", "draw the edge with a fillet, or state a larger stress.distance")
"""Errors at the place of a stress in words, each with what to state."""


def stresses(done: Round, progress: Progress = silent) -> tuple[SeatStress | None, PlateStress | None]:
    """Return the stress in the seat, and in a plate that strikes, if the scene needs them. Raises as `seat_stress`.

    The error bars include errors of the stress recovery, by mesh and modes, and of the contact force, by the runs of
    the error budget. A stress in the seat that half the time step changes by more than `RAW` follows the unfiltered
    force at first touch, which without a compliant contact law does not converge with the step: it has no error bar,
    and needs no coarser mesh.
    """
    strike, seat, reed = done.strike, seat_stress(done, progress), done.plate
    if reed is None:
        reed = plate_stress(done)
    elif REED in done.budget.values:  # a measure of the round, which has its bar there
        reed = replace(reed, bar=done.budget.bar(REED))
    of_seat = seat if np.any(done.result.force) else None
    of_reed = reed if done.plate is None and reed is not None and reed.largest.after_contact.is_known else None
    if seat is not None and of_seat is None:
        seat = replace(seat, bars=seat.bars + left_by_mesh(seat))
    if of_seat is None and of_reed is None:
        return seat, reed

    def look(run: MarchRun, *, anew: bool = False) -> Values:
        forces, values = Forces.from_march(run), dict[str, float]()
        if of_seat is not None:
            values |= _name_stresses(judged_under(of_seat, forces.find_seat_forces(strike.seat), forces.dt, anew=anew))
        if of_reed is not None:
            pushes = forces.find_striker_forces(of_reed.largest_at.body.greens, strike.forces.seat.division)
            values[REED] = float(largest(of_reed.largest_at, pushes, forces.dt).after_contact.von_mises.max())
        return values

    run_peaks = {} if of_seat is None else _name_stresses(of_seat.judged)

    def is_raw(half: Values) -> list[bool]:
        return [abs(half[name] - run_peaks[name]) > RAW * run_peaks[name] for name in run_peaks]

    def is_judged(half: Values) -> bool:
        return of_reed is not None or not all(is_raw(half))

    bodies = {REED: of_reed, SEAT: of_seat}
    what = (
        f"errors left at the places in {', '.join(sorted(name for name, each in bodies.items() if each is not None))}"
    )

    def compute() -> Mapping[str, Values]:
        budget, half = error_bars_of(done, look, partial(look, anew=True), progress, is_judged)
        return {"half": half, **budget.parts}

    parts = dict(kept.cached_numbers(done, done.touches, what, compute))
    budget = Budget(parts.pop("half"), parts)
    raw = is_raw(budget.values)
    if of_seat is not None:
        mesh_error = np.full(len(raw), math.nan)
        if not all(raw):
            errors = partial(left_by_mesh, of_seat)
            mesh_error[:] = kept.cached_numbers(
                done, done.touches, "mesh errors of the seat's stress", lambda: {"at places": errors().tolist()}
            )["at places"]
        of_force = [budget.bar(name) for name in run_peaks]
        bars = np.sqrt(of_seat.bars**2 + mesh_error**2 + np.square(of_force))
        by_key = {key: SAFETY * errors[SEAT] for key, errors in budget.parts.items()}
        by_key |= {RECOVERY: float(mesh_error[0]), WAVES: of_seat.bar}
        seat = replace(of_seat, bars=np.where(raw, math.nan, bars), by_key=by_key)
    if of_reed is not None:
        bar = math.hypot(of_reed.bar, budget.bar(REED))
        reed = replace(of_reed, bar=bar if math.isfinite(bar) else math.nan)
    return seat, reed


def stress_notes(plan: Plan, seat: SeatStress | None) -> tuple[str, ...]:
    """Return sentences on what the stress in a seat does not include, and on why it has no error bar."""
    sentences: list[str] = []
    if seat is None:
        return ()
    if plan.level == "spring":
        leaves = next((choice.leaves for choice in plan.choices if choice.key == MODEL), "")
        words = f", which leaves {leaves}" if leaves else ""
        sentences.append(
            "stress in the seat: the contact force behind it is that on the seat's static stiffness, without waves in "
            f"the seat{words}; the stress has the waves that this force sends in. To have them in the force, too, "
            "state seat.model"
        )
    bar, peak, asked = seat.bar, seat.peak.von_mises, plan.scene.stress
    rivals = [k for k in seat.spots if k != seat.where and peak[k] + bar > seat.judged[0] - bar]
    if rivals:
        sentences.append(
            f"stress in the seat: another place may have the largest: {place_words(seat.sites[rivals[0]], 'seat')} has "
            f"{write_quantity(float(peak[rivals[0]]), 'pressure')}"
        )
    at_limit = asked is not None and asked.surface and seat.from_excluded < AT_LIMIT * asked.distance
    key = max(seat.by_key, key=lambda each: seat.by_key[each], default="")
    if bar > LARGE * seat.judged[0] and seat.by_key.get(key, 0.0) > bar / 2:
        source = source_of(key) if ladder_of(key) else key
        named, remedy = source_in_words(source), remedy_of(plan, key, source)
        if key == WAVES:
            named, remedy = OF_WAVES, remedy_by_source(plan, "reduction")
        elif key == RECOVERY:
            named, remedy = OF_EDGES if at_limit else OF_MESH
        sentences.append(
            f"uncertainty of peak_seat_stress_Pa: {percent(bar / seat.judged[0])}, most of it by the {named}: {remedy}"
        )
    if at_limit:
        sentences.append(
            "stress in the seat: its largest lies at the limit of where it is reported, stress.distance from a sharp "
            "edge or the struck face; nearer to it, it is larger"
        )
    bars = {"peak_seat_stress_Pa": seat.bars[0], "peak_seat_principal_stress_Pa": seat.bars[1]}
    if names := [name for name, bar in bars.items() if math.isnan(bar)]:
        sentences.append(
            f"uncertainty of {' and '.join(names)} not known: half the time step changes it by more than "
            f"{100 * RAW:g} %, as for the raw force of a first touch, or there is no coarser mesh to compare with; "
            "state a compliant contact.law, or a shorter run.time_step"
        )
    return tuple(sentences)


def _name_stresses(judged: Array) -> dict[str, float]:
    """Return `SeatStress.judged` by name [Pa]."""
    names = (SEAT, TENSION, *(f"point {number} {SEAT}" for number in range(len(judged) - 2)))
    return dict(zip(names, map(float, judged), strict=True))
