"""Remedies state in words how an error becomes smaller, and name only keys which the kinds of a scene have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from pydantic import BaseModel

from seatfem.study.impacts.touches import LIP, RECORD, STOPPER, STRIKER
from seatfem.study.ladders.patch import finer_stopper
from seatfem.study.method import (
    BAND,
    MODEL,
    MODES,
    PORTS,
    REED_BAND,
    RINGS,
    SEAT_MODES,
    STEP,
    STOPPER_ARCS,
    STOPPER_RINGS,
    TOLERANCE,
)
from seatfem.study.plan import Plan
from seatfem.study.scene import Scene
from seatfem.study.scene.problems import tables_in

STATED: Final[Mapping[str, str]] = {
    "seat.mesh": "refine",
    BAND: "raise",
    TOLERANCE: "lower",
    MODEL: "take a more complete",
    SEAT_MODES: "keep more",
    STEP: "shorten",
    "reed.mesh": "refine",
    REED_BAND: "raise",
    "reed.greens.tolerance": "lower",
    "reed.model": "take a more complete",
    MODES: "keep more",
    "stopper.mesh": "refine",
    "stopper.greens.bandwidth": "raise",
    "stopper.greens.tolerance": "lower",
    "stopper.model": "take a more complete",
    "stopper.n_modes": "keep more",
}
"""These verbs say how a key, or a table of keys, is changed so that its error becomes smaller."""
OF_SOURCES: Final[Mapping[str, tuple[str, ...]]] = {
    "mesh": ("seat.mesh",),
    "reduction": (BAND, TOLERANCE),
    "time_step": (STEP,),
    "model": (MODEL, SEAT_MODES, MODES),
    STRIKER: ("reed.mesh", REED_BAND, "reed.model"),
    STOPPER: ("stopper.mesh", "stopper.greens.bandwidth", "stopper.model", "stopper.n_modes"),
}
"""Keys of a source of which no single one leaves most."""
IN_WORDS: Final[Mapping[str, str]] = {
    PORTS: f"divide the lip by more {PORTS}",
    "patch": f"divide the contact face by {RINGS} = 4, or more",
    LIP: f"divide the lip by {PORTS}",
    RECORD: "average over more hammer blows, or measure to higher frequencies than 1/run.filter_width",
}
NOTHING: Final = "raise accuracy.target"  # where no key of the scene's kinds makes an error smaller


def remedy_of(plan: Plan, key: str, source: str) -> str:
    """Return in words how the error by a ``key`` of a ``source`` becomes smaller, or why it cannot."""
    if source == LIP and plan.scene.reed.states_contact:
        return "remove reed.contact_radius: the reed then meets the struck face in segments"
    return plan.refused.get(key) or remedy_by_key(plan.scene, key) or remedy_by_source(plan.scene, source) or NOTHING


def remedy_by_key(scene: Scene, key: str) -> str:
    """Return in words what to state at one ``key``, so that its error becomes smaller; "" if the scene has no such
    key."""
    if key == STOPPER_ARCS and scene.stopper is not None:
        finer = finer_stopper(scene, scene.stopper.parts)
        return "" if finer is None else f"state {key} = {finer.arcs} and {STOPPER_RINGS} = {finer.rings}"
    table = next((each for each in STATED if key == each or key.startswith(f"{each}.")), "")
    return IN_WORDS.get(key, f"{STATED[table]} {table}" if table and has_key_of_kind(scene, table) else "")


def remedy_by_source(scene: Scene, source: str) -> str:
    """Return in words what to state of a whole source of error; "" if the scene's kinds have none of its keys."""
    keys = (key for key in OF_SOURCES.get(source, ()) if has_key_of_kind(scene, key))
    return IN_WORDS.get(source) or ", or ".join(f"{STATED[key]} {key}" for key in keys)


def has_key_of_kind(scene: Scene, key: str) -> bool:
    """Return whether the kinds of a scene's tables have a dotted ``key``, whether or not the file states its table."""
    role, *path = key.split(".")
    table = getattr(scene, role)
    bodies = (table, table.body) if role == "stopper" and table is not None else (table,)
    return any(table is not None and _has(type(table), path) for table in bodies)


def _has(table: type[BaseModel], path: list[str]) -> bool:
    field = table.model_fields.get(path[0])
    return field is not None and (len(path) == 1 or any(_has(each, path[1:]) for each in tables_in(field.annotation)))
