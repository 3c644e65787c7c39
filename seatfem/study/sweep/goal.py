"""[optimise]: which measure is to become least or greatest, within which limits, at what cost."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Annotated, Any, Final

from pydantic import BeforeValidator

from seatfem.fields import Contradictions, Fraction, Table, absent, default

LEAST: Final = 5  # evaluations: three for a line and its curvature, one to begin with, one that uses them
CONFIRMED: Final = 3  # points that are carried out at the scene's own target
LOOSE: Final = 1e-3  # of a limit: by so much a constraint whose measure has no error bar may be violated
_CONSTRAINT: Final = re.compile(r"\s*(\w+)\s*(<=|>=)\s*(\S+)\s*")


@dataclass(frozen=True)
class Constraint:
    """A measure of summary.json and its limit [SI]; ``sign`` is 1 where the measure must stay above it, else -1."""

    measure: str
    sign: float
    limit: float

    def __str__(self) -> str:
        return f"{self.measure} {'>=' if self.sign > 0 else '<='} {self.limit:g}"

    def margin(self, value: float) -> float:
        """Return by how much the limit is kept, in the unit of the measure; negative where it is not."""
        return self.sign * (value - self.limit)

    def holds(self, margin: float, bar: float) -> bool:
        """Return whether the limit is kept up to the measure's error bar, or up to `LOOSE` of it without one (nan)."""
        return margin >= -(bar if math.isfinite(bar) else LOOSE * abs(self.limit))


def _constraint(text: object) -> Constraint:
    parts = _CONSTRAINT.fullmatch(text) if isinstance(text, str) else None
    try:
        limit = float(parts[3]) if parts else math.nan
    except ValueError:
        limit = math.nan
    if parts is None or not math.isfinite(limit):
        raise ValueError(
            f"{str(text)[:80]!r} cannot be read; write a key of summary.json, <= or >=, and a number in SI units, as "
            "in 'life_margin >= 1.2' or 'impulse_Ns <= 2e-3'"
        )
    return Constraint(parts[1], 1.0 if parts[2] == ">=" else -1.0, limit)


class Optimise(Table):
    """Which scene is sought."""

    minimise: str | None = absent("key of summary.json of which less is better", pattern=r"^\w+$")
    maximise: str | None = absent("key of summary.json of which more is better", pattern=r"^\w+$")
    subject_to: tuple[Annotated[Any, BeforeValidator(_constraint)], ...] = default(
        (), "limits, as 'life_margin >= 1.2', of keys of summary.json [SI]", max_length=20
    )
    most: int = default(40, "scenes of the search, at most", strict=True, ge=LEAST, le=10_000)
    coarse: Fraction = default("20 %", "accuracy.target of the search")

    @property
    def measure(self) -> str:
        """Return the measure that is optimised."""
        return self.minimise or self.maximise or ""

    @property
    def sign(self) -> float:
        """Return 1 where less is better, else -1."""
        return 1.0 if self.minimise else -1.0

    @property
    def measures(self) -> tuple[str, ...]:
        """Return all measures that are asked for, each once."""
        return tuple(dict.fromkeys((self.measure, *(each.measure for each in self.subject_to))))

    def contradictions(self) -> Contradictions:
        if (self.minimise is None) == (self.maximise is None):
            yield "minimise", "give one of minimise and maximise: a key of summary.json"
