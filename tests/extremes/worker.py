"""The battery's process: answers the name of a cell with its outcome, in JSON. Started by `tests.extremes.runner`."""

import json
import os
from dataclasses import asdict

from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import limit_process
from seatfem.jobs.worker import answer_lines
from seatfem.structures.cache import VARIABLE
from tests.extremes.battery import battery
from tests.extremes.cell import carry_out
from tests.extremes.mixed import random_cells

MOST_RANDOM = 2000  # random scenes, of the long form
MEMORY_LIMIT = 6 << 30  # bytes of address space beyond what the libraries map


def main() -> None:
    """Carry out cells until the parent ends, or ends this process; bodies are stored for this process alone."""
    cells = {cell.name: cell for cell in (*battery(), *random_cells(MOST_RANDOM))}
    limit_process(memory=MEMORY_LIMIT)
    with private_folder("extremes-store") as folder:
        os.environ[VARIABLE] = str(folder)
        answer_lines(lambda name: json.dumps(asdict(carry_out(cells[name]))))


if __name__ == "__main__":
    main()
