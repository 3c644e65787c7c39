"""Solids of revolution, and their recipes in gmsh, in millimetres."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

from seatfem.structures.rings import ring_borders
from seatfem.structures.shapes.profile import Point, Profile
from seatfem.structures.shapes.shape import Shape


class Turning(Shape):
    """A solid of revolution about z: its ``profile`` is its recipe."""

    @property
    @abstractmethod
    def profile(self) -> Profile:
        """Return the half section."""

    def build(self, occ: Any) -> None:
        """Revolve the profile once around, in the given gmsh OpenCASCADE model."""
        section, _ = _surface(self.profile, occ, lambda r, z: (r, 0.0, z))
        occ.revolve([(2, section)], 0, 0, 0, 0, 0, 1, 2 * math.pi)
        occ.remove([(2, section)], recursive=True)


@dataclass(frozen=True)
class Drawing:
    """Curve tags of a section: ``groups`` by name; ``arcs``: how many elements each arc asks for."""

    groups: dict[str, list[int]]
    arcs: dict[int, int]


def section(spec: Turning, occ: Any, rings: int = 1) -> Drawing:
    """Return the profile as a surface in the plane x = r, y = z. The struck edge has corners at the borders of its
    rings."""
    profile = spec.profile.cut("contact", ring_borders(rings)[1:-1].tolist())
    _, curves = _surface(profile, occ, lambda r, z: (r, z, 0.0))
    groups: dict[str, list[int]] = {name: [] for name in profile.names}
    for edge, tag in zip(profile.edges, curves, strict=True):
        if edge.name:
            groups[edge.name].append(tag)
    arcs = {tag: edge.elements for edge, tag in zip(profile.edges, curves, strict=True) if edge.centre is not None}
    return Drawing(groups, arcs)


def _surface(profile: Profile, occ: Any, place: Any) -> tuple[int, list[int]]:
    def point(where: Point) -> int:
        return int(occ.addPoint(*place(1e3 * where[0], 1e3 * where[1])))

    corners = [point(edge.start) for edge in profile.edges]
    curves, centres = [], []
    for edge, a, b in zip(profile.edges, corners, corners[1:] + corners[:1], strict=True):
        if edge.centre is None:
            curves.append(int(occ.addLine(a, b)))
        else:
            centres.append(point(edge.centre))
            curves.append(int(occ.addCircleArc(a, centres[-1], b)))
    occ.remove([(0, tag) for tag in centres])
    return int(occ.addPlaneSurface([occ.addCurveLoop(curves)])), curves
