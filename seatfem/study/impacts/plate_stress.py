"""Stress in the faces of a plate that strikes: its field, and the largest stress under the forces of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from impact.after.histories import PeakStress, ReedStress, stress_by_spans
from impact.after.loads import without_springs
from impact.bodies.body import Body, ModalState
from impact.greens.base import Array, GreensFunction
from impact.march.rows import MarchRun
from impact.march.stepper import with_recorded_loads
from seatfem.structures import lip, rings, sheets
from seatfem.structures.fields import recovery
from seatfem.structures.fields import sites as field_sites
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.structures.mesh import plane_meshes
from seatfem.structures.reduction import factorization
from seatfem.study.impacts import touches
from seatfem.study.scene import ContactGeometry
from seatfem.study.scene.lips import STOPPER

if TYPE_CHECKING:
    from seatfem.structures import sheets
    from seatfem.structures.elements.mindlin import PlateMesh
    from seatfem.structures.fields.recovery import Largest, LargestStress, StressField

AT_REST: Final = 1e-2  # frequency at which a free plate is solved for its static bending, over its lowest frequency
AS_IF_HELD: Final = 1e-8  # relative residual of a first solve of a plate that is held


@dataclass(frozen=True)
class _Columns:
    """Stress of a plate at P points, for a static force on each port and for each elastic mode.

    Attributes:
        points: (P, 2) coordinates [m].
        static: (P, 6, p) stress under a static unit force on each port [Pa/N].
        modal: (P, 6, M) stress of each elastic mode shape [Pa/(m sqrt(kg))].
    """

    points: Array
    static: Array
    modal: Array


@dataclass(frozen=True)
class PlatePeaks:
    """The stress ``field`` in a face of a plate under the forces of a run, and the largest stress at each point."""

    field: StressField
    found: LargestStress


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


def has_plate_stress(reed: Structure, striker: Body) -> bool:
    """Return whether the striker is a plate with modes, from which its stress follows."""
    return reed.thin_plate is not None and striker.greens.modal is not None


def lips_of_plate(geometry: ContactGeometry, division: rings.Division) -> tuple[lip.AnyLip, ...]:
    """Return the contact patches on the striking plate: its own face, the stopper's, the seat's lip by `division`."""
    seat = geometry.on_the_reed(geometry.lip(division.arcs, division.rings))
    return _plate_of(geometry).lips(seat, geometry.behind_the_reed())


def _plate_of(geometry: ContactGeometry) -> ThinPlate:
    """Return the plate that strikes."""
    assert geometry.reed.thin_plate is not None
    return geometry.reed.thin_plate


def _touching_lips(geometry: ContactGeometry, division: rings.Division) -> tuple[lip.AnyLip, ...]:
    """Return the patches of `lips_of_plate` that are in contact: those of seat and stopper, for which its own stands
    in."""
    own, *others = lips_of_plate(geometry, division)
    behind = [each for each in others if each.side]
    if geometry.stopper is not None and not behind:
        behind = [own]
    return (*behind, *([each for each in others if not each.side] or [own]))


def touched_points(geometry: ContactGeometry, greens: GreensFunction, division: rings.Division) -> Array:
    """Return the (k, 2) points of a plate's contact patches [m]."""
    return _points_of(_plate_of(geometry).plate(greens), _touching_lips(geometry, division))


def singular_points(geometry: ContactGeometry, greens: GreensFunction, division: rings.Division) -> Array:
    """Return the (k, 2) points near which plate theory gives no stress in the striking plate [m]."""
    return _singular(_plate_of(geometry).plate(greens), _touching_lips(geometry, division))


def plate_field(geometry: ContactGeometry, striker: Body, division: rings.Division) -> StressField:
    """Return the stress field in the face z = h/2 of the plate that strikes.

    It has the nodes at which plate theory gives a stress, farther than one thickness from sharp corners, ends of the
    clamp and contact patches, and includes elastic modes and the static response to each port's force.

    The field's body is the whole striker; `struck_by` replaces it by its elastic modes with the loads of a run.
    """
    plate = _plate_of(geometry).plate(striker.greens)
    lips, touched = lips_of_plate(geometry, division), _touching_lips(geometry, division)
    columns = _columns(_Plate(plate, lips, touched, tuple(striker.greens.ports)))
    return recovery.StressField(columns.points, columns.static, columns.modal, striker)


@dataclass(frozen=True, eq=False)
class _Plate:
    """A plate with its contact patches and ports, by which its stress is cached."""

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
def _columns(key: _Plate) -> _Columns:
    """Return the stress of a plate by modes and ports; cached in the process."""
    plate = key.plate
    sheet, sites = plate.sheet, field_sites.plate_nodes(plate.mesh)
    model, thickness = plate.with_ports(key.lips).with_ports(key.ports), sheet.shape.thickness
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
    away = ~field_sites.near(sites.points, _singular(plate, key.touched), thickness)
    return _Columns(sites.points[away], static[away], modal[away])


def struck_by(field: StressField, striker: Body, opening: Array, pushes: Array, dt: float) -> StressField:
    """Return the stress field of a plate with its initial state and loads in a run. ``opening``: (n + 1,) mean gap at
    the seat [m], for loads that depend on it; ``pushes``: (n + 1, ports) forces on its ports [N]; ``dt``: time step
    [s]."""
    body = without_springs(with_recorded_loads(striker, opening, dt), pushes, dt)
    greens = body.greens.modal
    assert greens is not None
    return replace(field, body=in_some_modes(body, greens.omega > 0))


def in_some_modes(body: Body, kept: NDArray[np.bool_]) -> Body:
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

    def __call__(self, run: MarchRun, since: float | None) -> ReedStress | None:
        """Return the largest stresses, also before and after the start ``since`` of a landing [s]."""
        if not len(self.field.points):
            return None
        forces, body = Forces.from_march(run), self.field.body
        pushes = forces.pushes(body.greens, self.division)
        field = struck_by(self.field, body, run.opening, pushes, forces.dt)
        return stresses_of_plate(self.reed, field, recovery.largest(field, pushes, forces.dt, since=since, workers=1))


@dataclass(frozen=True)
class Forces:
    """Contact forces of one run.

    Attributes:
        parts: (n + 1, parts) force on each part of the seat's patch [N].
        division: division of the patch into these parts.
        stopper: forces on the parts of the stopper's patch; ``None`` without one.
        dt: time step [s].
    """

    parts: Array
    division: rings.Division
    stopper: Forces | None
    dt: float

    @staticmethod
    def from_march(run: MarchRun) -> Forces:
        """Return the contact forces of a run."""
        problem, seats = run.problem, touches.seat_contacts(run.problem)
        parts, above = run.force[:, :seats], run.force[:, seats:]
        division = rings.Division.from_greens(problem.target.greens) if parts.shape[1] > 1 else rings.Division()
        of_stopper = _behind(problem.striker.greens)
        if of_stopper.count == 1:  # met at one port, in however many parts
            above = above.sum(axis=1, keepdims=True)
        behind = Forces(above, of_stopper, None, run.dt) if problem.contacts[seats:] else None
        return Forces(parts, division, behind, run.dt)

    def by(self, wanted: rings.Division) -> Array:
        """Return the (n + 1, parts) forces on the parts of another division, for uniform pressure on each part [N]."""
        own = self.division
        if own == wanted:
            return self.parts
        across = overlaps(rings.ring_borders(own.rings), rings.ring_borders(wanted.rings))
        along = overlaps(np.linspace(0, 1, own.arcs + 1), np.linspace(0, 1, wanted.arcs + 1))
        parts = self.parts.reshape(-1, own.arcs, own.rings)
        return np.asarray(np.einsum("nar,ab,rc->nbc", parts, along, across, optimize=True)).reshape(len(parts), -1)

    def pushes(self, greens: GreensFunction, division: rings.Division) -> Array:
        """Return the (n + 1, ports) forces on the ports of a striker, away from the seat [N]; ``division``: of the
        seat's patch there."""
        force = np.zeros((len(self.parts), len(greens.ports)))
        for name, pushed in zip(division.names, self.by(division).T, strict=True):
            force[:, greens.port_index(name) if name in greens.ports else 0] += pushed
        if self.stopper is not None:
            behind = _behind(greens)
            for name, pushed in zip(behind.names, self.stopper.by(behind).T, strict=True):
                port = STOPPER + name
                force[:, greens.port_index(port) if port in greens.ports else 0] -= pushed
        return force


def _behind(greens: GreensFunction) -> rings.Division:
    """Return the division of the stopper's patch by the ports of a striker; undivided where it has none for it."""
    names = tuple(name.removeprefix(STOPPER) for name in greens.ports if name.startswith(STOPPER))
    return rings.Division.from_names(names or rings.Division().names)


def overlaps(have: Array, wanted: Array) -> Array:
    """Return the (h, w) fraction of each of h intervals that lies in each of w others; edges (h + 1,) and (w + 1,)."""
    low = np.maximum(have[:-1, None], wanted[None, :-1])
    high = np.minimum(have[1:, None], wanted[None, 1:])
    return np.asarray(np.maximum(high - low, 0.0) / np.diff(have)[:, None])


def _singular(plate: sheets.PlateModes, touched: tuple[lip.AnyLip, ...]) -> Array:
    """Return the (k, 2) points of contact patches, ends of the clamp and sharp corners [m]."""
    ends = _ends_of_clamp(plate.mesh) if plate.sheet.shape.held_loop is None else np.zeros((0, 2))
    return np.concatenate([_points_of(plate, touched), ends, field_sites.sharp_nodes(plate.mesh)])


def _points_of(plate: sheets.PlateModes, lips: tuple[lip.AnyLip, ...]) -> Array:
    """Return the (k, 2) points of contact patches [m]."""
    return np.concatenate([patch.points for patch in sheets.patches_of(plate.sheet, lips).values()])


def _ends_of_clamp(mesh: PlateMesh) -> Array:
    """Return the (2, 2) ends of the clamped line [m]; none for a free plate."""
    line = mesh.points[mesh.lines.get(plane_meshes.CLAMPED, np.zeros(0, dtype=np.int64))]
    return line[[int(line[:, 1].argmin()), int(line[:, 1].argmax())]] if len(line) else line
