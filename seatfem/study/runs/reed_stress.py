"""Stress in the faces of a plate that strikes, with the errors of its mesh and modes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

import impact
from impact.after import measures
from impact.after.histories import ReedStress
from impact.bodies.body import Body
from impact.bodies.loads import find_own_coordinates
from impact.greens.base import Array
from impact.march.motion import modal_coordinates
from seatfem.pictures import cell_grid, frames
from seatfem.structures import method, sheets
from seatfem.structures.fields.peaks import LITTLE, LargestStress, largest, von_mises
from seatfem.structures.fields.recovery import StressField, in_frames
from seatfem.structures.fields.sites import peak_mesh_error
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.structures.mesh.checks import nearest_distances
from seatfem.structures.method import Method
from seatfem.study.impacts.bodies import problem_of, striker_of
from seatfem.study.impacts.contact import marched
from seatfem.study.impacts.forces import Strike
from seatfem.study.impacts.plate_stress import (
    RIM,
    PlateLook,
    parts_of_plate,
    plate_field,
    singular_points,
    stresses_of_plate,
    struck_by,
)
from seatfem.study.runs.body_stress import BOTH_FACES, FieldStress, History, Spot, foremost, rows_of
from seatfem.study.scene import Scene

BEFORE: Final = 0.15  # time shown before the contact, in its durations
AFTER: Final = 0.35  # time shown after the contact, in its durations
GREY: Final = "\ngrey: beside the contact and sharp corners"


@dataclass(frozen=True)
class PlateStress(FieldStress):
    """The stress in a plate that strikes, by its field in the face z = h/2.

    Attributes:
        reed: the plate.
        by_point: largest stress at each point in the run.
        bar: error bar of the largest von Mises stress after the first touch [Pa]; nan if unknown.
        largest_at: stress field at the point of that stress.
    """

    role: ClassVar[str] = "reed"
    faces: ClassVar[tuple[tuple[str, float], ...]] = BOTH_FACES

    field: StressField
    reed: ThinPlate
    by_point: LargestStress
    bar: float
    largest_at: StressField

    @property
    def force(self) -> Array:
        return self.strike.pushes

    @cached_property
    def largest(self) -> ReedStress:
        """Return the largest von Mises stresses before and after the first touch."""
        return stresses_of_plate(self.reed, self.field, self.by_point)

    @property
    def relative_bar(self) -> float:
        after = self.largest.after_contact
        return math.nan if after is None else self.bar / after.value

    @property
    def look(self) -> PlateLook:
        """Return how other runs evaluate the stress, at its largest."""
        at_start = replace(self.largest_at, body=self.strike.striker)
        return PlateLook(self.reed, at_start, self.strike.division)

    @cached_property
    def regions(self) -> NDArray[np.str_]:
        return parts_of_plate(self.strike, self.field.points)

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Return the mask of all points, or of those off the rim of an averaged patch, whose stress is a model's, if it
        has no bar."""
        return np.asarray((self.regions != RIM) | (not math.isnan(self.relative_bar)))

    def under(self, strike: Strike) -> PlateStress:
        return replace(self, strike=strike, field=struck_by(self.field, strike))

    def largest_in(self, strike: Strike, since: float | None) -> ReedStress:
        """Return the largest stresses in another run, also before and after the start ``since`` of a landing [s]."""
        other = self.under(strike)
        return stresses_of_plate(self.reed, self.field, largest(other.field, other.force, other.dt, since=since))

    def hot_spots(self, stride: int) -> tuple[tuple[Spot, ...], tuple[History, ...]]:
        """Return the places of the largest von Mises stress of each part, in the face away from the seat."""
        peak = self.by_point.after_contact if math.isfinite(self.by_point.spans.touch) else self.by_point.initial
        by_part = [np.flatnonzero(self.regions == part) for part in np.unique(self.regions)]
        which = np.array([points[peak.von_mises[points].argmax()] for points in by_part])
        edges = nearest_distances(self.field.points[which], singular_points(self.strike))
        spots = self.spots_at(which, self.regions[which], edges, peak.von_mises_time[which])
        histories = foremost(self.histories_at(which, spots, stride))
        return tuple(each.spot for each in histories), histories

    def on_skin(self, values: Array) -> tuple[cell_grid.Skin, Array]:
        mesh = self.reed.plate(self.strike.striker.greens).mesh
        skin = cell_grid.skin_of_plate(mesh)
        on_nodes = np.full((*values.shape[:-1], len(skin.nodes)), np.nan)
        on_nodes[..., rows_of(self.field.points, mesh.points[skin.nodes])] = values
        return skin, on_nodes

    @property
    def wave_span(self) -> tuple[float, float]:
        groups = measures.contact_groups(self.strike.touches.seat)
        start, end = groups[0] if len(groups) else (math.nan, math.nan)
        return start - BEFORE * (end - start), end + AFTER * (end - start)

    def wave(self, steps: range) -> frames.Frames:
        """Return the stress wave in a face, without the rigid motion, which would hide the bending."""
        striker, plate = self.strike.striker, self.reed.plate(self.strike.striker.greens)
        skin, mises = self.on_skin(von_mises(in_frames(self.field, self.force, self.dt, steps)))
        pushes = self.force[1 : steps[-1] + 1].T
        rows = modal_coordinates(striker, pushes, self.dt, steps.step)[steps.start // steps.step :]
        rows, dofs = find_own_coordinates(striker, rows), plate.model.dofs
        assert dofs is not None
        moved, bends = np.zeros((*mises.shape, 3)), np.flatnonzero(plate.modes.omega[: rows.shape[1]])
        moved[..., 2] = [dofs.expand(plate.modes.shapes[:, bends] @ q[bends])[2][skin.nodes] for q in rows]
        known = np.asarray(np.isfinite(mises).all(axis=0))
        time, touch = self.strike.touches.seat.time[list(steps)], self.strike.touches.touch
        return frames.wave_frames("Stress wave in the faces of the reed", skin, mises, moved, time, touch, known, GREY)


def plate_stress(scene: Scene, solved_by: Method, strike: Strike, since: float | None = None) -> PlateStress | None:
    """Return the stress in the faces of the plate that strikes.

    It is ``None`` for strikers that are no plates with modes, and for a plate too narrow to have points of known
    stress: plate theory gives none within one thickness of sharp corners, of the ends of the clamp and of the contact.
    The error bar is the sum of the mesh error, extrapolated from a coarser mesh, and of the truncation error, from
    modes beyond the band (`sheets.BEYOND`) in a run of their own, of second order; other errors of the contact force
    are not included.

    Args:
        scene: the scene.
        solved_by: method of the plate.
        strike: the run.
        since: start of the judged landing [s], from which on the stress is reported separately, too.
    """
    reed, greens = scene.reed.thin_plate, strike.striker.greens
    if reed is None or greens.modal is None:
        return None
    field = struck_by(plate_field(scene.geometry, strike.striker, strike.division), strike)
    if not len(field.points):
        return None
    by_point = largest(field, strike.pushes, strike.dt, since=since)
    stress = PlateStress(strike, field, reed, by_point, math.nan, field)
    if stress.largest.after_contact is None:
        return stress
    peaks, plate = by_point.after_contact.von_mises, reed.plate(greens)
    coarser = sheets.plate_modes(plate.sheet, method.COARSENING)
    lips = reed.lips(solved_by.lip, solved_by.behind)
    striker = striker_of(scene, greens=coarser.greens(lips, reed.damping_ratio))
    field_there = struck_by(plate_field(scene.geometry, striker, strike.division), replace(strike, striker=striker))
    on_coarser = largest(field_there, strike.pushes, strike.dt).after_contact.von_mises
    weight = 1 / (sheets.refinement(plate, coarser) ** sheets.ORDER - 1)
    mesh_error = peak_mesh_error(field.points, peaks, field_there.points, on_coarser, weight)
    peak, truncation = float(peaks.max()), math.nan
    if (beyond := reed.in_wider_band(greens, lips)) is not None:
        wider, ratio = beyond
        other = _stress_of(scene, reed, strike, striker_of(scene, greens=wider))
        truncation = abs(other - peak) / (1 - ratio**-2)
    worst = field.at(np.array([int(peaks.argmax())]))
    return replace(stress, bar=mesh_error + truncation + LITTLE * peak, largest_at=worst)


def _stress_of(scene: Scene, reed: ThinPlate, strike: Strike, striker: Body) -> float:
    """Return the largest stress after the first touch in a run with another model of the plate [Pa]."""
    look = PlateLook(reed, plate_field(scene.geometry, striker, strike.division), strike.division)
    problem = problem_of(scene, striker, impact.Body(strike.seat))
    largest = look(marched(problem, strike.dt, scene.run.duration), None)
    return math.nan if largest is None or largest.after_contact is None else largest.after_contact.value
