"""Scenes drawn at random that were compared with finer runs, by kinds of seat and reed, in reports and terminal."""

from __future__ import annotations

import csv
import html
import math
from collections.abc import Iterable, Iterator, Mapping
from importlib import resources
from typing import Any, Final

TABLE: Final = "checked_scenes.csv"
"""Table in the package that benchmarks/checked_scenes.py writes."""
PAGE: Final = "docs/coverage.md"


def checked_scenes() -> list[dict[str, str]]:
    """Return the rows of `TABLE` as header -> cell."""
    lines = resources.files(__package__).joinpath(TABLE).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(lines))


def who_checked(summary: Mapping[str, Any]) -> str:
    """Return, as HTML, the random scenes with the run's kinds of seat and reed, or if no scene has both, with either,
    that were compared with finer runs: by section of `PAGE` the number of scenes, of numbers with an error bar, and of
    those whose true error lies within it."""
    seat, reed = str(summary.get("seat_kind")), str(summary.get("reed_kind"))
    table, words = checked_scenes(), f'a seat "{seat}" and a reed "{reed}"'
    beginning = f"Scenes drawn at random were compared with finer runs (sections of {PAGE})."
    if both := list(_counts(each for each in table if (each["seat"], each["reed"]) == (seat, reed))):
        return _list(f"{beginning} Of those with {words}:", both)
    with_seat = _counts(each for each in table if each["seat"] == seat)
    with_reed = _counts(each for each in table if each["reed"] == reed)
    either = [f'seat "{seat}", {line}' for line in with_seat] + [f'reed "{reed}", {line}' for line in with_reed]
    return _list(f"{beginning} None had {words}{', but:' if either else ', nor either of them.'}", either)


AIM: Final = 0.97
"""Least fraction of numbers with their true error within the bar, as `PAGE` states it."""
CHANCE: Final = 0.05  # probability of so few inside, if `AIM` holds, below which bars of a kind of scene count as bad
FEW: Final = 2  # scenes of a kind below which its coverage is thin


def weak_coverage(summary: Mapping[str, Any]) -> str:
    """Return a sentence that scenes with the run's kinds of seat and reed were hardly compared with finer runs, or with
    a bad result; "" if they were often and well, or if the run reached no target."""
    if summary.get("accuracy_met") is not True:
        return ""
    seat, reed = str(summary.get("seat_kind")), str(summary.get("reed_kind"))
    rows = [each for each in checked_scenes() if (each["seat"], each["reed"]) == (seat, reed)]
    count, inside, numbers = (sum(int(each[name]) for each in rows) for name in ("scenes", "inside", "numbers"))
    chance = sum(math.comb(numbers, k) * AIM**k * (1 - AIM) ** (numbers - k) for k in range(inside + 1))
    if count >= FEW and chance >= CHANCE:
        return ""
    kinds = f'with a seat "{seat}" and a reed "{reed}"'
    words = f"{kinds}, {'; '.join(_counts(rows))}" if rows else f"no scene {kinds}"
    return f'"reached" is by the estimate of this run alone. Compared with finer runs ({PAGE}): {words}'


def _counts(scenes: Iterable[Mapping[str, str]]) -> Iterator[str]:
    """Yield a line for each section: how many numbers of how many scenes have their true error within the bar."""
    sections: dict[str, list[Mapping[str, str]]] = {}
    for each in scenes:
        sections.setdefault(each["section"], []).append(each)
    for section, group in sections.items():
        inside, numbers, count = (sum(int(each[name]) for each in group) for name in ("inside", "numbers", "scenes"))
        of_scenes = f"{count} scene{'s'[: count > 1]}"
        yield f"{section}: {inside} of {numbers} numbers of {of_scenes} had their true error within the uncertainty"


def _list(words: str, lines: list[str]) -> str:
    items = "".join(f"<li>{html.escape(line)}</li>" for line in lines)
    return f"<p>{html.escape(words)}</p>" + (f"<ul>{items}</ul>" if items else "")
