"""Fatigue strength of a material: S-N curves with their scatter, and criteria with constants of the material."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from difflib import get_close_matches
from itertools import pairwise
from statistics import NormalDist
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from impact.greens.base import Array
from impact.notices import SeatfemError
from impact.quantities import in_units

UNKNOWN: Final = math.nan
"""A number that was not measured."""
OWN: Final = math.nan
"""Survival for which an S-N curve is stated, whatever it is."""


class LifeError(SeatfemError, ValueError):
    """Error of data from which no fatigue life follows; the message names number, limit and remedy."""


@dataclass(frozen=True)
class Curve:
    """An S-N curve, piecewise linear in log S over log N; `basquin` and `tabled` make one.

    log10 N at a stress is normally distributed with the standard deviation ``scatter``, so that a fraction P survives

        log10 N_P(S) = log10 N(S) - (z(P) - z(survival)) scatter,   z = inverse of the normal distribution.

    Attributes:
        stresses: amplitudes [Pa], decreasing.
        cycles: cycles to failure at these amplitudes, increasing.
        first_slope: k = -dlogN/dlogS above the first stress.
        last_slope: the same below the last stress; ``inf`` is an endurance limit.
        scatter: standard deviation >= 0 of log10 N, or `UNKNOWN`.
        survival: fraction of parts that survives the curve as stated.

    Raises:
        LifeError: a rising branch, numbers that are not positive and finite, a fraction not within 0 ... 1.
    """

    stresses: tuple[float, ...]
    cycles: tuple[float, ...]
    first_slope: float
    last_slope: float
    scatter: float = UNKNOWN
    survival: float = 0.5

    def __post_init__(self) -> None:
        if not self.stresses or len(self.stresses) != len(self.cycles):
            raise LifeError("an S-N curve needs points: as many stresses as cycles, at least one")
        points = list(zip(self.stresses, self.cycles, strict=True))
        if bad := [pair for pair in points if not (min(pair) > 0 and max(pair) < math.inf)]:
            raise LifeError(f"S-N point {bad[0]}: stress and cycles must be positive and finite")
        if not (self.first_slope > 0 and self.last_slope > 0 and self.first_slope < math.inf):
            raise LifeError(f"slopes {self.first_slope:g} and {self.last_slope:g} of an S-N curve must be positive")
        for (high, early), (low, late) in pairwise(points):
            if not (low < high and late > early):
                raise LifeError(
                    f"S-N points rise: from {high:g} Pa at {early:g} cycles to {low:g} Pa at {late:g}; stress must "
                    "fall while cycles grow: sort the points, and fit those that scatter"
                )
        if not (math.isnan(self.scatter) or (math.isfinite(self.scatter) and self.scatter >= 0)):
            raise LifeError(f"scatter = {self.scatter:g} of log10 N must not be negative")
        _quantile(self.survival)

    def life(self, amplitude: ArrayLike, survival: float = OWN) -> Array:
        """Return the cycles to failure at (...,) amplitudes >= 0 [Pa] for a ``survival``; ``inf`` at 0 Pa.

        Raises `LifeError` for an amplitude that is no number >= 0, or another ``survival`` than that of a curve without
        scatter.
        """
        stress = np.asarray(amplitude, dtype=float)
        if not np.all(stress >= 0):
            raise LifeError(f"an amplitude of {stress.min():g} Pa is no amplitude: give halves of ranges, >= 0")
        levels, counts = np.log(self.stresses), np.log(self.cycles)
        with np.errstate(divide="ignore", over="ignore"):
            level = np.log(stress)
            above, below = np.maximum(level - levels[0], 0.0), np.maximum(levels[-1] - level, 0.0)
            later = np.multiply(self.last_slope, below, out=np.zeros_like(below), where=below > 0)
            logs = np.interp(level, levels[::-1], counts[::-1]) - self.first_slope * above + later
            return np.asarray(np.exp(logs - self._shift(survival)))

    def stress(self, cycles: float, survival: float = OWN) -> float:
        """Return the amplitude [Pa] for failure at this number of cycles > 0; ``survival`` and errors as in `life`."""
        if not 0 < cycles < math.inf:
            raise LifeError(f"cycles = {cycles:g} must be positive and finite")
        levels, counts = np.log(self.stresses), np.log(self.cycles)
        count = math.log(cycles) + self._shift(survival)
        before, after = max(counts[0] - count, 0.0), max(count - counts[-1], 0.0)
        level = np.interp(count, counts, levels) + before / self.first_slope - after / self.last_slope
        return float(np.exp(level))

    def _shift(self, survival: float) -> float:
        """Return the decrease of ln N for this survival."""
        if math.isnan(survival) or survival == self.survival:
            return 0.0
        if math.isnan(self.scatter):
            raise LifeError(
                f"survival = {survival:g} needs the scatter of log10 N; without it the curve holds for its own "
                f"{self.survival:g} alone"
            )
        return (_quantile(survival) - _quantile(self.survival)) * self.scatter * math.log(10)


def basquin(
    knee_stress: float,
    knee_cycles: float,
    slope: float,
    second_slope: float = math.nan,
    *,
    scatter: float = UNKNOWN,
    survival: float = 0.5,
) -> Curve:
    """Return the curve N = N_k (S/S_k)^-k, with another slope below the knee, by default (nan) 2k - 1.

    Args:
        knee_stress: S_k, amplitude [Pa].
        knee_cycles: N_k.
        slope: k above the knee, 1 to 1000.
        second_slope: slope below the knee; ``inf`` is an endurance limit.
        scatter, survival: as in `Curve`.

    Raises:
        LifeError: as `Curve`, a slope out of its range.

    Source: O. H. Basquin, ASTM Proc. 10 (1910) 625; E. Haibach, LBF TM 50 (1970), for 2k - 1.
    """
    if not 1 <= slope <= 1000:
        raise LifeError(f"slope = {slope:g} of an S-N curve: k = -dlogN/dlogS lies between 1 and 1000; is it 1/k?")
    second = 2 * slope - 1 if math.isnan(second_slope) else second_slope
    return Curve((knee_stress,), (knee_cycles,), slope, second, scatter, survival)


def tabled(points: Sequence[tuple[float, float]], *, scatter: float = UNKNOWN, survival: float = 0.5) -> Curve:
    """Return the curve through measured points (amplitude [Pa], cycles), linear and extrapolated in log-log.

    Raises:
        LifeError: as `Curve`, fewer than two points.
    """
    if len(points) < 2:
        raise LifeError(f"a table of an S-N curve needs two points or more, not {len(points)}")
    stresses, cycles = (tuple(map(float, column)) for column in zip(*points, strict=True))
    joined = Curve(stresses, cycles, 1.0, 1.0, scatter, survival)
    slopes = -np.diff(np.log(cycles)) / np.diff(np.log(stresses))
    return replace(joined, first_slope=float(slopes[0]), last_slope=float(slopes[-1]))


def _quantile(survival: float) -> float:
    if not 0 < survival < 1:
        raise LifeError(f"survival = {survival:g} must lie between 0 and 1, as in 0.999")
    return NormalDist().inv_cdf(survival)


Kind = TypeVar("Kind")


@dataclass(frozen=True)
class Strength:
    """Fatigue strength of a material with its source; numbers that were not measured are `UNKNOWN`.

    Attributes:
        source: citation of all numbers; required.
        grade, direction: material grade, and direction of loading (rolling, across).
        thickness: thickness of the specimens [m].
        temperature: temperature of the tests [K].
        specimens: number of specimens.
        ultimate: tensile strength [Pa].
        fatigue_strength: Morrow's coefficient sf' [Pa].
        walker_exponent: gamma, 0 < gamma <= 1.
        curve: stress amplitude against cycles, at the loading ratio; ``None`` without one.
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
    thickness: float = UNKNOWN
    temperature: float = UNKNOWN
    specimens: float = UNKNOWN
    ultimate: float = UNKNOWN
    fatigue_strength: float = UNKNOWN
    walker_exponent: float = UNKNOWN
    curve: Curve | None = None
    loading_ratio: float = -1.0
    torsion_limit: float = UNKNOWN
    bending_limit: float = UNKNOWN
    limit_cycles: float = UNKNOWN
    impact_velocity: float = UNKNOWN

    def __post_init__(self) -> None:
        if not self.source.strip():
            raise LifeError("strength.source is empty: cite the report or standard that the numbers are from")
        for field in fields(self):
            value = getattr(self, field.name)
            known = isinstance(value, float | int) and not math.isnan(value) and field.name != "loading_ratio"
            if known and not (math.isfinite(value) and value > 0):
                raise LifeError(f"strength.{field.name} = {value:g} must be positive and finite")
        if self.walker_exponent > 1:
            raise LifeError(f"strength.walker_exponent = {self.walker_exponent:g} must not be above 1")
        if not (math.isfinite(self.loading_ratio) and self.loading_ratio < 1):
            raise LifeError(f"strength.loading_ratio = {self.loading_ratio:g} must be finite and below 1 (smin/smax)")
        if self.curve is not None:
            knee = self.curve.stresses[-1]
            largest = 2 * knee / (1 - self.loading_ratio)
            if largest >= self.ultimate:
                raise LifeError(
                    f"strength.curve: its knee at an amplitude of {in_units(knee, 'Pa', 4)} means a largest stress of "
                    f"{in_units(largest, 'Pa', 4)} (loading_ratio = {self.loading_ratio:g}); it must be below the "
                    f"ultimate strength, {in_units(self.ultimate, 'Pa', 4)}. Check both, and that amplitudes are "
                    "given, not ranges"
                )

    def needed(self, what: str, *names: str) -> list[Any]:
        """Return the values of these fields. Raises `LifeError` if some that ``what`` needs are missing."""
        values = [getattr(self, name) for name in names]
        missing = [repr(name) for name, value in zip(names, values, strict=True) if value is None or value != value]
        if missing:
            raise LifeError(f"{what} needs {', '.join(missing)} of the material ({self.source}): measure or cite it")
        return values


def all_criteria(base: type[Kind]) -> Iterator[type[Kind]]:
    """Yield all criteria: every subclass with a ``name``, in any module."""
    for each in base.__subclasses__():
        yield from [each] if "name" in vars(each) else []
        yield from all_criteria(each)


def criterion(base: type[Kind], name: str, strength: Strength) -> Kind:
    """Return the criterion of this name, with constants from the fields of the same names of the strength.

    ``base`` is `MeanStress` or `Multiaxial`, ``name`` "goodman", ..., or "crossland", .... Raises `LifeError` for an
    unknown name, or constants that are missing or out of range.
    """
    known: dict[str, Any] = {each.name: each for each in all_criteria(base)}  # type: ignore[attr-defined]
    if name not in known:
        close = get_close_matches(name, known, n=1)
        meant = f"did you mean {close[0]!r}? " if close else ""
        raise LifeError(f"no criterion named {name!r}; {meant}There are: {', '.join(known)}")
    constants = [field.name for field in fields(known[name]) if field.default is MISSING]
    instance: Kind = known[name](*strength.needed(name, *constants))
    return instance


@dataclass(frozen=True)
class SpeedMargin:
    """Margin by the empirical limit of the closing speed of a valve [m/s]; ``margin`` = allowed/speed."""

    margin: float
    speed: float
    allowed: float
    source: str


def speed_margin(speed: float, strength: Strength) -> SpeedMargin:
    """Return the margin of a closing ``speed`` of either sign [m/s] to the allowed one.

    Raises `LifeError` if no allowed speed is known, or the speed is not finite.
    """
    [allowed] = strength.needed("the impact velocity limit", "impact_velocity")
    if not math.isfinite(speed):
        raise LifeError(f"speed = {speed:g} m/s must be finite")
    return SpeedMargin(math.inf if speed == 0 else allowed / abs(speed), abs(speed), allowed, strength.source)
