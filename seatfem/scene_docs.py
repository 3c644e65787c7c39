"""Writes docs/scene.md from the models, so that it cannot lag behind: `python -m seatfem.scene_docs docs/scene.md`."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel, BeforeValidator
from pydantic.fields import FieldInfo

from seatfem.scene import Scene
from seatfem.scene.fields import ReadQuantity
from seatfem.units import DIMENSIONS

_HEAD = """\
# Scene files

A scene is a TOML file. Quantities are strings with a unit (`"3 mm"`); pure numbers are bare (`0.1`) or percentages
(`"10 %"`). Unknown keys are errors, and all errors are reported at once, each with its line. Files are looked for from
the folder of the scene. This page is made from the program's own definitions (`make docs`).

"""
_COLUMNS = "| key | holds | default | meaning |\n|---|---|---|---|\n"


def scene_page() -> str:
    """The whole page, as Markdown. A table that stands in several others is described once, at the end."""
    sections = [(name, table) for name, field in Scene.model_fields.items() for table in _tables(field.annotation)]
    inner = dict.fromkeys(
        (name, part)
        for _, table in sections
        for name, field in table.model_fields.items()
        for part in _tables(field.annotation)
    )
    parts = [_HEAD, "## Top level\n\n", _table(Scene)]
    parts += [_section(f"[{name}]", table) for name, table in sections]
    parts += [_section(f"{name} = {{ ... }}", table) for name, table in _once(inner)]
    return "".join(parts).rstrip() + "\n"


def _once(inner: Iterable[tuple[str, type[BaseModel]]]) -> Iterator[tuple[str, type[BaseModel]]]:
    """Each table once, under all the names it goes by."""
    names: dict[type[BaseModel], list[str]] = {}
    for name, table in inner:
        names.setdefault(table, []).append(name)
    for table, known_as in names.items():
        yield ", ".join(known_as), table


def _section(name: str, table: type[BaseModel]) -> str:
    kind = f', kind = "{_kind(table)}"' if "kind" in table.model_fields else ""
    return f"## {name}{kind}\n\n{_summary(table)}\n\n{_table(table)}"


def _table(table: type[BaseModel]) -> str:
    rows = (
        f"| `{key}` | {_holds(field)} | {_default(field)} | {field.description or ''} |\n"
        for key, field in table.model_fields.items()
        if key != "kind"
    )
    return _COLUMNS + "".join(rows) + "\n"


def _summary(table: type[BaseModel]) -> str:
    return " ".join((table.__doc__ or "").split())


def _holds(field: FieldInfo) -> str:
    for note in _notes(field):
        if isinstance(note, BeforeValidator):
            reader: Any = note.func
            return _quantity(reader.dimension) if isinstance(reader, ReadQuantity) else "number"
    options = [option for kind in _leaves(field.annotation) if get_origin(kind) is Literal for option in get_args(kind)]
    if options:
        return ", ".join(f"`{_toml(option)}`" for option in options)
    if _tables(field.annotation):
        origin = get_origin(field.annotation)
        return "tables by name" if origin is dict else "list of tables" if origin is tuple else "table"
    kinds = {str: "text", int: "whole number", Path: "file name"}
    return next((kinds[kind] for kind in _leaves(field.annotation) if kind in kinds), "list of numbers")


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
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(part)}" for key, part in value.items()) + " }"
    return f'"{value}"' if isinstance(value, str) else str(value)


def _kind(table: type[BaseModel]) -> str:
    return str(get_args(table.model_fields["kind"].annotation)[0])


def _notes(field: FieldInfo) -> Iterator[object]:
    """What is annotated to the field, or to one side of `... | None`."""
    yield from field.metadata
    for kind in get_args(field.annotation):
        if get_origin(kind) is Annotated:
            yield from get_args(kind)[1:]


def _leaves(annotation: object) -> Iterator[Any]:
    """The plain types behind unions and annotations."""
    if get_origin(annotation) is Literal or not get_args(annotation):
        yield annotation
        return
    for part in get_args(annotation):
        yield from _leaves(part)


def _tables(annotation: object) -> list[type[BaseModel]]:
    return [kind for kind in _leaves(annotation) if isinstance(kind, type) and issubclass(kind, BaseModel)]


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(scene_page(), encoding="utf-8")
