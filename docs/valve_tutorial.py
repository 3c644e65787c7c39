"""Write the numbers of the suction valve's page: its table, its landings and its picture.

    .venv/bin/python docs/valve_tutorial.py [FOLDER]

Runs examples/suction_valve.toml into FOLDER, or takes what is there, and rewrites what stands between the markers of
docs/tutorial_suction_valve.md, and docs/images/suction_valve_force.png.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from refresh import between, write

from seatfem.faces.tables import landings_of
from seatfem.readings import reading, write_with_bar
from seatfem.results import rows_of, words_of
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import load_scene

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "tutorial_suction_valve.md"
SHOWN = 6


def main() -> None:
    """Run what is missing and write page and picture."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp())
    if not (folder / "summary.json").is_file():
        run_scene(load_scene(ROOT / "examples" / "suction_valve.toml"), folder)
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    page = between(PAGE.read_text(encoding="utf-8"), "first rows", first_rows(summary))
    write(PAGE, between(page, "landings", landing_rows(summary)))
    shutil.copyfile(folder / "force.png", ROOT / "docs" / "images" / "suction_valve_force.png")


def first_rows(summary: Mapping[str, Any]) -> str:
    """Return the rows of the judged landing as Markdown, and the load that presses the closed reed."""
    lines = ["| hardest landing | seat | spring |", "|---|---|---|"]
    for row in rows_of(summary)["landing"]:
        spring = reading(summary, f"spring_{row.key}", row.unit)
        lines.append(f"| {words_of(row, summary).strip()} | {reading(summary, row.key, row.unit)} | {spring} |")
    load = write_with_bar("", summary["pressed_on_largest_load_N"], None, "N")
    lasting = write_with_bar("", summary["pressed_on_time_s"], None, "s")
    return "\n".join([*lines, "", f"Reed pressed on its seat by its loads: up to {load}, {lasting} in total."])


def landing_rows(summary: Mapping[str, Any]) -> str:
    """Return the hardest landings on seat and stopper as Markdown."""
    columns = (
        ("time", "time_s", "s"),
        ("closing speed", "closing_speed_m_per_s", "m/s"),
        ("peak", "filtered_peak_force_N", "N"),
        ("static load", "static_load_N", "N"),
        ("impulse above static load", "impulse_Ns", "N s"),
    )
    records = landings_of(summary)
    lines = ["| landing | " + " | ".join(head for head, _, _ in columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for record in records[:SHOWN]:
        cells = [reading(record, key, unit) for _, key, unit in columns]
        lines.append(f"| {record['body']} {record['number']} | " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", f"{len(records)} landings, sorted by their largest force above the static load."])


if __name__ == "__main__":
    main()
