"""Kinds of scenes whose error bars were compared with true errors, in a table that reports show.

    python benchmarks/checked_scenes.py

counts, for each kind of seat and of reed, the scenes of the tables that sections of docs/coverage.md describe, their
numbers with a bar, and those of them that are inside; it writes these into the package. So does
`coverage_of_scenes.py --document`.
"""

from __future__ import annotations

import csv
import io
from collections import defaultdict
from pathlib import Path
from typing import Final

from scenes_summary import WIDEST
from table import RESULTS

from impact.files.safe_files import write_whole

FILE: Final = Path(__file__).parents[1] / "seatfem" / "study" / "answers" / "checked_scenes.csv"
SECTIONS: Final = {"The whole scene language": "coverage_of_scenes.csv", "Stress": "coverage_of_stress.csv"}
"""Headings of docs/coverage.md, and the tables that they describe."""
HEADS: Final = ("section", "seat", "reed", "scenes", "inside", "numbers")


def checked_scenes() -> str:
    """Return the table as CSV: section, kinds, scenes, numbers inside their bars, numbers with a bar that is shown."""
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(HEADS)
    for section, name in SECTIONS.items():
        scenes: dict[tuple[str, str], set[tuple[str, str]]] = defaultdict(set)
        inside: dict[tuple[str, str], list[bool]] = defaultdict(list)
        for line in csv.DictReader((RESULTS / name).read_text(encoding="utf-8").splitlines()):
            if line["inside"] and float(line["bar"]) <= WIDEST * abs(float(line["value"])):
                kinds = line["seat"], line["reed"]
                scenes[kinds].add((line["seed"], line["index"]))
                inside[kinds].append(line["inside"] == "True")
        for kinds in sorted(inside):
            writer.writerow((section, *kinds, len(scenes[kinds]), sum(inside[kinds]), len(inside[kinds])))
    return table.getvalue()


def write_checked_scenes() -> None:
    """Write the table into the package."""
    write_whole(FILE, checked_scenes().encode("utf-8"))


if __name__ == "__main__":
    write_checked_scenes()
