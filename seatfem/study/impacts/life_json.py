"""The life of the bodies of a run as JSON holds it, to be found again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from impact.advice import Advice
from impact.life.damage import Life
from impact.life.places import Judged
from impact.life.strength import SpeedMargin
from seatfem.study.impacts.life import Lasting
from seatfem.study.scene import Scene


def as_json(lasting: Lasting) -> dict[str, Any]:
    """Return a life as mappings, lists and numbers; the strengths are those of the scene."""
    return {
        "bodies": [asdict(judged) for judged, _ in lasting.bodies],
        "below": None if lasting.below is None else asdict(lasting.below[0]),
        "speed": None if lasting.speed is None else asdict(lasting.speed),
    }


def from_json(scene: Scene, numbers: Mapping[str, Any]) -> Lasting:
    """Return the life that `as_json` told of a run of this scene.

    Raises:
        ValueError, TypeError, LookupError: numbers that no such life has.
    """
    life = scene.life
    if life is None:
        return Lasting()
    demands = [life.demand(), life.demand("seat")] if life.of_bending else []
    strengths = [demand.strength for demand in demands if demand is not None]
    bodies = tuple(zip(map(_judged, numbers["bodies"]), strengths, strict=True))
    contact, below, speed = life.demand("contact"), numbers["below"], numbers["speed"]
    return Lasting(
        bodies,
        None if below is None or contact is None else (_judged(below), contact.strength),
        None if speed is None else SpeedMargin(**speed),
    )


def _judged(numbers: Mapping[str, Any]) -> Judged:
    life = numbers["life"]
    if life is not None:
        life = Life(**{**life, "advice": tuple(Advice(**each) for each in life["advice"])})
    return Judged(**{**numbers, "life": life})
