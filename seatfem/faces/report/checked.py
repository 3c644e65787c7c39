"""Scenes of the kind of a run whose error bars were compared with true errors, in a paragraph of its page."""

from __future__ import annotations

import csv
import html
from collections.abc import Iterator, Mapping
from importlib import resources
from typing import Any, Final

TABLE: Final = "checked_scenes.csv"
"""Table of the package that benchmarks/checked_scenes.py writes."""
PAGE: Final = "docs/coverage.md"


def checked_scenes() -> list[dict[str, str]]:
    """Return the rows of the package's table."""
    lines = resources.files(__package__).joinpath(TABLE).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(lines))


def who_checked(summary: Mapping[str, Any]) -> str:
    """Return which scenes with the run's kinds of seat and reed were checked, as HTML; where none has both, with
    either. The table has how many scenes of each section of the page, drawn and compared with finer runs, have these
    kinds, how many numbers with an error bar, and how many of these have their true error inside it."""
    seat, reed = str(summary.get("seat_kind")), str(summary.get("reed_kind"))
    table, words = checked_scenes(), f'a seat "{seat}" and a reed "{reed}"'
    beginning = f"Scenes drawn at random were compared with finer runs (sections of {PAGE})."
    if both := list(_counts(each for each in table if (each["seat"], each["reed"]) == (seat, reed))):
        return _list(f"{beginning} Of those with {words}:", both)
    with_seat = _counts(each for each in table if each["seat"] == seat)
    with_reed = _counts(each for each in table if each["reed"] == reed)
    either = [f'seat "{seat}", {line}' for line in with_seat] + [f'reed "{reed}", {line}' for line in with_reed]
    return _list(f"{beginning} None had {words}{', but:' if either else ', nor either of them.'}", either)


def _counts(scenes: Iterator[Mapping[str, str]]) -> Iterator[str]:
    """Yield a line for each section: how many numbers of how many scenes have their true error inside the bar."""
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
