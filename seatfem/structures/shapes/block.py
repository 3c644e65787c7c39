"""The rectangular block with a rectangular contact patch in the middle of its top."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from seatfem.structures.shapes.selectors import Patches, PlaneFace
from seatfem.structures.shapes.shape import (
    EVERYWHERE,
    Plan,
    Rectangle,
    Shape,
    check_quarters,
    key,
    require_below,
    require_positive,
)


@dataclass(frozen=True)
class Block(Shape):
    """Block centred on the z axis, underside at z = 0 (metres): ``width`` along x, ``depth`` along y.

    The group "contact" is the patch ``patch_width`` x ``patch_depth`` centred on the top, "fixed" the underside.
    """

    family: ClassVar[str] = "block"

    width: float = key("side of the block")
    depth: float = key("other side of the block")
    thickness: float = key("height of the block")
    patch_width: float = key("side of the contact face, along width")
    patch_depth: float = key("other side of the contact face, along depth")

    def __post_init__(self) -> None:
        require_positive(self, "width", "depth", "thickness", "patch_width", "patch_depth")
        require_below(self, "patch_width", self.width, "the width", inclusive=True)
        require_below(self, "patch_depth", self.depth, "the depth", inclusive=True)

    @property
    def patches(self) -> Patches:
        corner = math.hypot(self.patch_width, self.patch_depth) / 2
        patch = PlaneFace((0.0, 0.0, 1.0), self.thickness, radius_max=corner)
        return {"contact": (patch,), "fixed": (PlaneFace((0.0, 0.0, -1.0), 0.0),)}

    @property
    def plan(self) -> Plan:
        return Plan(self.thickness, {"contact": ("patch",)}, {"fixed": (EVERYWHERE,)})

    @property
    def rectangle(self) -> Rectangle:
        return Rectangle((self.width / 2, self.depth / 2), (self.patch_width / 2, self.patch_depth / 2))

    def check_sectors(self, sectors: int) -> None:
        check_quarters(self, sectors)

    def build(self, occ: Any) -> None:
        """Add the box (millimetres) with the patch imprinted on its top to the given gmsh OpenCASCADE model."""
        width, depth, top = 1e3 * self.width, 1e3 * self.depth, 1e3 * self.thickness
        patch_width, patch_depth = 1e3 * self.patch_width, 1e3 * self.patch_depth
        box = occ.addBox(-width / 2, -depth / 2, 0.0, width, depth, top)
        patch = occ.addRectangle(-patch_width / 2, -patch_depth / 2, top, patch_width, patch_depth)
        occ.fragment([(3, box)], [(2, patch)])
