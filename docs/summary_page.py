"""Writes docs/summary.md from the table of results, so that it cannot lag behind (`make docs`)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from impact.files.safe_files import write_whole
from seatfem.results import HEADINGS, OF_LANDINGS, RESULTS, result_of
from seatfem.study.scene.measures import all_measures

PAGE: Final = Path(__file__).with_name("summary.md")
HEAD: Final = """\
# Keys of summary.json

The numbers of a run that the terminal, the report and charts show. All are SI, with the unit at the end of the key.
`error_bar_KEY` is the error bar of a key that has one, `spring_KEY` the same of the spring baseline, `error_mesh_KEY`
and its like the parts of a bar; `first_landing_KEY` is `landing_KEY` of the first landing, where a scene asks for it.
A key is absent where a scene has no such part, and `null` where a number is not known, as the restitution of a reed
that never lets go.
"""
LANDINGS: Final = """
## landings

A list, in the order of time: one record for each landing on seat and stopper, also in landings.csv.

| key | what |
|---|---|
"""
PLACES: Final = {"{width}": "filter width", "{touch}": "touch", "{closed}": "", "{cut}": "", "{above}": "", "\n": " "}
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
    results = {row.key: row for row in (*RESULTS, *map(result_of, measures))}
    for group, heading in HEADINGS.items():
        rows = [row for row in results.values() if row.group == group]
        yield f"## {heading.partition('{')[0]}\n\n| key | what |\n|---|---|"
        above = ""
        for row in rows:
            above = above if row.words.startswith(" ") else row.words
            yield table_row(row.key, f"{above}, {row.words.strip()}" if row.words.startswith(" ") else row.words)
        yield ""
    yield LANDINGS.strip()
    yield from (table_row(key, words) for key, words in OF_LANDINGS.items())
    yield ""


if __name__ == "__main__":
    write_whole(PAGE, "\n".join(lines_of_page()).encode())
