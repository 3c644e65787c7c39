"""Errors by the end of the record.

Numerical errors of one bounce shift the time of the next. A record that ends in a contact, or shortly before or after
one, then contains too much or too little of it, and coarser runs, whose contact may lie beyond the end altogether, do
not reveal this error.
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
"""Name of a further measure in a budget: the time at which the last complete contact has half its impulse
[s].
"""

FAINT: Final = 0.2  # least impulse of a contact that counts, over the largest


@dataclass(frozen=True)
class LastTouch:
    """The last complete contact of a record or, without any, the one that the end cuts.

    Contacts with less than `FAINT` of the largest impulse are ignored.

    Attributes:
        impulse: impulse from the start of the run to the middle of this contact [N s]; 0 without contact.
    """

    impulse: float

    @staticmethod
    def from_record(record: ContactRecord) -> LastTouch:
        """Return the last touch of a run."""
        force, running = _solid_force(record), _impulse(record)
        touches = closed_steps(force)
        borne = np.diff(running[touches.astype(np.int64)])[:, 0] if len(touches) else np.zeros(0)
        touches = touches[borne > FAINT * borne.max(initial=0.0)]
        whole = touches[touches[:, 1] < len(force)]
        ends = (whole if len(whole) else touches)[-1:]
        return LastTouch(float(running[ends].mean()) if len(ends) else 0.0)

    def time(self, record: ContactRecord) -> float:
        """Return the time [s] at which another run has transferred this impulse; its end, if it never does."""
        running = _impulse(record)
        after = int(np.searchsorted(running, self.impulse))
        if after == 0 or after == len(running):
            return 0.0 if after == 0 else record.dt * (len(running) - 1)
        before, next_ = running[after - 1 : after + 1]
        return record.dt * (after - 1 + float((self.impulse - before) / (next_ - before)))


def clock_off(budget: Budget) -> float:
    """Return the error bar of the time of the last contact, from its changes in the runs of a budget [s]."""
    return SAFETY * sum(part.get(CLOCK, 0.0) for part in budget.parts.values())


def with_end(budget: Budget, beyond: ContactRecord, duration: float, off: float) -> Budget:
    """Return the budget with the change if the record ended ``off`` [s] earlier or later than ``duration`` [s].

    It is added to the source that shifts the last contact most. ``beyond``: the record of the run, longer by ``off``.
    """
    if not any(CLOCK in part for part in budget.parts.values()):
        return budget
    at_end = _until(beyond, duration)
    values, like = values_of(at_end), at_end.landings
    others = (values_of(_until(beyond, duration + by), like) for by in (-off, off))
    cut: Values = dict.fromkeys(budget.values, 0.0)
    for other in others:
        cut = larger(cut, {**cut, **changes(values, other)})
    source = max(budget.parts, key=lambda name: budget.parts[name].get(CLOCK, 0.0))
    return replace(budget, parts={**budget.parts, source: total(budget.parts[source], {**cut, CLOCK: 0.0})})


def without_clock(budget: Budget) -> Budget:
    """Return the budget without `CLOCK`."""
    parts = {source: _without_clock(part) for source, part in budget.parts.items()}
    return replace(budget, values=_without_clock(budget.values), parts=parts)


def _without_clock(values: Values) -> Mapping[str, float]:
    return {name: value for name, value in values.items() if name != CLOCK}


def _solid_force(record: ContactRecord) -> Array:
    """Return the (n,) contact force without that of the film [N]."""
    return (record.force if record.film is None else record.force - record.film)[1:]


def _impulse(record: ContactRecord) -> Array:
    """Return the (n + 1,) impulse of the contact force, without the film, up to each step [N s]."""
    return np.concatenate([[0.0], record.dt * np.cumsum(_solid_force(record))])


def _until(record: ContactRecord, time: float) -> ContactRecord:
    """Return the record up to a time [s], without stresses."""
    steps = min(len(record.force) - 1, max(1, round(time / record.dt)))
    first_steps = slice(steps + 1)
    line, film, displacement = record.line, record.film, record.displacement
    if line is not None:
        of_film = None if line.film is None else line.film[first_steps]
        line = replace(line, force=line.force[first_steps], film=of_film)
    film, displacement = (None if values is None else values[first_steps] for values in (film, displacement))
    landings = tuple(_landing_until(record, landing, time) for landing in record.landings if landing.start < time)
    force = record.force[first_steps]
    return replace(record, force=force, displacement=displacement, film=film, line=line, stress=None, landings=landings)


def _landing_until(record: ContactRecord, landing: Landing, time: float) -> Landing:
    """Return the part of a landing before a time [s]."""
    if landing.end <= time:
        return landing
    first, last, end = (round(at / record.dt) for at in (landing.start, time, landing.end))
    later = record.dt * float(np.sum(record.force[last + 1 : end + 1]))
    peak = landing.filtered_peak
    if landing.peak_time > time:
        peak = largest_average(record.force[first + 1 : last + 1], record.dt, record.filter_width)
    return replace(
        landing, end=time, impulse=landing.impulse - later, filtered_peak=peak, pressed_on=False, cut_off=True
    )
