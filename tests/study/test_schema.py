"""The JSON schema of scenes takes every example and refuses misspelt keys; docs/scene.md says what the program does."""

import json
import tomllib
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from scene_page import scene_pages

from seatfem.fields import kind_of
from seatfem.structures.kinds import kinds_of
from seatfem.study.scene.keys import scene_schema, scene_template, schema_text
from seatfem.study.sweep.study import study_schema

FOLDER = Path(__file__).parents[2] / "examples"
EXAMPLES = sorted({*FOLDER.glob("*.toml")} - {*FOLDER.glob("*_study.toml")})
SCHEMA = json.loads(schema_text(scene_schema()))
VALID = Draft202012Validator(SCHEMA)


@pytest.mark.slow
def test_it_is_a_schema() -> None:
    Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_it_takes_every_example(example: Path) -> None:
    given = tomllib.loads(example.read_text(encoding="utf-8"))
    if "seat" in given:
        assert [error.message for error in VALID.iter_errors(given)] == []


@pytest.mark.slow
def test_it_takes_a_scene_of_every_kind() -> None:
    for kind in kinds_of():
        if kind.__module__.startswith("seatfem."):
            VALID.validate(tomllib.loads(scene_template(kind_of(kind))))


STUDIES = Draft202012Validator(study_schema())


@pytest.mark.parametrize("example", sorted(FOLDER.glob("*_study.toml")), ids=lambda path: path.stem)
def test_that_of_studies_takes_every_example(example: Path) -> None:
    assert [error.message for error in STUDIES.iter_errors(tomllib.loads(example.read_text(encoding="utf-8")))] == []


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [
        ("seat", "bore_radus", "5 mm"), ("seat", "bore_radius", 5), ("seat", "kind", "anular"),
        ("reed", "release", {"mode": 1, "speed": "2 m/s"}),
        ("contact", "law", {"kind": "hertz", "stifness": "1 N/m^1.5"}), ("contact", "ports", "many"),
        ("accuracy", "measures", ["impuls"]), ("run", "steps", 3), ("sort", "of", "thing"),
    ],
)  # fmt: skip
def test_it_refuses_misspelt_keys_and_values(table: str, key: str, value: object) -> None:
    given = tomllib.loads(scene_template("flapper"))
    assert VALID.is_valid(given)
    given.setdefault(table, {})[key] = value
    assert not VALID.is_valid(given)


DOCS = Path(__file__).parents[2] / "docs"
PAGES = scene_pages()


def test_the_pages_are_current() -> None:
    written = [DOCS / "scene.md", *(DOCS / "scene").glob("*.md")]
    pages = {path.relative_to(DOCS).as_posix(): path.read_text(encoding="utf-8") for path in written}
    assert pages == PAGES, "run: make docs"
