"""The stubby reed, which yields to shear."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from impact.beams.timoshenko import TimoshenkoCantilever
from seatfem.fields import of_same_names
from seatfem.structures.kinds.beam import UniformBeam


class Timoshenko(UniformBeam):
    """A reed, clamped at its root, that may be thick: a Timoshenko beam, with shear and rotary inertia."""

    kind: Literal["timoshenko"]
    shear_factor: float = Field(5 / 6, gt=0, le=1, description="shear area over area; 5/6 for a rectangle")

    def beam(self) -> TimoshenkoCantilever:
        return of_same_names(TimoshenkoCantilever, self, self.material)

    def too_thick(self) -> str:
        return ""

    def shear_error(self, at: float | None) -> float:
        return 0.0
