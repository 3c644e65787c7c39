"""Error messages of a scene, all at once, each with file, line and key."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Final, Literal, get_args, get_origin

from pydantic import BaseModel, BeforeValidator, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, PydanticUndefined

from impact.notices import SeatfemError
from seatfem.fields import KeyProblem, kind_of, kinds_in_words, read_number

KeyPath = tuple[str | int, ...]

_TOKEN: Final = re.compile(
    r'''"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\\n])*"|'[^'\n]*'|#[^\n]*|[][{},=.\n]|[^][\s{},=.#"']+''',
    re.DOTALL,
)
"""Parts of TOML that is valid: strings, comments, marks, and what stands between them."""


def key_lines(text: str) -> dict[str, int]:
    """Return the line (from 1) of each dotted key of a valid TOML file: {"seat": 2, "seat.material.young": 5}."""
    ends = [newline.start() for newline in re.finditer("\n", text)]
    lines: dict[str, int] = {}
    counts: dict[str, int] = {}
    places: list[tuple[str, int]] = [("", -1)]  # tables, and lists with the number of their element
    key, brackets, in_value = "", 0, False
    for token in _TOKEN.finditer(text):
        mark, line, (place, number) = token[0], bisect_left(ends, token.start()) + 1, places[-1]
        if mark == "\n" and len(places) == 1:
            key, brackets, in_value = "", 0, False
        elif mark in ".\n" or mark.startswith("#"):
            continue
        elif mark in "]}" and len(places) > 1:
            places.pop()
            key, in_value = "", True
        elif mark == ",":
            key, in_value = "", False
            places[-1] = place, number + 1 if number >= 0 else number
        elif in_value or number >= 0:
            if not in_value:
                key = f"{place}.{number}"
                lines.setdefault(key, line)
            if mark in "[{":
                places.append((key, 0 if mark == "[" else -1))
            in_value = mark not in "[{"
        elif mark == "=":
            in_value = True
        elif mark == "[":
            brackets, places[0] = brackets + 1, ("", -1)
        elif mark == "]" and brackets == 2:  # the first of two
            counts[key] = counts.get(key, -1) + 1
            places[0], brackets = (f"{key}.{counts[key]}", -1), 0
            lines[places[0][0]] = line
        elif mark == "]":
            places[0] = (key, -1) if brackets else places[0]
        else:
            name = mark.strip("\"'")
            key = f"{key or place}.{name}" if key or place else name
            lines.setdefault(key, line)
    return lines


MOST: Final = 100  # largest number of problems that are reported
_LINE_END: Final = re.compile(r"\n(?!  )")
"""Line ends in keys and values, which must not look like the next problem; lines of a list are indented."""
ALIKE: Final = 0.7
"""Least similarity of a word that is suggested."""


@dataclass(frozen=True)
class Problem:
    """One error of a scene. `line` counts from 1, 0 for the whole file; `file` is None if it is not known; then
    `seatfem.study.scene.located` finds both by the dotted key."""

    file: Path | None
    line: int
    key: str
    message: str

    def __str__(self) -> str:
        if self.file is None:
            return f"{self.key}: {self.message}"
        place = f"{self.file}:{self.line}" if self.line else str(self.file)
        text = f"{place}: {self.key}: {self.message}" if self.key else f"{place}: {self.message}"
        return _LINE_END.sub(r"\\n", text)


_LIMITS: Final = {
    "less_than": ("lt", "below"),
    "less_than_equal": ("le", "at most"),
    "greater_than": ("gt", "above"),
    "greater_than_equal": ("ge", "at least"),
}
"""Types of pydantic's errors -> name of the limit in the error, and its text."""


_PLAIN: Final = {
    "bool_": "true or false, without quotes",
    "int_": "a whole number (an integer), without quotes",
    "float_": "a number, without quotes",
    "string_": "text in quotes",
    "tuple_type": "a list in brackets, as [...]",
}
"""Beginnings of types of pydantic's errors -> what must be written."""


class SceneError(SeatfemError, ValueError):
    """Error of an unusable scene; `problems` lists all its errors."""

    def __init__(self, problems: tuple[Problem, ...]) -> None:
        super().__init__("\n".join(str(problem) for problem in problems))
        self.problems = problems


def scene_error(key: str, message: str, file: Path | None = None, line: int = 0) -> SceneError:
    """Return the error of one ``key``; ``line``: 0 for the whole file, or if `located` is to find it."""
    return SceneError((Problem(file, line, key, message),))


def explain(
    error: ValidationError, model: type[BaseModel], data: Mapping[str, Any], file: Path, lines: Mapping[str, int]
) -> tuple[Problem, ...]:
    """Return pydantic's errors as messages about the scene file, in the order of the file; at most `MOST`."""
    places = [_Place.from_details(details, model, lines) for details in error.errors(include_url=False)]
    elements = {place.path[:length] for place in places for length in range(len(place.path))}
    # a list may be too short only because pydantic dropped a wrong element
    places = [each for each in places if not (each.details["type"] == "too_short" and each.path in elements)]
    places.sort(key=lambda place: place.line)
    problems = [Problem(file, each.line, _dotted(each.path), _message(each, data)) for each in places[:MOST]]
    if len(places) > MOST:
        problems.append(
            Problem(file, places[MOST].line, "", f"{len(places) - MOST} more problems from here on; mend these first")
        )
    return tuple(problems)


@dataclass(frozen=True)
class _Place:
    """An error of pydantic and its place in the file."""

    details: ErrorDetails
    path: KeyPath
    known: tuple[str, ...]
    table: type[BaseModel] | None
    line: int
    choices: tuple[type[BaseModel], ...] = ()
    """Tables that the key may hold."""
    tables: Mapping[str, frozenset[str]] = field(default_factory=dict)
    """Keys of each table of the scene."""

    def field(self, key: object) -> FieldInfo | None:
        """Return a key's field in the table; ``None`` for an unknown key or table."""
        return self.table.model_fields.get(str(key)) if self.table else None

    @staticmethod
    def from_details(details: ErrorDetails, model: type[BaseModel], lines: Mapping[str, int]) -> _Place:
        path, table, beside = _walk(model, details["loc"])
        fields = table.model_fields.items() if table else ()
        known = (*beside, *(field.alias or name for name, field in fields))
        cause = details.get("ctx", {}).get("error")
        if isinstance(cause, KeyProblem):
            path = (*path, *(int(part) if part.isdecimal() else part for part in cause.key.split(".")))
        held = table.model_fields.get(str(path[-1])) if table and path else None
        choices = tables_in(held.annotation) if held else ()
        if details["type"].startswith("union_tag"):
            path, inlined = (*path, "kind"), table.model_fields.get(getattr(table, "inlined", "")) if table else None
            choices = choices or (tables_in(inlined.annotation) if inlined else ())
        of_file = {name: _keys_in(field.annotation) for name, field in model.model_fields.items()}
        return _Place(details, path, known, table, line_of(_dotted(path), lines), choices, of_file)


def line_of(key: str, lines: Mapping[str, int]) -> int:
    """Return the line of the dotted key, or of the nearest table around it; 0 if there is none."""
    parts = key.split(".")
    around = (".".join(parts[:length]) for length in range(len(parts), 0, -1))
    return next((lines[each] for each in around if each in lines), 0)


def _message(place: _Place, data: Mapping[str, Any]) -> str:
    details, path = place.details, place.path
    context = details.get("ctx", {})
    written = _written(data, path) if (stated := _written(data, _single(path))) is None else stated
    match details["type"]:
        case "extra_forbidden" if advice := getattr(place.table, "former", {}).get(path[-1]):
            return str(advice)
        case "extra_forbidden":
            return f"unknown key; {_meant_key(place, data)}"
        case "missing":
            field = place.field(path[-1])
            return "required key is missing" + (f": {field.description}" if field and field.description else "")
        case "union_tag_not_found":
            return f"required key is missing; choose: {kinds_in_words(place.choices)}"
        case "union_tag_invalid":
            return _not_one_of(context["tag"], context["expected_tags"], place.choices)
        case "literal_error":
            return _not_one_of(written, context["expected"])
        case "greater_than" if context["gt"] == 0:
            return f"{written!r} must be positive{_suggest_positive(written)}"
        case "greater_than_equal" if context["ge"] == 0:
            return f"{written!r} must be >= 0{_suggest_positive(written)}"
        case "model_type" | "model_attributes_type" | "dict_type" if isinstance(written, list) and len(path) == 1:
            return f"is written as several tables, but there is one: write [{path[0]}], in one bracket"
        case "model_type" | "model_attributes_type" | "dict_type":
            table = f"[{path[-1]}]" if len(path) == 1 else f"{path[-1]} = {{ ... }}"
            return f"{written!r} is no table; write {table}{_content(place)}"
        case "tuple_type" if place.choices and isinstance(written, Mapping):
            return f"is written as one table, but there may be several: write [[{_dotted(path)}]], in two brackets"
        case "path_type":
            return f"{written!r} is no path of a file; write the path alone, in quotes"
        case "value_error":
            field = place.field(path[-1])
            is_default = written is None and field is not None and field.default not in (None, PydanticUndefined)
            more = "; this is its default: state the key, or check the others" if is_default else ""
            return f"{context['error']}{more}"
        case limit if limit in _LIMITS:
            name, words = _LIMITS[limit]
            field = place.field(path[-1])
            what = f" ({field.description.partition(';')[0]})" if field and field.description else ""
            return f"{written!r} must be {words} {context[name]:g}{_meant_percent(place, written) or what}"
        case kind if plain := next((words for name, words in _PLAIN.items() if kind.startswith(name)), ""):
            return f"{written!r} must be {plain.replace('...', repr(written))}"
    return f"{written!r}: {details['msg'][0].lower()}{details['msg'][1:]}"


def _single(path: KeyPath) -> KeyPath:
    """Return the path with dotted names divided, even if quoted: ("vary", "reed.length") has three parts."""
    return tuple(part for each in path for part in (each.split(".") if isinstance(each, str) else [each]))


def _dotted(path: KeyPath) -> str:
    """Return a path as a key: "load.0.area"."""
    return ".".join(map(str, path))


def _meant_percent(place: _Place, written: object) -> str:
    """Return a question if a fraction was probably written in percent, else ""."""
    field = place.field(place.path[-1])
    is_share = field is not None and reader_of(notes_of(field)) is read_number
    with suppress(TypeError, ValueError):
        if is_share and 1 <= (number := float(written)) < 100:  # type: ignore[arg-type]
            return f'; did you mean {number:g} %? write {number / 100:g} or "{number:g} %"'
    return ""


def _suggest_positive(written: object) -> str:
    """Return what to write in place of a negative quantity, else ""."""
    positive = str(written).removeprefix("-").strip()
    return f"; write {positive!r}" if isinstance(written, str) and written.startswith("-") else ""


_SYMBOLS: Final = {
    **{"e": "young", "nu": "poisson", "rho": "density", "zeta": "damping_ratio", "eta": "loss_factor"},
    **{"modulus": "young", "dt": "time_step", "t": "thickness", "k": "stiffness", "m": "mass", "v": "velocity"},
    **{"retainer": "stopper", "guard": "stopper"},
}
"""Usual symbols and names of keys, in small letters."""


def _meant_key(place: _Place, data: Mapping[str, Any]) -> str:
    """Return the key that is probably meant by an unknown one, the tables that have such a key, or all keys there."""
    key, known = str(place.path[-1]), place.known
    if len(place.path) > 1 and place.tables.get(key):
        return f"it is a table of the scene: write [{key}] on a line of its own"
    for one, other, size in (("diameter", "radius", "half the diameter"), ("radius", "diameter", "twice the radius")):
        if (meant := key.replace(one, other)) != key and meant in known:
            return f"did you mean {meant!r}? write {size}"
    meant = _SYMBOLS.get(key.lower(), key)
    if close := did_you_mean(meant, known):
        return close.removeprefix("; ")
    if homes := [table for table, keys in place.tables.items() if meant in keys]:
        homes = [table for table in homes if table in data] or homes
        return f"did you mean {' or '.join(f'{table}.{meant}' for table in homes)}? move it there"
    return f"known here: {', '.join(known)}"


def _keys_in(annotation: object) -> frozenset[str]:
    """Return the keys of the tables that a key of this type may hold; none if it holds no table."""
    return frozenset(key for table in tables_in(annotation) for key in table.model_fields)


def notes_of(field: FieldInfo) -> Iterator[object]:
    """Yield the annotations of the field, or of one side of `... | None`."""
    yield from field.metadata
    for kind in get_args(field.annotation):
        yield from get_args(kind)[1:] if get_origin(kind) is Annotated else ()


def reader_of(notes: Iterable[object]) -> Any:
    """Return the function that reads a value from the file, such as a `ReadQuantity`; ``None`` if there is none."""
    return next((note.func for note in notes if isinstance(note, BeforeValidator)), None)


def _content(place: _Place) -> str:
    """Return the keys, or kinds, of the table that a key should hold, as part of a message."""
    if len(place.choices) == 1:
        return f"; keys: {', '.join(own_keys(place.choices[0]))}"
    return f"; kinds: {kinds_in_words(place.choices)}" if any(map(kind_of, place.choices)) else ""


def _not_one_of(written: object, expected: str, kinds: tuple[type[BaseModel], ...] = ()) -> str:
    """Return a message with the options, kinds by groups, and the option of the most similar name."""
    if kinds and all(getattr(each, "group", "") for each in kinds):
        words = f"{written!r} is no kind; choose: {kinds_in_words(kinds)}"
        return words + did_you_mean(str(written), map(kind_of, kinds))
    allowed = expected.replace(" or ", ", ")
    names = (name.strip().strip("'") for name in allowed.split(","))
    return f"{written!r} is not one of {allowed}" + did_you_mean(str(written), names)


def did_you_mean(written: str, known: Iterable[str]) -> str:
    """Return a question for the most similar of the ``known`` words; "" if none is similar."""
    close = get_close_matches(written, list(known), n=1, cutoff=ALIKE)
    return f"; did you mean {close[0]!r}?" if close else ""


def _written(data: object, path: KeyPath) -> object:
    """Return the value at `path` in the file; None if it is absent."""
    for part in path:
        is_key = isinstance(data, Mapping) and part in data
        if not (is_key or (isinstance(data, list) and isinstance(part, int) and part < len(data))):
            return None
        data = data[part]  # type: ignore[index]
    return data


def _walk(model: type[BaseModel], location: KeyPath) -> tuple[KeyPath, type[BaseModel] | None, tuple[str, ...]]:
    """Return the path in the file (without tags inserted by pydantic), the table of its last key, and, if that table is
    written without a name inside another one (``inlined``), the keys of the latter."""
    table: type[BaseModel] | None = model
    tables: tuple[type[BaseModel], ...] = ()
    named = False  # the next part is a name that the user chose
    path: KeyPath = ()
    beside: tuple[str, ...] = ()
    depth = 0  # length of paths to keys of an inlined table
    for part in location:
        if isinstance(part, int) or named:
            path, named = (*path, part), False
            continue
        if len(tables) > 1 and part in (tags := {kind_of(each): each for each in tables}):
            table, tables = tags[str(part)], ()
            continue
        if len(tables) == 1:
            table = tables[0]
        if table is not None and part and part == getattr(table, "inlined", ""):
            beside, tables = tuple(own_keys(table)), tables_in(table.model_fields[str(part)].annotation)
            depth = len(path) + 1
            continue
        field = table.model_fields.get(str(part)) if table else None
        tables = tables_in(field.annotation) if field else ()
        named = field is not None and get_origin(field.annotation) is dict
        path = (*path, part)
    return path, table, beside if len(path) == depth else ()


def own_keys(table: type[BaseModel]) -> dict[str, FieldInfo]:
    """Return the table's keys except an ``inlined`` field, whose keys are written in the table itself."""
    return {name: field for name, field in table.model_fields.items() if name != getattr(table, "inlined", "")}


def tables_in(annotation: object) -> tuple[type[BaseModel], ...]:
    """Return the tables that a key of this type may hold."""
    return tuple(kind for kind in leaves(annotation) if isinstance(kind, type) and issubclass(kind, BaseModel))


def leaves(annotation: object) -> Iterator[Any]:
    """Yield the plain types behind unions and annotations."""
    if get_origin(annotation) is Literal or not get_args(annotation):
        yield annotation
        return
    for part in get_args(annotation):
        yield from leaves(part)


_AS_IF: Final = r"(?<![\w/\\.])(?:seat|reed)\."
"""Names of tables in messages of structures, which name a role whatever the body's own is."""


def rewrite_message(role: str, structure: BaseModel, text: str) -> str:
    """Return a structure's message with its keys as those of the table ``role``; names of files are not changed."""
    if role == "stopper":  # keys of [stopper] divide its face
        text = text.replace("contact.ports", "stopper.arcs").replace("contact.rings", "stopper.rings")
    keys = "|".join(sorted(type(structure).model_fields, key=len, reverse=True))
    return re.sub(rf"{_AS_IF}(?=(?:{keys})\b)", f"{role}.", text)


@contextmanager
def rewrite_errors(role: str, structure: BaseModel) -> Iterator[None]:
    """Rewrite errors about a body so that they name keys of the table ``role``."""
    try:
        yield
    except (ArithmeticError, RuntimeError, ValueError) as problem:
        if problem.args and isinstance(problem.args[0], str):
            problem.args = (rewrite_message(role, structure, problem.args[0]), *problem.args[1:])
        raise
