"""Fatigue life from the stress histories of one run, by the table [life], its keys and its JSON form."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

import impact
from impact.after import loads, measures
from impact.after.histories import ReedStress
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
"""Pairs of a place ("body, place") and its stress over the run [Pa]: (n + 1,) uniaxial, or (n + 1, 6) tensors."""
STRESS: Final = "stress"
"""The measure whose error bar gives that of the margin of a beam."""


@dataclass(frozen=True)
class LifeResult:
    """Fatigue life of the bodies of one run, for the strengths in the scene.

    Attributes:
        bodies: for each body, life and margins at its worst places, and the strength.
        below: the same for depths below a Hertzian contact; ``None`` if not asked for.
        speed: allowed and largest closing speed; ``None`` without a stated limit or a contact.
    """

    bodies: tuple[tuple[Judged, strength.Strength], ...] = ()
    below: tuple[Judged, strength.Strength] | None = None
    speed: strength.SpeedMargin | None = None

    @property
    def of_one_axis(self) -> tuple[Judged, strength.Strength] | None:
        """Return the result of the body with the least margin over the design life (uniaxial, on critical planes)."""
        candidates = [each for each in self.bodies if each[0].life is not None]
        return min(candidates, key=lambda each: each[0].life.margin if each[0].life else math.inf, default=None)

    @property
    def of_several_axes(self) -> tuple[Judged, strength.Strength] | None:
        """Return the result of the body with the least margin by the multiaxial criterion."""
        candidates = [each for each in self.bodies if each[0].tensor_at is not None]
        return min(candidates, key=lambda each: each[0].tensor_margin or 0.0, default=None)


def lasting(
    life: LifeTable | None, touches: Touches, first: int, reed: Histories, seat: Histories = (), stiffness: float = 0.0
) -> LifeResult:
    """Return the life of the bodies under the repeated stress block of one run; tensors are evaluated on critical
    planes and, if the scene has one, by a multiaxial criterion.

    ``life``: the table [life]; ``first``: first step of the block (`block_from`); ``reed``, ``seat``: stress histories;
    ``stiffness``: stiffness of a Hertzian contact [N/m^1.5], 0 for other laws.
    """
    if life is None:
        return LifeResult()
    allowed, closing = life.allowed_speed(), measures.largest_impact_velocity(touches.seat)
    speed = None if allowed is None or math.isnan(closing) else strength.speed_margin(closing, allowed)
    bodies = []
    for demand, histories in ((life.demand(), reed), (life.demand("seat"), seat)):
        if demand is not None and life.of_bending:
            block = ((name, thinned(each[first:])) for name, each in histories)
            result = judged(on_planes(block, tensors=demand.several_axes is not None), demand)
            bodies.append((result, demand.strength))
    contact = life.demand("contact")
    below = None if contact is None else (judged(_below_contact(life, stiffness, touches), contact), contact.strength)
    return LifeResult(tuple(bodies), below, speed)


def beam_histories(
    geometry: ContactGeometry,
    striker: impact.Body,
    touches: Touches,
    stress: ReedStress | None,
    *,
    few: bool = False,
) -> Iterator[tuple[str, Array]]:
    """Yield the stress histories of `seatfem.structures.kinds.structure.KnownStress.histories`, those at the places of
    the ``stress`` peaks included."""
    force, dt = pushes(striker, touches.seat.force, touches.stopper_forces), touches.seat.dt
    peaks = () if stress is None else (stress.initial, stress.after_contact, stress.largest)
    peak_places = {peak.at for peak in peaks if peak is not None}
    body = loads.without_springs(with_recorded_loads(striker, lift_of(touches), dt), force, dt)
    if (known := geometry.reed.stress(force, dt, body, geometry.contact_at)) is not None:
        yield from known.histories(peak_places, few=few)


def block_from(life: LifeTable | None, turn: float | None, touches: Touches) -> int:
    """Return the first step of the repeated stress block: 0 for the whole run, or a crank ``turn`` [s] before the
    end."""
    if life is None or life.block != "last cycle":
        return 0
    assert turn is not None
    return max(0, len(touches.seat.time) - 1 - round(turn / touches.seat.dt))


def _below_contact(life: LifeTable, stiffness: float, touches: Touches) -> Iterator[tuple[str, Array]]:
    """Yield depths below a Hertzian contact and the stress there, if [life] asks for it."""
    if life.contact_modulus is not None and stiffness:
        largest = float(touches.seat.solid.max())
        yield from hertz_path(largest, stiffness=stiffness, modulus=life.contact_modulus, poisson=life.contact_poisson)


def life_keys(lasting: LifeResult) -> dict[str, object]:
    """Return the keys of the life for summary.json; ``None`` for an infinite margin or life."""
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
    """Return the demands of [life], the strengths, and the error bars of the margins for summary.json.

    Margins are inversely proportional to stress: `impact.life.places.margin_error`. ``bars``: relative error bars of
    the stress by body; the margin of a body without one, as without contact, has none.
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
    """Return the body of a place of `Histories`."""
    return place.split(",")[0]


def life_notes(life: LifeTable | None, lasting: LifeResult) -> tuple[str, ...]:
    """Return advice on the life, such as on immediate failure, and a note if no closing speed can be compared."""
    worst = lasting.of_one_axis
    notes = [] if worst is None or worst[0].life is None else [f"life: {advice}" for advice in worst[0].life.advice]
    if life is not None and lasting.speed is None and life.allowed_speed() is not None:
        notes.append("life: nothing closed within run.duration, so there is no speed to compare with the allowed one")
    return tuple(notes)


def as_json(lasting: LifeResult) -> dict[str, Any]:
    """Return a life as JSON-compatible values, without the strengths, which the scene has."""
    return {
        "bodies": [asdict(judged) for judged, _ in lasting.bodies],
        "below": None if lasting.below is None else asdict(lasting.below[0]),
        "speed": None if lasting.speed is None else asdict(lasting.speed),
    }


def from_json(life: LifeTable | None, numbers: Mapping[str, Any]) -> LifeResult:
    """Return the life that `as_json` wrote for a run of a scene with this table [life].

    Raises:
        ValueError, TypeError, LookupError: the numbers do not match the table.
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
