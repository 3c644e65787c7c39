r"""All output to the terminal: consoles, options that the verbs share, and messages about files written.

Control characters (ESC sequences, C0, C1), marks that change the direction of text, invisible characters and lone
surrogates are written as escapes, ``\x1b``; square brackets are not interpreted as markup.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

from cyclopts import Group, Parameter, Token
from rich.console import Console as RichConsole
from rich.console import ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from impact.notices import Progress, SeatfemError
from seatfem import units
from seatfem.faces import progress_bars, tables
from seatfem.study import scene as scene_files
from seatfem.study.runs import pipeline
from seatfem.study.safety import MOST_ROUNDS
from seatfem.study.scene import contradictions, models
from seatfem.study.scene import load as scene_reader

_UNSEEN: Final = re.compile(
    "[\\x00-\\x08\\x0b-\\x1f\\x7f-\\x9f\\xad\\u034f\\u061c\\u115f\\u1160\\u17b4\\u17b5\\u180b-\\u180f\\u200b-\\u200f"
    "\\u2028-\\u202e\\u2060-\\u206f\\u3164\\ud800-\\udfff\\ufeff\\uffa0\\ufff0-\\ufffb\\U000e0000-\\U000e0fff]"
)


def visible(text: str) -> str:
    """Return the text with every invisible or control character as an escape; tabs and line ends stay."""
    return _UNSEEN.sub(lambda unseen: unseen[0].encode("unicode_escape").decode("ascii"), text)


class Console(RichConsole):
    """A console of rich that shows text from any source literally, markup and control characters included."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"markup": False, "emoji": False} | options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Render `visible` text as rich does, so that tables reserve its width."""
        return super().render_str(visible(text), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render as rich does, and make the text of each segment visible, except rich's own control codes."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else visible(text), style, control)


DONE: Final = 0
FAILED: Final = 1
BAD_INPUT: Final = 2
INTERRUPTED: Final = 130
Changes = Annotated[
    tuple[str, ...],
    Parameter(
        name="--set",
        negative="",
        help='KEY=VALUE, any number of times: replaces the value in the file, as in --set reed.thickness="0.2 mm".',
    ),
]
Output = Annotated[Path | None, Parameter(name=["--output", "-o"])]


def seconds_of(_: object, words: Sequence[Token]) -> float:
    """Return the seconds of an option: "90", "90 s", "1 min", "2 h". Raises `UnitError`."""
    text = words[0].value
    with suppress(ValueError):
        return float(text)
    try:
        return units.parse_quantity(text, "time")
    except units.UnitError:
        raise units.UnitError(f"{text!r} is no time; write seconds, 90, or a number with its unit, '1 min'") from None


Seconds = Annotated[float, Parameter(converter=seconds_of)]


class ChangeError(SeatfemError, ValueError):
    """Error of a --set option that is not KEY=VALUE."""


@Parameter(name="*", group=Group("Options of every verb", sort_key=1))
@dataclass(frozen=True)
class Common:
    """Options that every verb understands."""

    quiet: Annotated[bool, Parameter(negative="", help="Print nothing but errors.")] = False
    verbose: Annotated[bool, Parameter(negative="", help="Log each tenth of each stage: date, memory, time.")] = False
    debug: Annotated[bool, Parameter(negative="", help="Show the traceback of an error.")] = False


COMMON: Final = Common()


@Parameter(name="*")
@dataclass(frozen=True)
class Effort:
    """Limits on a run, and what it prints and draws, as options of a verb."""

    full: Annotated[
        bool, Parameter(negative="", help="Print all numbers, landings, notes and files instead of the first screen.")
    ] = False
    no_pictures: Annotated[bool, Parameter(negative="", help="Numbers and files only.")] = False
    max_time: Annotated[
        Seconds | None,
        Parameter(
            help="Seconds, or a time with its unit (10 min): no further round is begun that is expected to end "
            "later, and one that does is stopped; the first is always finished [default: 600 for each further round]."
        ),
    ] = None
    rounds: Annotated[int, Parameter(help="At most so many rounds of refinement, the first included.")] = MOST_ROUNDS


WHOLE: Final = Effort()


def console(*, highlight: bool = True) -> Console:
    """Return a console for tables, as wide as the terminal; for a file or pipe wide enough that no number is cut."""
    terminal = Console(highlight=highlight)
    return terminal if terminal.is_terminal else Console(width=200, highlight=highlight)


def lines(*, stderr: bool = False, quiet: bool = False) -> Console:
    """Return a console for sentences, one per line, unwrapped and without markup: [uff] is printed literally."""
    return Console(stderr=stderr, quiet=quiet, soft_wrap=True, highlight=False)


def progress_of(common: Common, console: Console | None = None) -> AbstractContextManager[Progress]:
    """Return progress bars on the ``console`` (default: standard error); silent ones for --quiet."""
    return progress_bars.progress_bars(console or lines(stderr=True), quiet=common.quiet, verbose=common.verbose)


def load(path: Path, changes: Sequence[str] = (), terminal: Console | None = None) -> models.Scene:
    """Return the scene with ``changes`` applied, each as in --set; doubts about it are printed on the ``terminal``."""
    scene = scene_reader.load_scene(path, dict(changed(each) for each in changes))
    if terminal is not None and (doubtful := contradictions.doubts_of(scene)):
        for doubt in scene_files.located(scene_files.SceneError(doubtful), path).problems:
            terminal.print(f"warning: {doubt}")
    return scene


def changed(option: str) -> tuple[str, object]:
    """Return the dotted key and value of a --set option; a value that is not TOML is text. Raises `ChangeError`."""
    key, equals, text = option.partition("=")
    key, text = key.strip(), text.strip()
    if not equals or not key or not text:
        raise ChangeError(f"--set: {option!r} must be KEY=VALUE, as in reed.thickness=0.2 mm or accuracy.target=1 %")
    try:
        return key, tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return key, text


def tell(outcome: pipeline.RunOutcome, common: Common, further_files: Sequence[Path] = ()) -> None:
    """Print the notes of a run, the files written, and the time by stage."""
    if common.quiet:
        return
    print_outcome(lines(), (), outcome.messages, (*outcome.files, *further_files))
    lines().print(f"time: {tables.time_line(outcome.stages)}")


def print_outcome(terminal: Console, sentences: Iterable[object], notes: Iterable[str], files: Iterable[Path]) -> None:
    """Print the sentences and notes of a run, and the files written."""
    for words in filter(None, sentences):
        terminal.print(words)
    for note in filter(None, notes):
        terminal.print(f"note: {note}")
    for file in files:
        terminal.print(f"wrote {file}")
