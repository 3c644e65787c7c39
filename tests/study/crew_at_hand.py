"""Workers' jobs answered in this process, which saves their start; by runs, or by a function of what is changed."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from seatfem.jobs.crew import Ask
from seatfem.study.sweep import runner as one
from seatfem.study.sweep.side_by_side import reply


def answer_here(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Let this process answer; return the jobs, which are listed as they are asked."""
    jobs: list[str] = []

    def ask(given: list[str], limit: float) -> Iterator[tuple[int, str]]:
        for number, job in enumerate(given):
            jobs.append(job)
            yield number, reply(job)

    @contextmanager
    def crew(*_: object, **__: object) -> Iterator[Ask]:
        yield ask

    monkeypatch.setattr("seatfem.study.sweep.runner.crew", crew)
    return jobs


Answer = Callable[[dict[str, object]], dict[str, object] | one.Outcome]


def answer_by(monkeypatch: pytest.MonkeyPatch, answer: Answer) -> None:
    """Let a function of the changed keys give the summary of each scene, or its whole outcome."""

    def carried_out(path: object, changed: dict[str, object], *_: object, **__: object) -> one.Outcome:
        outcome = answer(changed)
        return outcome if isinstance(outcome, one.Outcome) else one.Outcome("done", "", 0.0, outcome)

    monkeypatch.setattr(one, "_carried_out", carried_out)


def amount(value: object) -> float:
    """Return the number of a quantity, without its unit."""
    return float(str(value).split()[0])
