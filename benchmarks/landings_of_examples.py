"""The landings of all examples: what each scene of examples/ says first, with its error bars and what was predicted.

    python benchmarks/landings_of_examples.py [--document] [NAME ...]

runs each scene that is not yet in results/landings_of_examples.csv, or those named, in one round without pictures, and
appends a row as it ends. With --document: writes the table into docs/landings.md.
"""

from __future__ import annotations

import csv
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from time import process_time
from typing import Any, Final

from seatfem.readings import reading
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.runs.rounds import Limits
from seatfem.study.scene import load_scene

sys.path.append(str(Path(__file__).parents[1] / "docs"))  # whose scripts write between marks
from markers import between

ROOT: Final = Path(__file__).resolve().parents[1]
FILE: Final = ROOT / "benchmarks" / "results" / "landings_of_examples.csv"
PAGE: Final = ROOT / "docs" / "landings.md"
KEYS: Final = (
    "landing_status", "landing_count", "stopper_landing_count", "landing_time_s", "landing_closing_speed_m_per_s",
    "landing_filtered_peak_force_N", "error_bar_landing_filtered_peak_force_N", "landing_static_load_N",
    "landing_impulse_Ns", "error_bar_landing_impulse_Ns", "pressed_on_largest_load_N", "accuracy_target",
    "accuracy_met", "error_bar_landing_closing_speed_m_per_s", "plan_predicted_time_s",
    "plan_predicted_error_landing_filtered_peak_force_N",
    "plan_predicted_error_landing_impulse_Ns",
)  # fmt: skip


def main() -> None:
    """Run what is missing, or write the table."""
    names = [word for word in sys.argv[1:] if not word.startswith("-")]
    known = rows()
    if "--document" in sys.argv[1:]:
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(between(page, "landings of examples", table(known)), encoding="utf-8")
        return
    for path in sorted((ROOT / "examples").glob("*.toml")):
        wanted = path.stem in names if names else path.stem not in {row["scene"] for row in known}
        if wanted and not path.stem.endswith("_study"):
            append(row_of(path))


def rows() -> list[dict[str, str]]:
    """Return the rows on file, the last one of each scene."""
    if not FILE.is_file():
        return []
    with FILE.open(encoding="utf-8", newline="") as file:
        return list({row["scene"]: row for row in csv.DictReader(file)}.values())


def row_of(path: Path) -> dict[str, object]:
    """Return the row of one scene, with the seconds of processor time that it took."""
    start, limits = process_time(), Limits(rounds=1)
    with tempfile.TemporaryDirectory() as folder:
        summary = run_scene(load_scene(path), Path(folder), limits=limits, pictures=False, histories=False).summary
    return {"scene": path.stem, **{key: summary.get(key) for key in KEYS}, "seconds": round(process_time() - start, 1)}


def append(row: Mapping[str, object]) -> None:
    """Write a row, after the heads where the file is new."""
    new = not FILE.is_file()
    with FILE.open("a", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, ["scene", *KEYS, "seconds"])
        if new:
            writer.writeheader()
        writer.writerow(row)


def table(known: list[dict[str, str]]) -> str:
    """Return the rows as Markdown."""
    heads = ("scene", "status", "landings, at the stopper", "time", "closing speed", "peak", "static load", "impulse")
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for row in sorted(known, key=lambda each: each["scene"]):
        numbers: dict[str, Any] = {key: _number(value) for key, value in row.items()}
        cells = [
            reading(numbers, f"landing_{key}", unit)
            for key, unit in (
                ("time_s", "s"),
                ("closing_speed_m_per_s", "m/s"),
                ("filtered_peak_force_N", "N"),
                ("static_load_N", "N"),
                ("impulse_Ns", "N s"),
            )
        ]
        counts = f"{row['landing_count']}, {row['stopper_landing_count'] or 0}"
        lines.append(f"| {row['scene']} | {row['landing_status']} | {counts} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _number(value: str) -> float | str | None:
    try:
        return float(value)
    except ValueError:
        return value or None


if __name__ == "__main__":
    main()
