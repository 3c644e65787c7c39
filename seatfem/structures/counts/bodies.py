"""Samples of the volumes, surfaces and sections of all families of seats, from their closed forms."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from impact.greens.base import Array
from seatfem.structures.counts.size_field import COARSEST, Distance, Samples, from_segments, inside, squares
from seatfem.structures.shapes import AnnularSeat, Bar, Block, ConicalSeat, Profile, Stopper, ValvePlate
from seatfem.structures.shapes.profile import Edge, Point

Drawn = AnnularSeat | ConicalSeat | Stopper | ValvePlate | Bar | Block
CHORDS = 6  # of an arc
OUTLINE = 60  # samples of a straight edge
DEPTHS = 12  # samples through the thickness, denser towards the struck side
PER_ARC, ARC_GROWTH = 2, 1.0  # elements on an arc of a section, and growth of the size away from it


@dataclass(frozen=True)
class Body:
    """``inner``: of a volume (of a section: its area); ``outer``: of its surface (its outline)."""

    inner: Samples
    outer: Samples


@cache
def section_of(profile: Profile) -> Body:
    """The half section of a solid of revolution; arcs of the outline ask for small elements beside them."""
    points, weight, outline, lengths, distance = _sampled(profile)
    return Body(
        Samples(weight, distance(points), _beside_arcs(profile, points)),
        Samples(lengths, distance(outline), _beside_arcs(profile, outline)),
    )


@cache
def plan_of(geometry: ValvePlate | Stopper, sectors: int = 1) -> Body:
    """The plan of an extruded solid, or of one of its equal sectors."""
    (area, away), (length, beside) = _plan_part(geometry, sectors)
    return Body(Samples(area, np.maximum(0.0, away)), Samples(length, np.maximum(0.0, beside)))


@cache
def solid_of(geometry: Drawn, sectors: int = 1) -> Body:
    """The solid or one of its equal sectors."""
    if isinstance(geometry, AnnularSeat | ConicalSeat | Stopper):
        points, weight, outline, lengths, distance = _sampled(geometry.profile)
        around, along = 2 * math.pi * points[:, 0] / sectors, 2 * math.pi * outline[:, 0] / sectors
        inner, outer = (around * weight, distance(points)), (along * lengths, distance(outline))
        return Body(Samples(*inner), _joined([outer, (2 * weight, inner[1])] if sectors > 1 else [outer]))
    if isinstance(geometry, Bar):
        end, struck = geometry.width * geometry.height, np.zeros(1)
        sides = 2 * (geometry.width + geometry.height)
        cuts = (geometry.width + geometry.height) / 2 if sectors > 1 else 0.0
        return _extruded(
            (np.array([end / sectors]), struck), (np.array([sides / sectors + cuts]), struck), geometry.length
        )
    return _extruded(*_plan_part(geometry, sectors), geometry.thickness)


def _plan_part(geometry: ValvePlate | Block | Stopper, sectors: int) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Areas of a plan, or of one of its sectors, and lengths of its outline; each with the distances from the patch."""
    points, weight, outline, lengths, distance = _plan(geometry)
    edge = [(lengths / sectors, distance(outline)), *(_rays(points, weight, distance) if sectors > 1 else [])]
    length, beside = (np.concatenate(part) for part in zip(*edge, strict=True))
    return (weight / sectors, distance(points)), (length, beside)


def _rays(points: Array, weight: Array, distance: Distance) -> list[tuple[Array, Array]]:
    """Two rays from the centre to the edge, where the plan is; ones between all the points stand for the two."""
    reach = float(np.hypot(points[:, 0], points[:, 1]).max())
    radius = np.hypot(points[:, 0], points[:, 1])
    width = np.pi * np.maximum(radius, reach / COARSEST)
    return [(weight / width, distance(points))]


def _extruded(plan: tuple[Array, Array], walls: tuple[Array, Array], height: float) -> Body:
    """Areas of a plan and lengths of its outline with their distances from the patch, swept down from its plane."""
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
    found, areas = squares(corner, opposite, lambda p: from_segments(p, segments + arcs))
    kept = inside(found, outline)
    pieces = [_along(edge, OUTLINE, middles=True) for edge in profile.edges]
    ends, lengths = (np.concatenate(part) for part in zip(*pieces, strict=True))
    return found[kept], areas[kept], ends, lengths, distance


def _along(edge: Edge, pieces: int, middles: bool = False) -> tuple[Array, Array]:
    """Starts, or middles, (n, 2) of equal pieces of an edge, and their lengths."""
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
        size = math.dist(edge.centre, edge.start) * abs(edge.angles[1]) / PER_ARC
        np.minimum(cap, size + ARC_GROWTH * from_segments(points, _segments(edge)), out=cap)
    return cap


def _plan(geometry: ValvePlate | Block | Stopper) -> tuple[Array, Array, Array, Array, Distance]:
    """As `_sampled`, of the plan of an extruded solid."""
    if isinstance(geometry, Stopper):
        return _round(geometry.radius, geometry.contact_radius)
    if isinstance(geometry, Block):
        return _rectangle(geometry)
    return _plate(geometry)


def _round(radius: float, patch: float) -> tuple[Array, Array, Array, Array, Distance]:
    def distance(points: Array) -> Array:
        return np.asarray(np.hypot(points[:, 0], points[:, 1]) - patch)

    points, areas = squares((-radius, -radius), (radius, radius), distance)
    kept = np.hypot(points[:, 0], points[:, 1]) < radius
    return points[kept], areas[kept], *_circles(np.zeros((1, 2)), radius), distance


def _rectangle(block: Block) -> tuple[Array, Array, Array, Array, Distance]:
    half, patch = (block.width / 2, block.depth / 2), np.array([block.patch_width, block.patch_depth]) / 2

    def distance(points: Array) -> Array:
        off = np.abs(points) - patch
        outside = np.maximum(0.0, off)
        return np.asarray(np.hypot(outside[:, 0], outside[:, 1]) + np.minimum(0.0, off.max(axis=1)))

    points, areas = squares((-half[0], -half[1]), half, distance)
    return points, areas, *_sides(half), distance


def _plate(plate: ValvePlate) -> tuple[Array, Array, Array, Array, Distance]:
    centres = np.array(plate.centres)
    inner, outer = plate.port_radius, plate.port_radius + plate.land_width

    def from_centres(points: Array) -> Array:
        return np.asarray(np.min([np.hypot(*(points - centre).T) for centre in centres], axis=0))

    def distance(points: Array) -> Array:
        return from_centres(points) - outer

    x, y = plate.half_sides if plate.layout == "row" else (plate.outer_radius, plate.outer_radius)
    points, areas = squares((-x, -y), (x, y), distance)
    kept = from_centres(points) > inner
    rim = _sides((x, y))
    if plate.layout == "circle":
        kept &= np.hypot(points[:, 0], points[:, 1]) < x
        rim = _circles(np.zeros((1, 2)), x)
    holes = _circles(centres, inner)
    outline, lengths = (np.concatenate([rim[k], holes[k]]) for k in range(2))
    return points[kept], areas[kept], outline, lengths, distance


def _circles(centres: Array, radius: float) -> tuple[Array, Array]:
    angles = 2 * math.pi * np.arange(OUTLINE) / OUTLINE
    ring = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    points = (centres[:, None, :] + ring).reshape(-1, 2)
    return points, np.full(len(points), 2 * math.pi * radius / OUTLINE)


def _sides(half: Point) -> tuple[Array, Array]:
    corners = [(-half[0], -half[1]), (half[0], -half[1]), half, (-half[0], half[1])]
    pieces = [
        _along(Edge(a, b), OUTLINE, middles=True) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
    ]
    points, lengths = (np.concatenate(part) for part in zip(*pieces, strict=True))
    return points, lengths
