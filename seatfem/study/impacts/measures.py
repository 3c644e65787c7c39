"""The measures of a run, and what the error budget of `impact.runs.budget` is called in summary.json."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final, Literal

import numpy as np

from impact.after.spectrum import largest_average
from impact.after.stresses import ReedStress
from impact.greens.base import Array
from impact.runs.budget import Budget, Values
from seatfem.study.impacts.touches import Touches
from seatfem.study.scene.measures import Blow, all_measures, key_of

Source = Literal["mesh", "reduction", "time_step", "model", "patch", "striker", "stopper", "lip"]
SOURCES: Final[tuple[Source, ...]] = ("mesh", "reduction", "time_step", "model", "patch")
STRIKER: Final = "striker"
"""What is left by one that was computed; of a plate, a plan chooses the band."""
STOPPER: Final = "stopper"
"""What is left by one that is not exact."""
LIP: Final = "lip"
"""What one port in place of the arcs of a lip leaves, where a plan has chosen it."""


def measured(touches: Touches, filter_width: float, stress: ReedStress | None = None) -> Values:
    """The measures of a run, SI, by name; ``stress``: the reed's, where it is wanted."""
    return values_of(blow_of(touches, filter_width, stress))


def blow_of(touches: Touches, filter_width: float, stress: ReedStress | None = None) -> Blow:
    """What the measures of a run are taken from."""
    result = touches.seat
    return Blow(result.force, result.dt, filter_width, result.target_displacement, stress, touches.line, result.film)


def values_of(blow: Blow) -> dict[str, float]:
    """The measures, as far as the run tells them."""
    return {name: each.of(blow) for name, each in all_measures().items() if each.is_known(blow)}


def stopper_values(force: Array | None, dt: float, filter_width: float) -> dict[str, float]:
    """Return the numbers of the stopper's contact that have error bars, called as in summary.json; none without it.

    Args:
        force: (n + 1,) of the stopper [N]; ``None`` where there is none.
        dt: step [s].
        filter_width: of the run [s].
    """
    if force is None:
        return {}
    return {
        "stopper_filtered_peak_force_N": largest_average(force[1:], dt, filter_width),
        "stopper_impulse_Ns": float(np.sum(force[1:])) * dt,
    }


def bar_keys(budget: Budget, without: Collection[str] = ()) -> dict[str, object]:
    """For summary.json, flat: error_bar_KEY of each measure, and its shares error_SOURCE_KEY.

    The bars of the measures ``without`` one are ``None``: something is left out that no share knows.
    """
    bars: dict[str, object] = {
        f"error_bar_{key_of(name)}": None if name in without else budget.bar(name) for name in budget.values
    }
    shares = {f"error_{source}_{key_of(name)}": part[name] for source, part in budget.parts.items() for name in part}
    return bars | shares | {"error_unknown": ", ".join(budget.unknown)}
