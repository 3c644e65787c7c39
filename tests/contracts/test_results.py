"""Each result is declared once, and stands on the page of summary.json's keys with words and unit."""

from __future__ import annotations

import pytest
from summary_page import lines_of_page

from seatfem.results import RESULTS, ResultSource, label_of, rows_of
from tests.frozen.recorded import CHEAP, scenes
from tests.gallery import Gallery, read_summary


def test_every_key_is_declared_once() -> None:
    keys = [result.key for result in RESULTS]
    assert len(set(keys)) == len(keys)


def test_a_declared_measure_has_its_row_and_its_label() -> None:
    class Loudness(ResultSource):
        name, key, words = "loudness", "loudness_Pa", "sound pressure"

    try:
        summary = {"accuracy_measures": "loudness", "loudness_Pa": 2.0}
        (row,) = rows_of(summary)["run"]
        assert (row.key, row.words, row.unit) == ("loudness_Pa", "sound pressure", "Pa")
        assert label_of("loudness_Pa") == "sound pressure [Pa]"
    finally:
        del Loudness.name
    assert label_of("stopper_impulse_Ns") == "at the stopper: impulse [N s]"


@pytest.mark.slow
def test_what_runs_show_is_on_the_page(gallery: Gallery) -> None:
    summaries = [read_summary(gallery.run_of(scenes()[name])) for name in CHEAP]
    page = "\n".join(lines_of_page())
    shown = {row.key for summary in summaries for rows in rows_of(summary).values() for row in rows}
    assert len(shown) > 35
    assert [key for key in shown if f"| `{key.replace('first_landing', 'landing')}` | " not in page] == []
