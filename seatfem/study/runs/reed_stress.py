"""Stress in the faces of a striking plate, with the errors of its mesh and modes, and the errors of a value of its
histories, such as a fatigue margin, from the same value in other runs, in a wider band and on a coarser mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import impact
from impact.after import measures
from impact.after.histories import ReedStress, Spans
from impact.bodies.loads import find_own_coordinates
from impact.greens.base import Array
from impact.march.motion import modal_coordinates
from impact.march.problem import ContactProblem
from impact.march.rows import MarchRun
from impact.notices import Progress
from impact.runs.variations import Values
from seatfem.pictures import frames, skins
from seatfem.structures import method, sheets
from seatfem.structures.fields import peaks, recovery
from seatfem.structures.fields.peaks import LITTLE, LargestStress, largest, mises_range, von_mises
from seatfem.structures.fields.recovery import StressField, find_frames
from seatfem.structures.fields.sites import REACH, peak_mesh_error
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.structures.mesh.checks import nearest_distances
from seatfem.structures.method import COARSENING
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
from seatfem.study.method import REED_BAND
from seatfem.study.plan import Plan
from seatfem.study.runs import body_stress, kept
from seatfem.study.runs.body_stress import BOTH_FACES, Errors, FieldStress, History, Spot, ValueOf
from seatfem.study.runs.error_bars import error_bars_of, runs_of_budget
from seatfem.study.runs.round import Round

BEFORE: Final = 0.15  # time shown before the contact, over the duration of the contact
AFTER: Final = 0.35  # time shown after the contact, over the duration of the contact
STRONG: Final = 0.5
"""Least stress of a place, over the largest of its part or of the plate, at which errors or life are evaluated."""
GREY: Final = "\ngrey: beside the contact and sharp corners"


@dataclass(frozen=True)
class PlateStress(FieldStress):
    """The stress in a striking plate, by its field in the face z = h/2.

    Attributes:
        field: stress field of the face.
        reed: the plate.
        by_point: largest stress in the run at each point of the field.
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
        return self.bar / self.largest.after_contact.value

    @property
    def look(self) -> PlateLook:
        """Return the function by which other runs evaluate the stress at the point of the largest."""
        at_start = replace(self.largest_at, body=self.strike.striker)
        return PlateLook(self.reed, at_start, self.strike.division)

    @cached_property
    def regions(self) -> NDArray[np.str_]:
        return parts_of_plate(self.strike, self.field.points)

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Return the mask of the points whose stress counts: all, or, without a known error bar, those off the rim of
        an averaged patch, where the stress depends on the model of the contact."""
        return np.asarray((self.regions != RIM) | (not math.isnan(self.relative_bar)))

    @cached_property
    def likely(self) -> NDArray[np.int64]:
        """Return the points with at least half of the largest stress of their part, as a stress that alternates between
        p and -p has the range of one that pulsates between 0 and 2 p."""
        largest_in_run = self.by_point.within(slice(None)).von_mises
        in_part = [self.regions == part for part in np.unique(self.regions)]
        strong = [part & (largest_in_run >= STRONG * largest_in_run[part].max()) for part in in_part]
        return np.flatnonzero(np.any(strong, axis=0))

    def under(self, strike: Strike) -> PlateStress:
        return replace(self, strike=strike, field=struck_by(self.field, strike))

    def largest_in(self, strike: Strike, since: float) -> ReedStress:
        """Return the largest stresses in another run, also before and after the start ``since`` of a landing [s]."""
        other = self.under(strike)
        return stresses_of_plate(self.reed, self.field, largest(other.field, other.force, other.dt, since=since))

    def errors_of_value(self, done: Round, value_of: ValueOf, first: int, turn: float, progress: Progress) -> Errors:
        candidates = self.likely[self.counted[self.likely]]
        field = self.field.at(candidates)
        ranges = mises_range(field, self.force, self.dt, since=first)
        places = choose_places(ranges, self.regions[candidates])
        return find_errors_of_value(done, self.reed, self.strike, field.at(places), value_of, turn, progress)

    def hot_spots(self, stride: int) -> tuple[tuple[Spot, ...], tuple[History, ...]]:
        """Return the places of the largest von Mises stress of each part, in the face away from the seat, and the
        histories there at every ``stride``-th step."""
        peak = self.by_point.after_contact if math.isfinite(self.by_point.spans.touch) else self.by_point.initial
        by_part = [np.flatnonzero(self.regions == part) for part in np.unique(self.regions)]
        places = np.array([points[peak.von_mises[points].argmax()] for points in by_part])
        edges = nearest_distances(self.field.points[places], singular_points(self.strike))
        spots = self.spots_at(places, self.regions[places], edges, peak.von_mises_time[places])
        histories = body_stress.foremost(self.histories_at(places, spots, stride))
        return tuple(each.spot for each in histories), histories

    def map_to_skin(self, values: Array) -> tuple[skins.Skin, Array]:
        mesh = self.reed.plate(self.strike.striker.greens).mesh
        skin = skins.skin_of_plate(mesh)
        on_nodes = np.full((*values.shape[:-1], len(skin.nodes)), np.nan)
        on_nodes[..., body_stress.rows_of(self.field.points, mesh.points[skin.nodes])] = values
        return skin, on_nodes

    @property
    def wave_span(self) -> tuple[float, float]:
        groups = measures.contact_groups(self.strike.touches.seat)
        start, end = groups[0] if len(groups) else (math.nan, math.nan)
        return start - BEFORE * (end - start), end + AFTER * (end - start)

    def wave(self, steps: range) -> frames.Frames:
        """Return the stress wave in a face, deformed without the rigid motion, which would hide the bending."""
        striker, plate = self.strike.striker, self.reed.plate(self.strike.striker.greens)
        skin, mises = self.map_to_skin(von_mises(find_frames(self.field, self.force, self.dt, steps)))
        forces = self.force[1 : steps[-1] + 1].T
        rows = modal_coordinates(striker, forces, self.dt, steps.step)[steps.start // steps.step :]
        rows, dofs = find_own_coordinates(striker, rows), plate.model.dofs
        assert dofs is not None
        displacement, bending = np.zeros((*mises.shape, 3)), np.flatnonzero(plate.modes.omega[: rows.shape[1]])
        displacement[..., 2] = [dofs.expand(plate.modes.shapes[:, bending] @ q[bending])[2][skin.nodes] for q in rows]
        is_known = np.asarray(np.isfinite(mises).all(axis=0))
        time, touch = self.strike.touches.seat.time[list(steps)], self.strike.touches.touch
        title = "Stress wave in the faces of the reed"
        return frames.wave_frames(title, skin, mises, displacement, time, touch, is_known, GREY)


ERRORS: Final = "errors of the stress in a plate"
"""Name of `Errors` in the cache."""
PEAKS: Final = "largest stress at the points of a plate"
"""Name of the array (s, 4, P) of `LargestStress` in the cache."""


def plate_stress(done: Round) -> PlateStress | None:
    """Return the stress in the faces of the plate that strikes, in the run of a round; its numbers are cached.

    It is ``None`` for strikers that are no plates with modes, and for a plate too narrow to have points of known
    stress: plate theory gives none within one thickness of sharp corners, of the ends of the clamp and of the contact.
    The error bar is the sum of two errors: that of the mesh, extrapolated from a coarser mesh, and that of truncation,
    of second order, from a further run with the modes of a wider band (`sheets.BEYOND`). Other errors of the contact
    force are not included. Both errors are those of the places with at least `STRONG` of the largest stress.
    """
    scene, strike, since = done.plan.scene, done.strike, done.since
    reed, greens = scene.reed.thin_plate, strike.striker.greens
    if reed is None or greens.modal is None:
        return None
    field = struck_by(plate_field(scene.geometry, strike.striker, strike.division), strike)
    if not len(field.points):
        return None
    force, dt = strike.pushes, strike.dt

    def compute_peaks() -> Array:
        return largest(field, force, dt, since=since).by_span

    by_span = kept.cached_array(done, done.touches, PEAKS, field.points, compute_peaks)
    by_point = LargestStress(Spans.from_forces(force, dt, since), by_span)
    stress = PlateStress(strike, field, reed, by_point, math.nan, field)
    if not stress.largest.after_contact.is_known:
        return stress
    peaks = by_point.after_contact.von_mises
    errors = kept.cached_numbers(done, done.touches, ERRORS, lambda: _errors_of(done.plan, stress))
    worst = field.at(np.array([int(peaks.argmax())]))
    bar = errors["mesh"] + errors["truncation"] + LITTLE * float(peaks.max())
    return replace(stress, bar=bar, largest_at=worst)


def _errors_of(plan: Plan, stress: PlateStress) -> Errors:
    """Return the errors of the largest stress after the first touch, by the ``mesh`` and by ``truncation`` [Pa]."""
    scene, solved_by, strike, reed = plan.scene, plan.method.reed, stress.strike, stress.reed
    peaks, plate = stress.by_point.after_contact.von_mises, reed.plate(strike.striker.greens)
    strong = np.flatnonzero(peaks >= STRONG * peaks.max())
    points = stress.field.points[strong]
    coarser = sheets.plate_modes(plate.sheet, method.COARSENING)
    lips = reed.lips(solved_by.lip, solved_by.behind)
    striker = striker_of(scene, greens=coarser.greens(lips, reed.damping_ratio))
    field = restrict_to(plate_field(scene.geometry, striker, strike.division), points, 2 * REACH)  # maxima move
    field = struck_by(field, replace(strike, striker=striker))
    on_coarser = largest(field, strike.pushes, strike.dt).after_contact.von_mises
    weight = 1 / (sheets.refinement(plate, coarser) ** sheets.ORDER - 1)
    errors = {"mesh": peak_mesh_error(points, peaks[strong], field.points, on_coarser, weight), "truncation": math.nan}
    if (beyond := reed.solve_in_wider_band(strike.striker.greens, lips)) is not None:
        wider, ratio = beyond
        striker = striker_of(scene, greens=wider)
        field = restrict_to(plate_field(scene.geometry, striker, strike.division), points, 2 * REACH)
        look = PlateLook(reed, field, strike.division)
        run = marched(problem_of(scene, striker, impact.Body(strike.seat)), strike.dt, scene.run.duration)
        other = look(run, math.nan).after_contact.value
        errors["truncation"] = abs(other - float(peaks.max())) / (1 - ratio**-2)
    return errors


NEAR: Final = 0.75  # least stress range, over the largest, of a place that may have the least value in another run
MOST: Final = 12  # largest number of such places in each part
WORST: Final = 0.95  # least stress range, over the largest in the same run, of a place whose value is computed
FEW: Final = 8  # largest number of such places
VALUE: Final = "value"


@dataclass(frozen=True)
class ValueLook:
    """Function that computes a value of a plate's stress from the contact forces of a run.

    It is the least value at up to `FEW` places whose stress range is at least `WORST` of the largest in that run. The
    value at the place of the largest range alone would jump between places of nearly the same range and different mean
    stress.

    Attributes:
        look: function that gives the stress field of a run at the places that may have the least value.
        value_of: function that returns the value of stress histories.
        turn: duration of the last part of a run, which repeats [s]; ``inf``: the whole run.
    """

    look: PlateLook
    value_of: ValueOf
    turn: float = math.inf

    def __call__(self, run: MarchRun) -> Values:
        field, pushes, dt = self.look.load_by_run(run)
        first = 0 if math.isinf(self.turn) else max(0, len(pushes) - 1 - round(self.turn / dt))
        ranges = peaks.mises_range(field, pushes, dt, since=first)
        worst = np.argsort(-ranges, kind="stable")[: min(FEW, np.count_nonzero(ranges >= WORST * ranges.max()))]
        courses = recovery.tensor_histories(field.at(worst), pushes, dt)
        return {VALUE: self.value_of(course[first:] for course in courses)}

    def moved_to(self, field: recovery.StressField) -> ValueLook:
        """Return the look at these places of another model of the plate, by its ``field``."""
        return replace(self, look=replace(self.look, field=restrict_to(field, self.look.field.points, REACH)))


def restrict_to(field: recovery.StressField, points: Array, reach: float) -> recovery.StressField:
    """Return a field restricted to its places within ``reach`` times their median spacing of given ``points`` (n, 2),
    or to the nearest place."""
    spacing = float(np.median(cKDTree(field.points).query(field.points, k=[2])[0]))
    distance = np.asarray(cKDTree(points).query(field.points)[0])
    return field.at(np.asarray(distance <= max(reach * spacing, float(distance.min()))))


def choose_places(ranges: Array, regions: NDArray[np.str_]) -> NDArray[np.int64]:
    """Return the places, at most `MOST` in each part, with the largest stress ``ranges`` (P,) that are at least `NEAR`
    of the largest of all parts."""
    hottest = peaks.hottest(ranges, regions, MOST)
    near: NDArray[np.int64] = hottest[ranges[hottest] >= NEAR * ranges.max()]
    return near


def find_errors_of_value(
    done: Round,
    plate: ThinPlate,
    strike: Strike,
    field: recovery.StressField,
    value_of: ValueOf,
    turn: float,
    progress: Progress,
) -> dict[str, float]:
    """Return the errors of the least value at the places of a ``field`` by source: the keys of the error budget, and
    the ``mesh`` of the ``plate``.

    The error by the plate's band is the larger one of that in the budget and that by a wider band, ``inf`` if there is
    no wider one. ``strike``: the run of the round ``done``; ``turn``: as in `ValueLook`.
    """
    scene, greens = done.plan.scene, strike.striker.greens
    look = ValueLook(PlateLook(plate, replace(field, body=strike.striker), strike.division), value_of, turn)
    budget, _ = error_bars_of(done, look, progress=progress)
    errors, own = {key: part[VALUE] for key, part in budget.parts.items()}, budget.values[VALUE]
    modes, method = plate.plate(greens), done.plan.method.reed
    lips = plate.lips(method.lip, method.behind)
    own_problem, _, flights = runs_of_budget(done, progress)  # marched already for the budget

    def evaluate_model(striker: impact.Body, problem: ContactProblem) -> float:
        """Return the value by another model of the plate, under the forces of a run of the ``problem``."""
        run = marched(problem, strike.dt, scene.run.duration, flights)
        return look.moved_to(plate_field(scene.geometry, striker, strike.division))(run)[VALUE]

    coarser = sheets.plate_modes(modes.sheet, COARSENING)
    on_coarser = evaluate_model(striker_of(scene, greens=coarser.greens(lips, plate.damping_ratio)), own_problem)
    mesh = abs(on_coarser - own) / (sheets.refinement(modes, coarser) ** sheets.ORDER - 1)
    band = math.inf
    if (beyond := plate.solve_in_wider_band(greens, lips)) is not None:
        wider = striker_of(scene, greens=beyond[0])
        in_wider = evaluate_model(wider, problem_of(scene, wider, impact.Body(done.seat.greens)))
        band = abs(in_wider - own) / (1 - beyond[1] ** -2)
    return {**errors, REED_BAND: max(band, errors.get(REED_BAND, 0.0)), "mesh": mesh}
