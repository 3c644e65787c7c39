"""What of a seat's geometry counts before any mesh: the struck patch, its narrowest width, how stiff the body is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from impact.exact.half_space import disk_compliance
from seatfem.structures.inspection.cad import inspect_geometry
from seatfem.structures.inspection.shape import Shape
from seatfem.structures.kinds.parts import Material, OrthotropicMaterial
from seatfem.structures.kinds.seats import DrawnSeat, ElasticSeat, MeshFile, Plate, RevolvedSeat
from seatfem.structures.shapes import AnnularSeat, Block, CadPart, ConicalSeat, GeometryError, Stopper, ValvePlate

OFF_CENTRE = 1.5  # (R + r)/R of a force half way between a clamped plate's centre and its rim
_BENDING_LOAD = 1 / (16 * math.pi)  # centre of a clamped round plate under a central force: w = F R^2/(16 pi D)
_FUNDAMENTAL = 10.22  # of a clamped round plate: w_1 = 10.22/R^2 sqrt(D/(rho t)). Leissa, Vibration of Plates, 2.1


@dataclass(frozen=True)
class Patch:
    """The struck patch and the body behind it.

    Attributes:
        area: struck [m^2].
        width: the narrowest extent of the struck faces [m].
        depth: of the body behind the patch [m].
        compliance: static, of the body without bending, estimated [m/N].
        bending: static compliance of the plate that the patch lies on; 0 for a bulky body [m/N].
        bending_frequency: of the plate's first mode [rad/s]; 0 for a bulky body.
        density, c_p, c_s: of the material [kg/m^3, m/s].
        one_dimensional: whether waves go along a line and come back undiminished.
    """

    area: float
    width: float
    depth: float
    compliance: float
    bending: float
    bending_frequency: float
    density: float
    c_p: float
    c_s: float
    one_dimensional: bool

    @property
    def impedance(self) -> float:
        """Force per velocity of the patch at the very first instant, rho c_p A [N s/m]."""
        return self.density * self.c_p * self.area

    @property
    def evened(self) -> float:
        """Compliance by which a patch that moves as its mean is softer than under a rigid face [m/N].

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


@dataclass(frozen=True)
class _Elastic:
    young: float
    poisson: float
    density: float

    @property
    def c_p(self) -> float:
        nu = self.poisson
        return math.sqrt(self.young * (1 - nu) / ((1 + nu) * (1 - 2 * nu) * self.density))

    @property
    def c_s(self) -> float:
        return math.sqrt(self.young / (2 * (1 + self.poisson) * self.density))


def patch_of(seat: ElasticSeat) -> Patch:
    """The patch of a seat of finite elements; of a file's, as its faces are.

    Raises:
        GeometryError: a file without such faces.
    """
    solid = _elastic(seat)
    if isinstance(seat, MeshFile):
        from seatfem.structures.inspection.mesh_file import mesh_of, shape_of  # its readers take half a second to load

        return _of_shape(seat, shape_of(mesh_of(seat)), solid)
    assert isinstance(seat, DrawnSeat)
    geometry = seat.geometry()
    match geometry:
        case CadPart():
            found = inspect_geometry(geometry)
            if "contact" not in found.shape.groups:
                raise GeometryError("\n".join(message for _, message in found.problems))
            return _of_shape(seat, found.shape, solid)
        case AnnularSeat() | ConicalSeat() | Stopper():
            share = seat.arc / (2 * math.pi) if isinstance(seat, RevolvedSeat) and seat.arc is not None else 1.0
            depth = geometry.thickness + (geometry.lip_height if isinstance(geometry, AnnularSeat) else 0.0)
            return _bulky(solid, share * geometry.profile.area("contact"), _width(geometry), depth)
        case ValvePlate():
            assert isinstance(seat, Plate)
            return _plate(seat, geometry, solid)
        case Block():
            area = geometry.patch_width * geometry.patch_depth
            return _bulky(solid, area, min(geometry.patch_width, geometry.patch_depth), geometry.thickness)
        case _:
            area = geometry.width * geometry.height
            along = geometry.length / (solid.young * area)
            width = min(geometry.width, geometry.height)
            return Patch(area, width, geometry.length, along, 0.0, 0.0, solid.density, solid.c_p, solid.c_s, True)


def _width(geometry: AnnularSeat | ConicalSeat | Stopper) -> float:
    match geometry:
        case AnnularSeat():
            return geometry.lip_width - (2 * geometry.lip_edge_radius if geometry.lip_height else 0.0)
        case ConicalSeat():
            return geometry.band[1] - geometry.band[0]
        case Stopper():
            return geometry.contact_radius


def _elastic(seat: ElasticSeat) -> _Elastic:
    """The seat's material; of an orthotropic one the means."""
    material = seat.material
    if isinstance(material, OrthotropicMaterial):
        return _Elastic(sum(material.young) / 3, sum(material.poisson) / 3, material.density)
    assert isinstance(material, Material)
    return _Elastic(material.young, material.poisson, material.density)


def _bulky(solid: _Elastic, area: float, width: float, depth: float) -> Patch:
    """A half-space under a disk of the same area; a column of the patch's width at most, for what is thinner."""
    radius = math.sqrt(area / math.pi)
    local = disk_compliance(young=solid.young, poisson=abs(solid.poisson), radius=radius)  # even in nu
    column = depth / (solid.density * solid.c_p**2 * area)
    return Patch(area, width, depth, min(local, column), 0.0, 0.0, solid.density, solid.c_p, solid.c_s, False)


def _of_shape(seat: ElasticSeat, shape: Shape, solid: _Elastic) -> Patch:
    """A bulky body; where what holds it lies beside the struck faces, on a plate in bending, thinned by its holes.

    The plate's compliance is that of a clamped round one under a force off its centre,
    w = F (R^2 - r^2)^2/(16 pi D R^2) with the span R - r (Timoshenko and Woinowsky-Krieger,
    Theory of Plates and Shells, 1959, article 64). Springs that hold a body without clamped faces add their own
    compliance.
    """
    depth, mass = shape.depth("contact"), solid.density * shape.volume
    local = _bulky(solid, shape.area("contact"), shape.width("contact"), depth)
    springs = {support.on: support for support in seat.supports if support.kind in ("foundation", "bolted")}
    held = ["fixed", *(support.on for support in seat.supports if support.holds)]
    bending = frequency = 0.0
    if (span := shape.span("contact", held)) > 0:
        sides = np.sort(shape.extent)
        filled = min(1.0, shape.volume / float(shape.extent.prod()))
        stiffness = filled * solid.young * depth**3 / (12 * (1 - solid.poisson**2))
        bending = _BENDING_LOAD * (OFF_CENTRE * span) ** 2 / stiffness
        radius = float(sides[1]) / 2
        frequency = _FUNDAMENTAL / radius**2 * math.sqrt(stiffness / (filled * solid.density * depth))
    stiffness = sum(support.normal * shape.area(on) for on, support in springs.items() if on in shape.groups)
    if "fixed" not in shape.groups and stiffness > 0:
        bending += 1 / stiffness
        own = math.sqrt(stiffness / mass)
        frequency = own if frequency == 0 else 1 / math.hypot(1 / own, 1 / frequency)
    return replace(local, bending=bending, bending_frequency=frequency)


def _plate(seat: Plate, geometry: ValvePlate, solid: _Elastic) -> Patch:
    """A bulky body on a clamped round plate of the same reach, thinned by its ports."""
    struck = 1 if seat.struck is not None else geometry.ports
    reach = geometry.port_radius + geometry.land_width
    area = struck * math.pi * (reach**2 - geometry.port_radius**2)
    local = _bulky(solid, area, geometry.land_width, geometry.thickness)
    radius = geometry.outer_radius if geometry.layout == "circle" else min(geometry.half_sides)
    radius -= geometry.clamp_width
    solidity = 1 - geometry.ports * geometry.port_radius**2 / geometry.outer_radius**2
    solidity = max(solidity, 0.2) if geometry.layout == "circle" else 0.5
    stiffness = solidity * solid.young * geometry.thickness**3 / (12 * (1 - solid.poisson**2))
    bending = _BENDING_LOAD * radius**2 / stiffness
    frequency = _FUNDAMENTAL / radius**2 * math.sqrt(stiffness / (solidity * solid.density * geometry.thickness))
    return Patch(
        area=area,
        width=geometry.land_width,
        depth=geometry.thickness,
        compliance=local.compliance,
        bending=bending,
        bending_frequency=frequency,
        density=solid.density,
        c_p=solid.c_p,
        c_s=solid.c_s,
        one_dimensional=False,
    )
