"""Command lines under limits of memory and processor time, each in a process of its own, and what they took.

`python -m tests.bounded JSON` is that process; tests call `run_bounded`.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

GIB: Final = 1 << 30
SECONDS: Final = 10  # of the processor, as the promise is
SHARES: Final = 0.85  # of a limit of memory: one that catches its MemoryError has come as far


class Outcome(NamedTuple):
    """How a command line ended: its exit code, negative for a signal, and its standard output and error; seconds of the
    processor, and the largest memory beyond that of imports [bytes], those of processes that it waited for too."""

    code: int
    said: str
    seconds: float
    peak: int


def run_bounded(
    commands: Sequence[Sequence[str]], folder: Path, *, memory: int = GIB, seconds: int = SECONDS
) -> list[Outcome]:
    """Return how each command line of `seatfem` ended, started in a folder under limits; all share the imports."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.bounded", json.dumps([list(map(list, commands)), memory, seconds])],
        cwd=folder, env=dict(os.environ) | {"PYTHONPATH": str(Path(__file__).parents[1])},
        capture_output=True, text=True, check=True, timeout=60 + 60 * len(commands),
    )  # fmt: skip
    return [Outcome(*each) for each in json.loads(done.stdout.splitlines()[-1])]


def assert_refused(outcome: Outcome, *words: str) -> None:
    """Assert that the command ended with bad input, within the limits, and says these words."""
    assert outcome.code == 2, (outcome.code, outcome.seconds, outcome.said[-2000:])
    joined = " ".join(outcome.said.split())
    assert not any(word in joined for word in ("this is a bug", "Traceback"))
    for word in words:
        assert word in joined, joined[-2000:]
    assert outcome.peak < SHARES * GIB, outcome.peak


def _main(commands: list[list[str]], memory: int, seconds: int) -> list[Outcome]:
    import h5py  # noqa: F401  what every command takes stands outside of the limits
    import scipy.spatial  # noqa: F401

    import seatfem.faces.cli
    import seatfem.structures.formats.mesh_files
    import seatfem.study.scene
    from seatfem.jobs.processes import limit_process

    out = []
    for number, words in enumerate(commands):
        said, begun = Path(f"said-{number}.txt"), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        child = os.fork()
        if child == 0:
            code = 70
            with contextlib.suppress(BaseException):
                handle = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
                os.dup2(handle, 1)
                os.dup2(handle, 2)
                limit_process(memory=memory, seconds=seconds)  # a child begins at 0 s
                code = seatfem.faces.cli.run_command(words)
                sys.stdout.flush()
                sys.stderr.flush()
            os._exit(code)
        _, status, used = os.wait4(child, 0)
        code, peak = os.waitstatus_to_exitcode(status), 1024 * max(0, used.ru_maxrss - begun)
        out.append(Outcome(code, said.read_text(errors="replace"), used.ru_utime + used.ru_stime, peak))
    return out


if __name__ == "__main__":
    sys.stdout.write(json.dumps(_main(*json.loads(sys.argv[1]))) + "\n")
