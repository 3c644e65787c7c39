"""Scenes drawn at random that were compared with finer runs, by kinds of seat and reed, in reports and terminal."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping
from importlib import resources
from typing import Any, Final

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
