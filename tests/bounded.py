"""Command lines under limits of memory and processor time, each in a process of its own, and what they took.

`python -m tests.bounded JOBS.json` is that process; tests call `run_bounded`.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

GIB: Final = 1 << 30
SECONDS: Final = 10  # of the processor, as the promise is
SHARES: Final = 0.85  # of a limit of memory: one that catches its MemoryError has come as far


@dataclass(frozen=True)
class Outcome:
    """How a command line ended.

    Attributes:
        code: exit code, negative for a signal.
        said: its standard output and error.
        seconds: of the processor, with the processes that it waited for, without the imports.
        peak: largest resident memory of it or of one of those processes, beyond what the imports take [bytes].
    """

    code: int
    said: str
    seconds: float
    peak: int


def run_bounded(
    commands: Sequence[Sequence[str]], folder: Path, *, memory: int = GIB, seconds: int = SECONDS
) -> list[Outcome]:
    """Return how each command line of `seatfem` ended, started in a folder under limits; all share the imports."""
    jobs = folder / "jobs.json"
    jobs.write_text(json.dumps({"commands": [list(words) for words in commands], "memory": memory, "seconds": seconds}))
    root = Path(__file__).parents[1]
    environment = dict(os.environ) | {"PYTHONPATH": str(root)}
    process = subprocess.run(
        [sys.executable, "-m", "tests.bounded", str(jobs)],
        cwd=folder, env=environment, capture_output=True, text=True, check=True, timeout=60 + 60 * len(commands),
    )  # fmt: skip
    return [Outcome(**each) for each in json.loads(process.stdout.splitlines()[-1])]


def assert_refused(outcome: Outcome, *words: str) -> None:
    """Check that the command ended with bad input, within the limits, and says these words."""
    assert outcome.code == 2, (outcome.code, outcome.seconds, outcome.said[-2000:])
    assert "this is a bug" not in outcome.said
    assert "Traceback" not in outcome.said
    joined = " ".join(outcome.said.split())
    for word in words:
        assert word in joined, joined[-2000:]
    assert outcome.peak < SHARES * GIB, outcome.peak


def _main(jobs: Path) -> list[dict[str, object]]:
    given = json.loads(jobs.read_text())
    import h5py  # noqa: F401  what every command takes stands outside of the limits
    import scipy.spatial  # noqa: F401

    import seatfem.faces.cli
    import seatfem.structures.formats.mesh_files
    import seatfem.study.scene
    from seatfem.jobs.processes import limit_process

    out = []
    for number, words in enumerate(given["commands"]):
        said = jobs.with_name(f"said-{number}.txt")
        begun = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        child = os.fork()
        if child == 0:
            code = 70
            with contextlib.suppress(BaseException):
                handle = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
                os.dup2(handle, 1)
                os.dup2(handle, 2)
                limit_process(memory=given["memory"], seconds=given["seconds"])  # a child begins at 0 s
                code = seatfem.faces.cli.run_command(words)
                sys.stdout.flush()
                sys.stderr.flush()
            os._exit(code)
        _, status, used = os.wait4(child, 0)
        out.append(
            {
                "code": os.waitstatus_to_exitcode(status),
                "said": said.read_text(errors="replace"),
                "seconds": used.ru_utime + used.ru_stime,
                "peak": 1024 * max(0, used.ru_maxrss - begun),
            }
        )
    return out


if __name__ == "__main__":
    sys.stdout.write(json.dumps(_main(Path(sys.argv[1]))) + "\n")
