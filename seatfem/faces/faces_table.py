"""The faces of a part as a table, on the terminal and as CSV."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from impact.files.table import csv_text
from seatfem.structures.inspection.cad import FoundFace
from seatfem.structures.inspection.parts import Part

COLUMNS = ("number", "surface", "area", "centre", "normal or axis", "radius", "colour", "name", "groups")
UNITS = ("", "", "mm^2", "mm", "", "mm", "red, green, blue", "", "")


def faces_table(part: Part) -> Table:
    """Return a table of one row a face; columns that hold nothing are left out."""
    rows = [_cells(face) for face in part.faces]
    shown = [column for column in range(len(COLUMNS)) if any(row[column] for row in rows)]
    table = Table(*(_head(column, "({})") for column in shown))
    for row in rows:
        table.add_row(*(Text(row[column]) for column in shown))
    return table


def faces_csv(part: Part) -> str:
    """Return the same as comma-separated values, all columns."""
    return csv_text((_head(column, "[{}]") for column in range(len(COLUMNS))), map(_cells, part.faces))


def _head(column: int, brackets: str) -> str:
    return f"{COLUMNS[column]} {brackets.format(UNITS[column])}" if UNITS[column] else COLUMNS[column]


def _cells(face: FoundFace) -> tuple[str, ...]:
    half_angle = 0.0 if face.axis is None else face.axis[2]
    direction = "" if face.axis is None else f"a {_triple(face.axis[1], 1e-6)}"
    return (
        " = ".join(map(str, face.numbers)),
        f"cone of {math.degrees(half_angle):.4g} deg" if half_angle > 0 else face.kind.lower(),
        f"{1e6 * face.area:.5g}",
        _triple([1e3 * c for c in face.centre], 1e-4),
        direction if face.normal is None else f"n {_triple(face.normal, 1e-6)}",
        " to ".join(dict.fromkeys(f"{1e3 * radius:.5g}" for radius in face.radii or ())),
        "" if face.colour is None else ", ".join(map(str, face.colour[:3])),
        face.name,
        ", ".join(face.groups),
    )


def _triple(values: Sequence[float], zero: float) -> str:
    """Return three values as text; round-off counts as zero."""
    return ", ".join(f"{value:.4g}" if abs(value) > zero else "0" for value in values)
