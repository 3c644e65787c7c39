"""Kinds of prismatic solids: bars, blocks, and the valve plate with several ports."""

from __future__ import annotations

import math
from functools import partial
from typing import ClassVar, Final, Literal, Self

import numpy as np
from pydantic import Field, model_validator

import impact
from impact.exact.half_space import rectangle_compliance
from impact.greens import base, modal
from seatfem.fields import KeyProblem, build_from_fields
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.kinds.structure import LocalShare
from seatfem.structures.method import NAMES, QUARTERS, AnyLevel, Applicability, Solved, Task
from seatfem.structures.outlines import BodyViews, arc, box, draw_ported_plate
from seatfem.structures.patch import Patch, add_plate_bending, column_end
from seatfem.structures.shapes import Bar, Block, Geometry, ValvePlate

MODES: Final = 200  # modes of Love's rod; the last has a wavelength of a hundredth of the length


class BarSeat(Drawn):
    """A straight bar, clamped at one end and struck on the other: the rod in three dimensions."""

    shape: ClassVar[type[Geometry]] = Bar
    sample: ClassVar[str] = """
length = "30 mm"
width = "5 mm"
height = "5 mm"
"""

    kind: Literal["bar"]
    fixed: Literal["end"] = Field("end", description="the clamped face")

    @model_validator(mode="after")
    def _motion_without_modes(self) -> Self:
        if self.model == "rod" and (self.deflection is not None or self.force is not None):
            raise KeyProblem("model", "a rod in closed form has no modes to be set in motion; use model = 'sector'")
        return self

    def geometry(self) -> Bar:
        return build_from_fields(Bar, self)

    def struck_part(self) -> tuple[float, float, float]:
        bar = self.geometry()
        return bar.width * bar.height, min(bar.width, bar.height), bar.length

    def patch(self) -> Patch:
        area, width, length = self.struck_part()
        return column_end(self.material.mean, area, width, length)

    @property
    def local_share(self) -> LocalShare:
        return LocalShare()  # its end is struck as a whole and remains plane

    @property
    def sectors(self) -> int:
        return QUARTERS

    def _rod(self, band: float) -> Applicability:
        if not self.isotropic or self.supports or self.rayleigh is not None:
            return Applicability.refused(
                "rod", "the closed form knows an isotropic rod with one clamped end and modal damping"
            )
        delay, end = self.love_error(band), self.form_error
        reason = f"lateral inertia delays waves at the band edge by {delay:.1g}, the clamped end changes g by {end:.1g}"
        return Applicability("rod", True, delay + end, f"{reason}: a rod leaves both out")

    @property
    def polar(self) -> float:
        """Return the polar radius of gyration squared (width^2 + height^2)/12 [m^2]."""
        return (self.geometry().width ** 2 + self.geometry().height ** 2) / 12

    def love_error(self, band: float) -> float:
        """Return the relative delay nu^2 k^2 r^2/2 by lateral inertia of waves at the band edge [Hz], which a rod
        neglects.

        r is the polar radius of gyration, k = w/c_0. Source: Love, A Treatise on the Mathematical Theory of
        Elasticity, article 278.
        """
        solid = self.material.mean
        k = 2 * math.pi * band / math.sqrt(solid.young / solid.density)
        return solid.poisson**2 * k**2 * self.polar / 2

    @property
    def form_error(self) -> float:
        """Return the relative error of g since the clamped end cannot contract laterally, which shortens the rod.

        The static compliance falls by (0.33 to 0.5) nu^2 sqrt(width height)/length over nu = 0.15 to 0.45 and sides of
        1:1 to 1:8 (examples/bar_as_rod.py); g after a few reflections is off by about twice that, so 1.0 is taken.
        """
        area, _, length = self.struck_part()
        return self.material.mean.poisson**2 * math.sqrt(area) / length

    def closed_form(self) -> base.GreensFunction:
        """Return the elementary rod of the same cross-section, clamped at its far end."""
        solid, (area, _, length) = self.material.mean, self.struck_part()
        return impact.fixed_rod(
            young=solid.young, density=solid.density, area=area, length=length, damping_ratio=self.damping_ratio
        )

    def beyond(self, level: AnyLevel) -> base.GreensFunction | None:
        """Return the rod with lateral inertia (Love): mode n is slower by sqrt(s) and heavier by s.

        s = 1 + nu^2 k_n^2 r^2, k_n = (2n - 1) pi/(2 l), r^2 the polar radius of gyration squared; the static compliance
        is the elementary rod's. Source: Love, A Treatise on the Mathematical Theory of Elasticity, article 278.
        """
        if level != "rod":
            return None
        solid, (area, _, length) = self.material.mean, self.struck_part()
        k = (np.arange(MODES) + 0.5) * math.pi / length
        s = 1 + solid.poisson**2 * k**2 * self.polar
        omega = math.sqrt(solid.young / solid.density) * k / np.sqrt(s)
        shapes = np.sqrt(2 / (solid.density * area * length * s))
        left_out = max(length / (solid.young * area) - float(np.sum(shapes**2 / omega**2)), 0.0)
        zeta = np.full(MODES, self.damping_ratio)
        return modal.ModalGreens(omega, zeta, shapes[:, None], modal.Residual.spring(left_out))

    def solve(self, task: Task) -> Solved:
        if task.method.level != "rod":
            return super().solve(task)
        reason = self._rod(task.method.bandwidth or self.greens.bandwidth).reason
        about = {"seat_level": "rod", "seat_level_reason": reason, "seat_model": NAMES["rod"]}
        return Solved(self.closed_form(), about=about, level_error=self.form_error, plane=True)


class BlockSeat(Drawn):
    """A block with a rectangular contact patch in the middle of its top."""

    shape: ClassVar[type[Geometry]] = Block
    sample: ClassVar[str] = """
width = "20 mm"
depth = "20 mm"
thickness = "10 mm"
patch_width = "8 mm"
patch_depth = "1 mm"
"""

    kind: Literal["block"]
    fixed: Literal["underside"] = Field("underside", description="the clamped face")

    def geometry(self) -> Block:
        return build_from_fields(Block, self)

    def struck_part(self) -> tuple[float, float, float]:
        block = self.geometry()
        sides = (block.patch_width, block.patch_depth)
        return sides[0] * sides[1], min(sides), block.thickness

    @property
    def local_share(self) -> LocalShare:
        block = self.geometry()
        room = min(block.width / block.patch_width, block.depth / block.patch_depth) - 1
        compliance = partial(rectangle_compliance, sides=(block.patch_width, block.patch_depth))
        return self.find_half_space_share(compliance, room, ("patch_width", "patch_depth"))

    @property
    def sectors(self) -> int:
        return QUARTERS


class Plate(Drawn):
    """A flat valve plate with several round ports, a sealing land around each, and webs between them. With `outline` or
    `file` in place of its ports, kind = "plate" is a flat reed of any outline: all that kind = "sheet" takes."""

    has_faces: ClassVar[bool] = True

    shape: ClassVar[type[Geometry]] = ValvePlate
    sample: ClassVar[str] = """
ports = 4
port_radius = "3 mm"
pitch = "10 mm"
margin = "5 mm"
thickness = "3 mm"
land_width = "1 mm"
clamp_width = "2 mm"
"""

    kind: Literal["plate"]
    ports: int = Field(strict=True, ge=1, le=200, description="number of ports")
    layout: Literal["circle", "row"] = Field("circle", description="of the ports")
    struck: int | None = Field(None, strict=True, ge=1, description="port whose land is struck; all lands if absent")
    fixed: Literal["rim"] = Field("rim", description="the clamped face: the rim of the underside")

    @model_validator(mode="after")
    def _struck_is_a_port(self) -> Self:
        if self.struck is not None and self.struck > self.ports:
            raise KeyProblem("struck", f"there is no port {self.struck}, the plate has {self.ports}")
        return self

    @property
    def struck_face(self) -> str:
        """Return the name of the lands of all ports, or of one port."""
        return "contact" if self.struck is None else f"land_{self.struck}"

    @property
    def sectors(self) -> int:
        if self.struck is not None:
            return 1
        return QUARTERS if self.layout == "row" else 2 * self.ports

    def geometry(self) -> ValvePlate:
        return build_from_fields(ValvePlate, self)

    def views(self, *, coarse: bool = False) -> BodyViews:
        plate = self.geometry()
        if self.layout == "circle":
            outline, rim = arc(plate.outer_radius), arc(plate.outer_radius - plate.clamp_width)
        else:
            (x, y), inset = plate.half_sides, plate.clamp_width
            outline, rim = box((-x, -y), (x, y)), box((inset - x, inset - y), (x - inset, y - inset))
        struck = range(self.ports) if self.struck is None else (self.struck - 1,)
        radii = (plate.port_radius, plate.port_radius + plate.land_width)
        return draw_ported_plate(outline, rim, np.array(plate.centres), radii, struck, plate.thickness)

    def struck_part(self) -> tuple[float, float, float]:
        plate = self.geometry()
        reach = plate.port_radius + plate.land_width
        lands = self.ports if self.struck is None else 1
        return lands * math.pi * (reach**2 - plate.port_radius**2), plate.land_width, plate.thickness

    def patch(self) -> Patch:
        """Return a bulky body on a clamped round plate of the same size, its stiffness reduced by the ports."""
        local, geometry = super().patch(), self.geometry()
        round_plate = self.layout == "circle"
        radius = (geometry.outer_radius if round_plate else min(geometry.half_sides)) - geometry.clamp_width
        solidity = max(1 - self.ports * geometry.port_radius**2 / geometry.outer_radius**2, 0.2) if round_plate else 0.5
        return add_plate_bending(local, self.material.mean, radius, solidity)
