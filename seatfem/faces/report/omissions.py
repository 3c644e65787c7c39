"""Gaps of a run, in sentences: errors outside the bars, numbers without one, stress that nobody asked for."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from seatfem import results
from seatfem.readings import Summary, as_number, bar_of, is_known
from seatfem.results import Group, asked, name_of, rows_of, words_of
from seatfem.study.accuracy.source_words import in_words

BAR_UNKNOWN: Final = "Uncertainty not known"
TOO_WIDE: Final = "Not known, since the uncertainty is above half of the value"
NO_BAR: Final = "Without an uncertainty"
STATES: Final = (BAR_UNKNOWN, TOO_WIDE, NO_BAR)
BESIDE: Final = ("time_s", "_at_deg", "_at_m", "_over_rho_c0_v", "tilt_deg")
"""How keys of rows end that say when and where another one is, what it is a multiple of, and what the scene states."""


def omissions(summary: Summary) -> Iterator[str]:
    """Yield what the numbers of a run do not tell, a sentence each."""
    if unknown := str(summary.get("error_unknown") or ""):
        yield f"Not included in the uncertainty: {', '.join(in_words(source) for source in unknown.split(', '))}."
    for (words, group), names in _numbers_without_bar(summary).items():
        yield f"{words} ({results.HEADINGS[group].replace('{step}', '')}): {'; '.join(names)}."
    landed = summary.get(results.LANDING_TIME) is not None
    empty = [
        key for key in asked(summary) if summary.get(key) is None and (landed or not key.startswith(results.LANDING))
    ]
    if empty:
        yield f"Asked for, but without a value in this run: {', '.join(name_of(key, summary) for key in empty)}."
    if summary.get("accuracy_met") is False and (reason := str(summary.get("accuracy_stopped_because") or "")):
        yield f"The accuracy asked for was missed, and no further round followed: {reason}."
    yield from _not_computed(summary)
    if missing := str(summary.get("pictures_missing") or ""):
        yield f"Pictures that could not be drawn: {missing}."


def _numbers_without_bar(summary: Summary) -> dict[tuple[str, Group], list[str]]:
    """Return the numbers of the result whose error is open, by what is open and by their group of rows."""
    open_numbers: dict[tuple[str, Group], list[str]] = {}
    for group, rows in rows_of(summary).items():
        parent = ""
        for row in rows:
            words = words_of(row, summary)
            parent = parent if words.startswith(" ") else words
            value, bar = as_number(summary.get(row.key)), bar_of(summary, row.key)
            if not value or isinstance(summary[row.key], int) or row.key.endswith(BESIDE):
                continue
            if not is_known(row.key, value, bar):
                state = NO_BAR if bar is None else TOO_WIDE if math.isfinite(bar) else BAR_UNKNOWN
                name = f"{parent}: {words.strip()}" if words.startswith(" ") else words
                open_numbers.setdefault((state, group), []).append(name)
    return dict(sorted(open_numbers.items(), key=lambda each: STATES.index(each[0][0])))


def _not_computed(summary: Summary) -> Iterator[str]:
    """Yield the stresses and the fatigue that were not computed, and what asks for them."""
    if as_number(summary.get(results.SEAT_STRESS)) is None:
        yield "Stress in the seat was not computed; [stress] in the scene asks for that of a seat of finite elements."
    if as_number(summary.get(results.REED_STRESS)) is None:
        yield "Stress in the reed was not computed; [stress] in the scene asks for that of a plate."
    if not any(key.startswith("life_") for key in summary):
        yield "Fatigue was not judged; [life] in the scene asks for it."
