"""The first screen of `seatfem run`: it fits a terminal, begins with the decision, and `--full` prints the rest."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

from seatfem.faces.cli import DONE, run_command
from seatfem.faces.first_screen import COLUMNS, LINES, first_lines
from seatfem.faces.tables import result_table

SCENE = Path(__file__).parents[2] / "examples" / "flapper_on_spring.toml"


def height(lines: list[str]) -> int:
    return sum(math.ceil(max(len(line), 1) / COLUMNS) for line in lines)


@pytest.mark.slow
def test_the_first_screen_of_run_fits_and_full_prints_the_rest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
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


def test_the_verbs_stand_in_groups(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["--help"]) == DONE
    text = capsys.readouterr().out
    order = ["Begin", "init ", "Compute a scene", "run ", "Look at a run", "report ", "Studies", "sweep ", "Trust"]
    places = [re.search(rf"(?m)^\W*{words}", text) for words in order]
    starts = [place.start() for place in places if place]
    assert len(starts) == len(order)
    assert starts == sorted(starts)
    assert run_command(["run", "--help"]) == DONE
    assert re.search(r"(?s)Parameters .*--full .*Options of every verb .*--quiet ", capsys.readouterr().out)
