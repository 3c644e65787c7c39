"""Variations of a key and designs over several: values, numbers, distributions, and what is wrong with a study file."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from seatfem.study.scene import SceneError
from seatfem.study.sweep.cases import cases_of, changes_of, shares_of
from seatfem.study.sweep.study import Study, load_study
from seatfem.units import number_and_unit
from tests.gallery import refusal
from tests.study.test_studies import study_file


def study(folder: Path, text: str) -> Study:
    return load_study(study_file(folder, text))


def values(loaded: Study, key: str) -> np.ndarray:
    return np.array([number_and_unit(changed[key])[0] for changed in changes_of(loaded)])


def test_a_grid_takes_every_value_with_every_other(tmp_path: Path) -> None:
    loaded = study(
        tmp_path, '[vary]\nreed.mass = ["1 g", "2 g"]\nseat.stiffness = { from = "1 N/um", to = "9 N/um", number = 3 }'
    )
    pairs = [(changed["reed.mass"], changed["seat.stiffness"]) for changed in changes_of(loaded)]
    levels = ["1.0 N/um", "5.0 N/um", "9.0 N/um"]
    assert pairs == [(mass, level) for mass in ("1 g", "2 g") for level in levels]
    assert loaded.number_of_scenes == 6


def test_levels_of_a_logarithmic_range(tmp_path: Path) -> None:
    loaded = study(tmp_path, '[vary]\n"reed.mass" = { from = "1 g", to = "100 g", number = 3, scale = "log" }')
    assert values(loaded, "reed.mass") == pytest.approx([1, 10, 100], rel=1e-15)


def test_a_single_value_is_that_of_all_scenes(tmp_path: Path) -> None:
    loaded = study(tmp_path, '[vary]\nrun.duration = "1 ms"\nreed.mass = ["1 g", "2 g"]')
    assert [changed["run.duration"] for changed in changes_of(loaded)] == ["1 ms", "1 ms"]


def test_a_zip_takes_one_of_each(tmp_path: Path) -> None:
    loaded = study(tmp_path, 'design = "zip"\n[vary]\nreed.mass = ["1 g", "2 g"]\nreed.velocity = ["-1 m/s", "-3 m/s"]')
    assert [tuple(changed.values()) for changed in changes_of(loaded)] == [("1 g", "-1 m/s"), ("2 g", "-3 m/s")]


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
    ("[vary]\n", r":2: vary: \{\}: .*1"),
    ('design = "gird"\n[vary]\nreed.mass = ["1 g"]', ":2: design: 'gird' .*'grid'"),
    ('sed = 1\n[vary]\nreed.mass = ["1 g"]', ":2: sed: .*'seed'"),
    ("[vary]\nreed.mass = []", ":3: vary.reed.mass.values"),
    ('[vary]\nreed.mass = { mean = "1 g", deviation = "1 mg" }', ":3: vary.reed.mass.kind: .*missing"),
    ('[vary]\n"reed..mass" = ["1 g"]', r"'reed\.\.mass' .*key"),
    (f'[vary]\n"{"a." * 20}mass" = ["1 g"]', "a.mass' .*key"),
    ('[vary]\nreed.mass = { from = "2 g", to = "1 g", number = 2 }', ":3: vary.reed.mass.to: 1 .*from = 2"),
    ('[vary]\n"reed.mass" = { from = "2 g", to = "1 kg", number = 2 }', ":3: vary.reed.mass.to: .* kg"),
    ('[vary]\nreed.mass = { from = "0 g", to = "1 g", number = 2, scale = "log" }', "0 is not positive"),
    ('[vary]\nreed.mass = { from = "1 g", to = "2 g" }', ":3: vary.reed.mass.number: .*missing"),
    ('[vary]\nreed.mass = { from = "1 g", to = "2 g", number = 1 }', "vary.reed.mass.number: 1 "),
    ('[vary]\nreed.mass = { from = "1 g", too = "2 g", number = 2 }', "vary.reed.mass.too: .*'to'"),
    ('[vary]\nreed.mass = { kind = "normal", mean = "1 g", deviation = "0.1 g" }', "'normal' has no levels"),
    ('[vary]\nreed.mass = { kind = "nomal", mean = "1 g", deviation = "0.1 g" }', "'nomal'.*'normal'"),
    ('number = 4\n[vary]\nreed.mass = ["1 g"]', ":2: number: design = 'grid' draws none"),
    ('design = "sobol"\n[vary]\nreed.mass = ["1 g"]', "number: .*missing: .*'sobol'"),
    ('design = "sobol"\nnumber = 12\n[vary]\nreed.mass = ["1 g"]', ":3: number: 12 "),
    ('design = "zip"\n[vary]\nreed.mass = ["1 g"]\nreed.velocity = ["-1 m/s", "-2 m/s"]', ":5: vary.reed.velocity: 2"),
    ('limit = 5\n[vary]\nreed.mass = ["1 g", "2 g"]\nreed.velocity = ["-1 m/s", "-2 m/s", "-3 m/s"]',
     ":2: limit: 6 scenes"),
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
    shares = shares_of(loaded)[:, 0]
    assert np.array_equal(values(loaded, "reed.mass"), 1.0 + 4.0 * shares)
    assert all(math.isfinite(value) for value in values(loaded, "reed.mass"))
