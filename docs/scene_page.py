"""Writes docs/scene.md from the models, so that it cannot lag behind (`make docs`)."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import AfterValidator, BaseModel, BeforeValidator
from pydantic.fields import FieldInfo

from impact.files.atomic import write_whole
from seatfem.fields import ReadQuantity, kind_of, read_temperature
from seatfem.structures.kinds.materials import Material
from seatfem.structures.kinds.parts import Registered
from seatfem.structures.kinds.selectors import ByColour
from seatfem.structures.named_materials import NAMED_MATERIALS
from seatfem.study.scene import Scene
from seatfem.study.scene.problems import leaves, tables_in
from seatfem.units import DIMENSIONS

_HEAD = """\
# Scene files

A scene is a TOML file. Quantities are strings with a unit (`"3 mm"`); pure numbers are bare (`0.1`) or percentages
(`"10 %"`). Unknown keys are errors, and all errors are reported at once, each with its line. Files are looked for from
the folder of the scene. This page is made from the program's own definitions (`make docs`).

"""
_MATERIALS = """\
Materials by name; a value beside the name overrules it, as in `material = { name = "steel", young = "210 GPa" }`. The
values are generic ones at room temperature: a casting may be a tenth off.

| name | E (GPa) | nu | density (kg/m^3) | source |
|---|---|---|---|---|
"""
_FACES = """\
## Faces

Faces of a CAD seat are named by colour, place, surface, name or number; `seatfem faces part.step` shows them, as
a table and as a picture with their numbers, and `seatfem faces scene.toml` those that a scene selects. A key that only
one kind of selector has stands for the kind:

    contact = { number = 7 }                                   # or { numbers = [7, 9] }
    fixed = { radius = "2.25 mm", several = true }             # all bolt holes, wherever their axes are
    fixed = { radius = "4 mm", axis_point = ["15 mm", "0 mm", "0 mm"] }
    contact = { normal = [0, 0, 1], offset = "14 mm", radius_max = "10 mm" }
    groups.rim = { colour = [0, 255, 0] }                      # for supports: on = "rim"
    contact = { of = [{ number = 3 }, { name = "SEAT" }] }

Numbers are places in the file's order: they stay as long as the file does, and may change with the next export.

"""
_PLAIN = {bool: "`true` or `false`", str: "text", int: "whole number", float: "number", Path: "file name"}
_NUMBERS = {2: "two", 3: "three", 4: "four"}
_COLUMNS = "| key | holds | default | meaning |\n|---|---|---|---|\n"


def scene_page() -> str:
    """The whole page, as Markdown. A table that stands in several others is described once, at the end."""
    tables = [(f"[{name}]", table) for name, field in Scene.model_fields.items() for table in _in_it(field)]
    sections = list(_once(tables))
    inner = dict.fromkeys(
        (name, part)
        for _, table in sections
        for name, field in _own(table).items()
        for part in tables_in(field.annotation)
    )
    parts = [_HEAD, "## Top level\n\n", _table(Scene)]
    parts += [_section(name, table) for name, table in sections]
    for name, table in _once(inner):
        if table is ByColour:
            parts.append(_FACES)
        parts.append(_section(f"{name} = {{ ... }}", table))
        if table is Material:
            parts.append(_named_materials())
    return "".join(parts).rstrip() + "\n"


def _own(table: type[BaseModel]) -> dict[str, FieldInfo]:
    """Its keys, but for a field whose own keys stand in its place: they are described under the same heading."""
    return {name: field for name, field in table.model_fields.items() if name != getattr(table, "inlined", "")}


def _in_it(field: FieldInfo) -> Iterator[type[BaseModel]]:
    """The tables that a key may hold, with those whose keys stand in them."""
    for table in tables_in(field.annotation):
        yield table
        if inlined := getattr(table, "inlined", ""):
            yield from tables_in(table.model_fields[inlined].annotation)


def _named_materials() -> str:
    rows = (
        f"| `{_toml(name)}` | {found.young / 1e9:g} | {found.poisson:g} | {found.density:g} | {found.source} |\n"
        for name, found in NAMED_MATERIALS.items()
    )
    return _MATERIALS + "".join(rows) + "\n"


def _once(inner: Iterable[tuple[str, type[BaseModel]]]) -> Iterator[tuple[str, type[BaseModel]]]:
    """Each table once, under all the names it goes by."""
    names: dict[type[BaseModel], list[str]] = {}
    for name, table in inner:
        names.setdefault(table, []).append(name)
    for table, known_as in names.items():
        yield ", ".join(known_as), table


def _section(name: str, table: type[BaseModel]) -> str:
    kind = f', kind = "{kind_of(table)}"' if "kind" in table.model_fields else ""
    return f"## {name}{kind}\n\n{' '.join((table.__doc__ or '').split())}\n\n{_table(table)}"


def _table(table: type[BaseModel]) -> str:
    rows = (
        f"| `{key}` | {_holds(field)} | {_default(field)} | {field.description or ''} |\n"
        for key, field in _own(table).items()
        if key != "kind"
    )
    return _COLUMNS + "".join(rows) + "\n"


def _holds(field: FieldInfo) -> str:
    if elements := _elements(field):
        return _several(field, elements)
    if tables_in(field.annotation):
        origin = get_origin(field.annotation)
        return "tables by name" if origin is dict else "list of tables" if origin is tuple else "table"
    if names := _registered(field):
        return names
    if (quantity := _measured(_notes(field))) is not None:
        return quantity
    options = [option for kind in leaves(field.annotation) if get_origin(kind) is Literal for option in get_args(kind)]
    if options:
        return ", ".join(f"`{_toml(option)}`" for option in options)
    return next(_PLAIN[kind] for kind in leaves(field.annotation) if kind in _PLAIN)


def _registered(field: FieldInfo) -> str:
    """The names that a registry has."""
    checks = [note.func for note in _notes(field) if isinstance(note, AfterValidator)]
    return ", ".join(f"`{_toml(name)}`" for each in checks if isinstance(each, Registered) for name in each.options)


def _measured(notes: Iterable[object]) -> str | None:
    """A quantity with its unit, or a number: what the reader among a key's notes takes."""
    for note in notes:
        if isinstance(note, BeforeValidator):
            reader: Any = note.func
            if reader is read_temperature:
                return 'temperature, `"20 degC"`'
            return _quantity(reader.dimension) if isinstance(reader, ReadQuantity) else "number"
    return None


def _elements(field: FieldInfo) -> tuple[Any, ...]:
    """The types of a list of a fixed number of values, or of any number of plain ones (two, for "and so on")."""
    for kind in (field.annotation, *get_args(field.annotation)):
        if get_origin(kind) is tuple and not tables_in(kind):
            return get_args(kind)
    return ()


def _several(field: FieldInfo, elements: tuple[Any, ...]) -> str:
    """How many of what, with an example."""
    first = elements[0]
    any_number = elements[1:] == (Ellipsis,)
    if get_origin(first) is tuple and get_args(first)[1:] == (Ellipsis,):
        inner = get_args(get_args(first)[0])
        shown = _toml((field.examples or [[]])[0])
        return f"list of lists of lists of {_NUMBERS[len(inner)]} {_dimension(inner[0])}s, `{shown}`"
    if get_origin(first) is tuple:
        count, inner = "" if any_number else f"{_NUMBERS[len(elements)]} ", get_args(first)
        if len(mixed := dict.fromkeys(map(_dimension, inner))) > 1:
            return f"list of {count}pairs of {' and '.join(mixed)}"
        shown = f", `{_toml(field.examples[0])}`" if field.examples else ""
        return f"list of {count}lists of {_NUMBERS[len(inner)]} {_dimension(inner[0])}s{shown}"
    if any_number and get_origin(first) is Annotated and (dimension := _dimension(first)) in DIMENSIONS:
        return f"list of {dimension}s, `{_toml([DIMENSIONS[dimension].example] * 2)}`"
    if any_number:
        return f"list of {_one_of(first)}"
    dimension = _dimension(first)
    example = (field.examples or [[DIMENSIONS[dimension].example] * len(elements)])[0]
    return f"list of {_NUMBERS[len(elements)]} {dimension}s, `{_toml(example)}`"


def _dimension(kind: Any) -> str:
    """Of a quantity; of a plain value what it is."""
    return (_measured(get_args(kind)[1:]) or _PLAIN[next(iter(leaves(kind)))]).partition(",")[0]


def _one_of(kind: Any) -> str:
    if get_origin(kind) is Literal:
        return ", ".join(f"`{_toml(option)}`" for option in get_args(kind))
    return f"{_PLAIN[next(iter(leaves(kind)))]}s"


def _quantity(dimension: str) -> str:
    return f'{dimension}, `"{DIMENSIONS[dimension].example}"`'


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    if field.default is None:
        return "absent"
    if field.default == () or (field.default == {} and get_origin(field.annotation) is dict):
        return "none"
    if isinstance(field.default, BaseModel) or field.default == {}:
        return "see below"
    return f"`{_toml(field.default)}`"


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(part)}" for key, part in value.items()) + " }"
    return f'"{value}"' if isinstance(value, str) else str(value)


def _notes(field: FieldInfo) -> Iterator[object]:
    """What is annotated to the field, or to one side of `... | None`."""
    yield from field.metadata
    for kind in get_args(field.annotation):
        if get_origin(kind) is Annotated:
            yield from get_args(kind)[1:]


if __name__ == "__main__":
    write_whole(sys.argv[1], scene_page().encode("utf-8"))
