"""Limits of a study: which scenes keep to them in view of their error bars, and where, in every form that is read."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from seatfem.study.sweep.answers import answer_in_words
from seatfem.study.sweep.charts import write_reports
from seatfem.study.sweep.effort import Effort
from seatfem.study.sweep.maps import spread
from seatfem.study.sweep.runner import Outcome
from seatfem.study.sweep.study import load_study
from seatfem.study.sweep.sweep import run_optimum, run_study
from seatfem.study.sweep.table import StudyTable
from tests.steps import BAD_INPUT, FAILED, run_command
from tests.study.crew_at_hand import amount, answer_by
from tests.study.test_studies import study_file

WIDTHS = '[vary]\nreed.width = ["1 mm", "2 mm", "2.01 mm", "3 mm", "4 mm", "5 mm", "6 mm"]\n'
REED = """seat = { kind = "spring", stiffness = "1 N/um" }
reed = { kind = "cantilever", length = "25 mm", width = "10 mm", thickness = "0.3 mm", material = "steel", \
    release = { tip_deflection = "1 mm" } }
run = { duration = "2 ms" }
"""
Caught = pytest.CaptureFixture[str]


def answer(changed: dict[str, object]) -> dict[str, object] | Outcome:
    """Return a stress of 100 MPa for each mm, known to 1 %; 4 mm does not land, the run cuts 5 mm off, 6 mm fails."""
    if (width := amount(changed["reed.width"])) == 6:
        return Outcome("failed", "no convergence")
    status = {4: "no landing", 5: "cut off"}.get(width, "landed")
    stress = 1e8 * width
    return {
        "landing_status": status, "landing_peak_reed_stress_Pa": stress, "landing_impulse_Ns": 1e-3 * width,
        "error_bar_landing_peak_reed_stress_Pa": 0.01 * stress, "landing_filtered_peak_force_N": 3.0,
    }  # fmt: skip


def columns(path: Path) -> dict[str, list[str]]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jobs: list[str]) -> Path:
    answer_by(monkeypatch, answer)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_scenes_are_told_apart_by_a_limit(folder: Path, capsys: Caught) -> None:
    """A limit of 201.5 MPa is beyond the bar of 100 MPa, within those of 200 and 201 MPa, and below 300 MPa."""
    units = 'units = { landing_reed_stress_Pa = "MPa" }\n'
    text = f'title = "A <b>"\nbelow = {{ landing_reed_stress_Pa = "201.5 MPa" }}\n{units}{WIDTHS}'
    study_file(folder, text, REED)
    assert run_command(["sweep", "study.toml"]) == FAILED  # one scene has no numbers
    out = capsys.readouterr().out
    table = columns(folder / "study-sweep" / "study.csv")
    expected = ["holds", "undecided", "undecided", "does not hold", "no landing", "cut off", "failed"]
    assert table["verdict"] == expected
    stress = [float(each or "nan") for each in table["landing_peak_reed_stress [MPa]"]]
    assert stress[:4] == pytest.approx([100, 200, 201, 300], rel=1e-12)
    assert float(table["error_bar_landing_peak_reed_stress [MPa]"][0]) == pytest.approx(1, rel=1e-12)
    assert float(table["landing_impulse_Ns"][0]) == 1e-3
    first = "holds in 1 of 7 scenes, undecided in 2, does not hold in 1, cut off in 1, no landing in 1, failed in 1"
    assert f"reed stress after landing below 201.5 MPa: {first}\n" in out
    assert "reed width 1 mm holds\nreed width 2 to 2.01 mm undecided\nreed width 3 mm does not hold\n" in out
    assert "200.0 ± 2.0" in out
    page = (folder / "study-sweep" / "report.html").read_text(encoding="utf-8")
    assert all(f"{each}</td>" in page for each in expected)
    assert "A &lt;b&gt;" in page
    assert "data:image/png" in page
    assert (folder / "study-sweep" / "limits.png").stat().st_size > 0
    assert run_command(["report", "study-sweep"]) == BAD_INPUT
    assert "report.html" in capsys.readouterr().err


def test_several_limits_on_both_sides(folder: Path) -> None:
    """The worst verdict is that of all; a number without any bar counts as exact."""
    text = 'below = { landing_peak_reed_stress_Pa = 2.5e8 }\nabove = { landing_impulse_Ns = "2 mN s" }\n'
    path = study_file(folder, text + WIDTHS, REED)
    table = run_study(load_study(path), folder / "out")
    stress, impulse = (table.columns[f"verdict: {limit}"] for limit in table.study.limits)
    assert stress[:4] == ["holds", "holds", "holds", "does not hold"]
    assert impulse[:4] == ["does not hold", "holds", "holds", "holds"]
    assert table.columns["verdict"][:4] == ["does not hold", "holds", "holds", "does not hold"]


@pytest.mark.slow
def test_a_limited_result_has_an_error_bar(tmp_path: Path, jobs: list[str]) -> None:
    """A mass on a spring is in contact for pi sqrt(m / k); the scene asks no accuracy of that, the limit does."""
    path = study_file(tmp_path, 'below = { landing_duration_s = "0.1 ms" }\n[vary]\nreed.mass = ["0.5 g", "1.1 g"]\n')
    table = run_study(load_study(path), tmp_path / "out")
    assert list(table.columns["verdict"]) == ["holds", "does not hold"]
    durations, bars = (table.numbers(key) for key in ("landing_duration_s", "error_bar_landing_duration_s"))
    assert np.all(bars > 0)
    assert np.all(np.abs(durations - np.pi * np.sqrt([0.5e-9, 1.1e-9])) < bars)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("design", "vary"),
    [
        ("grid", 'reed.width = ["1 mm", "2 mm", "3 mm", "4 mm"]\nreed.length = ["20 mm", "25 mm", "30 mm"]'),
        ('sobol"\nnumber = "8', 'reed.width = { from = "1 mm", to = "6 mm", scale = "log" }\nreed.length = '
         '{ from = "20 mm", to = "25 mm" }'),
        ("grid", 'reed.width = ["1 mm", "2 mm", "6 mm"]\nreed.material = ["steel", "PEEK"]'),
        ("zip", 'reed.width = ["1 mm", "3 mm"]\nreed.length = ["20 mm", "25 mm"]'),
    ],
)  # fmt: skip
def test_a_map_is_drawn_over_two_keys(design: str, vary: str, folder: Path) -> None:
    limits = 'below = { landing_peak_reed_stress_Pa = "230 MPa", landing_impulse_Ns = "4 mN s" }'
    text = f'design = "{design}"\n{limits}\n[vary]\n{vary}'.replace('"8"', "8")
    path = study_file(folder, text, REED)
    table = run_study(load_study(path), folder / "out", Effort())
    files, gaps = write_reports(table, folder / "out")
    assert gaps == []
    assert folder / "out" / "map.png" in files
    assert answer_in_words(table)[0].startswith("reed stress after landing below 230 MPa and impulse of landing below")


def test_boundaries_are_interpolated_between_neighbours_alone() -> None:
    """A plane is met exactly, on a grid and between scattered places; beside a scene without a value there is none."""
    u, v = (each.ravel() for each in np.meshgrid(np.arange(4.0), np.arange(3.0)))
    fine = [np.linspace(0, 3, 7), np.linspace(0, 2, 5)]
    plane = np.add.outer(3 * fine[1], 2 * fine[0])
    for moved in (0.0, 0.01 * np.sin(7 * u)):  # a grid, then none
        field = spread(u + moved, v, (2 * (u + moved) + 3 * v)[:, None], fine)
        assert field[1:-1, 1:-1, 0] == pytest.approx(plane[1:-1, 1:-1])
    lost = np.where((u == 0) & (v == 0), np.nan, u)
    field = spread(u, v, lost[:, None], fine)
    assert np.isnan(field[:2, :2]).all()
    assert np.isfinite(field[:, 3:]).all()
    assert spread(np.arange(3.0), np.arange(3.0), np.ones((3, 1)), fine).size == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('below = { landing_peak_reed_stress_Pa = "350 mm" }', r"toml:2: below\.landing_peak_\w+: '350 mm'.*600 MPa"),
        ('below = { landing_stress = "350 MPa" }', r"below\.landing_stress: .*state 'landing_peak_reed_stress_Pa'"),
        ('above = { life_margin = "1 N" }', r"above\.life_margin: '1 N'.*write"),
        ('below = { landing_impulsive_Ns = 1 }', r"study.toml:2: below\.landing_impulsive_Ns: .*'landing_impulse_Ns'"),
        ('below = { landing_impulsive_Ns = 1 }\n[vary]\nrun.duration = "0.01 ms"', "2: below.*'landing_impulse_Ns'"),
        ('units = { landing_peak_reed_stress_Pa = "5 MPa" }', r"units\.landing_peak_\w+: '5 MPa'.*write one"),
        ('units = { landing_impulse_Ns = "MPa" }', r"units\.landing_impulse_Ns: .*a pressure; an impulse"),
        ('outputs.below = { landing_impulse_Ns = 1 }', r"outputs\.below: .*move it above \[vary\]"),
        ('[vary]\nbelow = { landing_impulse_Ns = 1 }', r"vary\.below\.landing_impulse_Ns: .*move below above"),
    ],
)  # fmt: skip
def test_bad_limits(text: str, message: str, folder: Path, capsys: Caught) -> None:
    study_file(folder, text if "[vary]" in text else f"{text}\n{WIDTHS}", REED)
    assert run_command(["plan", "study.toml"]) == BAD_INPUT
    assert re.search(message, capsys.readouterr().err)


def known(changed: dict[str, object]) -> dict[str, object]:
    """Return a force that is least for 2 g and 3 N/um, and a displacement."""
    mass, stiffness = amount(changed["reed.mass"]), amount(changed["seat.stiffness"])
    return {
        "landing_filtered_peak_force_N": (mass - 2) ** 2 + (stiffness - 3) ** 2 + 1,
        "max_seat_displacement_m": 1e-6 * mass,
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stiffness", "most", "fewest"),
    [
        ('["1 N/um", "2 N/um", "3 N/um", "4 N/um"]', 40, 20),  # all 20 combinations
        ('["1 N/um", "2 N/um", "3 N/um", "4 N/um"]', 14, 5),  # not all
        ('{ from = "1 N/um", to = "5 N/um", number = 5 }', 40, 25),
        ('{ from = "1 N/um", to = "5 N/um" }', 40, 10),
    ],
)
def test_a_search_among_values_of_lists(stiffness: str, most: int, fewest: int, folder: Path, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    """The least force is found among the values of the list; with a limit on the displacement the best within it."""
    answer_by(monkeypatch, known)
    for limit, best in (("", "2 g"), ('below = { max_seat_displacement_m = "1.2 um" }\n', "1 g")):
        text = f'{limit}[vary]\nreed.mass = ["1 g", "1.5 g", "2 g", "3 g", "4 g"]\nseat.stiffness = {stiffness}\n'
        goal = f'[optimise]\nminimise = "landing_filtered_peak_force_N"\nmost = {most}\n'
        optimum = run_optimum(load_study(study_file(folder, text + goal)), folder / f"out{len(limit)}")
        keys = optimum.as_json()["keys"]
        assert keys["reed.mass"] == best
        assert amount(keys["seat.stiffness"]) == pytest.approx(3, abs=0.02)
        assert fewest <= len(optimum.searched) <= most
        assert {each.case.changed["reed.mass"] for each in optimum.searched} <= {"1 g", "1.5 g", "2 g", "3 g", "4 g"}
        assert isinstance(optimum.table(optimum.confirmed), StudyTable)
