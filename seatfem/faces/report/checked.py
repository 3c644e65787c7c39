"""Scenes of the kind of a run whose error bars were compared with true errors, in a paragraph of its page."""

from __future__ import annotations

import csv
import html
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any, Final

TABLE: Final = "checked_scenes.csv"
"""Table of the package that benchmarks/checked_scenes.py writes."""
PAGE: Final = "docs/coverage.md"


@dataclass(frozen=True)
class CheckedScenes:
    """Scenes with one kind of seat and one of reed, in one section of docs/coverage.md.

    Attributes:
        section: its heading.
        seat, reed: kinds.
        scenes: that were drawn and compared with finer runs.
        inside, numbers: how many of their numbers with an error bar have their true error inside it.
    """

    section: str
    seat: str
    reed: str
    scenes: int
    inside: int
    numbers: int


def checked_scenes() -> tuple[CheckedScenes, ...]:
    """Return what the package knows of scenes that were checked."""
    lines = resources.files(__package__).joinpath(TABLE).read_text(encoding="utf-8").splitlines()
    return tuple(
        CheckedScenes(row["section"], row["seat"], row["reed"], *(int(row[k]) for k in ("scenes", "inside", "numbers")))
        for row in csv.DictReader(lines)
    )


def who_checked(summary: Mapping[str, Any]) -> str:
    """Return which scenes with the run's kinds of seat and reed were checked, as HTML; where none has both, with
    either."""
    seat, reed = str(summary.get("seat_kind")), str(summary.get("reed_kind"))
    table, words = checked_scenes(), f'a seat "{seat}" and a reed "{reed}"'
    beginning = "Scenes drawn at random were compared with finer runs"
    both = list(_counts(each for each in table if (each.seat, each.reed) == (seat, reed)))
    if both:
        return _list(f"{beginning} (sections of {PAGE}). Of those with {words}:", both)
    with_seat = _counts(each for each in table if each.seat == seat)
    with_reed = _counts(each for each in table if each.reed == reed)
    either = [f'seat "{seat}", {line}' for line in with_seat] + [f'reed "{reed}", {line}' for line in with_reed]
    return _list(
        f"{beginning} (sections of {PAGE}). None had {words}{', but:' if either else ', nor either of them.'}", either
    )


def _counts(scenes: Iterator[CheckedScenes]) -> Iterator[str]:
    """Yield a line for each section: how many numbers of how many scenes have their true error inside the bar."""
    sections: dict[str, list[CheckedScenes]] = {}
    for each in scenes:
        sections.setdefault(each.section, []).append(each)
    for section, group in sections.items():
        inside, numbers, count = (
            sum(getattr(each, name) for each in group) for name in ("inside", "numbers", "scenes")
        )
        of_scenes = f"{count} scene{'s'[: count > 1]}"
        yield f"{section}: {inside} of {numbers} numbers of {of_scenes} had their true error within the uncertainty"


def _list(words: str, lines: list[str]) -> str:
    items = "".join(f"<li>{html.escape(line)}</li>" for line in lines)
    return f"<p>{html.escape(words)}</p>" + (f"<ul>{items}</ul>" if items else "")
