"""Bodies of a scene as surfaces that pyvista draws, the struck face at the origin and the striker above it (metres)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import pyvista
from numpy.typing import NDArray

from impact.pictures.drawing import BLUE, ORANGE
from seatfem.pictures.skins import skin_of_plate
from seatfem.structures.inspection.cad import Part
from seatfem.structures.kinds.beam import Beam
from seatfem.structures.kinds.closed_forms import RigidMass, Rod, Spring
from seatfem.structures.kinds.structure import Structure
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.structures.kinds.turned import Ball
from seatfem.structures.mesh.plane_meshes import mesh_sheet

Array = NDArray[np.float64]

SEAT, REED, CLAMP, SPRING = "#BFC5CD", "#7FA3C7", "#5F6773", "#8A8F98"
STEEL: Final = 7850.0
"""Density of a rigid mass as it is drawn [kg/m^3]."""
BENT: Final = 0.16
"""Drawn opening at a reed's free end over its length."""
ROLLED: Final = math.tan(math.radians(11.0))
"""Drawn slope across a reed that lands tilted."""
COLUMNS: Final = 40
"""Of the strip that draws a beam."""
SLICE: Final = 64
"""Facets around what is turned."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A surface with its colour."""

    surface: Any
    colour: str
    opacity: float = 1.0
    edges: bool = True


@dataclass(frozen=True)
class Pose:
    """How far a striker is drawn from its seat.

    Attributes:
        opening: in place of `BENT`, or over the size of a body that flies.
        rolled: slope across the reed.
        reach: radius of the struck face, over which the end of a beam lies [m].
        at: of the contact, from the root of a beam [m]; ``None``: its end.
    """

    opening: float = BENT
    rolled: float = 0.0
    reach: float = 0.0
    at: float | None = None


def target_pieces(body: Structure, size: float, *, cut: bool = False) -> list[Piece]:
    """Return a body that is struck from above at the origin; a spring is drawn as large as befits the ``size`` [m] of
    what strikes it.

    ``cut``: without the half that hides the section from the camera.
    """
    if isinstance(body, Spring):
        height = 0.3 * size
        return [Piece(_coil(0.09 * size, -height, 0.0), SPRING, edges=False), _foot(0.16 * size, -height)]
    if isinstance(body, Rod):
        x, y = _sides(body)
        foot = _foot(max(0.12 * size, 0.6 * y), -body.length)
        return [Piece(_box(x, y, -body.length, 0.0), SEAT), *([foot] if body.far_end == "fixed" else [])]
    part = body.elastic.part() if body.elastic else None
    if part is None:
        raise ValueError(f"no surface of kind = {body.kind!r}")
    return _part_pieces(part, getattr(body, "arc", None), cut=cut)


def reach_of(pieces: list[Piece]) -> float:
    """Return the radius of the struck face [m]; 0 of bodies that are struck in a point."""
    struck = [piece.surface for piece in pieces if piece.colour == ORANGE]
    return float(np.abs(struck[0].points[:, 0]).max()) if struck else 0.0


def striker_pieces(body: Structure, pose: Pose) -> list[Piece]:
    """Return a body above the origin, opened from its seat."""
    if isinstance(body, Beam):
        return _beam_pieces(body, pose)
    if isinstance(body, ThinPlate):
        return _plate_pieces(body, pose)
    if isinstance(body, RigidMass):
        volume = body.mass / STEEL
        radius = max(1.15 * pose.reach, (volume / (2 * math.pi)) ** (1 / 3))
        low = pose.opening * 2 * radius
        return [Piece(_turned(radius, low, low + volume / (math.pi * radius**2)), REED)]
    if isinstance(body, Rod):
        x, y = _sides(body)
        low = 4 * pose.opening * max(x, y)
        return [Piece(_box(x, y, low, low + body.length), REED)]
    if isinstance(body, Ball):
        low = pose.opening * body.diameter
        ball = pyvista.Sphere(radius=body.diameter / 2, center=(0, 0, low + body.diameter / 2), theta_resolution=SLICE)
        return [Piece(ball, REED, edges=False)]
    raise ValueError(f"no picture of a striker of kind = {body.kind!r}")


def stop_pieces(body: Structure, size: float, height: float, along: float = 0.0) -> list[Piece]:
    """Return a body above the reed, ``along`` the reed from the contact, that it meets at ``height`` [m]."""
    found = []
    for piece in target_pieces(body, 0.6 * size):
        turned = piece.surface.rotate_x(180.0, point=(0, 0, 0)).translate((along, 0, height))
        found.append(replace(piece, surface=turned, opacity=0.55))
    return found


def arrow(length: float, height: float, along: float) -> Piece:
    """Return the arrow of a load downwards, ``along`` the reed from the contact, its tip at ``height`` [m]."""
    start = (along, 0.0, height + length)
    drawn = pyvista.Arrow(start=start, direction=(0, 0, -1), scale=length, shaft_radius=0.06, tip_radius=0.16)
    return Piece(drawn, BLUE, edges=False)


def cylinder_pieces(bore: float, stroke: float, along: float) -> list[Piece]:
    """Return the cylinder of a compressor above its valve, in outline, with the piston halfway [m]."""
    wall = pyvista.CylinderStructured(
        radius=bore / 2, height=stroke, center=(along, 0, stroke / 2), direction=(0, 0, 1), theta_resolution=SLICE
    ).extract_surface(algorithm=None)
    piston = _turned(bore / 2, 0.75 * stroke, stroke).translate((along, 0, 0))
    return [Piece(wall, SEAT, 0.18), Piece(piston, CLAMP, 0.45)]


def _part_pieces(part: Part, arc: float | None, *, cut: bool) -> list[Piece]:
    """The surface, turned so that the struck face looks upwards, its middle at the origin."""
    points, triangles = part.shape.points, part.shape.triangles
    struck = np.asarray(part.shape.groups.get("contact", np.empty(0, int)))
    corners = points[np.unique(triangles[struck])] if len(struck) else points[points[:, 2] == points[:, 2].max()]
    faces = [face for face in part.faces if "contact" in face.groups and face.normal is not None]
    if faces and faces[0].normal is not None and faces[0].normal[2] < 0.9:  # of a bar, whose end looks along x
        turn = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
        points, corners = points @ turn.T, corners @ turn.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle = np.array([*((low + high)[:2] / 2), high[2]])
    mask = np.zeros(len(triangles), dtype=bool)
    mask[struck] = True
    body = _surface(points - middle, triangles[~mask])
    face = _surface(points - middle, triangles[mask]).clean() if mask.any() else None
    if cut:
        whole = _surface(points - middle, triangles).clean()
        body = whole.clip_closed_surface(normal=(-0.35, 1.0, 0.0), origin=(0, 0, 0))
        face = face.clip(normal=(0.35, -1.0, 0.0), origin=(0, 0, 0)) if face is not None else None
    pieces = [Piece(body, SEAT)]
    if face is not None:
        if arc is not None:
            pieces.append(Piece(face, SEAT))
            face = _within(face, arc)
        pieces.append(Piece(face.translate((0, 0, 1e-5)), ORANGE))
    return pieces


def _surface(points: Array, triangles: NDArray[np.int64]) -> Any:
    polydata: Any = pyvista.PolyData  # whose types know no numbers of a stated size
    return polydata.from_regular_faces(points, triangles)


def _within(face: Any, arc: float) -> Any:
    """The part within an angle about the x axis, of less than 180 deg."""
    for side in (-1.0, 1.0):
        face = face.clip(normal=(-math.sin(arc / 2), side * math.cos(arc / 2), 0.0), origin=(0, 0, 0))
    return face


def _beam_pieces(body: Beam, pose: Pose) -> list[Piece]:
    length, width, thickness = (float(getattr(body, key)) for key in ("length", "width", "thickness"))
    at = length if pose.at is None else pose.at
    root = -at + (min(pose.reach, width / 2) if at == length else 0.0)
    x, y = np.meshgrid(np.linspace(0.0, length, COLUMNS), np.linspace(-width / 2, width / 2, 9), indexing="ij")
    upper = pyvista.StructuredGrid(root + x, y, _raised(x, y, length, pose)).extract_surface(algorithm=None)
    reed = upper.triangulate().extrude((0, 0, thickness), capping=True)
    return [Piece(reed, REED), _clamp(root, width, thickness)]


def _plate_pieces(body: ThinPlate, pose: Pose) -> list[Piece]:
    shape = body.geometry()
    skin = skin_of_plate(mesh_sheet(shape, shape.narrowest / 6))
    x, y = skin.points[:, 0], skin.points[:, 1]
    flying = pose.opening * float(np.ptp(x)) + pose.rolled * y
    height = _raised(x, y, shape.length, pose) if shape.is_clamped else flying
    points = np.column_stack([x - shape.centre[0], y - shape.centre[1], height])
    flat = _surface(points, skin.triangles)
    pieces = [Piece(flat.extrude((0, 0, shape.thickness), capping=True), REED)]
    if shape.is_clamped:
        held = points[shape.clamped(skin.points[:, :2])]
        width = float(np.ptp(held[:, 1])) if len(held) else float(np.ptp(y[x < 0.1 * shape.length]))
        pieces.append(_clamp(-shape.centre[0], width, shape.thickness))
    return pieces


def _raised(x: Array, y: Array, length: float, pose: Pose) -> Array:
    """Heights of a reed under a force at its end, and what twists it."""
    share = np.clip(x / length, 0.0, None)
    bent = share**2 * (3 - share) / 2
    return pose.opening * length * bent + pose.rolled * y * share


def _clamp(root: float, width: float, thickness: float) -> Piece:
    deep, high = 0.35 * width, max(0.14 * width, 3 * thickness)
    return Piece(pyvista.Box((root - deep, root, -0.6 * width, 0.6 * width, -high, thickness + high)), CLAMP)


def _sides(body: Rod) -> tuple[float, float]:
    side = math.sqrt(body.cross_section)
    return (body.thickness or side, body.width or side)


def _box(x: float, y: float, low: float, high: float) -> Any:
    return pyvista.Box((-x / 2, x / 2, -y / 2, y / 2, low, high))


def _turned(radius: float, low: float, high: float) -> Any:
    return pyvista.Cylinder(
        center=(0, 0, (low + high) / 2), direction=(0, 0, 1), radius=radius, height=high - low, resolution=SLICE
    )


def _foot(side: float, top: float) -> Piece:
    return Piece(_box(2 * side, 2 * side, top - 0.3 * side, top), CLAMP)


def _coil(radius: float, low: float, high: float, turns: int = 5) -> Any:
    """A helix of wire with a flat plate on it."""
    angle = np.linspace(0.0, 2 * math.pi * turns, 40 * turns)
    wire = np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), np.linspace(low, high - 0.2 * radius, len(angle))]
    )
    coil = pyvista.Spline(wire, len(wire)).tube(radius=0.13 * radius)
    plate = _turned(1.3 * radius, high - 0.25 * radius, high)
    return coil.merge(plate).extract_surface(algorithm=None)
