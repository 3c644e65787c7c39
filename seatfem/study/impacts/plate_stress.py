"""Stress in the faces of a plate that strikes: its field, and the largest of it under the forces of a march."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

import impact
from impact.after.loads import without_springs
from impact.after.stresses import PeakStress, ReedStress, stress_by_spans
from impact.bodies.body import Body, ModalState
from impact.greens.base import Array, GreensFunction
from impact.march.stepper import with_recorded_loads
from seatfem import structures
from seatfem.structures import fields, lip, rings
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.study.impacts.touches import parts_of, stopper_force_of
from seatfem.study.scene import ContactGeometry

if TYPE_CHECKING:
    from seatfem.structures import sheets
    from seatfem.structures.elements.mindlin import PlateMesh
    from seatfem.structures.fields import peaks
    from seatfem.structures.fields.recovery import Largest, LargestStress, StressField

AT_REST: Final = 1e-2  # of the lowest frequency: what moves so slowly bends a free plate as if at rest
AS_IF_HELD: Final = 1e-8  # residual of a first solve, as of a plate that is held
MODES_LOOKED_AT: Final = 12  # lowest modes whose most stressed places are checked in pre-runs
PLACES_OF_A_MODE: Final = 3


@dataclass(frozen=True)
class _Columns:
    """Stress of a plate at P points, for each port's force at rest and for each elastic mode.

    Attributes:
        points: (P, 2) where [m].
        static: (P, 6, p) of a unit force at rest on each port [Pa/N].
        modal: (P, 6, M) of each elastic mode [Pa/(m sqrt(kg))].
        few: numbers of the points of which one bears nearly the largest stress, whatever strikes.
    """

    points: Array
    static: Array
    modal: Array
    few: peaks.Integers


def has_plate_stress(reed: Structure, striker: Body) -> bool:
    """Return whether a plate strikes whose stress can be known."""
    return reed.thin_plate is not None and striker.greens.modal is not None


def lips_of_plate(geometry: ContactGeometry, division: rings.Division) -> tuple[lip.AnyLip, ...]:
    """Return the lips that touch the plate that strikes: its own face first, then the seat's lip in these parts."""
    return _plate_of(geometry).lips(geometry.on_the_reed(geometry.lip(division.arcs, division.rings)))


def _plate_of(geometry: ContactGeometry) -> ThinPlate:
    """Return the plate that strikes."""
    assert geometry.reed.thin_plate is not None
    return geometry.reed.thin_plate


def _touching_lips(geometry: ContactGeometry, division: rings.Division) -> tuple[lip.AnyLip, ...]:
    """Return those of `lips_of_plate` that really touch: the seat's, else its own; a stopper meets its own, too."""
    lips = lips_of_plate(geometry, division)
    return lips if geometry.stopper is not None else lips[-1:]


def touched_points(geometry: ContactGeometry, greens: GreensFunction, division: rings.Division) -> Array:
    """Return (k, 2) points of the patches with which a plate touches [m]."""
    return _points_of(_plate_of(geometry).plate(greens), _touching_lips(geometry, division))


def singular_points(geometry: ContactGeometry, greens: GreensFunction, division: rings.Division) -> Array:
    """Return (k, 2) points of a plate that strikes beside which its theory knows no stress [m]."""
    return _singular(_plate_of(geometry).plate(greens), _touching_lips(geometry, division))


def plate_field(
    geometry: ContactGeometry, striker: Body, division: rings.Division, *, few: bool = False
) -> StressField:
    """Return the stress in the face z = h/2 of the plate that strikes.

    It is known at the nodes away from what has no stress in plate theory: within one thickness of sharp corners, of the
    ends of the clamp and of what touches. The field is that of the elastic modes and of what each port's force at rest
    does beside them. ``few``: at some 40 nodes alone, those most stressed by the lowest modes and by the ports.

    The body of the field is the whole striker: `struck_by` takes its start, its loads and its elastic modes.
    """
    plate = _plate_of(geometry).plate(striker.greens)
    lips, touched = lips_of_plate(geometry, division), _touching_lips(geometry, division)
    columns = _columns(_Plate(plate, lips, touched, tuple(striker.greens.ports)))
    field = fields.recovery.StressField(columns.points, columns.static, columns.modal, striker)
    return field.at(columns.few) if few else field


@dataclass(frozen=True, eq=False)
class _Plate:
    """A plate and what touches it, equal to another where its modes, lips and ports are."""

    plate: sheets.PlateModes
    lips: tuple[lip.AnyLip, ...]
    touched: tuple[lip.AnyLip, ...]
    ports: tuple[str, ...]

    def __hash__(self) -> int:
        return hash((id(self.plate), self.lips, self.ports))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, _Plate):
            return NotImplemented
        mine, theirs = ((each.lips, each.touched, each.ports) for each in (self, other))
        return self.plate is other.plate and mine == theirs


@lru_cache(maxsize=4)
def _columns(asked: _Plate) -> _Columns:
    """Return the stress of a plate by modes and ports; found once in a process."""
    plate = asked.plate
    sheet, sites = plate.sheet, fields.sites.plate_nodes(plate.mesh)
    model, thickness = plate.with_ports(asked.lips).with_ports(asked.ports), sheet.shape.thickness
    rigid, shapes = plate.modes.omega == 0, plate.modes.shapes
    stiffness, loads, tolerance = model.K, model.port_matrix, AS_IF_HELD
    if rigid.any():  # its inertia balances the loads
        moving = shapes[:, rigid]
        slow = AT_REST * float(plate.modes.omega[~rigid].min())
        stiffness, loads = stiffness + slow**2 * model.M, loads - model.M @ (moving @ (moving.T @ loads))
        tolerance /= AT_REST**2  # a first solve pushes rigid motions, too, which yield as much more than bending
    functional = fields.sites.plate_stress(plate.mesh, sheet.material, thickness, model, sites)
    solutions = (
        structures.reduction.factorization.factorize(stiffness, tolerance=tolerance, name="K").solve(loads),
        shapes[:, ~rigid],
    )
    static, modal = (np.asarray(functional @ each).reshape(len(sites), 6, -1) for each in solutions)
    away = ~fields.corners.near(sites.points, _singular(plate, asked.touched), thickness)
    points, static, modal = sites.points[away], static[away], modal[away]
    return _Columns(points, static, modal, _most_stressed(static, modal))


def _most_stressed(static: Array, modal: Array) -> peaks.Integers:
    """Return the numbers of the points most stressed by each of the lowest modes and by all ports together."""
    by_mode = np.linalg.norm(modal[:, :, :MODES_LOOKED_AT], axis=1)
    by_ports = np.linalg.norm(static.sum(axis=2), axis=1)[:, None]
    order = np.argsort(-np.concatenate([by_mode, by_ports], axis=1), axis=0)
    return np.unique(order[:PLACES_OF_A_MODE]).astype(np.int64)


def struck_by(field: StressField, striker: Body, opening: Array, pushes: Array, dt: float) -> StressField:
    """Return the field of a plate in a run: as it starts there, with loads that follow its lift, of which ``opening``
    (n + 1,) is the mean at the seat [m]; ``pushes``: (n + 1, ports) forces on its ports [N]; ``dt``: step [s]."""
    body = without_springs(with_recorded_loads(striker, opening, dt), pushes, dt)
    greens = body.greens.modal
    assert greens is not None
    return replace(field, body=in_some_modes(body, greens.omega > 0))


def in_some_modes(body: Body, kept: NDArray[np.bool_]) -> Body:
    """Return the body in some of its modes (M,); of a translation in none of these nothing is left."""
    greens, start = body.greens.modal, body.modal_start()
    assert greens is not None
    some = replace(greens, omega=greens.omega[kept], zeta=greens.zeta[kept], shapes=greens.shapes[kept])
    state = ModalState(start.displacement[kept], start.velocity[kept])
    return Body(some, state=state, loads=tuple(replace(load, shape=load.shape[kept]) for load in body.loads))


def stresses_of_plate(reed: ThinPlate, field: StressField, found: LargestStress) -> ReedStress:
    """Return the largest von Mises stresses of a plate in the spans of a run."""
    return stress_by_spans(found.spans, lambda chosen: _peak(reed, field, found.within(chosen)))


def _peak(reed: ThinPlate, field: StressField, found: Largest) -> PeakStress:
    """Return the largest stress, its distance from the root, or of a free plate from its centre, and its time."""
    k, shape = int(found.von_mises.argmax()), reed.geometry()
    x, y = field.points[k] - (0.0 if shape.is_clamped else np.asarray(shape.centre))
    at = float(x if shape.is_clamped else math.hypot(x, y))
    return PeakStress(float(found.von_mises[k]), at, float(found.von_mises_time[k]))


@dataclass(frozen=True)
class PlateLook:
    """Computes the stress of a plate from the contact forces of a march.

    Attributes:
        reed: the plate that is marched.
        field: of the plate, its body the striker as it starts.
        division: of the seat's patch, whose parts are ports of that body.
    """

    reed: ThinPlate
    field: StressField
    division: rings.Division

    @classmethod
    def at_few_places(cls, geometry: ContactGeometry, striker: Body, division: rings.Division) -> PlateLook | None:
        """Return the look at the places that modes and ports stress most; ``None`` of strikers that are no plates."""
        if not has_plate_stress(geometry.reed, striker):
            return None
        return cls(_plate_of(geometry), plate_field(geometry, striker, division, few=True), division)

    def __call__(self, stepper: impact.ContactStepper, since: float | None) -> ReedStress | None:
        """Return the largest stresses, before and after the time ``since`` at which a landing begins, too [s]."""
        if not len(self.field.points):
            return None
        forces, body = Forces.from_march(stepper), self.field.body
        pushes = pushes_of(body.greens, forces.by(self.division), self.division, forces.stopper)
        field = struck_by(self.field, body, stepper.opening, pushes, forces.dt)
        return stresses_of_plate(
            self.reed, field, fields.recovery.largest(field, pushes, forces.dt, since=since, workers=1)
        )


@dataclass(frozen=True)
class Forces:
    """Contact forces of one run.

    Attributes:
        parts: (n + 1, parts) of each part of the seat's patch [N].
        division: of the patch into these.
        stopper: (n + 1,) likewise; ``None`` where there is none.
        dt: [s].
    """

    parts: Array
    division: rings.Division
    stopper: Array | None
    dt: float

    @staticmethod
    def from_march(stepper: impact.ContactStepper) -> Forces:
        """Return the contact forces of a march."""
        problem, parts = stepper.prepared.problem, parts_of(stepper)
        division = rings.Division.from_greens(problem.target.greens) if parts.shape[1] > 1 else rings.Division()
        return Forces(parts, division, stopper_force_of(stepper), stepper.prepared.dt)

    def by(self, wanted: rings.Division) -> Array:
        """Return (n + 1, parts) forces on the parts of another division, of a uniform pressure in each part [N]."""
        have = self.division
        if have == wanted:
            return self.parts
        across = overlaps(rings.ring_borders(have.rings), rings.ring_borders(wanted.rings))
        along = overlaps(np.linspace(0, 1, have.arcs + 1), np.linspace(0, 1, wanted.arcs + 1))
        parts = self.parts.reshape(-1, have.arcs, have.rings)
        return np.asarray(np.einsum("nar,ab,rc->nbc", parts, along, across, optimize=True)).reshape(len(parts), -1)


def overlaps(have: Array, wanted: Array) -> Array:
    """Return (h, w) the share of each of h intervals that lies in each of w others; edges (h + 1,) and (w + 1,)."""
    low = np.maximum(have[:-1, None], wanted[None, :-1])
    high = np.minimum(have[1:, None], wanted[None, 1:])
    return np.asarray(np.maximum(high - low, 0.0) / np.diff(have)[:, None])


def pushes_of(greens: GreensFunction, parts: Array, division: rings.Division, stopper: Array | None) -> Array:
    """Return (n + 1, ports) forces on the ports of a striker, away from the seat [N].

    Of the seat's patch in parts, of this ``division``, with (n + 1, parts) forces, and of a ``stopper`` with (n + 1,)
    ones, which meets the first port, if there is one [N].
    """
    force = np.zeros((len(parts), len(greens.ports)))
    for name, pushed in zip(division.names, parts.T, strict=True):
        force[:, greens.port_index(name) if name in greens.ports else 0] += pushed
    if stopper is not None:
        force[:, 0] -= stopper
    return force


def _singular(plate: sheets.PlateModes, touched: tuple[lip.AnyLip, ...]) -> Array:
    """Return (k, 2) points that are touched, ends of the clamp and sharp corners [m]."""
    return np.concatenate(
        [_points_of(plate, touched), _ends_of_clamp(plate.mesh), fields.corners.sharp_nodes(plate.mesh)]
    )


def _points_of(plate: sheets.PlateModes, lips: tuple[lip.AnyLip, ...]) -> Array:
    """Return (k, 2) points of the patches of some lips [m]."""
    return np.concatenate([patch.points for patch in structures.sheets.patches_of(plate.sheet, lips).values()])


def _ends_of_clamp(mesh: PlateMesh) -> Array:
    """Return (2, 2) ends of the clamped line [m]; none of a free plate."""
    line = mesh.points[mesh.lines.get(structures.mesh.plane_meshes.CLAMPED, np.zeros(0, dtype=np.int64))]
    return line[[int(line[:, 1].argmin()), int(line[:, 1].argmax())]] if len(line) else line
