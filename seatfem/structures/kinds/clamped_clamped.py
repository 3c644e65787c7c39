"""The leaf that is clamped at both ends and strikes with its middle."""

from __future__ import annotations

from typing import Literal

from impact.beams.clamped import ClampedClamped as ClampedClampedBeam
from seatfem.fields import of_same_names
from seatfem.structures.kinds.beam import UniformBeam


class ClampedClamped(UniformBeam):
    """A flat leaf, clamped at both ends: an Euler-Bernoulli beam; where nothing is said it strikes with its middle."""

    kind: Literal["clamped_clamped"]

    def beam(self) -> ClampedClampedBeam:
        return of_same_names(ClampedClampedBeam, self, self.material)
