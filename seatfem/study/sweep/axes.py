"""Columns of a study's table as people read them: short words, and one unit for all results of one kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from seatfem import readings
from seatfem.results import label_of, result_of
from seatfem.study.sweep.table import StudyTable

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
        return readings.in_text(self.name, value, bar, "", self.factor).replace("not known (", "(")


def axis_of(table: StudyTable, name: str) -> Axis:
    """Return a column's axis: of a result in the unit that the study states, otherwise in one that fits the largest
    result of its kind; of a varied key in the unit of its values."""
    if name in table.parameters:
        key, _, unit = name.partition(" [")
        parts = key.split(".")
        words = " ".join(dict.fromkeys((parts[0], parts[-1]))).replace("_", " ")
        return Axis(name, words, 1.0, unit.removesuffix("]"))
    factor, unit = table.study.scale(name) or _fitting(table, result_of(name).unit)
    return Axis(name, label_of(name, ""), factor, unit)


def _fitting(table: StudyTable, unit: str) -> tuple[float, str]:
    alike = [table.values(name) for name in table.measures if result_of(name).unit == unit]
    largest = np.nanmax(np.abs(alike), initial=0.0) if alike else 0.0
    (least, most), usual = USUAL.get(unit, ((np.inf, 0.0), (1.0, unit)))
    return usual if least <= largest < most else readings.prefix_of(unit, float(largest))
