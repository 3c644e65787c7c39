"""The measures of a run: what an accuracy may be asked of. A new one is a subclass of `Measure`, in any file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from impact import measures
from impact.after.along import Pieces, lengths_of, line_force_peak, line_impulse_peak
from impact.after.spectrum import largest_average
from impact.after.stresses import ReedStress
from impact.greens.base import Array
from seatfem.study.safety import OF_IMPULSE, OPENING


@dataclass(frozen=True)
class Line:
    """A contact along a lip.

    Attributes:
        force: (n + 1, arcs) of its arcs [N].
        length: of its centre line, whose arcs are equal, or (arcs,) of each arc [m].
        share: of it over which forces are averaged.
        edges: (arcs + 1,) angles at which the arcs begin and end [rad]; ``None``: angles do not tell places.
        film: (n + 1, arcs) what of the force a film bears [N]; ``None``: nothing.
        pieces: of the line, as in `impact.after.along`.
    """

    force: Array
    length: float | Array
    share: float
    edges: Array | None = None
    film: Array | None = None
    pieces: Pieces = ()

    @property
    def lengths(self) -> Array:
        """(arcs,) [m]."""
        return lengths_of(self.length, self.force.shape[1])

    def degrees_at(self, place: float) -> float | None:
        """Angle at a share of the line from the first arc's beginning; ``None`` where angles do not tell places."""
        if self.edges is None:
            return None
        borders = np.concatenate([[0.0], np.cumsum(self.lengths)]) / self.lengths.sum()
        return round(float(np.degrees(np.interp(place, borders, self.edges))), 6) % 360


@dataclass(frozen=True)
class Blow:
    """What measures are taken from.

    Attributes:
        force: (n + 1,) of one contact [N].
        dt: step [s].
        filter_width: of the run [s].
        displacement: (n + 1,) of the seat's patch [m]; ``None``: not known.
        stress: the reed's; ``None``: not known.
        line: arc by arc, of a contact along a lip; ``None`` of others.
        film: (n + 1,) what of the force a film bears [N]; ``None``: nothing.
    """

    force: Array
    dt: float
    filter_width: float
    displacement: Array | None = None
    stress: ReedStress | None = None
    line: Line | None = None
    film: Array | None = None


class Measure(ABC):
    """A number that an accuracy may be asked for. A subclass with a ``name``, in any file, is one more.

    Attributes:
        name: in ``accuracy.measures``.
        key: in summary.json, with its unit.
        words: in the tables of a run.
        needs_displacement, needs_stress, needs_line: what it takes of the run beside the force.
    """

    name: ClassVar[str]
    key: ClassVar[str]
    words: ClassVar[str]
    needs_displacement: ClassVar[bool] = False
    needs_stress: ClassVar[bool] = False
    needs_line: ClassVar[bool] = False

    def is_known(self, blow: Blow) -> bool:
        """Whether the run tells it."""
        return not (
            (self.needs_displacement and blow.displacement is None)
            or (self.needs_stress and blow.stress is None)
            or (self.needs_line and blow.line is None)
        )

    @abstractmethod
    def of(self, blow: Blow) -> float:
        """Its value [SI]. A contact that never was has the value 0."""

    def jump(self, blow: Blow, share: float) -> float:
        """By how much it may jump [SI] where the impulse is known to a ``share`` of it; 0 of what follows the force
        smoothly."""
        return 0.0


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
    """Of the first group of contacts, of the bodies themselves."""

    name, key, words = "contact_duration", "contact_duration_s", "contact duration"

    def of(self, blow: Blow) -> float:
        return _first(blow.dt * measures.closed_steps(_solid(blow)[1:]))

    def jump(self, blow: Blow, share: float) -> float:
        """Touches that bear less than the ``share`` may be none; openings near the limit may end a group or not."""
        solid = _solid(blow)
        steps = measures.closed_steps(solid[1:])
        if not len(steps):
            return 0.0
        done = np.concatenate([[0.0], np.cumsum(solid[1:])])
        borne = np.diff(done[steps])[:, 0]
        raw, off = blow.dt * steps, min(OPENING, OF_IMPULSE * share)
        kept = raw[borne > min(share * done[-1], float(borne.max()) / 2)]
        others = (_first(kept), *(_first(raw, measures.MERGE * (1 + by)) for by in (-off, off)))
        return max(abs(other - _first(raw)) for other in others)


def _solid(blow: Blow) -> Array:
    """(n + 1,) force of the bodies themselves [N]."""
    return blow.force if blow.film is None else blow.force - blow.film


def _first(raw: Array, merge: float = measures.MERGE) -> float:
    """How long the first group lasts of contacts (n, 2) [s]; 0 without any."""
    groups = measures.merged(raw, merge)
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


class LineForce(Measure):
    """Largest force per length of a lip, averaged over a part of it and over the filter's width."""

    name, key, words = "line_force", "line_force_peak_N_per_m", "force per length"
    needs_line = True

    def of(self, blow: Blow) -> float:
        assert blow.line is not None
        line = blow.line
        return line_force_peak(line.force[1:], blow.dt, blow.filter_width, line.length, line.share, line.pieces)[0]


class LineImpulse(Measure):
    """Largest impulse per length of a lip, averaged over a part of it."""

    name, key, words = "line_impulse", "line_impulse_peak_Ns_per_m", "impulse per length"
    needs_line = True

    def of(self, blow: Blow) -> float:
        assert blow.line is not None
        line = blow.line
        return line_impulse_peak(line.force[1:], blow.dt, line.length, line.share, line.pieces)[0]


def all_measures() -> Mapping[str, Measure]:
    """One of each that is defined by now, by name, ours first."""
    return {each.name: each() for each in Measure.__subclasses__() if "name" in vars(each)}


def in_words(name: str) -> str:
    """A measure in words, its key in brackets."""
    return f"{all_measures()[name].words} ({key_of(name)})"


def key_of(name: str) -> str:
    """Of a measure in summary.json; the name itself where there is none."""
    found = all_measures().get(name)
    return name if found is None else found.key


def any_needs_displacement(names: Collection[str]) -> bool:
    """Whether the displacement of the seat's patch is wanted for one of these measures."""
    return any(each.needs_displacement for name, each in all_measures().items() if name in names)


def any_needs_stress(names: Collection[str]) -> bool:
    """Whether the reed's stress is wanted for one of these measures."""
    return any(each.needs_stress for name, each in all_measures().items() if name in names)
