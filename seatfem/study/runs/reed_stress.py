"""Stress in the faces of a plate that strikes: its largest before the first touch and since, with an error bar."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.after.springs import without_springs
from impact.after.stresses import PeakStress, ReedStress, stress_by_spans
from impact.bodies.body import Body, ModalState
from impact.greens.base import Array, GreensFunction
from impact.march.followed import as_marched
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.fields.corners import near, sharp_nodes
from seatfem.structures.fields.doubt import left_by_mesh
from seatfem.structures.fields.peaks import LITTLE
from seatfem.structures.fields.plates import plate_nodes, plate_stress
from seatfem.structures.fields.recovery import Largest, LargestStress, StressField, largest
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.structures.lip import AnyLip
from seatfem.structures.mesh.sheet import CLAMPED
from seatfem.structures.method import COARSENING
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.rings import Division
from seatfem.structures.sheets import ORDER, PlateModes, patches_of, plate_modes, refinement
from seatfem.study.impacts.contact import striker_of
from seatfem.study.impacts.gas import lift_of
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs.round import Round
from seatfem.study.runs.summary import front_of, reed_stress_keys
from seatfem.study.scene.lips import lip_of, on_the_reed

FEWER: Final = 0.75  # of the modes, for the error bar
OF_FEWER: Final = FEWER / (1 - FEWER)  # error of all of them over that change, where it falls like 1/modes
BESIDE: Final = 3.0  # thicknesses from what touches a plate, within which a point lies beside the contact
AT_REST: Final = 1e-2  # of the lowest frequency: what moves so slowly bends a free plate as if at rest


@dataclass(frozen=True)
class PlatePeaks:
    """The ``field`` of stress in a face of a plate under the forces of a run, and the largest at each of its points."""

    field: StressField
    found: LargestStress

    @staticmethod
    def of(done: Round, since: float | None = None) -> PlatePeaks | None:
        """Of a round whose striker is a plate, ``None`` where all of that lies beside what has no stress; ``since``:
        the time at which a landing begins [s]."""
        field = plate_field(done)
        if not len(field.points):
            return None
        return PlatePeaks(field, largest(field, plate_pushes(done, done.touches), done.result.dt, since=since))


@dataclass(frozen=True)
class PlateReedStress:
    """The largest von Mises stress in the faces of a plate, and the error ``bar`` of that after the first touch [Pa];
    nan where it is unknown. ``largest_at``: the field where it is largest; ``peaks``: at all places."""

    found: ReedStress
    bar: float
    largest_at: StressField
    peaks: PlatePeaks


def plate_reed_stress(done: Round, since: float | None = None) -> PlateReedStress | None:
    """The largest von Mises stress in the faces of the plate that strikes, ``at`` the distance from its root, or of a
    free one from its centre; ``None`` where neither [stress] nor its life is asked for, of strikers that are no
    plates, and of one so narrow that no place of it has a stress.

    Within one thickness of sharp corners, of the ends of the clamp and of what touches no stress is told: a plate has
    none there. The bar is the sum of what the coarser mesh behind the error of its Green's function changes at any
    place, by its order, and of what a quarter of the modes less change; it knows nothing of the force's own.
    ``since``: the time at which a landing begins, before and after which the stress is told apart, too [s].
    """
    scene, reed = done.plan.scene, done.plan.scene.reed
    of_life = scene.life is not None and scene.life.demand() is not None
    if (scene.stress is None and not of_life) or not has_plate(done):
        return None
    assert isinstance(reed, ThinPlate)
    plate, force, dt = reed.plate(done.striker.greens), plate_pushes(done, done.touches), done.result.dt
    if (peaks := PlatePeaks.of(done, since)) is None:
        return None
    field, found = peaks.field, peaks.found
    told = stress_by_spans(found.spans, lambda chosen: _peak(plate, field, found.within(chosen)))
    if told.after_contact is None:
        return PlateReedStress(told, math.nan, field, peaks)
    worst = field.at(np.array([int(found.after_contact.von_mises.argmax())]))
    fewer = largest(_with_fewer_modes(worst), force, dt)
    coarser = plate_modes(plate.sheet, COARSENING)
    other = striker_of(scene, greens=coarser.greens(_lips(done), reed.damping_ratio))
    there = plate_field(done, other)
    on_coarser = largest(there, force, dt).after_contact.von_mises
    weight = 1 / (refinement(plate, coarser) ** ORDER - 1)
    of_mesh = left_by_mesh(field.points, found.after_contact.von_mises, there.points, on_coarser, weight)
    peak = _value(found)
    bar = of_mesh + OF_FEWER * abs(_value(fewer) - peak) + LITTLE * peak
    return PlateReedStress(told, bar, worst, peaks)


def reed_front_keys(done: Round, found: ReedStress | None) -> dict[str, object]:
    """The largest stress after the first touch over rho c_0 v of the reed, which a front in a slender beam's free end
    bears 0.8445 of; nothing where it bears no stress that is known, ``None`` without a closing speed."""
    if found is None or found.after_contact is None:
        return {}
    face = done.plan.scene.reed.face
    front = front_of(done.result, face.young, face.density)
    return {"peak_reed_stress_over_rho_c0_v": None if math.isnan(front) else found.after_contact.value / front}


def has_plate(done: Round) -> bool:
    """Whether a plate strikes whose stress can be known."""
    return isinstance(done.plan.scene.reed, ThinPlate) and done.striker.greens.modal is not None


def plate_stress_keys(stress: PlateReedStress | None) -> dict[str, object]:
    """For summary.json: the keys that a beam's stress has, and the error bar."""
    if stress is None:
        return {}
    bar = None if math.isnan(stress.bar) else stress.bar
    landing = stress.found.after_landing
    of_landing = {} if landing is None else {"landing_peak_reed_stress_Pa": landing.value}
    bars = {f"error_bar_{key}": bar for key in ("peak_reed_stress_after_contact_Pa", *of_landing)}
    return {**reed_stress_keys(stress.found), **of_landing, **bars}


def plate_field(done: Round, striker: Body | None = None) -> StressField:
    """The stress in the face z = h/2 of the plate that strikes, at its nodes away from what has none, by its elastic
    modes and what each port's force at rest does beside them; ``striker``: the same on another mesh."""
    striker, reed = striker or done.striker, done.plan.scene.reed
    assert isinstance(reed, ThinPlate)
    plate = reed.plate(striker.greens)
    sheet, sites = plate.sheet, plate_nodes(plate.mesh)
    model, thickness = plate.with_ports(_lips(done)).with_ports(striker.greens.ports), sheet.shape.thickness
    greens, rigid = striker.greens.modal, plate.modes.omega == 0
    assert greens is not None
    shapes, moving = plate.modes.shapes, plate.modes.shapes[:, rigid]
    stiffness, loads = model.K, model.port_matrix
    if rigid.any():  # its inertia balances the loads
        slow = AT_REST * float(plate.modes.omega[~rigid].min())
        stiffness, loads = stiffness + slow**2 * model.M, loads - model.M @ (moving @ (moving.T @ loads))
    functional = plate_stress(plate.mesh, sheet.material, thickness, model, sites)
    columns = factorize(stiffness, name="K").solve(loads), shapes[:, ~rigid]
    static, modal = (np.asarray(functional @ each).reshape(len(sites), 6, -1) for each in columns)
    singular = singular_of_plate(done, plate)
    field = StressField(sites.points, static, modal, striker).at(~near(sites.points, singular, thickness))
    return struck_by(field, striker, done.touches, plate_pushes(done, done.touches))


def struck_by(field: StressField, striker: Body, touches: Touches, pushes: Array) -> StressField:
    """The field of a plate in another run: it starts otherwise, or its loads follow another lift. ``pushes``: the
    (n + 1, ports) forces of that run [N]."""
    dt = touches.seat.dt
    body = without_springs(as_marched(striker, lift_of(touches), dt), pushes, dt)
    greens = body.greens.modal
    assert greens is not None
    return replace(field, body=_of_modes(body, greens.omega > 0))


def _with_fewer_modes(field: StressField) -> StressField:
    modes = field.modal.shape[2]
    kept = np.arange(modes) < max(1, round(FEWER * modes))
    return StressField(field.points, field.static, field.modal[..., kept], _of_modes(field.body, kept))


def _of_modes(body: Body, kept: NDArray[np.bool_]) -> Body:
    """The body in some of its modes; of a translation in none of these nothing is left."""
    greens, start = body.greens.modal, body.modal_start()
    assert greens is not None
    some = replace(greens, omega=greens.omega[kept], zeta=greens.zeta[kept], shapes=greens.shapes[kept])
    state = ModalState(start.displacement[kept], start.velocity[kept])
    return Body(some, state=state, loads=tuple(replace(load, shape=load.shape[kept]) for load in body.loads))


def _value(found: LargestStress) -> float:
    return float(found.after_contact.von_mises.max())


def _peak(plate: PlateModes, field: StressField, found: Largest) -> PeakStress:
    k, shape = int(found.von_mises.argmax()), plate.sheet.shape
    x, y = field.points[k] - (0.0 if shape.is_clamped else np.asarray(shape.centre))
    at = float(x if shape.is_clamped else math.hypot(x, y))
    return PeakStress(float(found.von_mises[k]), at, float(found.von_mises_time[k]))


def _ends(mesh: PlateMesh) -> Array:
    """(2, 2) of the clamped line; none of a free plate."""
    line = mesh.points[mesh.lines.get(CLAMPED, np.zeros(0, dtype=np.int64))]
    return line[[int(line[:, 1].argmin()), int(line[:, 1].argmax())]] if len(line) else line


def singular_of_plate(done: Round, plate: PlateModes | None = None) -> Array:
    """(k, 2) points of a plate that strikes beside which its theory knows no stress [m]; ``plate``: on another mesh."""
    reed = done.plan.scene.reed
    assert isinstance(reed, ThinPlate)
    mesh = (plate or reed.plate(done.striker.greens)).mesh
    return np.concatenate([touched_points(done), _ends(mesh), sharp_nodes(mesh)])


def parts_of_plate(done: Round, points: Array) -> NDArray[np.str_]:
    """What the part of a plate that strikes is called on which each of points (P, 2) lies."""
    reed = done.plan.scene.reed
    assert isinstance(reed, ThinPlate)
    beside = near(points, touched_points(done), BESIDE * reed.thickness)
    return np.where(beside, "beside the contact", reed.geometry().regions(points))


def touched_points(done: Round) -> Array:
    """(k, 2) of the patches with which a plate touches [m]: the lip's, else its own; on a stopper its own, too."""
    reed, lips = done.plan.scene.reed, _lips(done)
    assert isinstance(reed, ThinPlate)
    touched = lips if done.plan.scene.stopper is not None else lips[-1:]
    sheet = reed.plate(done.striker.greens).sheet
    return np.concatenate([patch.points for patch in patches_of(sheet, touched).values()])


def _lips(done: Round) -> tuple[AnyLip, ...]:
    scene = done.plan.scene
    assert isinstance(scene.reed, ThinPlate)
    division = Division.of(done.seat.greens)
    return scene.reed.lips(on_the_reed(scene, lip_of(scene, division.arcs, division.rings)))


def plate_pushes(done: Round, touches: Touches) -> Array:
    """(n + 1, ports) forces of a run, the round's own or one on another seat, on the ports of its striker [N]."""
    if touches.parts is None:
        return pushes_of(done.striker.greens, touches.seat.force[:, None], Division(), touches.stopper_force)
    return pushes_of(done.striker.greens, touches.parts.force, Division.of(done.seat.greens), touches.stopper_force)


def pushes_of(greens: GreensFunction, parts: Array, division: Division, stopper: Array | None) -> Array:
    """(n + 1, ports) forces on the ports of a striker, away from the seat, by those on the parts of the seat's patch;
    a stopper's is on its first one, too [N]."""
    force = np.zeros((len(parts), len(greens.ports)))
    for name, pushed in zip(division.names, parts.T, strict=True):
        force[:, greens.port_index(name) if name in greens.ports else 0] += pushed
    if stopper is not None:
        force[:, 0] -= stopper
    return force
