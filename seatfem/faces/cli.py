"""The program `seatfem`: one verb per thing to do. Exit code 0: done, 1: failed or missed its target, 2: bad input."""

from __future__ import annotations

import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from contextlib import suppress
from io import TextIOWrapper
from typing import Literal

from cyclopts import App, CycloptsError

from seatfem.faces import other_verbs, result_verbs, scene_verbs, study_verbs
from seatfem.faces.errors import MOST_LINES, WIDEST, clipped, code_of, placed
from seatfem.faces.output import BAD_INPUT, DONE, FAILED, INTERRUPTED, lines
from seatfem.faces.scene_verbs import DEMO_SCENE, demo_scene
from seatfem.faces.terminal import Console
from seatfem.jobs.folders import sweep
from seatfem.jobs.signals import ended_by_signals, exit_code

__all__ = [
    "BAD_INPUT",
    "DEMO_SCENE",
    "DONE",
    "FAILED",
    "INTERRUPTED",
    "MOST_LINES",
    "WIDEST",
    "demo_scene",
    "main",
    "run_command",
]

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
for verb in (
    scene_verbs.demo,
    scene_verbs.run,
    result_verbs.report,
    result_verbs.view,
    result_verbs.export,
    scene_verbs.plan,
    scene_verbs.draw,
    scene_verbs.trade,
    study_verbs.sweep,
    study_verbs.optimise,
    scene_verbs.greens,
    scene_verbs.modes,
    other_verbs.init,
    other_verbs.faces,
    other_verbs.verify,
    other_verbs.doctor,
):
    app.command(verb)


@app.command
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

    Dense products here are small, and OpenBLAS takes three times the processor time on two threads, unless the user has
    asked for them; before numpy is there, which reads this once. Factorizations keep their threads.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
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
    errors = lines(stderr=True)
    try:
        sweep()
        with ended_by_signals(), warnings.catch_warnings(record=True) as caught:
            code = app(arguments)
        for message in dict.fromkeys(str(warning.message) for warning in caught):
            errors.print(f"warning: {clipped(message)}")
    except CycloptsError:
        return BAD_INPUT  # cyclopts has told
    except KeyboardInterrupt as stopped:
        with suppress(OSError):  # the terminal may be gone
            errors.print("seatfem: interrupted; files are written whole or not at all")
        return exit_code(stopped)
    except Exception as error:
        if debug:
            raise
        errors.print(f"seatfem: {clipped(placed(error, arguments))}")
        return code_of(error)
    return code if isinstance(code, int) else DONE


if __name__ == "__main__":
    main()
