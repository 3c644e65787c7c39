"""Every error says what to do, and of what: a remedy or what is allowed, and the value or the name that is refused."""

from __future__ import annotations

import ast
import gc
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.contracts.error_texts import PLACES, Code, Made
from tests.contracts.expressions import VALUE, literal

ROOT = Path(__file__).parents[2]
DO = (
    "accept add allow apply ask average begin build call change check choose cite close compare compute condense "
    "construct convert copy correct cut define delete draw drive drop end enlarge exchange explode export fill "
    "fit fix flatten give heal improve install integrate join keep leave let list load lower make march measure "
    "mend merge move name open pip place prepare press put raise read redraw reduce refine release remove rename "
    "reorder report resample restore run save scale see select set shift shorten sort spell split stack start "
    "state straighten strike subtract take try turn unpack update use vary wait watch write"
).replace(" ", "|")
SOME = "free (?:some|space)|hold (?:it|the|what)|mesh (?:finer|it|the)|number (?:their|them)"
"""Verbs that are nouns, too."""
REMEDY = re.compile(
    rf"(?:^|[;:,.(?] |\}}|\b(?:or|and|please|then) )(?:{DO}|{SOME})\b"  # a clause that begins with what to do
    r"|\bmust\b|\bshould be\b|\bneeds?\b|\bneeded\b|\brequired\b|\bexpected\b"  # what is wanted
    r"|\bat (?:least|most)\b|\boutside\b|\bbetween \S+ and\b|\brange: |[<>]=? ?[\d{]|\.\."  # a range that is allowed
    r"|\b(?:not|none|no) one of\b|\bnone of\b|\bdid you mean\b|\bdecks know\b|\bknown(?::| are| here| places)"  # a list
    r"|\bthere are:|; (?:it has|it holds|there are) \{|\b(?:file|mesh|model|function|plate|reed|solid) has:?\s\{",
    re.IGNORECASE,
)
REFUSED = re.compile(r"\bmust (?:be|lie)\b|\bnot finite\b|\bunknown\b")
"""What is only said of a value."""
EXEMPT = {
    ("seatfem/fields.py", "str(error).removeprefix(drop)"): "the text of an error, as a problem of a key",
    ("seatfem/fields.py", "words"): "what tables yield, of which the same is asked where they do",
    ("faces/cli.py", "text"): "the whole text of an error, which gets its line",
    ("jobs/cluster.py", "reason"): "the words of a worker, whose errors are of the same packages",
    ("structures/inspection/mesh_file.py", "inspected.problems"): "what the process of gmsh found wrong, in its words",
    ("structures/inspection/outline.py", "inspected.problems"): "the same",
    ("structures/kinds/from_files.py", "inspected.problems"): "the same",
    ("structures/mesh/gmsh_process.py", "last['error']"): "the same",
    ("structures/mesh/_gmsh_base.py", "message"): "the same, with the name of the user's file in it",
    ("structures/kinds/from_files.py", "naming(self.file, message)"): "texts of the errors of a mesh, one for each key",
    ("structures/kinds/selectors.py", "field[2]"): "the text of an error of a geometry, without its field",
    ("structures/reduction/eigen_search.py", "counts eigenvalues"): "a search that begins anew without counting",
    ("structures/reduction/spectrum.py", "count"): "the same",
    ("structures/reduction/slepc.py", "{gap}; {remedy}"): "what is missing of PETSc, with what installs it",
    ("study/scene/contradictions.py", "a seat of kind {seat.kind!r}, {why}"): "`LipFace.no_lip`, words of each kind",
    ("study/scene/files.py", "text"): "findings of the structures, texts of their errors",
    ("study/scene/load.py", "why"): "what a file is in place of a scene, each with the verb that takes it",
    ("study/scene/parts_as_drawn.py", "finding"): "the same",
    ("study/scene/problems.py", "_message(place, data)"): "pydantic's words: 'input should be ...'",
}
"""File, and what its text has; why nothing is asked of it here."""


@pytest.fixture(scope="module")
def code() -> Iterator[Code]:
    files = [path for package in ("impact", "seatfem") for path in sorted((ROOT / package).rglob("*.py"))]
    gc.disable()  # half a million nodes without rings: looking for rings takes five times as long as all else
    try:
        found = Code(files, REMEDY)
        gc.freeze()
    finally:
        gc.enable()
    yield found
    gc.unfreeze()


def place(made: Made) -> str:
    return f"{made.scope.path.relative_to(ROOT)}:{made.text.lineno}: {made.kind}: {ast.unparse(made.text)}"


def exemptions(made: Made) -> list[tuple[str, str]]:
    path, text = made.scope.path.as_posix(), ast.unparse(made.text)
    return [(file, words) for file, words in EXEMPT if path.endswith(f"/{file}") and words in text]


def test_every_error_has_a_remedy(code: Code) -> None:
    """A clause that says what to do, what must be, or what is allowed; in `EXEMPT` only where nothing of it is here."""
    without = [made for made in code.made() if not code.has_remedy(made.text, made.scope)]
    assert [place(made) for made in without if not exemptions(made)] == []
    used = {found for made in without for found in exemptions(made)}
    assert used == set(EXEMPT), "exceptions that nothing needs"


def test_every_error_names_what_it_refuses(code: Code) -> None:
    """The value, or the key, or the argument's or field's name."""
    nameless = []
    for made in code.made():
        said = literal(made.text)
        named = VALUE in said or made.kind in PLACES or not made.scope.names.isdisjoint(re.findall(r"\w+", said))
        if REFUSED.search(said) and not named:
            nameless.append(place(made))
    assert nameless == []


def test_no_value_stands_there_as_its_name(code: Code) -> None:
    """A placeholder in a text that is no f-string would be printed as it stands."""
    assert [place(made) for made in code.made() if re.search(r"\{\w", literal(made.text))] == []


def test_the_rule_guards_something(code: Code) -> None:
    """All classes of errors of the packages, and texts that come by way of helpers."""
    made = list(code.made())
    assert len(made) > 900
    assert {"KeyProblem", "ModelError", "MeshError", "GreensFunctionError", "UnitError"} <= {each.kind for each in made}


HELPERS = """
class OwnError(ValueError): ...
LIMIT = "; use a smaller one"
def _wrong(path, what): return OwnError(f"{path}: {what}")
def advice(n): return "take fewer" if n > 2 else "give more"
def told(path, n, x):
    try:
        told(path, n, x)
    except OwnError as error:
        raise OwnError(f"{path}: {error}") from error
    words = "it is large" + LIMIT
    raise OwnError(f"{n} is refused: {words}")
    raise OwnError(f"{n} is refused; {advice(n)}")
    raise OwnError(f"{x} must be positive")
    raise OwnError(f"{path}: " + ("add a line" if n else "remove one"))
    raise _wrong(path, f"{n} lines; cut it")
"""


@pytest.mark.parametrize(
    "said",
    [
        'OwnError(f"{x} is bad")',
        'OwnError(f"{x!r}: {advice!r}")',
        'OwnError("it is bad; " + ("give one" if n else "too bad"))',
        '_wrong(path, f"{n} lines")',
        'OwnError(f"{n}: {str(x)}, of the set")',
    ],
)
def test_a_text_without_a_remedy_is_seen(said: str, tmp_path: Path) -> None:
    file = tmp_path / "module.py"
    file.write_text(HELPERS, encoding="utf-8")
    code = Code([file], REMEDY)
    made = list(code.made())
    assert len(made) == 6
    assert all(code.has_remedy(each.text, each.scope) for each in made)
    file.write_text(f"{HELPERS}    raise {said}\n", encoding="utf-8")
    code = Code([file], REMEDY)
    assert not all(code.has_remedy(each.text, each.scope) for each in code.made())
