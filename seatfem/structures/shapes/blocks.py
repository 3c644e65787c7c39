"""Geometries of prismatic solids: the bar, the block and the valve plate with several ports."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes import profile, shape
from seatfem.structures.shapes.selectors import DOWN, UP, Patches, PlaneFace, PointFace, Selector


@dataclass(frozen=True)
class Bar(shape.Shape):
    """Rectangular bar along z, centred on the z axis (metres): ``width`` along x, ``height`` along y.

    Groups: "fixed" is z = 0, "contact" is z = length, "sides_x" and "sides_y" are the side faces with normals
    along x and y (fix u_x on the first and u_y on the second for sliding sides).
    """

    family: ClassVar[str] = "bar"

    length: float = shape.key("length along the impact")
    width: float = shape.key("side of the cross-section")
    height: float = shape.key("other side of the cross-section")

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
    def cuboid(self) -> shape.Cuboid:
        return shape.Cuboid((self.width / 2, self.height / 2), self.length)

    def build(self, occ: Any) -> None:
        """Add the box (millimetres) to the given gmsh OpenCASCADE model."""
        length, width, height = 1e3 * self.length, 1e3 * self.width, 1e3 * self.height
        occ.addBox(-width / 2, -height / 2, 0.0, width, height, length)


@dataclass(frozen=True)
class Block(shape.Shape):
    """Block centred on the z axis, underside at z = 0 (metres): ``width`` along x, ``depth`` along y.

    The group "contact" is the patch ``patch_width`` x ``patch_depth`` centred on the top, "fixed" the underside.
    """

    family: ClassVar[str] = "block"

    width: float = shape.key("side of the block")
    depth: float = shape.key("other side of the block")
    thickness: float = shape.key("height of the block")
    patch_width: float = shape.key("side of the contact face, along width")
    patch_depth: float = shape.key("other side of the contact face, along depth")

    def __post_init__(self) -> None:
        super().__post_init__()
        shape.require_below(self, "patch_width", self.width, "the width", inclusive=True)
        shape.require_below(self, "patch_depth", self.depth, "the depth", inclusive=True)

    @property
    def patches(self) -> Patches:
        corner = math.hypot(self.patch_width, self.patch_depth) / 2
        patch = PlaneFace((0.0, 0.0, 1.0), self.thickness, radius_max=corner)
        return {"contact": (patch,), "fixed": (PlaneFace((0.0, 0.0, -1.0), 0.0),)}

    @property
    def cuboid(self) -> shape.Cuboid:
        patch = self.patch_width / 2, self.patch_depth / 2
        return shape.Cuboid((self.width / 2, self.depth / 2), self.thickness, patch)

    def build(self, occ: Any) -> None:
        """Add the box (millimetres) with the patch imprinted on its top to the given gmsh OpenCASCADE model."""
        width, depth, top = 1e3 * self.width, 1e3 * self.depth, 1e3 * self.thickness
        patch_width, patch_depth = 1e3 * self.patch_width, 1e3 * self.patch_depth
        box = occ.addBox(-width / 2, -depth / 2, 0.0, width, depth, top)
        patch = occ.addRectangle(-patch_width / 2, -patch_depth / 2, top, patch_width, patch_depth)
        occ.fragment([(3, box)], [(2, patch)])


@dataclass(frozen=True)
class ValvePlate(shape.Shape):
    """Plate with its underside at z = 0 and its centre on the z axis (metres).

    ``ports`` holes: on a circle in a round plate (``layout`` "circle", the first on the x axis) or along x in a
    rectangular one ("row"); the webs are pitch - 2 port_radius wide, the lands flush with the plate's top.
    The group "contact" is all lands, "land_1", "land_2", ... each of them, "fixed" the underside's rim.
    """

    family: ClassVar[str] = "valve_plate"

    ports: int = 6
    port_radius: float = shape.key("radius of each port", 3e-3)
    pitch: float = shape.key("distance of neighbouring ports, centre to centre", 10e-3)
    margin: float = shape.key("from the outer ports to the plate's edge", 5e-3)
    thickness: float = shape.key("thickness of the plate", 6e-3)
    land_width: float = shape.key("width of the land around each port", 1e-3)
    clamp_width: float = shape.key("width of the clamped rim of the underside", 2e-3)
    layout: Literal["circle", "row"] = "circle"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.ports < 1:
            raise GeometryError(f"ValvePlate.ports = {self.ports}: must be >= 1")
        if self.layout not in ("circle", "row"):
            raise GeometryError(f"ValvePlate.layout = {self.layout!r}: must be 'circle' or 'row'")
        apart = 2 * (self.port_radius + self.land_width)
        if self.ports > 1:
            shape.require_above(self, "pitch", apart, "two ports with lands")
        shape.require_below(self, "land_width", self.margin, "the margin")
        shape.require_below(self, "clamp_width", self.margin, "the margin")

    @property
    def centres(self) -> tuple[tuple[float, float], ...]:
        """Return (x, y) of the ports, in their order."""
        if self.layout == "row":
            return tuple(((k - (self.ports - 1) / 2) * self.pitch, 0.0) for k in range(self.ports))
        angles = [2 * math.pi * k / self.ports for k in range(self.ports)]
        return tuple((self.circle_radius * math.cos(a), self.circle_radius * math.sin(a)) for a in angles)

    @property
    def circle_radius(self) -> float:
        """Return the radius of the circle on which the centres of the ports lie."""
        return 0.0 if self.ports == 1 else self.pitch / (2 * math.sin(math.pi / self.ports))

    @property
    def outer_radius(self) -> float:
        """Return the outer radius of the round plate."""
        return self.circle_radius + self.port_radius + self.margin

    @property
    def half_sides(self) -> tuple[float, float]:
        """Return half the sides of the rectangular plate, along x and y."""
        half = self.port_radius + self.margin
        return (self.ports - 1) / 2 * self.pitch + half, half

    def lands_in(self, sectors: int) -> dict[str, tuple[float, float]]:
        """Return name -> centre of the lands that are at least partly in the first of that many sectors."""
        half = math.pi / sectors
        reach = self.port_radius + self.land_width
        names = {}
        for number, (x, y) in enumerate(self.centres, 1):
            beyond = abs(math.remainder(math.atan2(y, x) - half, 2 * math.pi)) - half
            away = math.hypot(x, y) * (math.sin(beyond) if beyond < math.pi / 2 else 1.0)
            if sectors == 1 or away < reach * (1 - 1e-9):
                names[f"land_{number}"] = (x, y)
        return names

    def patches_in(self, sectors: int) -> Patches:
        """Return the groups in the first of that many sectors."""
        reach, top = self.port_radius + self.land_width, self.thickness
        lands: Patches = {
            name: (PlaneFace(UP, top, radius_max=reach, axis_point=(x, y, 0.0)),)
            for name, (x, y) in self.lands_in(sectors).items()
        }
        rim: Selector = PlaneFace(DOWN, 0.0, radius_min=self.outer_radius - self.clamp_width)
        if self.layout == "row":
            rim = PointFace((self.half_sides[0] - self.clamp_width / 2, self.clamp_width / 4, 0.0))
        return {"contact": tuple(land for (land,) in lands.values()), "fixed": (rim,), **lands}

    @property
    def patches(self) -> Patches:
        return self.patches_in(1)

    def check_sectors(self, sectors: int) -> None:
        row = self.layout == "row"
        if not (sectors in (2, 4) if row else self.ports == 1 or (2 * self.ports) % sectors == 0):
            layout = "ports in a row" if row else f"{self.ports} ports on a circle"
            fitting = "2 or 4" if row else "the divisors of twice that number"
            raise GeometryError(f"sector = {sectors}: a ValvePlate with {layout} has other sectors; choose {fitting}")

    def build(self, occ: Any) -> None:
        """Extrude the outline (millimetres) and imprint the lands and the rim, in the given gmsh OpenCASCADE model."""
        solid = occ.extrude(self._base(occ), 0, 0, 1e3 * self.thickness)
        lands = [self._land(occ, centre, 1e3 * self.thickness) for centre in self.centres]
        occ.fragment([entity for entity in solid if entity[0] == 3], [*lands, self._rim(occ)])

    def _outline(self, occ: Any, inset: float) -> tuple[int, int]:
        if self.layout == "circle":
            radius = 1e3 * (self.outer_radius - inset)
            return 2, int(occ.addDisk(0, 0, 0.0, radius, radius))
        x, y = (1e3 * (side - inset) for side in self.half_sides)
        return 2, int(occ.addRectangle(-x, -y, 0.0, 2 * x, 2 * y))

    def _base(self, occ: Any) -> list[tuple[int, int]]:
        radius = 1e3 * self.port_radius
        holes = [(2, occ.addDisk(1e3 * x, 1e3 * y, 0.0, radius, radius)) for x, y in self.centres]
        return [occ.cut([self._outline(occ, 0.0)], holes)[0][0]]

    def _land(self, occ: Any, centre: profile.Point, z: float) -> tuple[int, int]:
        x, y = 1e3 * centre[0], 1e3 * centre[1]
        radii = 1e3 * (self.port_radius + self.land_width), 1e3 * self.port_radius
        outer, inner = ((2, occ.addDisk(x, y, z, radius, radius)) for radius in radii)
        ring: tuple[int, int] = occ.cut([outer], [inner])[0][0]
        return ring

    def _rim(self, occ: Any) -> tuple[int, int]:
        inner = self._outline(occ, self.clamp_width)
        rim: tuple[int, int] = occ.cut([self._outline(occ, 0.0)], [inner])[0][0]
        return rim

    @property
    def volume(self) -> float:
        x, y = self.half_sides
        plan = 4 * x * y if self.layout == "row" else math.pi * self.outer_radius**2
        return self.thickness * (plan - self.ports * math.pi * self.port_radius**2)
