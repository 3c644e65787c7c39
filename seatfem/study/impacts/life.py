"""How long the reed of a run lives: its histories of stress, judged as [life] asks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Final

import impact
from impact.after.measures import largest_impact_velocity
from impact.after.stresses import ReedStress
from impact.greens.base import Array
from impact.life.damage import Life
from impact.life.places import Judged, judged, left_of
from impact.life.pressed import hertz_path
from impact.life.strength import SpeedMargin, Strength, speed_margin
from impact.runs.budget import Budget
from seatfem.study.impacts.touches import Touches, pushes
from seatfem.study.scene import Scene
from seatfem.study.scene.life import turn_of

STRESS: Final = "stress"
"""The measure whose error bar is that of the margin."""


@dataclass(frozen=True)
class Lasting:
    """What one run leaves of the reed's life, as far as the scene asks for it.

    Attributes:
        found: the worst places; ``None`` without a file of strength.
        strength: by which; likewise.
        speed: allowed and largest speed of closing; ``None`` where no limit is stated, or nothing closed.
    """

    found: Judged | None = None
    strength: Strength | None = None
    speed: SpeedMargin | None = None


def lasting(scene: Scene, striker: impact.Body, touches: Touches, stress: ReedStress | None) -> Lasting:
    """The reed's life under the block of stress of one run.

    Args:
        stress: its largest ones; their places are among those that are judged.
    """
    if scene.life is None:
        return Lasting()
    demand, allowed = scene.life.demand(), scene.life.allowed_speed()
    closing = largest_impact_velocity(touches.seat)
    speed = None if allowed is None or math.isnan(closing) else speed_margin(closing, allowed)
    if demand is None:
        return Lasting(speed=speed)
    histories = chain(blocks(scene, striker, touches, stress), below_contact(scene, touches))
    return Lasting(judged(histories, demand), demand.strength, speed)


def below_contact(scene: Scene, touches: Touches) -> Iterator[tuple[str, Array]]:
    """Depths below a contact of Hertz with the stress there, where [life] asks for it."""
    life, stiffness = scene.life, scene.contact.law.of_a_sphere
    if life is not None and life.contact_modulus is not None and stiffness is not None:
        largest = float(touches.seat.solid.max())
        yield from hertz_path(largest, stiffness=stiffness, modulus=life.contact_modulus, poisson=life.contact_poisson)


def blocks(
    scene: Scene, striker: impact.Body, touches: Touches, stress: ReedStress | None
) -> Iterator[tuple[str, Array]]:
    """Names of places with the block of stress that repeats there: the whole run, or the crank's last turn."""
    force, dt = pushes(striker, touches.seat.force, touches.stopper_force), touches.seat.dt
    also = () if stress is None else (stress.initial.at, stress.largest.at)
    first = 0
    if scene.life is None or not scene.life.of_bending:
        return
    if scene.life.block == "last cycle":
        turn = turn_of(scene)
        assert turn is not None
        first = max(0, len(touches.seat.time) - 1 - round(turn / dt))
    for name, history in scene.reed.stress_histories(force, dt, striker, scene.contact_at, also):
        yield name, history[first:]


def life_keys(lasting: Lasting) -> dict[str, object]:
    """For summary.json; ``None`` for a margin or a life without end."""
    keys: dict[str, object] = {}
    found, speed = lasting.found, lasting.speed
    if found is not None and found.life is not None:
        keys |= {
            "life_margin": _finite(found.life.margin),
            "life_cycles": _finite(found.life.blocks),
            "life_damage_per_cycle": _finite(found.life.damage),
            "life_at": found.at,
        }
    if found is not None and found.tensor_at is not None:
        margin = math.inf if found.tensor_margin is None else found.tensor_margin
        keys |= {"life_contact_margin": _finite(margin), "life_contact_at": found.tensor_at}
    if speed is not None:
        keys |= {"life_speed_margin": _finite(speed.margin), "life_speed_m_per_s": speed.speed}
    return keys


def run_keys(scene: Scene, here: Lasting, there: Lasting, left: Budget, without: tuple[str, ...]) -> dict[str, object]:
    """All of a run: the seat's, those of the spring in its place, what was asked, and the error bar."""
    beside = {f"spring_{key}": value for key, value in life_keys(there).items()}
    return life_keys(here) | beside | asked_keys(scene, here, left, without)


def asked_keys(scene: Scene, lasting: Lasting, left: Budget, without: tuple[str, ...]) -> dict[str, object]:
    """What was asked of the reed's life, by which numbers, and the error bar of its margin, that of the stress.

    Margins are inversely proportional to stress: `impact.life.places.left_of`. Where the stress has no bar, as
    without contact, nor has the margin.
    """
    keys: dict[str, object] = {}
    if scene.life is None:
        return keys
    if lasting.found is not None and lasting.found.life is not None and lasting.strength is not None:
        known = left.values.get(STRESS, 0.0) > 0 and STRESS not in without
        bar = left_of(lasting.found.life.margin, left.relative(STRESS)) if known else math.inf
        keys |= {
            "life_criterion": scene.life.criterion,
            "life_survival": lasting.found.life.survival,
            "life_design_cycles": scene.life.blocks,
            "life_block": scene.life.block,
            "life_strength_source": lasting.strength.source,
            "error_bar_life_margin": _finite(bar),
        }
    if lasting.found is not None and lasting.found.tensor_at is not None and lasting.strength is not None:
        keys["life_contact_criterion"] = scene.life.contact_criterion
        keys["life_contact_cycles"] = lasting.strength.limit_cycles
        keys["life_strength_source"] = lasting.strength.source
    if lasting.speed is not None:
        keys |= {"life_speed_limit_m_per_s": lasting.speed.allowed, "life_speed_source": lasting.speed.source}
    return keys


def life_notes(scene: Scene, lasting: Lasting) -> tuple[str, ...]:
    """In sentences: what breaks at once, and a life that nothing closed on."""
    life: Life | None = None if lasting.found is None else lasting.found.life
    told = [f"life: {advice}" for advice in life.advice] if life is not None else []
    if scene.life is not None and lasting.speed is None and scene.life.allowed_speed() is not None:
        told.append("life: nothing closed within run.duration, so there is no speed to compare with the allowed one")
    return tuple(told)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
