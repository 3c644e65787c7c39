"""The table of a study: one row a scene, with its values, measures, error bars and what became of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.brief import brief
from impact.extras import how_to_mend
from impact.files.atomic import whole_file
from impact.files.table import write_csv
from seatfem.study.impacts.landed import BAR, LANDED, STATUS, has_landed, left_out_in_words, needs_landing
from seatfem.study.scene.measures import key_of
from seatfem.study.sweep.cases import Case, columns_of
from seatfem.study.sweep.outcome import NOTES, Outcome
from seatfem.study.sweep.runner import StudyError
from seatfem.study.sweep.sampled import is_own, judged
from seatfem.study.sweep.study import Study

Columns = Mapping[str, Sequence[object]]
MODULES: Final[Mapping[str, str]] = {"pandas": "pandas", "pyarrow": "pyarrow.parquet"}
"""What is imported of the optional packages by which tables are written, absent or whole."""


@dataclass(frozen=True)
class StudyTable:
    """Table of the results of a study.

    Attributes:
        study: what was asked.
        parameters: columns of what varies, as "reed.thickness [mm]", in the order of the study.
        measures: columns of what is asked; beside each that has one its error bar, "error_bar_" + its name, SI.
        columns: all of them, by scene; ``None`` where a scene tells nothing.

    Means and all else that follows from the table are of `counted` scenes.
    """

    study: Study
    parameters: tuple[str, ...]
    measures: tuple[str, ...]
    columns: Columns

    __repr__ = brief

    def __len__(self) -> int:
        return len(self.columns["scene"])

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return a column (scenes,); nan where it is no number."""
        values = self.columns.get(name, [None] * len(self))
        return np.array([float(v) if isinstance(v, int | float) else np.nan for v in values])

    def counted(self, name: str) -> NDArray[np.bool_]:
        """Return (scenes,) which count for a measure: carried out, and landed where it speaks of a landing."""
        return self.has_numbers & self.has_landed if needs_landing(name) else self.has_numbers

    def values(self, name: str) -> NDArray[np.float64]:
        """Return (scenes,) a measure; nan of scenes that do not count for it."""
        return np.where(self.counted(name), self.numbers(name), np.nan)

    def is_text(self, name: str) -> bool:
        """Return whether a column holds names."""
        return any(isinstance(value, str) for value in self.columns[name])

    @cached_property
    def has_numbers(self) -> NDArray[np.bool_]:
        """Return (scenes,) which were carried out."""
        return np.array([state in ("done", "missed") for state in self.columns["status"]])

    @cached_property
    def has_landed(self) -> NDArray[np.bool_]:
        """Return (scenes,) in which the reed landed on its seat, and the end of the run did not cut that off."""
        return np.array([status in (None, LANDED) for status in self.columns.get(STATUS, [None] * len(self))])

    @property
    def left_out(self) -> NDArray[np.bool_]:
        """Return (scenes,) carried out, and left out of what follows from a measure that is asked for."""
        return self.has_numbers & ~self.has_landed & any(map(needs_landing, self.measures))

    def left_out_in_words(self) -> str:
        """Return how many scenes did not land or were cut off, and so count for nothing; "" of none."""
        if not self.left_out.any():
            return ""
        every = zip(self.columns[STATUS], self.left_out, strict=True)
        return left_out_in_words(status if out else LANDED for status, out in every)

    def ranges(self) -> list[str]:
        """Return the least, mean and largest of each measure that is a number, over the scenes that count [SI]."""
        lines = []
        for name in self.measures:
            values = self.values(name)[np.isfinite(self.values(name))]
            if values.size and not name.startswith(BAR):
                lines.append(f"{name}: {values.min():.4g} to {values.max():.4g}, mean {values.mean():.4g}")
        return lines

    def unanswered(self) -> tuple[str, ...]:
        """Return the measures that are empty in all scenes that count for them."""
        return tuple(name for name in self.measures if self.has_numbers.any() and not self._answers(name).any())

    def empty_in_words(self) -> list[str]:
        """Return which measures are empty, and in how many of the scenes that count for them."""
        words = []
        for name in self.measures:
            counted = self.counted(name)
            empty, count = int((counted & ~self._answers(name)).sum()), int(counted.sum())
            if name in self.unanswered():
                words.append(f"{name}: no scene has it" + (f", of {count} that landed" if count else ": none landed"))
            elif empty:
                words.append(f"{name}: empty in {empty} of {count} scenes that count for it")
        return words

    def _answers(self, name: str) -> NDArray[np.bool_]:
        """Return (scenes,) which count for a measure and have a value of it."""
        known = np.array([value is not None for value in self.columns[name]], dtype=np.bool_)
        return np.asarray(self.counted(name) & known)

    def failures(self) -> list[str]:
        """Return what became of the scenes without numbers, in words."""
        shown = zip(*(self.columns[name] for name in ("scene", "status", "message", *self.parameters)), strict=True)
        return [
            f"scene {number} ({', '.join(f'{key} = {v}' for key, v in zip(self.parameters, row, strict=True))}): "
            f"{state}: {message}"
            for number, state, message, *row in shown
            if state not in ("done", "missed")
        ]


def measures_of(study: Study, judged: Sequence[str]) -> tuple[str, ...]:
    """Return the keys of summary.json that the study asks for; without any those that its first scene is judged by."""
    usual = () if study.outputs.measures else tuple(map(key_of, judged))
    return tuple(dict.fromkeys((*usual, *study.outputs.asked())))


def check_measures(measures: Sequence[str], outcome: Outcome, table: str = "outputs") -> None:
    """Raise `StudyError` for keys, named in a ``table`` of the study, that a scene's summary does not have.

    One that did not land tells nothing of that: it may lack some.
    """
    if not outcome.has_numbers or not has_landed(outcome.summary):
        return
    for name in measures:
        if name not in outcome.summary:
            close = get_close_matches(name, outcome.summary, n=3)
            remedy = f"did you mean {' or '.join(map(repr, close))}?" if close else "see summary.json of a run"
            raise StudyError(f"{table}: summary.json of these scenes has no single value {name!r}; {remedy}")


def table_of(study: Study, cases: list[Case], outcomes: Mapping[str, Outcome], measures: Sequence[str]) -> StudyTable:
    """Return the table, one row for each case."""
    if study.error_bars == "sampled":
        outcomes = judged(cases, outcomes, measures)
    results = [outcomes[case.key] for case in cases]
    parameters = columns_of(cases, study)
    columns: dict[str, list[object]] = {"scene": [case.number for case in cases], **parameters}
    for name in measures:
        columns[name] = [outcome.summary.get(name) for outcome in results]
        bars: list[object] = [outcome.summary.get(BAR + name) for outcome in results]
        if any(bar is not None for bar in bars):
            columns[BAR + name] = bars
    if study.error_bars == "sampled":
        columns["error_bars"] = ["own" if is_own(outcome) else "sampled" for outcome in results]
    if any(STATUS in outcome.summary for outcome in results):
        columns[STATUS] = [outcome.summary.get(STATUS) for outcome in results]
    columns["status"] = [outcome.state for outcome in results]
    columns["wall_time_s"] = [outcome.wall for outcome in results]
    columns["message"] = [" ".join(outcome.message.split()) for outcome in results]
    columns[NOTES] = [" ".join(str(outcome.summary.get(NOTES) or "").split()) for outcome in results]
    return StudyTable(study, tuple(parameters), tuple(measures), columns)


def write_columns(path: Path, columns: Columns) -> None:
    """Write all digits of every number, nothing where there is none; whole or absent."""
    write_csv(path, columns, zip(*columns.values(), strict=True))


def is_usable(package: str) -> bool:
    """Return whether a package of the extra "tables" is there.

    Studies ask before their first scene. Raises `StudyError` of one that is installed and cannot be imported.
    """
    if find_spec(package) is None:
        return False
    try:
        import_module(MODULES[package])
    except Exception as error:  # a broken one raises anything
        remedy = f"{how_to_mend(package, 'tables', error)}, or go without: pip uninstall {package}"
        raise StudyError(f"tables of studies: {remedy}") from error
    return True


def write_parquet(path: Path, columns: Columns) -> bool:
    """Write the same for programs that read Parquet, if pyarrow is there; whole or absent."""
    if not is_usable("pyarrow"):
        return False
    import pyarrow
    import pyarrow.parquet

    with whole_file(path) as temporary:
        pyarrow.parquet.write_table(pyarrow.table({name: list(column) for name, column in columns.items()}), temporary)
    return True


def as_frame(columns: Columns) -> Any:
    """Return a pandas DataFrame where pandas is there, else the columns."""
    if not is_usable("pandas"):
        return columns
    import pandas

    return pandas.DataFrame(columns)
