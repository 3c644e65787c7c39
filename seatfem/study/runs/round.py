"""One round of a run: a plan's results, their errors, time and memory, and sentences about them, with
remedies by key and source."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from pydantic import BaseModel

import impact
from impact.after.histories import ReedStress
from impact.after.regime import UNRESOLVED
from impact.after.result import ImpactResult
from impact.notices import Progress
from impact.quantities import in_time, percent
from impact.runs import variations
from impact.runs.variations import Budget
from seatfem.structures.method import Solved
from seatfem.study import safety
from seatfem.study.impacts import validity
from seatfem.study.impacts.contact import Flights
from seatfem.study.impacts.forces import Strike
from seatfem.study.impacts.touches import LIP, Touches, stress_since
from seatfem.study.ladders.ladder import ComputedRun, Ladder
from seatfem.study.ladders.patch import finer_stopper
from seatfem.study.ladders.table import LADDERS, ladder_of, source_of
from seatfem.study.method import MODES, STEP, STOPPER_ARCS, STOPPER_RINGS, RunMethod
from seatfem.study.plan import Plan
from seatfem.study.scene.contradictions import cover_doubts_of, own_doubts_of
from seatfem.study.scene.measures import describe_measure, short_words
from seatfem.study.scene.problems import tables_in
from seatfem.units import write_quantity

if TYPE_CHECKING:
    from seatfem.study.impacts.plate_stress import PlateLook
    from seatfem.study.runs.reed_stress import PlateStress

UNFINISHED: Final = "was begun and not finished"


@dataclass(frozen=True)
class Round:
    """Plan, results and errors of one round of a run.

    Attributes:
        plan: the plan that was run, with its scene.
        seat: the solved seat: Green's function, mesh, and whether it was reused.
        striker: the striker's Green's function and motion without contact.
        reed: the solved reed, if it has finite elements or other computed modes.
        touches, stress: contact history, and the reed's largest stresses.
        budget: error budget of the measures.
        number: 1, 2, ...
        stopped: why no further round follows; "" if the target is met.
        spent: wall time of this round by stage [s].
        price: the same, with what was reused at the time that it took when it was computed.
        memory: peak memory of the process up to the end of the round, or when what was reused was computed [bytes].
        memory_before: memory of the process before the run [bytes].
        before: method and price of the round before.
        plate: stress of a striking plate, if stress is a measure asked for.
        flights: the striker's motion without contact, shared by further runs of the round.
    """

    plan: Plan
    seat: Solved
    striker: impact.Body
    touches: Touches
    stress: ReedStress
    budget: Budget
    reed: Solved | None = None
    number: int = 1
    stopped: str = ""
    spent: Mapping[str, float] = field(default_factory=dict)
    price: Mapping[str, float] = field(default_factory=dict)
    memory: float = math.nan
    memory_before: float = 0.0
    before: tuple[RunMethod, Mapping[str, float]] | None = None
    plate: PlateStress | None = None
    flights: Flights | None = field(default=None, repr=False)

    @property
    def strike(self) -> Strike:
        """Return the run by itself, without its scene and method."""
        return Strike(self.plan.scene.geometry, self.striker, self.seat.greens, self.touches, self.stress)

    def build_computed_run(self, progress: Progress) -> ComputedRun:
        """Return the run whose errors are to be estimated; ``progress``: as in `ComputedRun`."""
        return ComputedRun(self.plan.scene, self.plan.method, self.seat, self.striker, self.reed, progress)

    @property
    def look(self) -> PlateLook | None:
        """Return how runs of the error budget evaluate a plate's stress; ``None``: it is no measure."""
        return None if self.plate is None else self.plate.look

    @property
    def is_followed(self) -> bool:
        """Return whether a further round begins next."""
        return self.stopped.endswith(UNFINISHED)

    @property
    def since(self) -> float:
        """Return the start of the judged landing [s], before and after which stress is reported; nan without one."""
        return stress_since(self.touches, self.plan.scene.accuracy.landing)

    @property
    def result(self) -> ImpactResult:
        """Return the impact on the seat, with its struck patch as one contact."""
        return self.touches.seat

    @property
    def touch(self) -> float:
        """Return the time of the first touch of the seat [s]; nan without one."""
        return self.touches.touch

    @property
    def landed(self) -> bool:
        """Return whether the run has what its measures need: a landing on the seat or, for "run", any contact."""
        if self.plan.scene.accuracy.landing == "run":
            return bool(np.any(self.result.force))
        return bool(self.touches.landings.seat)

    @property
    def judged(self) -> tuple[str, ...]:
        """Return the names of the values that must meet the target; none if the run has no landing."""
        names = self.plan.scene.accuracy.judged if self.landed else ()
        return tuple(name for name in names if name in self.budget.values)

    @property
    def met(self) -> bool | None:
        """Return whether the error bars of all judged values are within the target; ``None`` without such values."""
        target = self.plan.scene.accuracy.target
        return all(self.budget.relative(name) <= target for name in self.judged) if self.judged else None


def missed(done: Round) -> tuple[str, ...]:
    """Return sentences on the error bars that miss the target, their largest sources, and why the run stopped."""
    plan, target = done.plan, done.plan.scene.accuracy.target
    sentences = []
    for name in done.judged:
        if math.isinf(bar := done.budget.relative(name)):
            sentences.append(f"{describe_measure(name)} has no known uncertainty: {UNKNOWN}")
        elif bar > target:
            source = done.budget.dominant(name)
            errors = {key: part.get(name, 0.0) for key, part in done.budget.by_key.items() if source_of(key) == source}
            worst = max(errors, key=lambda key: errors[key], default="")
            sentences.append(
                f"{describe_measure(name)} has an uncertainty of {percent(bar)}, above accuracy.target = "
                f"{percent(target)}; largest part: {safety.source_in_words(source)}; {remedy_of(plan, worst, source)}"
            )
    if sentences and done.stopped:
        sentences.append(
            f"stopped short of the target after {done.number} round{'s'[: done.number > 1]}: {done.stopped}"
        )
    return tuple(sentences)


def bar_in_words(name: str, bar: float) -> str:
    """Return a value of a run and its relative error bar in words."""
    return f"{short_words(name)} {f'+-{percent(bar)}' if math.isfinite(bar) else 'not known'}"


def describe_round(done: Round, before: Plan | None = None) -> str:
    """Return a line on a round: what was refined since the plan of the round ``before``, the error bars of the judged
    measures with those before, time and memory."""
    refined = "" if before is None else f" ({done.plan.changes_since(before)})"
    cost = in_time(sum(done.spent.values())) + ("" if math.isnan(done.memory) else f", {done.memory / 1e9:.2g} GB")
    if done.met is None:
        return f"round {done.number}{refined}: no landing to judge; {cost}"
    bars = []
    for name in done.judged:
        bar = done.budget.relative(name)
        earlier = bar if before is None else before.error.get(name, bar)
        moved = math.isfinite(earlier) and percent(earlier) != percent(bar)
        bars.append(bar_in_words(name, earlier) + f" -> {percent(bar)}" if moved else bar_in_words(name, bar))
    target = percent(done.plan.scene.accuracy.target, 3)
    verdict = f"target {target} {'reached' if done.met else 'missed'}"
    return f"round {done.number}{refined}: {'; '.join(bars)}; {verdict}; {cost}"


UNKNOWN: Final = "the run ends during this landing, or the runs of the error estimate have no such landing"
NO_VALUE: Final = "restitution needs a rebound before the end of the run, displacement a seat with modes"
NARROWER: Final = "a lower seat.greens.bandwidth"
_STEP: Final = re.compile(r"dt <= (\S+) s\b")
_NAMES: Final = {
    "highest striker frequency times step": "time step coarse for the reed's modes: highest frequency times step",
    "highest target frequency times step": "time step coarse for the seat's modes: highest frequency times step",
}


def _is_step_within(done: Round) -> bool:
    """Return whether the error by the time step alone is within the target in all judged values."""
    by_step, target = done.budget.parts.get("time_step"), done.plan.scene.accuracy.target
    if by_step is None or not done.judged:
        return False
    return all(variations.SAFETY * by_step[name] <= target * abs(done.budget.values[name]) for name in done.judged)


OF_EITHER: Final = "a lower bandwidth (or fewer modes) of the seat, or of the stopper if that one rings fastest"


def remarks(done: Round, left_out: Sequence[str]) -> tuple[str, ...]:
    """Return remarks on the results of a round, in sentences, the most general first.

    ``left_out``: what its model leaves out (`not_modelled`), which is among them.
    """
    scene = done.plan.scene
    empty = [name for name in scene.accuracy.judged if done.landed and name not in done.budget.values]
    assumed = scene.reed.assumed()
    limits = validity.validity_advice(scene.geometry, scene.run.filter_width, done.seat.greens, done.striker.greens)
    return (
        *([f"asked for, but without a value: {', '.join(map(describe_measure, empty))}: {NO_VALUE}"] if empty else []),
        *([f"not given, taken from the paper's reed: {', '.join(assumed)}"] if assumed else []),
        *map(str, limits),
        *_advice(done),
        *left_out,
        *map(str, own_doubts_of(scene)),
    )


def not_modelled(done: Round) -> tuple[str, ...]:
    """Return sentences on effects in the scene of a round that its model leaves out."""
    scene = done.plan.scene
    return (
        *validity.film_notes(scene.geometry, done.result),
        *validity.stopper_notes(scene.stopper),
        *stress_not_modelled(done),
        *(each.message for each in cover_doubts_of(scene.geometry)),
    )


def stress_not_modelled(done: Round) -> tuple[str, ...]:
    """Return sentences on stress that the model of a round leaves out."""
    scene = done.plan.scene
    return validity.dishing_notes(scene.reed, scene.seat, scene.load, scene.run.duration)


def _advice(done: Round) -> tuple[str, ...]:
    """Return advice in terms of the scene's keys; none on contacts that the step does not resolve where what it leaves
    is measured and within the target, and none on a time step that the loop chose if the target is met."""
    is_small, measured = _is_step_within(done), done.met is True and not done.plan.is_given(STEP)
    narrower, sentences = NARROWER if done.plan.scene.stopper is None else OF_EITHER, []
    narrower_reed = "a lower reed.greens.bandwidth" if done.plan.method.reed.n_modes is None else f"fewer {MODES}"
    for advice in done.result.advice:
        of_the_step = "dt <=" in advice.remedy
        if not ((measured and of_the_step) or (is_small and advice.name == UNRESOLVED)):
            of_reed = "striker" in advice.name
            remedy = _STEP.sub(lambda word: f"{STEP} <= {write_quantity(float(word[1]), 'time', 2)}", advice.remedy)
            remedy = remedy.replace("fewer modes", narrower_reed if of_reed else narrower)
            name = _NAMES.get(advice.name, advice.name)
            sentences.append(str(replace(advice, name=name, remedy=remedy)))
    return tuple(sentences)


NOTHING: Final = "raise accuracy.target"  # where no key of the scene's kinds makes an error smaller


def remedy_of(plan: Plan, key: str, source: str) -> str:
    """Return in words how the error by a ``key`` of a ``source`` becomes smaller, or why it cannot."""
    if source == LIP and plan.scene.reed.states_contact:
        return "remove reed.contact_radius: the reed then meets the struck face in segments"
    return plan.refused.get(key) or remedy_by_key(plan, key) or remedy_by_source(plan, source) or NOTHING


def remedy_by_key(plan: Plan, key: str) -> str:
    """Return in words what to state at one ``key``, so that its error becomes smaller; "" if the scene has no such
    key."""
    if key == STOPPER_ARCS and (stopper := plan.scene.stopper) is not None:
        finer = finer_stopper(plan.scene.geometry, stopper.parts)
        return "" if finer is None else f"state {key} = {finer.arcs} and {STOPPER_RINGS} = {finer.rings}"
    return "" if (ladder := ladder_of(key)) is None else _remedy_on(plan, ladder)


def _remedy_on(plan: Plan, ladder: Ladder) -> str:
    """Return the remedy of a ladder in words; "" if a scene has no key that it names."""
    table = ladder.key.rpartition(".")[0]
    for name, key in (("{key}", ladder.key), ("{table}", table)):
        if name in ladder.remedy and not _has_key_of_kind(plan, key):
            return ""
    return ladder.remedy.format(key=ladder.key, table=table)


def remedy_by_source(plan: Plan, source: str) -> str:
    """Return in words what to state of a whole source of error; "" if the scene's kinds have none of its keys."""
    return ", or ".join(filter(None, (_remedy_on(plan, each) for each in LADDERS if each.source == source)))


def _has_key_of_kind(plan: Plan, key: str) -> bool:
    """Return whether the kinds of a scene's tables have a dotted ``key``, whether or not the file states its table."""
    role, *path = key.split(".")
    table = getattr(plan.scene, role)
    bodies = (table, table.body) if role == "stopper" and table is not None else (table,)
    return any(table is not None and _has(type(table), path) for table in bodies)


def _has(table: type[BaseModel], path: list[str]) -> bool:
    field = table.model_fields.get(path[0])
    return field is not None and (len(path) == 1 or any(_has(each, path[1:]) for each in tables_in(field.annotation)))
