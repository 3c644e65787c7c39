"""The stubby reed, which yields to shear."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from impact.beams.timoshenko import TimoshenkoCantilever
from seatfem.fields import of_same_names
from seatfem.structures.kinds.beam import UniformBeam


class Timoshenko(UniformBeam):
    """A reed, clamped at its root, that may be thick: a Timoshenko beam, with shear and rotary inertia."""

    sample: ClassVar[str] = """
length = "25 mm"
width = "10 mm"
thickness = "1 mm"
material = "steel"
damping_ratio = 0.02
"""
    sample_motion: ClassVar[str] = 'release = { tip_deflection = "0.2 mm" }'

    kind: Literal["timoshenko"]
    shear_factor: float = Field(5 / 6, gt=0, le=1, description="shear area over area; 5/6 for a rectangle")

    def beam(self) -> TimoshenkoCantilever:
        return of_same_names(TimoshenkoCantilever, self, self.material)

    def too_thick(self) -> str:
        return ""

    def shear_error(self, at: float | None) -> float:
        return 0.0
