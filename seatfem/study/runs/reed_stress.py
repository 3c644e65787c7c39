"""Largest stress in the faces of a plate that strikes, before and after the first touch, with an error bar."""

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

FEWER: Final = 0.75  # fraction of the modes in the comparison that gives the truncation error
OF_FEWER: Final = FEWER / (1 - FEWER)  # truncation error over that change, if the error falls like 1/modes
BESIDE: Final = 3.0  # distance from the contact within which a point is "beside the contact", in plate thicknesses


@dataclass(frozen=True)
class PlatePeaks:
    """The stress ``field`` in a face of a plate under the forces of a run, and the largest stress at each point."""

    field: StressField
    found: LargestStress

    @staticmethod
    def from_round(done: Round, since: float | None = None) -> PlatePeaks | None:
        """Return the peaks of a round whose striker is a plate; ``None`` if plate theory gives no stress at any point.

        ``since``: start of the judged landing [s].
        """
        field = plate_field(done)
        if not len(field.points):
            return None
        return PlatePeaks(field, largest(field, plate_pushes(done, done.touches), done.result.dt, since=since))


@dataclass(frozen=True)
class PlateReedStress:
    """The largest von Mises stress in the faces of a plate, and its errors by mesh and modes of the plate.

    Attributes:
        found: largest stresses before and after the first touch.
        bar: error bar of the largest after the first touch [Pa]; nan if unknown.
        largest_at: stress field at the point of the largest stress.
        peaks: largest stress at each point.
    """

    found: ReedStress
    bar: float
    largest_at: StressField
    peaks: PlatePeaks


def plate_reed_stress(done: Round, since: float | None = None) -> PlateReedStress | None:
    """Return the largest von Mises stress in the faces of the plate that strikes.

    It is ``None`` for strikers that are no plates, and for a plate too narrow to have points of known stress: plate
    theory gives none within one thickness of sharp corners, of the ends of the clamp and of the contact. The error bar
    is the sum of the mesh error, extrapolated from a coarser mesh, and of the truncation error, from `FEWER` of the
    modes; errors of the contact force are not included. ``since``: start of the judged landing [s], from which on the
    stress is reported separately, too.
    """
    scene, reed = done.plan.scene, done.plan.scene.reed.thin_plate
    if (
        reed is None
        or not has_plate_stress(reed, done.striker)
        or (peaks := PlatePeaks.from_round(done, since)) is None
    ):
        return None
    plate, force, dt = reed.plate(done.striker.greens), plate_pushes(done, done.touches), done.result.dt
    field, peak_stress = peaks.field, peaks.found
    stresses = plate_stress.stresses_of_plate(reed, field, peak_stress)
    if stresses.after_contact is None:
        return PlateReedStress(stresses, math.nan, field, peaks)
    worst = field.at(np.array([int(peak_stress.after_contact.von_mises.argmax())]))
    modes = worst.modal.shape[2]
    lowest = np.arange(modes) < max(1, round(FEWER * modes))
    lowest_field = StressField(worst.points, worst.static, worst.modal[..., lowest], in_some_modes(worst.body, lowest))
    fewer = largest(lowest_field, force, dt)
    coarser = sheets.plate_modes(plate.sheet, method.COARSENING)
    lips = lips_of_plate(scene.geometry, _division(done))
    on_coarser_mesh = plate_field(done, striker_of(scene, greens=coarser.greens(lips, reed.damping_ratio)))
    on_coarser = largest(on_coarser_mesh, force, dt).after_contact.von_mises
    weight = 1 / (sheets.refinement(plate, coarser) ** sheets.ORDER - 1)
    mesh_error = peak_mesh_error(
        field.points, peak_stress.after_contact.von_mises, on_coarser_mesh.points, on_coarser, weight
    )
    peak = _value(peak_stress)
    bar = mesh_error + OF_FEWER * abs(_value(fewer) - peak) + LITTLE * peak
    return PlateReedStress(stresses, bar, worst, peaks)


def plate_field(done: Round, striker: Body | None = None) -> StressField:
    """Return the stress field in a face of the plate in a round; ``striker``: the plate's body, if on another mesh."""
    striker, touches = striker or done.striker, done.touches
    field = plate_stress.plate_field(done.plan.scene.geometry, striker, _division(done))
    return struck_by(field, striker, gas.lift_of(touches), plate_pushes(done, touches), touches.seat.dt)


def struck_in(field: StressField, done: Round, touches: Touches) -> tuple[StressField, Array]:
    """Return the stress field of a plate in a run of a round, its own or that on another seat, and the port forces of
    `plate_pushes`."""
    pushes = plate_pushes(done, touches)
    return struck_by(field, done.striker, gas.lift_of(touches), pushes, touches.seat.dt), pushes


def stress_on_another_seat(done: Round, touches: Touches) -> ReedStress | None:
    """Return the largest stresses in a round's plate in a run on another seat; ``None`` if no stress is known."""
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
    """Return the (k, 2) points [m] near which plate theory gives no stress in the plate that strikes."""
    return plate_stress.singular_points(done.plan.scene.geometry, done.striker.greens, _division(done))


def parts_of_plate(done: Round, points: Array) -> NDArray[np.str_]:
    """Return the (P,) names of the parts of the striking plate on which points (P, 2) lie."""
    reed = done.plan.scene.reed.thin_plate
    assert reed is not None
    touched = plate_stress.touched_points(done.plan.scene.geometry, done.striker.greens, _division(done))
    beside = near(points, touched, BESIDE * reed.thickness)
    return np.where(beside, "beside the contact", reed.geometry().regions(points))


def plate_pushes(done: Round, touches: Touches) -> Array:
    """Return the (n + 1, ports) forces [N] on the striker's ports in a run of a round, its own or on another seat."""
    if touches.parts is None:
        return pushes_of(done.striker.greens, touches.seat.force[:, None], rings.Division(), touches.stopper_force)
    return pushes_of(done.striker.greens, touches.parts.force, _division(done), touches.stopper_force)
