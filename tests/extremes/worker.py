"""The battery's process: answers the name of a cell with its outcome, in JSON. Started by `tests.extremes.runner`."""

from __future__ import annotations

import json
from dataclasses import asdict

from seatfem.jobs.limits import limit_process
from seatfem.jobs.worker import answer_lines
from tests.extremes.battery import battery
from tests.extremes.cell import carry_out

MEMORY_LIMIT = 6 << 30  # bytes of address space beyond what the libraries map


def main() -> None:
    """Carry out cells until the parent ends, or ends this process."""
    cells = {cell.name: cell for cell in battery()}
    limit_process(memory=MEMORY_LIMIT)
    answer_lines(lambda name: json.dumps(asdict(carry_out(cells[name]))))


if __name__ == "__main__":
    main()
