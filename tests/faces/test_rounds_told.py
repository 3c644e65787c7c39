"""`seatfem run` tells a line of each round, and what is on file when it is stopped."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from impact.notices import ROUND
from seatfem.faces.cli import INTERRUPTED
from seatfem.faces.terminal import SILENCE, StageClock, progress_bars
from seatfem.study.runs import rounds
from tests.gallery import REED_ON_SPRING, Patch, Told
from tests.steps import DONE, FAILED, load_results, run_command

RUN = ["run", "scene.toml", "-o", "out", "--no-pictures"]


def test_a_long_stage_is_told_in_each_round(capsys: Told) -> None:
    """A stage of a later round that takes as long as one before is told as early, though its time is less."""
    with progress_bars(Console(stderr=True, force_terminal=False, width=200)) as progress:
        assert isinstance(progress, StageClock)
        for begin in (0.0, 100.0):
            times = iter([begin, begin + 1, begin + 2 + SILENCE, begin + 30.0])
            progress.now = lambda times=times: next(times)
            for stage, done in ((ROUND, 0.0), ("modes", 0.0), ("modes", 0.5), ("modes", 1.0)):
                progress(stage, done)
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("modes")]
    assert [line.partition(" (")[0] for line in lines] == 2 * ["modes: 11.0 s, 50 % done", "modes: 29.0 s"]


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: Patch) -> None:
    """Write a scene of three rounds: modes and step, then the step alone."""
    (tmp_path / "scene.toml").write_text(REED_ON_SPRING + 'target = "0.3 %"\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)


def summary() -> dict[str, Any]:
    return dict(json.loads(Path("out/summary.json").read_text(encoding="utf-8")))


@pytest.mark.slow
@pytest.mark.usefixtures("scene")
def test_a_round_is_a_line(capsys: Told) -> None:
    """A line tells what was refined, from what error to what, at what price, and begins where the last one ended."""
    assert run_command(RUN) == DONE
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("round")]
    bars = r"impulse \+-(\S+ %(?: -> \S+ %)?); peak force \+-(\S+ %(?: -> \S+ %)?)"
    cost = r"[\d.]+ s, [\d.]+ GB"
    first, *others = lines
    assert len(lines) == summary()["accuracy_rounds"] == 3
    match = re.fullmatch(rf"round 1: {bars}; target 0.3 % missed; {cost}; the next about \S+ s", first)
    assert match, first
    before = match.groups()
    for number, line in enumerate(others, start=2):
        end = "reached" if line is others[-1] else "missed"
        ahead = "" if line is others[-1] else r"; the next about \S+ s"
        pattern = rf"round {number} \((.+)\): {bars}; target 0.3 % {end}; {cost}{ahead}"
        match = re.fullmatch(pattern, line)
        assert match, line
        changes, *moved = match.groups()
        assert all(re.fullmatch(r"\S+ \S+( \S+)? -> \S+( \S+)?", change) for change in changes.split(", "))
        assert [bar.partition(" -> ")[0] for bar in moved] == list(before)
        before = tuple(bar.partition(" -> ")[2] or bar for bar in moved)
    assert "reed.n_modes 20 -> " in others[0]
    assert "reed.n_modes" not in others[1]


@pytest.mark.slow
@pytest.mark.usefixtures("scene")
def test_ctrl_c_in_the_second_round_leaves_the_first(monkeypatch: Patch, capsys: Told) -> None:
    march, calls = rounds.run_contacts, []

    def stopping(*given: Any, **more: Any) -> Any:
        calls.append(given)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return march(*given, **more)

    monkeypatch.setattr(rounds, "run_contacts", stopping)
    assert run_command(RUN) == INTERRUPTED
    assert "Traceback" not in capsys.readouterr().err
    kept = summary()
    assert (kept["accuracy_rounds"], kept["accuracy_met"]) == (1, False)
    assert kept["accuracy_stopped_because"] == f"round 2 {rounds.UNFINISHED}"
    assert kept["landing_impulse_Ns"] > 0
    assert {"wave", "spring"} <= load_results(Path("out/result.h5")).keys()
    assert not [path for path in Path("out").iterdir() if path.name.startswith(".")]


@pytest.mark.slow
@pytest.mark.usefixtures("scene")
def test_the_time_allowed_ends_the_rounds(capsys: Told) -> None:
    """The first round is finished; the second one is not begun."""
    assert run_command([*RUN, "--max-time", "1 ms"]) == FAILED
    out, err = capsys.readouterr()
    assert summary()["accuracy_rounds"] == 1
    assert re.search(r"the next round would take about \S+ s, 0 s of --max-time are left", out)
    [line] = [line for line in err.splitlines() if line.startswith("round")]
    assert line.startswith("round 1: ")
    assert "the next" not in line
