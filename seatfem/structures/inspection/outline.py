"""Outlines and sides of flat sheets in DXF and STEP files, and the position of a flat reed over the lip of its seat."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from impact.greens.base import Array
from seatfem.structures import errors, lands
from seatfem.structures.formats.dxf import read_outline
from seatfem.structures.inspection.cad import FoundFace, Shape, inspect_geometry, read_once
from seatfem.structures.lip import AnyLip, tilted
from seatfem.structures.mesh.gmsh_process import MeshingError, run_gmsh
from seatfem.structures.shapes import CadPart, Group, Selector, cad, inspect, loops, outlined
from seatfem.structures.shapes.selectors import ANGLE_TOLERANCE, LENGTH_TOLERANCE, Frame, Vector

PICOMETRE: Final = 12  # decimals to which coordinates in metres are rounded


@dataclass(frozen=True)
class DrawnOutline:
    """The outline in a file, its frame and the thickness of the plate.

    Attributes:
        outline, holes: closed loops of corners (x, y, bulge) [m].
        thickness: thickness of a solid plate [m]; 0 for a face or a drawing.
        frame: origin and axes of x and y in the STEP file, in the plane of the face that was read.
        normal: normal of that face, out of the solid.
    """

    outline: tuple[outlined.Corner, ...]
    holes: tuple[tuple[outlined.Corner, ...], ...]
    thickness: float = 0.0
    frame: Frame | None = None
    normal: Vector | None = None

    def seen_in(self, frame: Frame) -> DrawnOutline:
        """Return the outline in the coordinates of another frame in a parallel plane, rounded to a picometre, so that a
        sheet drawn in another position has the same corners and mesh."""
        assert self.frame is not None
        own, bulged = self.frame, 1.0 if self.frame.normal @ frame.normal > 0 else -1.0

        def moved(loop: tuple[outlined.Corner, ...]) -> tuple[outlined.Corner, ...]:
            corners = np.array(loop)
            places = frame.seen(own.points(corners[:, :2]))
            rows = np.column_stack([places, bulged * corners[:, 2]])
            return _corners(np.asarray(np.round(rows, PICOMETRE) + 0.0, dtype=np.float64))

        return replace(self, outline=moved(self.outline), holes=tuple(map(moved, self.holes)), frame=frame)


def outline_in(path: Path, unit: float = 0.0, *, oblique: bool = False) -> DrawnOutline:
    """Return the outline in a file, cached in the process while the file is unchanged.

    A STEP file holds one plane face, or a plate, whose thickness is determined. The normal of the face is an axis of
    the file: for z, coordinates are x and y of the file; for x, y and z; for y, z and x.

    Args:
        path: STEP or DXF file.
        unit: metres per unit of a DXF drawing; 0: as stated in it.
        oblique: whether a STEP face may be inclined to all axes; its axes are then those of
            `seatfem.structures.lands.axes_along`.

    Raises:
        GeometryError: "Outlined.file = ..." for a file that is damaged or has other content.
    """
    try:
        return read_once(_read, (path, unit, oblique))
    except (MeshingError, OSError) as error:
        raise errors.GeometryError(f"Outlined.file = {path.name}: {error}") from error


def _read(path: Path, unit: float, oblique: bool) -> DrawnOutline:
    if path.suffix.lower() not in cad.STEP_SUFFIXES:
        outline, *holes = map(_corners, read_outline(path, unit))
        return DrawnOutline(outline, tuple(holes))
    try:
        cad.check_readable(path)
        if not cad.stated_unit(path):
            raise errors.GeometryError(f"{path}: states no length unit; export it with one")
    except errors.GeometryError as error:
        raise errors.GeometryError(f"Outlined.file = {error}") from error
    arrays = run_gmsh({"task": "outline", "path": str(path), "oblique": oblique})
    outline, *holes = (_corners(arrays[f"loop:{k}"]) for k in range(sum(name.startswith("loop:") for name in arrays)))
    frame = Frame(*(inspect.triple(row) for row in arrays["frame"]))
    return DrawnOutline(outline, tuple(holes), float(arrays["thickness"]), frame, inspect.triple(arrays["normal"]))


def _corners(loop: Array) -> tuple[outlined.Corner, ...]:
    return tuple((float(x), float(y), float(bulge)) for x, y, bulge in loop)


GROUP: Final = "clamped"
Place = tuple[float, float]


def held_edge(path: Path, selectors: tuple[Selector, ...], frame: Frame) -> tuple[Place, ...]:
    """Return both ends of the straight side made of the selected faces, or one point on the edge of a round hole that
    they make, in coordinates of the frame [m].

    Raises:
        GeometryError: "Outlined.clamped = ...": no face is selected, or a face that is no straight side, or faces
            that do not lie in one line; the message lists the sides.
    """
    return read_once(_side, (path, selectors, frame))


def _side(path: Path, selectors: tuple[Selector, ...], frame: Frame) -> tuple[Place, ...]:
    try:
        inspected = inspect_geometry(CadPart(path, contact=(), fixed=(), groups=(Group(GROUP, selectors),)))
    except (MeshingError, OSError) as error:
        raise _wrong_side(path, f"{error}; check the file") from error
    if inspected.problems:
        raise errors.GeometryError(f"Outlined.clamped = {path.name}: {inspected.problems[0][1]}")
    sides = [
        face
        for face in inspected.faces
        if face.normal is not None and abs(float(np.array(face.normal) @ frame.normal)) < ANGLE_TOLERANCE
    ]
    chosen = [face for face in inspected.faces if GROUP in face.groups]
    if (hole := _circle(chosen, frame)) is not None:
        return (hole,)
    if other := [face for face in chosen if face not in sides]:
        kind = "a broad face of the plate" if other[0].normal is not None else f"a {other[0].kind.lower()}"
        raise _wrong_side(
            path,
            f"face {_numbers(other[0])} is {kind}; select all faces of a round hole, or a straight side: "
            f"{_listed_sides(sides)}",
        )
    first = np.array(chosen[0].normal)
    points = inspected.edges[GROUP].reshape(-1, 3)
    heights = points @ first
    if any(np.linalg.norm(first - np.array(face.normal)) > ANGLE_TOLERANCE for face in chosen) or (
        np.ptp(heights) > LENGTH_TOLERANCE
    ):
        raise _wrong_side(path, f"the faces do not lie in one line; select one straight side: {_listed_sides(chosen)}")
    way = np.cross(frame.normal, first)
    ends = points[[int(np.argmin(points @ way)), int(np.argmax(points @ way))]]
    (a, b), (c, d) = (np.round(frame.seen(ends), PICOMETRE) + 0.0).tolist()
    return (a, b), (c, d)


def _circle(faces: Sequence[FoundFace], frame: Frame) -> Place | None:
    """Return a point on the circle [m] that faces of cylinders along the normal close; ``None`` if they do not."""
    axes = [face.axis for face in faces if face.axis is not None]
    if len(axes) < len(faces) or any(
        np.linalg.norm(np.cross(axis.direction, frame.normal)) > ANGLE_TOLERANCE for axis in axes
    ):
        return None
    weights = [face.area for face in faces]
    centre = np.average(frame.seen(np.array([face.centre for face in faces])), axis=0, weights=weights)
    middles = frame.seen(np.array([axis.point for axis in axes]))
    if np.linalg.norm(middles - centre, axis=1).max() > LENGTH_TOLERANCE:
        return None
    return float(centre[0]) + max(face.ends[1] for face in faces), float(centre[1])


def _wrong_side(path: Path, why: str) -> errors.GeometryError:
    return errors.GeometryError(f"Outlined.clamped = {path.name}: {why}")


def _numbers(face: FoundFace) -> str:
    return " = ".join(map(str, face.numbers))


def _listed_sides(faces: list[FoundFace]) -> str:
    lines = []
    for face in faces:
        centre = ", ".join(f"{1e3 * each:.4g}" for each in np.round(face.centre, 12) + 0.0)
        normal = ", ".join(f"{each:.3g}" for each in np.round(np.array(face.normal), 6) + 0.0)
        name = f", name {face.name!r}" if face.name else ""
        lines.append(f"\n  face {_numbers(face)}: centre ({centre}) mm, normal ({normal}){name}")
    return "".join(lines) or "it has none"


ROUND_OFF: Final = 1e-6  # accuracy of coordinates in exchange files [m], [rad]
EDGE_POINTS: Final = 721  # number of points on each edge of a lip
BESIDE: Final = 1e-5  # distance from the reed's edge within which a point does not count as cutting through [m]


@dataclass(frozen=True)
class Placement:
    """Position and tilt of a reed over a lip.

    Attributes:
        frame: plane of the reed's side that faces the lip: x from the clamp towards the lip, normal away from the lip.
        lip: centre of the lip in coordinates of this frame [m].
        height: distance of that plane from the centre of the lip, along the normal [m].
        tilt, axis: angle between reed and lip, and direction of the axis of tilt, measured from x [rad].
    """

    frame: Frame
    lip: tuple[float, float]
    height: float
    tilt: float
    axis: float


def facing_side(drawn: DrawnOutline, normal: Vector) -> tuple[Vector, Vector]:
    """Return a point on the side of a plate that faces a lip with this outward normal [m], and the normal of the plate
    away from the lip."""
    assert drawn.frame is not None
    assert drawn.normal is not None
    own, point = np.array(drawn.normal), np.array(drawn.frame.origin)
    up = own if own @ np.array(normal) > 0 else -own
    return inspect.triple(point - drawn.thickness * own if own @ up > 0 else point), inspect.triple(up)


def placed(land: lands.Land, side: tuple[Vector, Vector], clamp: Array) -> Placement:
    """Return the position and tilt of a reed over a lip.

    Args:
        land: flat face of the lip; its axes do not matter.
        side: point and normal by `facing_side`.
        clamp: (2, 3) two points on the clamped line [m].
    """
    point, up = (np.array(each) for each in side)
    centre, lip_normal = np.array(land.centre), np.cross(land.x, land.y)
    line = (clamp[1] - clamp[0]) - (clamp[1] - clamp[0]) @ up * up
    foot = clamp.mean(axis=0)
    x = np.cross(line, up)
    x *= np.sign(x @ (centre - foot)) or 1.0
    x /= np.linalg.norm(x)
    frame = Frame(inspect.triple(foot - ((foot - point) @ up) * up), inspect.triple(x), inspect.triple(np.cross(up, x)))
    lip_axes = lands.axes_along(lip_normal, inspect.triple(x))
    rise = -lip_axes[:2] @ up / (lip_normal @ up)  # slope of the opening along the lip's x and y
    tilt = math.atan(float(np.hypot(*rise)))
    axis = math.atan2(-float(rise[0]), float(rise[1])) if tilt > ROUND_OFF else 0.0
    u, v = frame.seen(centre).tolist()
    return Placement(frame, (u, v), float((point - centre) @ up), tilt if tilt > ROUND_OFF else 0.0, axis)


def opening(lip: AnyLip, placement: Placement) -> tuple[float, float]:
    """Return the smallest opening between a reed and the centre lines of a lip, with the x axis of the placement, and
    by how much it is smaller at the edges of the lip [m]."""
    middle, edges = (
        float(tilted(points, placement.tilt, placement.axis).min())
        for points in (lip.lines(), np.stack(lip.cuts(np.linspace(0.0, 1.0, EDGE_POINTS))))
    )
    return placement.height + middle, max(0.0, middle - edges)


def cut_by(shape: Shape, outline: Sequence[Array], placement: Placement, allowed: float) -> Vector | None:
    """Return a point at which a body cuts through the facing side of the reed [m], ``None`` if there is none.

    Args:
        shape: surface of the body.
        outline: loops (n, 3) around the reed and its holes, in coordinates of the placement's frame.
        allowed: height above that side up to which the body may extend [m].
    """
    frame = placement.frame
    height = (shape.points - np.array(frame.origin)) @ frame.normal - ROUND_OFF - allowed
    edges = shape.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges = edges[(height[edges] > 0).sum(axis=1) == 1]
    if not len(edges):
        return None
    a, b = height[edges].T
    share = (a / (a - b))[:, None]
    met = shape.points[edges[:, 0]] + share * (shape.points[edges[:, 1]] - shape.points[edges[:, 0]])
    places = frame.seen(met)
    for point in met[loops.inside([loops.polygon(loop)[0] for loop in outline], places)]:
        if min(loops.nearest(loop, frame.seen(point)) for loop in outline) > BESIDE:
            return inspect.triple(point)
    return None
