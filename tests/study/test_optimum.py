"""Optima with a known place, of a mass m on a spring k, and scenes that do not land, which are left out of all."""

import csv
from pathlib import Path

import numpy as np
import pytest

from seatfem.study.sweep import effects
from seatfem.study.sweep.answers import ranges
from seatfem.study.sweep.best import Optimum
from seatfem.study.sweep.effort import Effort
from seatfem.study.sweep.runner import JOURNAL, StudyError
from seatfem.study.sweep.study import load_study
from seatfem.study.sweep.sweep import TABLE, run_optimum, run_study
from seatfem.study.sweep.table import StudyTable
from tests.steps import DONE, FAILED, run_command
from tests.study.crew_at_hand import amount, answer_by
from tests.study.test_studies import study_file

pytestmark = pytest.mark.slow
STIFFNESS = '[vary]\nseat.stiffness = { from = "0.1 N/um", to = "10 N/um", scale = "log" }\n'
MASS = 'reed.mass = { from = "0.2 g", to = "5 g" }\n'
SOUGHT = '[optimise]\nminimise = "filtered_peak_force_N"\nsubject_to = ["max_seat_displacement_m <= 3e-5"]\n'


def number(optimum: Optimum, key: str) -> float:
    return float(str(optimum.as_json()["keys"][key]).split()[0])


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


def test_an_optimum_between_the_bounds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jobs: list[str]) -> None:
    """The search has the largest 5 - (k / 2 - 2 / k)^2 at k = 2, near a parabola of shares."""
    answer_by(monkeypatch, lambda keys: {"impulse_Ns": 5 - ((k := amount(keys["seat.stiffness"])) / 2 - 2 / k) ** 2})
    text = STIFFNESS + '[optimise]\nmaximise = "impulse_Ns"\nmost = 20\n'
    optimum = run_optimum(load_study(study_file(tmp_path, text)), tmp_path / "out")
    assert number(optimum, "seat.stiffness") == pytest.approx(2.0, rel=0.01)  # 2e-3 of two decades
    assert len(optimum.searched) <= 20


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


GAPS = '[vary]\ncontact.gap = ["0 mm", "0.05 mm", "0.09 mm", "0.15 mm", "0.3 mm"]\nreed.velocity = {}\n'
STATUSES = ["landed", "landed", "landed", "cut off", "no landing"]
STAYS = np.pi * (1e-3 / 1e6) ** 0.5
RUN = 2e-4


def swept(folder: Path, more: str = "", velocity: str = '"-1 m/s"') -> StudyTable:
    return run_study(load_study(study_file(folder, GAPS.format(velocity) + more)), folder / "out")


def test_means_are_of_scenes_that_land(tmp_path: Path, jobs: list[str]) -> None:
    """Means over scenes that land are 2 m v to the steps' tolerance; all scenes would give a quarter less."""
    table = swept(tmp_path)
    assert list(table.columns["landing_status"]) == STATUSES
    assert list(table.columns["status"]) == ["done", "done", "done", "missed", "done"]  # of a part nothing is known
    assert table.left_out_in_words() == "2 of 5 scenes left out: 1 cut off, 1 no landing"
    assert table.numbers("landing_impulse_Ns")[3] < 1.7e-3  # its part until the run ends
    [impulse, peak] = ranges(table)
    assert float(impulse.split()[-1]) == pytest.approx(2.0, rel=5e-3)  # mN s
    assert peak.startswith("peak force of landing [N]: 31.")  # v sqrt(k m) is 31.62
    effect = effects.main_effect(table, "contact.gap [mm]", "landing_impulse_Ns")
    assert list(effect.at) == [0.0, 0.05, 0.09]
    assert effect.mean == pytest.approx([2e-3] * 3, rel=5e-3)


def test_side_by_side_they_are_told_apart_as_one_by_one(tmp_path: Path, jobs: list[str]) -> None:
    """Status follows from when the mass arrives and leaves; scenes that land have a sample's bars, no others."""
    text = """design = "latin_hypercube"
number = 64
error_bars = "sampled"
[vary]
contact.gap = { from = "0 mm", to = "0.4 mm" }
"""
    table = run_study(load_study(study_file(tmp_path, text)), tmp_path / "out")
    beside = np.array(table.columns["error_bars"]) == "sampled"
    arrives = 1e-3 * table.numbers("contact.gap [mm]")
    expected = np.where(arrives + STAYS < RUN, "landed", np.where(arrives < RUN, "cut off", "no landing"))
    clear = (np.abs(arrives + STAYS - RUN) > 2e-6) & (np.abs(arrives - RUN) > 2e-6)
    assert np.array(table.columns["landing_status"])[clear].tolist() == expected[clear].tolist()
    assert {status: (beside & clear & (expected == status)).sum() > 2 for status in STATUSES} == dict.fromkeys(
        STATUSES, True
    )
    assert {status for status, out in zip(table.columns["status"], table.left_out, strict=True) if not out} == {"done"}
    values, bars = table.values("landing_impulse_Ns"), table.numbers("error_bar_landing_impulse_Ns")
    landed = beside & table.has_landed
    assert np.all(np.abs(values - 2e-3)[landed] <= bars[landed] + 1e-9)
    assert np.isnan(bars[beside & ~table.has_landed]).all()
    peaks = table.numbers("landing_filtered_peak_force_N")[landed]
    assert peaks == pytest.approx((1e6 * 1e-3) ** 0.5, rel=5e-3)


FOR_LEAST = '[vary]\ncontact.gap = { from = "0 mm", to = "0.4 mm" }\n[optimise]\nminimise = "%s"\nmost = 12\n'


@pytest.mark.parametrize("measure", ["landing_impulse_Ns", "impulse_Ns"])
def test_an_optimum_lands(measure: str, tmp_path: Path, jobs: list[str]) -> None:
    """Half of the range has no impulse at all, a quarter a part of it; the least is 2 m v of the scenes that land."""
    optimum = run_optimum(load_study(study_file(tmp_path, FOR_LEAST % measure)), tmp_path / "out")
    assert optimum.best.outcome.summary["landing_status"] == "landed"
    assert {each.outcome.summary["landing_status"] for each in optimum.searched} == set(STATUSES)
    assert optimum.best.value(measure) == pytest.approx(2e-3, rel=5e-3)
    assert "of 12 scenes left out" in optimum.as_json()["left_out"] or len(optimum.searched) < 12
    assert optimum.as_json()["left_out"].endswith(("cut off", "no landing"))


def test_no_optimum_where_nothing_lands(tmp_path: Path, jobs: list[str]) -> None:
    text = FOR_LEAST.replace('"0 mm"', '"0.3 mm"') % "impulse_Ns"
    with pytest.raises(StudyError, match=r"\d+ scenes .*\d+ no landing"):
        run_optimum(load_study(study_file(tmp_path, text)), tmp_path / "out")


def test_what_the_program_says(tmp_path, monkeypatch, jobs, capsys):
    """The command tells how many scenes are left out, and which measures no or only some scenes have."""
    monkeypatch.chdir(tmp_path)
    study_file(tmp_path, GAPS.format('["-1 m/s", "-1.1 m/s"]'))
    assert run_command(["sweep", "study.toml", "-o", "out"]) == DONE
    out = capsys.readouterr().out
    assert "10 scenes, 8 done, 2 missed\n4 of 10 scenes left out: 2 cut off, 2 no landing\n" in out
    assert "empty" not in out
    assert (tmp_path / "out" / "main_effects.png").is_file()
    assert ",landing_status,status," in (tmp_path / "out" / TABLE).read_text(encoding="utf-8").splitlines()[0]
    outputs = '[outputs]\nmeasures = ["landing_peak_reed_stress_Pa", "impulse_Ns"]\n'  # a rigid mass bears none
    study_file(tmp_path, GAPS.format('"-1 m/s"') + outputs)
    assert run_command(["sweep", "study.toml", "-o", "out", "--no-pictures"]) == FAILED
    assert "landing_peak_reed_stress_Pa: no scene has it, of 3 that landed\n" in capsys.readouterr().out
    study_file(tmp_path, '[vary]\ncontact.gap = ["0.3 mm", "0.35 mm"]')
    assert run_command(["sweep", "study.toml", "-o", "never", "--no-pictures"]) == FAILED
    out = capsys.readouterr().out
    assert "2 of 2 scenes left out: 2 no landing\n" in out
    assert "landing_impulse_Ns: no scene has it: none landed\n" in out
