"""Outlines as DXF: closed polylines (LWPOLYLINE) in millimetres, arcs by their bulges, as `read_outline` reads them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from impact.files.atomic import write_whole
from impact.greens.base import Array

MM: Final = 4  # $INSUNITS
LAYER: Final = "0"
HEAD: Final = ((0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1015"), (9, "$INSUNITS"), (70, MM), (0, "ENDSEC"))


def write_outline(loops: Sequence[Array], path: Path) -> None:
    """Write closed loops (n, 3) of corners x, y [m] and bulges, `seatfem.structures.shapes.loops`; whole or absent.

    Coordinates have all their digits. Source: DXF reference of AutoCAD 2000 (AC1015).
    """
    write_whole(path, "".join(f"{code:>3}\n{value}\n" for code, value in _groups(loops)).encode("ascii"))


def _groups(loops: Sequence[Array]) -> Iterator[tuple[int, object]]:
    yield from HEAD
    yield from ((0, "SECTION"), (2, "ENTITIES"))
    for handle, loop in enumerate(loops, start=0x100):
        yield from ((0, "LWPOLYLINE"), (5, f"{handle:X}"), (100, "AcDbEntity"), (8, LAYER), (100, "AcDbPolyline"))
        yield from ((90, len(loop)), (70, 1))
        for x, y, bulge in loop.tolist():
            yield from ((10, 1e3 * x), (20, 1e3 * y), (42, bulge))
    yield from ((0, "ENDSEC"), (0, "EOF"))
