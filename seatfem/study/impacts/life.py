"""Life judged from the stress histories of one run, as [life] asks, and as JSON holds it; starts no runs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

import impact
from impact.after import loads, measures, stresses
from impact.greens.base import Array
from impact.life import damage, strength
from impact.life.multiaxial import hertz_path
from impact.life.places import Judged, judged, margin_error, on_planes, thinned
from impact.march.stepper import with_recorded_loads
from impact.notices import Advice
from impact.quantities import finite_or_none
from seatfem.study.impacts.gas import lift_of
from seatfem.study.impacts.touches import Touches, pushes
from seatfem.study.scene import ContactGeometry
from seatfem.study.scene.life import LifeTable

Histories = Iterable[tuple[str, Array]]
"""Places by name, their body first, with (n + 1,) stress of one axis or (n + 1, 6) tensors over the whole run [Pa]."""
STRESS: Final = "stress"
"""The measure whose error bar is that of the margin of a beam."""


@dataclass(frozen=True)
class LifeResult:
    """Life of the bodies of one run, for the strengths in the scene.

    Attributes:
        bodies: the worst places of each, and by which strength.
        below: the same below a contact of Hertz; ``None`` where nobody asked.
        speed: allowed and largest speed of closing; ``None`` where no limit is stated, or nothing closed.
    """

    bodies: tuple[tuple[Judged, strength.Strength], ...] = ()
    below: tuple[Judged, strength.Strength] | None = None
    speed: strength.SpeedMargin | None = None

    @property
    def of_one_axis(self) -> tuple[Judged, strength.Strength] | None:
        """Return the judgement of the body with the least margin over the design life."""
        candidates = [each for each in self.bodies if each[0].life is not None]
        return min(candidates, key=lambda each: each[0].life.margin if each[0].life else math.inf, default=None)

    @property
    def of_several_axes(self) -> tuple[Judged, strength.Strength] | None:
        """Return the judgement of the body with the least margin by the criterion of several axes."""
        candidates = [each for each in self.bodies if each[0].tensor_at is not None]
        return min(candidates, key=lambda each: each[0].tensor_margin or 0.0, default=None)


def lasting(
    life: LifeTable | None, touches: Touches, first: int, reed: Histories, seat: Histories = (), stiffness: float = 0.0
) -> LifeResult:
    """Return the life of the bodies under the block of stress of one run; tensors are judged on their critical planes,
    and by the criterion of several axes where one is asked for.

    ``life``: the table [life]; ``first``: step of the block, as `block_from` returns it; ``reed``, ``seat``: their
    histories of stress; ``stiffness``: of Hertz's contact [N/m^1.5], 0 of other laws.
    """
    if life is None:
        return LifeResult()
    allowed, closing = life.allowed_speed(), measures.largest_impact_velocity(touches.seat)
    speed = None if allowed is None or math.isnan(closing) else strength.speed_margin(closing, allowed)
    bodies = []
    for demand, histories in ((life.demand(), reed), (life.demand("seat"), seat)):
        if demand is not None and life.of_bending:
            block = ((name, thinned(each[first:])) for name, each in histories)
            judgement = judged(on_planes(block, tensors=demand.several_axes is not None), demand)
            bodies.append((judgement, demand.strength))
    contact = life.demand("contact")
    below = None if contact is None else (judged(_below_contact(life, stiffness, touches), contact), contact.strength)
    return LifeResult(tuple(bodies), below, speed)


def beam_histories(
    geometry: ContactGeometry,
    striker: impact.Body,
    touches: Touches,
    stress: stresses.ReedStress | None,
    *,
    few: bool = False,
) -> Iterator[tuple[str, Array]]:
    """Yield histories as `seatfem.structures.kinds.striking.KnownStress.histories` does, the places of the ``stress``
    peaks among them."""
    force, dt = pushes(striker, touches.seat.force, touches.stopper_force), touches.seat.dt
    peaks = () if stress is None else (stress.initial, stress.after_contact, stress.largest)
    also = {peak.at for peak in peaks if peak is not None}
    marched = loads.without_springs(with_recorded_loads(striker, lift_of(touches), dt), force, dt)
    if (known := geometry.reed.stress(force, dt, marched, geometry.contact_at)) is not None:
        yield from known.histories(also, few=few)


def block_from(life: LifeTable | None, turn: float | None, touches: Touches) -> int:
    """Return the step from which the block of stress is taken that repeats: the whole run, or the crank's last
    ``turn`` [s]."""
    if life is None or life.block != "last cycle":
        return 0
    assert turn is not None
    return max(0, len(touches.seat.time) - 1 - round(turn / touches.seat.dt))


def _below_contact(life: LifeTable, stiffness: float, touches: Touches) -> Iterator[tuple[str, Array]]:
    """Yield depths below a contact of Hertz with the stress there, where [life] asks for it."""
    if life.contact_modulus is not None and stiffness:
        largest = float(touches.seat.solid.max())
        yield from hertz_path(largest, stiffness=stiffness, modulus=life.contact_modulus, poisson=life.contact_poisson)


def life_keys(lasting: LifeResult) -> dict[str, object]:
    """Return the keys of the life for summary.json; ``None`` for a margin or a life without end."""
    keys: dict[str, object] = {}
    if (worst := lasting.of_one_axis) is not None and worst[0].life is not None:
        keys |= {
            "life_margin": finite_or_none(worst[0].life.margin),
            "life_cycles": finite_or_none(worst[0].life.blocks),
            "life_damage_per_cycle": finite_or_none(worst[0].life.damage),
            "life_at": worst[0].at,
        }
    for name, judgement in (("multiaxial", lasting.of_several_axes), ("contact", lasting.below)):
        if judgement is not None and judgement[0].tensor_margin is not None:
            keys |= {
                f"life_{name}_margin": finite_or_none(judgement[0].tensor_margin),
                f"life_{name}_at": judgement[0].tensor_at,
            }
    if lasting.speed is not None:
        keys |= {"life_speed_margin": finite_or_none(lasting.speed.margin), "life_speed_m_per_s": lasting.speed.speed}
    return keys


def asked_keys(life: LifeTable | None, lasting: LifeResult, bars: Mapping[str, float]) -> dict[str, object]:
    """Return the life asked for, its strengths, and the error bars of its margins, from those of the stress.

    Margins are inversely proportional to stress: `impact.life.places.margin_error`. ``bars``: of the stress in the
    bodies, by their names, relative; where there is none, as without contact, the margin has none, either.
    """
    keys: dict[str, object] = {}
    if life is None:
        return keys
    for name, judgement in (("multiaxial", lasting.of_several_axes), ("contact", lasting.below)):
        if judgement is not None:
            criterion = life.multiaxial if name == "multiaxial" else life.contact_criterion
            keys[f"life_{name}_criterion"] = criterion
            keys[f"life_{name}_cycles"] = judgement[1].limit_cycles
            keys["life_strength_source"] = judgement[1].source

    def bar(margin: float, place: str | None) -> float | None:
        return finite_or_none(margin_error(margin, bars.get(body_of(place or ""), math.inf)))

    if (several := lasting.of_several_axes) is not None and several[0].tensor_margin is not None:
        keys["error_bar_life_multiaxial_margin"] = bar(several[0].tensor_margin, several[0].tensor_at)
    if (worst := lasting.of_one_axis) is not None and worst[0].life is not None:
        keys |= {
            "life_criterion": life.criterion,
            "life_survival": worst[0].life.survival,
            "life_design_cycles": life.blocks,
            "life_block": life.block,
            "life_strength_source": worst[1].source,
            "error_bar_life_margin": bar(worst[0].life.margin, worst[0].at),
        }
    if lasting.speed is not None:
        keys |= {"life_speed_limit_m_per_s": lasting.speed.allowed, "life_speed_source": lasting.speed.source}
    return keys


def body_of(place: str) -> str:
    """Return the body that a place is on."""
    return place.split(",")[0]


def life_notes(life: LifeTable | None, lasting: LifeResult) -> tuple[str, ...]:
    """Return in sentences what breaks at once, and a life that nothing closed on."""
    worst = lasting.of_one_axis
    notes = [] if worst is None or worst[0].life is None else [f"life: {advice}" for advice in worst[0].life.advice]
    if life is not None and lasting.speed is None and life.allowed_speed() is not None:
        notes.append("life: nothing closed within run.duration, so there is no speed to compare with the allowed one")
    return tuple(notes)


def as_json(lasting: LifeResult) -> dict[str, Any]:
    """Return a life as mappings, lists and numbers; the strengths are those of the scene."""
    return {
        "bodies": [asdict(judged) for judged, _ in lasting.bodies],
        "below": None if lasting.below is None else asdict(lasting.below[0]),
        "speed": None if lasting.speed is None else asdict(lasting.speed),
    }


def from_json(life: LifeTable | None, numbers: Mapping[str, Any]) -> LifeResult:
    """Return the life that `as_json` wrote for a run of a scene with this table [life].

    Raises:
        ValueError, TypeError, LookupError: numbers that no such life has.
    """
    if life is None:
        return LifeResult()
    demands = [life.demand(), life.demand("seat")] if life.of_bending else []
    strengths = [demand.strength for demand in demands if demand is not None]
    bodies = tuple(zip(map(_judged, numbers["bodies"]), strengths, strict=True))
    contact, below, speed = life.demand("contact"), numbers["below"], numbers["speed"]
    return LifeResult(
        bodies,
        None if below is None or contact is None else (_judged(below), contact.strength),
        None if speed is None else strength.SpeedMargin(**speed),
    )


def _judged(numbers: Mapping[str, Any]) -> Judged:
    life = numbers["life"]
    if life is not None:
        life = damage.Life(**{**life, "advice": tuple(Advice(**each) for each in life["advice"])})
    return Judged(**{**numbers, "life": life})
