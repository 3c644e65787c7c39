"""Public names: none leaves before a version in which it warns and names its new place.

public_names.txt has them all. A new one is added there. One that goes elsewhere keeps its line, with "->", its new
place and the version that warns first, and stands among the former names of its package (`impact.names.lazy_names`).
In a later version the line may say "left" in place of "->", and the entry goes.
"""

import importlib
import inspect
import re
import sys
import tomllib
from pathlib import Path

import pytest

from impact.after import measures
from impact.names import lazy_names

FILE = Path(__file__).with_name("public_names.txt")
PACKAGES = (
    "impact", "impact.exact", "impact.gas", "impact.life", "seatfem", "seatfem.structures.fields",
    "seatfem.structures.shapes",
)  # fmt: skip
"""Those whose names stand on the pages of Python names."""
MEASURES = [name for name, it in inspect.getmembers(measures, inspect.isfunction) if it.__module__ == measures.__name__]
PUBLIC = {
    f"{package}.{name}": getattr(importlib.import_module(package), name)
    for package, names in (*((p, importlib.import_module(p).__all__) for p in PACKAGES), (measures.__name__, MEASURES))
    for name in names
    if not name.startswith("_") and not inspect.ismodule(getattr(importlib.import_module(package), name))
}
"""What stands on those pages, by its whole name."""
VERSION = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))["project"]["version"]
MOVED = re.compile(r"(?P<name>[\w.]+) (?P<how>->|left) (?P<place>[\w.:]+) \(warns since (?P<since>[\d.]+)\)")
LINES = [line for line in FILE.read_text("utf-8").splitlines() if line and not line.startswith("#")]
FORMER = [found for line in LINES if (found := MOVED.fullmatch(line))]


def test_the_list_is_what_there_is() -> None:
    there = {f"{package}.{name}" for package in PACKAGES for name in importlib.import_module(package).__all__}
    listed = {line for line in LINES if re.fullmatch(r"[\w.]+", line)}
    assert sorted(there - listed) == [], "new names: add them to public_names.txt"
    assert sorted(listed - there) == [], "names that left: keep them for a version, with a warning (CONTRIBUTING.md)"
    assert len(listed) + len(FORMER) == len(LINES), "a line that is neither a name nor tells where it went"


@pytest.mark.parametrize("line", [each[0] for each in FORMER if each["how"] == "->"])
def test_a_former_name_warns_and_works(line: str) -> None:
    match = MOVED.fullmatch(line)
    assert match
    package, _, name = match["name"].rpartition(".")
    module, _, held = match["place"].partition(":")
    present = importlib.import_module(module)
    sys.modules.pop(match["name"], None)
    with pytest.warns(DeprecationWarning, match=re.escape(match["place"].replace(":", "."))):
        former = getattr(importlib.import_module(package), name) if held else importlib.import_module(match["name"])
    if held:
        assert former is getattr(present, held)
    else:
        public = [each for each in vars(present) if not each.startswith("__")]
        assert all(getattr(former, each) is getattr(present, each) for each in public)


def test_a_name_has_left_only_after_a_version_with_a_warning() -> None:
    gone = [each for each in FORMER if each["how"] == "left"]
    assert [each[0] for each in gone if _ordered(each["since"]) >= _ordered(VERSION)] == []
    assert [each[0] for each in FORMER if _ordered(each["since"]) > _ordered(VERSION)] == []


def _ordered(version: str) -> tuple[int, ...]:
    return tuple(map(int, version.split(".")))


def test_names_of_a_package_are_loaded_when_they_are_asked_for() -> None:
    """A name, a module and a former name are loaded; another one is no attribute."""
    load = lazy_names("toy", {"math": "sqrt floor", "os.path": "path"}, {"root": "math:sqrt"})
    assert load("floor")(1.5) == 1
    assert load("path") is importlib.import_module("os.path")
    with pytest.warns(DeprecationWarning, match=r"toy\.root is math\.sqrt now"):
        assert load("root")(4.0) == 2.0
    with pytest.raises(AttributeError, match="module 'toy' has no attribute 'ceil'"):
        load("ceil")


def test_former_modules_are_imported_by_every_form_of_import() -> None:
    """`import impact.pekeris` and `from impact import pekeris` give the new module."""
    from impact.exact import half_space

    for statement in ("import impact.pekeris as former", "from impact import pekeris as former"):
        names: dict[str, object] = {}
        exec(statement, names)
        assert names["former"].rayleigh_speed is half_space.rayleigh_speed  # type: ignore[attr-defined]
