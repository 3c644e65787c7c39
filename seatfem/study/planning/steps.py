"""Time steps and numbers of reed modes that can be chosen: the error that each leaves, and its cost."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from seatfem.study.accuracy.sensitivity import Changes, Rung, no_better_than_finer
from seatfem.study.impacts.contact import MAX_STEPS, gas_step
from seatfem.study.ladders import fitted
from seatfem.study.method import MODES, REED_BAND, STEP, RunMethod, is_given
from seatfem.study.planning.costs import (
    BUDGET_RUNS,
    ContactModel,
    closed_form,
    contact_model,
    contact_seconds,
    with_striker,
)
from seatfem.study.planning.seen import Seen


@dataclass(frozen=True)
class ContactOption:
    """One way to march.

    Attributes:
        dt: time step [s].
        n_modes: of the reed; ``None`` for a rigid mass.
        changes: by key, the relative error left in each measure.
        seconds, per_pole: cost with a seat without poles, and of each of its poles [s].
    """

    dt: float
    n_modes: int | None
    changes: Mapping[str, Changes]
    seconds: float
    per_pole: float


def contact_options(seen: Seen, *, closed: bool) -> tuple[ContactOption, ...]:
    """Return every time step with every number of modes; a key that the file states is a ladder of one.

    ``closed``: the seat is a closed form, whose poles follow from the step.
    """
    return tuple(_option(seen, step, modes, closed) for step in _steps(seen) for modes in _modes(seen))


def _steps(seen: Seen) -> tuple[Rung, ...]:
    stated, duration, sensitivity = seen.stated.time_step, seen.scene.run.duration, seen.sensitivity
    if stated is not None:
        return (Rung(stated, sensitivity.of_stated_step(stated)),)
    stored = [rung for rung in sensitivity.steps if duration <= MAX_STEPS * rung.value]
    if stored and (most := gas_step(seen.scene)) < math.inf:
        finest = min(stored, key=lambda rung: rung.value)
        stored = [rung for rung in stored if rung.value <= most] or [Rung(most, finest.changes)]
    rungs = (Rung(fitted(rung.value, duration), rung.changes) for rung in stored or sensitivity.steps[:1])
    return no_better_than_finer(tuple(rungs))


def _modes(seen: Seen) -> Iterator[Rung | None]:
    stated = seen.stated.reed.n_modes
    if stated is None:
        yield None
    elif is_given(seen.scene, MODES):
        yield Rung(stated, seen.sensitivity.of_modes(stated))
    else:
        yield from no_better_than_finer(seen.sensitivity.modes)


def _option(seen: Seen, step: Rung, modes: Rung | None, closed: bool) -> ContactOption:
    errors = seen.sensitivity.known_to(step.value, step.changes)
    changes = {STEP: errors} if modes is None else {STEP: errors, MODES: modes.changes}
    if seen.band is not None:
        changes[REED_BAND] = seen.band.left
    number = None if modes is None else round(modes.value)
    stated = replace(seen.stated, reed=replace(seen.stated.reed, n_modes=number))
    if closed:
        run = seen.scene.run.duration / step.value
        model = contact_model(run, step.value, closed_form(seen.scene, seen.stated))
        model = with_striker(model, seen.scene, stated, step.value, seen.sensitivity.bench.striker)
        return ContactOption(step.value, number, changes, sum(contact_seconds(model, seen.machine).values()), 0.0)
    bare, one = (_seconds(seen, stated, step.value, poles) for poles in (0.0, 1.0))
    return ContactOption(step.value, number, changes, bare, one - bare)


def _seconds(seen: Seen, method: RunMethod, dt: float, poles: float) -> float:
    model = ContactModel(max(1.0, seen.scene.run.duration / dt), poles, 1.0, poles, BUDGET_RUNS)
    model = with_striker(model, seen.scene, method, dt, seen.sensitivity.bench.striker)
    return sum(contact_seconds(model, seen.machine).values())
