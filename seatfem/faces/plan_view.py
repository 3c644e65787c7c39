"""Tables and JSON of a plan, and the values read from a scene file, with units."""

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from rich.table import Table

from impact.files.csv_table import read_csv, without_nan
from impact.quantities import enumeration, in_digits, in_time, percent
from impact.runs.variations import SAFETY
from seatfem import fields
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.motion import Record, Recorded
from seatfem.study.answers.verdict import is_static
from seatfem.study.method import MODEL
from seatfem.study.plan import Choice, Plan
from seatfem.study.runs import round as rounds
from seatfem.study.runs.converge import errors_by_key, words_of
from seatfem.study.runs.forecast import Look
from seatfem.study.scene import Contact, Scene, drives, files, keys, tables
from seatfem.study.scene.measures import all_measures, asked_name, short_words
from seatfem.study.scene.wings import tables_in_files
from seatfem.units import write_quantity

SHOWN: Final = 4  # largest number of values of a list that are shown; longer lists are shown as number and range
HOW: Final = ("run", "accuracy", "title")
"""Tables and keys that are omitted, as the table of the plan states them."""
TABLES: Final = (".csv", ".tsv", ".txt", ".asc")
NOT_SHOWN: Final = ("kind", "name", "mesh", "greens")
_NONE: Final = FieldInfo(default=None)


def read_back(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Return the keys that a scene file states as rows (key, value), the struck face of each body, and what its file
    says besides.

    Raises:
        SceneError: a file that cannot be read, or has no such face.
    """
    files.check_files(scene)
    rows: list[tuple[str, str]] = []
    for key in type(scene).model_fields:
        value = getattr(scene, key)
        tables = value if isinstance(value, tuple) else (value,)
        for number, table in enumerate(tables, start=1):
            if key in HOW or not isinstance(table, BaseModel) or not (words := _words(table, key)):
                continue
            rows.append((f"{key} {number}" if len(tables) > 1 else key, words))
            if isinstance(table, Structure) and (face := _struck(table, along=key == "seat" and scene.contact)):
                rows.append((f"{key}, face", face))
            if isinstance(table, Structure) and (notes := table.file_notes()):
                rows.append((f"{key}, file", "; ".join(notes)))
    return tuple(rows)


def read_tables(scene: Scene) -> Iterator[Table]:
    """Yield the rows of `read_back` as a table; none for a scene without files. Raises as `read_back`."""
    if not files.files_of(scene):
        return
    table = Table("table", "what was read")
    for name, words in read_back(scene):
        table.add_row(name, words)
    yield table


def _struck(body: Structure, along: Contact | Literal[False]) -> str:
    """Return what was read of a body's file, and what is known without a mesh about its struck face."""
    facts = [counted] if (counted := body.counted()) else []
    if (ring := body.lip_face.ring) is not None:
        mean, width = (write_quantity(size, "length") for size in ring)
        facts.append(f"flat ring, mean radius {mean}, width {width}")
    elif along and along.lip_key and (lip := body.region()) is not None:
        facts.append(f"lip {write_quantity(lip.length, 'length')} long")
    if (patch := body.patch()) is not None:
        about, digits = ("", 5) if ring else ("about ", 2)  # an area by coarse flat triangles is approximate
        area, width = write_quantity(patch.area, "area", digits), write_quantity(patch.width, "length", digits)
        facts.append(f"area {about}{area}, narrowest width {about}{width}")
    return "; ".join(facts)


def _words(table: BaseModel, key: str = "") -> str:
    """Return the kind or name of a table, then each key that the file states, in the order of docs/scene.md."""
    kind = fields.kind_of(type(table)) if type(table).model_fields.get("kind", _NONE).is_required() else ""
    first = [getattr(table, "name", None) or kind.replace("_", " ")]
    facts = []
    for name, field in type(table).model_fields.items():
        value = getattr(table, name)
        if name not in table.model_fields_set or name in NOT_SHOWN or value is None or value in ((), {}, ""):
            continue
        if name == getattr(table, "inlined", ""):
            first.append(_words(value, key))
        elif name == kind and not isinstance(value, BaseModel):
            first.append(_value(value, field, f"{key}.{name}"))
        else:
            facts.append(f"{name.replace('_', ' ')} {_value(value, field, f'{key}.{name}')}")
    if isinstance(table, Recorded) and (record := table.record()) is not None:
        facts.append(_understood(record))
    return ", ".join(filter(None, (" ".join(filter(None, first)), *facts)))


def _understood(record: Record) -> str:
    """Return the ranges of a recorded history's values and times, in the units that the program understood."""
    course, dimension = record.course, "length" if record.quantity == "displacement" else record.quantity
    low, high = (write_quantity(float(end), dimension) for end in (course.value.min(), course.value.max()))
    first, last = (write_quantity(float(end), "time") for end in (course.time[0], course.time[-1]))
    over = f"repeated every {write_quantity(course.period, 'time')}" if course.period else f"from {first} to {last}"
    return f"read as {record.quantity} {low} to {high} {over}"


def _value(value: object, field: FieldInfo, key: str) -> str:
    if isinstance(value, drives.AreaByLift) and len(value.area) == 1:  # constant area
        return write_quantity(value.area[0], "area")
    if isinstance(value, BaseModel):
        inner, named = _words(value, key), bool(getattr(value, "name", ""))
        return inner.replace(", ", " (", 1) + ")" * (", " in inner) if named else f"({inner})"
    if isinstance(value, Path):
        return _file(value, key)
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_value(each, field, key)}" for name, each in value.items())
    if isinstance(value, tuple):
        return _several(value, field, key)
    if isinstance(value, bool):
        return "yes" if value else "no"
    return write_quantity(value, keys.dimension_of(field)) if isinstance(value, float) else str(value)


def _several(values: tuple[Any, ...], field: FieldInfo, key: str) -> str:
    if len(values) <= SHOWN or not all(isinstance(each, float) for each in values):
        text = ", ".join(_value(each, field, key) for each in values[:SHOWN])
        return f"[{text}{f', ... {len(values)} in all' if len(values) > SHOWN else ''}]"
    return f"{len(values)} from {_value(min(values), field, key)} to {_value(max(values), field, key)}"


def _file(path: Path, key: str) -> str:
    """Return a file's name; for columns also the number of rows and ranges, for a TOML file its content."""
    if (table := tables_in_files().get(key)) is not None:
        return f"{path.name} ({_words(tables.load_table(path, table), key)})"
    if path.suffix.lower() in TABLES and (columns := _columns(path)):
        return f"{path.name} ({columns})"
    return f"{path.name} ({math.ceil(path.stat().st_size / 1000):,} kB)"


def _columns(path: Path) -> str:
    """Return the number of rows and the range of each column; "" for a table without headers or with other cells."""
    try:
        table = read_csv(path, ValueError)
        numbers = table.numbers()
    except ValueError:
        return ""
    if not numbers.size:
        return ""
    ranges = zip(table.heads, numbers.min(axis=0), numbers.max(axis=0), strict=True)
    columns = ", ".join(f"{head.text} {in_digits(low, 6)} to {in_digits(high, 6)}" for head, low, high in ranges)
    return f"{len(numbers)} rows, {table.dialect}: {columns}"


OF_WAVES: Final = "seat.greens."
"""Beginning of the keys of a seat's response over frequency."""
COUNTS: Final = 0.01
"""Fraction of the largest error by a key below which another one is not shown."""


def choices_table(plan: Plan) -> Table:
    """Return a table of all choices of a plan, as `table_of`."""
    return table_of(plan.choices)


def table_of(choices: Iterable[Choice]) -> Table:
    """Return a table of choices: value, by file or plan, its error, and its reason.

    Keys of the response over frequency are left out where the seat is static and the plan chose them.
    """
    table, every = Table("key", "value", "from", "error left", "why"), list(choices)
    static = is_static({"plan_seat_level": next((each.value for each in every if each.key == MODEL), "")})
    for each in every:
        if static and each.key.startswith(OF_WAVES) and not each.given:
            continue
        table.add_row(*map(str, (each.key, each.value, "file" if each.given else "plan", each.leaves, each.reason)))
    return table


def look_lines(look: Look) -> Iterator[str]:
    """Yield the lines below the table: the measured uncertainty and whether it meets the target; for each measure that
    misses it the keys that leave most, largest first; what is left to do and what it will take; notes."""
    done, target = look.done, look.plan.scene.accuracy.target
    bars = {
        name: done.budget.relative(name) for name in sorted(done.judged, key=lambda name: -done.budget.relative(name))
    }
    if bars:
        verdict = "reached" if done.met else "missed so far"
        words = ", ".join(rounds.bar_in_words(name, bar) for name, bar in bars.items())
        counted = f"{done.number} round{'s'[: done.number > 1]}, {in_time(sum(look.stages.values()))}"
        yield f"target {verdict}: {words} measured ({counted}); asked for: {judged_line(look.plan)}"
    else:
        yield f"nothing to judge: no such landing in run.duration; asked for: {judged_line(look.plan)}"
    for name, bar in bars.items():
        if math.isinf(bar):
            yield f"{short_words(name)} is not known: {rounds.UNKNOWN}"
        elif bar > target:
            yield f"{short_words(name)} +-{percent(bar)} is left by: {', '.join(_largest(done, name))}"
    yield f"left to do: {_left_in_words(look)}"
    yield from (f"note: {note}" for note in rounds.remarks(done, rounds.not_modelled(done)))


def _largest(done: rounds.Round, measure: str) -> Iterator[str]:
    """Yield the keys with their parts of the error bar of a measure, largest first, those that count."""
    whole = abs(done.budget.values[measure]) or math.inf
    parts = {key: SAFETY * error / whole for key, error in errors_by_key(done, measure).items()}
    for key in sorted(parts, key=lambda key: -parts[key]):
        if 0 < parts[key] >= COUNTS * max(parts.values()):
            yield f"{key if '.' in key else words_of(key)} {percent(parts[key])}"


def _left_in_words(look: Look) -> str:
    """Return in words the further rounds of a run, the time that they take, and the uncertainty after them."""
    left = look.left
    if left.why and not left.rounds:
        return f"nothing more: {left.why}"
    files = f"files and pictures, about {in_time(left.after)}"
    if not left.rounds:
        return f"nothing more; a run repeats the contact and writes all {files}"
    bars = ", ".join(
        rounds.bar_in_words(name, bar) for name, bar in left.error.items() if bar != look.done.budget.relative(name)
    )
    expected = f"; expected after {'it' if left.rounds == 1 else 'them'}: {bars}" if bars else ""
    why = f" ({left.why})" if left.why else ""
    cost = f"about {in_time(left.seconds)}" + ("" if math.isnan(left.memory) else f", {left.memory / 1e9:.2g} GB")
    return f"{left.rounds} round{'s'[: left.rounds > 1]}, {cost}, first {left.changes}{expected}{why}; then {files}"


def judged_line(plan: Plan) -> str:
    """Return the measures, and the landing, to which the target of accuracy applies."""
    accuracy = plan.scene.accuracy
    of_it = "of the whole run" if accuracy.landing == "run" else f"of the {accuracy.landing} landing on the seat"
    names = enumeration(all_measures()[name].words for name in accuracy.measures)
    return f"{percent(accuracy.target, 3)} in {names} {of_it}"


def plan_json(plan: Plan, look: Look | None = None) -> str:
    """Return the plan as a JSON object: relative errors, ``scene`` in SI with all keys; of a ``look`` also what is left
    to do, times in s, memory in bytes.

    A number that is not finite, such as the relative error of a measure that is zero, is null.
    """
    scene = plan.scene
    left = (
        {}
        if look is None
        else {
            "meets_target": bool(look.done.met),
            "time_s": look.seconds,
            "stages_s": dict(look.stages),
            "memory_bytes": look.left.memory,
            "left": asdict(look.left),
            "notes": list(rounds.remarks(look.done, rounds.not_modelled(look.done))),
        }
    )
    data = {
        "title": scene.title,
        "read": dict(read_back(scene)),
        "level": plan.level,
        "target": scene.accuracy.target,
        "judged": judged_line(plan),
        "choices": [asdict(choice) for choice in plan.choices],
        "error": {asked_name(name): value for name, value in plan.error.items()},
        **left,
        "scene": plan.as_stated().model_dump(mode="json", warnings=False),
    }
    text = json.dumps(without_nan(data), indent=1, allow_nan=False)
    return text.replace("\x7f", "\\u007f")  # the one control character that json does not escape
