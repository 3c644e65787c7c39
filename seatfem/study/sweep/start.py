"""Plans that a scene of a study begins with: that which one of the first scenes with its seat has ended with.

Their rounds of refinement are done, so that one round suffices for most that follow; each measures its own error, and
is refined where it misses its target. What a scene begins with depends on those scenes alone, not on when they ran.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Final

from seatfem.machine.rates import Machine
from seatfem.structures.store import content_key
from seatfem.study.accuracy.seat_waves import tells_waves
from seatfem.study.method import FIELDS, has_key, is_given, value_of, written
from seatfem.study.planning.costs import predict_cost
from seatfem.study.planning.plan import Plan
from seatfem.study.runs.ended import plan_told, told
from seatfem.study.scene import Scene

PILOTS: Final = 4
"""Scenes with a seat that begin as the first one has ended. All others begin as the second dearest of these five has
ended: one may be an exception, but what two had to refine most others would."""
OF_ALL: Final = ("contact", "reed stress", "error budget")
NOTE: Final = "plan of another scene of the study, which reached its target"

Start = Mapping[str, Any]
"""Of JSON: a plan ("plan"), of which scenes ("like"), its predicted seconds ("work"), and the keys of its seat ("seat")
as a scene file has them, as far as the scene's own does not say."""


def start_of(plan: Plan) -> Start:
    """Return what scenes after that of the ``plan`` may begin with; nothing that this computer measured is in it."""
    scene, method = plan.scene, plan.method
    open_keys = [key for key in FIELDS if key.startswith("seat.") and has_key(scene, key) and not is_given(scene, key)]
    chosen = {key: method.value(key) for key in open_keys}
    cost = predict_cost(scene, method, Machine(), kept=True)
    choices = tuple(replace(choice, reason="") for choice in plan.choices)
    plain = replace(plan, cost=cost, alternatives=(), notes=(), choices=choices)
    return {
        "like": _like(scene),
        "work": sum(cost.parts[stage] for stage in OF_ALL),
        "seat": {key: written(key, value) for key, value in chosen.items() if value not in (None, "auto")},
        "plan": told(plain),
    }


def begun(scene: Scene, start: Start, *, as_it_is: bool = False) -> Plan | None:
    """Return the plan that ``scene`` begins with; ``None`` where it is too different for one of these.

    Nor does it begin with one that leaves out the waves of its seat, unless ``as_it_is``: what they would change is
    known by pre-runs alone, and those of another scene would stand in this one's error bar.
    """
    if start.get("like") != _like(scene):
        return None
    plan = plan_told(scene, start["plan"], NOTE)
    if plan is not None and plan.method.seat.static and not tells_waves(scene, plan.method) and not as_it_is:
        return None
    return plan


def chosen(starts: Iterable[Start]) -> Start:
    """Return what a scene begins with, of what those before it have left; nothing where they left nothing."""
    ranked = sorted(starts, key=lambda start: float(start["work"]))
    return ranked[max(0, len(ranked) - 2)] if ranked else {}


def _like(scene: Scene) -> str:
    """Return the same text for all scenes that may share one plan: duration, filter and target, kinds, and all stated
    keys of `FIELDS`."""
    stated = {key: value_of(scene, key) for key in FIELDS if is_given(scene, key)}
    tables = scene.model_dump(include={"run", "accuracy"}, exclude_unset=True)
    kinds = {name: body.kind for name, body in scene.bodies.items()}
    return content_key({"tables": tables, "stated": stated, "kinds": kinds, "law": scene.contact.law.kind})[:16]
