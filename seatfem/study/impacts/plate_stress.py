"""Stress in the faces of a plate that strikes: its field, and the largest stress under the forces of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from impact.after.histories import UNKNOWN_STRESS, PeakStress, ReedStress, stress_by_spans
from impact.bodies.body import Body, ModalState
from impact.greens.base import Array
from impact.march.rows import MarchRun
from seatfem.structures import lip, rings, sheets
from seatfem.structures.fields import recovery
from seatfem.structures.fields import sites as field_sites
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.structures.mesh import plane_meshes
from seatfem.structures.reduction import factorization
from seatfem.study.impacts.forces import Forces, Strike
from seatfem.study.scene import ContactGeometry

if TYPE_CHECKING:
    from seatfem.structures import sheets
    from seatfem.structures.elements.mindlin import PlateMesh
    from seatfem.structures.fields.recovery import Largest, LargestStress, StressField

AT_REST: Final = 1e-2  # frequency at which a free plate is solved for its static bending, over its lowest frequency
AS_IF_HELD: Final = 1e-8  # relative residual of a first solve of a plate that is held
BESIDE: Final = 3.0  # distance from the contact within which a point is "beside the contact", in plate thicknesses
RIM: Final = "rim of an averaged patch"  # part of a plate beside one contact with the mean motion of a disc or ring


Lips = tuple[lip.AnyLip, ...]


def _plate_of(geometry: ContactGeometry) -> ThinPlate:
    """Return the plate that strikes."""
    assert geometry.reed.thin_plate is not None
    return geometry.reed.thin_plate


def lips_of_plate(geometry: ContactGeometry, division: rings.Division) -> tuple[Lips, Lips]:
    """Return the contact patches on the striking plate, its own face, the stopper's and the seat's lip by ``division``;
    and those that are in contact: the plate's own face only where it stands in for that of seat or stopper."""
    seat = geometry.place_on_reed(geometry.lip(division.arcs, division.rings))
    lips = _plate_of(geometry).lips(seat, geometry.place_behind_reed())
    own, *others = lips
    behind = [each for each in others if each.side]
    if geometry.stopper is not None and not behind:
        behind = [own]
    return lips, (*behind, *([each for each in others if not each.side] or [own]))


def singular_points(strike: Strike) -> Array:
    """Return the (k, 2) points near which plate theory gives no stress in the striking plate [m]."""
    _, touched = lips_of_plate(strike.geometry, strike.division)
    return _singular(_plate_of(strike.geometry).plate(strike.striker.greens), touched)


def parts_of_plate(strike: Strike, points: Array) -> NDArray[np.str_]:
    """Return the (P,) names of the parts of the striking plate on which points (P, 2) lie."""
    reed, (_, touched) = _plate_of(strike.geometry), lips_of_plate(strike.geometry, strike.division)
    touching = _points_of(reed.plate(strike.striker.greens), touched)
    beside = field_sites.near(points, touching, BESIDE * reed.thickness)
    words = RIM if strike.division.arcs == 1 else "beside the contact"
    return np.where(beside, words, reed.geometry().regions(points))


def plate_field(geometry: ContactGeometry, striker: Body, division: rings.Division) -> StressField:
    """Return the stress field in the face z = h/2 of the plate that strikes.

    It has the nodes at which plate theory gives a stress, farther than one thickness from sharp corners, ends of the
    clamp and contact patches, and includes elastic modes and the static response to each port's force.

    The field's body is the whole striker; `struck_by` replaces it by its elastic modes with the loads of a run.
    """
    plate = _plate_of(geometry).plate(striker.greens)
    columns = _columns(plate, *lips_of_plate(geometry, division), tuple(striker.greens.ports))
    return recovery.StressField(*columns, striker)


@lru_cache(maxsize=4)
def _columns(plate: sheets.PlateModes, lips: Lips, touched: Lips, ports: tuple[str, ...]) -> tuple[Array, Array, Array]:
    """Return the points (P, 2) of known stress [m], and there the stress (P, 6, p) under a static unit force on each
    port [Pa/N] and (P, 6, M) of each elastic mode shape [Pa/(m sqrt(kg))]; cached in the process."""
    sheet, sites = plate.sheet, field_sites.plate_nodes(plate.mesh)
    model, thickness = plate.with_ports(lips).with_ports(ports), sheet.shape.thickness
    rigid, shapes = plate.modes.omega == 0, plate.modes.shapes
    stiffness, loads, tolerance = model.K, model.port_matrix, AS_IF_HELD
    if rigid.any():  # inertia relief: rigid-body inertia balances the loads
        moving = shapes[:, rigid]
        slow = AT_REST * float(plate.modes.omega[~rigid].min())
        stiffness, loads = stiffness + slow**2 * model.M, loads - model.M @ (moving @ (moving.T @ loads))
        tolerance /= AT_REST**2  # round-off in the rigid motions, more compliant than bending by this factor
    functional = field_sites.plate_stress(plate.mesh, sheet.material, thickness, model, sites)
    solutions = (
        factorization.factorize(stiffness, tolerance=tolerance, name="K").solve(loads),
        shapes[:, ~rigid],
    )
    static, modal = (np.asarray(functional @ each).reshape(len(sites), 6, -1) for each in solutions)
    away = ~field_sites.near(sites.points, _singular(plate, touched), thickness)
    return sites.points[away], static[away], modal[away]


def struck_by(field: StressField, strike: Strike) -> StressField:
    """Return the stress field of a plate with its initial state and loads in a run."""
    return _select_elastic_modes(field, strike.forces.loaded(strike.striker, strike.pushes))


def _select_elastic_modes(field: StressField, body: Body) -> StressField:
    """Return the stress field of a plate in the elastic modes of a body."""
    greens = body.greens.modal
    assert greens is not None
    return replace(field, body=select_body_modes(body, greens.omega > 0))


def select_body_modes(body: Body, kept: NDArray[np.bool_]) -> Body:
    """Return the body with the modes chosen by a mask (M,) only, and its initial state and loads in these."""
    greens, start = body.greens.modal, body.modal_start()
    assert greens is not None
    fewer = replace(greens, omega=greens.omega[kept], zeta=greens.zeta[kept], shapes=greens.shapes[kept])
    state = ModalState(start.displacement[kept], start.velocity[kept])
    return Body(fewer, state=state, loads=tuple(replace(load, shape=load.shape[kept]) for load in body.loads))


def stresses_of_plate(reed: ThinPlate, field: StressField, found: LargestStress) -> ReedStress:
    """Return the largest von Mises stresses of a plate in the spans of a run."""
    return stress_by_spans(found.spans, lambda chosen: _peak(reed, field, found.within(chosen)))


def _peak(reed: ThinPlate, field: StressField, found: Largest) -> PeakStress:
    """Return the largest stress, its distance from the root (free plates: from the centre), and its time."""
    k, shape = int(found.von_mises.argmax()), reed.geometry()
    x, y = field.points[k] - (0.0 if shape.is_clamped else np.asarray(shape.centre))
    at = float(x if shape.is_clamped else math.hypot(x, y))
    return PeakStress(float(found.von_mises[k]), at, float(found.von_mises_time[k]))


@dataclass(frozen=True)
class PlateLook:
    """Function that computes the largest stress of a plate from the contact forces of a run.

    Attributes:
        reed: the plate.
        field: its stress field, whose body is the striker in its initial state.
        division: division of the seat's patch into parts, the ports of that body.
    """

    reed: ThinPlate
    field: StressField
    division: rings.Division

    def __call__(self, run: MarchRun, since: float) -> ReedStress:
        """Return the largest stresses, also before and after the start ``since`` of a landing [s]."""
        if not len(self.field.points):
            return UNKNOWN_STRESS
        field, pushes, dt = self.load_by_run(run)
        return stresses_of_plate(self.reed, field, recovery.largest(field, pushes, dt, since=since, workers=1))

    def load_by_run(self, run: MarchRun) -> tuple[StressField, Array, float]:
        """Return the field of the striker in a run, the forces (n + 1, ports) on its ports [N] and their step [s]."""
        forces, body = Forces.from_march(run), self.field.body
        pushes = forces.find_striker_forces(body.greens, self.division)
        return _select_elastic_modes(self.field, forces.loaded(body, pushes)), pushes, forces.dt


def _singular(plate: sheets.PlateModes, touched: Lips) -> Array:
    """Return the (k, 2) points of contact patches, ends of the clamp and sharp corners [m]."""
    ends = _ends_of_clamp(plate.mesh) if plate.sheet.shape.held_loop is None else np.zeros((0, 2))
    return np.concatenate([_points_of(plate, touched), ends, field_sites.sharp_nodes(plate.mesh)])


def _points_of(plate: sheets.PlateModes, lips: Lips) -> Array:
    """Return the (k, 2) points of contact patches [m]."""
    return np.concatenate([patch.points for patch in sheets.patches_of(plate.sheet, lips).values()])


def _ends_of_clamp(mesh: PlateMesh) -> Array:
    """Return the (2, 2) ends of the clamped line [m]; none for a free plate."""
    line = mesh.points[mesh.lines.get(plane_meshes.CLAMPED, np.zeros(0, dtype=np.int64))]
    return line[[int(line[:, 1].argmin()), int(line[:, 1].argmax())]] if len(line) else line
