"""Bounds of the processor's time and of memory on what hostile files take, whatever they claim."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import pytest

from seatfem.faces.cli import BAD_INPUT, run_command
from seatfem.machine.resources import forget_peak, peak_memory


@contextmanager
def bounded(seconds: float = 10.0, memory: float = 200e6) -> Iterator[None]:
    """Check that a block takes no more time of the processor [s] and memory [bytes], that of libraries included."""
    start, at_rest = time.process_time(), forget_peak()
    yield
    assert time.process_time() - start < seconds
    assert peak_memory() - at_rest < memory


def assert_refused(arguments: Sequence[str], capfd: pytest.CaptureFixture[str], *words: str) -> None:
    """Check that a command line ends with bad input, within bounds, and says these words."""
    with bounded(memory=900e6):
        assert run_command(list(arguments)) == BAD_INPUT
    message = " ".join(capfd.readouterr().err.split())
    for word in words:
        assert word in message, message[-2000:]
