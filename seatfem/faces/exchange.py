"""The verb `seatfem export`: a scene, or the folder of a run, in the formats of other programs.

A new format is a function and its row in `FORMATS`, whose words appear in the help of the verb. The modules that a
format needs are reached through the lazy names of their rooms, so that the help loads none of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import impact
from impact.files import csv_table
from impact.notices import Progress, SeatfemError, silent
from seatfem import readings
from seatfem.faces.report import asked, fragments
from seatfem.faces.terminal import load
from seatfem.pictures import moving
from seatfem.structures import rings
from seatfem.structures.formats import dxf, uff, writing
from seatfem.study import scene
from seatfem.study.runs import calculix_contact, forecast, pictures, pipeline, rounds, stress_spots
from seatfem.study.scene import models

BINS: Final = 2000  # number of frequencies of a receptance
PER_BAND: Final = 1.25  # highest frequency of a receptance over the band of the filter

Written = Iterator["Path | str"]
"""Files that were written, and notes on what was omitted."""


class ExportError(SeatfemError, ValueError):
    """Error of an unknown format, or of a source that lacks the data of a format."""


@dataclass(frozen=True)
class Format:
    """A format of another program.

    Attributes:
        words: description of its files in the help of the verb.
        write: function (source, folder, progress) that writes the folder of a run, or a scene, into a folder.
        takes_scenes: whether the source may be a scene (TOML).
    """

    words: str
    write: Callable[[Path, Path, Progress], Written]
    takes_scenes: bool = False


def export(source: Path, to: str, output: Path | None = None, progress: Progress = silent) -> tuple[Path | str, ...]:
    """Write a scene or the folder of a run in the format ``to``, one of `FORMATS`, into a folder [that of the run, or
    the scene's name + "-" + the format]; return the files written, and notes on what was omitted.

    Raises:
        ExportError: an unknown format; a source that lacks its data.
        ReportError: a folder that contains no run.
        SceneError, ModelError, StorageError, UffError, GreensFunctionError, PictureError: errors of reading, planning
            and writing.
    """
    if to not in FORMATS:
        raise ExportError(f"--to: {to!r} is none of {', '.join(FORMATS)}")
    if not source.is_dir() and not FORMATS[to].takes_scenes:
        raise ExportError(f"{source}: --to {to} takes the folder of a run; give one (seatfem run -o)")
    if not source.exists():
        raise ExportError(f"{source}: no such file or folder; give a scene (TOML) or the folder of a run")
    folder = output or (source if source.is_dir() else Path(f"{source.stem}-{to}"))
    folder.mkdir(parents=True, exist_ok=True)
    return tuple(FORMATS[to].write(source, folder, progress))


def _as_csv(source: Path, output: Path, progress: Progress) -> Written:
    summary = fragments.run_summary(source)
    results, width = impact.load_results(source / pipeline.RESULT_FILE), _filter_width(source, summary)
    ends = results["wave"].rows.merge_ends(results["spring"].rows)
    columns = {"time [s]": results["wave"].dt * ends}
    for name, words in (("wave", ""), ("spring", "spring ")):
        run, rows = results[name], results[name].rows
        columns |= {
            f"{words}force [N]": rows.find_forces(rows.force, ends),
            f"{words}force, mean over {1e6 * width:g} us [N]": impact.measures.filtered_force(run, width)[ends],
            f"{words}gap [m]": rows.find_motions(rows.gap, ends),
            f"{words}striker displacement [m]": rows.find_motions(rows.make_displacement("striker"), ends),
            f"{words}seat displacement [m]": rows.find_motions(rows.make_displacement("target"), ends),
        }
    yield csv_table.write_csv(
        output / "force.csv", list(columns), zip(*(v.tolist() for v in columns.values()), strict=True)
    )
    if (source / stress_spots.HISTORIES_FILE).is_file():
        time, places = stress_spots.load_histories(source / stress_spots.HISTORIES_FILE)
        heads = ["time [s]", *(f"{name} [Pa]" for name in places)]
        yield csv_table.write_csv(
            output / "stress.csv", heads, zip(time.tolist(), *(v.tolist() for v in places.values()), strict=True)
        )
    yield csv_table.write_csv(
        output / "summary.csv",
        ["key", "value", "error bar", "spring baseline"],
        ((each.key, each.value, each.bar, each.spring) for each in readings.all_measured(summary)),
    )


def _filter_width(source: Path, summary: Mapping[str, object]) -> float:
    """Return the filter's width [s] of a run. Raises `ExportError` if the summary has none above zero."""
    if (width := readings.as_number(summary.get("filter_width_s"))) is None or width <= 0:
        raise ExportError(
            f"{source / pipeline.SUMMARY_FILE}: filter_width_s must be a time above 0 s; run the scene again"
        )
    return width


def _as_uff(source: Path, output: Path, progress: Progress) -> Written:
    modes = source / pictures.MODES_FILE
    if not modes.is_file() or (source / pipeline.SUMMARY_FILE).is_file():
        greens = rings.join_all_parts(impact.load_greens(_seat_of(source)))
        highest = PER_BAND / _filter_width(source, fragments.run_summary(source))
        frequencies = [highest * number / BINS for number in range(1, BINS + 1)]
        uff.write_receptance_uff(greens, frequencies, output / "receptance.uff")
        yield output / "receptance.uff"
    if not modes.is_file():
        return
    motion = moving.load_moving(modes)
    if motion.frequency is None or motion.modal_mass is None:
        yield f"no modes.uff: {modes} does not know its frequencies; write it again (seatfem modes -o)"
        return
    uff.write_modes_uff(motion.points, motion.displacement, motion.frequency, motion.modal_mass, output / "modes.uff")
    yield output / "modes.uff"


def _as_vtk(source: Path, output: Path, progress: Progress) -> Written:
    names = [name for name in moving.KEPT if (source / name).is_file()]
    if not names:
        remedies = "; ".join(f"{name}: {how}" for name, how in moving.SOURCES.items())
        raise ExportError(f"{source}: holds no motion, none of {', '.join(moving.KEPT)} ({remedies})")
    for name in names:
        path = output / f"{Path(name).stem}_motion.pvd"
        moving.write_moving(moving.load_moving(source / name), path)
        yield path


def _as_calculix(source: Path, output: Path, progress: Progress) -> Written:
    plan = forecast.converge(_scene_of(source), progress=progress).plan
    return calculix_contact.write_calculix(plan, output, progress)


def _as_reduced(source: Path, output: Path, progress: Progress) -> Written:
    if source.is_dir():
        seat = _seat_of(source)
    elif source.suffix.lower() == ".toml":
        seat = output / rounds.SEAT_FILE
        pipeline.compute_greens(_scene_of(source), seat, progress)
        yield seat
    else:
        seat = source
    yield from writing.write_reduced(impact.load_greens(seat), output)


def _as_dxf(source: Path, output: Path, progress: Progress) -> Written:
    reed = _scene_of(source).reed
    if not (loops := reed.outline_loops()):
        raise ExportError(
            f"{source}: reed.kind = {reed.kind!r} has no outline; use a flat one: flapper, sheet, disc, ring_plate"
        )
    dxf.write_outline(loops, output / "reed.dxf")
    yield output / "reed.dxf"


FORMATS: Final[Mapping[str, Format]] = {
    "csv": Format("force.csv and summary.csv for spreadsheets", _as_csv),
    "uff": Format("the seat's receptance (universal file, dataset 58) and modes (55)", _as_uff),
    "vtk": Format("modes, stress waves and landings for ParaView", _as_vtk),
    "calculix": Format("decks for ccx on the seat's mesh, our answers beside them", _as_calculix, takes_scenes=True),
    "reduced": Format("the seat's M, C, K and state space, .npz, .mat and .mtx", _as_reduced, takes_scenes=True),
    "dxf": Format("the reed's outline", _as_dxf, takes_scenes=True),
}
"""Formats by name; a test checks that README.md and docs/exchange.md name each of them."""


def _scene_of(source: Path) -> models.Scene:
    """Return the scene of a file, or the copy in the folder of a run with the --set changes of that run."""
    if not source.is_dir():
        return load(source)
    path = source / asked.SCENE_COPY
    if not path.is_file():
        raise ExportError(f"{source}: keeps no {asked.SCENE_COPY}; give the scene itself")
    try:
        return load(path, asked.changes_in(fragments.text_of(path)))
    except scene.SceneError as error:
        raise ExportError(
            f"{error}\n{path} is a copy of the scene that was run and names its files where they were: "
            "put them there, name them anew in it, or export the scene itself"
        ) from None


def _seat_of(folder: Path) -> Path:
    if not (path := folder / rounds.SEAT_FILE).is_file():
        raise ExportError(f"{folder}: holds no {rounds.SEAT_FILE}; give the folder of a run (seatfem run -o)")
    return path
