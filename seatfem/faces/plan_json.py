"""A plan, for other programs."""

from __future__ import annotations

import json
from dataclasses import asdict

from impact.files.table import without_nan
from seatfem.study.method import as_stated
from seatfem.study.planning.plan import Cost, Plan
from seatfem.study.planning.refining import rounds_ahead


def plan_json(plan: Plan) -> str:
    """One JSON object; times in s, memory in bytes, errors relative, ``scene`` in SI units with every key filled.

    A number that is not finite, such as the error of a measure that is zero, is null.
    """
    scene = plan.scene
    data = {
        "title": scene.title,
        "level": plan.level,
        "kept": plan.kept,
        "target": scene.accuracy.target,
        "meets_target": plan.meets_target,
        "choices": [asdict(choice) for choice in plan.choices],
        **_cost(plan.cost),
        "rounds": asdict(rounds_ahead(plan)),
        "error": dict(plan.error),
        "shares": {source: dict(share) for source, share in plan.shares.items()},
        "alternatives": [
            {"what": other.what, **_cost(other.cost), "error": dict(other.error)} for other in plan.alternatives
        ],
        "notes": list(plan.notes),
        "scene": as_stated(scene, plan.method).model_dump(mode="json"),
    }
    text = json.dumps(without_nan(data), indent=1, allow_nan=False)
    return text.replace("\x7f", "\\u007f")  # the one control character that JSON leaves as it is


def _cost(cost: Cost) -> dict[str, object]:
    return {"time_s": cost.seconds, "stages_s": dict(cost.parts), "memory_bytes": cost.memory}
