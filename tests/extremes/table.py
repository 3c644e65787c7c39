"""The outcomes as a table (CSV) and in words."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from impact.files.atomic import whole_file
from tests.extremes.cell import Cell, Outcome, Verdict

VERDICTS: tuple[Verdict, ...] = ("right", "advised", "warned", "refused", "wrong")


def write_table(cells: Sequence[Cell], outcomes: Mapping[str, Outcome], path: Path) -> None:
    """One line per cell: axis, value, verdict, error, stated, seconds, reason."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("axis", "value", "verdict", "error", "stated", "seconds", "reason"))
    for cell in cells:
        if (o := outcomes.get(cell.name)) is not None:
            numbers = (f"{o.error:.2e}", f"{o.stated:.2e}", f"{o.seconds:.2g}")
            writer.writerow((cell.axis, cell.value, o.verdict, *numbers, " ".join(o.reason.split())))
    with whole_file(path) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8")


def in_words(outcomes: Mapping[str, Outcome]) -> str:
    """How many ended how, and every wrong one."""
    counts = Counter(o.verdict for o in outcomes.values())
    head = f"{len(outcomes)} cells: " + ", ".join(f"{counts[v]} {v}" for v in VERDICTS)
    wrong = [
        f"wrong: {name}: error {o.error:.2e}, stated {o.stated:.2e}; {o.reason}"
        for name, o in outcomes.items()
        if o.verdict == "wrong"
    ]
    return "\n".join([head, *wrong])
