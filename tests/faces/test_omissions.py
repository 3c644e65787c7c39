"""The part of a report that says what its numbers do not tell, and how often scenes of this kind were checked."""

from __future__ import annotations

import html
import json
from pathlib import Path

import pytest

from seatfem.faces.report.page import report_page
from seatfem.study.answers.decision import checked_scenes, how_often_checked, omissions

HOSTILE = "<script>document.title='taken'</script>"
WHOLE = {
    "impulse_Ns": 1.0, "error_bar_impulse_Ns": 0.1, "peak_seat_stress_Pa": 1e6, "error_bar_peak_seat_stress_Pa": 1e4,
    "peak_reed_stress_Pa": 1e8, "error_bar_peak_reed_stress_Pa": 1e6, "life_margin": 1.2, "error_bar_life_margin": 0.1,
    "contact_count": 2, "accuracy_judged_keys": "impulse_Ns", "accuracy_met": True, "error_unknown": "",
}  # fmt: skip
"""Summary of a run that leaves nothing open."""


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"error_unknown": "mesh, patch"},
         "Not included in the uncertainty: mesh error, division of the contact face."),
        ({"error_bar_impulse_Ns": None}, "Uncertainty not known (whole run): impulse."),
        ({"error_bar_impulse_Ns": 0.51},
         "Not known, since the uncertainty is above half of the value (whole run): impulse."),
        ({"contact_duration_s": 1e-4, "first_contact_s": 1e-3, "error_bar_first_contact_s": 1e-6},
         "Without an uncertainty (whole run): first contact: contact duration."),
        ({"peak_force_N": 3.0}, "Without an uncertainty (raw): peak force."),
        ({"impulse_Ns": None}, "Asked for, but without a value in this run: impulse."),
        ({"accuracy_met": False, "accuracy_stopped_because": "no time is left"},
         "The accuracy asked for was missed, and no further round followed: no time is left."),
        ({"peak_seat_stress_Pa": None},
         "Stress in the seat was not computed; add [stress] to the scene (for seats of finite elements)."),
        ({"peak_reed_stress_Pa": None},
         "Stress in the reed was not computed; add [stress] to the scene (for reeds of plate elements)."),
        ({"pictures_missing": "no driver"}, "Pictures that could not be drawn: no driver."),
    ],
)  # fmt: skip
def test_what_is_open_is_told(changed: dict[str, object], sentence: str) -> None:
    assert sentence in list(omissions({**WHOLE, **changed}))


def test_the_package_names_scenes_that_were_checked() -> None:
    table = checked_scenes()
    assert len(table) > 50
    assert all(0 <= int(each["inside"]) <= int(each["numbers"]) and int(each["scenes"]) > 0 for each in table)
    lips = [each for each in table if (each["seat"], each["reed"]) == ("annular", "flapper")]
    scenes, inside, numbers = (sum(int(each[key]) for each in lips) for key in ("scenes", "inside", "numbers"))
    sentence = how_often_checked({"seat_kind": "annular", "reed_kind": "flapper"})
    assert sentence.startswith(f"{scenes} test scenes with ")
    assert f": {inside} of {numbers} results were right" in sentence


def test_nothing_of_a_summary_runs_in_the_page(tmp_path: Path) -> None:
    keys = ("error_unknown", "seat_kind", "reed_kind", "accuracy_stopped_because", "pictures_missing")
    whole = {key: value for key, value in WHOLE.items() if "life" not in key}
    hostile = {**whole, **dict.fromkeys(keys, HOSTILE), "accuracy_met": False, "first_contact_s": 0.1}
    (tmp_path / "summary.json").write_text(json.dumps(hostile), encoding="utf-8")
    page = report_page(tmp_path)
    assert HOSTILE not in page
    assert page.count(html.escape(HOSTILE)) >= 5
    assert "Also left out" in page
