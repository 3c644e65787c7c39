"""Stress of a striker that is known at a few places."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from impact.after.histories import NO_STRESS, PeakStress, ReedStress, Spans, stress_by_spans
from impact.greens.base import Array
from seatfem.structures.fields import peaks


@dataclass(frozen=True)
class StressAtPlaces:
    """The stress of a striker at a few places: a `seatfem.structures.kinds.structure.KnownStress`.

    Attributes:
        places: by its name the distance of each place from the root or the contact [m], and its stress in time [Pa].
        force, dt: contact force (n + 1, ...) [N] and time step [s].
        is_inside: whether they lie below the surface, where no hot spot is reported.
    """

    places: Mapping[str, tuple[float, Array]]
    force: Array
    dt: float
    is_inside: bool = False

    def largest(self, *, coarsely: bool, since: float = math.nan) -> ReedStress:
        spans, histories = Spans.from_forces(self.force, self.dt, since), (stress for _, stress in self.places.values())
        sizes = np.array([np.abs(each) if each.ndim == 1 else peaks.von_mises(each) for each in histories])
        numbers, distances = spans.find_numbers(np.arange(len(self.force))), [at for at, _ in self.places.values()]

        def largest(chosen: slice) -> PeakStress:
            within = np.where(np.isin(numbers, np.arange(spans.count)[chosen]), sizes, 0.0)
            place, step = np.unravel_index(int(within.argmax()), within.shape)
            value = float(within[place, step])
            return PeakStress(value, distances[place], self.dt * int(step)) if value else NO_STRESS

        return stress_by_spans(spans, largest)

    def histories(self, also: Collection[float] = ()) -> Iterator[tuple[str, Array]]:
        return ((name, stress) for name, (_, stress) in self.places.items())

    def spots(self, worst: float) -> Iterator[tuple[str, Array, Array]]:
        places = {} if self.is_inside else self.places
        return ((name, np.array([at]), stress) for name, (at, stress) in places.items())
