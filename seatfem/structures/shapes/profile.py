"""The outline of a solid of revolution: lines and circular arcs in the half plane (r, z)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from seatfem.structures.errors import GeometryError

Point = tuple[float, float]
CLOSED = 1e-9  # largest gap of a closed outline [m]
PER_ARC = 2  # least number of elements along an arc


@dataclass(frozen=True)
class Edge:
    """Edge from ``start`` to ``end`` (r, z in metres): straight, or the shorter arc about ``centre``.

    ``name``: name of its group, or "". ``elements``: least number of elements along an arc.
    """

    start: Point
    end: Point
    centre: Point | None = None
    name: str = ""
    elements: int = PER_ARC

    @property
    def angles(self) -> tuple[float, float]:
        """Return the azimuth of an arc's start about its centre, and its signed angle (radians)."""
        assert self.centre is not None
        first, last = (math.atan2(z - self.centre[1], r - self.centre[0]) for r, z in (self.start, self.end))
        return first, math.remainder(last - first, 2 * math.pi)

    @property
    def volume(self) -> float:
        """Return the contribution pi int r^2 dz to the volume of the solid (the outline runs counter-clockwise)."""
        (r0, z0), (r1, z1) = self.start, self.end
        if self.centre is None:
            return math.pi / 3 * (z1 - z0) * (r0 * r0 + r0 * r1 + r1 * r1)
        c, radius = self.centre[0], math.dist(self.centre, self.start)
        first, turn = self.angles

        def primitive(t: float) -> float:
            return (c**2 * math.sin(t) + c * radius * (t + math.sin(2 * t) / 2)) + radius**2 * (
                math.sin(t) - math.sin(t) ** 3 / 3
            )

        return math.pi * radius * (primitive(first + turn) - primitive(first))

    @property
    def section_area(self) -> float:
        """Return the contribution int r dz to the area of the half section."""
        (r0, z0), (r1, z1) = self.start, self.end
        if self.centre is None:
            return (z1 - z0) * (r0 + r1) / 2
        c, radius, (first, turn) = self.centre[0], math.dist(self.centre, self.start), self.angles
        ends = [c * math.sin(t) + radius * (t / 2 + math.sin(2 * t) / 4) for t in (first, first + turn)]
        return radius * (ends[1] - ends[0])

    @property
    def area(self) -> float:
        """Return the area 2 pi int r ds of the surface that the edge sweeps."""
        (r0, _), (r1, _) = self.start, self.end
        if self.centre is None:
            return math.pi * (r0 + r1) * math.dist(self.start, self.end)
        c, radius = self.centre[0], math.dist(self.centre, self.start)
        first, turn = self.angles
        mean = c * turn + radius * (math.sin(first + turn) - math.sin(first))
        return 2 * math.pi * radius * abs(mean)


@dataclass(frozen=True)
class Profile:
    """Closed outline, counter-clockwise in (r, z), r >= 0; raises `GeometryError` otherwise.

    The solid is swept by revolving the outline about the z axis. Volume and areas are exact (theorems of Pappus).
    """

    edges: tuple[Edge, ...]

    def __post_init__(self) -> None:
        for edge, following in zip(self.edges, self.edges[1:] + self.edges[:1], strict=True):
            if math.dist(edge.end, following.start) > CLOSED:
                raise GeometryError(f"Profile: the outline is open at {edge.end}; the next edge must start there")
            if min(edge.start[0], edge.end[0]) < 0.0:
                raise GeometryError(f"Profile: {edge}: lies at r < 0")
        if not self.volume > 0.0:
            raise GeometryError("Profile: encloses no volume; its edges must run counter-clockwise in (r, z)")

    @property
    def volume(self) -> float:
        """Return the volume of the full solid, in cubic metres."""
        return sum(edge.volume for edge in self.edges)

    @property
    def section_area(self) -> float:
        """Return the area of the half section, in square metres."""
        return sum(edge.section_area for edge in self.edges)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the groups, in the order of the outline."""
        return tuple(dict.fromkeys(edge.name for edge in self.edges if edge.name))

    def area(self, name: str) -> float:
        """Return the area of the named group's surface on the full solid, in square metres."""
        return sum(edge.area for edge in self.edges if edge.name == name)

    def rings(self, name: str) -> tuple[tuple[float, float], ...]:
        """Return the inner and the outer radius of each ring that the named group's edges in a row sweep, from inside
        [m]."""
        marks = [edge.name == name for edge in self.edges]
        starts = [k for k, mark in enumerate(marks) if mark and not marks[k - 1]]
        rings = []
        for k in starts:
            run = list(itertools.takewhile(lambda edge: edge.name == name, self.edges[k:]))
            radii = [r for edge in run for r in (edge.start[0], edge.end[0])]
            rings.append((min(radii), max(radii)))
        return tuple(sorted(rings))

    def cut(self, name: str, shares: Sequence[float]) -> Profile:
        """Return the outline with further corners in the named group, which divide its area at these fractions."""
        whole, behind, edges = self.area(name), 0.0, []
        for edge in self.edges:
            if edge.name == name:
                inside = [(share * whole - behind) / edge.area for share in shares]
                behind += edge.area
                edges += _pieces(edge, [share for share in inside if CLOSED < share < 1 - CLOSED])
            else:
                edges.append(edge)
        return Profile(tuple(edges))

    @property
    def outer_radius(self) -> float:
        return max(edge.start[0] for edge in self.edges)


def _pieces(edge: Edge, shares: Sequence[float]) -> list[Edge]:
    """Return the parts of ``edge`` divided at these fractions of its swept area."""
    ends = [edge.start, *(_divide_edge(edge, share) for share in shares), edge.end]
    return [replace(edge, start=a, end=b) for a, b in itertools.pairwise(ends)]


def _divide_edge(edge: Edge, share: float) -> Point:
    """Return the point that divides an edge at this fraction of its swept area."""

    def point(t: float) -> Point:
        if edge.centre is None:
            (r0, z0), (r1, z1) = edge.start, edge.end
            return r0 + t * (r1 - r0), z0 + t * (z1 - z0)
        first, turn = edge.angles
        radius, angle = math.dist(edge.centre, edge.start), first + t * turn
        return edge.centre[0] + radius * math.cos(angle), edge.centre[1] + radius * math.sin(angle)

    from scipy.optimize import brentq  # needed for several rings only; slow to import

    return point(brentq(lambda t: replace(edge, end=point(t)).area / edge.area - share, 1e-12, 1.0, xtol=1e-14))


def polygon(points: Sequence[Point], names: Sequence[str]) -> tuple[Edge, ...]:
    """Return straight edges through the points and back to the first; ``names``: one per edge."""
    ends = [*points[1:], points[0]]
    return tuple(Edge(a, b, name=name) for a, b, name in zip(points, ends, names, strict=True))


def rounded(edges: Sequence[Edge], corner: Point, radius: float, elements: int = PER_ARC) -> tuple[Edge, ...]:
    """Return the edges with a corner between straight ones replaced by an arc of this radius [m], which may be 0, with
    a least number of ``elements``."""
    if radius == 0.0:
        return tuple(edges)
    k = next(number for number, edge in enumerate(edges) if edge.start == corner)
    before, after = edges[k - 1], edges[k]
    sides = [math.dist(corner, end) for end in (before.start, after.end)]
    back, forth = (
        ((end[0] - corner[0]) / side, (end[1] - corner[1]) / side)
        for end, side in zip((before.start, after.end), sides, strict=True)
    )
    half = math.acos(back[0] * forth[0] + back[1] * forth[1]) / 2
    away = radius / math.tan(half)
    middle = radius / math.sin(half) / (2 * math.cos(half))
    start, end = ((corner[0] + away * u, corner[1] + away * v) for u, v in (back, forth))
    centre = corner[0] + middle * (back[0] + forth[0]), corner[1] + middle * (back[1] + forth[1])
    outline = list(edges)
    outline[k - 1], outline[k] = replace(before, end=start), replace(after, start=end)
    outline.insert(k, Edge(start, end, centre, elements=elements))
    return tuple(outline)
