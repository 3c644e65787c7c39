"""Ladders: the keys of a scene that have a finer value, each with the source of error that it is behind.

A key that is declared here is in the error budget by its source, is made finer where a run misses its target, and is
finer in a reference. One of the ways in which bodies are computed that is in no table here fails a test.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from impact.quantities import percent
from seatfem.structures.rings import MOST_RINGS
from seatfem.study.impacts.touches import Source
from seatfem.study.impacts.validity import ONE_PORT
from seatfem.study.method import (
    BAND,
    CONTACT_SIZE,
    FIELDS,
    MODEL,
    MODES,
    ORDER,
    PORTS,
    REDUCTION,
    REED_BAND,
    RINGS,
    SEAT_MODES,
    SIZE,
    STEP,
    TOLERANCE,
    RunMethod,
)
from seatfem.study.safety import FEWER, LEAST_FINER, MESH_ORDER
from seatfem.study.scene import Scene
from seatfem.units import write_quantity

BANDS: Final = tuple(float(f"{10 ** (k / 5):.1e}") for k in range(15, 36))
"""Band edges that are chosen from [Hz]: five a decade, so that different contact scenes share a seat."""
TOLERANCES: Final = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)
RING_NUMBERS: Final = (1, 4, 8)
MOST_MODES: Final = 1000

Finer = Callable[[Any, float, Scene], Any]
"""Returns a finer value of a scene's key, which leaves an error smaller by about the factor in the middle."""


@dataclass(frozen=True)
class Ladder:
    """A key of a method that has finer values.

    Attributes:
        source: of the error budget, which estimates what a finer value changes.
        finer: the next value; ``None`` of what no round changes: a model gives way to another plan.
        falls: whether finer values are smaller.
        describe: a value in words, with its unit.
    """

    source: Source
    finer: Finer | None = None
    falls: bool = False
    describe: Callable[[Any], str] = str


def fitted(dt: float, duration: float) -> float:
    """Return a step that ends with the run, as do its double and fourfold [s]: a record of g may end there, too."""
    return duration / (4 * math.ceil(duration / (4 * dt) * (1 - 1e-9)))


def _wider(band: float, _: float, __: Scene) -> float:
    return next((edge for edge in BANDS if edge > band * (1 + 1e-9)), float(LEAST_FINER * band))


def _stricter(tolerance: float, factor: float, _: Scene) -> float:
    return tolerance / factor


def _smaller(size: float, factor: float, _: Scene) -> float:
    return float(f"{size / factor ** (1 / MESH_ORDER):.2g}")


def _more_modes(number: int, factor: float, _: Scene) -> int:
    return min(MOST_MODES, math.ceil(number * FEWER ** math.ceil(math.log2(factor))))


def _shorter(step: float, factor: float, scene: Scene) -> float:
    return fitted(step / factor, scene.run.duration)


def _more_rings(rings: int, _: float, __: Scene) -> int:
    return next((number for number in RING_NUMBERS if number > rings), MOST_RINGS)


def _more_arcs(arcs: int, _: float, __: Scene) -> int:
    return 2 * arcs


def _wider_of_reed(band: float, factor: float, scene: Scene) -> float:
    plate = scene.reed.thin_plate
    return float(min(band * factor**0.5, math.inf if plate is None else max(band, plate.widest_band)))


def large_percent(value: float) -> str:
    """Return a share in percent, whole ones from 1 on."""
    return percent(value) if value < 1 else f"{100 * value:,.0f} %"


def _written(dimension: str) -> Callable[[float], str]:
    return lambda value: write_quantity(value, dimension, 3)


_frequency, _length, _time = map(_written, ("frequency", "length", "time"))
LADDERS: Final[Mapping[str, Ladder]] = {
    MODEL: Ladder("model"),
    BAND: Ladder("reduction", _wider, describe=_frequency),
    TOLERANCE: Ladder("reduction", _stricter, True, large_percent),
    SIZE: Ladder("mesh", _smaller, True, _length),
    CONTACT_SIZE: Ladder("mesh", _smaller, True, _length),
    ORDER: Ladder("mesh"),
    SEAT_MODES: Ladder("model", _more_modes),
    MODES: Ladder("model", _more_modes),
    STEP: Ladder("time_step", _shorter, True, _time),
    RINGS: Ladder("patch", _more_rings),
    PORTS: Ladder("patch", _more_arcs),
    REED_BAND: Ladder("striker", _wider_of_reed, describe=_frequency),
}
"""Ladders of the keys that a plan chooses."""
OF_OTHER_BODIES: Final[Mapping[str, Source]] = {
    **{f"reed.{key}": "striker" for key in ("model", "mesh.size", "mesh.contact_size", "mesh.order")},
    "reed.greens.tolerance": "striker",
    **{f"stopper.{key}": "stopper" for key in ("model", "mesh.size", "mesh.contact_size", "mesh.order", "n_modes")},
    **{f"stopper.greens.{key}": "stopper" for key in ("bandwidth", "tolerance")},
}
"""Sources of error behind keys that no plan chooses."""
BEHIND: Final[Mapping[str, Source]] = {
    **{key: ladder.source for key, ladder in LADDERS.items()},
    **OF_OTHER_BODIES,
    ONE_PORT: "lip",
}
"""The source of error that a key is behind, or a model."""
SAME_ANSWER: Final = "another way to the same g, to within its tolerance"
LEFT_OUT: Final[Mapping[str, str]] = {
    **{
        f"{role}.{key}": SAME_ANSWER
        for role in ("seat", "reed", "stopper")
        for key in ("greens.method", "greens.max_vectors", "greens.backend", "mesh.shape")
    },
    "stopper.arcs": "stated alone: against 32 arcs in two rings, one port was off by 0.2 % under an even pressure",
    "stopper.rings": "stated alone, as its arcs",
}
"""Keys of how a scene is computed that no error bar knows, and why."""


def described(key: str, value: Any) -> str:
    """Return a key's value with its unit."""
    return LADDERS[key].describe(value) if key in LADDERS else str(value)


def not_finer(method: RunMethod, reference: RunMethod) -> tuple[str, ...]:
    """Return the keys of a ``method`` that a ``reference`` for it has no finer value of; models and element orders must
    be the same at least."""
    same = (MODEL, ORDER, REDUCTION)
    coarse = []
    for key in FIELDS:
        value, other = method.value(key), reference.value(key)
        if key in same or value is None or other is None or (key == RINGS and value == MOST_RINGS):
            continue
        if other >= value if LADDERS[key].falls else other <= value:
            coarse.append(key)
    return tuple(coarse)
