"""What tests of studies share."""

import pytest

from tests.study.crew_at_hand import answer_here


@pytest.fixture
def jobs(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Let this process answer the jobs of workers, which are listed as they are asked."""
    return answer_here(monkeypatch)
