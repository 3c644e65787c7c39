"""What of a body's geometry counts before any mesh: the struck patch, its narrowest width, how stiff the body is."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from impact.exact.half_space import disk_compliance
from seatfem.structures.inspection.shape import Shape
from seatfem.structures.materials import Material

if TYPE_CHECKING:
    from seatfem.structures.kinds.parts import Support

OFF_CENTRE: Final = 1.5  # (R + r)/R of a force half way between a clamped plate's centre and its rim
_BENDING_LOAD: Final = 1 / (16 * math.pi)  # centre of a clamped round plate under a central force: w = F R^2/(16 pi D)
_FUNDAMENTAL: Final = 10.22  # of a clamped round plate: w_1 = 10.22/R^2 sqrt(D/(rho t)). Leissa, Vibration of Plates


@dataclass(frozen=True)
class Patch:
    """The struck patch and the body behind it.

    Attributes:
        area: struck [m^2].
        width: the narrowest extent of the struck faces [m].
        depth: of the body behind the patch [m].
        compliance: static, of the body without bending, estimated [m/N].
        density, c_p, c_s: of the material [kg/m^3, m/s].
        bending: static compliance of the plate that the patch lies on; 0 for a bulky body [m/N].
        bending_frequency: of the plate's first mode [rad/s]; 0 for a bulky body.
        one_dimensional: whether waves go along a line and come back undiminished.
    """

    area: float
    width: float
    depth: float
    compliance: float
    density: float
    c_p: float
    c_s: float
    bending: float = 0.0
    bending_frequency: float = 0.0
    one_dimensional: bool = False

    @property
    def impedance(self) -> float:
        """Return the force per velocity of the patch at the very first instant, rho c_p A [N s/m]."""
        return self.density * self.c_p * self.area

    @property
    def evened(self) -> float:
        """Return the compliance by which a patch that moves as its mean is softer than under a rigid face [m/N].

        Of a strip 2 (3/2 - ln 4) (1 - nu^2)/(pi E) over its length, which is area over width; a disk's is of the same
        size, (16/(3 pi^2) - 1/2) (1 - nu^2)/(E a). The end of a bar stays plane.
        Source: Johnson, Contact Mechanics, 2.8 and 3.4.
        """
        if self.one_dimensional:
            return 0.0
        squared = (self.c_p / self.c_s) ** 2
        poisson = (squared - 2) / (2 * (squared - 1))
        plane = 2 * self.density * self.c_s**2 / (1 - poisson)  # E/(1 - nu^2)
        return 2 / math.pi * (1.5 - math.log(4)) * self.width / (plane * self.area)


def bulky(solid: Material, area: float, width: float, depth: float) -> Patch:
    """Return a half-space under a disk of the same area; a column of the patch's width at most, for what is thinner."""
    radius = math.sqrt(area / math.pi)
    local = disk_compliance(young=solid.young, poisson=abs(solid.poisson), radius=radius)  # even in nu
    column = depth / (solid.density * solid.c_p**2 * area)
    return Patch(area, width, depth, min(local, column), solid.density, solid.c_p, solid.c_s)


def column_end(solid: Material, area: float, width: float, length: float) -> Patch:
    """Return the end of a straight bar."""
    compliance = length / (solid.young * area)
    return Patch(area, width, length, compliance, solid.density, solid.c_p, solid.c_s, one_dimensional=True)


def on_plate(patch: Patch, solid: Material, radius: float, solidity: float) -> Patch:
    """Return the patch on a clamped round plate of this radius [m], thinned by its holes to a part ``solidity`` of
    it."""
    stiffness = solidity * solid.young * patch.depth**3 / (12 * (1 - solid.poisson**2))
    bending = _BENDING_LOAD * radius**2 / stiffness
    frequency = _FUNDAMENTAL / radius**2 * math.sqrt(stiffness / (solidity * solid.density * patch.depth))
    return replace(patch, bending=bending, bending_frequency=frequency)


def of_shape(shape: Shape, supports: Sequence[Support], solid: Material) -> Patch:
    """Return a bulky body; where what holds it lies beside the struck faces, on a plate in bending, thinned by its
    holes.

    The plate's compliance is that of a clamped round one under a force off its centre,
    w = F (R^2 - r^2)^2/(16 pi D R^2) with the span R - r (Timoshenko and Woinowsky-Krieger,
    Theory of Plates and Shells, 1959, article 64). Springs that hold a body without clamped faces add their own
    compliance.
    """
    depth, mass = shape.depth("contact"), solid.density * shape.volume
    local = bulky(solid, shape.area("contact"), shape.width("contact"), depth)
    held = ["fixed", *(support.on for support in supports if support.holds)]
    bending = frequency = 0.0
    if (span := shape.span("contact", held)) > 0:
        filled = min(1.0, shape.volume / float(shape.extent.prod()))
        plate = on_plate(local, solid, OFF_CENTRE * span, filled)
        radius = float(np.sort(shape.extent)[1]) / 2
        bending = plate.bending
        frequency = plate.bending_frequency * (OFF_CENTRE * span / radius) ** 2
    springs = {support.on: support.stiffness for support in supports if support.stiffness > 0}
    stiffness = sum(each * shape.area(on) for on, each in _there(springs, shape.groups).items())
    if "fixed" not in shape.groups and stiffness > 0:
        bending += 1 / stiffness
        own = math.sqrt(stiffness / mass)
        frequency = own if frequency == 0 else 1 / math.hypot(1 / own, 1 / frequency)
    return replace(local, bending=bending, bending_frequency=frequency)


def _there(springs: dict[str, float], groups: Collection[str]) -> dict[str, float]:
    return {on: each for on, each in springs.items() if on in groups}


@dataclass(frozen=True)
class Column:
    """A straight column: area [m^2] of the struck face, height [m] down to the clamp, narrowest width [m] of the face.

    Its stiffness E A/h is the usual guess at a seat's.
    """

    area: float
    height: float
    width: float
    young: float
    density: float

    @property
    def stiffness(self) -> float:
        """Return E A/h [N/m]."""
        return self.young * self.area / self.height
