"""A plan, for the terminal and for other programs."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Final

from rich.table import Table

from impact.files.table import without_nan
from impact.quantities import enumeration, in_digits, in_time, percent
from seatfem.faces.read_back import read_back
from seatfem.study.accuracy.source_words import STAGES, in_words
from seatfem.study.method import as_stated
from seatfem.study.planning.plan import Cost, Plan
from seatfem.study.planning.refining import rounds_ahead
from seatfem.study.scene.measures import all_measures, asked_name, short_words

COUNTS: Final = 0.01
"""Share of the largest source of error below which another one is not shown."""


def choices_table(plan: Plan) -> Table:
    """Return what is chosen or stated, the error that it leaves, and why."""
    table = Table("key", "value", "from", "error left", "why")
    for choice in plan.choices:
        table.add_row(choice.key, choice.value, "file" if choice.given else "plan", choice.leaves, choice.reason)
    return table


def costs_table(plan: Plan) -> Table:
    """Time, memory and error of the plan, and of what would be cheaper or more accurate."""
    words = (f"uncertainty of\n{short_words(name)}" for name in plan.error)
    table = Table("", "time", "memory", *words)
    for what, cost, error in (
        ("this plan", plan.cost, plan.error),
        *((other.what, other.cost, other.error) for other in plan.alternatives),
    ):
        table.add_row(
            what, in_time(cost.seconds), f"{in_digits(cost.memory / 1e9, 2)} GB", *(percent(e) for e in error.values())
        )
    return table


def plan_lines(plan: Plan) -> Iterator[str]:
    """Yield what the target of accuracy speaks of; predicted seconds by stage, the longest first; how many rounds of
    refinement are expected, what they take, and the price of one more; where the error of each measure comes from, the
    largest first, without what hardly counts; notes."""
    yield f"accuracy asked for: {judged_line(plan)}"
    stages = sorted(plan.cost.parts.items(), key=lambda item: -item[1])
    shown = (f"{STAGES.get(stage, stage)} {in_time(seconds)}" for stage, seconds in stages if seconds >= 0.05)
    yield f"predicted time: {', '.join(shown)}"
    ahead = rounds_ahead(plan)
    rounds = f"predicted rounds: {ahead.number} expected, {in_time(ahead.seconds)} in total"
    further = "; if the measured error is too large, another one: about "
    yield rounds if ahead.further is None else f"{rounds}{further}{in_time(ahead.further)}"
    measures = []
    for measure in plan.error:
        parts = {source: share.get(measure, 0.0) for source, share in plan.shares.items()}
        largest = sorted(parts.items(), key=lambda item: -item[1])
        counted = (f"{in_words(source)} {percent(v)}" for source, v in largest if v >= COUNTS * largest[0][1])
        measures.append(f"{short_words(measure)}: {', '.join(counted)}")
    yield f"predicted error: {'; '.join(measures)}"
    yield from (f"note: {note}" for note in plan.notes)


def judged_line(plan: Plan) -> str:
    """Return what the target of accuracy speaks of: the measures, and of which landing."""
    accuracy = plan.scene.accuracy
    of_it = "of the whole run" if accuracy.landing == "run" else f"of the {accuracy.landing} landing on the seat"
    names = enumeration(all_measures()[name].words for name in accuracy.measures)
    return f"{percent(accuracy.target, 3)} in {names} {of_it}"


def plan_json(plan: Plan) -> str:
    """Return a JSON object; times in s, memory in bytes, errors relative, ``scene`` in SI units with all keys filled.

    A number that is not finite, such as the error of a measure that is zero, is null.
    """
    scene = plan.scene
    data = {
        "title": scene.title,
        "read": dict(read_back(scene)),
        "level": plan.level,
        "kept": plan.kept,
        "target": scene.accuracy.target,
        "judged": judged_line(plan),
        "meets_target": plan.meets_target,
        "choices": [asdict(choice) for choice in plan.choices],
        **_cost(plan.cost),
        "rounds": asdict(rounds_ahead(plan)),
        "error": _by_asked_name(plan.error),
        "shares": {source: dict(share) for source, share in plan.shares.items()},
        "alternatives": [
            {"what": other.what, **_cost(other.cost), "error": _by_asked_name(other.error)}
            for other in plan.alternatives
        ],
        "notes": list(plan.notes),
        "scene": as_stated(scene, plan.method).model_dump(mode="json"),
    }
    text = json.dumps(without_nan(data), indent=1, allow_nan=False)
    return text.replace("\x7f", "\\u007f")  # the one control character that JSON leaves as it is


def _by_asked_name(error: Mapping[str, float]) -> dict[str, float]:
    """Return predicted errors by the names that the scene asks for them by."""
    return {asked_name(name): value for name, value in error.items()}


def _cost(cost: Cost) -> dict[str, object]:
    return {"time_s": cost.seconds, "stages_s": dict(cost.parts), "memory_bytes": cost.memory}
