"""Structures whose Green's function is a reduction of mass, damping and stiffness matrices."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from pydantic import Field

from seatfem.fields import DampingRatio, default
from seatfem.structures.kinds.motion import Moving
from seatfem.structures.kinds.parts import GreensSettings
from seatfem.structures.kinds.structure import Traits
from seatfem.structures.method import AUTO, Applicability, Method
from seatfem.structures.method import memory as forgotten_after


class Reduced(Moving):
    """Base of all bodies that are known by their matrices."""

    traits: ClassVar[Traits] = replace(Moving.traits, is_reduced=True)

    damping_ratio: DampingRatio = Field(0.0, description="modal damping, the same for every mode")
    greens: GreensSettings = default({}, "how the Green's function is computed")

    @property
    def loss(self) -> float:
        return self.damping_ratio

    def levels(self, band: float | None = None) -> tuple[Applicability, ...]:
        return (Applicability("3d", True, 0.0, "as the file has it"),)

    def stated(self, error: float = 0.0, rings: int | None = 1) -> Method:
        settings = self.greens
        return replace(
            super().stated(error, rings),
            bandwidth=settings.bandwidth,
            tolerance=settings.tolerance,
            reduction=settings.method,
            max_vectors=settings.max_vectors,
            backend=settings.backend,
        )

    @property
    def couples(self) -> bool:
        """Return whether damping couples its modes."""
        return False

    @property
    def is_convolved(self) -> bool:
        if self.greens.method == AUTO:
            return self.couples
        from seatfem.structures.reduction.greens import named  # for load time: most scenes name none

        return not named(self.greens.method).oscillators

    def memory(self, method: Method, duration: float) -> float:
        """Return the run, or the time in which uniform damping forgets the band's tail [s]."""
        assert method.bandwidth is not None
        return min(duration, forgotten_after(self.damping_ratio, method.bandwidth))
