"""A plan made finer where its run missed the target."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from seatfem.machine.rates import Machine
from seatfem.structures.rings import MOST_RINGS
from seatfem.study.impacts.budget import Source
from seatfem.study.impacts.variations import FEWER
from seatfem.study.planning.choices import described
from seatfem.study.planning.filling import replaced, value_of
from seatfem.study.planning.means import cost_of
from seatfem.study.planning.options import (
    BAND,
    BANDS,
    CONTACT_SIZE,
    MODES,
    RING_NUMBERS,
    RINGS,
    SIZE,
    STEP,
    TOLERANCE,
    fitted,
)
from seatfem.study.planning.plan import Plan
from seatfem.study.scene import Scene

LEAST: Final = 1.6  # factor by which a source is made smaller at least ...
MOST: Final = 4.0  # ... and at most, in one go
MESH_ORDER: Final = 1.0  # of convergence that is counted on
KEYS: Final[Mapping[Source, tuple[str, ...]]] = {
    "mesh": (SIZE, CONTACT_SIZE),
    "reduction": (BAND, TOLERANCE),
    "time_step": (STEP,),
    "model": (MODES,),
    "patch": (RINGS,),
}


def finer_keys(plan: Plan, source: Source, factor: float, machine: Machine | None) -> Plan | None:
    """``plan`` with the keys behind ``source`` made finer; ``None`` where the file states them or none can be finer."""
    factor = min(max(factor, LEAST), MOST)
    values = {key: _finer(plan.scene, key, factor) for key in KEYS[source] if _is_open(plan, key)}
    if CONTACT_SIZE not in values and SIZE in values:
        values[SIZE] = max(values[SIZE], value_of(plan.scene, CONTACT_SIZE) or 0.0)
    scene = replaced(plan.scene, values)
    if scene == plan.scene:
        return None
    reason = f"made finer: the {source.replace('_', ' ')}'s share of the error was {factor:.2g} times too large"
    choices = tuple(
        replace(choice, value=described(choice.key, values[choice.key]), reason=reason)
        if choice.key in values
        else choice
        for choice in plan.choices
    )
    shares = {
        s: {name: value / (factor if s == source else 1.0) for name, value in share.items()}
        for s, share in plan.shares.items()
    }
    whole = {name: sum(share.get(name, 0.0) for share in plan.shares.values()) for name in plan.error}
    left = {name: sum(share.get(name, 0.0) for share in shares.values()) for name in plan.error}
    error = {name: bar * left[name] / whole[name] if whole[name] else bar for name, bar in plan.error.items()}
    kept = source in ("time_step", "model")  # the seat is there from the round before
    cost = cost_of(scene, plan.level, machine, kept=kept)
    return replace(plan, scene=scene, choices=choices, shares=shares, error=error, cost=cost, kept=kept)


def _is_open(plan: Plan, key: str) -> bool:
    return any(choice.key == key and not choice.given for choice in plan.choices) and bool(value_of(plan.scene, key))


def _finer(scene: Scene, key: str, factor: float) -> float | int:
    value = value_of(scene, key)
    match key:
        case "reed.n_modes":
            more: int = math.ceil(value * FEWER ** math.ceil(math.log2(factor)))
            return min(1000, more)
        case "seat.greens.bandwidth":
            wider = [band for band in BANDS if band > value * (1 + 1e-9)]
            return wider[0] if wider else float(LEAST * value)
        case "seat.mesh.size" | "seat.mesh.contact_size":
            return float(f"{value / factor ** (1 / MESH_ORDER):.2g}")
        case "contact.rings":
            return next((rings for rings in RING_NUMBERS if rings > value), MOST_RINGS)
        case "run.time_step":
            return fitted(value / factor, scene.run.duration)
        case _:
            return float(value / factor)
