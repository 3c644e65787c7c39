"""The waves of a seat whose statics alone was run: what they change is measured, where that costs little."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from impact.greens.base import GreensFunction
from impact.runs.variations import NARROWER
from seatfem.structures.estimates.patch import Patch
from seatfem.structures.method import Method
from seatfem.study.impacts.contact import seat_beside
from seatfem.study.method import RunMethod
from seatfem.study.safety import FIRST_WAVE
from seatfem.study.scene import Scene

CHEAP: Final = "harmonics"  # modes of half sections, of a few hundred unknowns each


def lowest_band(patch: Patch) -> float:
    """Return the narrowest band that describes a body [Hz]: its first resonance, a plate's in bending, and more."""
    bends = patch.bending_frequency / (2 * math.pi)
    return NARROWER * (bends or patch.c_p / (FIRST_WAVE * patch.depth))


def tells_waves(scene: Scene, method: RunMethod) -> bool:
    """Return whether a run on the statics of a seat measures what its waves change: of a body of revolution in arcs."""
    body, seat = scene.seat.drawn, method.seat
    return seat.static and seat.in_arcs and body is not None and body.elements_of(seat) == CHEAP


def method_beside(scene: Scene, method: RunMethod) -> Method | None:
    """Return how the seat with its waves is computed: on the mesh of its statics, in no wider a band than its first
    resonances need; ``None`` where it has them already, or they are expensive."""
    body, seat = scene.seat.drawn, method.seat
    if not tells_waves(scene, method) or body is None or (patch := body.patch()) is None:
        return None
    assert seat.bandwidth is not None
    spec, band = body.mesh_spec(seat), min(seat.bandwidth, lowest_band(patch))
    level = body.level(0.0).level
    return replace(seat, level=level, bandwidth=band, size=spec.size, contact_size=spec.patch_size)


def waves_beside(scene: Scene, method: RunMethod) -> GreensFunction | None:
    """Return the seat with its waves, as `method_beside` says.

    Statics end after the first velocity and lose what waves bring back, in one scene of seed 403 4.3 % of the impulse.
    A surrogate knows neither the seat's section nor its harmonics.
    """
    how = method_beside(scene, method)
    return None if how is None else seat_beside(scene, how).greens
