"""docs/scene.md says what the program does."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import BaseModel, create_model
from pydantic.fields import FieldInfo
from scene_page import scene_page

from seatfem.fields import Table
from seatfem.study.scene import Scene
from seatfem.study.scene.keys import holds
from seatfem.study.scene.problems import tables_in

PAGE = Path(__file__).parents[2] / "docs" / "scene.md"


def test_the_page_is_current() -> None:
    assert PAGE.read_text(encoding="utf-8") == scene_page(), "run: make docs"


def test_every_kind_of_seat_is_on_the_page() -> None:
    for kind in ("annular", "bar", "block", "cad", "mesh", "rod", "spring", "greens"):
        assert f'## [seat], [reed], [stopper], kind = "{kind}"' in scene_page()
    assert '| `lip_height` | length, `"3 mm"` | `"0.5 mm"` |' in scene_page()


def fields(table: type[BaseModel], seen: set[type[BaseModel]]) -> Iterator[tuple[str, FieldInfo]]:
    """Every key of a table and of the tables in it."""
    seen.add(table)
    for name, field in table.model_fields.items():
        yield f"{table.__name__}.{name}", field
        for inner in tables_in(field.annotation):
            if inner not in seen:
                yield from fields(inner, seen)


FIELDS = dict(fields(Scene, set()))


@pytest.mark.parametrize("key", sorted(FIELDS))
def test_what_a_key_holds_is_what_it_takes(key: str) -> None:
    """Flags are flags, lists say how many of what, and the example shown is one that the key takes."""
    field = FIELDS[key]
    said = holds(field)
    if tables_in(field.annotation) or not (shown := re.findall(r"`(.+?)`", said)):
        return
    holder = create_model("Holder", __base__=Table, value=(field.annotation, field))
    for example in shown:
        value = tomllib.loads(f"value = {example}")["value"]
        if said.startswith("list") and not isinstance(value, list):
            value = [value]
        if "velocity" in key:  # the unit's example; the sign is in the description
            value = f"-{value}"
        holder.model_validate({"value": value})


def test_lists_say_how_many_of_what() -> None:
    said = {key: holds(field) for key, field in FIELDS.items()}
    assert said["ByPlane.several"] == "`true` or `false`"
    assert said["ByPlane.axis_point"] == 'list of three lengths, `["12 mm", "0 mm", "8 mm"]`'
    assert said["ByPlane.normal"] == "list of three numbers, `[0.0, 0.0, 1.0]`"
    assert said["OrthotropicMaterial.young"].startswith("list of three pressures")
    assert said["Accuracy.measures"].startswith('list of `"impulse"`')
    assert "list of numbers" not in scene_page()
    assert "False" not in scene_page()
