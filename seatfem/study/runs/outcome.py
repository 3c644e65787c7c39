"""Outcome of a run for its caller, as text, as a table in a notebook and as a data frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from impact.after.frame import frame_of
from impact.brief import as_html, brief
from seatfem.readings import Measured, measured
from seatfem.study.planning.plan import Plan

if TYPE_CHECKING:
    import pandas

    from seatfem.structures.natural_modes import Mode


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
