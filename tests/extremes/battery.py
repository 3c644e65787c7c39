"""The whole battery, and seeded parts of it."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from tests.extremes.bodies import body_cells
from tests.extremes.cell import Cell
from tests.extremes.encounters import bouncing_cells, encounter_cells
from tests.extremes.lasting_axes import lasting_cells
from tests.extremes.lips_axes import lip_cells
from tests.extremes.marching import marching_cells
from tests.extremes.moved_axes import moved_cells
from tests.extremes.plates_axes import plate_cells
from tests.extremes.random_scenes import random_cells
from tests.extremes.records import record_cells
from tests.extremes.scene_files import scene_file_cells
from tests.extremes.solids import solid_cells

# To add an axis: a function that returns cells, here. Making the cells is cheap; only their checks work.
PROVIDERS: tuple[Callable[[], tuple[Cell, ...]], ...] = (
    marching_cells, encounter_cells, bouncing_cells, body_cells, record_cells, solid_cells,
)  # fmt: skip
OF_SCENE_FILES: tuple[Callable[[], tuple[Cell, ...]], ...] = (
    scene_file_cells, plate_cells, lip_cells, moved_cells, lasting_cells, random_cells,
)  # fmt: skip
"""The same of cells that run whole scene files."""


@cache
def battery() -> tuple[Cell, ...]:
    """Return all cells."""
    marches = (cell for provider in PROVIDERS for cell in provider())
    files = (replace(cell, of_scene_file=True) for provider in OF_SCENE_FILES for cell in provider())
    return (*marches, *files)


def subset(cells: Sequence[Cell], size: int, *, seed: int) -> tuple[Cell, ...]:
    """Draw ``size`` cells, in the order given; all if there are fewer."""
    chosen = np.random.default_rng(seed).permutation(len(cells))[:size]
    return tuple(cells[i] for i in np.sort(chosen))
