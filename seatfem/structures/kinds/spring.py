"""The massless spring."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

import impact
from impact.greens.base import GreensFunction
from seatfem.fields import Stiffness
from seatfem.structures.kinds.structure import Structure, Traits
from seatfem.structures.outlines import BodyViews


class Spring(Structure):
    """A massless spring: the model of the seat that has no waves."""

    traits: ClassVar[Traits] = Traits(plane=True)

    sample: ClassVar[str] = """
stiffness = "50 N/um"
"""

    kind: Literal["spring"]
    stiffness: Stiffness = Field(description="force per displacement of the contact")

    @property
    def _model_words(self) -> str:
        return "spring"

    def views(self, at: float | None = None, *, coarse: bool = False) -> BodyViews:
        return BodyViews(f"spring {1e-6 * self.stiffness:.4g} N/um", symbol="spring")

    def closed_form(self) -> GreensFunction | None:
        return impact.spring(stiffness=self.stiffness)
