r"""All output to the terminal: consoles, options that the verbs share, messages about files written, and progress.

Control characters (ESC sequences, C0, C1), marks that change the direction of text, invisible characters and lone
surrogates are written as escapes, ``\x1b``; square brackets are not interpreted as markup.
"""

from __future__ import annotations

import re
import time
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final

import psutil
from cyclopts import Group, Parameter, Token
from rich.console import Console as RichConsole
from rich.console import ConsoleOptions, RenderableType
from rich.progress import BarColumn, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars
from rich.segment import Segment
from rich.text import Text

from impact.notices import ROUND, Progress, SeatfemError, silent
from seatfem import units
from seatfem.faces import tables
from seatfem.study import scene as scene_files
from seatfem.study.runs import pipeline
from seatfem.study.safety import MOST_ROUNDS
from seatfem.study.scene import load as scene_reader
from seatfem.study.scene import models

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
    return progress_bars(console or lines(stderr=True), quiet=common.quiet, verbose=common.verbose)


def load(path: Path, changes: Sequence[str] = (), terminal: Console | None = None) -> models.Scene:
    """Return the scene with ``changes`` applied, each as in --set; doubts about it are printed on the ``terminal``."""
    scene = scene_reader.load_scene(path, dict(changed(each) for each in changes))
    if terminal is not None and (doubtful := scene.find_doubts()):
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


DOES: Final[Mapping[str, str]] = {
    "meshing": "gmsh divides the body into elements",
    "assembly": "matrices of mass, damping and stiffness",
    "factorization": "the stiffness matrix is factorized for many solutions",
    "reduction": "the response of the body to an impulse, until its error is small enough",
    "harmonics": "the response of the body, one order around the axis after another",
    "modes": "natural modes of the body",
    "stepping": "contact of reed and seat, step by step; the first run ever compiles this code",
    "error budget": "the run is repeated with one setting changed at a time, to measure its error",
    "predictable landings": "the run is repeated with a disturbance as small as round-off",
    "ensemble": "runs that differ by round-off, for statistics of landings",
    "reed stress": "the largest stresses in the reed, from its motion",
    "spring baseline": "the same run on a spring of the seat's static stiffness",
    "life": "fatigue cycles at each place of the bodies",
}
"""Words that say to those who wait what the stages of a run do."""
LONG: Final = 1.0  # time of a stage from which its line says what it did [s]
SILENCE: Final = 10.0  # time after which a stage that is not over says how far it is [s]
Show = Callable[[str, float, float], None]
"""Function that is called with the stage, the fraction completed (0..1) and the time that the stage has taken [s]."""


@contextmanager
def progress_bars(console: RichConsole, *, quiet: bool = False, verbose: bool = False) -> Iterator[Progress]:
    """Yield a progress listener for the duration of the block; its console is on stderr, as results go to stdout."""
    if quiet:
        yield silent
    elif verbose:
        yield StageClock(_log(console))
    elif not console.is_terminal:
        yield StageClock(_lines(console))
    else:
        stage = TextColumn("{task.description:<16}", markup=False)
        columns = (stage, BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
        with Bars(*columns, console=console) as bars:
            yield StageClock(_bars(bars))


@dataclass
class StageClock:
    """Progress listener that measures the time of each stage.

    A stage runs from its first report to its report of 1; a stage that starts again adds to its earlier time, up to the
    end of a round (`ROUND`).
    """

    show: Show
    now: Callable[[], float] = time.perf_counter
    _spent: dict[str, float] = field(default_factory=dict)
    _began: dict[str, float] = field(default_factory=dict)

    def __call__(self, stage: str, fraction: float) -> None:
        now = self.now()
        if stage == ROUND:
            self._spent.clear()
            self._began.clear()
            return
        if stage not in self._began:
            if fraction >= 1.0 and stage in self._spent:
                return  # completion was reported twice
            self._began[stage] = now - self._spent.get(stage, 0.0)
        self._spent[stage] = now - self._began[stage]
        if fraction >= 1.0:
            del self._began[stage]
        self.show(stage, min(max(fraction, 0.0), 1.0), self._spent[stage])


def _lines(console: RichConsole) -> Show:
    """Return a display that prints a line at the end of each stage, and of a long one every `SILENCE` seconds."""
    printed: dict[str, float] = {}

    def show(stage: str, fraction: float, seconds: float) -> None:
        before = printed.get(stage, 0.0)
        if fraction < 1.0 and seconds - (before if before <= seconds else 0.0) < SILENCE:  # a new round begins at 0
            return
        printed[stage] = seconds
        far = "" if fraction >= 1.0 else f", {100 * fraction:.0f} % done"
        does = f" ({DOES[stage]})" if stage in DOES and seconds >= LONG else ""
        console.print(f"{stage}: {seconds:.1f} s{far}{does}", highlight=False, markup=False)

    return show


def _log(console: RichConsole) -> Show:
    """Return a display that prints a dated line at each tenth of a stage, with the memory of this process."""
    shown: dict[str, int] = {}

    def show(stage: str, fraction: float, seconds: float) -> None:
        tenths = int(10 * fraction)
        if shown.get(stage) == tenths:
            return
        shown[stage] = tenths
        memory = psutil.Process().memory_info().rss / 1e9
        console.print(
            f"{time.strftime('%Y-%m-%d %H:%M:%S')} {memory:.2f} GB {stage}: {10 * tenths} %, {seconds:.1f} s",
            highlight=False, markup=False,
        )  # fmt: skip

    return show


def _bars(bars: Bars) -> Show:
    tasks: dict[str, TaskID] = {}

    def show(stage: str, fraction: float, seconds: float) -> None:
        if stage not in tasks:
            tasks[stage] = bars.add_task(f"{stage}: {DOES[stage]}" if stage in DOES else stage, total=1.0)
        bars.update(tasks[stage], completed=fraction)

    return show
