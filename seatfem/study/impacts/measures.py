"""The measures of a run, and what the error budget of `impact.runs.budget` is called in summary.json."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Final, Literal, get_args

from impact.after.landings import pair_landings
from impact.after.stresses import ReedStress
from impact.runs.budget import Budget, Values
from seatfem.study.impacts.landings import Face, Landings
from seatfem.study.impacts.touches import Touches
from seatfem.study.scene.measures import Blow, LandingChoice, key_of, values_of

Source = Literal["mesh", "reduction", "time_step", "model", "patch", "striker", "stopper", "lip"]
SOURCES: Final[tuple[Source, ...]] = ("mesh", "reduction", "time_step", "model", "patch")
STRIKER: Final = "striker"
"""What is left by one that was computed; of a plate, a plan chooses the band."""
STOPPER: Final = "stopper"
"""What is left by one that is not exact."""
LIP: Final = "lip"
"""What one port in place of the arcs of a lip leaves, where a plan has chosen it."""


def measured(
    touches: Touches, filter_width: float, stress: ReedStress | None = None, asked: LandingChoice = "hardest"
) -> Values:
    """The measures of a run, SI, by name; ``stress``: the reed's, where it is wanted; ``asked``: of which landing."""
    return values_of(blow_of(touches, filter_width, stress, asked))


def blow_of(
    touches: Touches, filter_width: float, stress: ReedStress | None = None, asked: LandingChoice = "hardest"
) -> Blow:
    """What the measures of a run are taken from."""
    result, landings = touches.seat, () if touches.landings is None else touches.landings.seat
    displacement = result.target_displacement
    return Blow(result.force, result.dt, filter_width, displacement, stress, touches.line, result.film, landings, asked)


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


def bar_keys(budget: Budget, without: Collection[str] = ()) -> dict[str, object]:
    """For summary.json, flat: error_bar_KEY of each measure, and its shares error_SOURCE_KEY.

    The bars of the measures ``without`` one are ``None``: something is left out that no share knows.
    """
    names = [name for name in budget.values if key_of(name) != name]
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
