"""The pages of Python names: every public name once, each with what one must know to call it."""

import importlib
import inspect
import re
from pathlib import Path

import pytest

from impact.after import measures
from tests.contracts.test_public_names import PACKAGES

DOCS = Path(__file__).parents[2] / "docs"
MEASURES = [name for name, it in inspect.getmembers(measures, inspect.isfunction) if inspect.getmodule(it) is measures]
PUBLIC = [
    *((package, name) for package in PACKAGES for name in importlib.import_module(package).__all__),
    *(("impact.after.measures", name) for name in MEASURES if not name.startswith("_")),
]
OBJECTS = {
    f"{package}.{name}": found
    for package, name in PUBLIC
    if not inspect.ismodule(found := getattr(importlib.import_module(package), name))
}
UNIT = re.compile(
    r"\[[^\]]*\b(?:m|N|s|kg|Pa|J|Hz|rad|SI|K)\b[^\]]*\]"  # in brackets
    r"|-> (?:\([\w +]+,\) )?(?:m|Pa|N)\b"  # of a function
    r"|\bSI\b|\bmetres\b|relative|ratio|factor\b|coefficient"  # all of it; or a number without one
)
SHAPE = re.compile(r"\([\w.]+(?: [+-] 1)?,(?: ?[\w. +|]+,?)*\)|shape of")
ELSEWHERE = re.compile(r"[Aa]s `([\w.]+)`")


@pytest.mark.parametrize("package", ["impact", "seatfem"])
def test_every_public_name_stands_once_on_its_page(package: str) -> None:
    listed = re.findall(r"^   ([\w.]+)$", (DOCS / f"api_{package}.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(name for name in OBJECTS if name.partition(".")[0] == package)


@pytest.mark.parametrize("name", sorted(OBJECTS))
def test_a_docstring_is_full(name: str) -> None:
    """Sentences; units where there are numbers, shapes where there are arrays, or the place where they are told."""
    found, doc = OBJECTS[name], inspect.getdoc(OBJECTS[name]) or ""
    assert re.match(r"\S.*", doc)
    assert doc.rstrip().endswith("."), doc[-60:]
    given = inspect.get_annotations(found) if isinstance(found, type) else inspect.signature(found).parameters
    types = " ".join(str(getattr(each, "annotation", each)) for each in given.values() if "ClassVar" not in str(each))
    if not isinstance(found, type):
        types += str(inspect.signature(found).return_annotation)
    if ELSEWHERE.search(doc):
        return
    if not isinstance(found, type):
        raised = set(re.findall(r"^ +raise (\w+)\(", inspect.getsource(found), re.MULTILINE))
        of_module = inspect.getdoc(inspect.getmodule(found)) or ""
        assert [error for error in raised if error not in doc + of_module] == [], "errors that are not told"
    assert not re.search(r"\bfloat\b|Array\b", types) or UNIT.search(doc), "numbers without units"
    assert not re.search(r"Array\b", types) or SHAPE.search(doc), "arrays without shapes"
