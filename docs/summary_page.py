"""Writes docs/summary.md from the table of results, so that it cannot lag behind (`make docs`)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from impact.files.safe_files import write_whole
from seatfem.results import HEADINGS, OF_LANDINGS, OF_LANDS, all_results, result_of
from seatfem.study.scene.measures import all_measures

PAGE: Final = Path(__file__).with_name("summary.md")
HEAD: Final = """\
# Keys of summary.json

The results of a run that terminal, report and charts show. All are SI; the key ends with the unit. `error_bar_KEY` is
the error bar of KEY, if it has one, `spring_KEY` its value for the spring baseline, and `error_mesh_KEY` and similar
keys are the parts of the bar. `first_landing_KEY` is `landing_KEY` of the first landing, if the scene asks for it. A
key is absent if the scene has no such part, and `null` if its value is not known, such as the restitution of a reed
that stays on the seat.
"""
DECISION: Final = """
## decision

| key | meaning |
|---|---|
| `decision` | go, no-go or undecided, by margins with their error bars |
| `decision_reasons` | why, in sentences, those that decide first |
| `decision_event` | what happens, in one sentence |
| `decision_checked` | how often scenes of this kind were compared with finer runs |
| `decision_left_out` | what the numbers leave out, a sentence each |
| `not_modelled` | effects in the scene that its model leaves out, a sentence each |
"""
LANDINGS: Final = """
## landings

A list with one record for each landing on seat and stopper, in the order of time; also in landings.csv.

| key | meaning |
|---|---|
"""
LANDS: Final = """
## lands

A list with one record for each land of a seat with several: its hardest landing during the hardest landing on the seat
([lands](lands.md)). `land_landings` lists every landing on each land.

| key | meaning |
|---|---|
"""
PLACES: Final = {"{width}": "filter width", "{closed}": "", "{cut}": "", "{above}": "", "\n": " "}
"""What stands in the words of a result for what a run says there."""


def table_row(key: str, words: str) -> str:
    """Return the row of a key."""
    plain = words
    for name, text in PLACES.items():
        plain = plain.replace(name, text)
    return f"| `{key}` | {plain.strip()} |"


def lines_of_page() -> Iterator[str]:
    """Yield the page: a table for each group of `HEADINGS`, and the one of landings."""
    yield HEAD
    measures = (each.key for each in all_measures().values())
    results = all_results() | {row.key: row for row in map(result_of, measures)}
    for group, heading in HEADINGS.items():
        if not (rows := [row for row in results.values() if row.group == group]):
            continue
        yield f"## {heading.partition('{')[0]}\n\n| key | meaning |\n|---|---|"
        above = ""
        for row in rows:
            above = above if row.words.startswith(" ") else row.words
            yield table_row(row.key, f"{above}, {row.words.strip()}" if row.words.startswith(" ") else row.words)
        yield ""
    yield DECISION.strip() + "\n"
    yield LANDINGS.strip()
    yield from (table_row(key, words) for key, words in OF_LANDINGS.items())
    yield LANDS.rstrip()
    yield from (table_row(key, words) for key, words in OF_LANDS.items())
    yield ""


if __name__ == "__main__":
    write_whole(PAGE, "\n".join(lines_of_page()).encode())
