"""The straight bar: the rod in three dimensions, in one, and with the lateral inertia that one leaves out."""

from __future__ import annotations

import math
from typing import ClassVar, Final, Literal

import numpy as np
from pydantic import Field

import impact
from impact.greens.base import GreensFunction
from impact.greens.modal import ModalGreens, Residual
from impact.progress import Progress
from seatfem.fields import KeyProblem, Length, of_same_names
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.estimates.patch import Patch, column_end
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.method import NAMES, QUARTERS, AnyLevel, Applicability, Method
from seatfem.structures.shapes import Bar
from seatfem.structures.solved import Solved

MODES: Final = 200  # of Love's rod; the last has a wavelength of a hundredth of the length


class BarSeat(Drawn):
    """A straight bar, clamped at one end and struck on the other: the rod in three dimensions."""

    sample: ClassVar[str] = """
length = "30 mm"
width = "5 mm"
height = "5 mm"
material = "steel"
damping_ratio = 0.02
"""

    kind: Literal["bar"]
    length: Length = Field(description="length along the impact")
    width: Length = Field(description="side of the cross-section")
    height: Length = Field(description="other side of the cross-section")
    fixed: Literal["end"] = Field("end", description="the clamped face")

    def check_motion(self) -> None:
        if self.model == "rod" and self.velocity is None:
            raise KeyProblem("model", "a rod in closed form has no modes to be set in motion; use model = 'sector'")

    def geometry(self) -> Bar:
        return of_same_names(Bar, self)

    def struck_part(self) -> tuple[float, float, float]:
        return self.width * self.height, min(self.width, self.height), self.length

    def patch(self) -> Patch | None:
        area, width, length = self.struck_part()
        return column_end(self.material.mean, area, width, length)

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
        return (self.width**2 + self.height**2) / 12

    def love_error(self, band: float) -> float:
        """Return the relative delay of waves at the band edge [Hz] that a rod without lateral inertia leaves out, nu^2
        k^2 r^2/2.

        r^2 is the polar radius of gyration squared, k = w/c_0. Source: Love, A Treatise on the Mathematical Theory of
        Elasticity, article 278.
        """
        solid = self.material.mean
        k = 2 * math.pi * band / math.sqrt(solid.young / solid.density)
        return solid.poisson**2 * k**2 * self.polar / 2

    @property
    def form_error(self) -> float:
        """Return the relative error of g by the clamped end, which cannot contract sideways: it shortens the rod.

        The static compliance falls by (0.33 to 0.5) nu^2 sqrt(width height)/length over nu = 0.15 to 0.45 and sides of
        1:1 to 1:8 (examples/bar_as_rod.py); g after a few reflections is off by about twice that, so 1.0 is taken.
        """
        return self.material.mean.poisson**2 * math.sqrt(self.width * self.height) / self.length

    def closed_form(self) -> GreensFunction | None:
        """Return the elementary rod of its cross-section, clamped at its far end, where it is one."""
        if not self._rod(self.greens.bandwidth).applies:
            return None
        solid = self.material.mean
        return impact.fixed_rod(
            young=solid.young,
            density=solid.density,
            area=self.width * self.height,
            length=self.length,
            damping_ratio=self.damping_ratio,
        )

    def beyond(self, level: AnyLevel) -> GreensFunction | None:
        return self.love_rod() if level == "rod" else None

    def love_rod(self) -> ModalGreens:
        """Return the rod with lateral inertia (Love): mode n is slower by sqrt(s) and heavier by s, s = 1 + nu^2 k_n^2
        r^2.

        k_n = (2n - 1) pi/(2 l), r^2 the polar radius of gyration squared; the static compliance is the elementary
        rod's. Source: Love, A Treatise on the Mathematical Theory of Elasticity, article 278.
        """
        solid = self.material.mean
        area = self.width * self.height
        k = (np.arange(MODES) + 0.5) * math.pi / self.length
        s = 1 + solid.poisson**2 * k**2 * self.polar
        omega = math.sqrt(solid.young / solid.density) * k / np.sqrt(s)
        shapes = np.sqrt(2 / (solid.density * area * self.length * s))
        left_out = max(self.length / (solid.young * area) - float(np.sum(shapes**2 / omega**2)), 0.0)
        zeta = np.full(MODES, self.damping_ratio)
        return ModalGreens(omega, zeta, shapes[:, None], Residual.spring(left_out))

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: Progress, *, mesh_error: bool = True
    ) -> Solved:
        if method.level != "rod" or (greens := self.closed_form()) is None:
            return super().solve(method, duration, watch, progress, mesh_error=mesh_error)
        about = {"seat_level": "rod", "seat_level_reason": self.levels(method.bandwidth)[0].reason}
        about["seat_model"] = NAMES["rod"]
        return Solved(greens, about=about, level_error=self.form_error, plane=True)
