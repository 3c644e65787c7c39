"""The ball: an elastic sphere in free flight, by finite elements."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from impact.bodies.body import Body
from impact.greens.base import Array
from seatfem.fields import KeyProblem, Length
from seatfem.structures.kinds.drawn import Turned
from seatfem.structures.outlines import BodyViews, Size, length_text
from seatfem.structures.shapes import Ball as Sphere


class Ball(Turned):
    """An elastic sphere in free flight. It touches with a small flat facet at its pole, a disc whose radius stays: it
    translates as a rigid body exactly, and its waves and own compliance are in its Green's function. Hertz's contact of
    a ball on a flat face, whose disc grows with the force, is kind = "rigid_mass" with law = { kind = "hertz", ... }:
    that has the compliance of both bodies, and no waves in the ball."""

    group: ClassVar[str] = "strikers"
    sample: ClassVar[str] = """
diameter = "10 mm"
material = "steel"
damping_ratio = 0.005
"""
    sample_motion: ClassVar[str] = 'velocity = "-0.5 m/s"'
    sample_opposite: ClassVar[str] = "stopper"

    kind: Literal["ball"]
    diameter: Length = Field(description="diameter")
    contact_radius: Length | None = Field(None, description="radius of the facet; absent: diameter/16")
    fixed: Literal["nothing"] = Field("nothing", description="it flies freely")  # type: ignore[assignment]

    @model_validator(mode="after")
    def _whole_facet(self) -> Self:
        if self.arc is not None:
            raise KeyProblem("arc", "a ball touches with its whole facet; remove the key")
        return self

    @property
    def clamped(self) -> bool:
        return False

    def geometry(self) -> Sphere:
        return Sphere(self.diameter, self.contact_radius or self.diameter / 16)

    def views(self, at: float | None = None, *, coarse: bool = False) -> BodyViews:
        radius = self.diameter / 2
        diameter = Size("plan", 1, -radius, radius, radius, f"Ø {length_text(self.diameter)}")
        return replace(super().views(at), sizes=(diameter,))

    def pushed_at_points(self, body: Body, points: Array | None) -> Array:
        """Return (M, n) of its translation alone, as a spring through its centre does: not its facet, which yields."""
        modal, pushed = body.greens.modal, super().pushed_at_points(body, points)
        assert modal is not None
        return np.where(modal.omega[:, None] == 0, pushed, 0.0)

    def struck_part(self) -> tuple[float, float, float]:
        return self.struck_area, self.geometry().contact_radius, self.diameter
