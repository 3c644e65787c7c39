"""[vary] of a study file: the values of a key of the scene, as a list, a range or a distribution."""

import math
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Final, Literal

import numpy as np
import scipy
from pydantic import AfterValidator, BeforeValidator, Field

from seatfem import fields

MOST: Final = 10_000  # largest number of values of a key
EDGE: Final = 2.0**-53  # smallest probability p, or 1 - p, at which unbounded distributions are evaluated


def _positive(value: tuple[float, str]) -> tuple[float, str]:
    if not value[0] > 0:
        raise ValueError(f"{value[0]:g} must be positive")
    return value


Positive = Annotated[fields.WrittenQuantity, AfterValidator(_positive)]
Share = Annotated[float, Field(ge=0, le=1)]


class Variation(fields.Table):
    """Values of one key. A subclass with a ``kind`` is a way to state them."""

    kind: str

    @cached_property
    def unit(self) -> str:
        """Return the unit of its numbers in the file; "" for pure numbers and other values."""
        return next((unit for _, unit in self.quantities().values()), "")

    def quantities(self) -> dict[str, tuple[float, str]]:
        """Return its numbers and their units by key of the file."""
        values = {field.alias or name: getattr(self, name) for name, field in type(self).model_fields.items()}
        return {key: value for key, value in values.items() if isinstance(value, tuple)}

    def contradictions(self) -> fields.Contradictions:
        for key, (_, unit) in self.quantities().items():
            if unit != self.unit:
                yield key, f"is in {unit or 'no unit'}, another in {self.unit or 'none'}: give all in one unit"
        if isinstance(self, Range | TruncatedNormal) and not self.low[0] < self.high[0]:
            yield "to", f"{self.high[0]:g} must be above from = {self.low[0]:g}"

    @property
    def places(self) -> tuple[float, ...]:
        """Return the shares (0 to 1) of the values that a search may choose; none where it may take any in between."""
        return ()

    @property
    def is_searchable(self) -> bool:
        """Return whether a search may choose its values."""
        return len(self.places) > 1

    def levels(self, keys: str) -> tuple[fields.Value, ...]:
        """Return the values for grids; raises `KeyProblem` if there are none. ``keys``: dotted key for messages."""
        raise fields.KeyProblem(
            keys, f"{self.kind!r} has no levels for this design: give a list, or from, to and number"
        )

    def quantile(self, share: float) -> fields.Value:
        """Return the quantile of the distribution for the probability ``share`` (0 to 1)."""
        raise NotImplementedError

    def check_drawn(self, keys: str) -> None:
        """Raise `KeyProblem` for keys that are not allowed in designs that draw values."""

    def written(self, number: float) -> fields.Value:
        """Return a number with the unit of the variation, as text of a scene file."""
        return f"{number!r} {self.unit}" if self.unit else number


class Listed(Variation):
    """Plain list; designs that draw take all entries equally often."""

    kind: Literal["list"]
    values: tuple[fields.Value, ...] = Field(min_length=1, max_length=MOST)

    def quantities(self) -> dict[str, tuple[float, str]]:
        """Return the numbers of all values, or nothing if one is no number or they differ in unit."""
        try:
            quantities = {f"values.{number}": fields.read_written(value) for number, value in enumerate(self.values)}
        except ValueError:
            return {}
        return quantities if len({unit for _, unit in quantities.values()}) == 1 else {}

    @property
    def places(self) -> tuple[float, ...]:
        return tuple((number + 0.5) / len(self.values) for number in range(len(self.values)))

    def levels(self, keys: str) -> tuple[fields.Value, ...]:
        return self.values

    def quantile(self, share: float) -> fields.Value:
        return self.values[min(int(share * len(self.values)), len(self.values) - 1)]


class Range(Variation):
    """Range from one value to another: ``number`` levels in grids, any value between in designs that draw."""

    kind: Literal["range"]
    low: fields.WrittenQuantity = Field(alias="from", description="lowest value")
    high: fields.WrittenQuantity = Field(alias="to", description="highest value")
    number: int | None = fields.absent("of levels", strict=True, ge=2, le=MOST)
    scale: Literal["linear", "log"] = "linear"

    def contradictions(self) -> fields.Contradictions:
        yield from super().contradictions()
        if self.scale == "log" and self.low[0] <= 0:
            yield "from", f"{self.low[0]:g} is not positive, as a logarithmic scale needs it"

    @property
    def places(self) -> tuple[float, ...]:
        return () if self.number is None else tuple(step / (self.number - 1) for step in range(self.number))

    @property
    def is_searchable(self) -> bool:
        return True

    def levels(self, keys: str) -> tuple[fields.Value, ...]:
        if self.number is None:
            raise fields.KeyProblem(f"{keys}.number", "required key is missing: levels of the range, for this design")
        return tuple(self.quantile(step / (self.number - 1)) for step in range(self.number))

    def quantile(self, share: float) -> fields.Value:
        low, high = self.low[0], self.high[0]
        if share in (0.0, 1.0):
            return self.written(high if share else low)
        return self.written(low * (high / low) ** share if self.scale == "log" else low + (high - low) * share)

    def check_drawn(self, keys: str) -> None:
        if self.number is not None:
            raise fields.KeyProblem(f"{keys}.number", "this design draws anywhere between from and to; remove the key")


class Uniform(Range):
    """Uniform distribution between two values, or with ``scale = "log"`` between their logarithms."""

    kind: Literal["uniform"]  # type: ignore[assignment]

    def levels(self, keys: str) -> tuple[fields.Value, ...]:
        return Variation.levels(self, keys)


class Normal(Variation):
    """Normal distribution."""

    kind: Literal["normal"]
    mean: fields.WrittenQuantity = Field(description="mean value")
    deviation: Positive = Field(description="standard deviation")

    def quantile(self, share: float) -> fields.Value:
        return self.written(self.mean[0] + self.deviation[0] * _normal(share))


class TruncatedNormal(Normal):
    """Normal distribution within bounds: mean and deviation are those without the bounds."""

    kind: Literal["truncated_normal"]  # type: ignore[assignment]
    low: fields.WrittenQuantity = Field(alias="from", description="lowest value")
    high: fields.WrittenQuantity = Field(alias="to", description="highest value")

    def contradictions(self) -> fields.Contradictions:
        yield from super().contradictions()
        below, above = self._shares()
        if above - below < 1e-9:
            yield "from", f"{self.low[0]:g} to {self.high[0]:g} must hold more of the distribution"

    def _shares(self) -> tuple[float, float]:
        """Return the probabilities of the untruncated distribution below the lowest and the highest value."""
        low, high = (
            float(scipy.special.ndtr((end[0] - self.mean[0]) / self.deviation[0])) for end in (self.low, self.high)
        )
        return low, high

    def quantile(self, share: float) -> fields.Value:
        below, above = self._shares()
        value = self.mean[0] + self.deviation[0] * _normal(below + share * (above - below))
        return self.written(min(max(value, self.low[0]), self.high[0]))


class LogNormal(Variation):
    """Lognormal distribution: median exp(sigma z), z standard normal."""

    kind: Literal["lognormal"]
    median: Positive = Field(description="value that half of all lie below")
    sigma: float = Field(gt=0, le=5, description="standard deviation of the natural logarithm")

    def quantile(self, share: float) -> fields.Value:
        return self.written(self.median[0] * math.exp(self.sigma * _normal(share)))


class Tabled(Variation):
    """Measured distribution: values, and the fraction of all below each, interpolated linearly."""

    kind: Literal["table"]
    points: tuple[tuple[fields.WrittenQuantity, Share], ...] = Field(
        min_length=2, max_length=MOST, description="[value, share below it], from 0 to 1"
    )

    def quantities(self) -> dict[str, tuple[float, str]]:
        return {f"points.{number}": value for number, (value, _) in enumerate(self.points)}

    def contradictions(self) -> fields.Contradictions:
        yield from super().contradictions()
        values, shares = np.array([(value[0], share) for value, share in self.points]).T
        if np.any(np.diff(values) <= 0) or np.any(np.diff(shares) < 0):
            yield "points", "values and shares must rise from one point to the next"
        if shares[0] != 0 or shares[-1] != 1:
            yield "points", f"the shares go from {shares[0]:g} to {shares[-1]:g}: begin with 0, end with 1"

    def quantile(self, share: float) -> fields.Value:
        values, shares = zip(*((value[0], below) for value, below in self.points), strict=True)
        return self.written(float(np.interp(share, shares, values)))


def _normal(share: float) -> float:
    """Return the inverse of the standard normal distribution."""
    return float(scipy.special.ndtri(min(max(share, EDGE), 1 - EDGE)))


def _tabulate_variation(value: object) -> object:
    """Return the value as a table: a list or a single value as kind "list", one with ``from`` as kind "range"."""
    if isinstance(value, str | int | float):
        return {"kind": "list", "values": [value]}
    if isinstance(value, list | tuple):
        return {"kind": "list", "values": value}
    if isinstance(value, Mapping) and "kind" not in value and "from" in value:
        return {**value, "kind": "range"}
    return value


if TYPE_CHECKING:
    AnyVariation = Variation
else:
    AnyVariation = Annotated[fields.one_of(fields.kinds_below(Variation)), BeforeValidator(_tabulate_variation)]
