"""The first screen of a run: the valve, what happens, the decision and why, what was left out, numbers asked for."""

import math
import textwrap
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Final

from rich.table import Table

from impact.quantities import in_time
from seatfem.faces.tables import landings_of, landings_tables, lands_tables, result_table
from seatfem.faces.terminal import Console, visible
from seatfem.readings import Summary, as_number
from seatfem.study.answers.decision import Decision, decide, not_modelled, omissions
from seatfem.study.answers.verdict import against_spring, sentences

LINES: Final = 40
COLUMNS: Final = 100
KINDS: Final = (("reed", "reed_kind"), ("seat", "seat_kind"), ("stopper", "stopper_kind"))


def decision_lines(summary: Summary, title: str, decision: Decision) -> Iterator[str]:
    """Yield the lines about the valve, what happens, and the decision with its reasons, at most `COLUMNS` wide."""
    shape = f"{summary['stopper_shape']}, " if summary.get("stopper_shape") else ""
    kinds = (
        f"{body}: {shape if body == 'stopper' else ''}{str(summary[key]).replace('_', ' ')}"
        for body, key in KINDS
        if summary.get(key)
    )
    yield from (*wrapped(title.replace("\n", "\\n")), *wrapped(", ".join(kinds)), *wrapped(decision.happens), "")
    yield f"Decision: {decision.word}"
    for reason in (*decision.reasons, decision.checked):
        yield from wrapped(reason, "- ")


def first_lines(summary: Summary, title: str, notes: Sequence[str], files: Sequence[Path]) -> list[str]:
    """Return at most `LINES` lines of `COLUMNS` columns: the decision, what was left out, the numbers asked for, notes
    and files. What does not fit is counted, and the last line names the option that shows it."""
    decision = decide(summary)
    begin = list(decision_lines(summary, title, decision))
    numbers = ["", *_table_lines(summary), *wrapped(against_spring(summary))]
    end = [*_files_lines(summary, files), "all numbers, notes and files: --full; curves and pictures: seatfem report"]
    room = LINES - len(begin) - len(numbers) - len(end) - 3  # the heading, and a line that counts what does not fit
    effects = [wrapped(each, "- ") for each in decision.left_out]
    left_out = _fitting(effects, room)
    further = [[f"note: {note}"] for note in notes if note not in not_modelled(summary)]
    shown = _fitting(further, room - sum(map(_height, left_out)))
    if omitted := len(effects) + len(further) - len(left_out) - len(shown):
        end = [f"further notes: {omitted} (--full)", *end]
    heading = ["", "Left out:"] if left_out else []
    return [*begin, *heading, *chain(*left_out), *numbers, *chain(*shown), *end]


def all_parts(summary: Summary, title: str) -> Iterator[str | Table]:
    """Yield the lines of the decision, all that was left out, and the tables of all numbers with their sentences."""
    yield from ("", *decision_lines(summary, title, decide(summary)), "", "Left out:")
    yield from (f"- {sentence}" for sentence in omissions(summary))
    yield result_table(summary)
    landings = landings_of(summary)
    if len(landings) > 1:  # else the table above has all
        yield from landings_tables(landings)
    yield from lands_tables(summary)
    yield from filter(None, (against_spring(summary), *sentences(summary)))


def _fitting(blocks: Sequence[list[str]], room: int) -> list[list[str]]:
    """Return those of the ``blocks`` of lines that fit into so many lines, the first ones first."""
    fitting = list[list[str]]()
    for block in blocks:
        if _height(block) <= room:
            room -= _height(block)
            fitting.append(block)
    return fitting


def _height(lines: Sequence[str]) -> int:
    """Return the lines of a terminal of `COLUMNS` columns that lines of any length take."""
    return sum(math.ceil(max(len(line), 1) / COLUMNS) for line in lines)


def _files_lines(summary: Summary, files: Sequence[Path]) -> list[str]:
    """Return where so many files were written, and in what time."""
    if not files:
        return []
    folders, spent = sorted({str(file.parent) for file in files}), as_number(summary.get("wall_time_s"))
    time = "" if spent is None else f" in {in_time(spent)}"
    return wrapped(f"wrote {len(files)} file{'s'[: len(files) > 1]} to {', '.join(folders)}{time}")


def wrapped(text: str, bullet: str = "") -> list[str]:
    """Return a sentence in lines of at most `COLUMNS` columns, below its bullet."""
    return textwrap.wrap(
        visible(text), COLUMNS, initial_indent=bullet, subsequent_indent=" " * len(bullet), break_on_hyphens=False
    )


def _table_lines(summary: Summary) -> list[str]:
    """Return the table of the numbers asked for as lines."""
    narrow = Console(width=COLUMNS, highlight=False, color_system=None)
    with narrow.capture() as captured:
        narrow.print(result_table(summary, short=True))
    return [line.rstrip() for line in captured.get().rstrip().splitlines() if line.strip()]
