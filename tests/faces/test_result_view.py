"""What a run prints of its numbers: one sentence, and a table with error bars, differences, targets and landings."""

import re
from collections.abc import Mapping
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from seatfem.faces.report.fragments import provenance
from seatfem.faces.tables import landings_of, landings_tables, result_table
from seatfem.study.answers.decision import omissions
from seatfem.study.answers.verdict import verdict
from seatfem.study.runs.pipeline import write_landings
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


def printed(run: Mapping[str, object] = RUN, **changed: object) -> list[str]:
    console = Console(width=200, record=True, file=StringIO())
    console.print(result_table({**run, **changed}))
    return [" ".join(line.split()) for line in console.export_text().splitlines()]


def row(words: str, **changed: object) -> str:
    return next(line for line in printed(**changed) if line.startswith(words))


def test_value_bar_spring_difference_and_target_stand_in_one_row() -> None:
    peak = row("peak force (mean over 2 us)")
    assert peak == "peak force (mean over 2 us) 50.00 ± 0.50 N 40.00 N -20 % 20 1 %, reached"
    assert row("impulse") == "impulse 1.0000 ± 0.0010 mN s 1.0005 mN s +0.05 % 0.5 0.1 %, reached"
    assert row("peak force (mean over 2 us)", **{"error_bar_" + PEAK: 1.5}).endswith("3 %, missed")
    assert row("restitution") == "restitution 0.85 0.87"


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
    stress = "peak_reed_stress_after_contact_Pa"
    asked = {"accuracy_measures": "stress", stress: 1e8, f"spring_{stress}": 1.001e8, f"error_bar_{stress}": 1e6}
    assert re.match("A spring is enough .*reed stress after", verdict({**RUN, **asked})), "the peak was not asked for"


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


JUDGED = "landing_impulse_Ns, landing_filtered_peak_force_N"


def landing(number: int, body: str = "seat", **numbers: object) -> dict[str, object]:
    """Return a landing of a suction valve, as summary.json lists it."""
    return {
        "body": body, "number": number, "time_s": 9.0006e-3, "place_deg": 348.75, "place_m": 0.0335,
        "closing_speed_m_per_s": 1.49, "filtered_peak_force_N": 43.8, "peak_time_s": 9.0056e-3, "static_load_N": 3.1,
        "excess_peak_force_N": 40.7, "impulse_Ns": 230e-6, "duration_s": 21e-6, "restitution": 0.31, "cut_off": False,
        "error_bar_filtered_peak_force_N": 0.57, "error_bar_impulse_Ns": 1.4e-6, "error_bar_restitution": 0.22,
        "error_bar_duration_s": None,
    } | numbers  # fmt: skip


@pytest.fixture
def summary() -> dict[str, object]:
    """Return a suction valve's summary: pressed by the gas, one hit at the stopper, two landings on the seat."""
    records = [
        landing(1, "stopper", excess_peak_force_N=81.0),
        landing(1),
        landing(2, time_s=11.2e-3, excess_peak_force_N=8.0, filtered_peak_force_N=12.0, cut_off=True),
    ]
    skipped = ("body", "number", "place_deg", "place_m", "peak_time_s", "cut_off")
    hardest = {
        key.replace("error_bar_", "error_bar_landing_") if key.startswith("error_bar_") else f"landing_{key}": value
        for key, value in records[1].items()
        if key not in skipped
    }
    return {
        "landings": records, "landing_status": "landed", "landing_count": 2, "landing_number": 1,
        "accuracy_landing": "hardest", **hardest, "spring_landing_static_load_N": 3.1,
        "spring_landing_filtered_peak_force_N": 35.4, "spring_landing_impulse_Ns": 230.5e-6,
        "reed_stress_before_landing_Pa": 180e6, "accuracy_judged_keys": JUDGED,
        "accuracy_measures": "impulse, filtered_peak", "accuracy_target": 0.02, "accuracy_met": True,
        "filtered_peak_force_N": 72.821, "error_bar_filtered_peak_force_N": 0.087, "filter_width_s": 5e-6,
        "impulse_Ns": 0.9, "first_contact_s": 0.0, "contact_count": 2, "contact_count_raw": 7,
        "pressed_on_time_s": 12.3e-3, "pressed_on_largest_load_N": 72.0, "gas_largest_lift_m": 1e-3,
        "plan_run_duration": "20 ms", "seat_kind": "annular",
    }  # fmt: skip


def test_the_hardest_landing_stands_first_and_is_what_is_judged(summary: dict[str, object]) -> None:
    lines = printed(summary)
    first = lines.index("hardest landing (1 of 2)")
    assert lines[first + 1 : first + 10] == [
        "time 9.001 ms", "closing speed 1.49 m/s",
        "peak force (mean over 5 us) 43.80 ± 0.57 N 35.40 N -19 % 15 1.3 %, reached", "above the static load 40.7 N",
        "static load 3.1 N 3.1 N", "impulse above static load 230.0 ± 1.4 uN s 230.5 uN s +0.22 % 0.36 0.61 %, reached",
        "contact duration 21 ± ? us", "restitution not known (0.31 ± 0.22)", "reed stress before landing 180 MPa",
    ]  # fmt: skip
    whole = lines.index("whole run")
    assert whole > first
    assert lines[whole + 1] == "peak force (mean over 5 us) 72.821 ± 0.087 N", "the load of the gas is not judged"
    assert "first contact, reed starts closed 0 s" in lines
    assert "contacts 2 (landings 2), touches 7" in lines
    stress = {"peak_reed_stress_after_contact_Pa": 4e8, "initial_reed_stress_Pa": 0.0, "peak_reed_stress_Pa": 4e8}
    closed, opened = (printed(summary, **stress, first_contact_s=first) for first in (0.0, 1e-3))
    assert not any(line.startswith("reed stress before first") for line in closed), "there is nothing before"
    assert {"reed stress after first contact 400 MPa", "reed stress before first contact 0 Pa"} <= {*opened}
    assert not any(line.startswith("largest reed stress") for line in opened)


@pytest.mark.parametrize(
    ("status", "words", "remedy"),
    [
        ("no landing", "No landing: .*20 ms", "a longer run.duration"),
        ("cut off", "Cut off: ", "a run.duration longer than 20 ms"),
        ("never opened", "Never opened: ", 'accuracy.landing = "run"'),
    ],
)
def test_a_run_that_did_not_land_says_so_first(
    summary: dict[str, object], status: str, words: str, remedy: str
) -> None:
    nothing = {key: None for key in summary if "landing_" in key and key != "landing_status"}
    run = {**summary, **nothing, "landings": [], "landing_status": status, "accuracy_met": None}
    run |= {"accuracy_judged_keys": JUDGED, "impulse_Ns": 0.0, "error_bar_impulse_Ns": 0.0}
    assert re.match(words, verdict(run))
    assert remedy in verdict(run)
    lines = printed(run)
    assert "landing" not in " ".join(lines[:6])
    assert not [line for line in lines if line.endswith((", reached", ", missed"))]
    assert not list(landings_tables(landings_of(run)))


def test_landings_as_csv(tmp_path: Path) -> None:
    path = tmp_path / "landings.csv"
    write_landings(path, [landing(1, restitution=None), landing(2, cut_off=True)])
    text = path.read_text(encoding="utf-8").splitlines()
    assert text[0].startswith("body,number,time_s,place_deg,")
    first, second = (dict(zip(text[0].split(","), line.split(","), strict=True)) for line in text[1:])
    assert float(first["time_s"]) == 9.0006e-3
    assert (first["restitution"], first["cut_off"], second["cut_off"]) == ("", "false", "true")
    write_landings(path, [])
    assert path.read_bytes() == b"body,number,time_s\n"
