"""Stress of a striker that is known at a few places."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np

from impact.after.histories import NO_STRESS, PeakStress, ReedStress, Spans, stress_by_spans
from impact.greens.base import Array
from seatfem.structures.fields import peaks


@dataclass(frozen=True)
class Place:
    """A place in a striker.

    Attributes:
        name: part of the body on which it lies.
        at: its distance from the root or the contact [m].
        stress: stress over time [Pa]: (n + 1,) uniaxial, > 0 in tension, or (n + 1, 6) tensors xx, yy, zz, yz, xz, xy.
        on_surface: whether it may be a hot spot.
    """

    name: str
    at: float
    stress: Array
    on_surface: bool = True


@dataclass(frozen=True)
class StressAtPlaces:
    """A `structure.KnownStress` by its histories, under the contact ``force`` (n + 1, ...) at steps ``dt`` [s]."""

    places: tuple[Place, ...]
    force: Array
    dt: float

    def largest(self, *, coarsely: bool, since: float | None = None) -> ReedStress:
        """Return the largest |uniaxial| or von Mises stresses of the run, and those before and after the time ``since``
        of a landing [s]."""
        spans = Spans.of_run(self.force, self.dt, since)
        numbers = spans.of_times(np.arange(len(self.force)))
        histories = (place.stress for place in self.places)
        sizes = np.array([np.abs(each) if each.ndim == 1 else peaks.von_mises(each) for each in histories])

        def largest(chosen: slice) -> PeakStress:
            within = np.where(np.isin(numbers, np.arange(spans.count)[chosen]), sizes, 0.0)
            if not within.any():
                return NO_STRESS
            place, step = np.unravel_index(int(within.argmax()), within.shape)
            return PeakStress(float(within[place, step]), self.places[place].at, self.dt * int(step))

        return stress_by_spans(spans, largest)

    def histories(self, also: Collection[float] = ()) -> Iterator[tuple[str, Array]]:
        """Yield name and stress of each place."""
        for place in self.places:
            yield place.name, place.stress

    def spots(self, worst: float) -> Iterator[tuple[str, Array, Array]]:
        """Yield name, position and stress of each place on the surface."""
        for place in self.places:
            if place.on_surface:
                yield place.name, np.array([place.at]), place.stress
