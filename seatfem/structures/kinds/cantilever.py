"""The flat reed that is clamped at its root."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

import impact
from impact.bodies.body import Body
from impact.greens.base import Array
from seatfem.fields import of_same_names
from seatfem.structures.kinds.beam import UniformBeam
from seatfem.structures.kinds.striking import At

if TYPE_CHECKING:
    from impact.after.stresses import ReedStress


class Cantilever(UniformBeam):
    """A flat reed, clamped at its root: an Euler-Bernoulli beam; by default as wide and thick as the paper's."""

    has_stress: ClassVar[bool] = True

    kind: Literal["cantilever"]

    def beam(self) -> impact.Cantilever:
        return of_same_names(impact.Cantilever, self, self.material)

    def stress(self, force: Array, dt: float, body: Body, at: At, *, coarsely: bool) -> ReedStress | None:
        from impact.after.stresses import reed_stress  # compiled code, of runs only

        return reed_stress(force, dt, body, self.beam(), contact_at=at, coarsely=coarsely)
