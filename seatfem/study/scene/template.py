"""A scene to begin with: the keys that are needed with values, all others as comments with their defaults."""

from __future__ import annotations

import re
import textwrap
import tomllib
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any, Final, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from seatfem.fields import kind_of
from seatfem.structures.kinds import Structure, kinds_of
from seatfem.study.scene.keys import as_toml, default_of, holds, own_keys
from seatfem.study.scene.models import Scene
from seatfem.study.scene.problems import tables_in

WIDE: Final = 118  # characters
AT: Final = 40  # where comments begin
_HEAD: Final = """\
# seatfem plan {file}    what it would take, and how accurate it will be
# seatfem run {file}     force, motion, stress, error bars, pictures
# A key behind a # has this default, or is absent: then the value shows how one is written. docs/scene.md has them all.
"""
DURATION: Final = "2 ms"
TARGET: Final = "5 %"
_SPOKEN: Final = {"number": "0.1", "whole number": "1", "text": '"..."', "file name": '"file.csv"'}


class NoTemplate(ValueError):
    """There is no such kind of body."""


def scene_template(name: str, *, file: str = "scene.toml") -> str:
    """The text of a scene in which a body of the kind ``name`` meets one of a kind that suits it.

    Args:
        name: of any kind that `[seat]` and `[reed]` take; it stands where it usually does.
        file: what the comments call the scene.

    Raises:
        NoTemplate: there is no such kind.
    """
    kinds = {kind_of(each): each for each in kinds_of()}
    if name not in kinds:
        close = get_close_matches(name, kinds, n=1)
        hint = f"; did you mean {close[0]!r}?" if close else ""
        raise NoTemplate(f"kind: {name!r} is none of {', '.join(sorted(kinds))}{hint}")
    kind, other = kinds[name], kinds[kinds[name].sample_opposite]
    seat, reed = (other, kind) if kind.sample_motion else (kind, other)
    lines = [_HEAD.format(file=file), f"title = {as_toml(f'{kind_of(reed)} on {kind_of(seat)}'.replace('_', ' '))}", ""]
    width = {"filter_width": reed.sample_filter} if reed.sample_filter else {}
    given: dict[str, Mapping[str, Any]] = {"contact": {}, "run": {"duration": DURATION} | width}
    given["accuracy"] = {"target": TARGET}
    for key, field in Scene.model_fields.items():
        if key in ("seat", "reed"):
            lines += _body(key, seat if key == "seat" else reed)
        elif key in given:
            lines += [f"[{key}]", *table_lines(tables_in(field.annotation)[0], given[key], of=key), ""]
        elif tables_in(field.annotation):
            lines += [*_commented(_header(key, field), field.description or ""), ""]
    return "\n".join(lines).rstrip() + "\n"


def _body(role: str, kind: type[Structure]) -> list[str]:
    words = textwrap.wrap((kind.__doc__ or "").replace("`", ""), WIDE - 2)
    given = tomllib.loads(kind.sample + kind.sample_motion)
    moving = kind.model_construct().moved_by if role == "seat" else ()
    head = [f"[{role}]", *(f"# {line}" for line in words), f'kind = "{kind_of(kind)}"']
    return [*head, *table_lines(kind, given, leave=("kind", *moving), of=role), ""]


def table_lines(
    table: type[BaseModel], given: Mapping[str, Any], *, leave: tuple[str, ...] = (), of: str = ""
) -> list[str]:
    """The keys of a table: those that are given, then the others as comments, then its own tables."""
    keys = {key: field for key, field in own_keys(table).items() if key not in leave}
    lines = [line for key in given for line in _key(key, given[key], keys[key])]
    plain = {key: field for key, field in keys.items() if key not in given and not _is_table(field)}
    lines += [line for key, field in plain.items() for line in _key(key, None, field)]
    for key, field in keys.items():
        if key not in given and key not in plain:
            lines += _commented(_header(f"{of}.{key}" if of else key, field), field.description or "")
    return lines


def _key(key: str, value: object, field: FieldInfo) -> list[str]:
    if value is not None:
        return _commented(f"{key} = {as_toml(value)}", field.description or "")
    return _commented(f"# {key} = {_example(field)}", field.description or "")


def _example(field: FieldInfo) -> str:
    """The default, or a value that shows how one is written."""
    if (default := default_of(field)).startswith("`"):
        return default.strip("`")
    told = holds(field)
    found = re.findall("`([^`]+)`", told)
    return found[0] if found else _SPOKEN.get(told, f"[{_SPOKEN.get(told.removeprefix('list of ').rstrip('s'), '')}]")


def _is_table(field: FieldInfo) -> bool:
    return bool(tables_in(field.annotation)) and not isinstance(field.default, str)


def _header(name: str, field: FieldInfo) -> str:
    return f"# [[{name}]]" if get_origin(field.annotation) is tuple else f"# [{name}]"


def _commented(text: str, words: str) -> list[str]:
    """A line with what it means behind it, on lines of their own where that is long."""
    words = " ".join(words.split()).replace("`", "")
    if not words:
        return [text]
    if len(text) <= AT - 2 and AT + 2 + len(words) <= WIDE:
        return [f"{text:<{AT}}# {words}"]
    return [*(f"#   {line}" for line in textwrap.wrap(words, WIDE - 4)), text]
