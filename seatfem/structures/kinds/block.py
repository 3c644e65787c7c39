"""The block with a rectangular patch."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from seatfem.fields import Length, of_same_names
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.method import QUARTERS
from seatfem.structures.shapes import Block


class BlockSeat(Drawn):
    """A block with a rectangular contact patch in the middle of its top."""

    sample: ClassVar[str] = """
width = "20 mm"
depth = "20 mm"
thickness = "10 mm"
patch_width = "8 mm"
patch_depth = "1 mm"
material = "steel"
damping_ratio = 0.02
"""

    kind: Literal["block"]
    width: Length = Field(description="side of the block")
    depth: Length = Field(description="other side of the block")
    thickness: Length = Field(description="height of the block")
    patch_width: Length = Field(description="side of the contact face, along width")
    patch_depth: Length = Field(description="other side of the contact face, along depth")
    fixed: Literal["underside"] = Field("underside", description="the clamped face")

    def geometry(self) -> Block:
        return of_same_names(Block, self)

    def struck_part(self) -> tuple[float, float, float]:
        sides = (self.patch_width, self.patch_depth)
        return sides[0] * sides[1], min(sides), self.thickness

    @property
    def sectors(self) -> int:
        return QUARTERS
