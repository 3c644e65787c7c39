"""Writes docs/scene.md and docs/scene/ from the models, so that they cannot lag behind (`make docs`)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from impact.files.safe_files import write_whole
from seatfem.fields import kind_of
from seatfem.structures.kinds.beam import Beam
from seatfem.structures.kinds.closed_forms import RigidMass
from seatfem.structures.kinds.parts import Material, OrthotropicMaterial
from seatfem.structures.kinds.plate_loads import ClampedPlate
from seatfem.structures.kinds.plates import FreePlate
from seatfem.structures.kinds.selectors import FaceChoice, Region
from seatfem.structures.kinds.structure import Structure
from seatfem.structures.kinds.turned import Ball
from seatfem.structures.materials import NAMED_MATERIALS
from seatfem.study.scene.keys import as_toml, default_of, holds
from seatfem.study.scene.load import scene_of
from seatfem.study.scene.problems import leaves, own_keys, tables_in

_HEAD = """\
# Scene files

A scene is a TOML file. Quantities are strings with a unit (`"3 mm"`); pure numbers are bare (`0.1`) or percentages
(`"10 %"`). Unknown keys are errors, and all errors are reported at once, each with its line. File names are
relative to the folder of the scene. `make docs` generates these pages from the program's definitions.

"""
_MATERIALS = """\
Materials by name. A value beside the name overrides it, for example `material = { name = "steel", young = "210 GPa" }`.
Values are generic, at room temperature: those of a casting may differ by a tenth.

| name | E (GPa) | nu | density (kg/m^3) | source |
|---|---|---|---|---|
"""
_FACES = """\
# Faces

Select faces of a CAD seat by colour, position, surface, name or number. `seatfem faces part.step` shows them in a table
and in a picture with their numbers, `seatfem faces scene.toml` shows those that a scene selects. The keys determine the
kind of selector:

    contact = { number = 7 }                                   # or { numbers = [7, 9] }
    fixed = { radius = "2.25 mm", several = true }             # all bolt holes, wherever their axes are
    fixed = { radius = "4 mm", axis_point = ["15 mm", "0 mm", "0 mm"] }
    contact = { normal = [0, 0, 1], offset = "14 mm", radius_max = "10 mm" }
    groups.rim = { colour = [0, 255, 0] }                      # for supports: on = "rim"
    contact = { of = [{ number = 3 }, { name = "SEAT" }] }

Numbers follow the order of the file: they are valid for this file, and may change with the next export.

"""
_DRAWING = """\
`seatfem draw scene.toml` shows the contact in section and from above, with the lip segments and the tilt axis.

![Section and plan of a tilted landing](../images/drawing_tilted_landing.png)

"""
_COLUMNS = "| key | holds | default | meaning |\n|---|---|---|---|\n"


_FAMILIES: Final = ("seats", "reeds", "strikers", "imported")
_KINDS = "Each kind may be used in [seat], [reed] and [stopper].\n\n"
_INTRODUCED: Final = {
    "seats": f"# Seats\n\n{_KINDS}",
    "reeds": f"# Reeds\n\n{_KINDS}",
    "strikers": f"# Strikers\n\n{_KINDS}",
    "imported": f"# Imported bodies\n\n{_KINDS}",
    "materials": "# Materials\n\n",
    "faces": _FACES,
    "parts": "# Parts of bodies\n\n",
}
_ORDER: Final = tuple(_INTRODUCED)


@dataclass(frozen=True)
class _Chapter:
    """A table with its keys: under what name, and on which page."""

    name: str
    table: type[BaseModel]
    page: str


def scene_pages() -> dict[str, str]:
    """Return the pages as Markdown, by their names in docs/. A table that several tables may hold is described once."""
    chapters = _chapters()
    places = {each.table: each.page for each in chapters}
    pages = {"scene.md": _index(chapters, places)}
    for page in dict.fromkeys(each.page for each in chapters):
        mine = [each for each in chapters if each.page == page]
        parts = [_INTRODUCED.get(page, "") or f"# {mine[0].name}\n\n"]
        for number, each in enumerate(mine):
            heading = "" if number == 0 and page not in _INTRODUCED else f"## {each.name}\n\n"
            parts.append(f"{heading}{_words(each.table)}\n\n{_table(each.table, places, page)}")
            if each.table is Material:
                parts.append(_named_materials())
            if each.name == "[contact]":
                parts.append(_DRAWING)
        pages[f"scene/{page}.md"] = "".join(parts).rstrip() + "\n"
    return pages


def _chapters() -> list[_Chapter]:
    """Tables of a scene, each kind of body on the page of its family, then those within them."""
    found: dict[type[BaseModel], _Chapter] = {}
    for name, field in scene_of().model_fields.items():
        for table in _in_it(field):
            page = _page_of(name, table)
            shown = f"[[{name}]]" if holds(field) == "list of tables" else f"[{name}]"
            kind = f'kind = "{kind_of(table)}"' if page in _FAMILIES else shown
            found.setdefault(table, _Chapter(kind, table, page))
    inner: dict[type[BaseModel], list[tuple[str, str]]] = {}
    for chapter in found.values():
        for name, table in _within(chapter.table):
            inner.setdefault(table, []).append((name, chapter.page))
    chapters = list(found.values())
    for table, users in inner.items():
        kind = f', kind = "{kind_of(table)}"' if "kind" in table.model_fields else ""
        name = f"{', '.join(dict.fromkeys(name for name, _ in users))} = {{ ... }}{kind}"
        chapters.append(_Chapter(name, table, _page_within(table, [page for _, page in users])))
    return sorted(chapters, key=lambda each: _ORDER.index(each.page) if each.page in _ORDER else len(_ORDER))


def _within(table: type[BaseModel], above: tuple[type[BaseModel], ...] = ()) -> Iterator[tuple[str, type[BaseModel]]]:
    """Names and tables that a table's keys hold, and those in them; none within itself."""
    for name, field in own_keys(table).items():
        for part in tables_in(field.annotation):
            if not issubclass(part, Structure):
                yield name, part
                if part not in above:
                    yield from _within(part, (*above, part))


def _page_of(name: str, table: type[BaseModel]) -> str:
    """Where a table is described that a scene holds: of bodies by their families, of others by its name."""
    if not issubclass(table, Structure):
        return name
    if any(field.is_required() and Path in leaves(field.annotation) for field in table.model_fields.values()):
        return "imported"
    if issubclass(table, Beam | ClampedPlate):
        return "reeds"
    return "strikers" if issubclass(table, FreePlate | RigidMass | Ball) else "seats"


def _page_within(table: type[BaseModel], users: list[str]) -> str:
    """Where a table is described that others hold: of what several families have on pages of their own."""
    if issubclass(table, FaceChoice | Region):
        return "faces"
    if issubclass(table, Material | OrthotropicMaterial):
        return "materials"
    return "parts" if len(set(users) & set(_FAMILIES)) > 1 else users[0]


def _index(chapters: list[_Chapter], places: dict[type[BaseModel], str]) -> str:
    """The page that links all others."""
    lines = []
    for page in dict.fromkeys(each.page for each in chapters):
        title = _INTRODUCED.get(page, f"# {page}").partition("\n")[0].removeprefix("# ")
        mine = [each for each in chapters if each.page == page]
        kinds = [f"`{kind_of(each.table)}`" for each in mine if issubclass(each.table, Structure)]
        names = dict.fromkeys(f"`{name}`" for each in mine for name in each.name.partition(" =")[0].split(", "))
        words = f": {', '.join(kinds or names)}" if page in _INTRODUCED else ""
        lines.append(f"- [{title}](scene/{page}.md){words}")
    top = _table(scene_of(), places, "scene").replace("](", "](scene/")
    return "\n".join([f"{_HEAD}## Pages\n", *lines, "", "## Top level\n", top]).rstrip() + "\n"


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


def _words(table: type[BaseModel]) -> str:
    return " ".join((table.__doc__ or "").split())


def _table(table: type[BaseModel], places: dict[type[BaseModel], str], page: str) -> str:
    """Its keys; where a key holds a table that another page describes, with a link."""
    rows = []
    for key, field in own_keys(table).items():
        if key != "kind":
            elsewhere = [places[part] for part in tables_in(field.annotation) if places[part] != page]
            first = f"{key}s" if f"{key}s" in elsewhere else "".join(elsewhere[:1])
            held = f"[{holds(field)}]({first}.md)" if first else holds(field)
            default = "see there" if first and default_of(field) == "see below" else default_of(field)
            rows.append(f"| `{key}` | {held} | {default} | {field.description or ''} |\n")
    return _COLUMNS + "".join(rows) + "\n"


if __name__ == "__main__":
    docs = Path(__file__).resolve().parent
    (docs / "scene").mkdir(exist_ok=True)
    for name, text in scene_pages().items():
        write_whole(docs / name, text.encode("utf-8"))
