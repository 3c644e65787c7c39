"""Answers of a study in words, how many scenes are within its limits and where, and columns of its table as people read
them: short words, and one unit for all results of one kind.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final

import numpy as np

from impact.quantities import in_digits, plain
from seatfem import readings
from seatfem.readings import BAR
from seatfem.results import label_of, result_of
from seatfem.study.sweep.effects import varying
from seatfem.study.sweep.limits import HOLDS, VERDICT, VERDICTS, Constraint
from seatfem.study.sweep.table import SAFETY, StudyTable

MOST: Final = 12  # largest number of lines, or of scenes in one, that tell where the limits hold


def verdicts(table: StudyTable, limit: Constraint | None = None) -> list[str]:
    """Return the verdict on each scene by all limits, or by one of them; none for a study without limits."""
    column = table.columns.get(f"{VERDICT}: {limit}") or table.columns.get(VERDICT, ())
    return [str(each) for each in column]


def limits_in_words(table: StudyTable) -> list[str]:
    """Return the limits of a study as text: "reed stress after landing below 350 MPa"."""
    axes = ((limit, axis_of(table, limit.measure)) for limit in table.study.limits)
    return [limit.in_words(axis.factor, plain(axis.unit)) for limit, axis in axes]


def answer_in_words(table: StudyTable) -> list[str]:
    """Return the answer of a study with limits in sentences: the number of scenes by verdict, and where they are."""
    if not (of_scenes := verdicts(table)):
        return []
    counts = Counter(of_scenes)
    others = "".join(f", {each} in {counts[each]}" for each in VERDICTS if counts[each] and each != HOLDS)
    limits = " and ".join(limits_in_words(table))
    return [f"{limits}: holds in {counts[HOLDS]} of {len(table)} scenes{others}", *where(table)]


def describe_study(table: StudyTable) -> list[str]:
    """Return what a study says in sentences: its scenes by state, where its limits hold, the range of each result, and
    which scenes and results are missing."""
    states = list(table.columns["status"])
    counts = ", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states))
    first = f"{table.study.heading}: {len(table)} scenes, {counts}"
    lines = [
        first,
        table.left_out_in_words(),
        bars_in_words(table),
        *answer_in_words(table),
        *ranges(table),
        *table.empty_in_words(),
    ]
    return [*filter(None, lines), *table.failures()]


def bars_in_words(table: StudyTable) -> str:
    """Return as text how many scenes have error bars of others; "" if every scene has its own."""
    of_scenes = Counter(table.columns.get("error_bars", ()))
    if not of_scenes["sampled"]:
        return ""
    others = f"{of_scenes['sampled']} others have {SAFETY:g} times the largest relative ones of these"
    return f"error bars: {of_scenes['own']} scenes have their own, {others}"


def ranges(table: StudyTable) -> list[str]:
    """Return the least, the greatest and the mean of each measure over the scenes that count for it."""
    lines = []
    for axis in (axis_of(table, name) for name in table.measures if not name.startswith(BAR)):
        values = axis.factor * table.values(axis.name)
        if np.isfinite(values).any():
            low, high, mean = (in_digits(float(f(values)), 4) for f in (np.nanmin, np.nanmax, np.nanmean))
            lines.append(f"{plain(axis.label)}: {low} to {high}, mean {mean}")
    return lines


def where(table: StudyTable) -> list[str]:
    """Return lines that tell for which values of the varied keys the limits hold.

    With one key its values in order, with two the same for each value of the second; with more the numbers of the
    scenes that hold.
    """
    keys, of_scenes, rows = varying(table), verdicts(table), range(len(table))
    if not keys:
        return []
    first, *others = (axis_of(table, name) for name in keys)
    if not others:
        return [f"{first.words} {run}" for run in _runs(table, first, rows)][:MOST]
    second = others[0]
    column = table.columns[second.name]
    values = list(dict.fromkeys(column))
    if len(others) == 1 and len(values) <= MOST:
        groups = ((value, [row for row in rows if column[row] == value]) for value in values)
        lines = ((_text(second, value), ", ".join(_runs(table, first, group))) for value, group in groups)
        return [f"{second.words} {at}: {first.words} {runs}" for at, runs in lines]
    numbers = [str(table.columns["scene"][row]) for row in rows if of_scenes[row] == HOLDS]
    more = f" and {len(numbers) - MOST} more" if len(numbers) > MOST else ""
    return [f"holds in scene{'s'[: len(numbers) > 1]} {', '.join(numbers[:MOST])}{more}"] if numbers else []


def _runs(table: StudyTable, axis: Axis, rows: Sequence[int]) -> Iterator[str]:
    """Yield text for each run of neighbouring values of a key with one verdict: "0.2 to 0.3 mm holds"."""
    column, of_scenes = table.columns[axis.name], verdicts(table)
    pairs = [(column[row], of_scenes[row]) for row in rows]
    if not table.is_text(axis.name):
        pairs.sort(key=lambda pair: pair[0])  # type: ignore[arg-type, return-value]
    for verdict, run in groupby(pairs, key=lambda pair: pair[1]):
        values = [value for value, _ in run]
        begin = f"{_text(axis, values[0], '')} to " if len(values) > 1 else ""
        yield f"{begin}{_text(axis, values[-1])} {verdict}"


def _text(axis: Axis, value: object, unit: str | None = None) -> str:
    number = f"{value:.6g}" if isinstance(value, int | float) else str(value)
    return f"{number} {axis.unit if unit is None else unit}".rstrip()


LONGEST_NAME: Final = 16  # characters of a name at a tick


def name_ticks(values: Sequence[str]) -> list[str]:
    """Return what stands at the ticks of ``values``: of a long one, such as a list, its number in the study."""
    return [value if len(value) <= LONGEST_NAME else f"value {number}" for number, value in enumerate(values, 1)]


USUAL: Final = {"Pa": ((1e6, 1e10), (1e-6, "MPa"))}
"""Units that engineers keep over a range of values [SI], where a prefix by the value would change them."""


@dataclass(frozen=True)
class Axis:
    """A column of a table: its name there, words, and the unit in which it is shown, ``factor`` times the column's."""

    name: str
    words: str
    factor: float
    unit: str

    @property
    def label(self) -> str:
        """Return what stands on an axis or at the head of a column: "peak force of landing [N]"."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words

    def text(self, value: float, bar: float | None = None) -> str:
        """Return a number of the column in the unit, with its error bar, but without the unit's name."""
        return readings.write_with_bar(self.name, value, bar, "", self.factor).replace("not known (", "(")


def axis_of(table: StudyTable, name: str) -> Axis:
    """Return a column's axis: of a result in the unit that the study states, otherwise in one that fits the largest
    result of its kind; of a varied key in the unit of its values."""
    if name in table.parameters:
        key, _, unit = name.partition(" [")
        parts = key.split(".")
        words = " ".join(dict.fromkeys((parts[0], parts[-1]))).replace("_", " ")
        return Axis(name, words, 1.0, unit.removesuffix("]"))
    factor, unit = table.study.scale(name) or _fitting(table, result_of(name).unit)
    return Axis(name, label_of(name), factor, unit)


def _fitting(table: StudyTable, unit: str) -> tuple[float, str]:
    alike = [table.values(name) for name in table.measures if result_of(name).unit == unit]
    largest = np.nanmax(np.abs(alike), initial=0.0) if alike else 0.0
    (least, most), usual = USUAL.get(unit, ((np.inf, 0.0), (1.0, unit)))
    return usual if least <= largest < most else readings.prefix_of(unit, float(largest))
