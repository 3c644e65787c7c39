"""Meshes of the seat for its stress, and the stress fields on them under the contact forces of a round."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any, Final

import numpy as np

from impact.greens.base import Array
from impact.notices import Progress, silent
from seatfem.structures.cache import key_of
from seatfem.structures.fields.kept_spaces import SpacesOnMesh, kept_spaces
from seatfem.structures.fields.peaks import Integers, largest
from seatfem.structures.fields.recovery import MORE, VECTORS, Response, StressField, StressSpace
from seatfem.structures.fields.sites import Sites, at_points, near, on_surface, singular_points
from seatfem.structures.fields.solids import AnyField, Harmonic, RingField, elements_of, felt, solid_stress
from seatfem.structures.finite_elements import AnyMesh, draw, matrices, refinement_of
from seatfem.structures.inspection.mesh_file import regions_of
from seatfem.structures.kinds.elastic import Elastic
from seatfem.structures.lands import FaceLip
from seatfem.structures.lip import Lip
from seatfem.structures.mesh.checks import nearest_distances
from seatfem.structures.mesh.plane_meshes import MeridianMesh
from seatfem.structures.method import BEYOND, COARSENING, Solved
from seatfem.structures.model import ModelError, SecondOrderModel
from seatfem.structures.reduction.harmonics import RingPatch, mixing_of
from seatfem.structures.rings import Division, ring_names
from seatfem.study.plan import Plan
from seatfem.study.scene.problems import Problem, SceneError
from seatfem.study.scene.run import Stress as StressTable

FIRST: Final = 4  # harmonics up to this n have a full Krylov space: the lowest frequency first falls, then rises with n
STATIC: Final = 10  # Krylov vectors per port of harmonics without natural frequencies in the band
FEWEST_ANGLES: Final = 16  # fewest angles around the axis at which stress is evaluated
ENOUGH: Final = {2: 10000, 3: 12000}
"""Elements, by dimension, that a drawn seat's mesh would have for stress if it were as fine all over; where impulse and
peak ask for 20 of a section, stress asks for hundreds."""
ON_IT: Final = 1e-6  # distance [m] from a node of the struck face within which a point counts as on it


def seat_of(plan: Plan) -> Elastic:
    """Return the seat of a plan, which has finite elements wherever its stress is asked for."""
    body = plan.scene.seat.elastic
    assert body is not None
    return body


@dataclass(frozen=True)
class SeatMesh:
    """A mesh of the seat of a plan.

    Attributes:
        plan: plan with the seat.
        mesh: mesh made by gmsh, or read from the seat's file.
        assembled: the model on the mesh, if it is assembled already.
    """

    plan: Plan
    mesh: AnyMesh
    assembled: SecondOrderModel | None = None

    @property
    def body(self) -> Elastic:
        """Return the seat."""
        return seat_of(self.plan)

    @property
    def asked(self) -> StressTable:
        """Return the table [stress] of the scene."""
        assert self.plan.scene.stress is not None
        return self.plan.scene.stress

    @property
    def singular(self) -> Array:
        """Return the (k, d) points on singular edges of the mesh [m]."""
        return singular_points(self.mesh, self.body.held)

    @property
    def struck(self) -> Array:
        """Return (k, d) points of the struck face [m]: vertices, and midpoints of edges and of facets."""
        mesh = elements_of(self.mesh).mesh
        corners = mesh.p[:, mesh.facets[:, mesh.boundaries[self.body.struck_face]]]
        pairs = [(corners[:, a] + corners[:, b]) / 2 for a, b in combinations(range(corners.shape[1]), 2)]
        return np.concatenate([*np.moveaxis(corners, 1, 0), *pairs, corners.mean(axis=1)], axis=1).T

    def named(self) -> Sites:
        """Return the sites of ``stress.points``. Raises `SceneError` if one is off the seat, or at a singular edge."""
        elements, wanted, distance = elements_of(self.mesh), self.asked.points, self.asked.distance
        points, problems = self._in_mesh_coordinates(np.array(wanted).reshape(-1, 3)), []
        close = near(points, self.singular, distance)
        for number, point in enumerate(wanted):
            message = ""
            try:
                at_points(elements, points[[number]])
            except ModelError:
                surface = on_surface(elements).points
                distances = np.linalg.norm(surface - points[number], axis=1)
                node = _in_mm(surface[int(distances.argmin())])
                message = (
                    f"{_in_mm(point)} mm lies off the seat: its nearest node, at {node} mm"
                    f"{' in (r, z)' if self.flat else ''}, is {1e3 * distances.min():.3g} mm away; name a point in the "
                    "seat or on its surface, in its own coordinates"
                )
            if close[number] and not message:
                message = (
                    f"{_in_mm(point)} mm is within stress.distance = {1e3 * distance:.4g} mm of an edge where "
                    "elastic stress has no limit: move the point away, round the edge, or lower stress.distance"
                )
            if message:
                problems.append(Problem(None, 0, f"stress.points.{number}", message))
        if problems:
            raise SceneError(tuple(problems))
        return at_points(elements, points)

    @property
    def flat(self) -> bool:
        """Return whether the mesh is a half section of a body of revolution."""
        return isinstance(self.mesh, MeridianMesh)

    def _in_mesh_coordinates(self, points: Array) -> Array:
        """Return the points in the coordinates of the mesh."""
        return np.column_stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]]) if self.flat else points

    # Stress

    def stress(self, waves: Waves, at: Array | None) -> MeshStress:
        """Return the stress at the points ``at``, ``None`` where the scene asks for named ones only, and at these, by
        the harmonics of ``waves`` if there are any."""
        return MeshStress.from_spaces(self.spaces(waves, at), self.asked, waves)

    def spaces(self, waves: Waves, at: Array | None = None) -> SpacesOnMesh:
        """Return the stress spaces at the surface, or of it only ``at`` points, and at the named points; only one set
        where the scene asks for one of the two."""
        asked, elements = self.asked, elements_of(self.mesh)
        of_surface = [on_surface(elements) if at is None else at_points(elements, at)] if asked.surface else []
        places = [*of_surface, *([self.named()] if asked.points else [])]
        by_place: list[list[StressSpace]] = [[] for _ in places]
        for n, model, response, _ in self.harmonics(waves):
            for spaces, sites in zip(by_place, places, strict=True):
                spaces.append(response.stress(self.stress_of(model, sites, n), sites.points))
        points = by_place[0][0].points
        distances = np.array([nearest_distances(points, of) for of in (self.singular, self.struck)])
        return SpacesOnMesh(tuple(map(tuple, by_place)), distances)

    def harmonics(self, waves: Waves) -> Iterator[tuple[int, SecondOrderModel, Response, Array]]:
        """Yield number, model, response and `Harmonic.mixing` of each harmonic; of `NO_WAVES` those of the only model,
        with an empty mixing."""
        if not waves.numbers:
            vectors = VECTORS + MORE * (len(self.model.ports) - 1)
            yield 0, self.model, self._response(self.model, vectors), np.zeros((0, 0, 2))
            return
        rings, slowest = waves.rings, 0.0
        for n in waves.numbers:
            model = self._matrices(harmonic=n)
            has_modes_in_band = n <= FIRST or slowest < 2 * math.pi * BEYOND * self.bandwidth
            most = VECTORS + MORE * (len(rings) - 1) if has_modes_in_band else STATIC * len(rings)
            response = self._response(model, most, resting=n > 0)
            slowest = float(response.pairs.omega.min())
            yield n, model, response, mixing_of(waves.patches, rings, n)

    def stress_of(self, model: SecondOrderModel, sites: Sites, harmonic: int = 0) -> Any:
        """Return the (6 P, n) stress at P sites per unknown of the model."""
        solids = self.body.solids(regions_of(self.mesh))
        return solid_stress(elements_of(self.mesh), solids, model, sites, harmonic=harmonic)

    @property
    def bandwidth(self) -> float:
        """Return the bandwidth of the seat's response in the plan [Hz]."""
        return bandwidth_of(self.plan)

    @cached_property
    def model(self) -> SecondOrderModel:
        """Return the model on the mesh; for a body of revolution that of harmonic 0."""
        return self.assembled or self._matrices()

    def _matrices(self, harmonic: int = 0) -> SecondOrderModel:
        method, body = self.plan.method.seat, self.body
        lip = method.lip if method.in_arcs and isinstance(method.lip, FaceLip) else None
        return matrices(body, self.mesh, body.elements_of(method), rings=method.rings or 1, harmonic=harmonic, lip=lip)

    def _response(self, model: SecondOrderModel, vectors: int, *, resting: bool = False) -> Response:
        zeta = self.body.damping_ratio
        return Response.from_model(
            model, bandwidth=self.bandwidth, damping_ratio=zeta, vectors=vectors, resting=resting
        )


@dataclass(frozen=True)
class MeshStress:
    """Stress on one mesh of a seat, for any port forces and time step.

    Attributes:
        where: stress at all surface nodes (or at the named points, if the scene asks for these only), by harmonic.
        points: stress at the points that the scene names, by harmonic.
        to_edge, to_struck: (P,) distance of each of these places from the nearest singular edge, and from the struck
            face [m].
        asked: the table [stress] of the scene.
        waves: harmonics around a body of revolution that is struck in arcs, else `NO_WAVES`.
    """

    where: tuple[StressSpace, ...]
    points: tuple[StressSpace, ...]
    to_edge: Array
    to_struck: Array
    asked: StressTable
    waves: Waves

    @staticmethod
    def from_spaces(kept: SpacesOnMesh, asked: StressTable, waves: Waves) -> MeshStress:
        """Return the stress by its spaces on a mesh."""
        where, points, (to_edge, to_struck) = kept.spaces[0], kept.spaces[-1], kept.distances
        if not asked.points:
            points = tuple(space.select_points(np.zeros(len(space.points), dtype=bool)) for space in where)
        return MeshStress(where, points, to_edge, to_struck, asked, waves)

    @property
    def angles(self) -> int:
        """Return the number of angles around the axis at which each place has a stress."""
        return len(self.waves.angles) if self.asked.surface else 1

    def within(self) -> MeshStress:
        """Return the stress at places away from singular edges and, unless ``stress.struck``, from the struck face.

        Raises:
            ModelError: no such places.
        """
        asked = self.asked
        if not asked.surface:
            return self
        counted = self.to_edge >= asked.distance * (1 - 1e-9)
        if not asked.struck:
            counted &= self.to_struck >= max(asked.distance, ON_IT) * (1 - 1e-9)
        if not counted.any():
            raise ModelError(
                f"stress: the whole surface is within stress.distance = {1e3 * asked.distance:g} mm of excluded "
                "edges and faces; make it smaller, refine seat.mesh.size, or set stress.struck = true"
            )
        where = tuple(space.select_points(counted) for space in self.where)
        return replace(self, where=where, to_edge=self.to_edge[counted], to_struck=self.to_struck[counted])

    def fields(self, dt: float, *, fewer: bool = False) -> SeatFields:
        """Return the stress fields for a time step ``dt`` [s]; ``fewer``: from fewer vectors, for the error bar."""
        surface, named = ([space.field(dt, fewer=fewer) for space in spaces] for spaces in (self.where, self.points))
        if not self.waves.numbers:
            return SeatFields(surface[0], named[0])
        points = np.array(self.asked.points).reshape(-1, 3)
        own = np.arctan2(points[:, 1], points[:, 0])[:, None]
        around = self.waves.angles[None] if self.asked.surface else own
        return SeatFields(self.waves.sum(surface, around), self.waves.sum(named, own))

    def fields_at(self, which: Integers, dt: float, *, fewer: bool = False) -> SeatFields:
        """Return `fields` with these points of the surface only, by their numbers in the whole one."""
        places, angle = np.divmod(which, self.angles)
        where = tuple(space.select_points(places) for space in self.where)
        some = replace(self, where=where, to_edge=self.to_edge[places], to_struck=self.to_struck[places])
        return some.fields(dt, fewer=fewer).at(np.arange(len(which)) * self.angles + angle)


@dataclass(frozen=True)
class SeatFields:
    """Stress fields of a seat, on its ``surface`` and at the Q points ``named`` by the scene."""

    surface: AnyField
    named: AnyField

    def at(self, which: Integers) -> SeatFields:
        """Return the fields with these points of the surface only."""
        return replace(self, surface=self.surface.at(which))

    def judged(self, force: Array, dt: float) -> Array:
        """Return the (2 + Q,) von Mises stress of the surface's first point, tension of its second one, and von Mises
        stress of the named points under forces (n + 1, ports), the largest after the first touch [Pa]."""
        of_surface, of_named = (largest(field, force, dt).after_contact for field in (self.surface, self.named))
        return np.array([of_surface.von_mises[0], of_surface.principal[1], *of_named.von_mises])


@dataclass(frozen=True)
class SeatMeshes:
    """The two meshes of a round's seat: those of its Green's function or, where these have fewer elements than `ENOUGH`
    or are not at hand, meshed again.

    Attributes:
        plan: plan of the round.
        solved: solved seat of the round.
        progress: receives the progress of meshing.
    """

    plan: Plan
    solved: Solved
    progress: Progress = silent

    @cached_property
    def run_meshes(self) -> tuple[AnyMesh, AnyMesh | None]:
        """Return the mesh of the Green's function, and one coarser by `COARSENING` unless it is read from a file."""
        body, mesh, coarser = seat_of(self.plan), self.solved.mesh, self.solved.coarser_mesh
        if mesh is None or (coarser is None and body.drawn is not None):
            return body.meshes(self.plan.method.seat, self.progress)
        return mesh, coarser

    @cached_property
    def both(self) -> tuple[SeatMesh, SeatMesh | None]:
        """Return the mesh, made finer to have about `ENOUGH` elements, and one coarser by `COARSENING`, likewise."""
        (mesh, coarser), method, body = self.run_meshes, self.plan.method.seat, seat_of(self.plan)
        if body.drawn is not None and self.finer > 1:
            spec = body.drawn.mesh_spec(method)
            method = replace(method, size=spec.size / self.finer, contact_size=spec.patch_size / self.finer)
            mesh, coarser = body.meshes(method, self.progress)
        known = self.solved.model if mesh is self.solved.mesh else None
        return SeatMesh(self.plan, mesh, known), None if coarser is None else SeatMesh(self.plan, coarser)

    def stress(self, waves: Waves) -> MeshStress:
        """Return the stress on the finer mesh, by the harmonics of ``waves`` if there are any; what is on file needs no
        mesh."""
        plan = self.plan
        asked = plan.scene.stress
        assert asked is not None
        content = {
            "seat": key_of(seat_of(plan), plan.method.seat),
            "band": bandwidth_of(plan),
            "elements": list(ENOUGH.values()),
            "at": [asked.surface, [list(point) for point in asked.points]],
            "harmonics": waves.numbers or None,
        }
        return MeshStress.from_spaces(kept_spaces(content, lambda: self.both[0].spaces(waves)), asked, waves)

    @property
    def finer(self) -> float:
        """Return the element size of the Green's function over that of the stress, at least 1."""
        mesh, dim = self.run_meshes[0], elements_of(self.run_meshes[0]).mesh.dim()
        return float(max(1.0, (ENOUGH[dim] / mesh.quality.elements) ** (1 / dim)))

    @property
    def refinement(self) -> float:
        """Return the ratio of their element sizes."""
        fine, coarse = self.both
        assert coarse is not None
        return refinement_of(fine.mesh, coarse.mesh)


def bandwidth_of(plan: Plan) -> float:
    """Return the bandwidth of the response of the seat of a plan [Hz]."""
    return plan.method.seat.bandwidth or 1 / plan.scene.run.filter_width


@dataclass(frozen=True)
class Waves:
    """Fourier harmonics around a body of revolution that is struck on arcs of its ring.

    Attributes:
        patches: struck patch of each port.
        numbers: circumferential orders of the harmonics; none of a body that is not solved by them.
        angles: (A,) angles around the axis at which stress is evaluated [rad].
    """

    patches: dict[str, RingPatch]
    numbers: list[int]
    angles: Array

    @property
    def rings(self) -> list[str]:
        """Return the names of the rings that are struck."""
        return list(dict.fromkeys(patch.boundary for patch in self.patches.values()))

    def sum(self, fields: Sequence[StressField], angles: Array) -> RingField:
        """Return the sum of the fields of the harmonics at their G places, at angles (G, A) or (1, A) [rad]."""
        points, mixings = fields[0].points, (mixing_of(self.patches, self.rings, n) for n in self.numbers)
        parts = tuple(map(Harmonic, self.numbers, fields, mixings))
        return RingField(points, np.broadcast_to(angles, (len(points), angles.shape[-1])), parts)

    @staticmethod
    def from_forces(seat: SeatMeshes, force: Array) -> Waves:
        """Return the harmonics of a seat that forces (n + 1, ports) excite; `NO_WAVES` of one not solved by harmonics.

        Their wavelength around the ring is at least two elements of the struck face in the mesh of the round.
        """
        method, body = seat.plan.method.seat, seat_of(seat.plan)
        if body.elements_of(method) != "harmonics" or not isinstance(drawn := seat.run_meshes[0], MeridianMesh):
            return NO_WAVES
        faces, lip, mesh = ring_names("contact", method.rings or 1), method.lip, elements_of(drawn).mesh
        if method.in_arcs and isinstance(lip, Lip):
            turns, width = [float(angle) for angle in lip.angles], 2 * math.pi / lip.arcs
        else:
            turns, width = [0.0], body.struck_arc or 2 * math.pi
        names = Division(len(turns), len(faces)).names
        patches = [RingPatch(turn, width, face) for turn in turns for face in faces]
        by_port = dict(zip(names, patches, strict=True))
        ends = mesh.p[:, mesh.facets[:, mesh.boundaries[body.struck_face]]]
        size = float(np.hypot(*(ends[:, 1] - ends[:, 0])).mean())
        numbers = felt(by_port, force, max(1, int(math.pi * float(ends[0].mean()) / size)))
        arcs, wanted = len(turns), max(2 * numbers[-1] + 1, FEWEST_ANGLES if numbers[-1] else 1)
        count = arcs * math.ceil(wanted / arcs) if numbers[-1] else 1
        angles = turns[0] + 2 * math.pi * np.arange(count) / count
        return Waves(by_port, numbers, angles)


NO_WAVES: Final = Waves({}, [], np.zeros(1))


def check_stress(plan: Plan, progress: Progress) -> None:
    """Raise `SceneError` for named points that are off the seat or at a singular edge; a seat that is drawn is meshed
    coarser by `COARSENING` for it."""
    if plan.scene.stress is None or not plan.scene.stress.points:
        return
    body, method = seat_of(plan), plan.method.seat
    if (drawn := body.drawn) is not None:
        spec, level = drawn.mesh_spec(method), drawn.elements_of(method)
        spec = replace(spec, size=COARSENING * spec.size, contact_size=COARSENING * spec.patch_size)
        mesh = draw(drawn, spec, level, method, progress)
    else:
        mesh = body.meshes(method, progress)[0]
    SeatMesh(plan, mesh).named()


def _in_mm(point: Sequence[float] | Array) -> str:
    return "(" + ", ".join(f"{1e3 * x:.4g}" for x in point) + ")"
