"""A scene to begin with: the keys that are needed with values, all others as comments with their defaults."""

from __future__ import annotations

import re
import textwrap
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from seatfem.fields import kind_of, kinds_in_words
from seatfem.structures.kinds import Structure, kinds_of
from seatfem.study.scene.keys import as_toml, default_of, holds
from seatfem.study.scene.laws import laws
from seatfem.study.scene.measures import all_measures
from seatfem.study.scene.models import Scene
from seatfem.study.scene.problems import did_you_mean, own_keys, tables_in

WIDE: Final = 118  # characters
AT: Final = 40  # where comments begin
_HEAD: Final = """\
# seatfem plan {file}    what it would take, and how accurate it will be
# seatfem run {file}     force, motion, stress, error bars, pictures
# A key behind a # has this default, or is absent: then the value shows how one is written. A table behind # works as
# it stands once its # are taken away, where the files that it names are there. docs/scene.md has all keys.
"""
DURATION: Final = "2 ms"
TARGET: Final = "5 %"
STEEL: Final = {"material": "steel", "damping_ratio": 0.02}
"""Of a kind with these keys, unless its sample says otherwise."""
Stated = dict[str, Mapping[str, Any]]
"""Tables of a scene, and what stands in them without #."""
_SPOKEN: Final = {"number": "0.1", "whole number": "1", "text": '"..."', "file name": '"file.csv"'}


class NoTemplate(ValueError):
    """There is no such kind of body."""


def scene_template(name: str, *, file: str = "scene.toml") -> str:
    """Return the text of a scene in which a body of the kind ``name`` meets one of a kind that suits it.

    Args:
        name: of any kind that `[seat]` and `[reed]` take; it stands where it usually does.
        file: what the comments call the scene.

    Raises `NoTemplate`: there is no such kind.
    """
    kinds = {kind_of(each): each for each in kinds_of()}
    if name not in kinds:
        hint = did_you_mean(name, kinds)
        raise NoTemplate(f"kind: {name!r} is no kind; choose: {kinds_in_words(kinds_of())}{hint}")
    kind, other = kinds[name], kinds[kinds[name].sample_scene.opposite]
    seat, reed = (other, kind) if kind.sample_scene.motion else (kind, other)
    title = f"{kind_of(reed)} on {kind_of(seat)}".replace("_", " ")
    around = reed.sample_scene
    width = {"filter_width": around.filter_width} if around.filter_width else {}
    stated: Stated = {"seat": _begun(seat), "reed": _begun(reed, around.motion), "contact": {}}
    stated |= {"run": {"duration": DURATION} | width, "accuracy": {"target": TARGET}}
    lines = [_HEAD.format(file=file), f"title = {as_toml(title)}", ""]
    for key, field in Scene.model_fields.items():
        if key in ("seat", "reed"):
            lines += _body(key, seat if key == "seat" else reed, stated)
        elif key in stated:
            lines += [f"[{key}]", *table_lines(tables_in(field.annotation)[0], stated[key], of=key, beside=stated), ""]
        elif tables_in(field.annotation):
            lines += [*_block(key, field, stated), ""]
    return "\n".join(lines).rstrip() + "\n"


def _begun(kind: type[Structure], motion: str = "") -> Mapping[str, Any]:
    usual = STEEL if "material" in kind.model_fields else {}
    return {"kind": kind_of(kind), **usual, **tomllib.loads(kind.sample + motion)}


def _body(role: str, kind: type[Structure], stated: Stated) -> list[str]:
    words = textwrap.wrap((kind.__doc__ or "").replace("`", ""), WIDE - 2)
    values = {key: value for key, value in stated[role].items() if key != "kind"}
    moving = kind.model_construct().moved_by if role == "seat" else ()
    head = [f"[{role}]", *(f"# {line}" for line in words), f'kind = "{kind_of(kind)}"']
    return [*head, *table_lines(kind, values, leave=("kind", *moving), of=role, beside=stated), ""]


def table_lines(
    table: type[BaseModel],
    given: Mapping[str, Any],
    *,
    leave: tuple[str, ...] = (),
    of: str = "",
    beside: Stated | None = None,
) -> list[str]:
    """Return the keys of a table: those that are given, then the others as comments, then its own tables.

    ``beside``: what the scene states, of which the table is ``of``; its own tables are filled as far as they fit that.
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
    """Return a table behind #, as its class has it, where a scene with it is one; else what it would be, in words."""
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
    """Return whether the scene may have this table, if its files are there."""
    from seatfem.study.scene.load import scene_of  # with what is defined by now

    model, key = scene_of(kinds_of(), laws(), tuple(all_measures())), name.partition(".")
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
    """Return the default, or a value that shows how one is written."""
    if (default := default_of(field)).startswith("`"):
        return default.strip("`")
    if field.examples and isinstance(field.examples[0], str):
        return as_toml(field.examples[0])
    words = holds(field)
    if examples := re.findall("`([^`]+)`", words):
        return str(examples[0])
    return _SPOKEN.get(words, f"[{_SPOKEN.get(words.removeprefix('list of ').rstrip('s'), '')}]")


def _commented(text: str, words: str) -> list[str]:
    """Return a line with what it means behind it, on lines of their own where that is long."""
    words = " ".join(words.split()).replace("`", "")
    if not words:
        return [text]
    if len(text) <= AT - 2 and AT + 2 + len(words) <= WIDE:
        return [f"{text:<{AT}}# {words}"]
    return [*_comment(words), text]


def _comment(words: str) -> list[str]:
    return [f"#   {line}" for line in textwrap.wrap(words, WIDE - 4)]
