"""Stress in the faces of a plate that strikes: its largest before the first touch and since, with an error bar."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.after.stresses import ReedStress
from impact.bodies.body import Body
from impact.greens.base import Array
from seatfem.structures import method, rings, sheets
from seatfem.structures.fields.corners import near, peak_mesh_error
from seatfem.structures.fields.peaks import LITTLE
from seatfem.structures.fields.recovery import LargestStress, StressField, largest
from seatfem.study.impacts import gas, plate_stress
from seatfem.study.impacts.bodies import striker_of
from seatfem.study.impacts.plate_stress import has_plate_stress, in_some_modes, lips_of_plate, pushes_of, struck_by
from seatfem.study.impacts.touches import Touches, stress_since
from seatfem.study.runs.round import Round

FEWER: Final = 0.75  # share of the modes in the run that is compared, for the error bar
OF_FEWER: Final = FEWER / (1 - FEWER)  # error with all modes over the change with fewer, if it falls like 1/modes
BESIDE: Final = 3.0  # largest distance of a point "beside the contact" from what touches the plate, in thicknesses


@dataclass(frozen=True)
class PlatePeaks:
    """The ``field`` of stress in a face of a plate under the forces of a run, and the largest at each of its points."""

    field: StressField
    found: LargestStress

    @staticmethod
    def from_round(done: Round, since: float | None = None) -> PlatePeaks | None:
        """Return the peaks of a round whose striker is a plate; ``None`` where no point has a known stress.

        ``since``: the time at which a landing begins [s].
        """
        field = plate_field(done)
        if not len(field.points):
            return None
        return PlatePeaks(field, largest(field, plate_pushes(done, done.touches), done.result.dt, since=since))


@dataclass(frozen=True)
class PlateReedStress:
    """The largest von Mises stress in the faces of a plate, and its errors by mesh and modes of the plate.

    Attributes:
        found: the largest, before the first touch and since.
        bar: error of that after the first touch [Pa]; nan where it is unknown.
        largest_at: the field where it is largest.
        peaks: at all places.
    """

    found: ReedStress
    bar: float
    largest_at: StressField
    peaks: PlatePeaks


def plate_reed_stress(done: Round, since: float | None = None) -> PlateReedStress | None:
    """Return the largest von Mises stress in the faces of the plate that strikes.

    ``None`` of strikers that are no plates, and of one so narrow that no place of it has a stress. Within one thickness
    of sharp corners, of the ends of the clamp and of what touches no stress is told: a plate has none there. The bar is
    the sum of what the coarser mesh behind the error of its Green's function changes at any place, by its order, and of
    what a quarter of the modes less change; it knows nothing of the force's own. ``since``: the time at which a landing
    begins, before and after which the stress is told apart, too [s].
    """
    scene, reed = done.plan.scene, done.plan.scene.reed.thin_plate
    if (
        reed is None
        or not has_plate_stress(reed, done.striker)
        or (peaks := PlatePeaks.from_round(done, since)) is None
    ):
        return None
    plate, force, dt = reed.plate(done.striker.greens), plate_pushes(done, done.touches), done.result.dt
    field, of_run = peaks.field, peaks.found
    stresses = plate_stress.stresses_of_plate(reed, field, of_run)
    if stresses.after_contact is None:
        return PlateReedStress(stresses, math.nan, field, peaks)
    worst = field.at(np.array([int(of_run.after_contact.von_mises.argmax())]))
    modes = worst.modal.shape[2]
    lowest = np.arange(modes) < max(1, round(FEWER * modes))
    of_lowest = StressField(worst.points, worst.static, worst.modal[..., lowest], in_some_modes(worst.body, lowest))
    fewer = largest(of_lowest, force, dt)
    coarser = sheets.plate_modes(plate.sheet, method.COARSENING)
    lips = lips_of_plate(scene.geometry, _division(done))
    on_coarser_mesh = plate_field(done, striker_of(scene, greens=coarser.greens(lips, reed.damping_ratio)))
    on_coarser = largest(on_coarser_mesh, force, dt).after_contact.von_mises
    weight = 1 / (sheets.refinement(plate, coarser) ** sheets.ORDER - 1)
    of_mesh = peak_mesh_error(field.points, of_run.after_contact.von_mises, on_coarser_mesh.points, on_coarser, weight)
    peak = _value(of_run)
    bar = of_mesh + OF_FEWER * abs(_value(fewer) - peak) + LITTLE * peak
    return PlateReedStress(stresses, bar, worst, peaks)


def plate_field(done: Round, striker: Body | None = None) -> StressField:
    """Return the stress in a face of the plate in a round; ``striker``: the plate on another mesh."""
    striker, touches = striker or done.striker, done.touches
    field = plate_stress.plate_field(done.plan.scene.geometry, striker, _division(done))
    return struck_by(field, striker, gas.lift_of(touches), plate_pushes(done, touches), touches.seat.dt)


def struck_in(field: StressField, done: Round, touches: Touches) -> tuple[StressField, Array]:
    """Return the field of a plate as one run of a round has it, the round's own or one on another seat, and the forces
    that `plate_pushes` returns."""
    pushes = plate_pushes(done, touches)
    return struck_by(field, done.striker, gas.lift_of(touches), pushes, touches.seat.dt), pushes


def stress_on_another_seat(done: Round, touches: Touches) -> ReedStress | None:
    """Return the largest stresses of the plate of a round in a run on another seat; ``None`` where none is known."""
    since, reed = stress_since(touches, done.plan.scene.accuracy.landing), done.plan.scene.reed.thin_plate
    field, pushes = struck_in(
        plate_stress.plate_field(done.plan.scene.geometry, done.striker, _division(done)), done, touches
    )
    if reed is None or not len(field.points):
        return None
    stresses = largest(field, pushes, touches.seat.dt, since=since)
    return plate_stress.stresses_of_plate(reed, field, stresses)


def _division(done: Round) -> rings.Division:
    return rings.Division.from_greens(done.seat.greens)


def _value(found: LargestStress) -> float:
    return float(found.after_contact.von_mises.max())


def singular_of_plate(done: Round) -> Array:
    """Return (k, 2) points of a plate that strikes near which plate theory gives no stress [m]."""
    return plate_stress.singular_points(done.plan.scene.geometry, done.striker.greens, _division(done))


def parts_of_plate(done: Round, points: Array) -> NDArray[np.str_]:
    """Return the names of the parts of a plate that strikes on which points (P, 2) lie."""
    reed = done.plan.scene.reed.thin_plate
    assert reed is not None
    touched = plate_stress.touched_points(done.plan.scene.geometry, done.striker.greens, _division(done))
    beside = near(points, touched, BESIDE * reed.thickness)
    return np.where(beside, "beside the contact", reed.geometry().regions(points))


def plate_pushes(done: Round, touches: Touches) -> Array:
    """Return (n + 1, ports) forces on the ports of the striker of a round, in its own run or on another seat [N]."""
    if touches.parts is None:
        return pushes_of(done.striker.greens, touches.seat.force[:, None], rings.Division(), touches.stopper_force)
    return pushes_of(done.striker.greens, touches.parts.force, _division(done), touches.stopper_force)
