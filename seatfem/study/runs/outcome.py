"""What a run leaves to who called it, as text, as a table in a notebook and as a data frame."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from impact.after.frame import frame_of
from impact.brief import as_html, brief
from seatfem.study.planning.plan import Plan

if TYPE_CHECKING:
    import pandas

    from seatfem.structures.natural_modes import Mode


class Measured(NamedTuple):
    """A number of summary.json, its unit in its name [SI]; ``None`` where there is no bar, or no spring to compare."""

    key: str
    value: float
    error_bar: float | None
    spring: float | None


def measured(summary: Mapping[str, object]) -> Iterator[Measured]:
    """The numbers of a run in the order of summary.json, each with its error bar and the spring baseline's value."""
    for key, value in summary.items():
        number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if number and not key.startswith(("spring_", "error_", "plan_")):
            yield Measured(key, value, *(summary.get(f"{of}_{key}") for of in ("error_bar", "spring")))  # type: ignore[arg-type]


@dataclass(frozen=True)
class RunOutcome:
    """What a run left.

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
        barred = [row for row in measured(self.summary) if row.error_bar is not None]
        lines = [
            f"{row.key}: {row.value:.5g} +- {row.error_bar:.2g}"
            + ("" if row.spring is None else f", spring baseline {row.spring:.5g}")
            for row in barred
        ]
        target = "no landing" if self.met is None else "target met" if self.met else "target missed"
        return "\n  ".join([f"RunOutcome, {target}, {len(self.files)} files", *lines])

    def to_dataframe(self) -> pandas.DataFrame:
        """Key, value, error_bar and spring of every number [SI], the key as index; raises `FrameError`, no pandas."""
        rows = list(measured(self.summary))
        return frame_of({name: [getattr(row, name) for row in rows] for name in Measured._fields}, "key")
