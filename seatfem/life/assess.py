"""Fatigue life from the stress histories of one run, by the table [life], and its keys."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import TypeAdapter

from impact.after import measures
from impact.greens.base import Array
from impact.life import strength
from impact.life.multiaxial import hertz_path
from impact.life.places import Demand, Judged, judged, margin_error, resolve_on_planes, thin_history
from impact.life.strength import SpeedMargin
from impact.quantities import finite_or_none, percent
from seatfem.life.table import LifeTable
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs.body_stress import Histories


@dataclass(frozen=True)
class BodyLife:
    """Life and margins of a body, ``worst``, at its worst places, with the source of its strength and the number of
    cycles of its limits, nan without any."""

    worst: Judged
    source: str
    limit_cycles: float

    @staticmethod
    def under(histories: Histories, demand: Demand) -> BodyLife:
        """Return the life under named stress histories."""
        return BodyLife(judged(histories, demand), demand.strength.source, demand.strength.limit_cycles)


@dataclass(frozen=True)
class LifeResult:
    """Fatigue life of the bodies of one run, for the strengths in the scene.

    Attributes:
        bodies: life of each body.
        below: the same for depths below a Hertzian contact; ``None`` if not asked for.
        speed: allowed and largest closing speed; ``None`` without a stated limit or a contact.
    """

    bodies: tuple[BodyLife, ...] = ()
    below: BodyLife | None = None
    speed: SpeedMargin | None = None

    @property
    def of_one_axis(self) -> BodyLife | None:
        """Return the result of the body with the least margin over the design life (uniaxial, on critical planes)."""
        candidates = [each for each in self.bodies if each.worst.at]
        return min(candidates, key=lambda each: each.worst.life.margin, default=None)

    @property
    def of_several_axes(self) -> BodyLife | None:
        """Return the result of the body with the least margin by the multiaxial criterion."""
        candidates = [each for each in self.bodies if each.worst.tensor_at]
        return min(candidates, key=lambda each: each.worst.tensor_margin, default=None)


def assess_life(
    life: LifeTable, touches: Touches, first: int, reed: Histories, seat: Histories = (), stiffness: float = 0.0
) -> LifeResult:
    """Return the life of the bodies under the repeated stress block of one run; tensors are evaluated on critical
    planes and, if the scene has one, by a multiaxial criterion.

    ``life``: the table [life]; ``first``: first step of the block (`block_from`); ``reed``, ``seat``: stress histories;
    ``stiffness``: stiffness of a Hertzian contact [N/m^1.5], 0 for other laws.
    """
    landings = () if touches.landings is None else touches.landings.seat
    speeds = [measures.largest_impact_velocity(touches.seat), *(each.closing_speed for each in landings)]
    allowed, closing = life.allowed_speed(), max((each for each in speeds if not math.isnan(each)), default=math.nan)
    speed = None if allowed is None or math.isnan(closing) else strength.speed_margin(closing, allowed)
    bodies = []
    for demand, histories in ((life.demand(), reed), (life.demand("seat"), seat)):
        if demand is not None and life.judges_bending:
            block = ((name, thin_history(each[first:])) for name, each in histories)
            bodies.append(BodyLife.under(resolve_on_planes(block, tensors=demand.several_axes is not None), demand))
    contact = life.demand("contact")
    below = None if contact is None else BodyLife.under(_find_stress_below(life, stiffness, touches), contact)
    return LifeResult(tuple(bodies), below, speed)


def block_from(life: LifeTable, turn: float, touches: Touches) -> int:
    """Return the first step of the repeated stress block: 0 for the whole run, or a crank ``turn`` [s] before the
    end."""
    if life.block != "last cycle":
        return 0
    return max(0, len(touches.seat.time) - 1 - round(turn / touches.seat.dt))


def _find_stress_below(life: LifeTable, stiffness: float, touches: Touches) -> Iterator[tuple[str, Array]]:
    """Yield depths below a Hertzian contact and the stress there, if [life] asks for it."""
    if life.contact_modulus is not None and stiffness:
        largest = float(touches.seat.solid.max())
        yield from hertz_path(largest, stiffness=stiffness, modulus=life.contact_modulus, poisson=life.contact_poisson)


def life_keys(result: LifeResult) -> dict[str, object]:
    """Return the keys of the life for summary.json; ``None`` for an infinite margin or life."""
    keys: dict[str, object] = {}
    if (worst := result.of_one_axis) is not None:
        keys |= {
            "life_margin": finite_or_none(worst.worst.life.margin),
            "life_cycles": finite_or_none(worst.worst.life.blocks),
            "life_damage_per_cycle": finite_or_none(worst.worst.life.damage),
            "life_at": worst.worst.at,
        }
    for name, judgement in (("multiaxial", result.of_several_axes), ("contact", result.below)):
        if judgement is not None and judgement.worst.tensor_at:
            keys |= {
                f"life_{name}_margin": finite_or_none(judgement.worst.tensor_margin),
                f"life_{name}_at": judgement.worst.tensor_at,
            }
    if result.speed is not None:
        keys |= {"life_speed_margin": finite_or_none(result.speed.margin), "life_speed_m_per_s": result.speed.speed}
    return keys


def asked_keys(life: LifeTable, result: LifeResult, bars: Mapping[str, float]) -> dict[str, object]:
    """Return the demands of [life], the strengths, and the error bars of the margins for summary.json.

    Margins are inversely proportional to stress: `impact.life.places.margin_error`. ``bars``: relative error bars of
    the stress by body; the margin of a body without one, as without contact, has none.
    """
    keys: dict[str, object] = {}
    for name, judgement in (("multiaxial", result.of_several_axes), ("contact", result.below)):
        if judgement is not None:
            criterion = life.multiaxial if name == "multiaxial" else life.contact_criterion
            keys[f"life_{name}_criterion"] = criterion
            keys[f"life_{name}_cycles"] = finite_or_none(judgement.limit_cycles)
            keys["life_strength_source"] = judgement.source

    def bar(margin: float, place: str) -> float | None:
        return finite_or_none(margin_error(margin, bars.get(body_of(place), math.inf)))

    if (several := result.of_several_axes) is not None:
        keys["error_bar_life_multiaxial_margin"] = bar(several.worst.tensor_margin, several.worst.tensor_at)
    if (worst := result.of_one_axis) is not None:
        keys |= {
            "life_criterion": life.criterion,
            "life_survival": worst.worst.life.survival,
            "life_basis": f"for {percent(worst.worst.life.survival, 6)} of the parts",
            "life_design_cycles": life.blocks,
            "life_block": life.block,
            "life_strength_source": worst.source,
            "error_bar_life_margin": bar(worst.worst.life.margin, worst.worst.at),
        }
    if result.speed is not None:
        keys |= {"life_speed_limit_m_per_s": result.speed.allowed, "life_speed_source": result.speed.source}
    return keys


def body_of(place: str) -> str:
    """Return the body of a place of `Histories`."""
    return place.split(",")[0]


def life_notes(life: LifeTable, result: LifeResult) -> tuple[str, ...]:
    """Return advice on the life, such as on immediate failure, and a note if no closing speed can be compared."""
    worst = result.of_one_axis
    notes = [] if worst is None else [f"life: {advice}" for advice in worst.worst.life.advice]
    if result.speed is None and life.allowed_speed() is not None:
        notes.append("life: nothing closed within run.duration, so there is no speed to compare with the allowed one")
    return tuple(notes)


def from_json(numbers: Mapping[str, Any]) -> LifeResult:
    """Return the life of which `dataclasses.asdict` made JSON-compatible values. Raises `ValueError` for others."""
    return TypeAdapter(LifeResult).validate_python(numbers)
