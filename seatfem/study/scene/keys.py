"""Types of the keys of a scene, as text with examples, as JSON schema for editors, and as template of a scene."""

from __future__ import annotations

import json
import re
import textwrap
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, Literal, get_args, get_origin

from pydantic import AfterValidator, BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from impact.notices import SeatfemError
from seatfem import fields, units
from seatfem.structures.kinds import Structure, kinds_of
from seatfem.structures.kinds.parts import ReductionName
from seatfem.study.scene import contact, load
from seatfem.study.scene.problems import did_you_mean, leaves, notes_of, own_keys, reader_of, tables_in

_PLAIN: Final = {bool: "`true` or `false`", str: "text", int: "whole number", float: "number", Path: "file name"}
_NUMBERS: Final = {2: "two", 3: "three", 4: "four"}


def holds(field: FieldInfo) -> str:
    """Return the type of the value in Markdown: a quantity with an example, the options, "table"."""
    if elements := _elements(field):
        return _several(field, elements)
    if tables_in(field.annotation):
        origin = get_origin(field.annotation)
        return "tables by name" if origin is dict else "list of tables" if origin is tuple else "table"
    notes = list(notes_of(field))
    fixed = [note.func for note in notes if isinstance(note, AfterValidator) and isinstance(note.func, ReductionName)]
    if options := [name for each in fixed for name in each.options]:
        return _listed(options)
    if (quantity := _measured(notes)) is not None:
        return quantity
    kinds = list(leaves(field.annotation))
    if options := [option for kind in kinds if get_origin(kind) is Literal for option in get_args(kind)]:
        return _listed(options)
    return next(_PLAIN[kind] for kind in kinds if kind in _PLAIN)


def dimension_of(field: FieldInfo) -> str:
    """Return the dimension of a quantity or a list of quantities: a name in `DIMENSIONS`, "temperature" or ""."""
    readers = [reader_of(notes) for notes in (notes_of(field), *(get_args(kind)[1:] for kind in _elements(field)))]
    names = ("temperature" if each is fields.read_temperature else getattr(each, "dimension", "") for each in readers)
    return next(filter(None, names), "")


def _measured(notes: Iterable[object]) -> str | None:
    """Return the text for a quantity with an example, or a number, by the reader in a key's annotations."""
    reader = reader_of(notes)
    if isinstance(reader, fields.ReadQuantity):
        return f'{reader.dimension}, `"{units.DIMENSIONS[reader.dimension].example}"`'
    return None if reader is None else 'temperature, `"20 degC"`' if reader is fields.read_temperature else "number"


def _elements(field: FieldInfo) -> tuple[Any, ...]:
    """Return the types of the elements of a list; ``...`` as the second for any number of them."""
    for kind in (field.annotation, *get_args(field.annotation)):
        if get_origin(kind) is tuple and not tables_in(kind):
            return get_args(kind)
    return ()


def _several(field: FieldInfo, elements: tuple[Any, ...]) -> str:
    """Return the text for a list of values, with an example."""
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
    if any_number and dimension not in units.DIMENSIONS:
        return f"list of {_PLAIN[next(iter(leaves(first)))]}s"
    count, usual = ("", 2) if any_number else (f"{_NUMBERS[len(elements)]} ", len(elements))
    value = example if field.examples and not any_number else [units.DIMENSIONS[dimension].example] * usual
    plural = "moduli" if dimension == "modulus" else f"{dimension}s"
    return f"list of {count}{plural}, `{as_toml(value)}`"


def _dimension(kind: Any) -> str:
    """Return the dimension of a quantity, or the type of a plain value."""
    return (_measured(get_args(kind)[1:]) or _PLAIN[next(iter(leaves(kind)))]).partition(",")[0]


def _listed(options: Iterable[object]) -> str:
    return ", ".join(f"`{as_toml(option)}`" for option in options)


def default_of(field: FieldInfo) -> str:
    """Return the default of a key in Markdown, or "required", "absent", "none" or "see below"."""
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
    """Return a value as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {as_toml(part)}" for key, part in value.items()) + " }"
    return f'"{value}"' if isinstance(value, str) else str(value)


SCHEMA_FILE: Final = "seatfem.schema.json"
_NOT_FOR_EDITORS: Final = ("title", "ge", "gt", "le", "lt")
"""Keywords of pydantic's schema that editors do not use."""


class _AsWritten(GenerateJsonSchema):
    """Generator of schemas of values as a file has them: quantities are text, tables with a short form text, too."""

    def function_before_schema(self, schema: core_schema.BeforeValidatorFunctionSchema) -> JsonSchemaValue:
        function: Any = schema["function"]["function"]
        if isinstance(function, fields.ReadQuantity):
            return {"type": "string", "examples": [units.DIMENSIONS[function.dimension].example]}
        if function is fields.read_temperature:
            return {"type": "string", "examples": ["20 degC"]}
        if function is fields.read_number:
            return {"type": ["number", "string"], "examples": [0.1, "10 %"]}
        inner = super().function_before_schema(schema)
        if inner.get("type") in ("object", ["object", "string"]) and "allOf" not in inner:
            return {**inner, "type": ["object", "string"]}
        return {"anyOf": [inner, {"type": ["string", "array"]}]}

    def tagged_union_schema(self, schema: core_schema.TaggedUnionSchema) -> JsonSchemaValue:
        """Return the schema of tables by ``kind``; a name of several kinds is checked against any of them."""
        kinds = {str(name): self.generate_inner(each) for name, each in schema["choices"].items()}
        if not isinstance(schema["discriminator"], str):
            return {"anyOf": list(kinds.values())}
        also = {fields.kind_of(each): each.also for each in kinds_of()}
        rules = []
        for name in kinds:
            meant = [kinds[name], *(kinds[other] for other in kinds if name in also.get(other, ()))]
            condition = {"properties": {"kind": {"const": name}}, "required": ["kind"]}
            rules.append({"if": condition, "then": {"anyOf": meant}})
        return {"type": ["object", "string"], "properties": {"kind": {"enum": list(kinds)}}, "allOf": rules}


def scene_schema() -> dict[str, Any]:
    """Return the schema of a scene file, JSON Schema draft 2020-12.

    By it editors check the names of keys, options and types of values; missing keys, units, ranges and contradictions
    are checked by the program only. The keys of [stopper], which include those of a body, are not checked.
    """
    schema = schema_of(load.scene_of(), "seatfem scene")
    for name, table in schema["$defs"].items():
        schema["$defs"][name] = {**table, "additionalProperties": True} if name == contact.Stopper.__name__ else table
    for table in kinds_of():
        if table.also and table.__name__ in schema["$defs"]:
            schema["$defs"][table.__name__]["properties"]["kind"] = {"enum": [fields.kind_of(table), *table.also]}
    return schema


def schema_of(table: type[BaseModel], title: str) -> dict[str, Any]:
    """Return the schema of a file with the keys of ``table``."""
    schema = _clean_schema(table.model_json_schema(schema_generator=_AsWritten))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title, **schema}


def schema_text(schema: Mapping[str, Any]) -> str:
    """Return a schema as JSON."""
    return json.dumps(schema, separators=(",", ":")) + "\n"


def _clean_schema(value: Any, *, keys: bool = False) -> Any:
    """Return the schema without null, keywords for pydantic only, and required keys, which short forms of tables omit;
    ``keys``: names in this mapping are keys of the file."""
    if isinstance(value, list):
        return [_clean_schema(each) for each in value if each != {"type": "null"}]
    if not isinstance(value, Mapping):
        return value
    dropped = (*_NOT_FOR_EDITORS, *(["required"] if "additionalProperties" in value else []))
    kept = {
        key: each for key, each in value.items() if keys or not (key in dropped or (key, each) == ("default", None))
    }
    return {key: _clean_schema(each, keys=key in ("properties", "$defs")) for key, each in kept.items()}


WIDE: Final = 118  # most characters of a line
AT: Final = 40  # column where comments begin
_HEAD: Final = """\
# seatfem plan {file}    what it would take, and how accurate it will be
# seatfem run {file}     force, motion, stress, error bars, pictures
# A key behind a # has this default, or is absent: then the value shows how one is written. A table behind # works as
# it stands once its # are taken away, where the files that it names are there. docs/scene.md has all keys.
"""
DURATION: Final = "2 ms"
TARGET: Final = "5 %"
STEEL: Final = {"material": "steel", "damping_ratio": 0.02}
"""Values of these keys in templates, unless the sample of a kind has others."""
Stated = dict[str, Mapping[str, Any]]
"""Tables of a template with their keys that are not commented out."""
_SPOKEN: Final = {"number": "0.1", "whole number": "1", "text": '"..."', "file name": '"file.csv"'}


class NoTemplate(SeatfemError, ValueError):
    """Error of an unknown kind of body."""


def scene_template(name: str, *, file: str = "scene.toml") -> str:
    """Return the text of a scene in which a body of the kind ``name`` meets one of a kind that suits it.

    Args:
        name: name of a kind of `[seat]` or `[reed]`; it takes its usual role.
        file: name of the scene in comments.

    Raises `NoTemplate` for an unknown kind.
    """
    kinds = {fields.kind_of(each): each for each in kinds_of()}
    if name not in kinds:
        hint = did_you_mean(name, kinds)
        raise NoTemplate(f"kind: {name!r} is no kind; choose: {fields.kinds_in_words(kinds_of())}{hint}")
    kind, other = kinds[name], kinds[kinds[name].sample_scene.opposite]
    seat, reed = (other, kind) if kind.sample_scene.motion else (kind, other)
    title = f"{fields.kind_of(reed)} on {fields.kind_of(seat)}".replace("_", " ")
    around = reed.sample_scene
    width = {"filter_width": around.filter_width} if around.filter_width else {}
    stated: Stated = {"seat": _begun(seat), "reed": _begun(reed, around.motion)}
    stated["contact"] = tomllib.loads(around.contact)
    stated |= {"run": {"duration": DURATION} | width, "accuracy": {"target": TARGET}}
    lines = [_HEAD.format(file=file), f"title = {as_toml(title)}", ""]
    for key, field in load.scene_of().model_fields.items():
        if key in ("seat", "reed"):
            lines += _body(key, seat if key == "seat" else reed, stated)
        elif key in stated:
            lines += [f"[{key}]", *table_lines(tables_in(field.annotation)[0], stated[key], of=key, beside=stated), ""]
        elif tables_in(field.annotation):
            lines += [*_block(key, field, stated), ""]
    return "\n".join(lines).rstrip() + "\n"


def _begun(kind: type[Structure], motion: str = "") -> Mapping[str, Any]:
    usual = STEEL if "material" in kind.model_fields else {}
    return {"kind": fields.kind_of(kind), **usual, **tomllib.loads(kind.sample + motion)}


def _body(role: str, kind: type[Structure], stated: Stated) -> list[str]:
    words = textwrap.wrap((kind.__doc__ or "").replace("`", ""), WIDE - 2)
    values = {key: value for key, value in stated[role].items() if key != "kind"}
    moving = kind.traits.moved_by if role == "seat" else ()
    head = [f"[{role}]", *(f"# {line}" for line in words), f'kind = "{fields.kind_of(kind)}"']
    return [*head, *table_lines(kind, values, leave=("kind", *moving), of=role, beside=stated), ""]


def table_lines(
    table: type[BaseModel],
    given: Mapping[str, Any],
    *,
    leave: tuple[str, ...] = (),
    of: str = "",
    beside: Stated | None = None,
) -> list[str]:
    """Return lines for the keys of a table: those with a value in ``given``, the others as comments, then its tables.

    ``of``: name of the table; ``beside``: other tables of the scene, with which samples of its tables must agree.
    """
    keys = {key: field for key, field in own_keys(table).items() if key not in leave}
    lines = [line for key in given for line in _key(key, given[key], keys[key])]
    blocks = []
    for key, field in keys.items():
        if key not in given and tables_in(field.annotation) and not isinstance(field.default, str):
            blocks += _block(f"{of}.{key}" if of else key, field, beside)
        elif key not in given:
            lines += _key(key, None, field)
    return lines + blocks


def _block(name: str, field: FieldInfo, beside: Stated | None) -> list[str]:
    """Return a table as comments: its sample if the scene with it is valid, else its description."""
    words = " ".join((field.description or "").split()).replace("`", "")
    several = get_origin(field.annotation) is tuple
    header = f"[[{name}]]" if several else f"[{name}]"
    table = next((each for each in tables_in(field.annotation) if getattr(each, "sample", "")), None)
    if table is None or beside is None or get_origin(field.annotation) is dict:
        return _comment(f"{header}: {words}")
    sample, keys = tomllib.loads(str(table.sample)), own_keys(table)  # type: ignore[attr-defined]
    if not _is_scene(beside, name, [sample] if several else sample):
        return _comment(f"{header}, not together with the keys above: {words}")
    lines = _commented(f"# {header}", words)
    for key, value in sample.items():
        lines += _commented(f"# {key} = {as_toml(value)}", (keys[key].description or "") if key in keys else "")
    if more := ", ".join(key for key in keys if key not in sample and key != "kind"):
        lines += _comment(f"other keys: {more}")
    return [f"# # {line[4:]}" if line.startswith("#   ") else line for line in lines]  # comments once # are taken away


def _is_scene(stated: Stated, name: str, table: object) -> bool:
    """Return whether the scene with this table is valid, apart from missing files."""
    model, key = load.scene_of(), name.partition(".")
    part = {**stated[key[0]], key[2]: table} if key[2] else table
    data: dict[str, Any] = {**stated, key[0]: part}
    try:
        model.model_validate(data, context={"folder": Path(), "unread": True})
    except ValidationError:
        return False
    return True


def _key(key: str, value: object, field: FieldInfo) -> list[str]:
    written = f"# {key} = {_example(field)}" if value is None else f"{key} = {as_toml(value)}"
    return _commented(written, field.description or "")


def _example(field: FieldInfo) -> str:
    """Return the default, or an example of a value."""
    if (default := default_of(field)).startswith("`"):
        return default.strip("`")
    if field.examples and isinstance(field.examples[0], str):
        return as_toml(field.examples[0])
    words = holds(field)
    if examples := re.findall("`([^`]+)`", words):
        return str(examples[0])
    return _SPOKEN.get(words, f"[{_SPOKEN.get(words.removeprefix('list of ').rstrip('s'), '')}]")


def _commented(text: str, words: str) -> list[str]:
    """Return a line with a comment behind it, or before it if it is long."""
    words = " ".join(words.split()).replace("`", "")
    if not words:
        return [text]
    if len(text) <= AT - 2 and AT + 2 + len(words) <= WIDE:
        return [f"{text:<{AT}}# {words}"]
    return [*_comment(words), text]


def _comment(words: str) -> list[str]:
    return [f"#   {line}" for line in textwrap.wrap(words, WIDE - 4)]
