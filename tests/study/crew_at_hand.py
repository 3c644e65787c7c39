"""Workers' jobs answered in this process, which saves their start."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from seatfem.jobs.desk import Ask
from seatfem.study.sweep import outcome as one


def answer_here(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Gives the jobs, which are listed as they are asked."""
    jobs: list[str] = []

    def ask(given: list[str], limit: float) -> Iterator[tuple[int, str]]:
        for number, job in enumerate(given):
            jobs.append(job)
            yield number, one._reply(job)

    @contextmanager
    def crew(*_: object, **__: object) -> Iterator[Ask]:
        yield ask

    monkeypatch.setattr("seatfem.study.sweep.runner.crew", crew)
    return jobs
