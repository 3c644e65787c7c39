"""Stress in the seat of a run: the largest on its surface with an error bar, and histories at named points."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from impact import notices, quantities
from impact.greens.base import Array
from seatfem.pictures import frames, skins
from seatfem.structures.errors import ModelError
from seatfem.structures.fields.peaks import BETWEEN, Largest
from seatfem.structures.fields.recovery import histories, largest, response_in_frames, von_mises
from seatfem.structures.fields.sites import at_nodes, local_maxima, near
from seatfem.structures.fields.solids import AnyField, RingField, elements_of, turned
from seatfem.structures.finite_elements import MESH_SAFETY
from seatfem.structures.model import SecondOrderModel
from seatfem.study.impacts.forces import Strike
from seatfem.study.runs import kept, seat_fields, summary
from seatfem.study.runs.body_stress import COMPONENTS, FieldStress, Histories, History, Spot, rows_of
from seatfem.study.runs.round import Round

FEWER_HARMONICS: Final = 0.75  # fraction of the harmonics in the comparison that gives their truncation error
NEAREST: Final = 6  # sites at and beside a place at which its mesh error is estimated
LIVES: Final = 12  # hot spots of the surface whose life is computed
MOST_SPOTS: Final = 20  # most hot spots of a seat
LEAST_SPOT: Final = 0.1  # least stress of a hot spot, over the largest stress
PASSES: Final = 2  # duration of the frames of its wave, in travel times of a shear wave along the seat
AROUND: Final = ("rr", "tt", "zz", "tz", "rz", "rt")  # stress components of a body of revolution
LIP: Final = "lip"


@dataclass(frozen=True)
class SeatStress(FieldStress):
    """Stress in the seat at P sites of its surface: peaks, hot spots and error bars.

    Attributes:
        meshes: the seat's two meshes, made when they are needed.
        known: stress on the finer mesh as a function of port forces and time step.
        sites: (P, d) coordinates away from singular edges [m]; (r, z) in a half section, x, y, z if harmonics are
            summed, with stress components rr, tt, zz, tz, rz, rt in both cases.
        singular: (P,) distance to the nearest singular edge [m].
        on_lip: (P,) mask of the sites within ``stress.apart`` of the struck face.
        spots: numbers of the sites that are hot spots, the largest first.
        peak: largest stress after the first touch at each site.
        judged: (2 + Q,) largest von Mises stress, largest tension, largest von Mises stress at each named point [Pa].
        bars: their error bars at the same places, so far [Pa].
        by_key: parts of the first bar, by the key or the model that leaves them [Pa]; empty so far.
        points: (Q, 3) points that the scene names [m].
        named: (Q + 1, 6, n + 1) stress histories of these points, and of the site of the largest stress [Pa].
        front: rho c_0 v, c_0^2 = E/rho, at the first touch [Pa]; nan without one.
        worst: fields at the sites of the largest von Mises stress and of the largest tension, and at the named points.
    """

    role: ClassVar[str] = "seat"
    each: ClassVar[int] = LIVES

    meshes: seat_fields.SeatMeshes
    known: seat_fields.MeshStress
    sites: Array
    singular: Array
    on_lip: NDArray[np.bool_]
    spots: NDArray[np.int64]
    peak: Largest
    judged: Array
    bars: Array
    points: Array
    named: Array
    front: float
    worst: seat_fields.SeatFields
    by_key: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @property
    def force(self) -> Array:
        return self.strike.on_seat

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
        return None if self.known.waves.numbers else self.drawn.model

    @property
    def components(self) -> tuple[str, ...]:
        """Return the names of the stress components, of a body of revolution in cylindrical coordinates."""
        return AROUND if self.sites.shape[1] == 2 or isinstance(self.field, RingField) else COMPONENTS

    @property
    def regions(self) -> NDArray[np.str_]:
        """Return one name, of the surface, for all points."""
        return np.full(len(self.sites), "")

    @property
    def relative_bar(self) -> float:
        return self.bar / float(self.peak.von_mises.max()) if math.isfinite(self.bar) else math.nan

    def under(self, strike: Strike) -> SeatStress:
        return replace(self, strike=strike)

    def histories(self, first: int) -> Histories:
        """Yield those of the surface, then those of the points that the scene names."""
        yield from super().histories(first)
        yield from self._named_histories(self.worst.named, np.full(len(self.points), ""))

    def hot_spots(self, stride: int) -> tuple[tuple[Spot, ...], tuple[History, ...]]:
        """Return all hot spots, and histories at the largest on the lip and elsewhere and at named points."""
        parts, touches = np.where(self.on_lip[self.spots], LIP, "body"), self.strike.touches
        times = self.peak.von_mises_time[self.spots]
        spots = self.spots_at(self.spots, parts, self.singular[self.spots], times)
        first = np.sort(np.unique(parts, return_index=True)[1])
        histories = self.histories_at(self.spots[first], [spots[k] for k in first], stride)
        for point, stress in zip(self.worst.named.points, self.named[:-1], strict=True):
            histories.append(History.at_peak(self.role, "named", point, stress, touches, self.components, stride))
        return spots, tuple(histories)

    def map_to_skin(self, values: Array) -> tuple[skins.Skin, Array]:
        """Return the surface as `FieldStress.map_to_skin`; of harmonics all around the ring."""
        nodes = elements_of(self.mesh).nodes
        if not isinstance(self.field, RingField):
            assert self.model is not None
            skin = skins.skin_of(self.model)
            on_nodes = np.full(len(skin.nodes), np.nan)
            on_nodes[rows_of(self.field.points, nodes.T[skin.nodes])] = values
            return skin, on_nodes
        around = self.field.angles[0]
        closed = np.append(around, around[0] + 2 * np.pi)
        skin = skins.skin_of_section(self.mesh, nodes[0], nodes[1], closed).spread()
        assert skin.angles is not None
        on_nodes = np.full((nodes.shape[1], len(around)), np.nan)
        on_nodes[rows_of(self.field.section, nodes.T)] = values.reshape(self.field.angles.shape)
        turns = np.round((skin.angles - around[0]) / (2 * np.pi) * len(around)).astype(np.int64) % len(around)
        return skin, on_nodes[skin.nodes, turns]

    @property
    def wave_span(self) -> tuple[float, float]:
        touch, extent = self.strike.touches.touch, float(np.ptp(self.mesh.p, axis=1).max())
        return touch, touch + PASSES * extent / self.drawn.body.slowest

    def wave(self, steps: range) -> frames.Frames:
        """Return the stress wave on the mesh of the stress: harmonics are summed one by one to save memory."""
        elements, drawn = elements_of(self.mesh), self.drawn
        if self.model is None:
            skin = skins.skin_of_section(elements.mesh, *elements.nodes).spread()
        else:
            skin = skins.skin_of(self.model)
        nodes, which = np.unique(skin.nodes, return_inverse=True)
        sites = at_nodes(elements, nodes)
        tensors, moved = np.zeros((len(steps), len(which), 6)), np.zeros((len(steps), len(which), 3))
        around, force = None if self.model is not None else skin.angles, self.force
        for n, model, response, mixing in drawn.harmonics(self.known.waves):
            functional = drawn.stress_of(model, sites, n)
            for by_sin in (False, True)[: 2 if n else 1]:
                pushes = force if around is None else force @ mixing[:, :, int(by_sin)]
                unknowns = response_in_frames(response, pushes, self.dt, steps)
                stress = np.asarray(functional @ unknowns.T).reshape(len(sites), 6, -1)
                for frame, each in enumerate(unknowns):
                    for sums, part in (
                        (tensors, stress[which, :, frame]),
                        (moved, model.expand(each)[:, skin.nodes].T),
                    ):
                        sums[frame] += part if around is None else turned(part, around, n, by_sin=by_sin)
        known = ~near(elements.nodes.T[skin.nodes], drawn.singular, drawn.asked.distance)
        time, mises = self.strike.touches.seat.time[list(steps)], von_mises(tensors)
        touch = self.strike.touches.touch
        return frames.wave_frames("Stress wave in the seat", skin, mises, moved, time, touch, known)

    @property
    def bar(self) -> float:
        """Return the error bar of the largest von Mises stress, at its own place [Pa]."""
        return float(self.bars[0])

    @property
    def from_excluded(self) -> float:
        """Return the distance of the largest von Mises stress from sharp edges and, where it is left out, from the
        struck face [m]."""
        struck = math.inf if self.known.asked.struck else float(self.known.to_struck[self.where // self.known.angles])
        return min(float(self.singular[self.where]), struck)

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
    strike, solid = done.strike, seat_fields.seat_of(done.plan).material.solid
    dt, force = strike.dt, strike.on_seat
    waves = seat_fields.Waves.from_forces(meshes, force)
    known = meshes.stress(waves).within()
    fields, angles = known.fields(dt), known.angles
    field = fields.surface

    def find_peaks() -> Array:
        return np.array([*vars(largest(field, force, dt).after_contact).values()])

    what = "largest stress at the points of a seat"
    peaks = Largest(*kept.cached_array(done, done.touches, what, field.points, find_peaks))
    places = places_of(peaks)
    at_worst = fields.at(places)
    judged, others = at_worst.judged(force, dt), [known.fields_at(places, dt, fewer=True)]
    if isinstance(field, RingField) and len(field.harmonics) > 1:
        others.append(seat_fields.SeatFields(*map(_with_fewer, (at_worst.surface, at_worst.named))))
    bars = sum((np.abs(each.judged(force, dt) - judged) for each in others), BETWEEN * judged)
    shown = [each for each in (at_worst.named, at_worst.surface.at(np.array([0]))) if len(each.points)]
    return SeatStress(
        strike,
        field,
        meshes,
        known,
        field.points,
        np.repeat(known.to_edge, angles),
        np.repeat(known.to_struck < scene.stress.apart * (1 - 1e-9), angles),
        local_maxima(field.points, peaks.von_mises, scene.stress.apart, least=LEAST_SPOT)[:MOST_SPOTS],
        peaks,
        judged,
        bars,
        np.array(scene.stress.points).reshape(-1, 3),
        np.concatenate([histories(each, force, dt) for each in shown]),
        summary.front_of(done.result, float(np.max(solid.young)), solid.density),
        at_worst,
    )


def places_of(peaks: Largest) -> NDArray[np.int64]:
    """Return the sites of the largest von Mises stress and of the largest tension."""
    return np.array([peaks.von_mises.argmax(), peaks.principal.argmax()])


def _with_fewer(field: AnyField) -> AnyField:
    """Return a field with `FEWER_HARMONICS` of its harmonics."""
    assert isinstance(field, RingField)
    return replace(field, harmonics=field.harmonics[: max(1, int(FEWER_HARMONICS * len(field.harmonics)))])


def left_by_mesh(stress: SeatStress) -> Array:
    """Return the mesh errors (2 + Q,) of `SeatStress.judged` [Pa]; nan if there is no coarser mesh to compare with.

    They are `MESH_SAFETY` / (r - 1) times the change from the coarser mesh, r the ratio of element sizes: its root mean
    square at the same places and the sites beside them, `NEAREST` altogether, as one may be small by accident.
    """
    unknown, peak, sites = np.full(len(stress.judged), math.nan), stress.peak, stress.sites
    if (coarse := stress.meshes.both[1]) is None:
        return unknown
    if not peak.von_mises.any():
        return np.zeros(len(stress.judged))
    beside = cKDTree(sites).query(sites[places_of(peak)], k=min(NEAREST, len(sites)))[1].reshape(2, -1)
    try:
        found, named = stress_on(coarse, stress, beside.ravel(), stress.force, stress.dt)
    except ModelError:  # a place lies between a chord of the coarser mesh and the surface
        return unknown
    pairs = ((found.von_mises, peak.von_mises), (found.principal, peak.principal))
    of_spots = [_rms(other.reshape(2, -1)[k] - own[beside[k]]) for k, (other, own) in enumerate(pairs)]
    return MESH_SAFETY / (stress.meshes.refinement - 1) * np.array([*of_spots, *np.abs(named - stress.judged[2:])])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def stress_on(
    mesh: seat_fields.SeatMesh, stress: SeatStress, which: NDArray[np.int64], force: Array, dt: float
) -> tuple[Largest, Array]:
    """Return the largest stress at the sites ``which``, and the von Mises stress at the named points, on another mesh
    of the seat, under forces (n + 1, ports) [N] in steps ``dt`` [s]. Raises `ModelError` where that holds no site."""
    on_section, angles = None, stress.known.angles
    if stress.known.asked.surface:
        on_section = stress.known.where[0].points[which // angles]
        which = np.arange(len(which)) * angles + which % angles
    fields = mesh.stress(stress.known.waves, at=on_section).fields(dt)
    on_surface, named = (largest(each, force, dt).after_contact for each in (fields.surface.at(which), fields.named))
    return on_surface, named.von_mises


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
        "error_bar_peak_seat_stress_Pa": quantities.finite_or_none(stress.bars[0]),
        "error_bar_peak_seat_principal_stress_Pa": quantities.finite_or_none(stress.bars[1]),
        "peak_seat_stress_over_rho_c0_v": None if math.isnan(stress.front) else value / stress.front,
        "seat_stress_at_points": [
            {"at_m": list(map(float, at)), "von_mises_Pa": float(own), "error_bar_Pa": quantities.finite_or_none(bar)}
            for at, own, bar in zip(stress.points, stress.judged[2:], stress.bars[2:], strict=True)
        ],
    }


def judged_under(stress: SeatStress, force: Array, dt: float, *, anew: bool = False) -> Array:
    """Return `SeatStress.judged` at the same places under other forces (n + 1, ports) [N]; ``anew``: by a field for the
    step ``dt`` [s], as a shorter one includes more of the Ritz pairs, which respond to a sharper pulse."""
    if not anew:
        return stress.worst.judged(force, dt)
    known, waves = stress.known, seat_fields.Waves.from_forces(stress.meshes, force)
    if waves.numbers != known.waves.numbers:
        known = stress.meshes.stress(replace(waves, angles=known.waves.angles)).within()
    return known.fields_at(places_of(stress.peak), dt).judged(force, dt)
