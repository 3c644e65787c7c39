"""Scenes of a study that do not land, or are cut off: told, counted, and left out of all that follows.

A mass m with speed v meets a spring k at t = gap / v and stays for pi sqrt(m / k) = 99 us; the run takes 200 us.
"""

from pathlib import Path

import numpy as np
import pytest

from seatfem.study.sweep import effects
from seatfem.study.sweep.answers import ranges
from seatfem.study.sweep.runner import StudyError
from seatfem.study.sweep.study import load_study
from seatfem.study.sweep.sweep import TABLE, run_optimum, run_study
from seatfem.study.sweep.table import StudyTable
from tests.steps import DONE, FAILED, run_command
from tests.study.test_studies import study_file

GAPS = '[vary]\ncontact.gap = ["0 mm", "0.05 mm", "0.09 mm", "0.15 mm", "0.3 mm"]\nreed.velocity = {}\n'
STATUSES = ["landed", "landed", "landed", "cut off", "no landing"]
STAYS = np.pi * (1e-3 / 1e6) ** 0.5
RUN = 2e-4


def swept(folder: Path, more: str = "", velocity: str = '"-1 m/s"') -> StudyTable:
    return run_study(load_study(study_file(folder, GAPS.format(velocity) + more)), folder / "out")


@pytest.mark.slow
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


@pytest.mark.slow
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


SOUGHT = '[vary]\ncontact.gap = { from = "0 mm", to = "0.4 mm" }\n[optimise]\nminimise = "%s"\nmost = 12\n'


@pytest.mark.slow
@pytest.mark.parametrize("measure", ["landing_impulse_Ns", "impulse_Ns"])
def test_an_optimum_lands(measure: str, tmp_path: Path, jobs: list[str]) -> None:
    """Half of the range has no impulse at all, a quarter a part of it; the least is 2 m v of the scenes that land."""
    optimum = run_optimum(load_study(study_file(tmp_path, SOUGHT % measure)), tmp_path / "out")
    assert optimum.best.outcome.summary["landing_status"] == "landed"
    assert {each.outcome.summary["landing_status"] for each in optimum.searched} == set(STATUSES)
    assert optimum.best.value(measure) == pytest.approx(2e-3, rel=5e-3)
    assert "of 12 scenes left out" in optimum.as_json()["left_out"] or len(optimum.searched) < 12
    assert optimum.as_json()["left_out"].endswith(("cut off", "no landing"))


@pytest.mark.slow
def test_no_optimum_where_nothing_lands(tmp_path: Path, jobs: list[str]) -> None:
    text = SOUGHT.replace('"0 mm"', '"0.3 mm"') % "impulse_Ns"
    with pytest.raises(StudyError, match=r"\d+ scenes .*\d+ no landing"):
        run_optimum(load_study(study_file(tmp_path, text)), tmp_path / "out")


@pytest.mark.slow
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
