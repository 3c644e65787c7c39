"""Cache of final plans and of expensive numbers of runs: JSON files named by the hash of all that they depend on.

A plan is stored if its run met the target of accuracy.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, get_args

from impact.files.safe_files import MB, read_text, write_whole
from impact.greens.base import Array
from impact.storage import hdf5
from seatfem.machine.code import cache_folder, code_version
from seatfem.structures import cache
from seatfem.structures.cache import content_key
from seatfem.structures.method import AnyLevel
from seatfem.study.impacts.touches import Touches
from seatfem.study.method import (
    FIELDS,
    MODEL,
    PORTS,
    REDUCTION,
    RINGS,
    STOPPER_ARCS,
    STOPPER_RINGS,
    RunMethod,
    stated_method,
)
from seatfem.study.plan import Choice, Plan
from seatfem.study.runs.round import Round
from seatfem.study.scene import ContactGeometry, Scene
from seatfem.study.scene.files import describe_content

MOST_BYTES: Final = 100_000  # largest size of a cached file that is read
MOST_ARRAYS: Final = 256 * MB  # most bytes of all arrays in the cache
OLDEST: Final = 2000  # most files of plans, and of numbers, in the cache; older ones are deleted
UNSOUND: Final = (OSError, ValueError, TypeError, LookupError, AttributeError)


def cached_plan(scene: Scene) -> Plan | None:
    """Return the plan of this scene's last run that met its target; ``None`` if there is none, or its file is bad."""
    try:
        file = _plan_file(scene)
        data = json.loads(read_text(file, MOST_BYTES, ValueError))
        return plan_from_json(scene, data)
    except UNSOUND:
        return None


def plan_from_json(scene: Scene, data: Mapping[str, Any]) -> Plan | None:
    """Return the plan of ``scene`` from `plan_to_json`; ``None`` if the data are invalid."""
    try:
        method = _method(stated_method(scene), scene.geometry, data["values"])
        choices = tuple(Choice(**choice) for choice in data["choices"])
    except UNSOUND:
        return None
    return Plan(scene, method, choices)


def plan_to_json(plan: Plan) -> dict[str, Any]:
    """Return a plan without its scene and its errors, as JSON-compatible values."""
    return {
        "values": plan.method.values,
        "choices": [asdict(replace(choice, leaves="")) for choice in plan.choices],
    }


def save_plan(scene: Scene, done: Round) -> None:
    """Store the plan of a ``scene``'s round that met the target, where the cache can be written to."""
    if done.met is True:
        with suppress(OSError, TypeError):
            _save_json(_plan_file(scene), plan_to_json(done.plan))


def _method(stated: RunMethod, geometry: ContactGeometry, values: Mapping[str, object]) -> RunMethod:
    """Return the stated method with ``values`` of `FIELDS` in it; raises `ValueError` for values that no plan has."""
    if values[MODEL] not in get_args(AnyLevel) or values[REDUCTION] != stated.value(REDUCTION):
        raise ValueError(f"{values[MODEL]}, {values[REDUCTION]} must be the stated ones")
    for key in FIELDS.keys() - {MODEL, REDUCTION}:
        value = values[key]
        number = isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < math.inf
        if value is not None and not number:
            raise ValueError(f"{value!r} must be a positive number")
    if not all(isinstance(values[key], int | None) for key in (PORTS, RINGS, STOPPER_ARCS, STOPPER_RINGS)):
        raise ValueError("parts must be whole numbers")
    return stated.with_values(geometry, values)


def _plan_file(scene: Scene) -> Path:
    """Return the file of a scene's plan, named by the hash of the scene, of the files it reads, and of the code."""
    key = content_key({"scene": describe_content(scene), "program": code_version()})
    return cache_folder() / "ended" / f"{key}.json"


def _save_json(path: Path, data: Mapping[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, json.dumps(data).encode())
    for file in sorted(path.parent.glob("*.json"), key=lambda file: -file.stat().st_mtime)[OLDEST:]:
        file.unlink(missing_ok=True)


def cached_numbers(
    done: Round, touches: Touches, what: str, compute: Callable[[], Mapping[str, Any]]
) -> Mapping[str, Any]:
    """Return numbers of one run of a round from the cache, or compute and store them.

    The cache is valid for the same scene, method, forces of the run, and program. If the folder is not writable or a
    file was changed, as the hash in it tells, the numbers are computed again.

    Args:
        done: the round.
        touches: contact history of its run, or of a run of its scene on another seat.
        what: name of the numbers.
        compute: function that returns them as JSON-compatible values.
    """
    path = _number_file(done, touches, what)
    with suppress(*UNSOUND):
        data = json.loads(read_text(path, MOST_BYTES, ValueError))
        numbers: dict[str, Any] = data["numbers"]
        if data["hash"] == _hash_of(numbers):
            return numbers
    numbers = dict(compute())
    with suppress(OSError, TypeError):
        _save_json(path, {"numbers": numbers, "hash": _hash_of(numbers)})
    return numbers


def cached_array(done: Round, touches: Touches, what: str, at: Array, compute: Callable[[], Array]) -> Array:
    """Return an array of one run of a round, its values ``at`` places, from the cache, or compute and store it, as
    `cached_numbers`."""

    def write(file: Any, values: Array) -> None:
        file["values"] = values

    key = content_key({"of": _number_file(done, touches, what).stem, "at": at})
    read = partial(hdf5.finite_array, key="values")
    return cache.load_or_compute("arrays", key, compute, content=what, read=read, write=write, most_bytes=MOST_ARRAYS)


def _hash_of(numbers: Mapping[str, Any]) -> str:
    return content_key({"numbers": json.dumps(numbers)})


def _number_file(done: Round, touches: Touches, what: str) -> Path:
    parts = None if touches.parts is None else touches.parts.rows.force
    key = content_key(
        {
            "what": what,
            "scene": describe_content(done.plan.scene),
            "method": done.plan.method.values,
            "forces": [touches.seat.force, parts, touches.stopper_force],
            "gap": touches.seat.rows.gap,
            "ends": None if touches.seat.rows.is_uniform else touches.seat.rows.ends,
            "step": touches.seat.dt,
            "program": code_version(),
        }
    )
    return cache_folder() / "numbers" / f"{key}.json"
