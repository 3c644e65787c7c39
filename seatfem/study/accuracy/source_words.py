"""Names of the sources of error, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

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
OF_A_BODY: Final[Mapping[str, str]] = {"mesh": "mesh error", "reduction": "reduced model"}
STAGES: Final[Mapping[str, str]] = {"striker": "reed", "patch error": "contact face error"}
"""Stages of a run whose names are shown in other words."""
BODIES: Final[Mapping[str, str]] = {"striker": "reed", "stopper": "stopper", "seat": "seat"}


def in_words(source: str) -> str:
    """Return a source of error of the budget in words; one that is new by its name."""
    body, _, its = source.partition("'s ")
    if its and body in BODIES:
        return f"{OF_A_BODY.get(its, its.replace('_', ' '))} of the {BODIES[body]}"
    return SOURCES.get(source, source.replace("_", " "))
