"""Outlines in DXF files: lines, arcs, circles and polylines that form closed loops, read and written."""

import io
import math
import re
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Final

import numpy as np

from impact.files.safe_files import MB, read_text, write_whole
from impact.greens.base import Array
from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes import loops

JOINED: Final = 1e-6  # largest distance of end points that count as one, over the outline's size
LARGEST: Final = 20 * MB
MOST_CORNERS: Final = 10_000  # largest number of corners of all curves: each end is compared with all others
MOST_LENGTH: Final = 1e3  # largest coordinate and radius [m]
FLAT: Final = 1e-9  # bulge below which an edge is straight
STEEP: Final = 1e4  # bulge above which an arc is a full circle
UNITS: Final = {1: 0.0254, 2: 0.3048, 4: 1e-3, 5: 1e-2, 6: 1.0, 13: 1e-6}  # metres per unit, by $INSUNITS
CURVES: Final = ("LINE", "ARC", "CIRCLE", "LWPOLYLINE")
OTHERS: Final = ("SPLINE", "ELLIPSE", "POLYLINE", "INSERT", "REGION", "3DSOLID", "MLINE")
"""Entities that could be part of an outline, unlike texts, dimensions and points."""
Group = tuple[int, str]
Groups = list[Group]


def read_outline(path: Path, unit: float | None = None) -> tuple[Array, ...]:
    """Return closed loops (n, 3) of corners x, y [m] and bulges, the outline first, then its holes; arcs stay arcs.

    Args:
        path: an ASCII file.
        unit: metres per unit of the drawing; ``None``: as stated in its header ($INSUNITS).

    Raises:
        GeometryError: no DXF file, no unit, curves of other types, an outline that is open.
    """
    text = read_text(path, LARGEST, GeometryError, errors="replace")
    scale = _unit(_groups(text, path), path) if unit is None else unit
    chains: list[Array] = []
    corners = 0
    for entity in _entities(_groups(text, path), path):
        curve = _chain(entity, path, MOST_LENGTH / scale)
        corners += len(curve)
        if corners > MOST_CORNERS:
            raise _crowded(path)
        chains += [curve] if len(curve) > 1 else []
    if not chains:
        raise _wrong(path, f"no {', '.join(CURVES)} among its entities; draw its outline with these")

    def open_at(point: Array) -> GeometryError:
        x, y = 1e3 * scale * point
        return _wrong(path, f"its outline is open at ({x:.6g}, {y:.6g}) mm: nothing goes on from there; close it")

    within = JOINED * float(np.ptp(np.concatenate(chains)[:, :2], axis=0).max())
    outlines = [loop * (scale, scale, 1.0) for loop in loops.closed(chains, within, open_at)]
    return tuple(sorted(outlines, key=lambda loop: -abs(loops.area(loop))))


def _wrong(path: Path, what: str) -> GeometryError:
    return GeometryError(f"Outlined.file = {path.name}: {what}")


def _crowded(path: Path) -> GeometryError:
    return _wrong(path, f"its curves have more than {MOST_CORNERS} corners; keep the outline and its holes alone")


def _groups(text: str, path: Path) -> Iterator[Group]:
    """Yield (code, value) of each pair of lines."""
    if text.startswith("AutoCAD Binary DXF"):
        raise _wrong(path, "a binary DXF file; save it as ASCII")
    lines = iter(io.StringIO(text))
    try:
        for code, value in zip(lines, lines, strict=False):
            yield int(code), value.strip()
    except ValueError:
        raise _wrong(path, "no DXF file: its lines are no pairs of codes and values; save it as ASCII DXF") from None


def _unit(groups: Iterator[Group], path: Path) -> float:
    code = next((next(groups, (0, ""))[1] for group in groups if group == (9, "$INSUNITS")), "")
    if not re.fullmatch("[0-9]{1,3}", code) or int(code) not in UNITS:
        raise _wrong(path, 'its header states no length unit that is known; state it: unit = "mm"')
    return UNITS[int(code)]


def _entities(groups: Iterator[Group], path: Path) -> Iterator[Groups]:
    """Yield the groups of each entity in the section ENTITIES, its name first."""
    section, entity = "", Groups()
    for code, value in chain(groups, [(0, "")]):
        if code == 0:
            if entity:
                yield entity
            entity = [(0, value)] if section == "ENTITIES" and value not in ("SECTION", "ENDSEC") else []
            section = "" if value == "SECTION" else section
        elif code == 2 and not section:
            section = value
        elif entity:
            entity.append((code, value))
        if len(entity) > 8 * MOST_CORNERS:
            raise _crowded(path)


def _chain(entity: Groups, path: Path, most: float) -> Array:
    """Return corners and bulges (n, 3) of a curve, the first again at the end of a closed one; (0, 3) without any."""
    name = entity[0][1]
    if name in OTHERS:
        raise _wrong(path, f"a {name}; an outline may have {', '.join(CURVES)}: explode or convert it")
    if name not in CURVES:
        return np.zeros((0, 3))
    try:
        values = {code: float(value) for code, value in entity if 10 <= code <= 59 or code in (70, 230)}
        if not np.isfinite(list(values.values())).all():
            raise _wrong(path, f"a {name} whose numbers must be finite")
        if values.get(230, 1.0) < 0:
            raise _wrong(path, f"a {name} that is drawn from below (extrusion -1); flatten it")
        if name == "LINE":
            corners = np.array([[values[10], values[20], 0.0], [values[11], values[21], 0.0]])
        elif name == "LWPOLYLINE":
            corners = _polyline(entity, closed=bool(int(values.get(70, 0)) & 1))
        else:
            start, end = (values[50], values[51]) if name == "ARC" else (0.0, 360.0)
            turn = math.radians((end - start) % 360 or 360.0)
            corners = _arc(np.array([values[10], values[20]]), values[40], math.radians(start), turn)
    except (KeyError, ValueError) as problem:
        if isinstance(problem, GeometryError):
            raise
        raise _wrong(path, f"draw its {name} again, its numbers are missing or none: {problem}") from problem
    if np.abs(corners[:, :2]).max() > most or np.abs(corners[:, 2]).max() > STEEP:
        raise _wrong(
            path, f"a {name} beyond {MOST_LENGTH:g} m, or with a bulge beyond {STEEP:g}; check its numbers and the unit"
        )
    return np.where((np.abs(corners) < FLAT) & (False, False, True), 0.0, corners)


def _arc(centre: Array, radius: float, start: float, turn: float) -> Array:
    """Return corners and bulges of an arc in pieces of at most half a circle."""
    count = max(1, math.ceil(turn / math.pi - 1e-9))
    angles = start + turn * np.arange(count + 1) / count
    points = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.column_stack([points, np.full(count + 1, math.tan(turn / count / 4))])


def _polyline(entity: Groups, *, closed: bool) -> Array:
    """Return the vertices (10, 20), each with the bulge (42) of the edge that follows."""
    corners: list[list[float]] = []
    for code, value in entity:
        if code == 10:
            corners.append([float(value), math.nan, 0.0])
        elif code in (20, 42) and corners:
            corners[-1][1 if code == 20 else 2] = float(value)
    points = np.array(corners)
    if len(points) < 2 or not np.isfinite(points).all():
        raise ValueError("at least two vertices are needed")
    return np.vstack([points, points[:1]]) if closed else points


MM: Final = 4  # $INSUNITS of millimetres
LAYER: Final = "0"
HEAD: Final = ((0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1015"), (9, "$INSUNITS"), (70, MM), (0, "ENDSEC"))


def write_outline(loops: Sequence[Array], path: Path) -> None:
    """Write closed loops (n, 3) of corners x, y [m] and bulges, as in `loops`, to a file, complete or not at all.

    Coordinates are written with all digits. Source: DXF reference of AutoCAD 2000 (AC1015).
    """
    write_whole(path, "".join(f"{code:>3}\n{value}\n" for code, value in _written_groups(loops)).encode("ascii"))


def _written_groups(loops: Sequence[Array]) -> Iterator[tuple[int, object]]:
    yield from HEAD
    yield from ((0, "SECTION"), (2, "ENTITIES"))
    for handle, loop in enumerate(loops, start=0x100):
        yield from ((0, "LWPOLYLINE"), (5, f"{handle:X}"), (100, "AcDbEntity"), (8, LAYER), (100, "AcDbPolyline"))
        yield from ((90, len(loop)), (70, 1))
        for x, y, bulge in loop.tolist():
            yield from ((10, 1e3 * x), (20, 1e3 * y), (42, bulge))
    yield from ((0, "ENDSEC"), (0, "EOF"))
