"""The reports of a study: tables as CSV and pictures, those that are meaningful for its design."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Final

from impact.pictures.drawing import gap_of
from seatfem.study.sweep import charts, effects
from seatfem.study.sweep.table import Columns, StudyTable, write_columns

SCATTERED: Final = 8  # columns of a matrix that can still be read
LEAST: Final = 5  # scenes that a matrix of points is drawn of

Report = tuple[str, Columns | None, Callable[[Path], None]]
"""Its name, its table where it has one of its own, and what draws it."""


def reports_of(table: StudyTable) -> Iterator[Report]:
    """Yield all reports that are meaningful."""
    if main := effects.main_effects(table):
        yield "main_effects", effects.effects_columns(main), partial(charts.draw_effects, table, main)
    if indices := effects.sobol_indices(table):
        columns = effects.indices_columns(table, indices)
        yield "sobol_indices", columns, partial(charts.draw_indices, table, indices)
    if bands := effects.tolerance_bands(table):
        yield "percentiles", effects.bands_columns(bands), partial(charts.draw_bands, table, bands)
    numeric = [name for name in effects.varying(table) if not table.is_text(name)] + effects.varying_measures(table)
    if len(numeric) > 2 and table.has_numbers.sum() >= LEAST:
        yield "scatter", None, partial(charts.draw_scatter, table, numeric[:SCATTERED])
    if best := effects.front(table):
        rows = {name: [column[place] for place in best] for name, column in table.columns.items()}
        yield "pareto", rows, partial(charts.draw_front, table)


def write_reports(table: StudyTable, folder: Path, *, pictures: bool = True) -> tuple[list[Path], list[str]]:
    """Write the reports; return the files, and in words what was not drawn. Raises `OSError` if a CSV fails."""
    files, gaps = [], []
    for name, columns, draw in reports_of(table):
        if columns is not None:
            write_columns(folder / f"{name}.csv", columns)
            files.append(folder / f"{name}.csv")
        if not pictures:
            continue
        if gap := gap_of(draw, folder / f"{name}.png"):
            gaps.append(gap)
        else:
            files.append(folder / f"{name}.png")
    return files, gaps
