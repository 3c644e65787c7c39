"""Plugin of pytest that records what each test executes of the product, and how long that takes.

Each process leaves a coverage file with the tests as contexts, and of each test its processor time and if it is slow.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import coverage
import pytest

FOLDER: Final = Path(os.environ["MUTATIONS_FOLDER"])
PACKAGES: Final = ["impact", "seatfem"]


class Recorder:
    """One process's record."""

    def __init__(self) -> None:
        self.coverage = coverage.Coverage(
            data_file=str(FOLDER / f"coverage.{os.getpid()}"), source=PACKAGES, config_file=False
        )
        self.tests: dict[str, tuple[float, bool]] = {}
        self.coverage.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self.coverage.switch_context(item.nodeid)
        begin = time.process_time()
        result = yield
        self.tests[item.nodeid] = time.process_time() - begin, item.get_closest_marker("slow") is not None
        self.coverage.switch_context("")
        return result

    def pytest_sessionfinish(self) -> None:
        self.coverage.stop()
        self.coverage.save()
        (FOLDER / f"tests.{os.getpid()}.json").write_text(json.dumps(self.tests), encoding="utf-8")


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Recorder(), "recorder of executed lines")
