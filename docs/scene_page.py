"""Writes docs/scene.md from the models, so that it cannot lag behind (`make docs`)."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from impact.files.atomic import write_whole
from seatfem.fields import kind_of
from seatfem.structures.kinds.materials import Material
from seatfem.structures.kinds.selectors import ByColour
from seatfem.structures.named_materials import NAMED_MATERIALS
from seatfem.study.scene import Scene
from seatfem.study.scene.keys import as_toml, default_of, holds, own_keys
from seatfem.study.scene.problems import tables_in

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
_DRAWING = """\
`seatfem draw scene.toml` shows where the two meet: in section, and in plan with the arcs and the axis of the tilt.

![Section and plan of a tilted landing](images/drawing_tilted_landing.png)

"""
_COLUMNS = "| key | holds | default | meaning |\n|---|---|---|---|\n"


def scene_page() -> str:
    """The whole page, as Markdown. A table that stands in several others is described once, at the end."""
    tables = [(f"[{name}]", table) for name, field in Scene.model_fields.items() for table in _in_it(field)]
    sections = list(_once(tables))
    inner = dict.fromkeys(
        (name, part)
        for _, table in sections
        for name, field in own_keys(table).items()
        for part in tables_in(field.annotation)
    )
    parts = [_HEAD, "## Top level\n\n", _table(Scene)]
    for name, table in sections:
        parts += [_section(name, table), *([_DRAWING] if name == "[contact]" else ())]
    known = tuple(inner)
    there = {table for _, table in known}
    deeper = {
        (key, part)
        for _, table in known
        for key, field in own_keys(table).items()
        for part in tables_in(field.annotation)
        if part not in there
    }
    for name, table in _once((*known, *sorted(deeper, key=str))):
        if table is ByColour:
            parts.append(_FACES)
        parts.append(_section(f"{name} = {{ ... }}", table))
        if table is Material:
            parts.append(_named_materials())
    return "".join(parts).rstrip() + "\n"


def _in_it(field: FieldInfo) -> Iterator[type[BaseModel]]:
    """The tables that a key may hold, with those whose keys stand in them."""
    for table in tables_in(field.annotation):
        yield table
        if inlined := getattr(table, "inlined", ""):
            yield from tables_in(table.model_fields[inlined].annotation)


def _named_materials() -> str:
    rows = (
        f"| `{as_toml(name)}` | {found.young / 1e9:g} | {found.poisson:g} | {found.density:g} | {found.source} |\n"
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
        f"| `{key}` | {holds(field)} | {default_of(field)} | {field.description or ''} |\n"
        for key, field in own_keys(table).items()
        if key != "kind"
    )
    return _COLUMNS + "".join(rows) + "\n"


if __name__ == "__main__":
    write_whole(sys.argv[1], scene_page().encode("utf-8"))
