"""The bodies of a scene on the bases that its [[base]] tables move."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from impact.bodies.body import Body
from impact.greens.base import GreensFunction, GreensFunctionError
from seatfem.structures.kinds.structure import in_role
from seatfem.study.scene import Scene
from seatfem.units import write_quantity

STRAYS: Final = 0.01
"""Most that a body may bend by the inertia that is left out, over the way of its base."""
LOOKS: Final = 20_000  # times at which a course is looked at


def on_its_base(scene: Scene, role: str, body: Body) -> Body:
    """Return the ``body`` in a ``role``, carried by its base and under its own inertia, where that is known.

    Raises:
        GreensFunctionError: a body that nothing holds; `TimeSeriesError`, a file that cannot be used.
    """
    base = scene.base_of(role)
    if base is None or body.base is not None:
        return body
    if not math.isinf(body.mass):
        raise GreensFunctionError(
            f"base.of = {role!r}: nothing holds this body, so that it has no base; clamp it somewhere, or give it a "
            "velocity"
        )
    motion, structure, loads = base.motion(), scene.bodies[role], body.loads
    modes = 0 if body.greens.modal is None else len(body.greens.modal.omega)
    if structure.traits.has_weight and modes:  # a spring in its place has no inertia
        with in_role(role, structure):
            shape, mass = structure.weight(body)
        alike = np.zeros(modes)  # as many as it has: what it is compared with may have fewer, or one more
        alike[: len(shape)] = shape[:modes]
        loads = (*loads, motion.load(alike, mass))
    return replace(body, loads=loads, base=motion.displacement)


def check_base(scene: Scene, role: str, greens: GreensFunction) -> None:
    """Refuse a base that moves so fast that the body, of which the rigid motion alone is known, bends by its inertia.

    It bends by some a/w^2 of its lowest frequency: under a course at a tenth of that by 1 % of its way.

    Raises:
        GreensFunctionError: naming frequency, way and limit.
    """
    base, structure = scene.base_of(role), scene.bodies[role]
    if base is None or (structure.traits.has_weight and greens.modal is not None):
        return
    motion, lowest = base.motion(), _lowest(greens)
    time = np.linspace(0.0, scene.run.duration, LOOKS)
    way, push = float(np.ptp(motion.displacement(time))), float(np.abs(motion.acceleration(time)).max())
    bends = push / lowest**2 if lowest > 0 else math.inf
    if push > 0 and bends > STRAYS * way:
        known = (
            f"its lowest frequency is {write_quantity(lowest / (2 * math.pi), 'frequency', 4)}"
            if lowest
            else "its frequencies are not known"
        )
        raise GreensFunctionError(
            f"base.of = {role!r}: of a body of kind {structure.kind!r} the rigid motion alone is known; {known}, and "
            f"{push:.3g} m/s^2 would bend it by more than {100 * STRAYS:g} % of the way of "
            f"{write_quantity(way, 'length', 3)}: give a slower "
            "course, or a beam or plate"
        )


def _lowest(greens: GreensFunction) -> float:
    """Return the body's lowest angular frequency of its own [rad/s]; ``inf`` for a spring, 0 where it is not known."""
    if greens.rod is not None:
        return math.pi / (2 * greens.rod.transit)
    if greens.modal is None:
        return 0.0
    omega = greens.modal.omega
    return float(omega.min()) if len(omega) else math.inf
