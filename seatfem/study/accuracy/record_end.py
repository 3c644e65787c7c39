"""Errors by the end of the record.

Each bounce is delayed by what the step, the mesh and all else take of the one before. A record that ends in a touch, or
shortly before or after one, has more or less of it than the truth, and coarser runs, whose touch lies beyond the end
altogether, cannot tell.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from impact.after.histories import largest_average
from impact.after.landings import Landing
from impact.after.measures import closed_steps
from impact.greens.base import Array
from impact.runs.variations import SAFETY, Budget, Values, changes, larger, total
from seatfem.study.scene.measures import ContactRecord, values_of

CLOCK: Final = "last touch"
"""Name, among the measures of runs behind a budget, of the middle of the impulse of the last whole touch [s]."""

FAINT: Final = 0.2  # least impulse of a touch that counts, over the largest


@dataclass(frozen=True)
class LastTouch:
    """The last touch of a record that the end does not cut, or the one that it does where there is no other.

    One that bears less than `FAINT` of the hardest is none: what bodies give each other before it may differ by more.

    Attributes:
        impulse: up to its middle [N s]; 0 without any touch.
    """

    impulse: float

    @staticmethod
    def from_record(blow: ContactRecord) -> LastTouch:
        """Return the last touch of a run."""
        force, running = _touching(blow), _impulse(blow)
        touches = closed_steps(force)
        borne = np.diff(running[touches.astype(np.int64)])[:, 0] if len(touches) else np.zeros(0)
        touches = touches[borne > FAINT * borne.max(initial=0.0)]
        whole = touches[touches[:, 1] < len(force)]
        ends = (whole if len(whole) else touches)[-1:]
        return LastTouch(float(running[ends].mean()) if len(ends) else 0.0)

    def time(self, blow: ContactRecord) -> float:
        """Return when another run has had as much impulse [s]; its end, where it never has."""
        running = _impulse(blow)
        after = int(np.searchsorted(running, self.impulse))
        if after == 0 or after == len(running):
            return 0.0 if after == 0 else blow.dt * (len(running) - 1)
        before, then = running[after - 1 : after + 1]
        return blow.dt * (after - 1 + float((self.impulse - before) / (then - before)))


def clock_off(budget: Budget) -> float:
    """Return by how much the runs of a budget disagree on the time of the last touch, as an error bar [s]."""
    return SAFETY * sum(part.get(CLOCK, 0.0) for part in budget.parts.values())


def with_end(budget: Budget, beyond: ContactRecord, duration: float, off: float) -> Budget:
    """Return the budget with what changes if the record ends ``off`` [s] earlier or later than ``duration`` [s].

    It counts to the source that moves the last touch most. ``beyond``: the same run, longer by ``off``.
    """
    if not any(CLOCK in part for part in budget.parts.values()):
        return budget
    as_it_ends = _until(beyond, duration)
    values, like = values_of(as_it_ends), as_it_ends.landings
    others = (values_of(_until(beyond, duration + by), like) for by in (-off, off))
    cut: Values = dict.fromkeys(budget.values, 0.0)
    for other in others:
        cut = larger(cut, {**cut, **changes(values, other)})
    source = max(budget.parts, key=lambda name: budget.parts[name].get(CLOCK, 0.0))
    return replace(budget, parts={**budget.parts, source: total(budget.parts[source], {**cut, CLOCK: 0.0})})


def without_clock(budget: Budget) -> Budget:
    """Return the budget of the measures alone."""
    parts = {source: _without_clock(part) for source, part in budget.parts.items()}
    return replace(budget, values=_without_clock(budget.values), parts=parts)


def _without_clock(values: Values) -> Mapping[str, float]:
    return {name: value for name, value in values.items() if name != CLOCK}


def _touching(blow: ContactRecord) -> Array:
    """Return the force (n,) of the bodies themselves [N]."""
    return (blow.force if blow.film is None else blow.force - blow.film)[1:]


def _impulse(blow: ContactRecord) -> Array:
    """Return the impulse (n + 1,) of the bodies' own force up to every step [N s]."""
    return np.concatenate([[0.0], blow.dt * np.cumsum(_touching(blow))])


def _until(blow: ContactRecord, time: float) -> ContactRecord:
    """Return the run up to a time [s], without stresses."""
    steps = min(len(blow.force) - 1, max(1, round(time / blow.dt)))
    first_steps = slice(steps + 1)
    line, film, moved = blow.line, blow.film, blow.displacement
    if line is not None:
        of_film = None if line.film is None else line.film[first_steps]
        line = replace(line, force=line.force[first_steps], film=of_film)
    film, moved = (None if values is None else values[first_steps] for values in (film, moved))
    landings = tuple(_landing_until(blow, landing, time) for landing in blow.landings if landing.start < time)
    force = blow.force[first_steps]
    return replace(blow, force=force, displacement=moved, film=film, line=line, stress=None, landings=landings)


def _landing_until(blow: ContactRecord, landing: Landing, time: float) -> Landing:
    """Return the part of a landing before a time [s]."""
    if landing.end <= time:
        return landing
    first, last, end = (round(at / blow.dt) for at in (landing.start, time, landing.end))
    later = blow.dt * float(np.sum(blow.force[last + 1 : end + 1]))
    peak = landing.filtered_peak
    if landing.peak_time > time:
        peak = largest_average(blow.force[first + 1 : last + 1], blow.dt, blow.filter_width)
    return replace(
        landing, end=time, impulse=landing.impulse - later, filtered_peak=peak, pressed_on=False, cut_off=True
    )
