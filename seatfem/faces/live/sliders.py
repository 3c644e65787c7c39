"""Sliders of a scene: the quantities in its file, with ranges; and the file with the values of sliders."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from impact.files.safe_files import read_text
from impact.notices import SeatfemError
from seatfem.study.method import FIELDS, has_key, value_of
from seatfem.study.scene import Scene, load_scene
from seatfem.study.scene.problems import SceneError, key_lines
from seatfem.study.scene.tables import LIMIT, changed_data
from seatfem.units import UnitError, number_and_unit, write_quantity

NOT_THE_PROBLEM: Final = ("title", "assembly", "run", "accuracy", "life", "stress", "gauge")
"""Tables of a scene that say what is computed, and not of what."""
OF_THE_METHOD: Final = frozenset(FIELDS) | {key.split(".")[1] for key in FIELDS if key.count(".") == 2}
"""Keys, and names of tables within the table of a body, that say how it is computed."""
ALWAYS: Final = {"contact.gap": "length", "contact.tilt": "angle", "reed.damping_ratio": "", "seat.damping_ratio": ""}
"""Keys that have a slider where the file does not state them, and their dimensions."""
FROM_ZERO: Final = {"": 0.1, "mm": 0.1, "um": 100.0, "m": 1e-4, "deg": 1.0, "rad": 0.02}
"""Largest value of a slider whose own value is zero, by its unit; a slider of another unit needs another value."""
NUDGE: Final = 0.01  # share of its value, or of its range, by which a key is changed to see what depends on it
DIGITS: Final = 4  # of a value that a slider states


class LiveError(SeatfemError, ValueError):
    """A live page that cannot do what is asked; the message names key or file, and the remedy."""


@dataclass(frozen=True)
class Slider:
    """A quantity of a scene that can be moved.

    Attributes:
        key: dotted key in the file.
        number, unit: its value as the file states it.
        least, most: range of the number: from half to double, or from zero.
        is_quick: whether seat, reed and stopper remain as they were computed, but for their damping.
    """

    key: str
    number: float
    unit: str
    least: float
    most: float
    is_quick: bool = True

    @staticmethod
    def from_value(key: str, number: float, unit: str) -> Slider:
        """Return the slider of a value; that of a zero whose range is not known cannot be moved."""
        least, most = sorted((number / 2, 2 * number))
        return Slider(key, number, unit, least, most if number else FROM_ZERO.get(unit, 0.0))

    def written(self, number: float) -> str | float:
        """Return a number as the file has it. Raises `LiveError` outside the range."""
        if not self.least - 1e-9 * abs(self.least) <= number <= self.most + 1e-9 * abs(self.most):
            words = f"{number:g} is outside {self.least:g} to {self.most:g} {self.unit}"
            raise LiveError(f"{self.key}: {words}; choose a value within, or change the file")
        short = float(f"{number:.{DIGITS}g}")
        return f"{short:g} {self.unit}" if self.unit else short

    @property
    def nudged(self) -> tuple[float, ...]:
        """Return values close by, within the range."""
        step = NUDGE * (abs(self.number) or self.most)
        return (self.number + step, self.number - step) if self.number else (step,)

    def as_json(self) -> dict[str, Any]:
        """Return it for the page, its key in words beside it: "load.0.area" is "load 1 area"."""
        words = (f"{int(part) + 1}" if part.isdecimal() else part.replace("_", " ") for part in self.key.split("."))
        return {**asdict(self), "words": " ".join(words)}


def candidates(data: Mapping[str, Any], scene: Scene) -> Iterator[Slider]:
    """Yield a slider for each quantity that a scene's file states (``data``), and those of `ALWAYS`.

    That a key takes other values shows only when the scene is read with one (`seatfem.study.scene.load_scene`).
    """
    stated = {key: written for key, written in _values(data) if not _is_no_slider(key)}
    for key, dimension in ALWAYS.items():
        if key not in stated and has_key(scene, key) and isinstance(value := value_of(scene, key), float):
            stated[key] = write_quantity(value, dimension, 12) if dimension else value
    for key, written in stated.items():
        try:
            number, unit = number_and_unit(written)
        except UnitError:
            continue
        slider = Slider.from_value(key, number, unit)
        if slider.least < slider.most and math.isfinite(number) and (unit or not isinstance(written, str)):
            yield slider


def _is_no_slider(key: str) -> bool:
    table, *names = key.split(".")
    return table in NOT_THE_PROBLEM or key in OF_THE_METHOD or bool(OF_THE_METHOD & {*names[:-1]})


def _values(value: object, key: str = "") -> Iterator[tuple[str, Any]]:
    """Yield texts and numbers by dotted key, those in lists of values excepted."""
    if isinstance(value, str | int | float) and not isinstance(value, bool):
        yield key, value
    tables = value.items() if isinstance(value, Mapping) else enumerate(value) if isinstance(value, list) else ()
    for name, part in tables:
        if isinstance(value, Mapping) or isinstance(part, Mapping):
            yield from _values(part, f"{key}.{name}" if key else str(name))


def taken(path: Path, given: Mapping[str, object], slider: Slider) -> Scene | None:
    """Return the scene with a value of a slider close to its own; ``None`` if the scene takes no such value."""
    for number in slider.nudged:
        with suppress(SceneError):
            return load_scene(path, {**given, slider.key: slider.written(number)})
    return None


def changed_file(path: Path, changes: Mapping[str, object]) -> bytes:
    """Return the content of a scene's file with ``changes`` by dotted key, all its other lines as they are.

    Raises `LiveError` for a value that cannot be replaced alone where it stands.
    """
    text = read_text(path, LIMIT, LiveError)
    for key, value in changes.items():
        text = _replaced(text, key, value, path)
    made = ", ".join(f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in changes.items())
    first = text.index("\n") + 1 if text.startswith("#:schema") else 0  # editors look for it in the first line
    return f"{text[:first]}# from {path.name} by seatfem live{': ' * bool(made)}{made}\n{text[first:]}".encode()


def _replaced(text: str, key: str, value: object, path: Path) -> str:
    """Return the text of a file with one value replaced or added, which the reader finds where it should be."""
    changed_tables = changed_data(text, path, {key: value})
    table, _, name = key.rpartition(".")
    written = json.dumps(value, ensure_ascii=False)
    lines, known = text.splitlines(keepends=True), key_lines(text)
    if line := known.get(key):
        own = lines[line - 1]
        stated = re.finditer(rf"""({re.escape(name)}["']?\s*=\s*)("[^"]*"|'[^']*'|[^,\]}}#\s]+)""", own)
        tries = [(line - 1, own[: each.start()] + each[1] + written + own[each.end() :]) for each in stated]
    elif head := known.get(table):
        tries = [(head - 1, f"{lines[head - 1].rstrip()}\n{name} = {written}\n")]
    else:
        tries = [(len(lines) - 1, f"{lines[-1].rstrip()}\n\n[{table}]\n{name} = {written}\n")]
    for line, changed in tries:
        candidate = "".join([*lines[:line], changed, *lines[line + 1 :]])
        with suppress(tomllib.TOMLDecodeError):
            if tomllib.loads(candidate) == changed_tables:
                return candidate
    raise LiveError(f"{path}: {key} cannot be replaced alone where it stands; write {key} = {written} by hand")
