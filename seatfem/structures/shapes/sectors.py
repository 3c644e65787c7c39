"""Equal sectors about the z axis, the first from the plane y = 0 on."""

from __future__ import annotations

import math
from typing import Any

from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes.selectors import HalfPlaneFace, Patches
from seatfem.structures.shapes.shape import Shape

REACH = 8.0  # of the cutting wedge, over the size of what it cuts


def check_sectors(shape: Shape, sectors: int) -> None:
    """Raise `GeometryError` where the geometry is known not to be that many equal sectors between symmetry planes."""
    if sectors < 1:
        raise GeometryError(f"sector = {sectors}: must be >= 1 (1: the whole {type(shape).__name__})")
    if sectors > 1:
        shape.check_sectors(sectors)


def patches_in(shape: Shape, sectors: int) -> Patches:
    """Return the groups of one sector: those of the whole, and the cut faces "symmetry_0" and "symmetry_1"."""
    if sectors == 1:
        return shape.patches
    cuts: Patches = {
        "symmetry_0": (HalfPlaneFace(0.0),),
        "symmetry_1": (HalfPlaneFace(2 * math.pi / sectors),),
    }
    return shape.patches_in(sectors) | cuts


def cut(occ: Any, dimension: int, sectors: int) -> list[list[tuple[int, int]]]:
    """Keep one sector of all solids (3) or of all surfaces at z = 0 (2); the pieces of each, in order."""
    whole = occ.getEntities(dimension)
    bounds = [occ.getBoundingBox(*entity) for entity in whole]
    size = REACH * max(abs(value) for box in bounds for value in box)
    wedge = _wedge(occ, sectors, size, -size if dimension == 3 else 0.0)
    tool = (2, wedge)
    if dimension == 3:
        tool = next(entity for entity in occ.extrude([tool], 0, 0, 2 * size) if entity[0] == 3)
    _, pieces = occ.intersect(whole, [tool])
    if dimension == 3:
        occ.remove([(2, wedge)], recursive=True)
    if sectors > 2:
        return [list(piece) for piece in pieces[: len(whole)]]
    # Both cut faces of a half lie in one plane: what crosses the axis is split there.
    kept = occ.getEntities(dimension)
    middle = occ.addPoint(0, 0, 0)
    axis = (0, middle) if dimension == 2 else (1, occ.addLine(occ.addPoint(0, 0, -size), occ.addPoint(0, 0, size)))
    _, split = occ.fragment(kept, [axis])
    after = dict(zip(kept, split[: len(kept)], strict=True))
    return [[new for old in piece for new in after[old]] for piece in pieces[: len(whole)]]


def _wedge(occ: Any, sectors: int, size: float, z: float) -> int:
    if sectors == 2:
        return int(occ.addRectangle(-size, 0, z, 2 * size, size))
    angle = 2 * math.pi / sectors
    corners = [(0.0, 0.0), (size, 0.0), (size * math.cos(angle), size * math.sin(angle))]
    points = [occ.addPoint(x, y, z) for x, y in corners]
    lines = [occ.addLine(points[k - 1], points[k]) for k in range(3)]
    return int(occ.addPlaneSurface([occ.addCurveLoop(lines)]))
