"""The measures of a run, and what the error budget of `impact.runs.budget` is called in summary.json."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from impact.after.landings import pair_landings
from impact.after.spectrum import largest_average
from impact.after.stresses import ReedStress
from impact.greens.base import Array
from impact.runs.budget import Budget, Values
from seatfem.study.impacts.landings import Face, Landings
from seatfem.study.impacts.touches import Touches
from seatfem.study.scene.measures import Blow, LandingChoice, judged_landing, key_of, values_of

Source = Literal["mesh", "reduction", "time_step", "model", "patch", "striker", "stopper", "lip", "record"]
SOURCES: Final[tuple[Source, ...]] = ("mesh", "reduction", "time_step", "model", "patch")
STRIKER: Final = "striker"
"""What is left by one that was computed; of a plate, a plan chooses the band."""
STOPPER: Final = "stopper"
"""What is left by one that is not exact."""
LIP: Final = "lip"
"""What one port in place of the arcs of a lip leaves, where a plan has chosen it."""

RECORD: Final = "record"
"""What the noise of a measured seat's record leaves, and a misfit beyond it."""


def measured(
    touches: Touches, filter_width: float, stress: ReedStress | None = None, asked: LandingChoice = "hardest"
) -> Values:
    """Return the measures of a run, SI, by name; ``stress``: the reed's, if wanted; ``asked``: of which landing."""
    return values_of(blow_of(touches, filter_width, stress, asked))


def blow_of(
    touches: Touches, filter_width: float, stress: ReedStress | None = None, asked: LandingChoice = "hardest"
) -> Blow:
    """Return what the measures of a run are taken from."""
    result, landings = touches.seat, () if touches.landings is None else touches.landings.seat
    force, moved, film, line = result.force, result.target_displacement, result.film, touches.line
    since = None if stress is None else stress_since(touches, asked)
    return Blow(force, result.dt, filter_width, moved, stress, line, film, landings, asked, since)


def stress_since(touches: Touches, asked: LandingChoice) -> float | None:
    """Return when the landing begins that a reed's stress is told apart by [s]; ``None`` where there is none."""
    landings = () if touches.landings is None else touches.landings.seat
    landing = judged_landing(landings, asked)
    return None if landing is None else landing.start


OF_A_LANDING: Final[Mapping[str, str]] = {
    "start": "time_s",
    "closing_speed": "closing_speed_m_per_s",
    "filtered_peak": "filtered_peak_force_N",
    "excess_peak": "excess_peak_force_N",
    "impulse": "impulse_Ns",
    "duration": "duration_s",
    "restitution": "restitution",
}
"""What of each landing has an error bar: the field of `impact.after.landings.Landing`, and its key in a record."""


def landing_name(face: Face, number: int, key: str) -> str:
    """Return what a key of a landing, numbered from 0 on, is called among the values of a run."""
    return f"{face} {number} {key}"


def is_of_a_landing(name: str) -> bool:
    """Return whether a value of a run is one of `landing_name`."""
    return name.startswith(tuple(f"{face} " for face in get_args(Face)))


def is_time(name: str) -> bool:
    """Return whether a value of a run is when a landing begins."""
    return is_of_a_landing(name) and name.endswith(f" {OF_A_LANDING['start']}")


def values_of_landings(landings: Landings, like: Landings | None = None) -> dict[str, float]:
    """Return the numbers of each landing that have error bars.

    ``like``: of a neighbouring run, whose landings are looked for; one without partner has infinite values.
    """
    values: dict[str, float] = {}
    for face in get_args(Face):
        own = landings.on(face)
        partners = own if like is None else pair_landings(like.on(face), own)
        for number, landing in enumerate(partners):
            for field, key in OF_A_LANDING.items():
                value = math.inf if landing is None else getattr(landing, field)
                if value is not None:
                    values[landing_name(face, number, key)] = value
    return values


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


@dataclass(frozen=True)
class RunRecord:
    """Histories and results of one run, from which its values are taken.

    Attributes:
        blow: of the seat.
        landings: of the run; ``None``: not looked for.
        stopper: (n + 1,) force of the stopper [N]; ``None`` where there is none.
    """

    blow: Blow
    landings: Landings | None = None
    stopper: Array | None = None


def values_of_record(record: RunRecord, like: Landings | None = None) -> Values:
    """Return all values of a run that have error bars, by name.

    ``like``: the landings of a neighbouring run, each of which is looked for; ``None``: of the run's own.
    """
    blow, landings = record.blow, record.landings
    return {
        **values_of(blow, None if like is None else like.seat),
        **({} if landings is None else values_of_landings(landings, like)),
        **stopper_values(record.stopper, blow.dt, blow.filter_width),
    }


def bar_keys(budget: Budget, without: Collection[str] = ()) -> dict[str, object]:
    """Return the error bars for summary.json, flat: error_bar_KEY of each measure, and its error_SOURCE_KEY.

    The bars of the measures ``without`` one are ``None``: something is left out that no share knows.
    """
    names = [name for name in budget.values if not is_of_a_landing(name)]
    bars: dict[str, object] = {
        f"error_bar_{key_of(name)}": None if name in without else _known(budget.bar(name)) for name in names
    }
    shares = {
        f"error_{source}_{key_of(name)}": _known(part[name])
        for source, part in budget.parts.items()
        for name in names
        if name in part
    }
    return bars | shares | {"error_unknown": ", ".join(budget.unknown)}


def _known(error: float) -> float | None:
    """Return an error, ``None`` where it is not known."""
    return error if math.isfinite(error) else None
