"""What follows from a table: against scipy, closed forms and values that are known."""

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from seatfem.study.sweep import effects
from seatfem.study.sweep.cases import shares_of
from seatfem.study.sweep.charts import write_reports
from seatfem.study.sweep.study import Study
from seatfem.study.sweep.table import StudyTable

KEYS = ("reed.a", "reed.b", "reed.c")
PARETO = {"pareto": ["first", "max second"]}


def study(design: str, number: int | None, keys: tuple[str, ...] = KEYS, **others: object) -> Study:
    each: object = {"kind": "uniform", "from": -np.pi, "to": np.pi} if number else [1.0, 2.0, 3.0, 4.0]
    given = {
        "scene": str(Path(__file__)), "design": design, "limit": 100_000, "vary": dict.fromkeys(keys, each), **others,
    }  # fmt: skip
    return Study.model_validate(given | ({"number": number} if number else {}))


def table(loaded: Study, x: np.ndarray, **measures: np.ndarray) -> StudyTable:
    columns: dict[str, list[object]] = {"scene": list(range(1, len(x) + 1))}
    columns |= {key: x[:, place].tolist() for place, key in enumerate(loaded.vary)}
    columns |= {name: [None if np.isnan(v) else float(v) for v in values] for name, values in measures.items()}
    columns["status"] = ["done" if np.isfinite(v) else "failed" for v in next(iter(measures.values()))]
    columns["message"] = [""] * len(x)
    return StudyTable(loaded, tuple(loaded.vary), tuple(measures), columns)


def ishigami(x: np.ndarray) -> np.ndarray:
    return np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def ishigami_table(number: int, failed: int = 0) -> StudyTable:
    loaded = study("sobol_indices", number)
    x = -np.pi + 2 * np.pi * shares_of(loaded)
    y = ishigami(x)
    y[:failed] = np.nan
    return table(loaded, x, y=y)


def ishigami_indices() -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of Ishigami and Homma (1990), a = 7, b = 0.1, in closed form."""
    pi, a, b = np.pi, 7.0, 0.1
    v1, v2, v13 = 0.5 * (1 + b * pi**4 / 5) ** 2, a**2 / 8, 8 * b**2 * pi**8 / 225
    return np.array([v1, v2, 0]) / (v1 + v2 + v13), np.array([v1 + v13, v2, v13]) / (v1 + v2 + v13)


@pytest.mark.slow
def test_indices_of_a_known_function() -> None:
    """Indices from 4096 blocks are within 0.012, as scipy documents, and within their intervals."""
    [indices] = effects.sobol_indices(ishigami_table(4096))
    first, total = ishigami_indices()
    assert indices.first == pytest.approx(first, abs=0.012)
    assert indices.total == pytest.approx(total, abs=0.012)
    for value, interval in ((first, indices.first_interval), (total, indices.total_interval)):
        assert np.all((interval[0] - 1e-9 <= value) & (value <= interval[1] + 1e-9))
        assert np.all(np.ptp(interval, axis=0) < 0.1)


@pytest.mark.slow
def test_indices_without_the_blocks_that_failed() -> None:
    [indices] = effects.sobol_indices(ishigami_table(1024, failed=24))
    assert indices.blocks == 1000
    assert indices.first == pytest.approx(ishigami_indices()[0], abs=0.03)
    again = effects.sobol_indices(ishigami_table(1024, failed=24))[0]
    assert np.array_equal(indices.first_interval, again.first_interval)


def test_main_effects_of_a_grid() -> None:
    """The main effects of y = 3 a + b c are its means over the other keys, exactly."""
    loaded = study("grid", None)
    x = np.array(np.meshgrid(*[[1.0, 2.0, 3.0, 4.0]] * 3, indexing="ij")).reshape(3, -1).T
    y = 3 * x[:, 0] + x[:, 1] * x[:, 2]
    of_a, of_b, of_c = effects.main_effects(table(loaded, x, y=y))
    assert of_a.at == [1, 2, 3, 4]
    assert of_a.mean == pytest.approx([3 * a + 6.25 for a in (1, 2, 3, 4)], rel=1e-14)
    assert of_b.mean == pytest.approx([7.5 + 2.5 * b for b in (1, 2, 3, 4)], rel=1e-14)
    assert of_b.error == pytest.approx([np.std(y[x[:, 1] == b], ddof=1) / 4 for b in (1, 2, 3, 4)], rel=1e-12)
    assert of_c.count.tolist() == [16] * 4


def test_main_effects_of_what_is_drawn_are_of_equal_groups() -> None:
    loaded = study("latin_hypercube", 400)
    x = shares_of(loaded)
    of_a, of_b, _ = effects.main_effects(table(loaded, x, y=2 * x[:, 0]))
    assert of_a.mean == pytest.approx(2 * np.array(of_a.at), rel=1e-12)
    assert len(of_a.at) == effects.MOST_LEVELS
    assert of_a.count.max() - of_a.count.min() <= 1
    assert np.all(np.abs(of_b.mean - 1.0) < 4 * of_b.error)


def test_percentiles_and_their_confidence() -> None:
    """Percentiles of 10,000 normal values are within 4 standard errors, and their intervals hold the true ones."""
    loaded = study("monte_carlo", 10_000, KEYS[:1])
    x = shares_of(loaded)
    y = stats.norm.ppf(x[:, 0])
    [band] = effects.tolerance_bands(table(loaded, x, y=y, error_bar_y=np.full(10_000, 0.1)))[:1]
    exact = stats.norm.ppf([0.05, 0.5, 0.95])
    assert band.at == pytest.approx(exact, abs=0.085)
    assert np.all((band.interval[0] < exact) & (exact < band.interval[1]))
    assert np.ptp(band.interval, axis=0) == pytest.approx([0.083, 0.049, 0.083], rel=0.3)  # 2*1.96 sqrt(p(1-p)/n)/pdf
    assert band.bar == 0.1


def test_percentiles_are_of_the_two_samples_alone() -> None:
    sample = ishigami_table(64)
    [band] = effects.tolerance_bands(sample)
    assert np.array_equal(band.sample, np.sort(sample.numbers("y")[:128]))
    assert np.isnan(band.interval).all()


def test_the_front_heeds_which_way_is_better() -> None:
    loaded = study("zip", None, KEYS[:1], outputs=PARETO)
    x = np.arange(5.0)[:, None]
    results = table(loaded, x, first=np.array([1.0, 2, 3, 2, np.nan]), second=np.array([1.0, 3, 2, 0, 9]))
    assert effects.front(results) == [0, 1]


@pytest.mark.slow
def test_all_reports_are_drawn(tmp_path: Path) -> None:
    """All tables and pictures are written, also with names in a column, scenes that failed, and a front."""
    loaded = study("sobol_indices", 16, KEYS[:2], outputs=PARETO)
    x = shares_of(loaded)
    y = x[:, 0] + x[:, 1] ** 2
    y[3] = np.nan
    results = table(loaded, x, first=y, second=x[:, 0] - y)
    named = {**results.columns, KEYS[1]: ["wide" if value > 0.5 else "narrow" for value in x[:, 1]]}
    for each in (results, StudyTable(loaded, results.parameters, results.measures, named)):
        files, gaps = write_reports(each, tmp_path)
        assert gaps == []
        names = {file.name for file in files}
        assert {"main_effects.csv", "sobol_indices.csv", "percentiles.csv", "pareto.csv"} <= names
        assert {"main_effects.png", "sobol_indices.png", "percentiles.png", "scatter.png", "pareto.png"} <= names
        assert all(file.stat().st_size > 0 for file in files)
    assert [file.suffix for file in write_reports(results, tmp_path, pictures=False)[0]] == [".csv"] * 4
