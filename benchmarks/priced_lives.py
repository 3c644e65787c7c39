"""Life and stress at a price: processor time of whole runs with [stress] and [life], over that of the bare imports in
the same minute, first with an empty store and again with what the first run has left in it.

Each run is a process of its own without pictures, with warm caches of compiled code and one thread of linear algebra;
those of an earlier commit take turns with those of the present one.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

from table import Table, timed
from whole_runs import ONE_THREAD, ROOT, checked_out

from seatfem.structures.cache import VARIABLE

BEFORE: Final = "19031005"
"""The last commit that recovers the stress of a seat anew in each run."""
BARE: Final = ("-c", "import numpy, scipy.linalg, h5py, numba, pydantic")
SCENES: Final = (  # name, file, goals of the first run and of one again, over the bare imports
    ("suction flapper on a plate of 20,000 unknowns", "life_on_a_plate_20.toml", "24", "9"),
    ("the same on 137,000 unknowns", "life_on_a_plate_137.toml", "91", "30"),
)
NOTES: Final = (
    "Whole runs of one round with [stress] and [life], without pictures, one thread: processor time over that of the",
    f"imports of numpy, scipy.linalg, h5py, numba and pydantic in the same minute; before: commit {BEFORE}.",
)
COLUMNS: Final = ("scene", "first", "goal", "before", "again", "goal", "before")


def run_over_imports(program: Path, scene: str, store: Path) -> float:
    """Return the processor time of a run by the ``program`` in a folder, over that of the bare imports."""
    env = {**os.environ, **ONE_THREAD, "NUMBA_NUM_THREADS": "1", VARIABLE: str(store), "PYTHONPATH": str(program)}

    def whole(*arguments: str) -> float:
        command = [sys.executable, *arguments]
        return timed(lambda: subprocess.run(command, cwd=store.parent, env=env, capture_output=True, check=False))[1]

    file = str(ROOT / "benchmarks" / "long_scenes" / scene)
    bare = min(whole(*BARE) for _ in range(2))
    seconds = whole("-m", "seatfem", "run", file, "--no-pictures", "--rounds", "1", "--output", str(store / "out"))
    return seconds / min(bare, whole(*BARE))


def priced_lives_table() -> Table:
    """Return the price of each scene, first and again, now and before."""
    rows = []
    with checked_out(BEFORE) as before:
        for name, scene, of_first, of_again in SCENES:
            found: dict[str, list[str]] = {}
            for way, program in (("before", before), ("now", ROOT)):
                with tempfile.TemporaryDirectory() as folder:
                    store = Path(folder) / "store"
                    store.mkdir()
                    found[way] = [f"{run_over_imports(program, scene, store):.3g}" for _ in range(2)]
            (first, again), (first_before, again_before) = found["now"], found["before"]
            rows.append((name, first, of_first, first_before, again, of_again, again_before))
            print(*rows[-1], sep=" | ", flush=True)  # noqa: T201
    return Table("Life and stress at a price", NOTES, COLUMNS, tuple(rows))
