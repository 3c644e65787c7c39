"""What a user sees first: the landing that a run is judged by, all landings, and that nothing landed where so."""

from __future__ import annotations

import re
from collections.abc import Mapping
from io import StringIO
from pathlib import Path

import pytest
from rich.table import Table

from seatfem.faces.tables import landings_of, landings_tables, result_table
from seatfem.faces.terminal import Console
from seatfem.study.answers.verdict import verdict
from seatfem.study.runs.pipeline import write_landings

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


def lines_of(table: Table | None) -> list[str]:
    console = Console(width=200, record=True, file=StringIO())
    console.print(table)
    return [" ".join(line.split()) for line in console.export_text().splitlines()]


def printed(summary: Mapping[str, object], **changed: object) -> list[str]:
    return lines_of(result_table({**summary, **changed}))


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
    stress = {"peak_reed_stress_after_contact_Pa": 4e8, "initial_reed_stress_Pa": 0.0}
    closed, opened = (printed(summary, **stress, first_contact_s=first) for first in (0.0, 1e-3))
    assert not any(line.startswith("reed stress before first") for line in closed), "there is nothing before"
    assert {"reed stress after first contact 400 MPa", "reed stress before first contact 0 Pa"} <= {*opened}


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
