"""How large a CAD part is, from the numbers in its file."""

from __future__ import annotations

import re

import numpy as np

from seatfem.geometry import Block, CadPart, GeometryError
from seatfem.geometry.cad import STEP_SUFFIXES, check_readable, stated_unit
from seatfem.geometry.step_text import cad_text, entities

PATCH_SHARE = 0.2  # side of the struck patch over the side of the part
_POINT = re.compile(r"\s*'[^']*'\s*,\s*\(([^)]*)\)")
_NUMBER = r"(-?\d[\d.eE+-]{0,40})"
_LINE = re.compile(rf"^[ \t]{{0,40}}{_NUMBER}[ \t]{{1,40}}{_NUMBER}[ \t]{{1,40}}{_NUMBER}[ \t]{{0,40}}$", re.MULTILINE)


def as_block(part: CadPart) -> Block:
    """A block as large as the part's bounding box, which holds all points of the file, the thinnest side upright.

    It is rough: what is hollow counts as full, and the patch is taken to be a fifth of the block wide.

    Raises:
        GeometryError: the file is no sound CAD file, or has no points that can be read.
    """
    check_readable(part.path)
    text = cad_text(part.path)
    step = part.path.suffix.lower() in STEP_SUFFIXES
    unit = part.unit or (stated_unit(part.path) if step else 1.0)
    rows = _step_points(text) if step else _LINE.findall(text)
    try:
        points = np.array([[float(x) for x in row] for row in rows if len(row) == 3])
    except ValueError:
        points = np.empty((0, 3))
    if len(points) < 2 or not np.all(np.isfinite(points)):
        raise GeometryError(f"{part.path}: no points can be read from the file, so that its size is not known")
    low, middle, high = sorted(max(float(side), 1e-9) for side in unit * np.ptp(points, axis=0))
    return Block(high, middle, low, PATCH_SHARE * high, PATCH_SHARE * middle)


def _step_points(text: str) -> list[list[str]]:
    points = (_POINT.match(body) for _, keyword, body in entities(text) if keyword == "CARTESIAN_POINT")
    return [point[1].split(",") for point in points if point]
