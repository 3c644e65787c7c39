"""Verbs that take a scene: demo, run, plan, draw, greens, modes."""

import math
import sys
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

from impact.files.safe_files import OutputError
from seatfem import units
from seatfem.faces import first_screen, plan_view, tables, terminal
from seatfem.faces.report import asked
from seatfem.faces.terminal import COMMON, DONE, FAILED, WHOLE, Changes, Common, Effort, Output, Seconds
from seatfem.faces.wings import file_kinds
from seatfem.study.impacts import contact
from seatfem.study.impacts import layout as layouts
from seatfem.study.runs import forecast, next_round, pipeline
from seatfem.study.scene import files as scene_files
from seatfem.study.scene import tables as scene_tables

# Verbs reach the modules that they run by lazy names: `seatfem --help` must not load compilers and finite elements.

SceneFile = Annotated[Path, Parameter(help="The scene file (TOML).")]
DEMO_SCENE: Final = "valve_on_cast_iron.toml"


def demo(*, output: Output = None, effort: Effort = WHOLE, common: Common = COMMON) -> int:
    """Run the embedded example: a suction valve, with all files and pictures.

    Parameters
    ----------
    output:
        Folder for the results [default: seatfem-demo].
    """
    return _run(demo_scene(), output or Path("seatfem-demo"), effort, common)


def run(
    scene: SceneFile,
    /,
    *,
    output: Output = None,
    changes: Changes = (),
    effort: Effort = WHOLE,
    common: Common = COMMON,
) -> int:
    """Compute everything that a scene describes: seat, contact, measures, pictures.

    Parameters
    ----------
    output:
        Folder for the results [default: the scene's name + "-result"].
    """
    return _run(scene, output or Path(f"{scene.stem}-result"), effort, common, changes)


def plan(
    scene: SceneFile,
    /,
    *,
    json: Annotated[bool, Parameter(negative="")] = False,
    drawing: Path | None = None,
    max_time: Seconds | None = None,
    changes: Changes = (),
    common: Common = COMMON,
) -> int:
    """Run a quick trial of a scene: accuracy so far, time of the full run.

    It begins with coarse values of the keys that the scene does not state, measures their errors, and prints each value
    with its reason and error, and what remains to be done; for another file than a scene, the expected cost. A run
    continues from there. It takes some seconds; for a plate reed on lands of a plate, a CAD part or a mesh up to two
    minutes.

    Parameters
    ----------
    json:
        Print one JSON object instead: all of it, and the scene in SI units with every open key filled.
    drawing:
        File for a drawing of the scene, in section and plan (.png, .svg or .pdf).
    max_time:
        Time of the look, in seconds or with a unit (1 min), after which it is stopped even in its first round [default:
        no round is begun after 3 s, 6 s with files; the first is stopped after 60 s, later on a busy machine].
    """
    for other in file_kinds():
        if scene_tables.has_table(scene, other.table):
            cost = other.expected_cost(scene, as_json=json)
            if json:
                sys.stdout.write(f"{cost}\n")
            else:
                terminal.lines(quiet=common.quiet).print(cost)
            return DONE
    checked = terminal.load(scene, changes, terminal.lines(stderr=True, quiet=common.quiet))
    with terminal.progress_of(common) as progress:
        longest = forecast.patience() if max_time is None else max_time
        look = forecast.look_at(checked, max_time, progress, longest=longest)
    if drawing is not None:
        layouts.draw_scene(checked, drawing, look.plan.method.seat.division)
    if json and not common.quiet:
        sys.stdout.write(plan_view.plan_json(look.plan, look) + "\n")
    elif not common.quiet:
        wide = terminal.console()
        for read in plan_view.read_tables(checked):
            wide.print(read)
        wide.print(plan_view.choices_table(look.plan))
        for words in (*plan_view.look_lines(look), *([] if drawing is None else [f"wrote {drawing}"])):
            wide.print(words, soft_wrap=True)
    return DONE


def draw(scene: SceneFile, /, *, output: Output = None, changes: Changes = (), common: Common = COMMON) -> int:
    """Draw the scene as it will be computed: a section through the contact along the reed, and the plan, with sizes.

    Parameters
    ----------
    output:
        File of the drawing: .png, .svg or .pdf [default: the scene's name + "-drawing.png"].
    """
    checked = terminal.load(scene, changes, terminal.lines(quiet=common.quiet))
    contact.check_step(checked)
    path = output or Path(f"{scene.stem}-drawing.png")
    layout = layouts.draw_scene(checked, path)
    terminal.print_outcome(
        terminal.lines(quiet=common.quiet), [layouts.facts_of(layout)], [layouts.cover_note(layout)], [path]
    )
    return DONE


def greens(scene: SceneFile, /, *, output: Output = None, common: Common = COMMON) -> int:
    """Compute only the seat's Green's function.

    Parameters
    ----------
    output:
        File for the Green's function [default: the scene's name + "-seat.h5"].
    """
    checked = terminal.load(scene, terminal=terminal.lines(stderr=True, quiet=common.quiet))
    path = output or Path(f"{scene.stem}-seat.h5")
    with terminal.progress_of(common) as progress:
        outcome = pipeline.compute_greens(checked, path, progress)
    terminal.tell(outcome, common)
    return DONE


def modes(
    scene: SceneFile,
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
    output:
        Folder for the results [default: the scene's name + "-modes"].
    count:
        Number of modes, the lowest; a pair of a body of revolution counts as two [default: 20].
    up_to:
        Highest frequency, with its unit, e.g. "50 kHz"; instead of a count, or with it: what ends first.
    """
    try:
        highest = None if up_to is None else units.parse_quantity(up_to, "frequency")
    except units.UnitError as problem:
        raise units.UnitError(f"--up-to: {problem}") from None
    checked = terminal.load(scene, terminal=terminal.lines(stderr=True, quiet=common.quiet))
    folder = output or Path(f"{scene.stem}-modes")
    with terminal.progress_of(common) as progress:
        outcome = pipeline.write_modes(checked, folder, progress, count=count, up_to_hz=highest)
    if not common.quiet and outcome.modes:
        terminal.console().print(tables.modes_table(outcome.modes))
    terminal.tell(outcome, common)
    return DONE


def demo_scene() -> Path:
    """Return the demo's scene file, in an installed package or in a source tree."""
    installed = Path(str(resources.files("seatfem"))) / "data" / DEMO_SCENE
    source = Path(__file__).parents[2] / "examples" / DEMO_SCENE
    return installed if installed.is_file() else source


def _run(path: Path, folder: Path, effort: Effort, common: Common, changes: Sequence[str] = ()) -> int:
    errors = terminal.lines(stderr=True, quiet=common.quiet)
    scene = terminal.load(path, changes, errors)
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"--output: {folder} is a file; choose a folder")
    content = path.read_bytes()
    limits = next_round.Limits(effort.rounds, math.inf if effort.max_time is None else effort.max_time)
    for read in plan_view.read_tables(scene):
        errors.print(read, soft_wrap=False)
    with terminal.progress_of(common, errors) as progress:
        outcome = pipeline.run_scene(
            scene, folder, progress, tell=errors.print, limits=limits, pictures=not effort.no_pictures
        )
    copies = asked.keep_asked(content, scene_files.files_of(scene), path.parent, outcome.plan, folder, changes)
    if not common.quiet:
        summary, title = outcome.summary, scene.title or path.stem
        if effort.full:
            for part in first_screen.all_parts(summary, title):
                terminal.console(highlight=False).print(part, soft_wrap=isinstance(part, str))
            terminal.tell(outcome, common, copies)
        else:
            for line in first_screen.first_lines(summary, title, outcome.messages, (*outcome.files, *copies)):
                terminal.lines().print(line)
    if common.quiet and outcome.met is False:  # an exit code alone does not explain the reason
        terminal.lines(stderr=True).print(f"seatfem: {outcome.messages[0]}")
    return FAILED if outcome.met is False else DONE


VERBS: Final = (demo, run, plan, draw, greens, modes)
