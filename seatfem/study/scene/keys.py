"""Descriptions of what a key of a scene may hold, in words and by an example: for documents and templates."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final, Literal, get_args, get_origin

from pydantic import AfterValidator, BaseModel
from pydantic.fields import FieldInfo

from seatfem.fields import ReadQuantity, read_temperature
from seatfem.structures.kinds.parts import Registered
from seatfem.study.scene.problems import leaves, notes_of, reader_of, tables_in
from seatfem.units import DIMENSIONS

_PLAIN: Final = {bool: "`true` or `false`", str: "text", int: "whole number", float: "number", Path: "file name"}
_NUMBERS: Final = {2: "two", 3: "three", 4: "four"}


def holds(field: FieldInfo) -> str:
    """Return what the value is, in Markdown: a quantity with an example, the options, "table"."""
    if elements := _elements(field):
        return _several(field, elements)
    if tables_in(field.annotation):
        origin = get_origin(field.annotation)
        return "tables by name" if origin is dict else "list of tables" if origin is tuple else "table"
    notes = list(notes_of(field))
    registers = [note.func for note in notes if isinstance(note, AfterValidator) and isinstance(note.func, Registered)]
    if options := [name for each in registers for name in each.options]:
        return _listed(options)
    if (quantity := _measured(notes)) is not None:
        return quantity
    kinds = list(leaves(field.annotation))
    if options := [option for kind in kinds if get_origin(kind) is Literal for option in get_args(kind)]:
        return _listed(options)
    return next(_PLAIN[kind] for kind in kinds if kind in _PLAIN)


def dimension_of(field: FieldInfo) -> str:
    """Return the dimension of a quantity, or of a list of them: a name in `DIMENSIONS`, or "temperature"; else ""."""
    readers = [reader_of(notes) for notes in (notes_of(field), *(get_args(kind)[1:] for kind in _elements(field)))]
    names = ("temperature" if each is read_temperature else getattr(each, "dimension", "") for each in readers)
    return next(filter(None, names), "")


def _measured(notes: Iterable[object]) -> str | None:
    """Return a quantity with its unit, or a number: what the reader among a key's notes takes."""
    reader = reader_of(notes)
    if isinstance(reader, ReadQuantity):
        return f'{reader.dimension}, `"{DIMENSIONS[reader.dimension].example}"`'
    return None if reader is None else 'temperature, `"20 degC"`' if reader is read_temperature else "number"


def _elements(field: FieldInfo) -> tuple[Any, ...]:
    """Return the types of a list of a fixed number of values, or of any number of plain ones (two, for "and so on")."""
    for kind in (field.annotation, *get_args(field.annotation)):
        if get_origin(kind) is tuple and not tables_in(kind):
            return get_args(kind)
    return ()


def _several(field: FieldInfo, elements: tuple[Any, ...]) -> str:
    """Return how many of what, with an example."""
    first, inner, any_number = elements[0], get_args(elements[0]), elements[1:] == (Ellipsis,)
    example = (field.examples or [None])[0]
    shown = f", `{as_toml(example)}`" if field.examples else ""
    if get_origin(first) is tuple and inner[1:] == (Ellipsis,):
        of = get_args(inner[0])
        return f"list of lists of lists of {_NUMBERS[len(of)]} {_dimension(of[0])}s{shown or ', `[]`'}"
    if get_origin(first) is tuple:
        count = "" if any_number else f"{_NUMBERS[len(elements)]} "
        if len(mixed := dict.fromkeys(map(_dimension, inner))) > 1:
            return f"list of {count}pairs of {' and '.join(mixed)}"
        return f"list of {count}lists of {_NUMBERS[len(inner)]} {_dimension(inner[0])}s{shown}"
    if get_origin(first) is Literal:
        return f"list of {_listed(inner)}"
    dimension = _dimension(first)
    if any_number and dimension not in DIMENSIONS:
        return f"list of {_PLAIN[next(iter(leaves(first)))]}s"
    count, usual = ("", 2) if any_number else (f"{_NUMBERS[len(elements)]} ", len(elements))
    value = example if field.examples and not any_number else [DIMENSIONS[dimension].example] * usual
    return f"list of {count}{dimension}s, `{as_toml(value)}`"


def _dimension(kind: Any) -> str:
    """Return the dimension of a quantity; of a plain value what it is."""
    return (_measured(get_args(kind)[1:]) or _PLAIN[next(iter(leaves(kind)))]).partition(",")[0]


def _listed(options: Iterable[object]) -> str:
    return ", ".join(f"`{as_toml(option)}`" for option in options)


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
