"""Time to `import impact`, beside the libraries it is built on."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from time import perf_counter

from table import Table, publish

CASES = ("import numpy, numba, h5py", "import impact")
RUNS = 21


def main() -> None:
    """Medians of interleaved runs in fresh interpreters, all with their byte code kept."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
        environment["PYTHONPYCACHEPREFIX"] = folder
        times: dict[str, list[float]] = {code: [] for code in CASES}
        for run in range(RUNS + 1):
            for code in CASES:
                start = perf_counter()
                subprocess.run([sys.executable, "-c", code], env=environment, check=True)
                if run:  # the first fills the cache
                    times[code].append(perf_counter() - start)
    median = {code: statistics.median(values) for code, values in times.items()}
    ratio = median[CASES[1]] / median[CASES[0]]
    rows = [(f"`{code}`", f"{seconds:.3f}") for code, seconds in median.items()]
    notes = (
        f"Medians of {RUNS} interleaved runs, start of the interpreter included.",
        f"`impact` takes {ratio:.2f} times the libraries alone (aim: at most 1.3).",
    )
    publish("imports", Table("Import", notes, ("code", "seconds"), tuple(rows)))


if __name__ == "__main__":
    main()
