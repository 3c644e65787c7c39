"""Sides of a flat plate in a STEP file: faces of its solid, selected as those of seats are."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from seatfem.structures.errors import GeometryError
from seatfem.structures.inspection.cad import FoundFace, inspect_geometry
from seatfem.structures.inspection.opened import FileState, state_of
from seatfem.structures.inspection.outline import PICOMETRE
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.shapes import CadPart, Group, Selector
from seatfem.structures.shapes.faces import Frame
from seatfem.structures.shapes.selectors import ANGLE_TOLERANCE, LENGTH_TOLERANCE

GROUP: Final = "clamped"
Place = tuple[float, float]


def straight_side(path: Path, selectors: tuple[Selector, ...], frame: Frame) -> tuple[Place, Place]:
    """Return both ends, in the frame of the plate, of the straight side that the selected faces are [m].

    Raises:
        GeometryError: "Outlined.clamped = ...": a selection that finds no face, one that is no straight side, or faces
            that do not lie in one line; with the sides that there are.
    """
    return _side(state_of(path), path, selectors, frame)


@lru_cache(maxsize=8)
def _side(state: FileState, path: Path, selectors: tuple[Selector, ...], frame: Frame) -> tuple[Place, Place]:
    del state  # part of the key
    try:
        inspected = inspect_geometry(CadPart(path, contact=(), fixed=(), groups=(Group(GROUP, selectors),)))
    except (MeshingError, OSError) as error:
        raise _wrong(path, f"{error}; check the file") from error
    if inspected.problems:
        raise GeometryError(f"Outlined.clamped = {path.name}: {inspected.problems[0][1]}")
    sides = [face for face in inspected.faces if _is_side(face, frame)]
    chosen = [face for face in inspected.faces if GROUP in face.groups]
    if other := [face for face in chosen if face not in sides]:
        kind = "a broad face of the plate" if other[0].normal is not None else f"a {other[0].kind.lower()}"
        raise _wrong(
            path, f"face {_numbers(other[0])} is {kind}; select a straight side of the sheet: {_listed(sides)}"
        )
    first = np.array(chosen[0].normal)
    points = inspected.edges[GROUP].reshape(-1, 3)
    heights = points @ first
    if any(np.linalg.norm(first - np.array(face.normal)) > ANGLE_TOLERANCE for face in chosen) or (
        np.ptp(heights) > LENGTH_TOLERANCE
    ):
        raise _wrong(path, f"the faces do not lie in one line; select one straight side: {_listed(chosen)}")
    way = np.cross(frame.normal, first)
    ends = points[[int(np.argmin(points @ way)), int(np.argmax(points @ way))]]
    (a, b), (c, d) = (np.round(frame.seen(ends), PICOMETRE) + 0.0).tolist()
    return (a, b), (c, d)


def _wrong(path: Path, why: str) -> GeometryError:
    return GeometryError(f"Outlined.clamped = {path.name}: {why}")


def _is_side(face: FoundFace, frame: Frame) -> bool:
    return face.normal is not None and abs(float(np.array(face.normal) @ frame.normal)) < ANGLE_TOLERANCE


def _numbers(face: FoundFace) -> str:
    return " = ".join(map(str, face.numbers))


def _listed(faces: list[FoundFace]) -> str:
    lines = []
    for face in faces:
        centre = ", ".join(f"{1e3 * each:.4g}" for each in np.round(face.centre, 12) + 0.0)
        normal = ", ".join(f"{each:.3g}" for each in np.round(np.array(face.normal), 6) + 0.0)
        name = f", name {face.name!r}" if face.name else ""
        lines.append(f"\n  face {_numbers(face)}: centre ({centre}) mm, normal ({normal}){name}")
    return "".join(lines) or "it has none"
