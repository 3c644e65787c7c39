"""Display of progress: one bar per stage on a terminal, plain lines elsewhere, a log, or nothing when quiet."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Final

import psutil
from rich.console import Console
from rich.progress import BarColumn, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars

from impact.notices import ROUND, Progress, silent

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
def progress_bars(console: Console, *, quiet: bool = False, verbose: bool = False) -> Iterator[Progress]:
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


def _lines(console: Console) -> Show:
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


def _log(console: Console) -> Show:
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
