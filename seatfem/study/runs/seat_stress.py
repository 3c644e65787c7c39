"""Stress in the seat of a run: the largest on its surface with an error bar, and histories at named points."""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact import notices, quantities
from impact.greens.base import Array
from seatfem.pictures import rendering, stress_plot
from seatfem.structures.fields.peaks import Largest
from seatfem.structures.fields.recovery import at_time, histories, largest, von_mises
from seatfem.structures.fields.sites import local_maxima, peak_mesh_error
from seatfem.structures.fields.solids import AnyField, RingField, elements_of
from seatfem.structures.finite_elements import MESH_SAFETY
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.rings import Division
from seatfem.study.runs import seat_fields, summary
from seatfem.study.runs.round import Round
from seatfem.study.runs.stress_spots import place_words

FEWER_HARMONICS: Final = 0.75  # fraction of the harmonics in the comparison that gives their truncation error
MOST_SPOTS: Final = 20  # most hot spots of a seat
LEAST_SPOT: Final = 0.1  # least stress of a hot spot, over the largest stress


@dataclass(frozen=True)
class SeatStress:
    """Stress in the seat at P sites of its surface: peaks, hot spots and error bars.

    Attributes:
        meshes: the seat's two meshes, made when they are needed.
        known: stress on the finer mesh as a function of port forces and time step.
        waves: harmonics around a body of revolution that is struck in arcs, else ``None``.
        sites: (P, d) coordinates away from singular edges [m]; (r, z) in a half section, x, y, z if harmonics are
            summed, with stress components rr, tt, zz, tz, rz, rt in both cases.
        section: (P,) mask of the sites on the half section that is drawn.
        singular: (P,) distance to the nearest singular edge [m].
        on_lip: (P,) mask of the sites within ``stress.apart`` of the struck face.
        spots: numbers of the sites that are hot spots, the largest first.
        peak: largest stress after the first touch at each site.
        bar, tension_bar: error bars of the largest von Mises stress and of the largest tension [Pa], so far.
        time: (n + 1,) [s].
        points: (Q, 3) points that the scene names [m].
        named: (Q + 1, 6, n + 1) stress histories of these points, and of the site of the largest stress [Pa].
        snapshot: (P, 6) stress on the surface at the time of the largest stress [Pa].
        front: rho c_0 v, c_0^2 = E/rho, at the first touch [Pa]; nan without one.
        field, of_points: stress fields at all sites and at the named points, for any port forces.
        largest_at: stress field at the sites of the largest von Mises stress and of the largest tension.
        division: division of the struck patch into parts, the ports of these fields.
    """

    meshes: seat_fields.SeatMeshes
    known: seat_fields.MeshStress
    waves: seat_fields.Waves | None
    sites: Array
    section: NDArray[np.bool_]
    singular: Array
    on_lip: NDArray[np.bool_]
    spots: NDArray[np.int64]
    peak: Largest
    bar: float
    tension_bar: float
    time: Array
    points: Array
    named: Array
    snapshot: Array
    front: float
    field: AnyField
    of_points: AnyField
    largest_at: AnyField
    division: Division

    @property
    def drawn(self) -> seat_fields.SeatMesh:
        """Return the finer of the seat's meshes."""
        return self.meshes.both[0]

    @property
    def mesh(self) -> Any:
        """Return the scikit-fem mesh of the body, its half section or its sector."""
        return elements_of(self.drawn.mesh).mesh

    @property
    def model(self) -> SecondOrderModel | None:
        """Return the model on that mesh; ``None`` for a body of revolution struck in arcs, with one a harmonic."""
        return self.drawn.model if self.waves is None else None

    @property
    def named_places(self) -> Array:
        """Return the named points in the coordinates of the sites: r and z on a half section."""
        if self.sites.shape[1] == 3:
            return self.points
        return np.column_stack([np.hypot(*self.points[:, :2].T), self.points[:, 2]])

    @property
    def is_around(self) -> bool:
        """Return whether the stress components are in cylindrical coordinates."""
        return self.sites.shape[1] == 2 or isinstance(self.field, RingField)

    @property
    def where(self) -> int:
        """Return the site of the largest von Mises stress."""
        return int(self.peak.von_mises.argmax())


def seat_stress(done: Round, progress: notices.Progress = notices.silent) -> SeatStress | None:
    """Return the stress in the seat of a round; ``None`` if the scene has no [stress].

    Its error bars are truncation errors, from fewer vectors and fewer harmonics; other functions add further errors.

    Raises:
        SceneError: a named point is off the seat or at a singular edge.
    """
    scene = done.plan.scene
    if scene.stress is None:
        return None
    meshes = seat_fields.SeatMeshes(done.plan, done.seat, progress)
    dt, force = done.result.dt, seat_fields.force_by_port(done, done.touches)
    waves = seat_fields.Waves.from_forces(meshes, force)
    known = meshes.stress(waves).within(scene.stress)
    points = np.array(scene.stress.points).reshape(-1, 3)
    field, fewer = (known.field(scene.stress, waves, dt, fewer=less) for less in (False, True))
    of_points = [known.field(scene.stress, waves, dt, named=True)] if known.points else []
    peaks = largest(field, force, dt).after_contact
    worst = int(peaks.von_mises.argmax())
    both = field.at(np.array([worst, int(peaks.principal.argmax())]))
    others = [fewer.at(np.array([worst, int(peaks.principal.argmax())]))]
    if isinstance(both, RingField) and (harmonics := len(both.harmonics)) > 1:
        count = max(1, int(FEWER_HARMONICS * harmonics))
        others.append(RingField(both.section, both.angles, both.harmonics[:count]))
    bars = np.sum(
        [np.abs(_two_peaks(largest(other, force, dt).after_contact) - _two_peaks(peaks)) for other in others], axis=0
    )
    named_fields = [*of_points, both.at(np.array([0]))]
    angles = len(field.points) // len(known.to_edge)
    return SeatStress(
        meshes,
        known,
        waves,
        field.points,
        np.arange(len(field.points)) % angles == worst % angles,
        np.repeat(known.to_edge, angles),
        np.repeat(known.to_struck < scene.stress.apart * (1 - 1e-9), angles),
        local_maxima(field.points, peaks.von_mises, scene.stress.apart, least=LEAST_SPOT)[:MOST_SPOTS],
        peaks,
        float(bars[0]),
        float(bars[1]),
        done.result.time,
        points,
        np.concatenate([histories(each, force, dt) for each in named_fields]),
        at_time(field, force, dt, round(peaks.von_mises_time[worst] / dt)),
        _front(done),
        field,
        of_points[0] if of_points else field.at(np.zeros(0, dtype=np.int64)),
        both,
        Division.from_greens(done.seat.greens) if done.touches.parts is not None else Division(1, force.shape[1]),
    )


def left_by_mesh(stress: SeatStress, done: Round) -> float:
    """Return the mesh error of the largest stress [Pa]; nan if there is no coarser mesh to compare with.

    It is `MESH_SAFETY` / (r - 1) times the change from the coarser mesh (`peak_mesh_error`), r the ratio of element
    sizes; the larger change of von Mises stress and of tension counts for both.
    """
    scene, body = done.plan.scene, done.plan.scene.seat.elastic
    assert scene.stress is not None
    assert body is not None
    if body.drawn is None:
        return math.nan
    if not stress.peak.von_mises.any():
        return 0.0
    dt, force = done.result.dt, seat_fields.force_by_port(done, done.touches)
    coarse = stress.meshes.stress(stress.waves, coarser=True).within(scene.stress)
    field = coarse.field(scene.stress, stress.waves, dt)
    peaks, coarse_peaks, weight = (
        stress.peak,
        largest(field, force, dt).after_contact,
        MESH_SAFETY / (coarse.refinement - 1),
    )
    pairs = ((peaks.von_mises, coarse_peaks.von_mises), (peaks.principal, coarse_peaks.principal))
    return max(peak_mesh_error(stress.sites, fine, field.points, coarser, weight) for fine, coarser in pairs)


def _two_peaks(peaks: Largest) -> Array:
    """Return the (2,) largest von Mises stress and largest tension of all points [Pa]."""
    return np.array([peaks.von_mises.max(), peaks.principal.max()])


def stress_keys(stress: SeatStress | None) -> dict[str, object]:
    """Return for summary.json the largest stresses in the seat, with place, time, error bars and ratio to rho c_0 v."""
    if stress is None:
        return {}
    k, peak = stress.where, stress.peak
    value = float(peak.von_mises[k])
    place = [float(x) for x in stress.sites[k]]
    return {
        "peak_seat_stress_Pa": value,
        "peak_seat_stress_at_m": place,
        "peak_seat_stress_time_s": float(peak.von_mises_time[k]),
        "peak_seat_principal_stress_Pa": float(peak.principal.max()),
        "error_bar_peak_seat_stress_Pa": quantities.finite_or_none(stress.bar),
        "error_bar_peak_seat_principal_stress_Pa": quantities.finite_or_none(stress.tension_bar),
        "peak_seat_stress_over_rho_c0_v": None if math.isnan(stress.front) else value / stress.front,
    }


def peaks_under(stress: SeatStress, force: Array, dt: float) -> Largest:
    """Return the largest stress at each site under other forces (n + 1, ports) [N]; a shorter step ``dt`` [s] includes
    more of the Ritz pairs, which respond to a sharper pulse."""
    asked, known = stress.meshes.plan.scene.stress, stress.known
    waves = seat_fields.Waves.from_forces(stress.meshes, force)
    assert asked is not None
    if waves is not None and stress.waves is not None and waves.numbers != stress.waves.numbers:
        known = stress.meshes.stress(waves).within(asked)
    return largest(known.field(asked, waves, dt), force, dt).after_contact


def stress_pictures(stress: SeatStress, title: str, unsure: tuple[float, float]) -> list[rendering.Picture]:
    """Return seat_stress.png and seat_stress.vtu. ``unsure``: as in `plot_stress`."""
    k, peak = stress.where, stress.peak
    labels = [place_words(place, "seat") for place in (*stress.named_places, stress.sites[k])]
    sites = stress.sites[stress.section]
    if stress.mesh.dim() == 2:
        sites = np.column_stack([np.hypot(*sites[:, :-1].T), sites[:, -1]]) if sites.shape[1] == 3 else sites
    draw = partial(
        stress_plot.plot_stress,
        stress.mesh,
        sites,
        von_mises(stress.snapshot[stress.section]),
        stress.time,
        von_mises(np.moveaxis(stress.named, 1, 2)),
        (*labels[:-1], f"largest, {labels[-1]}"),
        at=float(peak.von_mises_time[k]),
        title=title,
        unsure=unsure,
    )
    write = partial(stress_plot.write_stress_vtu, stress.sites, peak.von_mises, peak.von_mises_time)
    return [("seat_stress.png", draw), ("seat_stress.vtu", write)]


def _front(done: Round) -> float:
    """Return rho c_0 v at the first touch [Pa], for the seat's material and the closing speed v."""
    body = done.plan.scene.seat.elastic
    assert body is not None
    solid = body.material.solid
    return summary.front_of(done.result, float(np.max(solid.young)), solid.density)
