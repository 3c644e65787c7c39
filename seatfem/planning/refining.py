"""A plan made finer where its run missed the target."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from seatfem.planning.choices import described
from seatfem.planning.costs import predict_cost
from seatfem.planning.filling import replaced
from seatfem.planning.machine import Machine
from seatfem.planning.options import BAND, BANDS, CONTACT_SIZE, MODES, SIZE, STEP, TOLERANCE, fitted
from seatfem.planning.plan import Plan
from seatfem.runs.budget import Source
from seatfem.runs.variations import FEWER
from seatfem.scene import Scene

LEAST: Final = 1.6  # factor by which a source is made smaller at least ...
MOST: Final = 4.0  # ... and at most, in one go
MESH_ORDER: Final = 1.0  # of convergence that is counted on
KEYS: Final[Mapping[Source, tuple[str, ...]]] = {
    "mesh": (SIZE, CONTACT_SIZE),
    "reduction": (BAND, TOLERANCE),
    "time_step": (STEP,),
    "model": (MODES,),
}


def finer_keys(plan: Plan, source: str, factor: float, machine: Machine | None) -> Plan | None:
    """``plan`` with the keys behind ``source`` made finer; ``None`` where the file states them or there are none."""
    named = next((known for known in KEYS if known == source), None)
    factor = min(max(factor, LEAST), MOST)
    keys = [key for key in KEYS[named] if _is_open(plan, key)] if named is not None else []
    if named is None or not keys:
        return None
    values = {key: _finer(plan.scene, key, factor) for key in keys}
    scene = replaced(plan.scene, values)
    reason = f"made finer: the {named.replace('_', ' ')}'s share of the error was {factor:.2g} times too large"
    choices = tuple(
        replace(choice, value=described(choice.key, values[choice.key]), reason=reason)
        if choice.key in values
        else choice
        for choice in plan.choices
    )
    shares = {
        s: {name: value / (factor if s == named else 1.0) for name, value in share.items()}
        for s, share in plan.shares.items()
    }
    whole = {name: sum(share.get(name, 0.0) for share in plan.shares.values()) for name in plan.error}
    left = {name: sum(share.get(name, 0.0) for share in shares.values()) for name in plan.error}
    error = {name: bar * left[name] / whole[name] if whole[name] else bar for name, bar in plan.error.items()}
    kept = plan.kept and named in ("time_step", "model")
    cost = predict_cost(scene, plan.level, machine)
    return replace(plan, scene=scene, choices=choices, shares=shares, error=error, cost=cost, kept=kept)


def _is_open(plan: Plan, key: str) -> bool:
    return any(choice.key == key and not choice.given for choice in plan.choices) and bool(_of(plan.scene, key))


def _of(scene: Scene, key: str) -> Any:
    value: Any = scene
    for part in key.split("."):
        value = getattr(value, part)
    return value


def _finer(scene: Scene, key: str, factor: float) -> float | int:
    value = _of(scene, key)
    match key:
        case "reed.n_modes":
            more: int = math.ceil(value * FEWER ** math.ceil(math.log2(factor)))
            return min(1000, more)
        case "seat.greens.bandwidth":
            wider = [band for band in BANDS if band > value * (1 + 1e-9)]
            return wider[0] if wider else float(LEAST * value)
        case "seat.mesh.size" | "seat.mesh.contact_size":
            return float(f"{value / factor ** (1 / MESH_ORDER):.2g}")
        case "run.time_step":
            return fitted(value / factor, scene.run.duration)
        case _:
            return float(value / factor)
