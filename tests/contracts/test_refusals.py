"""Every refusal that a test provokes is judged (`tests/refusals.py`): what it names, and what it says to do."""

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
