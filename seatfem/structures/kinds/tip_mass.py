"""The flat reed that carries a mass at its tip."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from impact.beams.tip_mass import TipMassCantilever
from seatfem.fields import Mass, of_same_names
from seatfem.structures.kinds.beam import UniformBeam


class TipMass(UniformBeam):
    """A flat reed, clamped at its root, with a point mass at its tip: an Euler-Bernoulli beam."""

    sample: ClassVar[str] = """
length = "25 mm"
width = "10 mm"
thickness = "0.3 mm"
tip_mass = "0.1 g"
material = "steel"
damping_ratio = 0.02
"""
    sample_motion: ClassVar[str] = 'release = { tip_deflection = "1 mm" }'

    kind: Literal["tip_mass"]
    tip_mass: Mass = Field(description="mass at the tip")

    def beam(self) -> TipMassCantilever:
        return of_same_names(TipMassCantilever, self, self.material)
