"""Plans that the last runs of scenes ended with: the next run of the same scene begins with that plan.

A plan is data: the values of its keys, and what it tells. It is kept where a run met its target by refining.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final, get_args

from impact.files.atomic import write_whole
from impact.files.input_files import read_text
from seatfem.machine.code import cache_folder, code_version
from seatfem.structures.method import AnyLevel
from seatfem.structures.store import content_key
from seatfem.study.method import FIELDS, MODEL, PORTS, REDUCTION, RINGS, RunMethod, stated_method
from seatfem.study.planning.plan import Alternative, Choice, Cost, Plan
from seatfem.study.runs.round import Round
from seatfem.study.scene import Scene
from seatfem.study.scene.parcel import by_content

MOST: Final = 100_000  # bytes of the file
NOTE: Final = "plan of the last run of this scene, which reached its target"
UNSOUND: Final = (OSError, ValueError, TypeError, LookupError, AttributeError)


def ended_plan(scene: Scene) -> Plan | None:
    """Return the plan of this scene's last run that met its target; ``None``: there was none, or it is not sound."""
    try:
        return plan_told(scene, json.loads(read_text(_file(scene), MOST, ValueError)), NOTE)
    except UNSOUND:
        return None


def plan_told(scene: Scene, found: Mapping[str, Any], note: str) -> Plan | None:
    """Return a plan of ``scene`` as `told` has it, with a ``note`` of where it is from; ``None``: it is not sound."""
    try:
        method = _method(scene, found["values"])
        cost = Cost(**found["cost"])
        alternatives = tuple(Alternative(**{**each, "cost": Cost(**each["cost"])}) for each in found["alternatives"])
        choices = tuple(Choice(**choice) for choice in found["choices"])
        error, shares, parts = (dict(found[name]) for name in ("error", "shares", "parts"))
        if not all(set(scene.accuracy.judged) <= set(each) for each in (error, *shares.values(), *parts.values())):
            return None
        notes, without = map(str, found["notes"]), tuple(found["without"])
    except UNSOUND:
        return None
    return Plan(scene, method, choices, cost, error, alternatives, shares, False, (*notes, note), without, parts)


def told(plan: Plan) -> dict[str, Any]:
    """Return a plan without its scene, as JSON can hold it."""
    return {
        "values": {key: plan.method.value(key) for key in FIELDS},
        "cost": asdict(plan.cost),
        "alternatives": [asdict(each) for each in plan.alternatives],
        "choices": [asdict(each) for each in plan.choices],
        "error": dict(plan.error),
        "shares": {str(source): dict(part) for source, part in plan.shares.items()},
        "notes": [note for note in plan.notes if note != NOTE],
        "without": list(plan.without),
        "parts": {key: dict(errors) for key, errors in plan.parts.items()},
    }


def remember(done: Round) -> None:
    """Keep the plan of a round that met the target and was not the first, where the store can be written to."""
    plan = done.plan
    if done.met is not True or done.number == 1:
        return
    with suppress(OSError, TypeError):
        path = _file(plan.scene)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, json.dumps(told(plan)).encode())


def _method(scene: Scene, values: Mapping[str, object]) -> RunMethod:
    """Return the method with these values of `FIELDS`; raises `ValueError` for what no plan has."""
    stated = stated_method(scene)
    if values[MODEL] not in get_args(AnyLevel) or values[REDUCTION] != stated.value(REDUCTION):
        raise ValueError(f"{values[MODEL]}, {values[REDUCTION]} must be the stated ones")
    numbers = {key: values[key] for key in FIELDS if key not in (MODEL, REDUCTION)}
    for value in numbers.values():
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float) or not _sound(value)):
            raise ValueError(f"{value!r} must be a positive number")
    ports, rings = numbers.pop(PORTS), numbers[RINGS]
    along = stated.along(scene, ports, rings) if isinstance(ports, int) and isinstance(rings, int) else stated
    return along.replaced({MODEL: values[MODEL], **numbers})


def _sound(value: float) -> bool:
    return math.isfinite(value) and value > 0


def _file(scene: Scene) -> Path:
    """Return the file of a scene's plan, named by what the scene asks for, its files' content, and the code."""
    key = content_key({"scene": by_content(scene), "program": code_version()})
    return cache_folder() / "ended" / f"{key}.json"
