"""A scene file, run as a user would, and its numbers against what is known of them."""

import json
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from impact.notices import Progress
from seatfem.jobs.folders import private_folder
from seatfem.machine.resources import forget_peak
from tests.extremes.cell import Finding, Price, Standing, is_refusal, judge_price
from tests.extremes.scene_text import Table, scene_text
from tests.steps import Limits, RunError, load_scene, run_scene

LONGEST = Limits(seconds=20.0)
"""Of the rounds of a run: what a refinement would cost beyond is not asked of a cell."""
FIRST = "first landing: "
"""Before a key: that of the first entry of ``landings`` in summary.json."""
Files = Mapping[str, str | Callable[[Path], None]]


@dataclass(frozen=True)
class SceneRun:
    """What a run left.

    Attributes:
        summary: summary.json.
        messages: what the run said beside it.
        price: processor time and memory.
    """

    summary: Mapping[str, object]
    messages: tuple[str, ...]
    price: Price

    def number(self, key: str) -> float:
        """Return a number of summary.json, or of its first landing after `FIRST`; nan where it is null or absent."""
        value = self._table(key).get(key.removeprefix(FIRST))
        return float(value) if isinstance(value, int | float) else math.nan

    def bar(self, key: str) -> float:
        """Return the error bar of a number: 0 where it has none, infinite where it is stated as not known (null)."""
        name, table = f"error_bar_{key.removeprefix(FIRST)}", self._table(key)
        if name not in table:
            return 0.0
        value = table[name]
        return float(value) if isinstance(value, int | float) else math.inf

    def _table(self, key: str) -> Mapping[str, object]:
        landings = self.summary["landings"]
        if not key.startswith(FIRST):
            return self.summary
        return landings[0] if isinstance(landings, list) and landings else {}


@dataclass(frozen=True)
class Known:
    """What is known of a number of summary.json.

    Attributes:
        key: of summary.json.
        exact: its value from elsewhere.
        theory: what that value leaves out, relative to it (or to ``scale``): a tolerance with a reason.
        bar: error bar of ``exact`` itself, where it is of another run; in the unit of the key.
        scale: what errors are relative to, where that is not ``exact``.
        value: the run's, where it is no number of summary.json by itself.
        barred: whether the run's error bar counts; not where ``theory`` holds all that the known value leaves out, so
            that a bar, or one that is not known, would hide what the cell can see.
    """

    key: str
    exact: float
    theory: float = 1e-6
    bar: float = 0.0
    scale: float = 0.0
    value: float | None = None
    barred: bool = True

    def standing(self, run: SceneRun) -> Standing:
        """Return error, bar and tolerance of a run's number, all relative."""
        scale = self.scale or abs(self.exact) or 1.0
        value = run.number(self.key) if self.value is None else self.value
        error = abs(value - self.exact) / scale
        bar = ((run.bar(self.key) if self.barred else 0.0) + self.bar) / scale
        return Standing(self.key, error, bar, self.theory, run.number("accuracy_target"))


def run_text(
    text: str, files: Files | None = None, *, pictures: bool = False, most_seconds: float = math.inf
) -> SceneRun:
    """Return what a scene's run leaves; its files are written beside it.

    Raises:
        RunError: the scene is refused, in the same words wherever its folder is, or its first round takes more than
            ``most_seconds``; and what is no refusal that `run_scene` raises.
    """
    with private_folder("extremes") as folder:
        for name, content in (files or {}).items():
            if isinstance(content, str):
                (folder / name).write_text(content, encoding="utf-8")
            else:
                content(folder / name)
        path = folder / "scene.toml"
        path.write_text(text, encoding="utf-8")
        forget_peak()
        start = processor_seconds()
        try:
            listen = until(time.perf_counter() + most_seconds)
            outcome = run_scene(load_scene(path), folder / "out", progress=listen, limits=LONGEST, pictures=pictures)
        except Exception as refusal:
            if not is_refusal(refusal):
                raise
            raise RunError(str(refusal).replace(f"{folder}{os.sep}", "")) from None
        spent = processor_seconds() - start
        summary = json.loads((folder / "out" / "summary.json").read_text(encoding="utf-8"))
        used = summary["peak_memory_bytes"]
        price = Price(spent, math.nan if used is None else used)
        return SceneRun(summary, outcome.messages, price)


def until(deadline: float) -> Progress:
    """Return a listener of progress that stops a run after a time of `time.perf_counter`: nothing is known of the price
    of a scene whose numbers are at their ends."""

    def listen(stage: str, done: float) -> None:
        if time.perf_counter() > deadline:
            raise RunError(
                f"stopped in {stage} ({done:.0%}): it takes longer than the battery allows; shorten run.duration"
            )

    return listen


def run_tables(files: Files | None = None, /, **tables: Table | Sequence[Table] | None) -> SceneRun:
    """Return what the run of a scene of these tables leaves, as `run_text`."""
    return run_text(scene_text(**tables), files)


def judge(run: SceneRun, *known: Known, note: str = "") -> Finding:
    """Return what is worst of a run's numbers, with its price."""
    worst = max((each.standing(run) for each in known), key=lambda standing: standing.excess)
    return Finding(worst.error, worst.stated, run.messages, note or worst.name, worst, judge_price(run.price))


def same(
    run: SceneRun, other: SceneRun, *keys: str, theory: float = 1e-6, factor: float = 1.0, barred: bool = True
) -> Iterator[Known]:
    """Yield that numbers of a run are ``factor`` times those of another one, whose bars count as well; not ``barred``:
    both are the same march."""
    for key in keys:
        exact = other.number(key) * factor
        if not (math.isnan(exact) and math.isnan(run.number(key))):
            yield Known(key, exact, theory, other.bar(key) * factor if barred else 0.0, barred=barred)


def processor_seconds() -> float:
    """Return the processor time of this process and of those that it has waited for [s]."""
    return sum(os.times()[:4])
