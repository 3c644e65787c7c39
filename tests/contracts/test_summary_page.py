"""The page of summary.json's keys is as the program's table; what a run shows is on it, with words and unit."""

import json

from summary_page import PAGE, lines_of_page

from seatfem.results import rows_of
from tests.frozen.recorded import FILE


def test_the_page_is_current() -> None:
    assert PAGE.read_text(encoding="utf-8") == "\n".join(lines_of_page())


def test_what_frozen_runs_show_is_on_it() -> None:
    scenes = json.loads(FILE.read_text(encoding="utf-8"))["scenes"]
    page = PAGE.read_text(encoding="utf-8")
    shown = {row.key for run in scenes.values() for rows in rows_of(run).values() for row in rows}
    assert len(shown) > 40
    assert [key for key in shown if f"| `{key}` | " not in page] == []
