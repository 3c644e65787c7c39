"""What a run prints of its numbers: one sentence, and a table with error bars, differences and targets."""

import re
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from seatfem.faces.report.fragments import provenance
from seatfem.faces.tables import result_table
from seatfem.study.answers.decision import omissions
from seatfem.study.answers.verdict import verdict
from seatfem.wings.life import life_sentence

ABSENT = ...  # of a key that is not there
PEAK, IMPULSE = "filtered_peak_force_N", "impulse_Ns"
RUN: dict[str, object] = {
    PEAK: 50.0, "spring_" + PEAK: 40.0, "error_bar_" + PEAK: 0.5, IMPULSE: 1e-3, "spring_" + IMPULSE: 1.0005e-3,
    "error_bar_" + IMPULSE: 1e-6, "filter_width_s": 2e-6, "time_step_s": 25e-9, "first_contact_s": 5e-4,
    "spring_first_contact_s": 5e-4, "contact_count": 2, "spring_contact_count": 3, "restitution": 0.85,
    "spring_restitution": 0.87, "max_seat_displacement_m": 1e-6, "spring_max_seat_displacement_m": 2e-6,
    "error_bar_max_seat_displacement_m": 1e-8, "peak_force_N": 150.0, "spring_peak_force_N": 70.0,
    "energy_residual": 1e-12, "accuracy_target": 0.02, "accuracy_measures": "impulse, filtered_peak",
    "accuracy_met": True, "plan_seat_level": "axisymmetric", "plan_given": "run.duration", "seat_kind": "annular",
    "error_unknown": "",
}  # fmt: skip


def printed(**changed: object) -> list[str]:
    console = Console(width=120, record=True, file=StringIO())
    console.print(result_table({**RUN, **changed}))
    return [" ".join(line.split()) for line in console.export_text().splitlines()]


def row(words: str, **changed: object) -> str:
    return next(line for line in printed(**changed) if line.startswith(words))


def test_value_bar_spring_difference_and_target_stand_in_one_row() -> None:
    assert (
        row("peak force (mean over 2 us)") == "peak force (mean over 2 us) 50.00 ± 0.50 N 40.00 N -20 % 20 1 %, reached"
    )
    assert row("impulse") == "impulse 1.0000 ± 0.0010 mN s 1.0005 mN s +0.05 % 0.5 0.1 %, reached"
    assert row("peak force (mean over 2 us)", **{"error_bar_" + PEAK: 1.5}).endswith("3 %, missed")
    assert row("restitution") == "restitution 0.85 0.87"


def test_stress_after_the_first_landing_replaces_the_largest_of_all() -> None:
    old = {"peak_reed_stress_Pa": 2e8, "spring_peak_reed_stress_Pa": 2e8}
    new = {"peak_reed_stress_after_contact_Pa": 9e7, "initial_reed_stress_Pa": 2e8, "reed_stress_at_start_Pa": 1.5e8}
    assert row("largest reed stress", **old) == "largest reed stress 200 MPa 200 MPa"
    lines = printed(**old, **new)
    assert "reed stress after first contact 90 MPa" in lines
    assert "reed stress before first contact 200 MPa" in lines
    assert "reed stress at the start 150 MPa" in lines
    assert not any(line.startswith("largest reed stress") for line in lines)


def test_a_bar_above_half_of_the_value_leaves_it_not_known() -> None:
    """A value with a bar above its half is not known, whatever the plan's seat; instants are."""
    stress = {"peak_seat_stress_Pa": 21.18e6, "error_bar_peak_seat_stress_Pa": 42.9e6}
    for level in ("spring", "axisymmetric"):
        assert row("largest, von Mises", **stress, plan_seat_level=level) == (
            "largest, von Mises not known (21 ± 43 MPa)"
        )
    assert row("impulse", **{"error_bar_" + IMPULSE: 0.51e-3}).endswith("not known, missed")
    assert "not known" not in row("impulse", **{"error_bar_" + IMPULSE: 0.49e-3})
    assert row("first contact", error_bar_first_contact_s=4e-4).startswith("first contact 500 ± 400 us")


def test_a_difference_beyond_the_bars_is_told_with_its_numbers() -> None:
    peak = r"Peak force .*2 us.* 40 N .*50 N \(-20 %\)\. .* 50 N: 0\.5 N\."
    assert re.fullmatch(peak, verdict(RUN))
    both = verdict({**RUN, "spring_" + IMPULSE: 1.01e-3})
    assert re.fullmatch(peak + r" Impulse: .*1\.01 mN s .*1\.00 mN s \(\+1 %\)\. .*: 0\.001 mN s\.", both)


def test_below_the_bars_a_spring_is_enough() -> None:
    near = {**RUN, "spring_" + PEAK: 50.4}
    assert re.fullmatch(r"A spring is enough .* 0\.8 % .* 1 %\.", verdict(near))
    wide = verdict({**RUN, "error_bar_" + PEAK: 20.0, "accuracy_met": False})
    assert wide.startswith("This run cannot show")
    unknown = verdict({**RUN, "spring_" + PEAK: 5.0, "error_bar_" + PEAK: 26.0})
    assert unknown.startswith("This run cannot show"), "an unknown value decides nothing"


def test_measures_asked_for_decide_and_others_do_not() -> None:
    """The stress was asked for: the peak's difference is not the answer."""
    stress = "peak_reed_stress_after_contact_Pa"
    changed = {
        **RUN, "accuracy_measures": "stress", stress: 1e8, f"spring_{stress}": 1.001e8, f"error_bar_{stress}": 1e6
    }  # fmt: skip
    assert re.match("A spring is enough .*reed stress after", verdict(changed))


LIFE: dict[str, object] = {
    "life_margin": 1.35, "spring_life_margin": 1.4, "error_bar_life_margin": 0.05, "life_cycles": 2.3e12,
    "life_damage_per_cycle": 1 / 2.3e12, "life_at": "reed, root, face away from the seat", "life_design_cycles": 4.5e9,
    "life_survival": 0.999, "life_criterion": "goodman", "life_strength_source": "invented",
}  # fmt: skip


@pytest.mark.slow(but="None")
@pytest.mark.parametrize("value", [ABSENT, None, "text", 0, -1.0, []], ids=repr)
def test_a_summary_of_another_version_is_still_readable(value: object, tmp_path: Path) -> None:
    """Whatever a key of somebody else's summary.json holds, or where it is absent, the others are shown."""
    speed = {"life_speed_margin": 4.0, "life_speed_m_per_s": 2.0, "life_speed_limit_m_per_s": 8.0}
    whole = {**RUN, **LIFE, **speed, "life_multiaxial_margin": 2.0}
    for key in whole:
        summary = {name: old if name != key else value for name, old in whole.items() if name != key or value != ABSENT}
        sentence = life_sentence(summary)
        assert sentence.count(" endures ") + sentence.count(" fails ") + sentence.count("no stress") >= 1
        assert verdict(summary)
        assert result_table(summary).row_count
        assert "to reproduce" in provenance(tmp_path, {**summary, "stages_s": {"plan": value}})
        assert "Stress in the seat was not computed" in " ".join(omissions(summary))
    without = {
        key: value for key, value in LIFE.items() if key not in ("life_design_cycles", "life_survival", "life_at")
    }
    assert re.search(r"endures .*1\.35 \+- 0\.05 .*\(goodman; invented\)$", life_sentence(without))
