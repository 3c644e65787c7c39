"""Sentences state what the numbers of a run leave out: in short beside the decision, in full in a report; and how often
scenes of this kind, drawn at random, were compared with finer runs.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Mapping
from importlib import resources
from typing import Any, Final

from impact.quantities import with_capital
from seatfem import readings, results
from seatfem.results import Group, name_of, rows_of, words_of
from seatfem.study.answers.verdict import beyond_horizon, is_static, static_seat
from seatfem.study.safety import source_in_words

BAR_UNKNOWN: Final = "Uncertainty not known"
TOO_WIDE: Final = "Not known, since the uncertainty is above half of the value"
NO_BAR: Final = "Without an uncertainty"
STATES: Final = (BAR_UNKNOWN, TOO_WIDE, NO_BAR)
BESIDE: Final = ("time_s", "_at_deg", "_at_m", "_over_rho_c0_v", "tilt_deg")
"""Suffixes of keys that state the time or place of another number, a multiple of it, or an input of the scene."""


def not_modelled(summary: readings.Summary) -> list[str]:
    """Return the sentences on effects that the model of a run leaves out."""
    sentences = summary.get("not_modelled")
    return list(map(str, sentences)) if isinstance(sentences, list) else []


def left_out(summary: readings.Summary) -> Iterator[str]:
    """Yield a sentence for each effect that a run leaves out of its model, its uncertainty, or its results."""
    if waves := static_seat(summary):
        yield waves
    elif is_static(summary):
        yield "Waves and stress in the seat are left out: the scene states a spring as its seat."
    for sentence in not_modelled(summary):
        yield f"{with_capital(sentence)}."
    if unknown := str(summary.get("error_unknown") or ""):
        sources = ", ".join(source_in_words(source) for source in unknown.split(", "))
        yield f"Not included in the uncertainty: {sources}."
    if statistics := beyond_horizon(summary):
        yield statistics
    yield from _not_computed(summary)


def omissions(summary: readings.Summary) -> Iterator[str]:
    """Yield a sentence for each thing that the numbers of a run leave out, the short list of `left_out` first."""
    yield from left_out(summary)
    for (words, group), names in _numbers_without_bar(summary).items():
        yield f"{words} ({results.HEADINGS[group].replace('{step}', '')}): {'; '.join(names)}."
    if empty := results.without_value(summary):
        yield f"Asked for, but without a value in this run: {', '.join(name_of(key, summary) for key in empty)}."
    if summary.get("accuracy_met") is False and (reason := str(summary.get("accuracy_stopped_because") or "")):
        yield f"The accuracy asked for was missed, and no further round followed: {reason}."
    if missing := str(summary.get("pictures_missing") or ""):
        yield f"Pictures that could not be drawn: {missing}."


def _numbers_without_bar(summary: readings.Summary) -> dict[tuple[str, Group], list[str]]:
    """Return the names of numbers whose error is unknown or too large, by reason and by group of rows."""
    open_numbers: dict[tuple[str, Group], list[str]] = {}
    for group, rows in rows_of(summary).items():
        parent = ""
        for row in rows:
            words = words_of(row, summary)
            parent = parent if words.startswith(" ") else words
            value, bar = readings.as_number(summary.get(row.key)), readings.bar_of(summary, row.key)
            if not value or isinstance(summary[row.key], int) or row.key.endswith(BESIDE):
                continue
            if not readings.is_known(row.key, value, bar):
                state = NO_BAR if bar is None else TOO_WIDE if math.isfinite(bar) else BAR_UNKNOWN
                name = f"{parent}: {words.strip()}" if words.startswith(" ") else words
                open_numbers.setdefault((state, group), []).append(name)
    return dict(sorted(open_numbers.items(), key=lambda each: STATES.index(each[0][0])))


def _not_computed(summary: readings.Summary) -> Iterator[str]:
    """Yield the stresses that were not computed, and the keys of the scene that request them."""
    is_a_spring = is_static(summary) and not static_seat(summary)
    if readings.as_number(summary.get(results.SEAT_STRESS)) is None and not is_a_spring:
        yield "Stress in the seat was not computed; add [stress] to the scene (for seats of finite elements)."
    if readings.as_number(summary.get(results.REED_STRESS)) is None:
        yield "Stress in the reed was not computed; add [stress] to the scene (for reeds of plate elements)."


TABLE: Final = "checked_scenes.csv"
"""Table in the package that benchmarks/checked_scenes.py writes."""


def checked_scenes() -> list[dict[str, str]]:
    """Return the rows of `TABLE` as header -> cell."""
    lines = resources.files(__package__).joinpath(TABLE).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(lines))


AIM: Final = 0.97
"""Least fraction of numbers with their true error within the bar, as docs/coverage.md states it."""
CHANCE: Final = 0.05  # probability of so few inside, if `AIM` holds, below which bars of a kind of scene count as bad
FEW: Final = 2  # scenes of a kind below which its coverage is thin
CAUTION: Final = "treat the uncertainty with caution"


def how_often_checked(summary: Mapping[str, Any]) -> str:
    """Return in one sentence how many scenes with the run's kinds of seat and reed were compared with finer runs, and
    how many of their uncertainties held; it asks for caution where these are few or held too seldom."""
    seat, reed = _kinds(summary)
    table, kinds = checked_scenes(), f'a seat "{seat}" and a reed "{reed}"'
    scenes, inside, numbers = _sums(each for each in table if (each["seat"], each["reed"]) == (seat, reed))
    if not scenes:
        with_seat, *_ = _sums(each for each in table if each["seat"] == seat)
        with_reed, *_ = _sums(each for each in table if each["reed"] == reed)
        either = f"; {with_seat} had such a seat, {with_reed} such a reed" if with_seat or with_reed else ""
        return f"No test scene with {kinds} was compared with a finer run{either}: {CAUTION}."
    chance = sum(math.comb(numbers, k) * AIM**k * (1 - AIM) ** (numbers - k) for k in range(inside + 1))
    held = f"{inside} of {numbers} results were right within their uncertainty"
    caution = f": {CAUTION}" if scenes < FEW or chance < CHANCE else ""
    return f"{scenes} test scene{'s'[: scenes > 1]} with {kinds} compared with finer runs: {held}{caution}."


def _kinds(summary: Mapping[str, Any]) -> tuple[str, str]:
    return str(summary.get("seat_kind")), str(summary.get("reed_kind"))


def _sums(scenes: Iterable[Mapping[str, str]]) -> tuple[int, int, int]:
    """Return the numbers of scenes, of values with their true error within the bar, and of values."""
    rows = list(scenes)
    count, inside, numbers = (sum(int(each[name]) for each in rows) for name in ("scenes", "inside", "numbers"))
    return count, inside, numbers
