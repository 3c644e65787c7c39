"""How much model a structure requires: the levels of modelling, and the cheapest of those that describe it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from seatfem.structures.method import AnyLevel, Level

__all__ = ["CHEAPEST_FIRST", "COARSENING", "DISCRETE", "NAMES", "PER_WAVELENGTH", "QUARTERS", "Applicability", "Level"]

CHEAPEST_FIRST: Final[tuple[Level, ...]] = ("rod", "axisymmetric", "harmonics", "sector", "3d")
DISCRETE: Final[tuple[Level, ...]] = ("axisymmetric", "harmonics", "sector", "3d")
QUARTERS: Final = 4  # sectors of a body of revolution, a bar, a block: wide enough to be meshed well
COARSENING: Final = 1.6  # element size ratio of the mesh behind the mesh error estimate
PER_WAVELENGTH: Final[Mapping[Level, float]] = {"rod": 1, "axisymmetric": 6, "harmonics": 6, "sector": 4, "3d": 3}
"""Second-order elements per shear wavelength at the band edge, where the scene gives no size."""
NAMES: Final[Mapping[Level, str]] = {
    "rod": "rod, closed form",
    "axisymmetric": "finite elements, axisymmetric",
    "harmonics": "finite elements, Fourier harmonics in the angle",
    "sector": "finite elements, one of several equal sectors",
    "3d": "finite elements, 3-D",
}


@dataclass(frozen=True)
class Applicability:
    """Whether a level describes a structure.

    Attributes:
        level: of modelling.
        applies: the level can be run at all.
        error: relative error of g that the level itself makes at the band edge; 0 where it leaves nothing out.
        reason: in words.
    """

    level: AnyLevel
    applies: bool
    error: float
    reason: str


class LevelError(ValueError):
    """A level that does not describe the structure; the message names key, reason and what does."""


def choose_level(found: tuple[Applicability, ...], error: float, named: str = "auto") -> Applicability:
    """The level ``named``, or the cheapest whose own error is at most ``error``.

    Of a spring, whose compliance finite elements give, the cheapest that leaves nothing out.

    Raises:
        LevelError: the named level does not apply.
    """
    if named in ("auto", "spring"):
        limit = error if named == "auto" else 0.0
        return next(level for level in found if level.applies and level.error <= limit)
    chosen = next(level for level in found if level.level == named)
    if not chosen.applies:
        others = ", ".join(level.level for level in found if level.applies)
        raise LevelError(f"seat.model = {named!r} does not apply: {chosen.reason}; what applies: {others}")
    return chosen
