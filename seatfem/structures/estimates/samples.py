"""Samples of the volumes, surfaces, sections and plans of shapes and of parts drawn elsewhere.

The size h grows with the distance from the patch as the mesher lets it: constant near it, then linear up to the
bulk's. A body has about c int dV/h^3 elements, a section c int dA/h^2: no mesh is needed. Shapes are sampled from
their closed forms, parts drawn elsewhere from the coarse elements that their inspection made.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Final

import numpy as np

from impact.greens.base import Array
from seatfem.structures.inspection import cad
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import Geometry, GeometryError, Profile, Shape
from seatfem.structures.shapes.profile import Edge, Point
from seatfem.structures.shapes.shape import COARSEST, OUTLINE, Distance, PlanSamples, Rectangle, side_points, squares

CHORDS = 6  # of an arc
DEPTHS = 12  # samples through the thickness, denser towards the struck side
ARC_GROWTH = 1.0  # of the size away from an arc of a section


@dataclass(frozen=True)
class Samples:
    """Places of a body, ``weight`` [m, m^2 or m^3] of it around each, at ``distance`` [m] from the struck patch.

    ``cap``: element size that something else there allows [m].
    """

    weight: Array
    distance: Array
    cap: Array | None = None

    def count(self, spec: MeshSpec, dimension: int) -> float:
        """Return int dV/h^3, int dA/h^2 or int ds/h."""
        h = size_at(self.distance, spec)
        h = h if self.cap is None else np.minimum(h, self.cap)
        count = self.weight / h
        for _ in range(dimension - 1):  # a power takes several times as long
            count /= h
        return float(np.sum(count))

    @property
    def total(self) -> float:
        """Return the volume, area or length."""
        return float(self.weight.sum())


def size_at(distance: Array, spec: MeshSpec) -> Array:
    """Return the element size [m] at distances from the patch [m]."""
    near = spec.patch_size
    return np.asarray(np.interp(distance, [near, max(near + spec.transition, 1.001 * near)], [near, spec.size]))


def from_segments(points: Array, segments: Sequence[tuple[Point, Point]]) -> Array:
    """Return the distance (n,) of points (n, 2) from the nearest of some straight segments; infinite without any."""
    nearest = np.full(len(points), np.inf)
    for start, end in segments:
        a, along = np.asarray(start), np.subtract(end, start)
        t = np.clip((points - a) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
        off = points - a - t[:, None] * along
        np.minimum(nearest, np.hypot(off[:, 0], off[:, 1]), out=nearest)
    return nearest


def inside(points: Array, outline: Array) -> Array:
    """Return whether points (n, 2) lie in a closed polygon (m, 2)."""
    x, y = points.T
    odd = np.zeros(len(points), dtype=bool)
    for (xa, ya), (xb, yb) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        crosses = (ya > y) != (yb > y)
        if crosses.any():
            odd ^= crosses & (x < xa + (y - ya) * (xb - xa) / (yb - ya if yb != ya else 1.0))
    return odd


@dataclass(frozen=True)
class Body:
    """``inner``: of a volume (of a section: its area); ``outer``: of its surface (its outline)."""

    inner: Samples
    outer: Samples


@cache
def section_of(profile: Profile) -> Body:
    """Return the half section of a solid of revolution; arcs of the outline ask for small elements beside them."""
    points, weight, outline, lengths, distance = _sampled(profile)
    return Body(
        Samples(weight, distance(points), _beside_arcs(profile, points)),
        Samples(lengths, distance(outline), _beside_arcs(profile, outline)),
    )


@cache
def plan_of(shape: Shape, sectors: int = 1) -> Body:
    """Return the plan of an extruded solid, or of one of its equal sectors."""
    (area, away), (length, beside) = _plan_part(shape, sectors)
    return Body(Samples(area, np.maximum(0.0, away)), Samples(length, np.maximum(0.0, beside)))


@cache
def solid_of(shape: Shape, sectors: int = 1) -> Body:
    """Return the solid or one of its equal sectors; `GeometryError` of one that is neither turned nor extruded."""
    profile, plan, rectangle = shape.profile, shape.plan, shape.rectangle
    if profile is not None:
        points, weight, outline, lengths, distance = _sampled(profile)
        around, along = 2 * math.pi * points[:, 0] / sectors, 2 * math.pi * outline[:, 0] / sectors
        inner, outer = (around * weight, distance(points)), (along * lengths, distance(outline))
        return Body(Samples(*inner), _joined([outer, (2 * weight, inner[1])] if sectors > 1 else [outer]))
    if plan is None:
        raise GeometryError(f"{shape.source} must be a solid of revolution or extruded for its size to be known")
    if rectangle is not None and rectangle.patch is None:
        (x, y), struck = rectangle.sides, np.zeros(1)
        whole = 4 * (x + y) / sectors + (x + y if sectors > 1 else 0.0)
        return _extruded((np.array([4 * x * y / sectors]), struck), (np.array([whole]), struck), plan.height)
    return _extruded(*_plan_part(shape, sectors), plan.height)


def _plan_part(shape: Shape, sectors: int) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return areas of a plan or its sector and lengths of its outline, each with distances from the patch."""
    rectangle = shape.rectangle
    points, weight, outline, lengths, distance = shape.plan_samples() if rectangle is None else _rectangle(rectangle)
    edge = [(lengths / sectors, distance(outline))]
    if sectors > 1:  # two rays from the centre to the edge, where the plan is; ones between all points stand for them
        radius = np.hypot(points[:, 0], points[:, 1])
        edge.append((weight / (np.pi * np.maximum(radius, float(radius.max()) / COARSEST)), distance(points)))
    length, beside = (np.concatenate(part) for part in zip(*edge, strict=True))
    return (weight / sectors, distance(points)), (length, beside)


def _extruded(plan: tuple[Array, Array], walls: tuple[Array, Array], height: float) -> Body:
    """Return areas of a plan and lengths of its outline with their distances, swept down from its plane."""
    (area, away), (length, beside) = ((weight, np.maximum(0.0, distance)) for weight, distance in (plan, walls))
    u = (np.arange(DEPTHS) + 0.5) / DEPTHS
    depth, thick = height * u**2, 2 * height * u / DEPTHS
    volume = Samples(np.outer(area, thick).ravel(), np.hypot(away[:, None], depth).ravel())
    sides = np.outer(length, thick).ravel(), np.hypot(beside[:, None], depth).ravel()
    return Body(volume, _joined([(area, away), (area, np.hypot(away, height)), sides]))


def _joined(parts: list[tuple[Array, Array]]) -> Samples:
    weight, distance = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Samples(weight, distance)


def _sampled(profile: Profile) -> tuple[Array, Array, Array, Array, Distance]:
    outline = np.concatenate([_along(edge, 1 if edge.centre is None else CHORDS)[0] for edge in profile.edges])
    struck = [edge for edge in profile.edges if edge.name == "contact"]
    segments = [segment for edge in struck for segment in _segments(edge)]

    def distance(points: Array) -> Array:
        return from_segments(points, segments)

    arcs = [segment for edge in profile.edges if edge.centre is not None for segment in _segments(edge)]
    low, high = outline.min(axis=0), outline.max(axis=0)
    corner, opposite = (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))
    centres, areas = squares(corner, opposite, lambda p: from_segments(p, segments + arcs))
    kept = inside(centres, outline)
    pieces = [_along(edge, OUTLINE, middles=True) for edge in profile.edges]
    ends, lengths = (np.concatenate(part) for part in zip(*pieces, strict=True))
    return centres[kept], areas[kept], ends, lengths, distance


def _along(edge: Edge, pieces: int, middles: bool = False) -> tuple[Array, Array]:
    """Return starts, or middles, (n, 2) of equal pieces of an edge, and their lengths."""
    t = (np.arange(pieces) + (0.5 if middles else 0.0)) / pieces
    if edge.centre is None:
        start, end = np.asarray(edge.start), np.asarray(edge.end)
        return start + np.outer(t, end - start), np.full(pieces, math.dist(edge.start, edge.end) / pieces)
    first, turn = edge.angles
    radius, angles = math.dist(edge.centre, edge.start), first + turn * t
    points = np.asarray(edge.centre) + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return points, np.full(pieces, radius * abs(turn) / pieces)


def _segments(edge: Edge) -> list[tuple[Point, Point]]:
    if edge.centre is None:
        return [(edge.start, edge.end)]
    points = [*map(tuple, _along(edge, CHORDS)[0].tolist()), edge.end]
    return list(itertools.pairwise(points))


def _beside_arcs(profile: Profile, points: Array) -> Array:
    cap = np.full(len(points), np.inf)
    for edge in profile.edges:
        if edge.centre is None:
            continue
        size = math.dist(edge.centre, edge.start) * abs(edge.angles[1]) / edge.elements
        np.minimum(cap, size + ARC_GROWTH * from_segments(points, _segments(edge)), out=cap)
    return cap


def _rectangle(rectangle: Rectangle) -> PlanSamples:
    half, patch = rectangle.sides, np.array(rectangle.patch or rectangle.sides)

    def distance(points: Array) -> Array:
        off = np.abs(points) - patch
        outside = np.maximum(0.0, off)
        return np.asarray(np.hypot(outside[:, 0], outside[:, 1]) + np.minimum(0.0, off.max(axis=1)))

    points, areas = squares((-half[0], -half[1]), half, distance)
    return points, areas, *side_points(half), distance


FEW, MANY = 4, 64  # points in an element: far from the struck faces, and near them
NEAR: Final = 1.5  # sizes of an element within which it is near
PER_TRIANGLE: Final = 16  # points on each struck triangle
BINS, CLOSEST = 300, 1e-3  # of distances, and the smallest that is told apart over the largest
FILLED: Final = 0.6  # of its bounding box, for a part that could not be filled with elements


def body_of(part: Geometry) -> Body:
    """Return the part's volume and surface by their distance from the struck faces."""
    return _body(cad.inspect_geometry(part))


@lru_cache(maxsize=4)
def _body(found: cad.Inspected) -> Body:
    shape = found.shape
    struck = _struck(shape)
    outer = _element_samples(shape, shape.triangles, shape.areas, struck)
    if not found.meshed:  # all of it as far as its middle, on average
        volume = shape.volume or FILLED * float(shape.extent.prod())
        away = cad.distances(np.mean(shape.points, axis=0)[None], struck)
        return Body(Samples(np.array([volume]), away), outer)
    corners = shape.points[shape.cells]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
    return Body(_element_samples(shape, shape.cells, volumes * (shape.volume / volumes.sum()), struck), outer)


def _struck(shape: cad.Shape) -> Array:
    """Return the points on the struck faces; of a part without any, its middle."""
    rows = shape.groups.get("contact")
    if rows is None or len(rows) == 0:
        return np.asarray(np.mean(shape.points, axis=0)[None])
    weights = np.random.default_rng(0).dirichlet(np.ones(3), PER_TRIANGLE)
    corners = shape.points[shape.triangles[rows]]
    return np.concatenate([corners.reshape(-1, 3), np.einsum("qk,nki->nqi", weights, corners).reshape(-1, 3)])


def _element_samples(shape: cad.Shape, elements: cad.Integers, measures: Array, struck: Array) -> Samples:
    """Return the points within elements, of which those near the struck faces have many: sizes change there."""
    corners = shape.points[elements]
    extent = np.linalg.norm(np.ptp(corners, axis=1), axis=1)
    near = cad.distances(corners.mean(axis=1), struck) < NEAR * extent
    weight, away = [], []
    for chosen, number in ((near, MANY), (~near, FEW)):
        inside = np.random.default_rng(1).dirichlet(np.ones(elements.shape[1]), number)
        points = np.einsum("qk,nki->nqi", inside, corners[chosen]).reshape(-1, 3)
        weight.append(np.repeat(measures[chosen] / number, number))
        away.append(cad.distances(points, struck))
    return _binned(np.concatenate(weight), np.concatenate(away))


def _binned(weight: Array, away: Array) -> Samples:
    """Return samples of like distance together: `BINS` of them count as well as all, and a plan counts often."""
    edges = np.geomspace(max(float(away.max()), 1e-9) * CLOSEST, max(float(away.max()), 1e-9), BINS)
    place = np.digitize(away, edges)
    total, first = (np.asarray(np.bincount(place, each), dtype=float) for each in (weight, weight * away))
    filled = total > 0
    return Samples(total[filled], first[filled] / total[filled])
