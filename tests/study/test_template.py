"""Scenes to begin with: of every kind, ready to be run; what stands behind a # is what holds without it."""

import re
from pathlib import Path

import pytest

from seatfem.fields import kind_of
from seatfem.study.scene.keys import scene_template
from tests.gallery import load_text
from tests.steps import Scene, SceneError, begin_plan, kinds_of

NAMES = [kind_of(kind) for kind in kinds_of() if kind.__module__.startswith("seatfem.")]


BLOCK = re.compile(r"# \[\[?([\w.]+)\]\]?")
"""Where a table behind # begins."""


def blocks(text: str) -> dict[str, tuple[int, int]]:
    """Return the lines of each, from its name to where the next one begins, or something that is none."""
    lines = text.splitlines()
    begins = [k for k, line in enumerate(lines) if BLOCK.match(line)]
    ends = {k for k, line in enumerate(lines) if not line.startswith("# ") or line.startswith("#   ")} | {len(lines)}
    names = {k: match[1] for k in begins if (match := BLOCK.match(lines[k]))}
    return {name: (k, min(end for end in (*ends, *begins) if end > k)) for k, name in names.items()}


COURSE = "time [ms],displacement [um]\n0,0\n1,2\n5,0\n"


@pytest.mark.slow(but="flapper")
@pytest.mark.parametrize("kind", NAMES)
def test_every_table_behind_a_mark_works_as_it_stands(kind: str, tmp_path: Path) -> None:
    """A table works once the marks of its lines are taken away; files that it names are put there."""
    text = scene_template(kind)
    bare = loaded(text, tmp_path)
    assert kind in (bare.seat.kind, bare.reed.kind)
    tables = blocks(text)
    for name, (first, last) in tables.items():
        lines = text.splitlines()
        lines[first:last] = [line.removeprefix("# ") for line in lines[first:last]]
        scene = loaded("\n".join(lines), tmp_path)
        table, _, part = name.partition(".")
        assert table in scene.model_fields_set
        assert not part or part in getattr(scene, table).model_fields_set
    reed_is_plate = kind in ("flapper", "sheet")
    assert {"stopper", "load"} <= tables.keys()
    assert ("stress" in tables) == (bare.seat.elastic is not None)
    assert not reed_is_plate or {"base", "reed.mesh", "reed.curvature", "contact.film", "seat.mesh"} <= tables.keys()


def loaded(text: str, folder: Path) -> Scene:
    """Load a scene with files that hold a course, or nothing, in place of those that are not there."""
    for _ in range(4):
        try:
            return load_text(folder, text)
        except SceneError as error:
            problems = str(error).splitlines()
        absent = [re.search(r"no such file: (\S+);", problem) for problem in problems]
        assert all(absent), problems
        for file in filter(None, absent):
            Path(file[1]).write_text(COURSE if file[1].endswith("base.csv") else "", encoding="utf-8")
    raise AssertionError("files that are there are still missed")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ball", "conical", "plate", "stepped"])
def test_a_plan_of_it_begins(kind: str, tmp_path: Path) -> None:
    assert begin_plan(load_text(tmp_path, scene_template(kind))).scene.accuracy.target == 0.05


@pytest.mark.parametrize("kind", ["annular", "flapper", "bar"])
def test_every_default_is_what_the_comment_says(kind: str, tmp_path: Path) -> None:
    """All commented keys at once that show a default; those that are absent show how one would be written."""
    text = scene_template(kind)
    absent = load_text(tmp_path, text)
    shown, tables = [], 0
    for line in text.splitlines():
        name, _, _ = line.removeprefix("# ").partition(" = ")
        tables = 0 if re.match(r"\[\w+\]", line) else tables + line.startswith("# [")
        said = line.startswith("# ") and name.isidentifier() and not tables
        shown.append(line.removeprefix("# ") if said and name in STATED else line)
    assert sum(a != b for a, b in zip(shown, text.splitlines(), strict=True)) >= 8
    stated = load_text(tmp_path, "\n".join(shown))
    assert stated.model_dump() == absent.model_dump()


STATED = {
    *("model", "fixed", "lip_height", "lip_edge_radius", "outer_radius", "thickness", "gap", "preload", "rings"),
    *("tilt", "tilt_axis", "offset", "line_arc", "filter_width", "measures", "damping_ratio"),
}
"""Keys with a default."""
