"""The rigid striker in free flight."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

import impact
from impact.bodies.body import Body
from impact.greens.base import Array, GreensFunction
from impact.quantities import in_units
from seatfem.fields import Approach, Mass
from seatfem.structures.kinds.striking import At
from seatfem.structures.kinds.structure import SampleScene, Structure, Traits
from seatfem.structures.outlines import BodyViews


class RigidMass(Structure):
    """A rigid striker in free flight, as in a drop test."""

    group: ClassVar[str] = "strikers"
    traits: ClassVar[Traits] = Traits(has_weight=True)

    sample: ClassVar[str] = """
mass = "5 g"
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('velocity = "-1 m/s"', "stopper")

    kind: Literal["rigid_mass"]
    mass: Mass = Field(description="mass")
    velocity: Approach = Field(description='velocity at the start; towards the seat it is negative, as in "-2 m/s"')

    @property
    def moved_by(self) -> tuple[str, ...]:
        return ("velocity",)

    @property
    def loose(self) -> str:
        return "seat.kind = 'rigid_mass' is free to move"

    def views(self, at: float | None = None, *, coarse: bool = False) -> BodyViews:
        return BodyViews(f"rigid mass {in_units(self.mass, 'kg')}", symbol="mass")

    def closed_form(self) -> GreensFunction | None:
        return impact.rigid_mass(mass=self.mass, velocity=0.0).greens

    def weight(self, body: Body) -> tuple[Array, float]:
        return self.pushed_at(body, None)[:, 0], self.mass

    def body(self, greens: GreensFunction | None = None, n_modes: int | None = None, at: At = None) -> Body:
        return impact.rigid_mass(mass=self.mass, velocity=self.velocity)
