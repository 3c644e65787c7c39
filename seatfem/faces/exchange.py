"""`seatfem export`: a scene, or the folder of a run, in the formats of other programs."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from impact import measures
from impact.files.csv_table import write_csv
from impact.greens.base import GreensFunction
from impact.notices import Progress, silent
from impact.storage.hdf5 import load_greens, load_results
from seatfem.faces.report import asked, fragments
from seatfem.faces.terminal import load
from seatfem.pictures.moving import KEPT, SOURCES, load_moving, write_moving
from seatfem.readings import as_number, measured
from seatfem.structures.formats import dxf, uff, writing
from seatfem.structures.rings import as_a_whole
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs import calculix, pictures, rounds, stress_spots
from seatfem.study.runs.pipeline import RESULT_FILE, SUMMARY_FILE, compute_greens
from seatfem.study.scene import Scene, SceneError

BINS: Final = 2000  # frequencies of a receptance
PER_BAND: Final = 1.25  # of it beyond the band of the filter

Written = Iterator[Path | str]
"""Files, and notes of what is left out."""


class ExportError(ValueError):
    """A format that there is not, or one that what is given has nothing for."""


@dataclass(frozen=True)
class Format:
    """A format of other programs.

    Attributes:
        write: writes the folder of a run, or a scene, into a folder: (source, folder, progress).
        takes_scenes: whether a scene (TOML) will do for a source.
    """

    write: Callable[[Path, Path, Progress], Written]
    takes_scenes: bool = False


def export(source: Path, to: str, output: Path | None = None, progress: Progress = silent) -> tuple[Path | str, ...]:
    """Write a scene or the folder of a run as ``to``, one of `FORMATS`, into a folder [that of the run, or the scene's
    name + "-" + the format]; the files written, and notes of what is left out.

    Raises:
        ExportError: no such format; a source that it has nothing for.
        ReportError: a folder that holds no run.
        SceneError, DeckError, ModelError, StorageError, UffError, GreensFunctionError, PictureError: what reading,
            planning and writing them raise.
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
    runs, width = load_results(source / RESULT_FILE), _filter_width(source, summary)
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
    yield write_csv(output / "force.csv", list(columns), zip(*(v.tolist() for v in columns.values()), strict=True))
    if (source / stress_spots.HISTORIES_FILE).is_file():
        time, places = stress_spots.load_histories(source / stress_spots.HISTORIES_FILE)
        heads = ["time [s]", *(f"{name} [Pa]" for name in places)]
        yield write_csv(
            output / "stress.csv", heads, zip(time.tolist(), *(v.tolist() for v in places.values()), strict=True)
        )
    yield write_csv(output / "summary.csv", ["key", "value", "error bar", "spring baseline"], measured(summary))


def _filter_width(source: Path, summary: Mapping[str, object]) -> float:
    """Return the filter's width [s] of a run. Raises `ExportError` of a summary that has none above zero."""
    if (width := as_number(summary.get("filter_width_s"))) is None or width <= 0:
        raise ExportError(f"{source / SUMMARY_FILE}: filter_width_s must be a time above 0 s; run the scene again")
    return width


def _as_uff(source: Path, output: Path, progress: Progress) -> Written:
    modes = source / pictures.MODES_FILE
    if not modes.is_file() or (source / SUMMARY_FILE).is_file():
        greens: GreensFunction = as_a_whole(load_greens(_seat_of(source)))
        highest = PER_BAND / _filter_width(source, fragments.run_summary(source))
        uff.write_receptance_uff(greens, np.linspace(highest / BINS, highest, BINS), output / "receptance.uff")
        yield output / "receptance.uff"
    if not modes.is_file():
        return
    motion = load_moving(modes)
    if motion.frequency is None or motion.modal_mass is None:
        yield f"no modes.uff: {modes} does not know its frequencies; write it again (seatfem modes -o)"
        return
    uff.write_modes_uff(motion.points, motion.displacement, motion.frequency, motion.modal_mass, output / "modes.uff")
    yield output / "modes.uff"


def _as_vtk(source: Path, output: Path, progress: Progress) -> Written:
    names = [name for name in KEPT if (source / name).is_file()]
    if not names:
        remedies = "; ".join(f"{name}: {how}" for name, how in SOURCES.items())
        raise ExportError(f"{source}: holds no motion, none of {', '.join(KEPT)} ({remedies})")
    for name in names:
        path = output / f"{Path(name).stem}_motion.pvd"
        write_moving(load_moving(source / name), path)
        yield path


def _as_calculix(source: Path, output: Path, progress: Progress) -> Written:
    plan = plan_scene(_scene_of(source), progress=progress, folder=source if source.is_dir() else None)
    return calculix.write_calculix(plan, output, progress)


def _as_reduced(source: Path, output: Path, progress: Progress) -> Written:
    if source.is_dir():
        seat = _seat_of(source)
    elif source.suffix.lower() == ".toml":
        seat = output / rounds.SEAT_FILE
        compute_greens(_scene_of(source), seat, progress)
        yield seat
    else:
        seat = source
    yield from writing.write_reduced(load_greens(seat), output)


def _as_dxf(source: Path, output: Path, progress: Progress) -> Written:
    reed = _scene_of(source).reed
    if reed.thin_plate is None:
        raise ExportError(
            f"{source}: reed.kind = {reed.kind!r} has no outline; use a flat one: flapper, sheet, disc, ring_plate"
        )
    dxf.write_outline(reed.thin_plate.geometry().drawn, output / "reed.dxf")
    yield output / "reed.dxf"


FORMATS: Final[Mapping[str, Format]] = {
    "csv": Format(_as_csv),
    "uff": Format(_as_uff),
    "vtk": Format(_as_vtk),
    "calculix": Format(_as_calculix, takes_scenes=True),
    "reduced": Format(_as_reduced, takes_scenes=True),
    "dxf": Format(_as_dxf, takes_scenes=True),
}
"""Formats by their names; the help of the verb, README.md and docs/exchange.md describe each, which a test compares."""


def _scene_of(source: Path) -> Scene:
    """Return the scene of a file, or the one that the folder of a run keeps, with the changes that were made to it."""
    if not source.is_dir():
        return load(source)
    path = source / asked.SCENE_COPY
    if not path.is_file():
        raise ExportError(f"{source}: keeps no {asked.SCENE_COPY}; give the scene itself")
    try:
        return load(path, asked.changes_in(fragments.text_of(path)))
    except SceneError as error:
        raise ExportError(
            f"{error}\n{path} is a copy of the scene that was run and names its files where they were: "
            "put them there, name them anew in it, or export the scene itself"
        ) from None


def _seat_of(folder: Path) -> Path:
    if not (path := folder / rounds.SEAT_FILE).is_file():
        raise ExportError(f"{folder}: holds no {rounds.SEAT_FILE}; give the folder of a run (seatfem run -o)")
    return path
