"""Open keys of a scene and how they are filled: what the file states is never touched."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel

from seatfem.study.scene import Scene

_Model = TypeVar("_Model", bound=BaseModel)
OPEN_KEYS = (
    "seat.model",
    "seat.mesh.size",
    "seat.mesh.contact_size",
    "seat.mesh.order",
    "seat.greens.bandwidth",
    "seat.greens.tolerance",
    "seat.greens.method",
    "reed.n_modes",
    "run.time_step",
    "contact.rings",
)
"""What the planner may choose."""


def value_of(scene: Scene, key: str) -> Any:
    """What the scene has at the dotted ``key``."""
    value: Any = scene
    for part in key.split("."):
        value = getattr(value, part)
    return value


def is_given(scene: Scene, key: str) -> bool:
    """Whether the file states the dotted ``key``; "auto" and an absent value are no statement."""
    tables, _, name = key.rpartition(".")
    table = value_of(scene, tables)
    return name in table.model_fields_set and getattr(table, name) not in (None, "auto")


def has_key(scene: Scene, key: str) -> bool:
    """Whether this kind of scene knows the dotted ``key`` at all."""
    value: Any = scene
    for part in key.split("."):
        if not isinstance(value, BaseModel) or part not in type(value).model_fields:
            return False
        value = getattr(value, part)
    return True


def filled(scene: Scene, values: Mapping[str, object]) -> Scene:
    """``scene`` with those dotted keys of ``values`` filled in that are open; keys it does not know are left out."""
    for key, value in values.items():
        if has_key(scene, key) and not is_given(scene, key):
            scene = _with(scene, key.split("."), value)
    return scene


def replaced(scene: Scene, values: Mapping[str, object]) -> Scene:
    """``scene`` with the dotted keys set, whether stated or not."""
    for key, value in values.items():
        scene = _with(scene, key.split("."), value)
    return scene


def _with(table: _Model, path: list[str], value: object) -> _Model:
    name, *rest = path
    return table.model_copy(update={name: _with(getattr(table, name), rest, value) if rest else value})
