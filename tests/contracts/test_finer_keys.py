"""Every key with a finer value is in the error budget, or a reason says why not; references are finer in every key."""

from __future__ import annotations

import typing
from collections.abc import Iterator
from dataclasses import replace

import pytest
from pydantic import BaseModel

from seatfem.study.ladders.table import LEFT_OUT, ladder_of, ladders, not_finer
from seatfem.study.method import FIELDS, MODEL, ORDER, REED_BAND, RINGS, STEP, RunMethod
from tests.steps import SOURCES, Method, kinds_of

ROLES = ("seat", "reed", "stopper")
HOW = ("mesh", "greens")  # tables of a body that say how it is computed, beside ...
ALONE = ("model", "n_modes")
BEHIND = {key: ladder.source for ladder in ladders() for key in (ladder.key, *ladder.also)}


def tables(annotation: object) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in typing.get_args(annotation):
        yield from tables(part)


def keys_of_bodies() -> set[str]:
    """Dotted, of how bodies of any kind are computed in any role."""
    found = set()
    for kind in kinds_of():
        for name, field in kind.model_fields.items():
            nested = [f"{name}.{key}" for table in tables(field.annotation) for key in table.model_fields]
            found |= set(nested if name in HOW else [name] if name in ALONE else [])
    return {f"{role}.{key}" for role in ROLES for key in found}


def test_every_key_of_how_a_scene_is_computed_has_a_source_or_a_reason() -> None:
    keys = keys_of_bodies() | set(FIELDS) | {"stopper.arcs", "stopper.rings"}
    assert {"seat.mesh.size", "reed.greens.bandwidth", "contact.rings", "run.time_step"} <= keys
    assert sorted(keys - set(BEHIND) - set(LEFT_OUT)) == []
    assert not set(BEHIND) & set(LEFT_OUT)


def test_every_source_is_one_of_the_budget() -> None:
    assert set(BEHIND.values()) <= {*SOURCES, "striker", "stopper", "lip", "record"}


METHOD = RunMethod(
    Method(bandwidth=1e5, tolerance=0.01, size=1e-3, contact_size=5e-4, n_modes=10),
    Method(n_modes=20, bandwidth=6e4),
    1e-7,
)
FINER = METHOD.replaced(
    {
        key: value * (0.5 if ladder.falls else 3)
        for key in FIELDS
        if (ladder := ladder_of(key)) is not None and key not in (MODEL, ORDER)
        if isinstance(value := METHOD.value(key), int | float)
    }
)


def test_a_finer_reference_is_finer_in_every_key() -> None:
    assert not_finer(METHOD, FINER) == ()


@pytest.mark.parametrize("key", [RINGS, REED_BAND, STEP, "seat.mesh.contact_size", "reed.n_modes"])
def test_a_reference_that_keeps_a_key_is_told(key: str) -> None:
    assert not_finer(METHOD, FINER.replaced({key: METHOD.value(key)})) == (key,)
    assert not_finer(replace(METHOD, time_step=None), FINER) == ()
