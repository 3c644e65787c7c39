"""The JSON schema of scenes: it takes every example, and refuses misspelt keys and kinds of values."""

import json
import re
import tomllib
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from seatfem.fields import kind_of
from seatfem.structures.kinds import kinds_of
from seatfem.study.scene.keys import scene_schema, scene_template, schema_text
from seatfem.study.sweep.study import Optimise, Outputs, Study, load_study, study_schema, study_template

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


def test_a_study_to_begin_with_is_one(tmp_path: Path) -> None:
    """The template is a study as it is, and with the keys of its comments, which are all there are."""
    (tmp_path / "flapper.toml").write_text(scene_template("flapper"), encoding="utf-8")
    path, text = tmp_path / "a.toml", study_template(file="a.toml")
    path.write_text(text, encoding="utf-8")
    assert load_study(path).number_of_scenes == 32
    STUDIES.validate(tomllib.loads(text))
    keys = re.compile(r"^# (?=(?!seatfem)[\w.]+ = |\[)", re.MULTILINE)
    whole = tomllib.loads(keys.sub("", text))
    STUDIES.validate(whole)
    assert set(whole) == set(Study.model_fields)
    assert set(whole["outputs"]) == set(Outputs.model_fields)
    assert set(whole["optimise"]) | {"maximise"} == set(Optimise.model_fields)
    for wrong in ({"desing": "grid"}, {"design": "gird"}, {"vary": {"reed.mass": {"kind": "norml"}}}):
        assert not STUDIES.is_valid({**whole, **wrong})


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
