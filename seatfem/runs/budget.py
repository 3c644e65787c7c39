"""How far each measure of a run is from the truth, and which part of the model is to blame.

Every source of error is varied on its own, from what was computed to something coarser, and the run repeated: the
change of the *measure* is the size of that source's error in it. With a refinement ratio r and an order q the error
left is the change over r^q - 1; q = 1 is taken for mesh and time step, which is on the safe side. Source:
goal-oriented estimation by coarsening; Becker and Rannacher, Acta Numerica 10 (2001).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np

from impact import measures
from impact.greens import Array
from impact.result import ImpactResult
from impact.spectrum import largest_average

Source = Literal["mesh", "reduction", "time_step", "model"]
SOURCES: Final[tuple[Source, ...]] = ("mesh", "reduction", "time_step", "model")
SAFETY: Final = 1.5  # on the sum of the sources, which need not be independent
STRESS_SAFETY: Final = 2.25  # likewise: the largest stress of all times and places jumps from one to another
KEYS: Final = {
    "impulse": "impulse_Ns",
    "filtered_peak": "filtered_peak_force_N",
    "contact_duration": "contact_duration_s",
    "seat_displacement": "max_seat_displacement_m",
    "stress": "peak_reed_stress_Pa",
}
"""Measures an accuracy may be asked for, and their keys in summary.json."""

Values = Mapping[str, float]


def measured(result: ImpactResult, filter_width: float, stress: float | None = None) -> Values:
    """The measures of a run, SI, by the names of `KEYS`; ``stress``: the reed's, where it has one."""
    return values_of(result.force, result.dt, filter_width, result.target_displacement, stress)


def values_of(
    force: Array, dt: float, filter_width: float, displacement: Array | None, stress: float | None
) -> dict[str, float]:
    """The measures, from the force of one contact and the seat's displacement, (n + 1,) both, as far as known.

    A contact that never was has duration 0, and leaves the seat where it is, whatever round-off says.
    """
    groups = measures.merged(dt * measures.closed_steps(force[1:]))
    values = {
        "impulse": float(np.sum(force[1:])) * dt,
        "filtered_peak": largest_average(force[1:], dt, filter_width),
        "contact_duration": float(groups[0, 1] - groups[0, 0]) if len(groups) else 0.0,
    }
    if displacement is not None:
        values["seat_displacement"] = float(np.max(np.abs(displacement))) if np.any(force) else 0.0
    if stress is not None:
        values["stress"] = stress
    return values


@dataclass(frozen=True)
class Budget:
    """Error left in each measure.

    Attributes:
        values: the measures themselves [SI].
        parts: by source and measure, the error it leaves [SI]; a source that is not there is unknown, one that cannot
            err has zeros.
    """

    values: Values
    parts: Mapping[Source, Values] = field(default_factory=dict)

    def bar(self, measure: str) -> float:
        """Half width of the error bar [SI]: `safety` times the sum over the sources."""
        return safety(measure) * sum(part[measure] for part in self.parts.values())

    def relative(self, measure: str) -> float:
        """The bar over the value; infinite for a value of zero with an error."""
        bar, value = self.bar(measure), abs(self.values[measure])
        return bar / value if value > 0 else (np.inf if bar > 0 else 0.0)

    def dominant(self, measure: str) -> str:
        """The source that contributes most."""
        return max(self.parts, key=lambda source: self.parts[source][measure], default="nothing known")

    @property
    def unknown(self) -> tuple[str, ...]:
        """Sources that nothing is known of."""
        return tuple(source for source in SOURCES if source not in self.parts)

    def keys(self) -> dict[str, object]:
        """For summary.json, flat: error_bar_KEY of each measure, and its shares error_SOURCE_KEY."""
        bars: dict[str, object] = {f"error_bar_{KEYS[name]}": self.bar(name) for name in self.values}
        shares = {f"error_{source}_{KEYS[name]}": part[name] for source, part in self.parts.items() for name in part}
        return bars | shares | {"error_unknown": ", ".join(self.unknown)}


def safety(measure: str) -> float:
    """The error bar of a measure over the sum of what its sources leave."""
    return STRESS_SAFETY if measure == "stress" else SAFETY


def changes(one: Values, other: Values) -> Values:
    """|one - other|, measure by measure."""
    return {name: abs(one[name] - other[name]) for name in one}


def larger(one: Values, other: Values) -> Values:
    """The larger of the two, measure by measure."""
    return {name: max(one[name], other[name]) for name in one}


def times(factor: float, values: Values) -> Values:
    """``factor`` times each."""
    return {name: factor * value for name, value in values.items()}


def total(one: Values, other: Values) -> Values:
    """one + other, measure by measure."""
    return {name: one[name] + other[name] for name in one}
