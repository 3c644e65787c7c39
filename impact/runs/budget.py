"""How far each measure of an impact is from the truth, and which part of the model is to blame.

Every source of error is varied on its own, from what was computed to something coarser, and the run repeated: the
change of the *measure* is the size of that source's error in it. With a refinement ratio r and an order q the error
left is the change over r^q - 1; q = 1 is taken for mesh and time step, which is on the safe side. Source:
goal-oriented estimation by coarsening; Becker and Rannacher, Acta Numerica 10 (2001).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from impact.brief import brief

SAFETY: Final = 1.5  # on the sum of the sources, which need not be independent
STRESS_SAFETY: Final = 2.25  # likewise: the largest stress of all times and places jumps from one to another

Values = Mapping[str, float]
"""Measures by name [SI]."""


@dataclass(frozen=True)
class Budget:
    """Error left in each measure.

    Attributes:
        values: the measures themselves [SI].
        parts: by source and measure, the error it leaves [SI]; a source that is not there is unknown, one that cannot
            err has zeros.
        sources: names of all sources of error, in the order in which they are reported.
    """

    values: Values
    parts: Mapping[str, Values] = field(default_factory=dict)
    sources: tuple[str, ...] = ()

    __repr__ = brief

    def bar(self, measure: str) -> float:
        """Return the half width of the error bar [SI]: `safety` times the sum over the sources."""
        return safety(measure) * sum(part[measure] for part in self.parts.values())

    def relative(self, measure: str) -> float:
        """Return the bar over the value; infinite for a value of zero with an error."""
        bar, value = self.bar(measure), abs(self.values[measure])
        return bar / value if value > 0 else (np.inf if bar > 0 else 0.0)

    def dominant(self, measure: str) -> str:
        """Return the source that contributes most."""
        return max(self.parts, key=lambda source: self.parts[source][measure], default="nothing known")

    @property
    def unknown(self) -> tuple[str, ...]:
        """Return sources that nothing is known of."""
        return tuple(source for source in self.sources if source not in self.parts)

    def __str__(self) -> str:
        rows = [(name, f"{self.values[name]:.5g} +- {self.bar(name):.2g}", self.dominant(name)) for name in self.values]
        width, longest = (max((len(row[i]) for row in rows), default=0) for i in (0, 1))
        lines = [f"{name:{width}}  {value:{longest}}  most of it: {source}" for name, value, source in rows]
        return "\n".join([*lines, f"not known, in no bar: {', '.join(self.unknown) or 'nothing'}"])


def safety(measure: str) -> float:
    """Return the error bar of a measure over the sum of what its sources leave."""
    return STRESS_SAFETY if measure.endswith("stress") else SAFETY


def is_time(measure: str) -> bool:
    """Return whether a measure is a time that is read off the steps of a run: of a contact, of a landing."""
    return "duration" in measure or measure.endswith("time_s")


def changes(one: Values, other: Values) -> Values:
    """Return |one - other|, measure by measure; infinite where either has no such value, or no finite one."""
    apart = {name: abs(value - other.get(name, math.inf)) for name, value in one.items()}
    return {name: math.inf if math.isnan(value) else value for name, value in apart.items()}


def larger(one: Values, other: Values) -> Values:
    """Return the larger of the two, measure by measure; infinite where the other has no such value."""
    return {name: max(value, other.get(name, math.inf)) for name, value in one.items()}


def times(factor: float, values: Values) -> Values:
    """Return ``factor`` times each."""
    return {name: factor * value for name, value in values.items()}


def total(one: Values, other: Values) -> Values:
    """Return one + other, measure by measure."""
    return {name: one[name] + other[name] for name in one}
