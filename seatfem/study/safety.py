"""Sources of error in words, and the most rounds of a run."""

from collections.abc import Mapping
from typing import Final

MOST_ROUNDS: Final = 9  # most rounds of a run by default
FAILURES: Final = (ArithmeticError, MemoryError, OSError, RuntimeError, ValueError)
"""Errors of packages, factorisations and disk, after which the round before or an estimate serves; others are bugs."""
SOURCES: Final[Mapping[str, str]] = {
    "mesh": "mesh error",
    "reduction": "reduced model of the seat",
    "time_step": "time step",
    "model": "simplified model of seat or reed",
    "patch": "division of the contact face",
    "striker": "model of the reed",
    "stopper": "stopper",
    "record": "noise of the measured record",
    "lip": "single contact point instead of the lip",
}
STAGES: Final[Mapping[str, str]] = {"striker": "reed", "patch error": "contact face error"}
"""Displayed names of stages of a run."""


def source_in_words(source: str) -> str:
    """Return a source of error in words; one without an entry in `SOURCES` by its name, underscores as blanks."""
    body, _, its = source.partition("'s ")
    words = SOURCES.get(its or source, (its or source).replace("_", " "))
    return f"{words.removesuffix(' of the seat')} of the {STAGES.get(body, body)}" if its else words
