"""The straight bar along z: the 1-D rod in three dimensions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from seatfem.structures.shapes.selectors import Patches, PlaneFace
from seatfem.structures.shapes.shape import EVERYWHERE, Plan, Rectangle, Shape, check_quarters, key, require_positive


@dataclass(frozen=True)
class Bar(Shape):
    """Rectangular bar along z, centred on the z axis (metres): ``width`` along x, ``height`` along y.

    Groups: "fixed" is z = 0, "contact" is z = length, "sides_x" and "sides_y" are the side faces with normals
    along x and y (fix u_x on the first and u_y on the second for sliding sides).
    """

    family: ClassVar[str] = "bar"

    length: float = key("length along the impact")
    width: float = key("side of the cross-section")
    height: float = key("other side of the cross-section")

    def __post_init__(self) -> None:
        require_positive(self, "length", "width", "height")

    @property
    def patches(self) -> Patches:
        return self.patches_in(1)

    def patches_in(self, sectors: int) -> Patches:
        """Return the groups of the whole bar (1), of its half y > 0 (2), or of its quarter x, y > 0 (4)."""
        x, y = self.width / 2, self.height / 2
        left_side, front_side = PlaneFace((-1.0, 0.0, 0.0), x), PlaneFace((0.0, -1.0, 0.0), y)
        return {
            "contact": (PlaneFace((0.0, 0.0, 1.0), self.length),),
            "fixed": (PlaneFace((0.0, 0.0, -1.0), 0.0),),
            "sides_x": (PlaneFace((1.0, 0.0, 0.0), x), *([left_side] if sectors < 4 else [])),
            "sides_y": (PlaneFace((0.0, 1.0, 0.0), y), *([front_side] if sectors < 2 else [])),
        }

    @property
    def plan(self) -> Plan:
        return Plan(self.length, {"contact": (EVERYWHERE,)}, {"fixed": (EVERYWHERE,)})

    @property
    def rectangle(self) -> Rectangle:
        return Rectangle((self.width / 2, self.height / 2))

    def check_sectors(self, sectors: int) -> None:
        check_quarters(self, sectors)

    def build(self, occ: Any) -> None:
        """Add the box (millimetres) to the given gmsh OpenCASCADE model."""
        length, width, height = 1e3 * self.length, 1e3 * self.width, 1e3 * self.height
        occ.addBox(-width / 2, -height / 2, 0.0, width, height, length)
