"""A scene with some of its keys stated otherwise, as if the file said so."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from seatfem.study.method import FIELDS, RunMethod, has_key
from seatfem.study.scene import Scene, SceneError
from seatfem.study.scene.problems import explain

Settings = Mapping[str, object]
"""Values by dotted key, written as in a scene file ("1 mm"); ``None`` takes the key out of the file."""

UNITS: Final = {
    "seat.mesh.size": "m",
    "seat.mesh.contact_size": "m",
    "seat.greens.bandwidth": "Hz",
    "run.time_step": "s",
}
ALL_OPEN: Final[Settings] = dict.fromkeys(FIELDS)


def scene_with(path: Path, settings: Settings) -> Scene:
    """The scene of a file with ``settings`` stated: a planner obeys them, and chooses what is taken out.

    Raises:
        SceneError: a value that does not belong in a scene.
    """
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    for key, value in settings.items():
        _state(data, key.split("."), value)
    try:
        return Scene.model_validate(data, context={"folder": path.parent})
    except ValidationError as error:
        raise SceneError(explain(error, Scene, data, path, {})) from None


def written(key: str, value: object) -> object:
    """An SI value of a key as a scene file has it: ``"0.001 m"``."""
    return f"{value!r} {UNITS[key]}" if key in UNITS else value


def stated_choices(scene: Scene, method: RunMethod) -> Settings:
    """Everything that decides the fidelity of a planned scene, as settings."""
    values = {key: method.value(key) for key in FIELDS if has_key(scene, key)}
    return {key: written(key, value) for key, value in values.items() if value is not None}


def _state(table: dict[str, Any], path: list[str], value: object) -> None:
    """Set, or with ``None`` remove, one key of nested tables."""
    *tables, name = path
    for part in tables:
        if part not in table and value is None:
            return
        table = table.setdefault(part, {})
    if value is None:
        table.pop(name, None)
    else:
        table[name] = copy.deepcopy(value)
