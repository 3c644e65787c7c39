"""Outlines in DXF files: curves that form closed loops, read by ezdxf, and written."""

from __future__ import annotations

import io
import logging
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from impact.files.safe_files import MB, read_text, write_whole
from impact.greens.base import Array
from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes import loops

JOINED: Final = 1e-6  # largest distance of end points that count as one, over the outline's size
LARGEST: Final = 8 * MB
MOST_ENTITIES: Final = 20_000  # ezdxf takes 0.1 ms for each
MOST_CORNERS: Final = 10_000  # largest number of corners of all curves: each end is compared with all others
MOST_LENGTH: Final = 1e3  # largest coordinate and radius [m]
DEEPEST: Final = 16  # most blocks within each other
FLAT: Final = 1e-9  # bulge below which an edge is straight
STEEP: Final = 1e4  # bulge above which an arc is a full circle
CLOSE: Final = 1e-4  # largest distance of a spline or ellipse from the arcs in its place, over its size
MOST_ARCS: Final = 64  # of a piece between two knots
UNITS: Final = {
    1: 0.0254,
    2: 0.3048,
    4: 1e-3,
    5: 1e-2,
    6: 1.0,
    9: 2.54e-5,
    13: 1e-6,
    14: 0.1,
}  # metres per unit, by $INSUNITS
REQUIRED: Final = {
    "LINE": ("start", "end"),
    "ARC": ("center", "radius", "start_angle", "end_angle"),
    "CIRCLE": ("center", "radius"),
    "LWPOLYLINE": (),
    "POLYLINE": (),
    "SPLINE": (),
    "ELLIPSE": ("center", "major_axis", "ratio"),
}
"""Curves that an outline may have, and the numbers without which each has no shape."""
BESIDE: Final = frozenset(
    (
        *(
            "INSERT",
            "POINT",
            "TEXT",
            "MTEXT",
            "ATTRIB",
            "ATTDEF",
            "DIMENSION",
            "ARC_DIMENSION",
            "LEADER",
            "MULTILEADER",
        ),
        *("TOLERANCE", "ACAD_TABLE", "HATCH", "VIEWPORT", "XLINE", "RAY", "IMAGE", "WIPEOUT", "OLEFRAME", "OLE2FRAME"),
        *("PDFUNDERLAY", "DWFUNDERLAY", "DGNUNDERLAY", "LIGHT", "SUN", "GEODATA"),
    )
)
"""Entities that are no curves of a part: texts, dimensions, construction lines, pictures; what an INSERT inserts is."""


def read_outline(path: Path, unit: float | None = None) -> tuple[Array, ...]:
    """Return closed loops (n, 3) of corners x, y [m] and bulges, the outline first, then its holes.

    Arcs stay arcs; splines and ellipses become arcs. Blocks count where they are inserted, as often as they are.

    Args:
        path: an ASCII file.
        unit: metres per unit of the drawing; ``None``: as stated in its header ($INSUNITS).

    Raises:
        GeometryError: no DXF file, no unit, entities that are no curves in the plane, an outline that is open.
    """
    from ezdxf import filemanagement  # ezdxf loads for half a second

    if not (log := logging.getLogger("ezdxf")).handlers:
        log.addHandler(logging.NullHandler())  # else its warnings are printed
    text = read_text(path, LARGEST, GeometryError, errors="replace")
    _check_size(text, path)
    try:
        drawing = filemanagement.read(io.StringIO(text))
        scale = _unit(drawing.header.get("$INSUNITS"), path) if unit is None else unit
        chains = list(_chains(drawing.modelspace(), path, MOST_LENGTH / scale))
    except GeometryError:
        raise
    except Exception as problem:  # whatever a damaged file provokes
        raise _wrong(path, f"not readable ({problem}); export it again, as ASCII DXF") from problem
    if not chains:
        raise _wrong(path, f"no {', '.join(REQUIRED)} among its entities; draw its outline with these")

    def open_at(point: Array) -> GeometryError:
        x, y = 1e3 * scale * point
        return _wrong(path, f"its outline is open at ({x:.6g}, {y:.6g}) mm: nothing goes on from there; close it")

    within = JOINED * float(np.ptp(np.concatenate(chains)[:, :2], axis=0).max())
    outlines = [loop * (scale, scale, 1.0) for loop in loops.closed(chains, within, open_at)]
    return tuple(sorted(outlines, key=lambda loop: -abs(loops.area(loop))))


def _wrong(path: Path, what: str) -> GeometryError:
    return GeometryError(f"Outlined.file = {path.name}: {what}")


def _crowded(path: Path, what: str) -> GeometryError:
    return _wrong(path, f"{what}; keep the outline and its holes alone")


def _check_size(text: str, path: Path) -> None:
    """Raise `GeometryError` for a text that is no pairs of lines, or holds more entities than are read, or such that
    ezdxf passes over."""
    if text.startswith("AutoCAD Binary DXF"):
        raise _wrong(path, "a binary DXF file; save it as ASCII")
    codes, values = ([line.strip() for line in text.split("\n")[first::2]] for first in (0, 1))
    if not codes[0].isdecimal():
        raise _wrong(path, "no DXF file: its lines are no pairs of codes and values; save it as ASCII DXF")
    if codes.count("0") > MOST_ENTITIES:
        raise _crowded(path, f"more than {MOST_ENTITIES} entities")
    if values.count("ENTITIES") > 1:
        raise _wrong(path, "several sections ENTITIES; export it again")


def _unit(code: object, path: Path) -> float:
    if not isinstance(code, int) or code not in UNITS:
        raise _wrong(path, 'its header states no length unit that is known; state it: unit = "mm"')
    return UNITS[code]


def _chains(entities: Iterable[Any], path: Path, most: float) -> Iterator[Array]:
    """Yield the corners and bulges (n, 3) of every curve, the first again at the end of a closed one."""
    corners = 0
    for count, entity in enumerate(_with_blocks(entities, path)):
        if count > MOST_ENTITIES:
            raise _crowded(path, f"more than {MOST_ENTITIES} entities with those of its blocks")
        name = entity.dxftype()
        if name in BESIDE:
            continue
        if name not in REQUIRED:
            raise _wrong(path, f"a {name}; an outline may have {', '.join(REQUIRED)}: explode or convert it")
        if missing := [each for each in REQUIRED[name] if not entity.dxf.hasattr(each)]:
            raise _wrong(path, f"draw its {name} again, its {missing[0]} is missing")
        with np.errstate(all="ignore"):  # numbers are judged by what becomes of them
            chain = _chain(entity, path, most)
        corners += len(chain)
        if corners > MOST_CORNERS:
            raise _crowded(path, f"its curves have more than {MOST_CORNERS} corners")
        if len(chain) > 1:
            yield np.where((np.abs(chain) < FLAT) & (False, False, True), 0.0, chain)


def _with_blocks(entities: Iterable[Any], path: Path, depth: int = 0) -> Iterator[Any]:
    """Yield every entity, and those of the blocks that are inserted."""

    def refuse(entity: Any, reason: str) -> None:
        if entity.dxftype() not in BESIDE:
            raise _wrong(path, f"a {entity.dxftype()} in a block: {reason}; explode it")

    for entity in entities:
        yield entity
        if entity.dxftype() == "INSERT":
            block = entity.block()
            if depth == DEEPEST or block is None or block.block.is_xref:
                why = f"lies in {DEEPEST} others" if depth == DEEPEST else "is not in the file"
                raise _wrong(path, f"the block {entity.dxf.get('name')!r} {why}; explode or bind it")
            if entity.mcount > MOST_ENTITIES or (entity.has_extension_dict and CLIPPED in entity.get_extension_dict()):
                raise _wrong(path, f"the block {entity.dxf.name!r} is clipped, or in a large array; explode it")
            entity.dxf.zscale = entity.dxf.zscale or 1.0  # drawings in the plane may have 0
            several = entity.mcount > 1
            parts = entity.multi_insert() if several else entity.virtual_entities(skipped_entity_callback=refuse)
            yield from _with_blocks(parts, path, depth + 1)


def _chain(entity: Any, path: Path, most: float) -> Array:
    name, dxf = entity.dxftype(), entity.dxf
    if name == "LINE":
        corners = np.array([(*dxf.start.vec2, 0.0), (*dxf.end.vec2, 0.0)])
    elif name in ("ARC", "CIRCLE"):
        start, end = (dxf.start_angle, dxf.end_angle) if name == "ARC" else (0.0, 360.0)
        turn = math.radians((end - start) % 360 or 360.0) if math.isfinite(end - start) else math.nan
        corners = _arc(np.array(dxf.center.vec2), dxf.radius, math.radians(start), turn)
    elif name == "LWPOLYLINE":
        corners = _closed(entity.get_points("xyb"), entity.closed)
    elif name == "POLYLINE":
        if not (entity.is_2d_polyline or entity.is_3d_polyline):
            raise _wrong(path, f"a {entity.get_mode()}; an outline may have {', '.join(REQUIRED)}: convert it")
        vertices = [each.dxf for each in entity.vertices if not each.dxf.flags & FRAME]
        corners = _closed([(*each.location.vec2, each.bulge) for each in vertices], entity.is_closed)
    else:
        corners = _curved(entity, path, most)
    _check_numbers(corners, name, path, most)
    if name in ("LINE", "SPLINE", "ELLIPSE"):
        return corners
    x, y, z = dxf.extrusion
    if abs(x) + abs(y) > FLAT:
        raise _wrong(path, f"a {name} that is drawn in another plane; flatten it")
    return corners if z > 0 else corners * (-1, 1, -1)


CLIPPED: Final = "ACAD_FILTER"  # key of a clipping path
FRAME: Final = 16  # flag of a vertex that is the control point of a spline


def _check_numbers(corners: Array, name: str, path: Path, most: float) -> None:
    if not np.isfinite(corners).all():
        raise _wrong(path, f"a {name} whose numbers must be finite")
    if np.abs(corners[:, :2]).max(initial=0) > most or np.abs(corners[:, 2:]).max(initial=0) > STEEP:
        raise _wrong(
            path, f"a {name} beyond {MOST_LENGTH:g} m, or with a bulge beyond {STEEP:g}; check its numbers and the unit"
        )


def _closed(rows: Sequence[Sequence[float]], closed: bool) -> Array:
    points = np.array(rows, dtype=float).reshape(-1, 3)
    return np.vstack([points, points[:1]]) if closed else points


def _arc(centre: Array, radius: float, start: float, turn: float) -> Array:
    """Return corners and bulges of an arc in pieces of at most half a circle."""
    count = max(1, math.ceil(turn / math.pi - 1e-9)) if math.isfinite(turn) else 1
    angles = start + turn * np.arange(count + 1) / count
    points = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.column_stack([points, np.full(count + 1, math.tan(turn / count / 4))])


def _curved(entity: Any, path: Path, most: float) -> Array:
    """Return arcs in place of a spline or an ellipse."""
    name, tool = entity.dxftype(), entity.construction_tool()
    if name == "SPLINE":
        _check_numbers(np.array([(*point.vec2, 0.0) for point in tool.control_points]), name, path, most)
        knots = np.array(tool.knots())
        knots, points_at = np.unique(knots[tool.order - 1 : len(tool.control_points) + 1]), tool.points
    else:
        _check_numbers(np.array([(*tool.center.vec2, 0.0), (*tool.major_axis.vec2, 0.0)]), name, path, most)
        turn = (tool.end_param - tool.start_param) % math.tau or math.tau
        knots, points_at = tool.start_param + turn * np.arange(5) / 4, tool.vertices
    if not np.isfinite(knots).all() or len(knots) < 2:
        raise _wrong(path, f"a {name} whose numbers must be finite; draw it again")
    return _as_arcs(lambda at: np.array([point.vec2 for point in points_at(at)]), knots, path)


def _as_arcs(points_at: Callable[[Array], Array], knots: Array, path: Path) -> Array:
    """Return corners and bulges of arcs through points of a curve that is smooth between its knots, as many as follow
    it closely."""
    pieces = 1
    while pieces <= MOST_ARCS and pieces * len(knots) <= MOST_CORNERS:
        share = np.arange(4 * pieces) / (4 * pieces)
        at = np.append((knots[:-1, None] + np.diff(knots)[:, None] * share).ravel(), knots[-1])
        points = points_at(at)
        corners = loops.arcs_through(points[::2])
        start, end, bends = points[:-1:4], points[4::4], 2 * np.arctan(corners[:-1, 2])
        off = [
            (loops.bend(start, middle, end) - bends) * _norm(middle - start) * _norm(end - middle) / _norm(end - start)
            for middle in (points[1::4], points[3::4])
        ]
        if np.abs(off).max() <= CLOSE * np.ptp(points, axis=0).max():
            return corners
        pieces *= 2
    raise _wrong(path, f"a curve that {pieces // 2 * (len(knots) - 1)} arcs do not follow; draw it with lines and arcs")


def _norm(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=1))


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
