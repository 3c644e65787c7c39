"""Variations of a key, designs over several and what is wrong with them; what follows from a table, against scipy."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from seatfem.study.sweep import effects
from seatfem.study.sweep.answers import name_ticks
from seatfem.study.sweep.cases import cases_of, changes_of, shares_of
from seatfem.study.sweep.charts import write_reports
from seatfem.study.sweep.study import Study, load_study
from seatfem.study.sweep.table import StudyTable
from seatfem.units import number_and_unit
from tests.bounded import bounded
from tests.gallery import refusal
from tests.steps import DONE, SceneError, run_command
from tests.study.test_studies import study_file


def study(folder: Path, text: str) -> Study:
    return load_study(study_file(folder, text))


def values(loaded: Study, key: str) -> np.ndarray:
    return np.array([number_and_unit(changed[key])[0] for changed in changes_of(loaded)])


def test_a_grid_takes_every_value_with_every_other(tmp_path: Path) -> None:
    keys = 'run.duration = "1 ms"\nreed.mass = ["1 g", "2 g"]'  # a single value is that of all scenes
    loaded = study(tmp_path, f'[vary]\n{keys}\nseat.stiffness = {{ from = "1 N/um", to = "9 N/um", number = 3 }}')
    assert {changed["run.duration"] for changed in changes_of(loaded)} == {"1 ms"}
    pairs = [(changed["reed.mass"], changed["seat.stiffness"]) for changed in changes_of(loaded)]
    levels = ["1.0 N/um", "5.0 N/um", "9.0 N/um"]
    assert pairs == [(mass, level) for mass in ("1 g", "2 g") for level in levels]
    assert loaded.number_of_scenes == 6


def test_a_zip_takes_one_of_each(tmp_path: Path) -> None:
    loaded = study(tmp_path, 'design = "zip"\n[vary]\nreed.mass = ["1 g", "2 g"]\nreed.velocity = ["-1 m/s", "-3 m/s"]')
    assert [tuple(changed.values()) for changed in changes_of(loaded)] == [("1 g", "-1 m/s"), ("2 g", "-3 m/s")]


def test_levels_of_a_logarithmic_range(tmp_path: Path) -> None:
    loaded = study(tmp_path, '[vary]\n"reed.mass" = { from = "1 g", to = "100 g", number = 3, scale = "log" }')
    assert values(loaded, "reed.mass") == pytest.approx([1, 10, 100], rel=1e-15)


TABLE = 'kind = "table", points = [["1 g", 0], ["2 g", 0.5], ["6 g", 1]]'
EXACT = [
    ('from = "1 g", to = "5 g"', stats.uniform(1, 4)),
    ('kind = "uniform", from = "1 g", to = "9 g", scale = "log"', stats.loguniform(1, 9)),
    ('kind = "normal", mean = "5 g", deviation = "0.5 g"', stats.norm(5, 0.5)),
    ('kind = "truncated_normal", mean = "5 g", deviation = "2 g", from = "4 g", to = "8 g"',
     stats.truncnorm(-0.5, 1.5, 5, 2)),
    ('kind = "lognormal", median = "3 g", sigma = 0.4', stats.lognorm(0.4, scale=3)),
    (TABLE, stats.rv_histogram(([0.5, 0.125 * 4], [1.0, 2.0, 6.0]), density=False)),
]  # fmt: skip


@pytest.mark.parametrize(("words", "exact"), EXACT)
@pytest.mark.parametrize("design", ["latin_hypercube", "sobol"])
def test_what_is_drawn_has_the_distribution_asked_for(words: str, exact: object, design: str, tmp_path: Path) -> None:
    """The distribution function of n even shares is off by at most 1/n; quantiles are scipy's, computed apart."""
    loaded = study(tmp_path, f'design = "{design}"\nnumber = 1024\n[vary]\nreed.mass = {{ {words} }}')
    draws = values(loaded, "reed.mass")
    assert stats.kstest(draws, exact.cdf).statistic <= 1 / 1024 + 1e-9
    shares = shares_of(loaded)[:, 0]
    assert draws == pytest.approx(exact.ppf(shares), rel=1e-9)


@pytest.mark.parametrize("design", ["latin_hypercube", "sobol", "monte_carlo", "sobol_indices"])
def test_the_same_seed_draws_the_same(design: str, tmp_path: Path) -> None:
    text = 'design = "{}"\nnumber = 8\nseed = {}\n[vary]\nreed.mass = {{ from = "1 g", to = "5 g" }}'
    one, again, other = (list(changes_of(study(tmp_path, text.format(design, seed)))) for seed in (3, 3, 4))
    assert one == again
    assert one != other


def test_more_of_a_sequence_begins_as_less_of_it(tmp_path: Path) -> None:
    """A larger study begins with the scenes of the smaller one, and takes them from its journal."""
    text = 'design = "{}"\nnumber = {}\n[vary]\nreed.mass = {{ from = "1 g", to = "5 g" }}\nreed.n = [1, 2]'
    for design in ("sobol", "monte_carlo"):
        few, many = (list(changes_of(study(tmp_path, text.format(design, number)))) for number in (8, 16))
        assert many[:8] == few


def test_blocks_of_saltelli(tmp_path: Path) -> None:
    keys = "\n".join(f'{key} = {{ from = "1 g", to = "5 g" }}' for key in ("reed.mass", "reed.a", "reed.b"))
    loaded = study(tmp_path, f'design = "sobol_indices"\nnumber = 16\n[vary]\n{keys}')
    first, second, *mixed = shares_of(loaded).reshape(5, 16, 3)
    assert loaded.number_of_scenes == 80
    assert not np.any(first == second)
    for column, block in enumerate(mixed):
        assert np.array_equal(block[:, column], second[:, column])
        others = [each for each in range(3) if each != column]
        assert np.array_equal(block[:, others], first[:, others])


def test_an_entry_of_a_list_is_drawn_as_often_as_another(tmp_path: Path) -> None:
    loaded = study(tmp_path, 'design = "latin_hypercube"\nnumber = 12\n[vary]\nreed.mass = ["1 g", "2 g", "4 g"]')
    assert sorted(values(loaded, "reed.mass")) == [1] * 4 + [2] * 4 + [4] * 4


BAD = [
    ("", "vary: .*missing"),
    ('design = "gird"\n[vary]\nreed.mass = ["1 g"]', ":2: design: 'gird' .*'grid'"),
    ("[vary]\nreed.mass = []", ":3: vary.reed.mass.values"),
    ('[vary]\nreed.mass = { mean = "1 g", deviation = "1 mg" }', ":3: vary.reed.mass.kind: .*missing"),
    ('[vary]\n"reed..mass" = ["1 g"]', r"'reed\.\.mass' .*key"),
    ('[vary]\nreed.mass = { from = "2 g", to = "1 g", number = 2 }', ":3: vary.reed.mass.to: 1 .*from = 2"),
    ('[vary]\n"reed.mass" = { from = "2 g", to = "1 kg", number = 2 }', ":3: vary.reed.mass.to: .* kg"),
    ('[vary]\nreed.mass = { from = "0 g", to = "1 g", number = 2, scale = "log" }', "0 is not positive"),
    ('[vary]\nreed.mass = { from = "1 g", to = "2 g" }', ":3: vary.reed.mass.number: .*missing"),
    ('[vary]\nreed.mass = { kind = "normal", mean = "1 g", deviation = "0.1 g" }', "'normal' has no levels"),
    ('[vary]\nreed.mass = { kind = "nomal", mean = "1 g", deviation = "0.1 g" }', "'nomal'.*'normal'"),
    ('number = 4\n[vary]\nreed.mass = ["1 g"]', ":2: number: design = 'grid' draws none"),
    ('design = "sobol"\n[vary]\nreed.mass = ["1 g"]', "number: .*missing: .*'sobol'"),
    ('design = "sobol"\nnumber = 12\n[vary]\nreed.mass = ["1 g"]', ":3: number: 12 "),
    ('design = "zip"\n[vary]\nreed.mass = ["1 g"]\nreed.velocity = ["-1 m/s", "-2 m/s"]', ":5: vary.reed.velocity: 2"),
    ('design = "monte_carlo"\nnumber = 2000000\n[vary]\nreed.mass = ["1 g"]', ":3: number: 2000000 "),
    ('design = "monte_carlo"\nnumber = 2\n[vary]\nreed.mass = { kind = "normal", mean = "1 g", deviation = "0 g" }',
     "vary.reed.mass.deviation: 0 "),
    ('design = "sobol"\nnumber = 2\n[vary]\nreed.mass = { kind = "table", points = [["1 g", 0], ["2 g", 0.9]] }',
     "vary.reed.mass.points: .*0 to 0.9"),
    ('design = "monte_carlo"\nnumber = 2\n[vary]\nreed.mass = { from = "1 g", to = "2 g", number = 3 }',
     ":5: vary.reed.mass.number: .*draws"),
    ('[vary]\nreed.mass = ["1 g"]\n[outputs]\npareto = ["impulse_Ns", "best life"]', "outputs.pareto.1"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), BAD)
def test_what_is_wrong_with_a_study_is_told_with_its_place(text: str, message: str, tmp_path: Path) -> None:
    answer = refusal(study, tmp_path, text)
    assert re.search(message, answer)
    assert f"{tmp_path / 'study.toml'}" in answer


def test_a_study_without_its_scene(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text('scene = "gone.toml"\n[vary]\nreed.mass = ["1 g"]', encoding="utf-8")
    with pytest.raises(SceneError, match=r"study\.toml:1:.*gone\.toml"):
        load_study(tmp_path / "study.toml")


WRONG = [
    ('"reed.mas" = ["1 g"]', r"study\.toml:3: vary\.reed\.mas: scene 1 of 1, .*'mass'"),
    ('red.mass = ["1 g"]', r"study\.toml:3: vary\.red\.mass: scene 1 of 1, .*'reed'"),
    ('reed.mass = ["1 g", "1 mm"]', r":3: vary\.reed\.mass: scene 2 of 2, reed\.mass = '1 mm': .*length"),
    ('reed.mass = ["0 g", "-1 g", "1 g"]', r"scene 1 of 3, reed\.mass = '0 g': .*positive; 1 more"),
    ('run.time_step = ["1 us"]', r"study\.toml:3: vary\.run\.time_step: scene 1 of 1, .*1 us"),
    ('"load.0.gravity" = ["-9.81 m/s^2"]', r"load\.0"),
]


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_every_scene_is_checked_before_the_first_runs(text: str, message: str, tmp_path: Path) -> None:
    path = study_file(tmp_path, f"[vary]\n{text}")
    with pytest.raises(SceneError, match=message):
        cases_of(load_study(path))


@pytest.mark.slow
def test_a_distribution_beyond_the_limits_of_a_key(tmp_path: Path) -> None:
    text = (
        'design = "monte_carlo"\nnumber = 64\n[vary]\nreed.mass = {{ kind = "{}", mean = "1 g", deviation = "1 g"{} }}'
    )
    path = study_file(tmp_path, text.format("normal", ""))
    with pytest.raises(SceneError, match=r"study\.toml:5: vary\.reed\.mass: .*\d+ more"):
        cases_of(load_study(path))
    path = study_file(tmp_path, text.format("truncated_normal", ', from = "0.1 g", to = "3 g"'))
    assert len(cases_of(load_study(path))) == 64


def test_equal_scenes_have_one_key_and_others_another(tmp_path: Path) -> None:
    """1 g and 0.001 kg ask for the same; the order of the design does not count, but for the seat's model."""
    path = study_file(tmp_path, '[vary]\nreed.mass = ["1 g", "0.001 kg", "2 g"]')
    one, same, other = cases_of(load_study(path))
    assert one.key == same.key != other.key
    assert other.guides == (one.key,)
    seats = study_file(tmp_path, '[vary]\nseat.stiffness = ["1 N/um", "2 N/um"]')
    first, second = cases_of(load_study(seats))
    assert second.guides == first.guides == ()
    assert second.key != first.key
    assert first.key == one.key
    scene = tmp_path / "scene.toml"
    scene.write_text(scene.read_text(encoding="utf-8").replace("0.2 ms", "0.3 ms"), encoding="utf-8")
    assert cases_of(load_study(path))[0].key != one.key
    assert cases_of(load_study(path), rounds=1)[0].key != cases_of(load_study(path), rounds=2)[0].key


def test_numbers_are_written_with_all_their_digits(tmp_path: Path) -> None:
    loaded = study(tmp_path, 'design = "monte_carlo"\nnumber = 50\n[vary]\nreed.mass = { from = "1 g", to = "5 g" }')
    assert np.array_equal(values(loaded, "reed.mass"), 1.0 + 4.0 * shares_of(loaded)[:, 0])


@pytest.mark.slow
def test_a_plan_of_many_scenes_is_a_price_at_once(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A hundred thousand scenes are priced by a thousand of them; more are refused (`BAD`)."""
    drawn = 'design = "monte_carlo"\nnumber = 100000\nlimit = 100000\n[vary]\n'
    path = study_file(tmp_path, drawn + 'reed.velocity = { from = "-2 m/s", to = "-1 m/s" }')
    with bounded():
        assert run_command(["plan", str(path)]) == DONE
    words = " ".join(capfd.readouterr().out.split())
    assert "100000 scenes: about" in words
    assert "based on 1000 scenes" in words


KEYS = ("reed.a", "reed.b", "reed.c")
PARETO = {"pareto": ["first", "max second"]}


def drawn_study(design: str, number: int | None, keys: tuple[str, ...] = KEYS, **others: object) -> Study:
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


def ishigami_table(number: int, failed: int = 0) -> StudyTable:
    loaded = drawn_study("sobol_indices", number)
    x = -np.pi + 2 * np.pi * shares_of(loaded)
    y = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
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


def test_a_long_value_is_named_at_ticks_by_its_number() -> None:
    assert name_ticks(["steel", "[['0 deg', '0 um'], ['90 deg', '20 um']]"]) == ["steel", "value 2"]


def test_main_effects_of_a_grid() -> None:
    """The main effects of y = 3 a + b c are its means over the other keys, exactly."""
    loaded = drawn_study("grid", None)
    x = np.array(np.meshgrid(*[[1.0, 2.0, 3.0, 4.0]] * 3, indexing="ij")).reshape(3, -1).T
    y = 3 * x[:, 0] + x[:, 1] * x[:, 2]
    of_a, of_b, of_c = effects.main_effects(table(loaded, x, y=y))
    assert of_a.at == [1, 2, 3, 4]
    assert of_a.mean == pytest.approx([3 * a + 6.25 for a in (1, 2, 3, 4)], rel=1e-14)
    assert of_b.mean == pytest.approx([7.5 + 2.5 * b for b in (1, 2, 3, 4)], rel=1e-14)
    assert of_b.error == pytest.approx([np.std(y[x[:, 1] == b], ddof=1) / 4 for b in (1, 2, 3, 4)], rel=1e-12)
    assert of_c.count.tolist() == [16] * 4


def test_main_effects_of_what_is_drawn_are_of_equal_groups() -> None:
    loaded = drawn_study("latin_hypercube", 400)
    x = shares_of(loaded)
    of_a, of_b, _ = effects.main_effects(table(loaded, x, y=2 * x[:, 0]))
    assert of_a.mean == pytest.approx(2 * np.array(of_a.at), rel=1e-12)
    assert len(of_a.at) == effects.MOST_LEVELS
    assert of_a.count.max() - of_a.count.min() <= 1
    assert np.all(np.abs(of_b.mean - 1.0) < 4 * of_b.error)


def test_percentiles_and_their_confidence() -> None:
    """Percentiles of 10,000 normal values are within 4 standard errors, and their intervals hold the true ones."""
    loaded = drawn_study("monte_carlo", 10_000, KEYS[:1])
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
    loaded = drawn_study("zip", None, KEYS[:1], outputs=PARETO)
    x = np.arange(5.0)[:, None]
    results = table(loaded, x, first=np.array([1.0, 2, 3, 2, np.nan]), second=np.array([1.0, 3, 2, 0, 9]))
    assert effects.front(results) == [0, 1]


@pytest.mark.slow
def test_all_reports_are_drawn(tmp_path: Path) -> None:
    """All tables and pictures are written, also with names in a column, scenes that failed, and a front."""
    loaded = drawn_study("sobol_indices", 16, KEYS[:2], outputs=PARETO)
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
