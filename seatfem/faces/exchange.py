"""`seatfem export`: the results of a run in the formats of other programs."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from impact import measures
from impact.files.atomic import whole_file
from impact.greens.base import GreensFunction
from impact.storage.hdf5 import load_greens, load_results
from seatfem.faces.report.folder import run_summary
from seatfem.structures.formats.uff_writing import write_receptance_uff
from seatfem.structures.rings import as_a_whole
from seatfem.study.runs.outcome import measured
from seatfem.study.runs.pipeline import RESULT_FILE
from seatfem.study.runs.rounds import SEAT_FILE
from seatfem.study.runs.stress_spots import HISTORIES_FILE, load_histories

BINS: Final = 2000  # frequencies of a receptance
PER_BAND: Final = 1.25  # of it beyond the band of the filter


class ExportError(ValueError):
    """A format that there is not."""


def export(folder: Path, to: str, output: Path) -> tuple[Path, ...]:
    """Write the run in ``folder`` as ``to`` ("csv" or "uff") into the folder ``output``; the files written.

    - csv: force.csv, time histories of seat and spring baseline; stress.csv, of stress at the hot spots, where it is
      known; summary.csv, a measure a row with its error bar.
    - uff: receptance.uff, dataset 58, of the struck patch up to 1.25/filter_width.

    Raises:
        ExportError: no such format.
        ReportError: ``folder`` holds no run.
        StorageError, UffError, GreensFunctionError: what reading and writing them raise.
    """
    if to not in FORMATS:
        raise ExportError(f"--to: {to!r} is none of {', '.join(FORMATS)}")
    summary = run_summary(folder)
    output.mkdir(parents=True, exist_ok=True)
    return tuple(FORMATS[to](folder, summary, output))


def _as_csv(folder: Path, summary: Mapping[str, Any], output: Path) -> Iterator[Path]:
    runs, width = load_results(folder / RESULT_FILE), float(summary["filter_width_s"])
    columns = {"time [s]": runs["wave"].time}
    for name, words in (("wave", ""), ("spring", "spring ")):
        run = runs[name]
        columns |= {
            f"{words}force [N]": run.force,
            f"{words}force, mean over {1e6 * width:g} us [N]": measures.filtered_force(run, width),
            f"{words}gap [m]": run.gap,
            f"{words}striker displacement [m]": run.striker_displacement,
            f"{words}seat displacement [m]": run.target_displacement,
        }
    yield _table(output / "force.csv", list(columns), zip(*(v.tolist() for v in columns.values()), strict=True))
    if (folder / HISTORIES_FILE).is_file():
        time, places = load_histories(folder / HISTORIES_FILE)
        heads = ["time [s]", *(f"{name} [Pa]" for name in places)]
        yield _table(
            output / "stress.csv", heads, zip(time.tolist(), *(v.tolist() for v in places.values()), strict=True)
        )
    yield _table(output / "summary.csv", ["key", "value", "error bar", "spring baseline"], measured(summary))


def _as_uff(folder: Path, summary: Mapping[str, Any], output: Path) -> Iterator[Path]:
    greens: GreensFunction = as_a_whole(load_greens(folder / SEAT_FILE))
    highest = PER_BAND / float(summary["filter_width_s"])
    path = output / "receptance.uff"
    write_receptance_uff(greens, np.linspace(highest / BINS, highest, BINS), path)
    yield path


FORMATS: Final[Mapping[str, Callable[[Path, Mapping[str, Any], Path], Iterator[Path]]]] = {
    "csv": _as_csv,
    "uff": _as_uff,
}


def _table(path: Path, heads: list[str], rows: Any) -> Path:
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(heads)
        writer.writerows(rows)
    return path
