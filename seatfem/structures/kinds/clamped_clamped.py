"""The leaf that is clamped at both ends and strikes with its middle."""

from __future__ import annotations

from typing import ClassVar, Literal

from impact.beams.clamped import ClampedClamped as ClampedClampedBeam
from seatfem.fields import of_same_names
from seatfem.structures.kinds.beam import UniformBeam


class ClampedClamped(UniformBeam):
    """A flat leaf, clamped at both ends: an Euler-Bernoulli beam; where nothing is said it strikes with its middle."""

    sample: ClassVar[str] = """
length = "40 mm"
width = "10 mm"
thickness = "0.3 mm"
material = "steel"
damping_ratio = 0.02
"""
    sample_motion: ClassVar[str] = 'release = { mode = 1, velocity = "-2 m/s" }'

    both_held: ClassVar[bool] = True

    kind: Literal["clamped_clamped"]

    def beam(self) -> ClampedClampedBeam:
        return of_same_names(ClampedClampedBeam, self, self.material)
