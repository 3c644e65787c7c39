"""The command line program `seatfem`: one verb for each task, every error in words. Exit code 0: success, 1: a run
that failed or missed its target, 2: wrong input."""

import gc
import os
import re
import sys
import traceback
import warnings
from collections.abc import Sequence
from contextlib import suppress
from errno import ENOENT
from io import TextIOWrapper
from pathlib import Path
from typing import Final, Literal

from cyclopts import App, CycloptsError, Group

from impact.files.safe_files import FULL
from impact.notices import SeatfemError
from seatfem.faces.scene_verbs import DEMO_SCENE, demo_scene
from seatfem.faces.terminal import BAD_INPUT, DONE, FAILED, INTERRUPTED, Console, lines
from seatfem.faces.wings import all_verbs
from seatfem.jobs import folders, processes
from seatfem.machine import doctor, resources
from seatfem.study import scene as scene_files
from seatfem.study.scene import problems, tables

__all__ = ["BAD_INPUT", "DEMO_SCENE", "DONE", "FAILED", "INTERRUPTED", "demo_scene", "main", "run_command"]


WIDEST: Final = 1000  # largest number of characters in a line of a message
MOST_LINES: Final = 40
RARELY: Final = (300_000, 20, 20)
"""Thresholds of the garbage collector: modules have no cycles, and usual thresholds cost 1/7 of a short run."""
_KEY: Final = re.compile(r"[a-z_]+(?:\.[A-Za-z_0-9]+)+(?=: | = )")
"""Pattern of a message that begins with a key of a scene."""


def describe_error(error: Exception) -> str:
    """Return the message of an error with its remedy; an error that is not caused by the user is called a bug."""
    if isinstance(error, OSError) and error.errno in FULL:
        return f"{error.filename or 'a file'}: {error.strerror}; free space there, or choose another folder (--output)"
    if isinstance(error, FileNotFoundError) and error.errno == ENOENT and error.filename:
        return f"{error.filename}: no such file; check the path"
    if isinstance(error, SeatfemError | OSError):
        return str(error)
    if words := doctor.broken_package(error):
        return words
    if isinstance(error, MemoryError):
        return f"{str(error) or 'out of memory'}; a coarser mesh (seat.mesh.size) needs less"
    return f"unexpected {type(error).__name__}: {error}; this is a bug, --debug or SEATFEM_DEBUG=1 shows where"


def placed(error: Exception, arguments: Sequence[str]) -> str:
    """Return the message of `describe_error` with its place: the name of the scene before a message of the contact
    solver, which does not know scenes, and the line of the key before a message about a file that the scene names."""
    scenes = [Path(word) for word in arguments if word.endswith(".toml")]
    if scenes and type(error).__name__ == "SceneError":
        assert isinstance(error, scene_files.SceneError)
        error = scene_files.located(error, scenes[0])
    text = describe_error(error)
    is_placed = type(error).__name__ == "SceneError"
    if scenes and not is_placed and isinstance(error, SeatfemError) and (key := _KEY.match(text)):
        text = _with_line(text, key[0], scenes[0])
    if not scenes or type(error).__module__.partition(".")[0] != "impact" or str(scenes[0].absolute().parent) in text:
        return text
    return f"{scenes[0]}: {text}"


def _with_line(text: str, key: str, scene: Path) -> str:
    """Return the text with the file, and the line of the key, or of its table, with which a message of one line
    begins, if the file has either."""
    try:
        line = problems.line_of(key, problems.key_lines(tables.read_toml(scene)))
    except scene_files.SceneError:  # an error of the scene file itself
        return text
    return text if "\n" in text else f"{scene}:{line}: {text}" if line else f"{scene}: {text}"


def clipped(text: str) -> str:
    """Return the text cut to a readable length: an error about a broken file may quote a million characters of it."""
    lines = [
        line if len(line) <= WIDEST else f"{line[: WIDEST // 2]} ... {line[-WIDEST // 2 :]}"
        for line in text.split("\n")
    ]
    more = len(lines) - MOST_LINES
    return "\n".join(lines if more <= 0 else [*lines[:MOST_LINES], f"... and {more} more lines"])


def code_of(error: Exception) -> int:
    """Return the exit code of a command that ended with this error."""
    bad_input = isinstance(error, FileNotFoundError) or (
        isinstance(error, SeatfemError) and isinstance(error, ValueError)
    )
    return BAD_INPUT if bad_input else FAILED


GROUPS: Final = {
    Group(title, sort_key=number): names
    for number, (title, names) in enumerate(
        {
            "Begin": ("demo", "init", "faces", "draw"),
            "Compute a scene": ("plan", "run", "live", "greens", "modes"),
            "Look at a run": ("report", "view", "export"),
            "Studies": ("sweep", "optimise", "identify", "trade"),
            "Trust and installation": ("verify", "doctor", "completion"),
        }.items()
    )
}
"""Headings of verbs in the help of the program; other verbs stand below `FURTHER`."""
FURTHER: Final = Group("Further", sort_key=len(GROUPS))


def group_of(name: str) -> Group:
    """Return the group in which the help shows a verb."""
    return next((group for group, names in GROUPS.items() if name in names), FURTHER)


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
    group_commands=FURTHER,
)
for verb in all_verbs():
    group = group_of(verb.__name__)
    app.command(verb, group=group, sort_key=[*GROUPS.get(group, ()), verb.__name__].index(verb.__name__))


@app.command(group=group_of("completion"))
def completion(shell: Literal["bash", "zsh", "fish"], /) -> int:
    """Print the script by which a shell completes verbs and options.

    Parameters
    ----------
    shell:
        For bash: seatfem completion bash > ~/.local/share/bash-completion/completions/seatfem
    """
    sys.stdout.write(app.generate_completion(shell=shell))
    return DONE


def main() -> None:
    """Run the command line: the entry point of the console script.

    Two threads triple OpenBLAS's time for the small dense products of this program: one is set before numpy reads the
    variable, unless the user has set a number. Factorizations keep their threads.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(*RARELY)
    resources.return_freed_arrays()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal that lacks a character must not end a run
    try:
        sys.exit(run_command(sys.argv[1:]))
    except Exception:  # only with --debug, which lets errors pass
        Console(stderr=True, soft_wrap=True, highlight=False).print(traceback.format_exc())
        sys.exit(FAILED)
    finally:
        gc.freeze()  # collections of all modules at the interpreter's end would take a third of a short run's time


def run_command(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit code. Errors become messages; only --debug shows a traceback."""
    debug = "--debug" in arguments or os.environ.get("SEATFEM_DEBUG", "0") not in ("", "0")
    errors = lines(stderr=True)
    try:
        folders.sweep()
        with processes.ended_by_signals(), warnings.catch_warnings(record=True) as caught:
            code = app(arguments)
        for message in dict.fromkeys(str(warning.message) for warning in caught):
            errors.print(f"warning: {clipped(message)}")
    except CycloptsError as problem:  # cyclopts has printed what is wrong
        errors.print(f"seatfem: see {' '.join(('seatfem', *(problem.command_chain or ())))} --help")
        return BAD_INPUT
    except KeyboardInterrupt as stopped:
        with suppress(OSError):  # the terminal may be gone
            errors.print("seatfem: interrupted; files are written whole or not at all")
        return processes.exit_code(stopped)
    except Exception as error:
        if debug:
            raise
        errors.print(f"seatfem: {clipped(placed(error, arguments))}")
        return code_of(error)
    return code if isinstance(code, int) else DONE


if __name__ == "__main__":
    main()
