"""Optima with a known place: a mass m, speed v, on a spring k: peak force v sqrt(k m), displacement v sqrt(m / k)."""

import csv
from pathlib import Path

import pytest

from seatfem.study.sweep.best import Optimum
from seatfem.study.sweep.effort import Effort
from seatfem.study.sweep.runner import JOURNAL, StudyError
from seatfem.study.sweep.study import load_study
from seatfem.study.sweep.sweep import run_optimum
from tests.study.crew_at_hand import amount, answer_by
from tests.study.test_studies import study_file

STIFFNESS = '[vary]\nseat.stiffness = { from = "0.1 N/um", to = "10 N/um", scale = "log" }\n'
MASS = 'reed.mass = { from = "0.2 g", to = "5 g" }\n'
SOUGHT = '[optimise]\nminimise = "filtered_peak_force_N"\nsubject_to = ["max_seat_displacement_m <= 3e-5"]\n'


def number(optimum: Optimum, key: str) -> float:
    return float(str(optimum.as_json()["keys"][key]).split()[0])


@pytest.mark.slow
def test_the_softest_spring_that_is_stiff_enough(tmp_path: Path, jobs: list[str]) -> None:
    """The optimum is k = m (v / x)^2, F = m v^2 / x at the limit x, within twice x's error bar."""
    optimum = run_optimum(load_study(study_file(tmp_path, STIFFNESS + SOUGHT)), tmp_path / "out")
    [limit] = optimum.as_json()["constraints"]
    share = limit["error_bar"] / 3e-5
    assert 1e-4 < share < 5e-3
    assert number(optimum, "seat.stiffness") == pytest.approx(1e-3 / 3e-5**2 / 1e6, rel=2 * (share + 1e-3))
    force = optimum.as_json()["measures"]["filtered_peak_force_N"]
    assert force["value"] == pytest.approx(1e-3 / 3e-5, rel=share + 1e-3 + force["error_bar"] / force["value"])
    assert optimum.is_met
    assert len(optimum.searched) <= 40


def closed_form(changed: dict[str, object]) -> dict[str, object]:
    """Return measures whose displacement is 4 % and force 7 % off in the search, and right at the target."""
    stiffness, mass = 1e6 * amount(changed["seat.stiffness"]), 1e-3 * amount(changed.get("reed.mass", "1 g"))
    coarse = "accuracy" in changed
    return {
        "filtered_peak_force_N": (stiffness * mass) ** 0.5 * (1.07 if coarse else 1.0),
        "max_seat_displacement_m": (mass / stiffness) ** 0.5 * (1.04 if coarse else 1.0),
        "impulse_Ns": 2 * mass,
    }


def closed_form_of_stiff_seats(changed: dict[str, object]) -> dict[str, object]:
    if amount(changed["seat.stiffness"]) < 0.6:
        raise RuntimeError("too soft")
    return closed_form(changed)


@pytest.mark.slow
def test_a_limit_is_met_at_the_target_not_at_the_loose_accuracy(tmp_path, monkeypatch, jobs):
    """Two keys and two limits. The search's own optimum has a stiffness 8 % too large; by the shift it is found to what
    a limit may be violated by without an error bar, 0.1 %, of which stiffness takes the double, and what mass does."""
    answer_by(monkeypatch, closed_form)
    sought = SOUGHT.replace('e-5"]', 'e-5", "impulse_Ns >= 2e-3"]')
    optimum = run_optimum(load_study(study_file(tmp_path, STIFFNESS + MASS + sought)), tmp_path / "out")
    assert number(optimum, "reed.mass") == pytest.approx(1.0, rel=2e-3)
    assert number(optimum, "seat.stiffness") == pytest.approx(1e-3 / 3e-5**2 / 1e6, rel=6e-3)
    assert optimum.best.value("filtered_peak_force_N") == pytest.approx(1e-3 / 3e-5, rel=4e-3)
    assert optimum.is_met
    first = min(optimum.confirmed, key=lambda each: each.case.number)
    assert first.value("max_seat_displacement_m") < 0.97 * 3e-5  # 4 % on the safe side, before anything was shifted
    with (tmp_path / "out" / "optimum.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3
    margin = float(rows[0]["margin of max_seat_displacement_m <= 3e-05"])
    assert margin == pytest.approx(3e-5 - optimum.best.value("max_seat_displacement_m"))


@pytest.mark.slow
def test_an_optimum_between_the_bounds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jobs: list[str]) -> None:
    """The search has the largest 5 - (k / 2 - 2 / k)^2 at k = 2, near a parabola of shares."""
    answer_by(monkeypatch, lambda keys: {"impulse_Ns": 5 - ((k := amount(keys["seat.stiffness"])) / 2 - 2 / k) ** 2})
    text = STIFFNESS + '[optimise]\nmaximise = "impulse_Ns"\nmost = 20\n'
    optimum = run_optimum(load_study(study_file(tmp_path, text)), tmp_path / "out")
    assert number(optimum, "seat.stiffness") == pytest.approx(2.0, rel=0.01)  # 2e-3 of two decades
    assert len(optimum.searched) <= 20


@pytest.mark.slow
def test_scenes_that_fail_are_outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jobs: list[str]) -> None:
    """Less is better, and below 0.6 N/um there is nothing; they are tried again when it is asked for."""
    answer_by(monkeypatch, closed_form_of_stiff_seats)
    text = STIFFNESS + '[optimise]\nminimise = "filtered_peak_force_N"\n'
    optimum = run_optimum(load_study(study_file(tmp_path, text)), tmp_path / "out")
    assert optimum.as_json()["failed"] > 3
    assert 0.6 <= number(optimum, "seat.stiffness") < 0.63
    answer_by(monkeypatch, lambda _: 1 / 0)
    with pytest.raises(StudyError, match=r"13 scenes .*ZeroDivisionError"):
        run_optimum(load_study(study_file(tmp_path, text)), tmp_path / "none")
    answer_by(monkeypatch, closed_form)
    with pytest.raises(StudyError, match="ZeroDivisionError"):
        run_optimum(load_study(study_file(tmp_path, text)), tmp_path / "none")
    again = run_optimum(load_study(study_file(tmp_path, text)), tmp_path / "none", Effort(retry=True))
    assert again.as_json()["failed"] == 0


@pytest.mark.slow
def test_it_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jobs: list[str]) -> None:
    """A search stopped at any scene repeats none and leaves the same files."""
    answer_by(monkeypatch, closed_form)
    path = study_file(tmp_path, STIFFNESS + MASS + SOUGHT)
    run_optimum(load_study(path), tmp_path / "whole")
    whole, count = (tmp_path / "whole" / "optimum.json").read_bytes(), len(jobs)
    lines = (tmp_path / "whole" / JOURNAL).read_text(encoding="utf-8").splitlines(keepends=True)
    for kept in (1, count // 3, count // 2, count - 1, count):
        out = tmp_path / f"kept{kept}"
        out.mkdir()
        (out / JOURNAL).write_text("".join(lines[: 1 + kept]) + '{"key": "cut', encoding="utf-8")
        jobs.clear()
        run_optimum(load_study(path), out)
        assert len(jobs) == count - kept
        assert (out / "optimum.json").read_bytes() == whole
