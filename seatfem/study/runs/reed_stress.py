"""Stress in the faces of a plate that strikes: its largest before the first touch and since."""

from __future__ import annotations

import numpy as np

from impact.after.stresses import PeakStress, ReedStress
from impact.greens.base import Array
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.fields.corners import near, sharp_nodes
from seatfem.structures.fields.plates import plate_nodes, plate_stress
from seatfem.structures.fields.recovery import Largest, StressField, largest
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.structures.mesh.sheet import CLAMPED
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.rings import Division
from seatfem.structures.sheets import patches_of
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs.round import Round
from seatfem.study.scene.lips import lip_of, on_the_reed


def plate_reed_stress(done: Round) -> ReedStress | None:
    """The largest von Mises stress in the faces of the plate that strikes, ``at`` the distance from its root.

    ``None`` where no [stress] is asked for, and where `plate_field` knows none.
    """
    field = None if done.plan.scene.stress is None else plate_field(done)
    if field is None:
        return None
    found = largest(field, plate_pushes(done, done.touches), done.result.dt)
    after = _peak(field.points, found.after_contact) if np.any(done.result.force) else None
    return ReedStress(_peak(field.points, found.initial), after)


def plate_field(done: Round) -> StressField | None:
    """Stress in the face z = h/2 of the plate that strikes, at its nodes; the opposite in the other one.

    ``None`` of strikers that are no clamped plates, with a stopper, whose port the plate's modes do not know, and under
    loads that depend on the lift. Within one thickness of sharp corners, of the ends of the clamp and of what touches
    no stress is told: a plate has none there.
    """
    scene, reed = done.plan.scene, done.plan.scene.reed
    if not isinstance(reed, ThinPlate) or reed.loose or scene.is_blown_by_lift:
        return None
    plate, greens = reed.plate(done.striker.greens), done.striker.greens.modal
    if scene.stopper is not None or greens is None or not greens.omega.all():
        return None
    lips = reed.lips(on_the_reed(scene, lip_of(scene, Division.of(done.seat.greens).arcs)))
    model = plate.with_ports(lips).with_ports(greens.ports)
    sheet, sites = plate.sheet, plate_nodes(plate.mesh)
    thickness = sheet.shape.thickness
    functional = plate_stress(plate.mesh, sheet.material, thickness, model, sites)
    rest = factorize(model.K, name="K").solve(model.port_matrix)
    modes = plate.modes.shapes[:, : len(greens.omega)]
    static, modal = (np.asarray(functional @ each).reshape(len(sites), 6, -1) for each in (rest, modes))
    touching = np.concatenate([patch.points for patch in patches_of(sheet, lips).values()])
    singular = np.concatenate([touching, _ends(plate.mesh), sharp_nodes(plate.mesh)])
    return StressField(sites.points, static, modal, done.striker).at(~near(sites.points, singular, thickness))


def _peak(points: Array, found: Largest) -> PeakStress:
    k = int(found.von_mises.argmax())
    return PeakStress(float(found.von_mises[k]), float(points[k, 0]), float(found.von_mises_time[k]))


def _ends(mesh: PlateMesh) -> Array:
    """(2, 2) of the clamped line."""
    line = mesh.points[mesh.lines[CLAMPED]]
    return line[[int(line[:, 1].argmin()), int(line[:, 1].argmax())]]


def plate_pushes(done: Round, touches: Touches) -> Array:
    """(n + 1, ports) forces of a run on the ports of the striker, away from the seat [N]."""
    greens, parts = done.striker.greens, touches.parts
    names = Division.of(done.seat.greens).names if parts is not None else ("",)
    each = touches.seat.force[:, None] if parts is None else parts.force
    force = np.zeros((len(each), len(greens.ports)))
    for name, pushed in zip(names, each.T, strict=True):
        force[:, greens.port_index(name) if name in greens.ports else 0] += pushed
    return force
