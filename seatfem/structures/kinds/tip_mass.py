"""The flat reed that carries a mass at its tip."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from impact.beams.tip_mass import TipMassCantilever
from seatfem.fields import Mass, of_same_names
from seatfem.structures.kinds.beam import UniformBeam


class TipMass(UniformBeam):
    """A flat reed, clamped at its root, with a point mass at its tip: an Euler-Bernoulli beam."""

    kind: Literal["tip_mass"]
    tip_mass: Mass = Field(description="mass at the tip")

    def beam(self) -> TipMassCantilever:
        return of_same_names(TipMassCantilever, self, self.material)
