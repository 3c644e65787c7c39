"""The program `seatfem`: one verb per thing to do. Exit code 0: done, 1: failed or missed its target, 2: bad input."""

from __future__ import annotations

import math
import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from importlib import resources
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

from cyclopts import App, CycloptsError, Parameter

from seatfem.faces.terminal import Console
from seatfem.jobs.folders import sweep
from seatfem.jobs.signals import ended_by_signals, exit_code

if TYPE_CHECKING:
    from impact.progress import Progress
    from seatfem.study.runs.pipeline import RunOutcome
    from seatfem.study.scene import Scene

# Verbs import what they run: `seatfem --help` must not wait for compilers and finite elements.

DONE: Final = 0
FAILED: Final = 1
BAD_INPUT: Final = 2
INTERRUPTED: Final = 130
WIDEST: Final = 1000  # characters of a line of a message
MOST_LINES: Final = 40
DEMO_SCENE: Final = "flapper_on_peek_sleeve.toml"

app = App(
    name="seatfem",
    help="Impact of flexible reeds on elastic valve seats.",
    help_epilogue="Exit code 0: done; 1: the run failed or missed its target; 2: bad input; 128 + n: signal n.",
    result_action="return_value",
    suppress_keyboard_interrupt=False,
    exit_on_error=False,
    console=Console(),
    error_console=Console(stderr=True),
    help_format="plaintext",
)


@Parameter(name="*")
@dataclass(frozen=True)
class Common:
    """What every verb understands."""

    quiet: Annotated[bool, Parameter(negative="", help="Print nothing but errors.")] = False
    debug: Annotated[bool, Parameter(negative="", help="Show the traceback of an error.")] = False


COMMON: Final = Common()
Output = Annotated[Path | None, Parameter(name=["--output", "-o"])]


def main() -> None:
    """Entry point of the console script."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without a letter must not end a run
    try:
        sys.exit(run_command(sys.argv[1:]))
    except Exception:  # asked for by --debug
        Console(stderr=True, soft_wrap=True, highlight=False).print(traceback.format_exc())
        sys.exit(FAILED)


def run_command(arguments: Sequence[str]) -> int:
    """Carry out one command line and return its exit code. No traceback leaves here unless it is asked for."""
    debug = "--debug" in arguments or os.environ.get("SEATFEM_DEBUG", "0") not in ("", "0")
    errors = _lines(stderr=True)
    try:
        sweep()
        with ended_by_signals(), warnings.catch_warnings(record=True) as caught:
            code = app(arguments)
        for message in dict.fromkeys(str(warning.message) for warning in caught):
            errors.print(f"warning: {_clipped(message)}")
    except CycloptsError:
        return BAD_INPUT  # cyclopts has told
    except KeyboardInterrupt as stopped:
        with suppress(OSError):  # the terminal may be gone
            errors.print("seatfem: interrupted; files are written whole or not at all")
        return exit_code(stopped)
    except Exception as error:
        if debug:
            raise
        errors.print(f"seatfem: {_clipped(_placed(error, arguments))}")
        return _exit_code(error)
    return code if isinstance(code, int) else DONE


@Parameter(name="*")
@dataclass(frozen=True)
class Effort:
    """What a run may take."""

    no_pictures: Annotated[bool, Parameter(negative="", help="Numbers and files only.")] = False
    max_time: Annotated[
        float | None,
        Parameter(
            help="Seconds: no further round is begun that is predicted to end later, and one that does is stopped; the "
            "first is always finished [default: 600 for each further round]."
        ),
    ] = None
    rounds: Annotated[int, Parameter(help="At most so many rounds of refinement, the first included.")] = 4


WHOLE: Final = Effort()


@app.command
def demo(*, output: Output = None, effort: Effort = WHOLE, common: Common = COMMON) -> int:
    """Run the embedded example, all the way.

    Parameters
    ----------
    output:
        Folder for the results [default: seatfem-demo].
    """
    return _run(demo_scene(), output or Path("seatfem-demo"), effort, common)


@app.command
def run(scene: Path, /, *, output: Output = None, effort: Effort = WHOLE, common: Common = COMMON) -> int:
    """Compute everything that a scene describes: seat, contact, measures, pictures.

    Parameters
    ----------
    scene:
        The scene file (TOML).
    output:
        Folder for the results [default: the scene's name + "-result"].
    """
    return _run(scene, output or Path(f"{scene.stem}-result"), effort, common)


@app.command
def plan(scene: Path, /, *, json: Annotated[bool, Parameter(negative="")] = False, common: Common = COMMON) -> int:
    """Choose what the scene leaves open, and print every choice with its reason, predicted cost and error.

    Parameters
    ----------
    scene:
        The scene file (TOML).
    json:
        Print one JSON object instead: all of it, and the scene in SI units with every open key filled.
    """
    checked = _load(scene)
    from seatfem.faces.plan_json import plan_json
    from seatfem.faces.plan_view import choices_table, costs_table, rounds_line, shares_line, stages_line
    from seatfem.study.planning.planner import plan_scene

    planned = plan_scene(checked)
    if json and not common.quiet:
        sys.stdout.write(plan_json(planned) + "\n")
    elif not common.quiet:
        console = _console()
        console.print(choices_table(planned))
        console.print(costs_table(planned))
        console.print(f"predicted time: {stages_line(planned.cost.parts)}", soft_wrap=True)
        console.print(f"predicted rounds: {rounds_line(planned)}", soft_wrap=True)
        console.print(f"predicted error: {shares_line(planned)}", soft_wrap=True)
        for note in planned.notes:
            console.print(f"note: {note}", soft_wrap=True)
    return DONE


@app.command
def trade(
    scene: Path,
    /,
    *,
    output: Output = None,
    quick: Annotated[bool, Parameter(negative="")] = False,
    limit: float = 20.0,
    common: Common = COMMON,
) -> int:
    """Measure speed against accuracy: the scene at every fidelity, as a chart and a table; goes on where it stopped.

    Parameters
    ----------
    scene:
        The scene file (TOML).
    output:
        Folder for chart, tables and journal [default: the scene's name + "-trade"].
    quick:
        Only about a third of the points.
    limit:
        Processor seconds for one point; the reference and the planner's choice may take four times as many.
    """
    _load(scene)
    from impact.pictures.drawing import gap_of
    from seatfem.study.trade.chart import draw_trade
    from seatfem.study.trade.table import in_words, write_trade
    from seatfem.study.trade.trade import measure_trade

    folder = output or Path(f"{scene.stem}-trade")
    with _progress(common) as progress:
        found = measure_trade(scene, folder / "trade.jsonl", quick=quick, time_limit=limit, progress=progress)
    files = [folder / "trade.csv", folder / "trade.json"]
    write_trade(found, *files)
    console = _lines(quiet=common.quiet)
    console.print(in_words(found))
    if gap := gap_of(lambda path: draw_trade(found, path), folder / "trade.png"):
        console.print(f"note: {gap}")
    else:
        files.append(folder / "trade.png")
    for file in files:
        console.print(f"wrote {file}")
    return DONE


@app.command
def greens(scene: Path, /, *, output: Output = None, common: Common = COMMON) -> int:
    """Compute only the seat's Green's function.

    Parameters
    ----------
    scene:
        The scene file (TOML).
    output:
        File for the Green's function [default: the scene's name + "-seat.h5"].
    """
    checked = _load(scene)
    from seatfem.study.runs.pipeline import compute_greens

    path = output or Path(f"{scene.stem}-seat.h5")
    with _progress(common) as progress:
        outcome = compute_greens(checked, path, progress)
    _tell(outcome, common)
    return DONE


@app.command
def modes(
    scene: Path,
    /,
    *,
    output: Output = None,
    count: int | None = None,
    up_to: str | None = None,
    common: Common = COMMON,
) -> int:
    """Compute the seat's natural modes, none missing: table, pictures, animation, a file for ParaView.

    Parameters
    ----------
    scene:
        The scene file (TOML).
    output:
        Folder for the results [default: the scene's name + "-modes"].
    count:
        Number of modes, the lowest; a pair of a body of revolution counts as two [default: 20].
    up_to:
        Highest frequency, with its unit, e.g. "50 kHz"; instead of a count, or with it: what ends first.
    """
    from seatfem.units import parse_quantity

    highest = None if up_to is None else parse_quantity(up_to, "frequency")
    checked = _load(scene)
    from seatfem.faces.tables import modes_table
    from seatfem.study.runs.pipeline import write_modes

    folder = output or Path(f"{scene.stem}-modes")
    with _progress(common) as progress:
        outcome = write_modes(checked, folder, progress, count=count, up_to_hz=highest)
    if not common.quiet and outcome.modes:
        _console().print(modes_table(outcome.modes))
    _tell(outcome, common)
    return DONE


@app.command
def faces(
    part: Path,
    /,
    *,
    output: Output = None,
    unit: Literal["m", "mm", "um", "inch"] | None = None,
    common: Common = COMMON,
) -> int:
    """Show the faces of a part: a table, and a picture with their numbers, by which scenes may select them.

    Parameters
    ----------
    part:
        A STEP, BREP or mesh file, or a scene (TOML), whose groups are shown then.
    output:
        File of the picture (.png, .pdf, .svg) or of the table (.csv) [default: the part's name + "-faces.png"].
    unit:
        Length unit of a BREP or mesh file, which state none [default: mm, m].
    """
    from impact.files.atomic import whole_file
    from impact.pictures.drawing import gap_of
    from seatfem.faces.faces_table import faces_csv, faces_table
    from seatfem.machine.libraries import require_gmsh_libraries
    from seatfem.pictures.faces_picture import draw_faces
    from seatfem.structures.inspection.parts import open_part
    from seatfem.study.scene.files import part_of_scene

    require_gmsh_libraries()
    with _progress(common) as progress:
        progress("reading the part", 0.0)
        found = part_of_scene(part) if part.suffix.lower() == ".toml" else open_part(part, unit)
        progress("reading the part", 1.0)
    path = output or Path(f"{part.stem}-faces.png")
    gap = ""
    if path.suffix.lower() == ".csv":
        with whole_file(path) as temporary:
            temporary.write_text(faces_csv(found), encoding="utf-8")
    else:
        gap = gap_of(lambda file: draw_faces(found, file), path)
    if common.quiet:
        return FAILED if gap and output else DONE
    _console().print(faces_table(found))
    console = Console(soft_wrap=True, highlight=False, markup=False)
    if len(found.regions) > 1:
        console.print(f"solids: {', '.join(found.regions)}")
    how = "contact = { number = 7 } or { numbers = [7, 9] }" if found.numbered else "the names of groups"
    console.print(f"scenes select by {how}, and as docs/scene.md says")
    for note in (*found.notes, *filter(None, [gap])):
        console.print(f"note: {note}")
    if not gap:
        console.print(f"wrote {path}")
    return FAILED if gap and output else DONE


@app.command
def verify(*, common: Common = COMMON) -> int:
    """Compare with exact solutions: case, exact value, ours, error, verdict."""
    from seatfem.verification.table import verification_table
    from seatfem.verification.view import verification_table_view

    with _progress(common) as progress:
        rows = verification_table(progress)
    if not common.quiet:
        _console().print(verification_table_view(rows))
    return DONE if all(row.verdict for row in rows) else FAILED


@app.command
def doctor(*, calibrate: Annotated[bool, Parameter(negative="")] = False, common: Common = COMMON) -> int:
    """Report what is installed, what is missing, and the exact command that mends it.

    Parameters
    ----------
    calibrate:
        Instead measure how fast this computer is, for the predicted times of plans; best while it is idle.
    """
    if calibrate:
        return _calibrate(common)
    from seatfem.faces.tables import doctor_table
    from seatfem.machine.doctor import doctor_report

    checks = doctor_report()
    gaps = [check for check in checks if check.required and not check.ok]
    if not common.quiet:
        _console().print(doctor_table(checks))
    for gap in gaps:
        _lines(stderr=True).print(f"{gap.name}: {gap.detail}; {gap.remedy}")
    return FAILED if gaps else DONE


def _calibrate(common: Common) -> int:
    from seatfem.faces.tables import rates_table
    from seatfem.machine.calibration import calibrate
    from seatfem.machine.libraries import require_gmsh_libraries
    from seatfem.machine.rates import calibration_file

    require_gmsh_libraries()
    with _progress(common) as progress:
        machine = calibrate(progress)
    path = calibration_file()
    machine.save(path)
    if not common.quiet:
        _console().print(rates_table(machine.rates(), type(machine)().rates()))
        _lines().print(f"wrote {path}")
    return DONE


def demo_scene() -> Path:
    """The demo's scene file, inside an installed package or a source tree."""
    installed = Path(str(resources.files("seatfem"))) / "data" / DEMO_SCENE
    source = Path(__file__).parents[2] / "examples" / DEMO_SCENE
    return installed if installed.is_file() else source


def _run(path: Path, folder: Path, effort: Effort, common: Common) -> int:
    scene = _load(path)
    from seatfem.faces.result_table import result_table
    from seatfem.faces.verdict import verdict
    from seatfem.study.runs.next_round import Limits
    from seatfem.study.runs.pipeline import run_scene

    limits = Limits(effort.rounds, math.inf if effort.max_time is None else effort.max_time)
    errors = _lines(stderr=True, quiet=common.quiet)
    with _progress(common, errors) as progress:
        outcome = run_scene(scene, folder, progress, tell=errors.print, limits=limits, pictures=not effort.no_pictures)
    if not common.quiet:
        console = Console(highlight=False, markup=False)
        title = (scene.title or path.stem).replace("\n", "\\n")
        console.print(f"\n{title}")
        console.print(verdict(outcome.summary), soft_wrap=True)
        console.print(result_table(outcome.summary))
        if outcome.summary.get("regime_predicted_peak_error") is not None:
            console.print(f"regime: {outcome.summary['regime']}", soft_wrap=True)
    _tell(outcome, common)
    if common.quiet and not outcome.met:  # an exit code alone explains nothing
        _lines(stderr=True).print(f"seatfem: {outcome.messages[0]}")
    return DONE if outcome.met else FAILED


def _console() -> Console:
    """For tables: as wide as the terminal; in a file or a pipe as wide as no number is cut."""
    console = Console(markup=False)
    return console if console.is_terminal else Console(width=200, markup=False)


def _lines(*, stderr: bool = False, quiet: bool = False) -> Console:
    """For sentences, one a line, as they are: what a file says, and [uff], is no markup."""
    return Console(stderr=stderr, quiet=quiet, soft_wrap=True, highlight=False, markup=False)


def _progress(common: Common, console: Console | None = None) -> AbstractContextManager[Progress]:
    from seatfem.faces.progress_bars import progress_bars

    return progress_bars(console or _lines(stderr=True), quiet=common.quiet)


def _load(path: Path) -> Scene:
    """The scene, once it is known that what it needs can run here."""
    from seatfem.machine.libraries import require_gmsh_libraries
    from seatfem.study.scene import load_scene

    scene = load_scene(path)
    if scene.seat.needs_gmsh or scene.reed.needs_gmsh:
        require_gmsh_libraries()
    return scene


def _tell(outcome: RunOutcome, common: Common) -> None:
    """What is worth knowing, what was written, and where the time went."""
    if common.quiet:
        return
    from seatfem.faces.tables import time_line

    console = _lines()
    for message in outcome.messages:
        console.print(f"note: {message}")
    for file in outcome.files:
        console.print(f"wrote {file}")
    console.print(f"time: {time_line(outcome.stages)}")


def _is_ours(error: Exception) -> bool:
    return type(error).__module__.partition(".")[0] in ("seatfem", "impact")


def _in_words(error: Exception) -> str:
    from impact.files.atomic import FULL

    if isinstance(error, OSError) and error.errno in FULL:
        return f"{error.filename or 'a file'}: {error.strerror}; free space there, or choose another folder (--output)"
    if _is_ours(error) or isinstance(error, OSError):
        return str(error)
    if isinstance(error, MemoryError):
        return f"{str(error) or 'out of memory'}; a coarser mesh (seat.mesh.size) needs less"
    return f"unexpected {type(error).__name__}: {error}; this is a bug, --debug or SEATFEM_DEBUG=1 shows where"


def _placed(error: Exception, arguments: Sequence[str]) -> str:
    """In words; the scene's name stands in front of what the contact solver says, which knows no scenes, and the lines
    of its keys in front of what is wrong with the files that it names."""
    scenes = [Path(word) for word in arguments if word.endswith(".toml")]
    if scenes and type(error).__name__ == "SceneError":
        from seatfem.study.scene import SceneError, located

        assert isinstance(error, SceneError)
        error = located(error, scenes[0])
    text = _in_words(error)
    if not scenes or type(error).__module__.partition(".")[0] != "impact" or str(scenes[0].absolute().parent) in text:
        return text
    return f"{scenes[0]}: {text}"


def _clipped(text: str) -> str:
    """A broken file's own words may be a million characters long."""
    lines = [
        line if len(line) <= WIDEST else f"{line[: WIDEST // 2]} ... {line[-WIDEST // 2 :]}"
        for line in text.split("\n")
    ]
    more = len(lines) - MOST_LINES
    return "\n".join(lines if more <= 0 else [*lines[:MOST_LINES], f"... and {more} more lines"])


def _exit_code(error: Exception) -> int:
    return (
        BAD_INPUT
        if isinstance(error, FileNotFoundError) or (_is_ours(error) and isinstance(error, ValueError))
        else FAILED
    )


if __name__ == "__main__":
    main()
