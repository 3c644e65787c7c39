"""Keys of a scene that have a finer value, each with the source of the error budget that estimates its effect.

A key that is in neither table here fails a test: what can be made finer is in the error bars, or has a reason why not.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from seatfem.structures.rings import MOST_RINGS
from seatfem.study.impacts.measures import Source
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

OF_THE_METHOD: Final[Mapping[str, Source]] = {
    MODEL: "model", BAND: "reduction", TOLERANCE: "reduction", SIZE: "mesh", CONTACT_SIZE: "mesh", ORDER: "mesh",
    MODES: "model", SEAT_MODES: "model", STEP: "time_step", RINGS: "patch", PORTS: "patch", REED_BAND: "striker",
}  # fmt: skip
"""The source that a key of a method is behind."""
OF_OTHER_BODIES: Final[Mapping[str, Source]] = {
    **{f"reed.{key}": "striker" for key in ("model", "mesh.size", "mesh.contact_size", "mesh.order")},
    "reed.greens.tolerance": "striker",
    **{f"stopper.{key}": "stopper" for key in ("model", "mesh.size", "mesh.contact_size", "mesh.order", "n_modes")},
    **{f"stopper.greens.{key}": "stopper" for key in ("bandwidth", "tolerance")},
}
"""The same of keys that no plan chooses."""
BEHIND: Final[Mapping[str, Source]] = {**OF_THE_METHOD, **OF_OTHER_BODIES}
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
FINER_IS_LESS: Final = (SIZE, CONTACT_SIZE, TOLERANCE, STEP)


def not_finer(method: RunMethod, reference: RunMethod) -> tuple[str, ...]:
    """Return the keys of a ``method`` that a ``reference`` for it has no finer value of; models and element orders must
    be the same at least."""
    same = (MODEL, ORDER, REDUCTION)
    coarse = []
    for key in FIELDS:
        value, other = method.value(key), reference.value(key)
        if key in same or value is None or other is None or (key == RINGS and value == MOST_RINGS):
            continue
        if other >= value if key in FINER_IS_LESS else other <= value:
            coarse.append(key)
    return tuple(coarse)
