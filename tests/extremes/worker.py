"""The battery's worker: answers the name of a cell with its outcome, in JSON. Started by `tests.extremes.runner`."""

import json
import os
import tempfile
from dataclasses import asdict
from functools import cache

from seatfem.jobs.processes import limit_process
from seatfem.structures.cache import VARIABLE
from tests.extremes.battery import battery
from tests.extremes.cell import Cell, carry_out
from tests.extremes.random_scenes import random_cells

MOST_RANDOM = 1000  # random scenes, of the long form
MEMORY_LIMIT = 6 << 30  # bytes of address space beyond what the libraries map


def reply(name: str) -> str:
    return json.dumps(asdict(carry_out(_cells()[name])))


@cache
def _cells() -> dict[str, Cell]:
    """Make the cells of this process once; it stores bodies for itself alone."""
    cells = {cell.name: cell for cell in (*battery(), *random_cells(MOST_RANDOM))}
    limit_process(memory=MEMORY_LIMIT)
    os.environ[VARIABLE] = tempfile.mkdtemp()  # removed with the crew's folder
    return cells
