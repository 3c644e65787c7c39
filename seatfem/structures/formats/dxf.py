"""Outlines in DXF files: curves that form closed loops, read by ezdxf, and written."""

from __future__ import annotations

import io
import logging
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np

from impact.files.safe_files import MB, read_text, write_whole
from impact.greens.base import Array
from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes import loops

LARGEST: Final = 8 * MB
MOST_ENTITIES: Final = 20_000  # ezdxf takes 0.1 ms for each
MOST_CORNERS: Final = 10_000  # largest number of corners of all curves: each end is compared with all others
MOST_LENGTH: Final = 1e3  # largest coordinate [m]
DEEPEST: Final = 16  # most blocks within each other
FLAT: Final = 1e-9  # bulge below which an edge is straight
STEEP: Final = 1e4  # bulge above which an arc is a full circle
CLOSE: Final = 1e-4  # largest distance of a spline from its chords, over its size
ARCS: Final = 129  # points of an ellipse, three for each arc: chords would be off by 1.5e-4 of its size
UNITS: Final = {1: 0.0254, 2: 0.3048, 4: 1e-3, 5: 1e-2, 6: 1.0, 9: 2.54e-5, 13: 1e-6, 14: 0.1}  # metres, by $INSUNITS
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
BESIDE: Final = re.compile(
    "INSERT|POINT|M?TEXT|ATTRIB|ATTDEF|(ARC_)?DIMENSION|(MULTI)?LEADER|TOLERANCE|ACAD_TABLE|HATCH|VIEWPORT|XLINE|RAY|"
    "IMAGE|WIPEOUT|OLE2?FRAME|(PDF|DWF|DGN)UNDERLAY|LIGHT|SUN|GEODATA"
)
"""Entities that are no curves of a part: texts, dimensions, construction lines, pictures; what an INSERT inserts is."""
CLIPPED: Final = "ACAD_FILTER"  # key of a clipping path
FRAME: Final = 16  # flag of a vertex that is the control point of a spline


def read_outline(path: Path, unit: float = 0.0) -> tuple[Array, ...]:
    """Return closed loops (n, 3) of corners x, y [m] and bulges, the outline first, then its holes.

    Arcs stay arcs; ellipses become arcs, splines chords. Blocks count where they are inserted, as often as they are.

    Args:
        path: an ASCII file.
        unit: metres per unit of the drawing; 0: as stated in its header ($INSUNITS).

    Raises:
        GeometryError: no DXF file, no unit, entities that are no curves in the plane, an outline that is open.
    """
    from ezdxf import filemanagement  # ezdxf loads for half a second

    if not (log := logging.getLogger("ezdxf")).handlers:
        log.addHandler(logging.NullHandler())  # else its warnings are printed
    text = read_text(path, LARGEST, GeometryError, errors="replace")
    try:
        _check_pairs(text)
        drawing = filemanagement.read(io.StringIO(text))
        scale = unit or UNITS.get(drawing.header.get("$INSUNITS"), 0.0)
        if not scale:
            raise GeometryError('its header states no length unit that is known; state it: unit = "mm"')
        return _outlines(drawing.modelspace(), scale)
    except Exception as problem:  # whatever a damaged file provokes
        own = isinstance(problem, GeometryError)
        words = problem if own else f"not readable ({problem}); export it again, as ASCII DXF"
        raise GeometryError(f"Outlined.file = {path.name}: {words}") from problem


def _check_pairs(text: str) -> None:
    """Raise `GeometryError` for what ezdxf takes long for, or passes over."""
    codes, values = ([line.strip() for line in text.split("\n")[first::2]] for first in (0, 1))
    if not codes[0].isdecimal():
        raise GeometryError("no DXF file of pairs of codes and values; save it as ASCII DXF")
    if codes.count("0") > MOST_ENTITIES:
        raise GeometryError(f"more than {MOST_ENTITIES} entities; keep the outline and its holes alone")
    if values.count("ENTITIES") > 1:
        raise GeometryError("several sections ENTITIES; export it again")


def _outlines(entities: Iterable[Any], scale: float) -> tuple[Array, ...]:
    chains, corners = [], 0
    for count, entity in enumerate(_with_blocks(entities)):
        if not BESIDE.fullmatch(entity.dxftype()):
            chains.append(_chain(entity, MOST_LENGTH / scale))
            corners += len(chains[-1])
        if count > MOST_ENTITIES or corners > MOST_CORNERS:
            raise GeometryError(
                f"more than {MOST_ENTITIES} entities with those of its blocks, or {MOST_CORNERS} corners of its "
                "curves; keep the outline and its holes alone"
            )
    if not (chains := [chain for chain in chains if len(chain) > 1]):
        raise GeometryError(f"no {', '.join(REQUIRED)} among its entities; draw its outline with these")

    def open_at(point: Array) -> GeometryError:
        x, y = 1e3 * scale * point
        return GeometryError(f"its outline is open at ({x:.6g}, {y:.6g}) mm: nothing goes on from there; close it")

    return tuple(loop * (scale, scale, 1.0) for loop in loops.outlines(chains, open_at))


def _with_blocks(entities: Iterable[Any], depth: int = 0) -> Iterator[Any]:
    """Yield every entity, and those of the blocks that are inserted."""
    for entity in entities:
        yield entity
        if entity.dxftype() == "INSERT":
            block, dictionary = entity.block(), entity.get_extension_dict() if entity.has_extension_dict else ()
            absent = block is None or block.block.is_xref
            if absent or depth == DEEPEST or entity.mcount > MOST_ENTITIES or CLIPPED in dictionary:
                raise GeometryError(
                    f"the block {entity.dxf.get('name')!r} is not in the file, lies in {DEEPEST} others, is clipped or "
                    "in a large array; bind or explode it"
                )
            entity.dxf.zscale = entity.dxf.zscale or 1.0  # drawings in the plane may have 0
            several = entity.mcount > 1
            parts = entity.multi_insert() if several else entity.virtual_entities(skipped_entity_callback=_refuse)
            yield from _with_blocks(parts, depth + 1)


def _refuse(entity: Any, reason: str) -> None:
    """Raise `GeometryError` for an entity of a part that is no curve of an outline."""
    if not BESIDE.fullmatch(entity.dxftype()):
        raise GeometryError(
            f"a {entity.dxftype()} ({reason}); an outline may have {', '.join(REQUIRED)}: explode or convert it"
        )


def _chain(entity: Any, most: float) -> Array:
    """Return the corners and bulges (n, 3) of a curve, the first again at the end of a closed one."""
    name, dxf = entity.dxftype(), entity.dxf
    if name not in REQUIRED or (name == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline)):
        _refuse(entity, "no curve in the plane")
    if missing := [key for key in REQUIRED[name] if not dxf.hasattr(key)]:
        _refuse(entity, f"its {missing[0]} is missing")
    if name not in ("LINE", "SPLINE") and dxf.extrusion.vec2.magnitude > FLAT:
        _refuse(entity, "drawn in another plane: flatten it")
    with np.errstate(all="ignore"):  # numbers are judged by what becomes of them
        try:
            chain = _corners(entity)
        except (ArithmeticError, RecursionError):
            chain = np.full((1, 3), np.nan)
    if not (np.abs(chain) <= (most, most, STEEP)).all():
        raise GeometryError(
            f"a {name} whose numbers must be finite, within {MOST_LENGTH:g} m and with bulges up to {STEEP:g}; "
            "check its numbers and the unit"
        )
    return np.where((np.abs(chain) < FLAT) & (False, False, True), 0.0, chain)


def _corners(entity: Any) -> Array:
    name, dxf = entity.dxftype(), entity.dxf
    if name == "LINE":
        return np.array([(*dxf.start.vec2, 0.0), (*dxf.end.vec2, 0.0)])
    if name in ("ARC", "CIRCLE"):
        start, end = (dxf.start_angle, dxf.end_angle) if name == "ARC" else (0.0, 360.0)
        turn = (end - start) % 360 or 360.0
        degrees = start + turn * np.linspace(0.0, 1.0, 3 if turn < 180 + FLAT else 5)  # arcs of up to half a circle
        return loops.arcs_through(_drop_height(entity.vertices(degrees)))
    if name == "ELLIPSE":
        tool = entity.construction_tool()
        turn = (tool.end_param - tool.start_param) % math.tau or math.tau
        return loops.arcs_through(_drop_height(tool.vertices(tool.start_param + turn * np.linspace(0.0, 1.0, ARCS))))
    if name == "SPLINE":
        size = np.ptp(_drop_height(entity.construction_tool().control_points), axis=0).max()
        points = _drop_height(islice(entity.flattening(CLOSE * size), MOST_CORNERS + 1))
        return np.column_stack([points, np.zeros(len(points))])
    if name == "LWPOLYLINE":
        rows, closed = entity.get_points("xyb"), entity.closed
    else:
        vertices = [each.dxf for each in entity.vertices if not each.dxf.flags & FRAME]
        rows, closed = [(*each.location.vec2, each.bulge) for each in vertices], entity.is_closed
    corners = np.array(rows, dtype=float).reshape(-1, 3) * ((1, 1, 1) if dxf.extrusion.z > 0 else (-1, 1, -1))
    return np.vstack([corners, corners[:1]]) if closed else corners


def _drop_height(points: Iterable[Any]) -> Array:
    return np.array([point.vec2 for point in points])


HEAD: Final = ((0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1015"), (9, "$INSUNITS"), (70, 4), (0, "ENDSEC"))


def write_outline(loops: Sequence[Array], path: Path) -> None:
    """Write closed loops (n, 3) of corners x, y [m] and bulges, as in `loops`, to a file in millimetres, complete or
    not at all.

    Coordinates are written with all digits. Source: DXF reference of AutoCAD 2000 (AC1015).
    """
    groups: list[tuple[int, object]] = [*HEAD, (0, "SECTION"), (2, "ENTITIES")]
    for handle, loop in enumerate(loops, start=0x100):
        groups += [(0, "LWPOLYLINE"), (5, f"{handle:X}"), (100, "AcDbEntity"), (8, "0"), (100, "AcDbPolyline")]
        groups += [(90, len(loop)), (70, 1)]
        groups += [pair for x, y, b in loop.tolist() for pair in ((10, 1e3 * x), (20, 1e3 * y), (42, b))]
    groups += [(0, "ENDSEC"), (0, "EOF")]
    write_whole(path, "".join(f"{code:>3}\n{value}\n" for code, value in groups).encode("ascii"))
