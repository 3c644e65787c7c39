"""What is said to make an error smaller names keys that the kinds of the scene have, and begins with a verb."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import pytest

from seatfem.structures.kinds import Structure, kinds_of
from seatfem.study.impacts.touches import SOURCES, STOPPER, STRIKER
from seatfem.study.ladders.table import LADDERS
from seatfem.study.runs.remedies import OF_SOURCES, STATED, has_key_of_kind, remedy_by_key, remedy_by_source
from seatfem.study.scene import Scene
from seatfem.study.scene.contact import Contact, Stopper
from seatfem.study.scene.problems import tables_in
from seatfem.study.scene.run import Run

KEY = re.compile(r"\b(?:seat|reed|stopper|contact|run)\.\w+(?:\.\w+)?")
VERBS = ("refine", "raise", "lower", "take", "keep", "shorten", "divide", "average", "state")


def scene_of(kind: type[Structure]) -> Any:
    """Return a scene with one kind in all three roles; of its tables only their types matter here."""
    body = kind.model_construct()
    stopper = Stopper.model_construct(body=body)
    return SimpleNamespace(seat=body, reed=body, stopper=stopper, contact=Contact(), run=Run.model_construct())


def keys_of(table: Any) -> set[str]:
    """Return the keys of a table, and of the tables in it with a dot."""
    nested = {
        f"{name}.{key}"
        for name, field in type(table).model_fields.items()
        for inner in tables_in(field.annotation)
        for key in inner.model_fields
    }
    return set(type(table).model_fields) | nested


@pytest.mark.parametrize("kind", kinds_of(), ids=lambda kind: kind.__name__)
def test_remedies_name_keys_of_the_kind(kind: type[Structure]) -> None:
    scene = scene_of(kind)
    tables = {name: keys_of(table) for name, table in vars(scene).items()} | {
        STOPPER: keys_of(scene.stopper) | keys_of(scene.stopper.body)
    }
    remedies = [remedy_by_source(scene, source) for source in (*SOURCES, STRIKER, STOPPER, "lip", "record")]
    remedies += [remedy_by_key(scene, ladder.key) for ladder in LADDERS if ladder.key != "stopper.arcs"]
    for words in filter(None, remedies):
        assert words.startswith(VERBS)
        for named in KEY.findall(words):
            role, _, key = named.partition(".")
            assert key in tables[role], (words, kind)


def test_each_key_of_a_remedy_is_one_of_some_kind() -> None:
    """Some kind has each key that a remedy names, so that no key is renamed without its remedy."""
    for key in {*STATED, *(each for keys in OF_SOURCES.values() for each in keys)}:
        assert any(has_key_of_kind(scene_of(kind), key) for kind in kinds_of()), key
    assert set(OF_SOURCES) <= {*SOURCES, STRIKER, STOPPER}
    assert set(Scene.model_fields) >= {key.partition(".")[0] for key in STATED}
