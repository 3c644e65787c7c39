"""docs/scene.md and its pages say what the program does."""

from collections.abc import Iterator
from pathlib import Path

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from scene_page import scene_pages

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
