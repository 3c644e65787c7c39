"""Numerical stability at the extremes: every cell ends right, warned or refused, never silently wrong.

`battery` makes the cells, `run_battery` carries them out in a process of their own and can be resumed, `write_table`
shows the outcomes; `make extremes` (`python -m tests.extremes`) does all of it.
"""

import sys
from pathlib import Path

if (path := str(Path(__file__).parents[2] / "benchmarks")) not in sys.path:
    sys.path.append(path)  # as pytest's pythonpath: random scenes are drawn by benchmarks/drawn_scenes.py

from tests.extremes.battery import battery, subset
from tests.extremes.cell import Cell, Finding, Outcome, carry_out
from tests.extremes.random_scenes import random_cells
from tests.extremes.runner import run_battery
from tests.extremes.table import describe_outcomes, read_table, write_counts, write_table

__all__ = [
    "Cell", "Finding", "Outcome", "battery", "carry_out", "describe_outcomes", "random_cells", "read_table",
    "run_battery", "subset", "write_counts", "write_table",
]  # fmt: skip
