"""The results of a study as people read them: a table for the terminal, and one web page that needs no network."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path
from string import Template
from typing import Final

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from impact.files.safe_files import write_whole
from impact.quantities import plain, with_capital
from seatfem.faces.report.figures import part_of_page
from seatfem.faces.report.fragments import html_list, html_table, kept_pictures, versions
from seatfem.faces.report.page import GUARD
from seatfem.readings import BAR
from seatfem.study.sweep.answers import Axis, answer_in_words, axis_of, describe_study, ranges, verdicts
from seatfem.study.sweep.effects import varying
from seatfem.study.sweep.limits import CUT_OFF, FAILED, FAILS, HOLDS, STOPPED, UNDECIDED
from seatfem.study.sweep.maps import SIGNS
from seatfem.study.sweep.table import StudyTable

MOST: Final = 20  # largest number of scenes in a table of the terminal
MOST_OF_PAGE: Final = 500
PAGE: Final = "report.html"
COLOURS: Final = {
    HOLDS: "green", UNDECIDED: "yellow", FAILS: "red", CUT_OFF: "magenta", FAILED: "bold red", STOPPED: "bold red",
}  # fmt: skip


def scenes_table(table: StudyTable, most: int = MOST, *, signs: bool = False) -> Table:
    """Return the scenes of a study, at most so many: varied keys, results with error bars, and how each stands.

    ``signs``: whether the marks of the charts stand before the words.
    """
    shown = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    shown.caption_justify = "left"
    keys = [axis_of(table, name) for name in varying(table) or table.parameters]
    results = [axis_of(table, name) for name in table.measures if not name.startswith(BAR)]
    of_scenes = verdicts(table) or [HOLDS if each == "landed" else each for each in table.standings]
    shown.add_column("scene", justify="right")
    for axis in keys:
        shown.add_column(_head(axis), justify="right")
    shown.add_column("verdict" if verdicts(table) else "landing")
    for axis in results:
        shown.add_column(_head(axis), justify="right")
    for row, verdict in list(enumerate(of_scenes))[:most]:
        words = verdict if verdicts(table) else table.standings[row]
        sign = f"{SIGNS.get(verdict, '')} " if signs else ""
        cells = [str(table.columns["scene"][row]), *(_key(axis, table, row) for axis in keys)]
        numbers = (_result(axis, table, row) for axis in results)
        shown.add_row(*cells, Text(sign + words, COLOURS.get(verdict, "")), *numbers)
    if len(table) > most:
        shown.caption = f"{most} of {len(table)} scenes; all are in study.csv"
    return shown


def _head(axis: Axis) -> str:
    return f"{axis.words}\n[{plain(axis.unit)}]" if axis.unit else axis.words


def _key(axis: Axis, table: StudyTable, row: int) -> str:
    value = table.columns[axis.name][row]
    return f"{value:.6g}" if isinstance(value, int | float) else str(value)


def _result(axis: Axis, table: StudyTable, row: int) -> str:
    """Return a result with its error bar; "-" for a scene that does not count for it."""
    if not table.counted(axis.name)[row] or not np.isfinite(value := table.numbers(axis.name)[row]):
        return "-"
    has_bars = BAR + axis.name in table.columns
    return axis.text(float(value), float(table.numbers(BAR + axis.name)[row]) if has_bars else None)


def write_page(table: StudyTable, folder: Path, notes: Sequence[str]) -> Path:
    """Write the page of a study, with the pictures in its folder, and return its path.

    All text of the study is escaped. Raises `OutputError`, `OSError` if it cannot be written.
    """
    answer, *where = answer_in_words(table) or [""]
    sections = {
        "Where the limits hold": html_list(where),
        "Scenes": html_table(scenes_table(table, MOST_OF_PAGE, signs=True)),
        "In numbers": html_list((*ranges(table), *table.empty_in_words(), *table.failures())),
        "Pictures": kept_pictures(folder),
        "Notes": html_list(notes),
    }
    content = "".join(f"<section><h2>{name}</h2>{inner}</section>" for name, inner in sections.items() if inner)
    page = Template(part_of_page("page.html")).substitute(
        dict.fromkeys(("plotly", "body_parts", "body", "links"), ""),
        style=part_of_page("style.css"),
        guard=GUARD,
        title=html.escape(table.study.heading),
        first=f"<p>{html.escape(f'{with_capital(answer)}.' if answer else describe_study(table)[0])}</p>",
        content=content,
        versions=versions(),
    )
    write_whole(folder / PAGE, page.encode("utf-8"))
    return folder / PAGE
