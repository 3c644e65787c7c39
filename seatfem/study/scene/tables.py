"""Reading of a TOML file into a table of checked keys, with messages that name file, line and key."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Set
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Final, NamedTuple, TypeGuard

import numpy as np
from pydantic import AfterValidator, BeforeValidator, ValidationError

from impact.files.safe_files import MB, read_text
from impact.quantities import brief_value
from seatfem.fields import AnyTable
from seatfem.study.scene.problems import SceneError, explain, key_lines, line_of, scene_error

UNCHANGED: Final[Mapping[str, object]] = MappingProxyType({})
LIMIT: Final = 1 * MB  # largest file
DEEPEST: Final = 32  # most parts of a dotted key
_DEEP_KEY: Final = re.compile(r"""(?<![\w"'-])(?:(?:"[^"\n]*+"|'[^'\n]*+'|[\w-]++)[ \t]*+\.[ \t]*+){32}""")
"""Dotted key of more than `DEEPEST` parts, for which reading takes the square of their number."""


class _Other(NamedTuple):
    """Kind of file that is told by its tables, and the verb that takes it."""

    name: str
    verb: str
    beside: tuple[str, ...]


_OTHERS: Final = {
    "seat": _Other("a scene", "run", ("reed", "run")),
    "vary": _Other("a study", "sweep", ("scene",)),
    "record": _Other("a file for identification", "identify", ("scene", "fit")),
}


class _Unreadable(ValueError):
    """Error of a file that cannot be read as text."""


def load_table(path: Path | str, model: type[AnyTable]) -> AnyTable:
    """Read a TOML file of up to 1 MB that holds the keys of a table; errors as `load_scene`."""
    file = path_from(path)
    return load_as(read_toml(file), file, lambda _: model)


def is_text(given: object) -> TypeGuard[str]:
    """Return whether a scene is given as text of several lines, not as the path of its file."""
    return isinstance(given, str) and "\n" in given


def path_from(given: object) -> Path:
    """Return the path of a file as a `Path`. Raises `SceneError` for anything but a path, or text of one line."""
    if is_text(given) or not isinstance(given, str | os.PathLike):
        what = "a text of several lines" if isinstance(given, str) else brief_value(given)
        raise scene_error("file", f"{what} is no path; give the path of a file, as text or Path")
    return Path(given)


def load_as(
    text: str,
    path: Path,
    model_of: Callable[[dict[str, Any]], type[AnyTable]],
    changed: Mapping[str, object] = UNCHANGED,
) -> AnyTable:
    """Read TOML as the table whose type ``model_of`` returns for its data; ``path``: of its file, or a name of the text
    in messages. ``changed`` and errors as in `seatfem.load_scene`."""
    if not (isinstance(changed, Mapping) and all(isinstance(key, str) for key in changed)):
        words = "must map dotted keys to values: write {'reed.thickness': '0.2 mm'}"
        raise scene_error("changed", f"{brief_value(changed)} {words}", path)
    data = changed_data(text, path, changed)
    model = model_of(data)
    for key, other in _OTHERS.items():
        if {key, *other.beside} <= data.keys() - model.model_fields.keys():
            words = f"is a table of {other.name}: take `seatfem {other.verb} {path.name}`"
            raise scene_error(key, words, path, line_of(key, key_lines(text)))
    try:
        return model.model_validate(data, context={"folder": path.parent})
    except ValidationError as error:
        raise SceneError(explain(error, model, data, path, key_lines(text))) from None


def changed_data(text: str, path: Path, changed: Mapping[str, object] = UNCHANGED) -> dict[str, Any]:
    """Return the keys and values of a TOML file with this ``text``; ``changed`` and errors as in
    `seatfem.load_scene`."""
    data = _parse(text, path)
    for key, value in changed.items():
        _change(data, key, value, path)
    return data


def has_table(path: Path, name: str) -> bool:
    """Return whether a file is TOML with a table of this name."""
    try:
        return isinstance(_parse(read_toml(path), path).get(name), dict)
    except SceneError:
        return False


def located(error: SceneError, path: Path) -> SceneError:
    """Return the error with the scene's file, and the lines of the keys."""
    if all(problem.file for problem in error.problems):
        return error
    lines = key_lines(read_toml(path))
    placed = (each if each.file else replace(each, file=path, line=line_of(each.key, lines)) for each in error.problems)
    return SceneError(tuple(sorted(placed, key=lambda problem: problem.line)))


def read_toml(path: Path) -> str:
    """Return the text of a file of up to 1 MB. Raises `SceneError` if it cannot be read."""
    try:
        return read_text(path, LIMIT, _Unreadable)
    except (OSError, _Unreadable) as error:
        raise scene_error("", f"cannot be read: {str(error).removeprefix(f'{path}: ')}", path) from None
    except UnicodeDecodeError as error:
        words = f"is not UTF-8 text (byte {error.start}), as TOML files are; save it so"
        raise scene_error("", words, path) from None


def _parse(text: str, path: Path) -> dict[str, Any]:
    if deep_key := _DEEP_KEY.search(text):
        line = text.count("\n", 0, deep_key.start()) + 1
        raise scene_error("", f"a key of more than {DEEPEST} parts; use at most four", path, line)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"\(at line (\d+), column (\d+)\)", str(error))
        line = int(place[1]) if place else text.count("\n") + 1
        message = re.sub(r"\s*\(at .*\)$", "", str(error))
        column = f" (column {place[2]})" if place else " (end of file)"
        remedy = next((words for part, words in _REMEDIES.items() if re.search(part, message)), "mend the line")
        at = f", {key}" if (key := _key_at(text, line)) else ""
        raise scene_error("", f"TOML syntax{at}: {message}{column}: {remedy}", path, line) from None
    except RecursionError:
        raise scene_error("", "tables or arrays are nested too deeply; use at most four levels", path) from None
    except ValueError as error:  # a whole number of thousands of digits, a date that does not exist
        raise scene_error("", f"TOML: {error}; mend it", path) from None


_REMEDIES: Final = {
    "Illegal character|Unterminated": "mend the line, close its quote",
    "overwrite|mutate|Duplicate": "the key is written twice; keep one",
    "Cannot declare": "the table is written twice; move its keys under one heading, or write [[...]] of several",
    "Expected '='|statement|initial character": 'write KEY = VALUE, a quantity in quotes, as width = "0.25 mm"',
    "Expected '\\]|Unclosed": "close the bracket",
    "Invalid value": "write text and quantities in quotes, and true or false in small letters",
    r"hex|\\": "write / in place of \\ in a path",
}
"""Patterns of tomllib's messages -> remedies."""
_HEAD: Final = re.compile(r"\s*(\[\[?)\s*([^\[\]#\n]+)")


def _key_at(text: str, line: int) -> str:
    """Return the dotted key that stands in a line, counted from 1, of a text that is no valid TOML."""
    *_, last = rows = text.split("\n")[:line]
    heads = [(head[1], head[2].strip()) for row in rows if (head := _HEAD.match(row))]
    bracket, table = heads[-1] if heads else ("", "")
    number = str(heads.count((bracket, table)) - 1) if bracket == "[[" else ""
    own = "" if _HEAD.match(last) else re.match(r"\s*([\w.-]*)", last)[1]  # type: ignore[index]
    return ".".join(filter(None, (table, number, own)))


def _change(data: dict[str, Any], key: str, value: object, path: Path) -> None:
    """Set or remove one value in the data of a file; missing tables are added."""
    *tables, last = key.split(".")
    place: Any = data
    for name in tables:
        if value is None and isinstance(place, dict) and name not in place:
            return
        known = isinstance(place, list) and name.isdecimal() and int(name) < len(place)
        place = place[int(name)] if known else place.setdefault(name, {}) if isinstance(place, dict) else None
    if not isinstance(place, dict):
        words = "there is no table with such a key; choose another (a list counts its tables from 0)"
        raise scene_error(key, words, path)
    if value is None:
        place.pop(last, None)
    else:
        place[last] = value.tolist() if isinstance(value, np.generic | np.ndarray) else deepcopy(value)


MOST_PARTS: Final = 8  # largest number of parts of a key of a scene
LONGEST: Final = 200  # largest number of characters of a key


def _whole_key(key: str) -> str:
    parts = key.split(".")
    if not all(part.strip() for part in parts) or len(parts) > MOST_PARTS or len(key) > LONGEST:
        raise ValueError(f"{key[:LONGEST]!r} is no key of a scene; write its tables and its name, as reed.thickness")
    return key


WholeKey = Annotated[str, AfterValidator(_whole_key)]


def _flatten_table(table: Mapping[str, Any], own: Set[str], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield values by dotted key; a table with one of the keys ``own`` is a value, others contain further keys."""
    for key, value in table.items():
        if isinstance(value, Mapping) and not own & value.keys() and before.count(".") < MOST_PARTS:
            yield from _flatten_table(value, own, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def dotted(own: Set[str]) -> BeforeValidator:
    """Return a validator that reads reed.thickness = ... as "reed.thickness" = ...; ``own``: keys of value tables."""
    return BeforeValidator(lambda table: dict(_flatten_table(table, own)) if isinstance(table, Mapping) else table)
