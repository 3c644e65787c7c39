"""Numerical stability at the extremes: every cell ends right, warned or refused, never silently wrong.

`battery` makes the cells, `run_battery` carries them out in a process of their own and can be resumed, `write_table`
and `draw_map` show the outcomes; `seatfem verify --extremes` does all of it.
"""

from seatfem.extremes.battery import battery, subset
from seatfem.extremes.cell import Cell, Finding, Outcome, carry_out
from seatfem.extremes.picture import draw_map
from seatfem.extremes.runner import run_battery
from seatfem.extremes.table import in_words, write_table

__all__ = [
    "Cell",
    "Finding",
    "Outcome",
    "battery",
    "carry_out",
    "draw_map",
    "in_words",
    "run_battery",
    "subset",
    "write_table",
]
