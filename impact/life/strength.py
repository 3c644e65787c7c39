"""Measured strength of a material, and criteria made of it by name. No number of strength ships with the program."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields
from difflib import get_close_matches
from typing import Any, TypeVar

from impact.life.curves import Curve, LifeError
from impact.quantities import in_units

Kind = TypeVar("Kind")


@dataclass(frozen=True)
class Strength:
    """The known fatigue strength of a material, and where it is from; ``None`` is what nobody measured.

    Attributes:
        source: citation of all numbers; required.
        grade, direction: which material, and along what it was loaded (rolling, across).
        thickness: of the specimens [m].
        temperature: of the tests [K].
        specimens: their number.
        ultimate: tensile strength [Pa].
        fatigue_strength: Morrow's coefficient sf' [Pa].
        walker_exponent: gamma, 0 < gamma <= 1.
        curve: stress amplitude against cycles, at the loading ratio.
        loading_ratio: R = smin/smax < 1 of the curve; -1: fully reversed.
        torsion_limit, bending_limit: t-1 and f-1, fully reversed amplitudes [Pa] endured for ``limit_cycles`` cycles.
        limit_cycles: N of the two limits.
        impact_velocity: largest speed of closing allowed [m/s].

    Raises:
        LifeError: no source, a number that is not positive and finite, an exponent or ratio outside its range.
    """

    source: str
    grade: str = ""
    direction: str = ""
    thickness: float | None = None
    temperature: float | None = None
    specimens: int | None = None
    ultimate: float | None = None
    fatigue_strength: float | None = None
    walker_exponent: float | None = None
    curve: Curve | None = None
    loading_ratio: float = -1.0
    torsion_limit: float | None = None
    bending_limit: float | None = None
    limit_cycles: float | None = None
    impact_velocity: float | None = None

    def __post_init__(self) -> None:
        if not self.source.strip():
            raise LifeError("strength.source is empty: cite the report or standard that the numbers are from")
        for field in fields(self):
            value = getattr(self, field.name)
            number = isinstance(value, float | int) and field.name != "loading_ratio"
            if number and not (math.isfinite(value) and value > 0):
                raise LifeError(f"strength.{field.name} = {value:g} must be positive and finite")
        if self.walker_exponent is not None and self.walker_exponent > 1:
            raise LifeError(f"strength.walker_exponent = {self.walker_exponent:g} must not be above 1")
        if not (math.isfinite(self.loading_ratio) and self.loading_ratio < 1):
            raise LifeError(f"strength.loading_ratio = {self.loading_ratio:g} must be finite and below 1 (smin/smax)")
        if self.curve is not None and self.ultimate is not None:
            knee = self.curve.stresses[-1]
            largest = 2 * knee / (1 - self.loading_ratio)
            if not largest < self.ultimate:
                raise LifeError(
                    f"strength.curve: its knee at an amplitude of {in_units(knee, 'Pa', 4)} means a largest stress of "
                    f"{in_units(largest, 'Pa', 4)} (loading_ratio = {self.loading_ratio:g}); it must be below the "
                    f"ultimate strength, {in_units(self.ultimate, 'Pa', 4)}. Check both, and that amplitudes are "
                    "given, not ranges"
                )

    def needed(self, what: str, *names: str) -> list[Any]:
        """Return values of these fields. Raises `LifeError`, which names those that are missing and ``what`` needs."""
        if missing := [name for name in names if getattr(self, name) is None]:
            raise LifeError(f"{what} needs {', '.join(missing)} of the material ({self.source}): measure or cite it")
        return [getattr(self, name) for name in names]


def kinds(base: type[Kind]) -> Iterator[type[Kind]]:
    """Yield the criteria there are: every subclass with a ``name``, those defined elsewhere, too."""
    for each in base.__subclasses__():
        yield from [each] if "name" in vars(each) else []
        yield from kinds(each)


def criterion(base: type[Kind], name: str, strength: Strength) -> Kind:
    """Return the criterion of that name, its constants the fields of the same names of the strength.

    ``base`` is `MeanStress` or `Multiaxial`, ``name`` "goodman", ..., or "crossland", .... Raises `LifeError`: no
    criterion of that name, or constants that are missing or outside its range.
    """
    known: dict[str, Any] = {each.name: each for each in kinds(base)}  # type: ignore[attr-defined]
    if name not in known:
        close = get_close_matches(name, known, n=1)
        meant = f"did you mean {close[0]!r}? " if close else ""
        raise LifeError(f"no criterion named {name!r}; {meant}There are: {', '.join(known)}")
    constants = [field.name for field in fields(known[name]) if field.default is MISSING]
    instance: Kind = known[name](*strength.needed(name, *constants))
    return instance


@dataclass(frozen=True)
class SpeedMargin:
    """The industry's rule: a valve may close up to a speed that experience allows [m/s]; ``margin`` = allowed/speed."""

    margin: float
    speed: float
    allowed: float
    source: str


def speed_margin(speed: float, strength: Strength) -> SpeedMargin:
    """Return how far a ``speed`` of closing, either sign [m/s], is below the one that the strength allows.

    Raises `LifeError`: no allowed speed is known, or the speed is not finite.
    """
    [allowed] = strength.needed("the impact velocity limit", "impact_velocity")
    if not math.isfinite(speed):
        raise LifeError(f"speed = {speed:g} m/s must be finite")
    return SpeedMargin(math.inf if speed == 0 else allowed / abs(speed), abs(speed), allowed, strength.source)
