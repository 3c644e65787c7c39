"""Every refusal that a test provokes is judged (`tests/refusals.py`): what it names, and what it says to do."""

from pathlib import Path

import pytest

from seatfem.faces import cli
from seatfem.structures.errors import ModelError
from seatfem.study.scene.problems import Problem, SceneError
from tests import refusals

GOOD = [
    "reed.length: '3 kg' is a mass; a length is needed, e.g. '3 mm'",
    "seat.h5: damaged: omega is missing; compute it again",
    "the bodies do not approach (closing speed 0 m/s): let one move towards the other",
]
BAD = [
    ("the mesh is bad; make it finer", "what is refused"),
    ("reed.length: '3 kg' is a mass, of no use", "a remedy"),
    ("something went wrong", "what is refused and a remedy"),
]


@pytest.mark.parametrize("text", GOOD)
def test_a_refusal_that_names_its_value_and_says_what_to_do_passes(text: str) -> None:
    with pytest.raises(ModelError):
        raise ModelError(text)
    assert text in cli.placed(ModelError(text), ["run", "a.h5"])


@pytest.mark.parametrize(("text", "lack"), BAD)
def test_any_other_fails_the_test_that_provokes_it(text: str, lack: str) -> None:
    """An error that lacks a part is caught in Python, as one of several problems of a scene and on the command line."""
    wrong = ModelError(text)
    of_scene = SceneError((Problem(None, 0, "reed.mass", "must be positive"), Problem(None, 0, "", text)))
    for error in (wrong, of_scene) if "refused" not in lack else (wrong,):
        with refusals.RAISES(AssertionError, match=f"does not say {lack}: "), pytest.raises(type(error)):
            raise error
    with refusals.RAISES(AssertionError, match=f"does not say {lack}: "):
        cli.placed(wrong, ["run"])


FOREIGN = [
    ("frf", "states no units; give units=, one of SI, or mm-N-s", ["units="]),
    ("mesh", "the law is rigid; add a residual (impact.Residual)", ["impact.Residual"]),
    ("frf", "nodes coincide; state merge = 0.1 mm", ["merge"]),
    ("mesh", "nodes coincide; state merge = 0.1 mm, with contact.gap = 1 mm and run.duration = 3 ms", []),
    ("frf", "states no units; take kind = 'mesh' with parts = 2, or state units = { response = 'g/N' }", []),
]


@pytest.mark.parametrize(("kind", "words", "names"), FOREIGN)
def test_keys_of_other_tables_and_arguments_of_python_are_found(
    kind: str, words: str, names: list[str], tmp_path: Path
) -> None:
    """They are found in a refusal of a scene by the kind of the table that it is about."""
    path = tmp_path / "scene.toml"
    path.write_text(f'[seat]\nkind = "{kind}"\n', encoding="utf-8")
    error = SceneError((Problem(path, 1, "seat.file", f"a.uff: {words}"),))
    assert refusals.foreign(error) == names
    if names:
        with refusals.RAISES(AssertionError, match=names[0]), pytest.raises(SceneError):
            raise error
