"""The measures of a run, and what the error budget of `impact.runs.budget` is called in summary.json."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final, Literal

import numpy as np

from impact import measures
from impact.after.result import ImpactResult
from impact.after.spectrum import largest_average
from impact.after.stresses import ReedStress
from impact.greens.base import Array
from impact.runs.budget import Budget, Values

Source = Literal["mesh", "reduction", "time_step", "model", "patch"]
SOURCES: Final[tuple[Source, ...]] = ("mesh", "reduction", "time_step", "model", "patch")
STRIKER: Final = "striker"
"""What is left by one that was computed: no plan makes it finer."""
KEYS: Final = {
    "impulse": "impulse_Ns",
    "filtered_peak": "filtered_peak_force_N",
    "contact_duration": "contact_duration_s",
    "seat_displacement": "max_seat_displacement_m",
    "stress": "peak_reed_stress_after_contact_Pa",
}
"""Measures an accuracy may be asked for, and their keys in summary.json."""


def measured(result: ImpactResult, filter_width: float, stress: ReedStress | None = None) -> Values:
    """The measures of a run, SI, by the names of `KEYS`; ``stress``: the reed's, where it is wanted."""
    return values_of(result.force, result.dt, filter_width, result.target_displacement, stress)


def values_of(
    force: Array, dt: float, filter_width: float, displacement: Array | None, stress: ReedStress | None
) -> dict[str, float]:
    """The measures, from the force of one contact and the seat's displacement, (n + 1,) both, as far as known.

    A contact that never was has duration 0, leaves the seat where it is, whatever round-off says, and stresses nothing:
    "stress" is the reed's after the first touch.
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
        values["stress"] = stress.after_contact.value if stress.after_contact else 0.0
    return values


def bar_keys(budget: Budget, without: Collection[str] = ()) -> dict[str, object]:
    """For summary.json, flat: error_bar_KEY of each measure, and its shares error_SOURCE_KEY.

    The bars of the measures ``without`` one are ``None``: something is left out that no share knows.
    """
    bars: dict[str, object] = {
        f"error_bar_{KEYS[name]}": None if name in without else budget.bar(name) for name in budget.values
    }
    shares = {f"error_{source}_{KEYS[name]}": part[name] for source, part in budget.parts.items() for name in part}
    return bars | shares | {"error_unknown": ", ".join(budget.unknown)}
