"""Values read of a scene, with units and the ranges of its records: a wrong column or unit shows before computing."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from rich.table import Table

from impact.files.csv_table import read_csv
from impact.quantities import in_digits
from seatfem.fields import kind_of
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.motion import Record, Recorded
from seatfem.study.scene import Contact, Scene
from seatfem.study.scene.external import AreaByLift
from seatfem.study.scene.files import check_files
from seatfem.study.scene.keys import dimension_of
from seatfem.units import write_quantity

SHOWN: Final = 4  # values of a list; of longer ones their number and range
HOW: Final = ("run", "accuracy", "title")
"""Tables and keys that the plan's own table tells."""
STRENGTHS: Final = ("strength", "seat_strength")
NOT_SHOWN: Final = ("kind", "name", "mesh", "greens")
_NONE: Final = FieldInfo(default=None)


def read_back(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Return the scene as rows (key, value), key by key as the file states them, with the struck face of each body.

    Raises:
        SceneError: a file that cannot be read, or has no such face.
    """
    check_files(scene)
    return tuple(_rows(scene))


def read_table(scene: Scene) -> Table | None:
    """Return the same for a terminal, where anything is read from files; ``None`` of others; raises as `read_back`."""
    if not any(_files_in(scene)):
        return None
    table = Table("table", "what was read")
    for name, words in read_back(scene):
        table.add_row(name, words)
    return table


def _files_in(value: object) -> Iterator[Path]:
    """Yield the files that a table, and the tables in it, name."""
    if isinstance(value, Path):
        yield value
    inner = vars(value).values() if isinstance(value, BaseModel) else value if isinstance(value, tuple | list) else ()
    for each in inner.values() if isinstance(inner, Mapping) else inner:
        yield from _files_in(each)


def _rows(scene: Scene) -> Iterator[tuple[str, str]]:
    for key in type(scene).model_fields:
        value = getattr(scene, key)
        tables = value if isinstance(value, tuple) else (value,)
        for number, table in enumerate(tables, start=1):
            if key in HOW or not isinstance(table, BaseModel) or not (words := _words(table, key)):
                continue
            yield (f"{key} {number}" if len(tables) > 1 else key), words
            if isinstance(table, Structure) and (face := _struck(table, along=key == "seat" and scene.contact)):
                yield f"{key}, face", face


def _struck(body: Structure, along: Contact | Literal[False]) -> str:
    """Return what is known of a body's struck face, and of a response that was measured, without any mesh."""
    facts = []
    if (ring := body.struck_ring) is not None:
        mean, width = (write_quantity(size, "length") for size in ring)
        facts.append(f"flat ring, mean radius {mean}, width {width}")
    elif along and along.along_a_lip and (lip := body.lip()) is not None:
        facts.append(f"lip {write_quantity(lip.length, 'length')} long")
    if (patch := body.patch()) is not None:
        about, digits = ("", 5) if ring else ("about ", 2)  # of coarse flat triangles
        area, width = write_quantity(patch.area, "area", digits), write_quantity(patch.width, "length", digits)
        facts.append(f"area {about}{area}, narrowest width {about}{width}")
    if (response := body.measured()) is not None:
        first, last = (write_quantity(float(f), "frequency") for f in (response.frequency[0], response.frequency[-1]))
        facts.append(f"response at {len(response.frequency)} frequencies, {first} to {last}")
    return "; ".join(facts)


def _words(table: BaseModel, key: str = "") -> str:
    """Return the kind or name of a table, then each key that the file states, in the order of docs/scene.md."""
    kind = kind_of(type(table)) if type(table).model_fields.get("kind", _NONE).is_required() else ""
    first = [getattr(table, "name", None) or kind.replace("_", " ")]
    facts = []
    for name, field in type(table).model_fields.items():
        value = getattr(table, name)
        if name not in table.model_fields_set or name in NOT_SHOWN or value is None or value in ((), {}, ""):
            continue
        if name == getattr(table, "inlined", ""):
            first.append(_words(value, key))
        elif name == kind and not isinstance(value, BaseModel):
            first.append(_value(value, field, f"{key}.{name}"))
        else:
            facts.append(f"{name.replace('_', ' ')} {_value(value, field, f'{key}.{name}')}")
    if isinstance(table, Recorded) and (record := table.record()) is not None:
        facts.append(_understood(record))
    return ", ".join(filter(None, (" ".join(filter(None, first)), *facts)))


def _understood(record: Record) -> str:
    """Return the range of a course and of its times, in the units that the program has read."""
    course, dimension = record.course, "length" if record.quantity == "displacement" else record.quantity
    low, high = (write_quantity(float(end), dimension) for end in (course.value.min(), course.value.max()))
    first, last = (write_quantity(float(end), "time") for end in (course.time[0], course.time[-1]))
    over = f"repeated every {write_quantity(course.period, 'time')}" if course.period else f"from {first} to {last}"
    return f"read as {record.quantity} {low} to {high} {over}"


def _value(value: object, field: FieldInfo, key: str) -> str:
    if isinstance(value, AreaByLift) and len(value.area) == 1:  # constant
        return write_quantity(value.area[0], "area")
    if isinstance(value, BaseModel):
        inner, named = _words(value, key), bool(getattr(value, "name", ""))
        return inner.replace(", ", " (", 1) + ")" * (", " in inner) if named else f"({inner})"
    if isinstance(value, Path):
        return _file(value, key)
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_value(each, field, key)}" for name, each in value.items())
    if isinstance(value, tuple):
        return _several(value, field, key)
    if isinstance(value, bool):
        return "yes" if value else "no"
    return write_quantity(value, dimension_of(field)) if isinstance(value, float) else str(value)


def _several(values: tuple[Any, ...], field: FieldInfo, key: str) -> str:
    if len(values) <= SHOWN or not all(isinstance(each, float) for each in values):
        text = ", ".join(_value(each, field, key) for each in values[:SHOWN])
        return f"[{text}{f', ... {len(values)} in all' if len(values) > SHOWN else ''}]"
    return f"{len(values)} from {_value(min(values), field, key)} to {_value(max(values), field, key)}"


def _file(path: Path, key: str) -> str:
    """Return a file's name; of columns their number of rows and ranges too, of a file of strength what it holds."""
    if key.rpartition(".")[2] in STRENGTHS:
        from seatfem.study.scene.load import load_table  # of scenes with a life only
        from seatfem.study.scene.strength import StrengthTable

        return f"{path.name} ({_words(load_table(path, StrengthTable), key)})"
    if path.suffix.lower() == ".csv" and (columns := _columns(path)):
        return f"{path.name} ({columns})"
    return f"{path.name} ({math.ceil(path.stat().st_size / 1000):,} kB)"


def _columns(path: Path) -> str:
    """Return the number of rows and the range of each column; "" for a table without heads or of other cells."""
    try:
        table = read_csv(path, ValueError)
        numbers = np.zeros((0, 0)) if table is None else table.numbers()
    except ValueError:
        return ""
    if table is None or not numbers.size:
        return ""
    ranges = zip(table.heads, numbers.min(axis=0), numbers.max(axis=0), strict=True)
    columns = ", ".join(f"{head.text} {in_digits(low, 6)} to {in_digits(high, 6)}" for head, low, high in ranges)
    return f"{len(numbers)} rows, {table.dialect}: {columns}"
