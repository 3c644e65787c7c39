"""The measures of a run, and what the error budget of `impact.runs.budget` is called in summary.json."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import ClassVar, Final, Literal

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


@dataclass(frozen=True)
class Blow:
    """What measures are taken from.

    Attributes:
        force: (n + 1,) of one contact [N].
        dt: step [s].
        filter_width: of the run [s].
        displacement: (n + 1,) of the seat's patch [m]; ``None``: not known.
        stress: the reed's; ``None``: not known.
    """

    force: Array
    dt: float
    filter_width: float
    displacement: Array | None = None
    stress: ReedStress | None = None


class Measure(ABC):
    """A number that an accuracy may be asked for. A subclass with a ``name``, in any file, is one more.

    Attributes:
        name: in ``accuracy.measures``.
        key: in summary.json, with its unit.
        words: in the tables of a run.
        needs_displacement, needs_stress: what it takes of the run beside the force.
    """

    name: ClassVar[str]
    key: ClassVar[str]
    words: ClassVar[str]
    needs_displacement: ClassVar[bool] = False
    needs_stress: ClassVar[bool] = False

    @abstractmethod
    def of(self, blow: Blow) -> float:
        """Its value [SI]. A contact that never was has the value 0."""


class Impulse(Measure):
    """Integral of the force."""

    name, key, words = "impulse", "impulse_Ns", "impulse"

    def of(self, blow: Blow) -> float:
        return float(np.sum(blow.force[1:])) * blow.dt


class FilteredPeak(Measure):
    """Largest average of the force over the filter's width."""

    name, key, words = "filtered_peak", "filtered_peak_force_N", "peak force"

    def of(self, blow: Blow) -> float:
        return largest_average(blow.force[1:], blow.dt, blow.filter_width)


class ContactDuration(Measure):
    """Of the first group of contacts."""

    name, key, words = "contact_duration", "contact_duration_s", "contact duration"

    def of(self, blow: Blow) -> float:
        groups = measures.merged(blow.dt * measures.closed_steps(blow.force[1:]))
        return float(groups[0, 1] - groups[0, 0]) if len(groups) else 0.0


class SeatDisplacement(Measure):
    """The seat's largest; 0 where nothing touched it, whatever round-off says."""

    name, key, words = "seat_displacement", "max_seat_displacement_m", "seat displacement"
    needs_displacement = True

    def of(self, blow: Blow) -> float:
        return float(np.max(np.abs(blow.displacement))) if np.any(blow.force) else 0.0  # type: ignore[arg-type]


class Stress(Measure):
    """The reed's largest after the first touch."""

    name, key, words = "stress", "peak_reed_stress_after_contact_Pa", "reed stress after the first touch"
    needs_stress = True

    def of(self, blow: Blow) -> float:
        peak = blow.stress.after_contact if blow.stress else None
        return peak.value if peak else 0.0


def all_measures() -> Mapping[str, Measure]:
    """One of each that is defined by now, by name, ours first."""
    return {each.name: each() for each in Measure.__subclasses__() if "name" in vars(each)}


def key_of(name: str) -> str:
    """Of a measure in summary.json; the name itself where there is none."""
    found = all_measures().get(name)
    return name if found is None else found.key


def any_needs_stress(names: Collection[str]) -> bool:
    """Whether the reed's stress is wanted for one of these measures."""
    return any(each.needs_stress for name, each in all_measures().items() if name in names)


def measured(result: ImpactResult, filter_width: float, stress: ReedStress | None = None) -> Values:
    """The measures of a run, SI, by name; ``stress``: the reed's, where it is wanted."""
    return values_of(result.force, result.dt, filter_width, result.target_displacement, stress)


def values_of(
    force: Array, dt: float, filter_width: float, displacement: Array | None, stress: ReedStress | None
) -> dict[str, float]:
    """The measures, from the force of one contact and the seat's displacement, (n + 1,) both, as far as known."""
    blow = Blow(force, dt, filter_width, displacement, stress)
    return {
        name: each.of(blow)
        for name, each in all_measures().items()
        if not (each.needs_displacement and displacement is None) and not (each.needs_stress and stress is None)
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
