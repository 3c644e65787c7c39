"""The flat reed that is clamped at its root."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, ClassVar, Final, Literal

import numpy as np

import impact
from impact.bodies.body import Body
from impact.greens.base import Array
from seatfem.fields import of_same_names
from seatfem.structures.kinds.beam import UniformBeam
from seatfem.structures.kinds.striking import At

if TYPE_CHECKING:
    from impact.after.stresses import ReedStress

PLACES: Final = 17
"""Along a reed, the root and the tip among them, whose fatigue is judged beside that of its largest stresses."""


class Cantilever(UniformBeam):
    """A flat reed, clamped at its root: an Euler-Bernoulli beam; by default as wide and thick as the paper's."""

    has_stress: ClassVar[bool] = True

    sample: ClassVar[str] = """
length = "25 mm"
width = "10 mm"
thickness = "0.3 mm"
material = "steel"
damping_ratio = 0.02
"""
    sample_motion: ClassVar[str] = 'release = { tip_deflection = "1 mm" }'

    kind: Literal["cantilever"]

    def beam(self) -> impact.Cantilever:
        return of_same_names(impact.Cantilever, self, self.material)

    def stress(
        self, force: Array, dt: float, body: Body, at: At, *, coarsely: bool, since: float | None = None
    ) -> ReedStress | None:
        from impact.after.stresses import reed_stress  # compiled code, of runs only

        return reed_stress(force, dt, body, self.beam(), contact_at=at, coarsely=coarsely, since=since)

    def stress_histories(
        self, force: Array, dt: float, body: Body, at: At, also: Collection[float] = (), *, few: bool = False
    ) -> Iterator[tuple[str, Array]]:
        """Yield the bending stress of both faces at `PLACES`, the contacts and ``also``; ``few``: at the root in their
        place."""
        from impact.after.stresses import bending_stress

        beam = self.beam()
        contacts = (
            {"contact": at} if isinstance(at, float) else dict(zip(("contact", "stopper"), at or (), strict=False))
        )
        named = {place: name for name, place in {**contacts, "root": 0.0}.items()}
        places = np.unique([*np.linspace(0.0, beam.length, 0 if few else PLACES), *named, *also])
        for place, stress in zip(places, bending_stress(force, dt, body, beam, places, contact_at=at), strict=True):
            name = named.get(place, f"{1e3 * place:.4g} mm from the root")
            yield f"{name}, face towards the seat", stress
            yield f"{name}, face away from the seat", -stress
