"""Runs say how many of their landings are known, and give statistics of the others where they are asked for."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from impact.after.landings import Landing
from seatfem import results
from seatfem.study.answers.verdict import horizon
from seatfem.study.runs.horizon import ensemble_keys
from tests.steps import run_command

SCENE = (
    '\nseat = {{ kind = "spring", stiffness = "100 kN/m" }}\n'
    'reed = {{ kind = "rigid_mass", mass = "10 g", velocity = "-0.2 m/s" }}\n'
    'contact = {{ law = {{ kind = "hunt_crossley", stiffness = "50 MN/m^1.5", damping = "1 s/m" }} }}\n'
    'run = {{ duration = "{duration}", time_step = "20 us", filter_width = "100 us"{more} }}\n[[load]]\n'
    'gravity = "-9.81 m/s^2"\n[[base]]\nof = "seat"\nacceleration = "table.csv"\n'
)


def shaken(folder: Path, duration: str, more: str = "") -> Path:
    """Write a ball on a table that shakes with 5 g at 50 Hz."""
    rows = (f"{t / 4000:.5f},{49.05 * math.cos(100 * math.pi * t / 4000):.6f}" for t in range(12001))
    (folder / "table.csv").write_text("\n".join(["time [s],acceleration [m/s^2]", *rows]) + "\n", encoding="utf-8")
    path = folder / "shaken.toml"
    path.write_text(SCENE.format(duration=duration, more=more and f", {more}"), encoding="utf-8")
    return path


def summary_of(folder: Path, scene: Path) -> dict[str, object]:
    run_command(["run", str(scene), "-o", str(folder / "out"), "--no-pictures", "--rounds", "1", "--quiet"])
    return dict(json.loads((folder / "out" / "summary.json").read_text(encoding="utf-8")))


@pytest.mark.slow
def test_a_shaken_ball_is_known_for_some_landings_only(tmp_path: Path) -> None:
    summary = summary_of(tmp_path, shaken(tmp_path, "1.6 s", "ensemble = 4"))
    known, inputs = summary[results.KNOWN_LANDINGS], summary[results.KNOWN_OF_INPUTS]
    assert isinstance(known, int)
    assert isinstance(inputs, int)
    number = len(list(summary["landings"]))  # type: ignore[call-overload]
    assert 1 <= inputs < known < number
    assert summary[results.LANDING_GROWTH] > 2  # type: ignore[operator]
    assert summary[results.ENSEMBLE] == 4
    speed, bar, spread = (
        summary[key]
        for key in (
            results.ENSEMBLE_SPEED,
            f"error_bar_{results.ENSEMBLE_SPEED}",
            results.spread_of(results.ENSEMBLE_SPEED),
        )
    )
    assert 0 < bar < speed  # type: ignore[operator]
    assert 0 < spread < speed  # type: ignore[operator]
    words = horizon(summary)
    assert f"landings 1 to {known} can be predicted, from {known + 1} on only statistics" in words
    assert "Mean of the others over 4 runs: closing speed" in words


@pytest.mark.slow
@pytest.mark.parametrize(("duration", "number"), [("30 ms", 1), ("70 ms", 2)])
def test_restitution_on_a_shaken_table_is_that_of_the_only_landing(tmp_path: Path, duration: str, number: int) -> None:
    """Impulses of all blows over the first approach would be above 1: the table and gravity give speed in between."""
    summary = summary_of(tmp_path, shaken(tmp_path, duration))
    assert len(list(summary["landings"])) == number  # type: ignore[call-overload]
    assert 0.5 < summary["landing_restitution"] < 1  # type: ignore[operator]
    assert summary["restitution"] == (summary["landing_restitution"] if number == 1 else None)


def landing(speed: float) -> Landing:
    return Landing(0.0, 1.0, 0.5, 0, speed, 10 * speed, 0.0, 10 * speed, speed, False, False)


def test_bars_are_of_the_members_and_spreads_of_single_landings() -> None:
    """Means of 2, 4 and 6 m/s: their standard error is 2/sqrt(3); single landings of 1, 3, 4, 6 scatter by more."""
    keys = ensemble_keys([[landing(1.0), landing(3.0)], [landing(4.0)], [landing(6.0)], []])
    assert keys[results.ENSEMBLE] == 4
    assert keys[results.ENSEMBLE_LANDINGS] == 4
    assert keys[results.ENSEMBLE_SPEED] == pytest.approx(4.0)
    assert keys[f"error_bar_{results.ENSEMBLE_SPEED}"] == pytest.approx(2 * 2 / math.sqrt(3))
    assert keys[results.spread_of(results.ENSEMBLE_SPEED)] == pytest.approx(math.sqrt(13 / 3))
    assert keys[results.ENSEMBLE_PEAK] == pytest.approx(40.0)


def test_a_difference_that_stays_is_said_to_hardly_grow() -> None:
    summary = {"landings": [{}, {}, {}], results.KNOWN_LANDINGS: 3, results.LANDING_GROWTH: 1.02}
    words = (
        "all 3 landings can be predicted: a small difference, of round-off or inputs and not of the step, hardly grows"
    )
    assert horizon(summary) == f"{words} from one to the next"
    alone = summary | {results.ENSEMBLE: 1, results.ENSEMBLE_LANDINGS: 0}
    nothing = "No landing is left to an ensemble (run.ensemble): it was not marched"
    assert horizon(alone) == f"{words} from one to the next. {nothing}"
    assert horizon({key: alone[key] for key in (results.ENSEMBLE, results.ENSEMBLE_LANDINGS)}) == nothing
