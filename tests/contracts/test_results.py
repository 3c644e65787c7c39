"""Each result is declared once, and stands on the page of summary.json's keys with words and unit."""

from __future__ import annotations

import pytest
from summary_page import lines_of_page

from seatfem.results import RESULTS, rows_of
from tests.frozen.recorded import CHEAP, scenes
from tests.gallery import Gallery, read_summary


def test_every_key_is_declared_once() -> None:
    keys = [result.key for result in RESULTS]
    assert len(set(keys)) == len(keys)


@pytest.mark.slow
def test_what_runs_show_is_on_the_page(gallery: Gallery) -> None:
    summaries = [read_summary(gallery.run_of(scenes()[name])) for name in CHEAP]
    page = "\n".join(lines_of_page())
    shown = {row.key for summary in summaries for rows in rows_of(summary).values() for row in rows}
    assert len(shown) > 35
    assert [key for key in shown if f"| `{key.replace('first_landing', 'landing')}` | " not in page] == []
