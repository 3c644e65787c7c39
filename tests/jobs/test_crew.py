"""Workers that answer jobs: those that hang, fail or die are lost alone, and others take their place."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import pytest

from seatfem.jobs.crew import Lost, crew

ROOT = Path(__file__).parents[2]
ANSWERS = "tests.jobs.answers:reply"
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


@pytest.mark.slow
def test_jobs_are_answered_in_other_processes() -> None:
    """Two other processes of one thread each answer every job of several batches once."""
    with crew(ANSWERS, workers=2) as ask:
        batches = [[f"slow {batch} {k}" for k in range(3)] for batch in range(2)]
        answers = [answer for jobs in batches for _, answer in sorted(ask(jobs, 60.0))]
    parts = [str(answer).split(", ") for answer in answers]
    assert [job for job, _, _ in parts] == [*batches[0], *batches[1]]
    assert {threads for _, _, threads in parts} == {"1"}
    pids = {pid for _, pid, _ in parts}
    assert len(pids) == 2
    assert str(os.getpid()) not in pids


@pytest.mark.slow
def test_what_is_lost_costs_itself_alone() -> None:
    """A lost job has its reason, the end of its log and its time; jobs before and after it are answered."""
    with crew(ANSWERS) as ask:
        answers = dict(ask(["a", "die", "fail", "b", "hang", "c"], 1.5))
    lost = {number: answer for number, answer in answers.items() if isinstance(answer, Lost)}
    assert sorted(lost) == [1, 2, 4]
    assert lost[1].in_words() == "the process died (signal SIGKILL): at die"
    assert lost[2].in_words() == "the process died (exit code 1): KeyError: 'no such thing'"
    assert [each.hung for each in lost.values()] == [False, False, True]
    assert lost[4].log.splitlines()[-1] == "at hang"
    assert 1.5 <= lost[4].seconds < 10.0
    pids = [str(answers[number]).split(", ")[1] for number in (0, 3, 5)]
    assert len(set(pids)) == 3


@pytest.mark.slow
def test_whoever_stops_asking_ends_what_has_begun() -> None:
    """Jobs are taken as there are workers for them; the crew is there for others."""
    taken = count()

    def jobs() -> Iterator[str]:
        for job in ("a", "hang", "b"):
            next(taken)
            yield job

    begun = time.monotonic()
    with crew(ANSWERS) as ask:
        answers = ask(jobs(), 60.0)
        next(answers)
        assert next(taken) == 1
        answers.close()
        [(_, answer)] = ask(["c"], 60.0)
    assert str(answer).startswith("c, ")
    assert time.monotonic() - begun < 30


@pytest.mark.slow
def test_workers_that_cannot_be_started_are_told_for_each_job() -> None:
    with crew("tests.jobs.no_such_module:reply", workers=2) as ask:
        answers = dict(ask(["a", "b", "c"], 60.0))
    words = "the process died (exit code 1): ModuleNotFoundError: No module named 'tests.jobs.no_such_module'"
    assert [answer.in_words() for _, answer in sorted(answers.items()) if isinstance(answer, Lost)] == [words] * 3


@pytest.mark.slow
def test_what_workers_leave_is_removed() -> None:
    with crew(ANSWERS) as ask:
        [(_, folder)] = ask(["litter"], 60.0)
        assert Path(str(folder)).is_dir()
    assert not Path(str(folder)).exists()


@pytest.mark.slow
def test_workers_neither_run_the_script_again_nor_take_modules_beside_it(tmp_path: Path) -> None:
    """A script without a guard beside foreign modules runs once, and its workers take none of them."""
    for name in ("pebble", "runpy", "psutil"):
        (tmp_path / f"{name}.py").write_text("import pathlib; pathlib.Path('ran').touch(); raise SystemExit(7)")
    script = f"from seatfem.jobs.crew import crew\nwith crew({ANSWERS!r}) as ask: print(*ask(['a'], 60.0))\n"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(["", str(ROOT)])}
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("(0, 'a, ")
    assert done.stdout.count("\n") == 1
    assert not (tmp_path / "ran").exists()
