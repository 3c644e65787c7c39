"""docs/scene.md and its pages say what the program does."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import BaseModel, ValidationError, create_model
from pydantic.fields import FieldInfo
from scene_page import scene_pages

from seatfem.fields import Table
from seatfem.study.scene.keys import holds
from seatfem.study.scene.load import scene_of
from seatfem.study.scene.problems import tables_in

DOCS = Path(__file__).parents[2] / "docs"
PAGES = scene_pages()


def test_the_pages_are_current() -> None:
    written = [DOCS / "scene.md", *(DOCS / "scene").glob("*.md")]
    pages = {path.relative_to(DOCS).as_posix(): path.read_text(encoding="utf-8") for path in written}
    assert pages == PAGES, "run: make docs"


def fields(table: type[BaseModel], seen: set[type[BaseModel]]) -> Iterator[tuple[str, FieldInfo]]:
    """Yield every key of a table and of the tables in it."""
    seen.add(table)
    for name, field in table.model_fields.items():
        yield f"{table.__name__}.{name}", field
        for inner in tables_in(field.annotation):
            if inner not in seen:
                yield from fields(inner, seen)


FIELDS = dict(fields(scene_of(), set()))


@pytest.mark.slow
def test_what_a_key_holds_is_what_it_takes() -> None:
    """Flags are flags, lists say how many of what, and the example shown is one that the key takes."""
    refused = []
    for key, field in FIELDS.items():
        said = holds(field)
        if tables_in(field.annotation) or not (shown := re.findall(r"`(.+?)`", said)):
            continue
        holder = create_model("Holder", __base__=Table, value=(field.annotation, field))
        for example in shown:
            value = tomllib.loads(f"value = {example}")["value"]
            if said.startswith("list") and not isinstance(value, list):
                value = [value]
            if "velocity" in key:  # the unit's example; the sign is in the description
                value = f"-{value}"
            try:
                holder.model_validate({"value": value})
            except ValidationError as error:
                refused.append((key, example, str(error)))
    assert refused == []
