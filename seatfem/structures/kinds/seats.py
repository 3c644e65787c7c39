"""[seat]: what is struck. One class per kind; a new kind is a new class and one name in `Seat`."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from seatfem.fields import (
    Angle,
    Area,
    DampingRatio,
    Density,
    ExistingFile,
    Gap,
    KeyProblem,
    Length,
    Pressure,
    Stiffness,
    Table,
    default,
)
from seatfem.structures.kinds.imported import FrequencyResponseFile, Matrices, UniversalModes
from seatfem.structures.kinds.parts import (
    AnyMaterial,
    AnySupport,
    GreensSettings,
    Mesh,
    Rayleigh,
)
from seatfem.structures.kinds.selectors import (
    BLUE_FACES,
    RED_FACES,
    ClampSelector,
    FaceSelector,
    Region,
    in_scene_words,
)
from seatfem.structures.shapes import (
    AnnularSeat,
    Bar,
    Block,
    CadPart,
    ConicalSeat,
    Geometry,
    Group,
    Revolved,
    Stopper,
    ValvePlate,
)

METRES = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "inch": 0.0254}
"""Metres per length unit of a CAD or mesh file."""


class ElasticSeat(Table):
    """What all seats made of finite elements have."""

    material: AnyMaterial = Field(description="the seat's material: a table, or a name alone")
    materials: dict[str, AnyMaterial] = default({}, "other materials, by the name of their region")
    damping_ratio: DampingRatio = Field(0.0, description="modal damping, the same for every mode")
    rayleigh: Rayleigh | None = Field(None, description="Rayleigh damping, instead of damping_ratio")
    supports: tuple[AnySupport, ...] = default((), "what holds the seat beside its clamped faces")
    greens: GreensSettings = default({}, "how the Green's function is computed")

    @property
    def clamped(self) -> bool:
        """Whether some face is."""
        return True

    @property
    def held(self) -> bool:
        """Whether something may keep the seat in its place; ``False``: it is certain to move away."""
        return self.clamped or any(support.holds for support in self.supports)

    @model_validator(mode="after")
    def _one_damping(self) -> Self:
        if self.rayleigh is not None and self.damping_ratio > 0.0:
            raise KeyProblem("rayleigh", "damping_ratio is given too; keep one of the two")
        return self


class DrawnSeat(ElasticSeat):
    """What all seats have that gmsh meshes."""

    mesh: Mesh = default({}, "how fine the finite elements are")
    model: Literal["auto", "spring", "rod", "axisymmetric", "harmonics", "sector", "3d"] = Field(
        "auto", description="how much of the seat is modelled; auto: the cheapest that serves; spring: its statics only"
    )

    def geometry(self) -> Geometry:
        """The geometry in SI units. Raises `GeometryError` where it cannot be built."""
        raise NotImplementedError

    @property
    def struck_face(self) -> str:
        """Name of the face that is struck."""
        return "contact"

    @model_validator(mode="after")
    def _geometry_can_be_built(self) -> Self:
        in_scene_words(self.geometry)
        return self


class RevolvedSeat(DrawnSeat):
    """What all solids of revolution have."""

    arc: Angle | None = Field(None, description="angular width of the part of the ring that is struck; absent: all")
    fixed: Literal["underside"] = Field("underside", description="the clamped face")

    def geometry(self) -> Revolved:
        raise NotImplementedError

    @model_validator(mode="after")
    def _arc_of_a_ring(self) -> Self:
        if self.arc is not None and not 0.0 < self.arc < 2 * math.pi:
            raise KeyProblem("arc", f"{math.degrees(self.arc):g} deg is not between 0 and 360 deg")
        return self


class Annular(RevolvedSeat):
    """A circular plate with a port bore and a raised, rounded lip around it; the reed strikes the lip's flat top."""

    kind: Literal["annular"]
    bore_radius: Length = Field(description="radius of the port")
    lip_width: Length = Field(description="radial width of the lip, its rounded edges included")
    lip_height: Gap = default("0.5 mm", "height of the lip above the plate; 0 mm for a flat seat")
    lip_edge_radius: Gap = default("0.1 mm", "radius of the lip's upper edges; 0 mm for sharp ones")
    outer_radius: Length = default("12 mm", "radius of the plate")
    thickness: Length = default("8 mm", "thickness of the plate")

    def geometry(self) -> AnnularSeat:
        return AnnularSeat(
            bore_radius=self.bore_radius,
            lip_width=self.lip_width,
            lip_height=self.lip_height,
            lip_edge_radius=self.lip_edge_radius,
            outer_radius=self.outer_radius,
            thickness=self.thickness,
        )


class Conical(RevolvedSeat):
    """A ring whose port widens in a cone, as under a poppet valve; a band in the middle of the cone is struck."""

    kind: Literal["conical"]
    bore_radius: Length = Field(description="radius of the port")
    half_angle: Angle = default("45 deg", "between the cone's generators and the axis")
    face_width: Length = Field(description="width of the cone along its generators")
    contact_width: Length | None = Field(
        None, description="width of the band that is struck; all of the cone if absent"
    )
    outer_radius: Length = default("12 mm", "radius of the ring")
    thickness: Length = default("8 mm", "thickness of the ring")

    def geometry(self) -> ConicalSeat:
        return ConicalSeat(
            bore_radius=self.bore_radius,
            half_angle=self.half_angle,
            face_width=self.face_width,
            contact_width=self.contact_width,
            outer_radius=self.outer_radius,
            thickness=self.thickness,
        )


class StopperSeat(RevolvedSeat):
    """A disc, flat or domed, struck around its axis: the stop that limits a valve's lift."""

    kind: Literal["stopper"]
    radius: Length = Field(description="radius of the disc")
    thickness: Length = Field(description="thickness of the disc, at its axis")
    contact_radius: Length = Field(description="radius of the patch that is struck")
    dome_radius: Length | None = Field(None, description="radius of the spherical top; a flat one if absent")

    def geometry(self) -> Stopper:
        return Stopper(
            radius=self.radius,
            thickness=self.thickness,
            contact_radius=self.contact_radius,
            dome_radius=self.dome_radius,
        )


class Plate(DrawnSeat):
    """A flat valve plate with several round ports, a sealing land around each, and webs between them."""

    kind: Literal["plate"]
    ports: int = Field(strict=True, ge=1, le=200, description="number of ports")
    port_radius: Length = Field(description="radius of each port")
    pitch: Length = Field(description="distance of neighbouring ports, centre to centre")
    margin: Length = Field(description="from the outer ports to the plate's edge")
    thickness: Length = Field(description="thickness of the plate")
    land_width: Length = Field(description="width of the land around each port")
    clamp_width: Length = Field(description="width of the clamped rim of the underside")
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
        """The lands of all ports, or of one."""
        return "contact" if self.struck is None else f"land_{self.struck}"

    def geometry(self) -> ValvePlate:
        return ValvePlate(
            ports=self.ports,
            port_radius=self.port_radius,
            pitch=self.pitch,
            margin=self.margin,
            thickness=self.thickness,
            land_width=self.land_width,
            clamp_width=self.clamp_width,
            layout=self.layout,
        )


class BarSeat(DrawnSeat):
    """A straight bar, clamped at one end and struck on the other: the rod in three dimensions."""

    kind: Literal["bar"]
    length: Length = Field(description="length along the impact")
    width: Length = Field(description="side of the cross-section")
    height: Length = Field(description="other side of the cross-section")
    fixed: Literal["end"] = Field("end", description="the clamped face")

    def geometry(self) -> Bar:
        return Bar(length=self.length, width=self.width, height=self.height)


class BlockSeat(DrawnSeat):
    """A block with a rectangular contact patch in the middle of its top."""

    kind: Literal["block"]
    width: Length = Field(description="side of the block")
    depth: Length = Field(description="other side of the block")
    thickness: Length = Field(description="height of the block")
    patch_width: Length = Field(description="side of the contact patch, along width")
    patch_depth: Length = Field(description="other side of the contact patch, along depth")
    fixed: Literal["underside"] = Field("underside", description="the clamped face")

    def geometry(self) -> Block:
        return Block(
            width=self.width,
            depth=self.depth,
            thickness=self.thickness,
            patch_width=self.patch_width,
            patch_depth=self.patch_depth,
        )


class Cad(DrawnSeat):
    """A solid drawn in a CAD program, read from a STEP or BREP file."""

    kind: Literal["cad"]
    file: ExistingFile = Field(description="the file, relative to the scene's folder")
    unit: Literal["m", "mm", "um", "inch"] | None = Field(
        None, description="length unit of the file; a STEP file states its own"
    )
    contact: FaceSelector = Field(RED_FACES, description="faces that are struck; by default those painted pure red")
    fixed: ClampSelector = Field(BLUE_FACES, description="faces that are clamped; by default those painted pure blue")
    groups: dict[str, FaceSelector] = default({}, "further faces by name, for supports")
    regions: dict[str, Region] = default({}, "solids by name, for materials; the others are solid_1, solid_2, ...")

    @property
    def clamped(self) -> bool:
        """Whether some face is."""
        return self.fixed.kind != "nothing"

    def geometry(self) -> CadPart:
        return CadPart(
            path=self.file,
            unit=None if self.unit is None else METRES[self.unit],
            contact=self.contact.selectors(),
            fixed=self.fixed.selectors(),
            groups=tuple(Group(name, faces.selectors()) for name, faces in self.groups.items()),
            regions=tuple(region.named(name) for name, region in self.regions.items()),
        )


class MeshFile(ElasticSeat):
    """A mesh made elsewhere, with named surface groups."""

    kind: Literal["mesh"]
    file: ExistingFile = Field(description="the mesh file, relative to the scene's folder")
    unit: Literal["m", "mm", "um", "inch"] = Field("m", description="length unit of the file")
    contact: str = Field("contact", description="name of the surface group that is struck")
    fixed: str = Field("fixed", description="name of the surface group that is clamped; empty for a free body")
    merge: Gap | None = Field(
        None, description="nodes nearer than this become one; 0 mm keeps all; absent: coincident nodes are an error"
    )
    parts: int = Field(1, strict=True, ge=1, description="number of parts that share no node")

    @property
    def clamped(self) -> bool:
        """Whether some face is."""
        return bool(self.fixed)


class Rod(Table):
    """The straight elastic rod in one dimension, clamped at its far end, in closed form."""

    kind: Literal["rod"]
    young: Pressure = Field(description="Young's modulus")
    density: Density = Field(description="mass per volume")
    length: Length = Field(description="length along the impact")
    area: Area | None = Field(None, description="cross-section; or give width and thickness")
    width: Length | None = Field(None, description="width of a rectangular cross-section")
    thickness: Length | None = Field(None, description="thickness of a rectangular cross-section")
    damping_ratio: DampingRatio = Field(0.0, description="modal damping, the same for every mode")

    @model_validator(mode="after")
    def _one_cross_section(self) -> Self:
        if self.area is not None and (self.width or self.thickness):
            raise KeyProblem("area", "width or thickness is given too; keep the area or both of these")
        if self.area is None and not (self.width and self.thickness):
            raise KeyProblem("area", "the cross-section is missing: give area, or width and thickness")
        return self

    @property
    def cross_section(self) -> float:
        """Area in square metres."""
        return self.area if self.area is not None else (self.width or 0.0) * (self.thickness or 0.0)


class Spring(Table):
    """A massless spring: the model of the seat that has no waves."""

    kind: Literal["spring"]
    stiffness: Stiffness = Field(description="force per displacement of the contact")


class GreensFile(Table):
    """A Green's function computed or measured before."""

    kind: Literal["greens"]
    file: ExistingFile = Field(description="the Green's function file, relative to the scene's folder")


Seat = Annotated[
    Annular
    | Conical
    | StopperSeat
    | Plate
    | BarSeat
    | BlockSeat
    | Cad
    | MeshFile
    | Matrices
    | UniversalModes
    | FrequencyResponseFile
    | Rod
    | Spring
    | GreensFile,
    Field(discriminator="kind"),
]
