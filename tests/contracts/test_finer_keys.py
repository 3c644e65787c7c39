"""Every key with a finer value is in the error budget, or a reason says why not."""

from __future__ import annotations

import typing
from collections.abc import Iterator

from pydantic import BaseModel

from seatfem.study.ladders.table import LADDERS
from seatfem.study.method import FIELDS
from tests.steps import SOURCES, kinds_of

ROLES = ("seat", "reed", "stopper")
HOW = ("mesh", "greens")  # tables of a body that say how it is computed, beside ...
ALONE = ("model", "n_modes")
LEFT_OUT = {f"{role}.greens.{key}": "another way to the same g" for role in ROLES for key in ("method", "max_vectors")}
BEHIND = {key: ladder.source for ladder in LADDERS for key in (ladder.key, *ladder.also)}


def tables(annotation: object) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in typing.get_args(annotation):
        yield from tables(part)


def keys_of_bodies() -> set[str]:
    """Return the dotted keys of how bodies of any kind are computed in any role."""
    keys = set()
    for kind in kinds_of():
        for name, field in kind.model_fields.items():
            nested = [f"{name}.{key}" for table in tables(field.annotation) for key in table.model_fields]
            keys |= set(nested if name in HOW else [name] if name in ALONE else [])
    return {f"{role}.{key}" for role in ROLES for key in keys}


def test_every_key_of_how_a_scene_is_computed_has_a_source_or_a_reason() -> None:
    keys = keys_of_bodies() | set(FIELDS) | {"stopper.arcs", "stopper.rings"}
    assert {"seat.mesh.size", "reed.greens.bandwidth", "contact.rings", "run.time_step"} <= keys
    assert sorted(keys - set(BEHIND) - set(LEFT_OUT)) == []
    assert not set(BEHIND) & set(LEFT_OUT)


def test_every_source_is_one_of_the_budget() -> None:
    assert set(BEHIND.values()) <= {*SOURCES, "striker", "stopper", "lip", "record"}
