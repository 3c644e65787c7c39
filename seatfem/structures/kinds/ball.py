"""The ball: an elastic sphere in free flight, by finite elements."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from impact.bodies.body import Body
from impact.greens.base import Array
from seatfem.fields import KeyProblem, Length
from seatfem.structures.kinds.drawn import Turned
from seatfem.structures.kinds.striking import At
from seatfem.structures.kinds.structure import SampleScene, Traits
from seatfem.structures.outlines import BodyViews, Size, length_text
from seatfem.structures.shapes import Ball as Sphere

if TYPE_CHECKING:
    from impact.after.stresses import ReedStress
    from impact.exact.contact_stress import ShearMaximum


class Ball(Turned):
    """An elastic sphere in free flight. It touches with a small flat facet at its pole, a disc whose radius stays: it
    translates as a rigid body exactly, and its waves and own compliance are in its Green's function. Hertz's contact of
    a ball on a flat face, whose disc grows with the force, is kind = "rigid_mass" with law = { kind = "hertz", ... }:
    that has the compliance of both bodies, and no waves in the ball."""

    traits: ClassVar[Traits] = replace(Turned.traits, has_stress=True)
    group: ClassVar[str] = "strikers"
    sample: ClassVar[str] = """
diameter = "10 mm"
material = "steel"
damping_ratio = 0.005
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('velocity = "-0.5 m/s"', "stopper")

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

    def pushed_by_springs(self, body: Body, points: Array | None) -> Array:
        """Return (M, n) of its translation alone, as a spring through its centre does: not its facet, which yields."""
        modal, pushed = body.greens.modal, super().pushed_by_springs(body, points)
        assert modal is not None
        return np.where(modal.omega[:, None] == 0, pushed, 0.0)

    def stress(
        self, force: Array, dt: float, body: Body, at: At, *, coarsely: bool, since: float | None = None
    ) -> ReedStress | None:
        """Return the largest von Mises stress on the axis below the facet, and its depth in place of its place.

        The facet's pressure is uniform, as its port in the Green's function has it: p = N/(pi a^2). The stress below it
        is that in a half-space, at rest under the force of each moment: sigma = 2 tau_max of `disk_shear_maximum`.

        Source: Timoshenko and Goodier, load over part of the boundary of a semi-infinite solid.
        """
        from impact.after.spans import Spans
        from impact.after.stresses import NO_STRESS, PeakStress, stress_by_spans

        spans, facet = Spans.of_run(force, dt, since), self.geometry().contact_radius
        most, pressed = self._most_stressed, np.abs(force)
        number = spans.of_times(np.arange(len(force)))

        def largest(chosen: slice) -> PeakStress:
            in_spans = np.isin(number, np.arange(spans.count)[chosen])
            if not pressed[in_spans].any():
                return NO_STRESS
            step = int(np.argmax(np.where(in_spans, pressed, 0.0)))
            value = 2 * most.stress * pressed[step] / (math.pi * facet**2)
            return PeakStress(float(value), most.depth * facet, dt * step)

        return stress_by_spans(spans, largest)

    def stress_histories(
        self, force: Array, dt: float, body: Body, at: At, also: Collection[float] = (), *, few: bool = False
    ) -> Iterator[tuple[str, Array]]:
        """Yield the tensors at the depth below the facet where the von Mises stress is largest, as of `stress`."""
        from impact.exact.contact_stress import disk_axis_stress

        facet, depth = self.geometry().contact_radius, self._most_stressed.depth
        across, along = disk_axis_stress(np.array([depth]), poisson=self.material.mean.poisson)
        tensors = np.zeros((len(force), 6))
        tensors[:, :2], tensors[:, 2] = across[0], along[0]
        yield f"{length_text(depth * facet)} below the facet", tensors * np.abs(force)[:, None] / (math.pi * facet**2)

    @property
    def _most_stressed(self) -> ShearMaximum:
        from impact.exact.contact_stress import disk_shear_maximum

        return disk_shear_maximum(poisson=self.material.mean.poisson)

    def struck_part(self) -> tuple[float, float, float]:
        return self.struck_area, self.geometry().contact_radius, self.diameter
