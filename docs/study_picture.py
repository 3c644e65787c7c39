"""Draw the map of docs/studies.md, docs/images/study_map.png, and write beside it what the study says.

    .venv/bin/python docs/study_picture.py

The study is examples/limits_study.toml; it takes about half a minute.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from markers import between

from seatfem.study.sweep.answers import answer_in_words
from seatfem.study.sweep.effort import Effort
from seatfem.study.sweep.maps import draw_map
from seatfem.study.sweep.study import load_study
from seatfem.study.sweep.sweep import run_study

ROOT = Path(__file__).resolve().parent.parent
STUDY, PAGE = ROOT / "examples" / "limits_study.toml", ROOT / "docs" / "studies.md"


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        table = run_study(load_study(STUDY), Path(folder), Effort(workers=2))
    draw_map(table, ROOT / "docs" / "images" / "study_map.png")
    said = "\n".join(["```text", *answer_in_words(table), "```"])
    PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), "limits", said), encoding="utf-8")


if __name__ == "__main__":
    main()
