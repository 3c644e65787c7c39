"""A look at a scene before its run: the loop for a few seconds, and a forecast of what is left until its target is met.

What a look has computed is in the stores of seats, numbers and plans, from which the run goes on.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Final

from impact.notices import Progress, Tell, ignore, silent
from impact.quantities import in_time
from impact.runs.variations import SAFETY
from seatfem.machine.resources import Stopwatch, busyness
from seatfem.study.impacts.contact import RunError
from seatfem.study.plan import Plan
from seatfem.study.runs import pipeline
from seatfem.study.runs.converge import AIM, begin_plan, mark, what_remains
from seatfem.study.runs.kept import cached_plan, save_plan
from seatfem.study.runs.next_round import POWER, Limits, expect_memory, expect_time, next_plan, time_of
from seatfem.study.runs.outcome import Landings, Measures, RunResult
from seatfem.study.runs.round import Round, missed, not_modelled, remarks
from seatfem.study.runs.rounds import NO_LIMITS, OutOfTime, last_round
from seatfem.study.scene import Scene
from seatfem.study.scene.load import AnyScene, take_scene

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


USUAL: Final = 9.0  # factor by which a round usually reduces the largest error bar: several keys are refined at once
SLOW: Final = 3.0  # the same factor of slow rounds, whose larger number decides on the memory
HANGING: Final = 60.0  # time after which the first round of a look is stopped [s]: kernels may be compiled in it
PICTURES: Final = 6.0  # wall time of the pictures of a run [s]
FOLLOWING: Final = 0.25  # wall time of files, stress and horizon after the last round over that of its contact
ASSESSING: Final = 1.5  # wall time of an assessment, such as a life with its bar and curves, over that of the contact
PURSE: Final = {False: 3.0, True: 6.0}  # wall time of a look [s], at a scene without and with files of geometry


@dataclass(frozen=True)
class Forecast:
    """A forecast states what is left of a run after some of its rounds.

    Attributes:
        rounds: number of further rounds.
        seconds: their wall time [s].
        after: wall time of files and pictures after them [s].
        seat, contact: wall time of seat and of contact in the last of them [s].
        memory: peak memory after them [bytes].
        error: relative error bar of each judged measure after them.
        changes: what the next of them refines, in words.
        why: why the target will not be met, in words; "" if it will.
    """

    rounds: int
    seconds: float
    seat: float
    contact: float
    after: float
    memory: float
    error: Mapping[str, float]
    changes: str = ""
    why: str = ""


@dataclass(frozen=True)
class Look:
    """A look holds the last round of a scene, the wall time of all by stage [s], and what is left."""

    done: Round
    stages: Mapping[str, float]
    left: Forecast

    @property
    def plan(self) -> Plan:
        """Return the plan of the last round."""
        return self.done.plan

    @property
    def seconds(self) -> float:
        """Return the expected wall time of a run that does all of it [s]."""
        return sum(self.stages.values()) + self.left.seconds + self.left.after


def look_at(
    scene: Scene, seconds: float | None = None, progress: Progress = silent, *, longest: float = math.inf
) -> Look:
    """Return a look at a scene, after which no round is begun that is expected to end later than ``seconds``, by
    default `PURSE`.

    Raises `RunError` where the first round does not end within ``longest`` [s], and what
    `seatfem.study.runs.rounds.rounds` and `seatfem.study.runs.converge.begin_plan` raise.
    """
    purse = PURSE[bool(scene.seat.files())] if seconds is None else seconds
    watch = Stopwatch()
    try:
        plan = cached_plan(scene) or begin_plan(scene)
        done = last_round(plan, watch, Limits(seconds=purse, first=longest), progress)
    except OutOfTime as problem:
        raise RunError(
            f"no first round within {in_time(longest)}: {problem}, or state a larger seat.mesh.size, a narrower "
            "seat.greens.bandwidth, a longer run.filter_width or fewer contact.ports; a run waits for its first round"
        ) from problem
    save_plan(scene, done)
    return Look(done, watch.stages, forecast(done))


def patience() -> float:
    """Return the wall time after which the first round of a look is stopped [s], longer on a busy machine."""
    return HANGING * busyness()


@dataclass(frozen=True, repr=False)
class ConvergedRound(Round):
    """The last round of the loop for a scene. Its numbers are those of a run, before its stress fields and life."""

    @cached_property
    def numbers(self) -> RunResult:
        """Return the round as the result of a run without files; the spring baseline is run when it is first read."""
        summary, spring = pipeline.summarise_round(self)
        notes = (*missed(self), *remarks(self, not_modelled(self)))
        return RunResult(summary, notes, (), self.spent, self.met, histories=self.result, spring=spring, plan=self.plan)

    @property
    def measures(self) -> Measures:
        """Return the measures by their keys in summary.json or their names."""
        return self.numbers.measures

    @property
    def landings(self) -> Landings:
        """Return all landings on seat and stopper in the order of time."""
        return self.numbers.landings

    def __repr__(self) -> str:
        return str(self.numbers).replace(RunResult.__name__, type(self).__name__, 1)

    def _repr_html_(self) -> str:
        return self.numbers._repr_html_()

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the numbers as `seatfem.RunResult.to_dataframe`."""
        return self.numbers.to_dataframe()

    def plot(self, history: str = "force", path: str | os.PathLike[str] | None = None) -> Figure:
        """Draw a history as `seatfem.RunResult.plot`."""
        return self.numbers.plot(history, path)


def converge(
    scene: AnyScene,
    target: float | str | None = None,
    *,
    limits: Limits = NO_LIMITS,
    progress: Progress = silent,
    tell: Tell = ignore,
) -> ConvergedRound:
    """Return the last round of the loop for a scene, which meets its target where it can be met. Nothing is kept but in
    the stores of seats and of numbers.

        seatfem.converge("scene.toml", "2 %").measures["impulse"]

    Args:
        scene: path of the scene's file, its text, or a `Scene`; the keys that it states are kept.
        target: relative accuracy of the measures asked for, in place of the scene's: 0.02 or "2 %".
        limits: limits on rounds and time.
        progress, tell: receive the progress, and a line on each round.

    Raises `SceneError`, and what `seatfem.study.runs.rounds.rounds` and `seatfem.study.runs.converge.begin_plan` raise.
    """
    checked = take_scene(scene)
    if target is not None:
        checked = checked.with_target(target)
    done = last_round(begin_plan(checked), Stopwatch(), limits, progress, tell)
    return ConvergedRound(**{each.name: getattr(done, each.name) for each in fields(done)})


def forecast(done: Round) -> Forecast:
    """Return what is left of a run, if every further round reduces the largest error by `USUAL`, but none what cannot
    be refined."""
    bars = {name: done.budget.relative(name) for name in done.judged}
    seat, contact = (time_of(done.price, part) for part in ("seat", "contact"))
    further, why = None, "" if done.met else "there is no landing to judge"
    assessed = len(done.plan.scene.assessments)
    if done.met is False:
        further, why = next_plan(done, Limits(), math.inf)
    if further is None:
        return Forecast(0, 0.0, seat, contact, _after(contact, assessed), expect_memory(done, None), bars, why=why)
    target, spent = done.plan.scene.accuracy.target, max(sum(done.price.values()), 1e-3)
    stuck = mark(done).stuck
    sizes = {name: abs(done.budget.values[name]) or math.inf for name in stuck}  # of zero a relative error says nothing
    least = {name: SAFETY * math.hypot(*part.values()) / sizes[name] for name, part in stuck.items()}
    worst = max([bar for name, bar in bars.items() if name not in least] or bars.values())
    count = 1 if math.isinf(worst) else max(1, math.ceil(math.log(max(worst / target, 1.0)) / math.log(USUAL)))
    seconds = expect_time(done, further)
    growth = max(seconds / spent, 1.0)
    whole, grown = sum(seconds * growth ** (POWER * k) for k in range(count)), growth ** (1 + POWER * (count - 1))
    error = {
        name: bar if bar <= target else min(bar, max(AIM * target, bar / USUAL**count, least.get(name, 0.0)))
        for name, bar in bars.items()
    }
    changes, why = further.changes_since(done.plan), what_remains(done)
    last = seat * grown, contact * grown, _after(contact * grown, assessed)
    rounds_to_grow = math.ceil(math.log(max(min(worst, 1.0) / target, SLOW)) / math.log(SLOW))
    return Forecast(count, whole, *last, expect_memory(done, further, rounds_to_grow), error, changes, why)


def _after(contact: float, assessments: int) -> float:
    """Return the wall time [s] of what follows the last round, from that of its contact."""
    return PICTURES + (FOLLOWING + ASSESSING * assessments) * contact
