"""Outcome of a run for its caller, as text, as a table in a notebook and as a data frame."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from impact.after.frame import frame_of
from impact.brief import as_html, brief
from seatfem.study.planning.plan import Plan

if TYPE_CHECKING:
    import pandas

    from seatfem.structures.natural_modes import Mode


MOST_UNCERTAIN: Final = 0.5
"""Share of a value that its error bar may be: with a larger one not even the first digit is known."""
WITHOUT_ZERO: Final = ("time_s", "contact_s", "_deg")
"""How keys of instants and places end: their zero is a convention, and no share of them says anything."""


class Measured(NamedTuple):
    """A number of summary.json, its unit in its name [SI].

    ``error_bar`` is ``None`` where there is none, ``spring`` where the baseline has no such number; ``known`` tells
    whether the bar leaves the value known (`is_known`), and is ``None`` where the summary states no bar.
    """

    key: str
    value: float
    error_bar: float | None
    spring: float | None
    known: bool | None


def is_known(key: str, value: float, bar: float | None) -> bool:
    """Return whether the value of a ``key`` is known: its error bar is a number, at most `MOST_UNCERTAIN` of it."""
    if bar is None or not math.isfinite(bar):
        return False
    return key.endswith(WITHOUT_ZERO) or bar <= MOST_UNCERTAIN * abs(value)


def measured(summary: Mapping[str, object]) -> Iterator[Measured]:
    """Yield the numbers of a run in the order of summary.json, each with its error bar and the spring's value."""
    for key, value in summary.items():
        if (number := as_number(value)) is not None and not key.startswith(("spring_", "error_", "plan_")):
            bar, spring = (as_number(summary.get(f"{prefix}_{key}")) for prefix in ("error_bar", "spring"))
            stated = f"error_bar_{key}" in summary
            yield Measured(key, number, bar, spring, is_known(key, number, bar) if stated else None)


def as_number(value: object) -> float | None:
    """Return a finite number, or ``None`` of anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return value


@dataclass(frozen=True)
class RunOutcome:
    """Results, files and notes of a run.

    Attributes:
        summary: the content of summary.json.
        messages: warnings and notes, a sentence each.
        files: that were written.
        stages: seconds that each stage took.
        met: whether the target of accuracy was met; ``None`` where nothing landed that it could be asked of.
        modes: natural modes, where they were asked for.
        plan: of the last round.
    """

    summary: Mapping[str, object]
    messages: tuple[str, ...]
    files: tuple[Path, ...]
    stages: Mapping[str, float] = field(default_factory=dict)
    met: bool | None = True
    modes: tuple[Mode, ...] = ()
    plan: Plan | None = None

    __repr__ = brief
    _repr_html_ = as_html

    def __str__(self) -> str:
        lines = []
        for row in measured(self.summary):
            if row.known is None:
                continue
            bar = "?" if row.error_bar is None else f"{row.error_bar:.2g}"
            number = f"{row.value:.5g} +- {bar}" if row.known else f"not known ({row.value:.5g} +- {bar})"
            spring = "" if row.spring is None else f", spring baseline {row.spring:.5g}"
            lines.append(f"{row.key}: {number}{spring}")
        target = "target reached" if self.met else "target missed"
        if self.met is None:
            target = f"{self.summary.get('landing_status') or 'nothing to judge'}: no target judged"
        elif judged := str(self.summary.get("accuracy_judged_keys") or self.summary.get("accuracy_measures") or ""):
            target = f"{target} ({judged})"
        return "\n  ".join([f"RunOutcome, {target}, {len(self.files)} files", *lines])

    def to_dataframe(self) -> pandas.DataFrame:
        """Return key, value, error_bar, spring and known of every number [SI], the key as index; ``known`` is False
        where the bar is above half of the value. Raises `FrameError` without pandas."""
        rows = list(measured(self.summary))
        return frame_of({name: [getattr(row, name) for row in rows] for name in Measured._fields}, "key")
