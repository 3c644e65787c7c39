"""Where the last run of a scene ended: the next one of the same scene begins with that method, and needs no rounds."""

from __future__ import annotations

import json
import math
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

from impact.files.atomic import write_whole
from impact.files.input_files import read_text
from seatfem.machine.code import cache_folder, code_version
from seatfem.structures.store import content_key
from seatfem.study.method import FIELDS, PORTS
from seatfem.study.planning.costs import predict_cost
from seatfem.study.planning.plan import Plan
from seatfem.study.planning.reasons import described
from seatfem.study.runs.round import Round
from seatfem.study.scene import Scene

MOST: Final = 10_000  # bytes of the file
WORDS: Final = "as the last run of this scene ended, where it met its target"


def begun_where_it_ended(plan: Plan) -> Plan:
    """``plan`` with the open numbers of the last run that met its target by refining; itself where there was none, or
    where its seat is modelled otherwise."""
    try:
        found = json.loads(read_text(_file(plan.scene), MOST, ValueError))
        level, values = found["level"], {key: found["values"][key] for key in FIELDS if key in found["values"]}
    except (OSError, ValueError, TypeError, LookupError):  # none, or none that is sound: the plan stands as it is
        return plan
    numbers = {key: value for key, value in values.items() if plan.is_open(key) and _replaces(plan, key, value)}
    if level != plan.level or not numbers:
        return plan
    method = plan.method.along(plan.scene, int(numbers[PORTS])) if PORTS in numbers else plan.method
    method = method.replaced({key: value for key, value in numbers.items() if key != PORTS})
    choices = tuple(
        replace(choice, value=described(choice.key, numbers[choice.key]), reason=WORDS)
        if choice.key in numbers
        else choice
        for choice in plan.choices
    )
    return replace(plan, method=method, choices=choices, cost=predict_cost(plan.scene, method), kept=False)


def remember(done: Round) -> None:
    """Keep the numbers of a round that met the target and was not the first, where the store can be written to."""
    plan = done.plan
    if not done.met or done.number == 1:
        return
    values = {key: plan.method.value(key) for key in FIELDS if plan.is_open(key)}
    numbers = {key: value for key, value in values.items() if isinstance(value, int | float)}
    with suppress(OSError):
        path = _file(plan.scene)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, json.dumps({"level": plan.level, "values": numbers}).encode())


def _replaces(plan: Plan, key: str, value: object) -> bool:
    """Whether it is a positive number where the plan has one of its kind."""
    there = plan.method.value(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not isinstance(there, int | float):
        return False
    return math.isfinite(value) and value > 0 and isinstance(value, int) == isinstance(there, int) and value != there


def _file(scene: Scene) -> Path:
    """By all that the scene asks for, its files by content, and by the code."""
    asked = scene.model_dump(exclude={"title"}, exclude_unset=True)
    key = content_key({"scene": asked, "program": code_version()})
    return cache_folder() / "ended" / f"{key}.json"
