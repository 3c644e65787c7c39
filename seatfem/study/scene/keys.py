"""Descriptions of what a key of a scene may hold, in words and by an example: for documents and templates."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, Final, Literal, get_args, get_origin

from pydantic import AfterValidator, BaseModel, BeforeValidator
from pydantic.fields import FieldInfo

from seatfem.fields import ReadQuantity, read_temperature
from seatfem.structures.kinds.parts import Registered
from seatfem.study.scene.problems import leaves, tables_in
from seatfem.units import DIMENSIONS

_PLAIN: Final = {bool: "`true` or `false`", str: "text", int: "whole number", float: "number", Path: "file name"}
_NUMBERS: Final = {2: "two", 3: "three", 4: "four"}


def own_keys(table: type[BaseModel]) -> dict[str, FieldInfo]:
    """Return the table's keys, but for a field whose own keys are written in its place, under its heading."""
    return {name: field for name, field in table.model_fields.items() if name != getattr(table, "inlined", "")}


def holds(field: FieldInfo) -> str:
    """Return what the value is, in Markdown: a quantity with an example, the options, "table"."""
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
        return ", ".join(f"`{as_toml(option)}`" for option in options)
    return next(_PLAIN[kind] for kind in leaves(field.annotation) if kind in _PLAIN)


def _registered(field: FieldInfo) -> str:
    """Return the names that a registry has."""
    checks = [note.func for note in _notes(field) if isinstance(note, AfterValidator)]
    return ", ".join(f"`{as_toml(name)}`" for each in checks if isinstance(each, Registered) for name in each.options)


def dimension_of(field: FieldInfo) -> str:
    """Return the dimension of a quantity, or of a list of them: a name in `DIMENSIONS`, or "temperature"; else ""."""
    notes = [*_notes(field), *(note for kind in _elements(field) for note in get_args(kind)[1:])]
    for note in notes:
        if isinstance(note, BeforeValidator):
            reader: Any = note.func
            if isinstance(reader, ReadQuantity):
                return reader.dimension
            if reader is read_temperature:
                return "temperature"
    return ""


def _measured(notes: Iterable[object]) -> str | None:
    """Return a quantity with its unit, or a number: what the reader among a key's notes takes."""
    for note in notes:
        if isinstance(note, BeforeValidator):
            reader: Any = note.func
            if reader is read_temperature:
                return 'temperature, `"20 degC"`'
            return _quantity(reader.dimension) if isinstance(reader, ReadQuantity) else "number"
    return None


def _elements(field: FieldInfo) -> tuple[Any, ...]:
    """Return the types of a list of a fixed number of values, or of any number of plain ones (two, for "and so on")."""
    for kind in (field.annotation, *get_args(field.annotation)):
        if get_origin(kind) is tuple and not tables_in(kind):
            return get_args(kind)
    return ()


def _several(field: FieldInfo, elements: tuple[Any, ...]) -> str:
    """Return how many of what, with an example."""
    first = elements[0]
    any_number = elements[1:] == (Ellipsis,)
    if get_origin(first) is tuple and get_args(first)[1:] == (Ellipsis,):
        inner = get_args(get_args(first)[0])
        shown = as_toml((field.examples or [[]])[0])
        return f"list of lists of lists of {_NUMBERS[len(inner)]} {_dimension(inner[0])}s, `{shown}`"
    if get_origin(first) is tuple:
        count, inner = "" if any_number else f"{_NUMBERS[len(elements)]} ", get_args(first)
        if len(mixed := dict.fromkeys(map(_dimension, inner))) > 1:
            return f"list of {count}pairs of {' and '.join(mixed)}"
        shown = f", `{as_toml(field.examples[0])}`" if field.examples else ""
        return f"list of {count}lists of {_NUMBERS[len(inner)]} {_dimension(inner[0])}s{shown}"
    if any_number and get_origin(first) is Annotated and (dimension := _dimension(first)) in DIMENSIONS:
        return f"list of {dimension}s, `{as_toml([DIMENSIONS[dimension].example] * 2)}`"
    if any_number:
        return f"list of {_one_of(first)}"
    dimension = _dimension(first)
    example = (field.examples or [[DIMENSIONS[dimension].example] * len(elements)])[0]
    return f"list of {_NUMBERS[len(elements)]} {dimension}s, `{as_toml(example)}`"


def _dimension(kind: Any) -> str:
    """Return the dimension of a quantity; of a plain value what it is."""
    return (_measured(get_args(kind)[1:]) or _PLAIN[next(iter(leaves(kind)))]).partition(",")[0]


def _one_of(kind: Any) -> str:
    if get_origin(kind) is Literal:
        return ", ".join(f"`{as_toml(option)}`" for option in get_args(kind))
    return f"{_PLAIN[next(iter(leaves(kind)))]}s"


def _quantity(dimension: str) -> str:
    return f'{dimension}, `"{DIMENSIONS[dimension].example}"`'


def default_of(field: FieldInfo) -> str:
    """Return its default in Markdown, or that it is required or absent."""
    if field.is_required():
        return "required"
    if field.default is None:
        return "absent"
    if field.default == () or (field.default == {} and get_origin(field.annotation) is dict):
        return "none"
    if isinstance(field.default, BaseModel) or field.default == {}:
        return "see below"
    return f"`{as_toml(field.default)}`"


def as_toml(value: object) -> str:
    """Return a value as it is written in a scene file."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {as_toml(part)}" for key, part in value.items()) + " }"
    return f'"{value}"' if isinstance(value, str) else str(value)


def _notes(field: FieldInfo) -> Iterator[object]:
    """Yield what is annotated to the field, or to one side of `... | None`."""
    yield from field.metadata
    for kind in get_args(field.annotation):
        if get_origin(kind) is Annotated:
            yield from get_args(kind)[1:]
