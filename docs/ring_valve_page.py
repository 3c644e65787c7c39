"""Fill docs/tutorial_ring_valve.md: what its two sweeps say, and the picture of the first.

    .venv/bin/python docs/ring_valve_page.py

The study is the page's own; it takes about half a minute.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path

from markers import between

from seatfem.study.sweep.answers import describe_study
from seatfem.study.sweep.charts import write_reports
from seatfem.study.sweep.effort import Effort
from seatfem.study.sweep.study import load_study
from seatfem.study.sweep.sweep import run_study
from seatfem.study.sweep.table import StudyTable

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "tutorial_ring_valve.md"
PICTURE = ROOT / "docs" / "images" / "ring_valve_lifts.png"
LIFT, PEAK, IMPULSE, OF_RUN = "contact.gap [mm]", "landing_filtered_peak_force_N", "landing_impulse_Ns", "impulse_Ns"


def main() -> None:
    text = PAGE.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "examples", Path(folder) / "examples")
        short, longer = (sweep(text, keys, Path(folder)) for keys in ("", 'run.duration = "1.1 ms"\n'))
        write_reports(short, Path(folder))
        shutil.copyfile(Path(folder) / "main_effects.png", PICTURE)
    text = between(text, "words", words(short))
    PAGE.write_text(between(text, "table", rows(short, longer)), encoding="utf-8")


def sweep(text: str, keys: str, folder: Path) -> StudyTable:
    """Return the table of the page's study, with further keys in [vary]."""
    [study] = re.findall(r"^```toml\n(# lifts\.toml\n.*?)^```$", text, re.DOTALL | re.MULTILINE)
    path = folder / ("longer.toml" if keys else "lifts.toml")
    path.write_text(study.replace("[vary]\n", f"[vary]\n{keys}"), encoding="utf-8")
    return run_study(load_study(path), folder / path.stem, Effort(workers=1))


def words(table: StudyTable) -> str:
    """Return what the program prints below the table of a sweep."""
    return "\n".join(["```text", *describe_study(table), "```"])


def rows(short: StudyTable, longer: StudyTable) -> str:
    """Return the lifts as a table: how the short sweep ends and what the long one finds."""
    lines = [
        "| lift [mm] | 0.7 ms | impulse of the run [mN s] | 1.1 ms | impulse of the run [mN s] | of the landing [mN s] "
        "| peak of the landing [N] |",
        "|---|---|---|---|---|---|---|",
    ]
    for place, lift in enumerate(short.numbers(LIFT)):
        cells = [f"{lift:g}"]
        cells += [str(short.columns["landing_status"][place]), f"{1e3 * short.numbers(OF_RUN)[place]:.3g}"]
        cells += [str(longer.columns["landing_status"][place]), f"{1e3 * longer.numbers(OF_RUN)[place]:.3g}"]
        cells += [with_bar(longer, IMPULSE, place, 1e3), with_bar(longer, PEAK, place, 1.0)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def with_bar(table: StudyTable, name: str, place: int, factor: float) -> str:
    """Return a measure of a scene and its error bar."""
    value, bar = (factor * table.numbers(key)[place] for key in (name, f"error_bar_{name}"))
    return f"{value:.4g} ± {float(f'{bar:.1g}'):g}"


if __name__ == "__main__":
    main()
