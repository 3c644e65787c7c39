"""Each key with a finer value is in the error budget, or a reason says why not; a remedy names keys of its kinds."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import pytest
from pydantic import BaseModel

from seatfem.structures.kinds import Structure, kinds_of
from seatfem.study.impacts.touches import SOURCES, STOPPER, STRIKER
from seatfem.study.ladders.table import LADDERS
from seatfem.study.method import FIELDS
from seatfem.study.runs.round import remedy_by_key, remedy_by_source
from seatfem.study.scene.contact import Contact, Stopper
from seatfem.study.scene.problems import tables_in
from seatfem.study.scene.run import Run

KEY = re.compile(r"\b(?:seat|reed|stopper|contact|run)\.\w+(?:\.\w+)?")
ROLES = ("seat", "reed", "stopper")
HOW = ("mesh", "greens")  # tables of a body that say how it is computed, beside ...
ALONE = ("model", "n_modes")
LEFT_OUT = {f"{role}.greens.{key}": "another way to the same g" for role in ROLES for key in ("method", "max_vectors")}
BEHIND = {key: ladder.source for ladder in LADDERS for key in (ladder.key, *ladder.also)}


def test_every_key_of_how_a_scene_is_computed_has_a_source_or_a_reason() -> None:
    bodies = {key for kind in kinds_of() for key in keys_of(kind) if key.partition(".")[0] in HOW or key in ALONE}
    keys = {f"{role}.{key}" for role in ROLES for key in bodies - {*HOW}} | {*FIELDS, "stopper.arcs", "stopper.rings"}
    assert {"seat.mesh.size", "reed.greens.bandwidth", "contact.rings", "run.time_step"} <= keys
    assert sorted(keys - set(BEHIND) - set(LEFT_OUT)) == []
    assert not set(BEHIND) & set(LEFT_OUT)
    assert set(BEHIND.values()) <= {*SOURCES, "striker", "stopper", "lip", "record"}


def plan_of(kind: type[Structure]) -> Any:
    """Return a plan of a scene with one kind in all three roles; of its tables only their types matter here."""
    body = kind.model_construct()
    stopper = Stopper.model_construct(body=body)
    tables = {"seat": body, "reed": body, "stopper": stopper, "contact": Contact(), "run": Run.model_construct()}
    return SimpleNamespace(scene=SimpleNamespace(**tables))


def keys_of(table: type[BaseModel]) -> set[str]:
    """Return the keys of a table, and of the tables in it with a dot."""
    nested = {
        f"{name}.{key}"
        for name, field in table.model_fields.items()
        for inner in tables_in(field.annotation)
        for key in inner.model_fields
    }
    return set(table.model_fields) | nested


@pytest.mark.parametrize("kind", kinds_of(), ids=lambda kind: kind.__name__)
def test_remedies_name_keys_of_the_kind(kind: type[Structure]) -> None:
    plan = plan_of(kind)
    tables = {name: keys_of(type(table)) for name, table in vars(plan.scene).items()}
    tables[STOPPER] = tables["stopper"] | tables["seat"]
    remedies = [remedy_by_source(plan, source) for source in (*SOURCES, STRIKER, STOPPER, "lip", "record")]
    remedies += [remedy_by_key(plan, ladder.key) for ladder in LADDERS if ladder.key != "stopper.arcs"]
    for words in filter(None, remedies):
        for named in KEY.findall(words):
            role, _, key = named.partition(".")
            assert key in tables[role], (words, kind)


def test_each_ladder_of_a_key_has_a_remedy_for_some_kind() -> None:
    """Some kind has each key that a remedy names, so that no key is renamed without its remedy."""
    for ladder in LADDERS:
        if ladder.key not in ("seat.mesh.order", "stopper.arcs"):
            assert any(remedy_by_key(plan_of(kind), ladder.key) for kind in kinds_of()), ladder.key
