"""What tests of studies share."""

from importlib import import_module

import pytest


@pytest.fixture
def jobs(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Let this process answer the jobs of workers, which are listed as they are asked; studies may be removed."""
    crew = import_module("tests.study.crew_at_hand")
    answered: list[str] = crew.answer_here(monkeypatch)
    return answered
