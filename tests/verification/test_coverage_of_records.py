"""Error bars of measured seats against bodies in closed form: benchmarks/coverage_of_records.py.

Its committed table is read, and a few records of another seed are run.
"""

import coverage_of_records as records
import pytest

ROWS = records.read_rows()
OWN_SEED = 90217


def test_all_records_were_run() -> None:
    assert [(row.seed, row.index) for row in ROWS] == [(records.SEED, index) for index in range(records.RECORDS)]


@pytest.mark.parametrize("name", records.KEYS)
def test_true_errors_are_inside_their_bars(name: str) -> None:
    inside, known = records.share(ROWS, name)
    assert known >= 30
    assert inside / known >= records.WANTED


def test_the_table_is_of_the_records_drawn_today() -> None:
    for row in ROWS:
        record = records.draw_record(row.index, row.seed)
        assert (row.quantity, row.kind, row.missed) == (record.quantity, record.kind, record.missed)
        assert row.noise == pytest.approx(record.noise, rel=1e-5)
        assert row.modes == len(record.body.omega)


@pytest.mark.slow
@pytest.mark.parametrize("index", range(3))  # one of each quantity
def test_records_of_another_seed(index: int) -> None:
    row = records.run_record(index, OWN_SEED)
    assert row.refused == ""
    assert all(row.inside(name) for name in records.KEYS), row
    assert row.static_bar < 0.1
