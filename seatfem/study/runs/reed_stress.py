"""Stress in the faces of a plate that strikes: its largest before the first touch and since."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from impact.after.stresses import PeakStress, ReedStress
from impact.bodies.body import Body, ModalState
from impact.greens.base import Array
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.fields.corners import near, sharp_nodes
from seatfem.structures.fields.plates import plate_nodes, plate_stress
from seatfem.structures.fields.recovery import Largest, StressField, largest
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.structures.lip import AnyLip
from seatfem.structures.mesh.sheet import CLAMPED
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.rings import Division
from seatfem.structures.sheets import patches_of
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs.round import Round
from seatfem.study.scene.lips import lip_of, on_the_reed


def plate_reed_stress(done: Round) -> ReedStress | None:
    """The largest von Mises stress in the faces of the plate that strikes, ``at`` the distance from its root, of a free
    plate from its centre.

    ``None`` where no [stress] is asked for, and where `plate_field` knows none.
    """
    field = None if done.plan.scene.stress is None else plate_field(done)
    if field is None:
        return None
    found = largest(field, plate_pushes(done, done.touches), done.result.dt)
    away = np.linalg.norm(field.points, axis=1) if done.plan.scene.reed.loose else field.points[:, 0]
    after = _peak(away, found.after_contact) if np.any(done.result.force) else None
    return ReedStress(_peak(away, found.initial), after)


def plate_field(done: Round) -> StressField | None:
    """Stress in the face z = h/2 of the plate that strikes, at its nodes; the opposite in the other one.

    ``None`` of strikers that are no plates, and under loads that depend on the lift. Within one thickness of sharp
    corners, of the ends of the clamp and of what touches no stress is told: a plate has none there. Of a free plate the
    rigid motion has no part in it; what the modes left out bear at rest is that of K + s^2 M then, s half the lowest
    frequency: right to (s/w)^2 of the first mode left out.
    """
    scene, reed = done.plan.scene, done.plan.scene.reed
    greens = done.striker.greens.modal
    if not isinstance(reed, ThinPlate) or greens is None or scene.is_blown_by_lift:
        return None
    plate = reed.plate(done.striker.greens)
    model = plate.with_ports(_lips(done, reed)).with_ports(greens.ports)
    sheet, sites = plate.sheet, plate_nodes(plate.mesh)
    thickness, bends = sheet.shape.thickness, greens.omega > 0
    functional = plate_stress(plate.mesh, sheet.material, thickness, model, sites)
    modes, omega = plate.modes.shapes[:, : len(greens.omega)][:, bends], greens.omega[bends]
    shift = omega.min() / 2 if reed.loose else 0.0
    rest = factorize(model.K + shift**2 * model.M, name="K + s^2 M").solve(model.port_matrix)
    static, modal = (np.asarray(functional @ each).reshape(len(sites), 6, -1) for each in (rest, modes))
    if shift:
        static += (modal * (1 / omega**2 - 1 / (omega**2 + shift**2))) @ greens.shapes[bends]
    ends = () if reed.loose else (_ends(plate.mesh),)
    singular = np.concatenate([touched_points(done), *ends, sharp_nodes(plate.mesh)])
    field = StressField(sites.points, static, modal, _bending(done.striker))
    return field.at(~near(sites.points, singular, thickness))


def struck_by(field: StressField, striker: Body) -> StressField:
    """The field of a plate that starts or is loaded in another way."""
    return replace(field, body=_bending(striker))


def touched_points(done: Round) -> Array:
    """(k, 2) of the patches with which a plate touches [m]: the lip's, else its own; on a stopper its own, too."""
    scene, reed = done.plan.scene, done.plan.scene.reed
    assert isinstance(reed, ThinPlate)
    sheet = reed.plate(done.striker.greens).sheet
    lips = _lips(done, reed)
    touched = lips if scene.stopper is not None else lips[-1:]
    return np.concatenate([patch.points for patch in patches_of(sheet, touched).values()])


def _lips(done: Round, reed: ThinPlate) -> tuple[AnyLip, ...]:
    scene = done.plan.scene
    return reed.lips(on_the_reed(scene, lip_of(scene, Division.of(done.seat.greens).arcs)))


def _bending(striker: Body) -> Body:
    """A striker without its rigid motion."""
    greens = striker.greens.modal
    assert greens is not None
    bends = greens.omega > 0
    kept = replace(greens, omega=greens.omega[bends], zeta=greens.zeta[bends], shapes=greens.shapes[bends])
    start = striker.modal_start(greens)
    state = ModalState(start.displacement[bends], start.velocity[bends])
    return Body(kept, state=state, loads=tuple(replace(load, shape=load.shape[bends]) for load in striker.loads))


def _peak(away: Array, found: Largest) -> PeakStress:
    k = int(found.von_mises.argmax())
    return PeakStress(float(found.von_mises[k]), float(away[k]), float(found.von_mises_time[k]))


def _ends(mesh: PlateMesh) -> Array:
    """(2, 2) of the clamped line."""
    line = mesh.points[mesh.lines[CLAMPED]]
    return line[[int(line[:, 1].argmin()), int(line[:, 1].argmax())]]


def plate_pushes(done: Round, touches: Touches) -> Array:
    """(n + 1, ports) forces of a run, the round's own or one on another seat, on the striker's ports, away from the
    seat; a stopper's on the first, where the plate is touched by itself [N]."""
    greens, parts = done.striker.greens, touches.parts
    names = Division.of(done.seat.greens).names if parts is not None else ("",)
    each = touches.seat.force[:, None] if parts is None else parts.force
    force = np.zeros((len(each), len(greens.ports)))
    for name, pushed in zip(names, each.T, strict=True):
        force[:, greens.port_index(name) if name in greens.ports else 0] += pushed
    if touches.stopper_force is not None:
        force[:, 0] -= touches.stopper_force
    return force
