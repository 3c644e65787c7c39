"""The first screen of `seatfem run`: it fits, begins with the decision, and says what its numbers do not tell."""

import html
import json
import math
import re
from pathlib import Path

import pytest

from seatfem.faces.cli import DONE, run_command
from seatfem.faces.first_screen import COLUMNS, LINES, first_lines
from seatfem.faces.report.page import report_page
from seatfem.faces.tables import result_table
from seatfem.study.answers.decision import checked_scenes, how_often_checked, omissions
from tests.gallery import Told

SCENE = Path(__file__).parents[2] / "examples" / "flapper_on_spring.toml"


def height(lines: list[str]) -> int:
    return sum(math.ceil(max(len(line), 1) / COLUMNS) for line in lines)


@pytest.mark.slow
def test_the_first_screen_of_run_fits_and_full_prints_the_rest(tmp_path: Path, capsys: Told) -> None:
    """It stands in the report, the terminal and summary.json alike."""
    folder = tmp_path / "out"
    assert run_command(["run", str(SCENE), "-o", str(folder), "--no-pictures"]) == DONE
    short = capsys.readouterr().out.splitlines()
    assert height(short) <= LINES
    assert max(map(len, short)) <= COLUMNS
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert short.index(f"Decision: {summary['decision']}") < short.index("Left out:")
    assert summary["decision"] == "undecided", "the scene states no strength"
    assert " ".join(short).count(summary["decision_event"]) == 1
    assert run_command(["run", str(SCENE), "-o", str(folder), "--no-pictures", "--full"]) == DONE
    full = capsys.readouterr().out.splitlines()
    assert len(full) > len(short)
    assert f"Decision: {summary['decision']}" in full
    for words in ("whole run", "raw, step", "wrote ", "time: "):
        assert any(line.strip().startswith(words) for line in full), words
        assert words == "wrote " or not any(line.strip().startswith(words) for line in short), words


def test_what_does_not_fit_is_counted() -> None:
    """Notes of many lines do not push the decision off the screen."""
    summary = {"landing_status": "landed", "seat_kind": "annular", "reed_kind": "cantilever", "impulse_Ns": 1.0}
    notes = [f"note {number} " + "word " * 40 for number in range(30)]
    lines = first_lines(summary, "A valve", notes, [Path("out/summary.json"), Path("out/result.h5")])
    assert height(lines) <= LINES
    shown = sum(line.startswith("note: ") for line in lines)
    assert 0 < shown < 30
    assert f"further notes: {30 - shown} (--full)" in lines
    assert "wrote 2 files to out" in lines


def test_a_curved_retainer_is_called_one() -> None:
    summary = {"landing_status": "landed", "seat_kind": "annular", "reed_kind": "cantilever", "stopper_kind": "spring"}
    assert "stopper: spring" in first_lines(summary, "A valve", (), ())[1]
    assert (
        "stopper: curved retainer, spring" in first_lines(summary | {"stopper_shape": "curved retainer"}, "", (), ())[0]
    )


def test_places_on_several_lands_are_those_of_the_table_of_lands() -> None:
    """A land and the angle on it, in place of a length along all of them."""
    places = {"ports": 16, "line_force_peak_N_per_m": 1e3, "line_force_peak_at_m": 0.0234}
    assert "23.4 mm" in result_table(places).columns[1].cells
    on_a_land = places | {"line_force_peak_land": "outer land", "line_force_peak_land_deg": 84.0}
    assert "outer land, 84 deg" in result_table(on_a_land).columns[1].cells
    assert "from its own x axis" not in str(result_table(on_a_land).caption)


def test_the_verbs_stand_in_groups(capsys: Told) -> None:
    assert run_command(["--help"]) == DONE
    text = capsys.readouterr().out
    order = ["Begin", "init ", "Compute a scene", "run ", "Look at a run", "report ", "Studies", "sweep ", "Trust"]
    places = [re.search(rf"(?m)^\W*{words}", text) for words in order]
    starts = [place.start() for place in places if place]
    assert len(starts) == len(order)
    assert starts == sorted(starts)
    assert run_command(["run", "--help"]) == DONE
    assert re.search(r"(?s)Parameters .*--full .*Options of every verb .*--quiet ", capsys.readouterr().out)


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
