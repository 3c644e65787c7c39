"""What the verbs of the program share on the command line, and their exit codes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

DONE: Final = 0
FAILED: Final = 1
BAD_INPUT: Final = 2
INTERRUPTED: Final = 130


@Parameter(name="*")
@dataclass(frozen=True)
class Common:
    """What every verb understands."""

    quiet: Annotated[bool, Parameter(negative="", help="Print nothing but errors.")] = False
    debug: Annotated[bool, Parameter(negative="", help="Show the traceback of an error.")] = False


COMMON: Final = Common()
Output = Annotated[Path | None, Parameter(name=["--output", "-o"])]


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
