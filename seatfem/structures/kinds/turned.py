"""Solids of revolution: seats and stoppers, and the ball."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import ClassVar, Final, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from impact.bodies.body import Body
from impact.exact import contact_stress, half_space
from impact.greens.base import Array
from seatfem.fields import Angle, KeyProblem, Length, build_from_fields
from seatfem.structures import lands
from seatfem.structures.kinds import drawn, structure
from seatfem.structures.kinds.places import StressAtPlaces
from seatfem.structures.lip import AnyLip, Lip
from seatfem.structures.method import QUARTERS, Level, Method
from seatfem.structures.outlines import BodyViews, Size, draw_profile, length_text
from seatfem.structures.shapes import AnnularSeat, ConicalSeat, Stopper, Turning
from seatfem.structures.shapes import Ball as Sphere

MOST_HARMONICS: Final = 1000  # most harmonics of a part of a ring (`seatfem.structures.reduction.harmonics`)
NARROWEST: Final = 2 * math.pi / MOST_HARMONICS
FLAT: Final = 1e-6  # largest difference in height between the edges of a flat ring, relative to its width
UNDIVIDED: Final = ("rod", "harmonics", "sector", "3d")  # values of the key model with a single port for the ring


class Turned(drawn.Drawn):
    """Base of all solids of revolution."""

    traits: ClassVar[structure.Traits] = replace(drawn.Drawn.traits, revolved=True)

    arc: Angle | None = Field(None, description="angular width of the part of the ring that is struck; absent: all")
    fixed: Literal["underside"] = Field("underside", description="the clamped face")

    shape: ClassVar[type[Turning]]

    def geometry(self) -> Turning:
        return build_from_fields(self.shape, self)  # type: ignore[type-var]

    @model_validator(mode="after")
    def _arc_of_a_ring(self) -> Self:
        if self.arc is not None and not NARROWEST <= self.arc < 2 * math.pi:
            least = math.degrees(NARROWEST)
            raise KeyProblem(
                "arc",
                f"{math.degrees(self.arc):g} deg must lie between {least:g} and 360 deg: a narrower part of a ring "
                f"needs more than {MOST_HARMONICS} harmonics",
            )
        return self

    @property
    def sectors(self) -> int:
        return QUARTERS

    @property
    def struck_area(self) -> float:
        """Return the area of the struck face [m^2]."""
        share = 1.0 if self.arc is None else self.arc / (2 * math.pi)
        return share * self.geometry().profile.area("contact")

    @property
    def struck_arc(self) -> float:
        return self.arc or 0.0

    @property
    def lip_face(self) -> structure.LipFace:
        if self.arc is not None:
            return structure.LipFace(no_lip="with arc is struck on that part of its ring alone; remove arc, or the key")
        if self.model in UNDIVIDED:
            return structure.LipFace(no_lip=drawn.struck_as_a_whole(self.model))
        if self._has_lands:
            return structure.LipFace()
        if not isinstance(face := self.region() if self.isotropic else None, Lip):
            return structure.LipFace(no_lip=structure.NO_RING)
        return structure.LipFace(None if face.is_disc else (face.radius, face.width))

    @property
    def local_share(self) -> structure.LocalShare:
        words = "is struck on a ring, nearer its edges than it is wide; take one struck on a disc (stopper) or a block"
        return structure.LocalShare(unknown=words)

    def _find_disc_share(self, radius: float, room: float) -> structure.LocalShare:
        if self.arc is not None:
            return structure.LocalShare(unknown="with arc is struck on a part of its disc; remove arc")
        compliance = partial(half_space.disk_compliance, radius=radius)
        return self.find_half_space_share(compliance, room, ("contact_radius",))

    def views(self, *, coarse: bool = False) -> BodyViews:
        name = self.kind.replace("_", " ")
        return draw_profile(name, self.geometry().profile, struck_arc=self.arc, held=self.clamped)

    @property
    def _has_lands(self) -> bool:
        """Return whether several rings about its axis are struck."""
        return len(self.geometry().profile.rings("contact")) > 1

    def land(self) -> lands.Land:
        profile = self.geometry().profile
        height = next(edge.start[1] for edge in profile.edges if edge.name == "contact")
        return lands.concentric(profile.rings("contact"), height)

    def region(self) -> AnyLip | None:
        if self.arc is not None:
            return None
        if self._has_lands:
            return lands.face_lip(self.land(), 1, 1)
        edges = [edge for edge in self.geometry().profile.edges if edge.name == "contact"]
        (r, z), (s, height) = edges[0].start, edges[-1].end
        flat = abs(z - height) < FLAT * abs(s - r)
        return Lip((r + s) / 2, abs(s - r)) if flat else None

    def elements_of(self, method: Method) -> Level:
        return "harmonics" if method.in_arcs and not self._has_lands else super().elements_of(method)

    @property
    def _obstacles(self) -> dict[Level, str]:
        meridians = "" if self.isotropic else "an orthotropic material need not be the same in every meridian"
        if self.arc is None:
            whole = "the whole ring is struck: harmonic 0 alone, the axisymmetric model, is enough"
            return {**super()._obstacles, "axisymmetric": meridians, "harmonics": meridians or whole}
        return {
            "axisymmetric": meridians or "only an arc of the ring is struck: the load is not the axis's",
            "harmonics": meridians,
            "sector": "only an arc of the ring is struck: the sectors differ",
            "3d": "the drawn contact face is the whole ring, not an arc of it",
        }

    def measures_inside(self, level: Level) -> float:
        if level in ("axisymmetric", "harmonics"):
            return self.geometry().profile.section_area
        return super().measures_inside(level)


class Annular(Turned):
    """A circular plate with a port bore and a raised, rounded lip around it; the reed strikes the lip's flat top. With
    a second lip around an annular port it is the seat of a ring valve, whose ring strikes both lips."""

    shape: ClassVar[type[Turning]] = AnnularSeat
    sample: ClassVar[str] = """
bore_radius = "5 mm"
lip_width = "1 mm"
"""

    kind: Literal["annular"]

    def geometry(self) -> AnnularSeat:
        return build_from_fields(AnnularSeat, self)

    def views(self, *, coarse: bool = False) -> BodyViews:
        """Return the outlines, dimensioned with the widths of the lip and of its flat top."""
        views, shape = super().views(), self.geometry()
        edge = shape.lip_edge_radius if shape.lip_height else 0.0
        flat = [size for size in views.sizes if size.words.startswith("contact")]
        lips = [replace(size, low=size.low - edge, high=size.high + edge, words="lip {} wide") for size in flat]
        sizes = (*(size for size in views.sizes if size not in flat), *(flat if edge else ()), *lips)
        return replace(views, sizes=sizes)

    def struck_part(self) -> tuple[float, float, float]:
        shape = self.geometry()
        width = min(high - low for low, high in shape.lips) - (2 * shape.lip_edge_radius if shape.lip_height else 0.0)
        return self.struck_area, width, shape.thickness + shape.lip_height


class Conical(Turned):
    """A ring whose port widens in a cone, as under a poppet valve; a band in the middle of the cone is struck."""

    shape: ClassVar[type[Turning]] = ConicalSeat
    sample: ClassVar[str] = """
bore_radius = "4 mm"
face_width = "2 mm"
"""

    kind: Literal["conical"]

    def geometry(self) -> ConicalSeat:
        return build_from_fields(ConicalSeat, self)

    def struck_part(self) -> tuple[float, float, float]:
        shape = self.geometry()
        start, end = shape.band
        return self.struck_area, end - start, shape.thickness


class StopperSeat(Turned):
    """A disc, flat or domed, struck around its axis: the stop that limits a valve's lift."""

    shape: ClassVar[type[Turning]] = Stopper
    sample: ClassVar[str] = """
radius = "8 mm"
thickness = "5 mm"
contact_radius = "1 mm"
"""

    kind: Literal["stopper"]

    def geometry(self) -> Stopper:
        return build_from_fields(Stopper, self)

    @property
    def local_share(self) -> structure.LocalShare:
        shape = self.geometry()
        return self._find_disc_share(shape.contact_radius, shape.radius / shape.contact_radius - 1)

    def struck_part(self) -> tuple[float, float, float]:
        return self.struck_area, self.geometry().contact_radius, self.geometry().thickness


class Ball(Turned):
    """A free elastic sphere. It touches with a small flat facet at its pole, a disc of constant radius. Its rigid
    motion is exact; its waves and its compliance are in its Green's function. For Hertz's contact of a ball on a flat
    face, whose disc grows with the force, use law = { kind = "hertz", ... } with the stiffness of both bodies, (4/3) E*
    sqrt(R): the local compliance of facet and patch is then subtracted from the law. State on both bodies a
    contact_radius of at least that of the contact; the force does not depend on it. kind = "rigid_mass" in place of the
    ball omits its waves."""

    traits: ClassVar[structure.Traits] = replace(Turned.traits, stress="closed form")
    group: ClassVar[str] = "strikers"
    sample: ClassVar[str] = """
diameter = "10 mm"
damping_ratio = 0.005
"""
    sample_scene: ClassVar[structure.SampleScene] = structure.SampleScene(
        'velocity = "-0.5 m/s"', "stopper", contact='law = { kind = "hertz", stiffness = "10.4 GN/m^1.5" }'
    )

    kind: Literal["ball"]
    diameter: Length = Field(description="diameter")
    contact_radius: Length | None = Field(None, description="radius of the facet; absent: diameter/16")
    fixed: Literal["nothing"] = Field("nothing", description="it flies freely")  # type: ignore[assignment]

    @model_validator(mode="after")
    def _whole_facet(self) -> Self:
        if self.arc is not None:
            raise KeyProblem("arc", "a ball touches with its whole facet; remove the key")
        return self

    @property
    def clamped(self) -> bool:
        return False

    def geometry(self) -> Sphere:
        return Sphere(self.diameter, self.contact_radius or self.diameter / 16)

    @property
    def local_share(self) -> structure.LocalShare:
        return self._find_disc_share(self.geometry().contact_radius, math.inf)

    def views(self, *, coarse: bool = False) -> BodyViews:
        radius = self.diameter / 2
        diameter = Size("plan", 1, -radius, radius, radius, "Ø {}")
        return replace(super().views(), sizes=(diameter,))

    def pushed_at(self, body: Body, place: structure.Place, by: structure.Push = "force") -> Array:
        """Return (M, n); springs act on the translation only, as at the centre of the ball: the facet would yield."""
        modal, pushed = body.greens.modal, super().pushed_at(body, place, by)
        assert modal is not None
        return np.where(modal.omega[:, None] == 0, pushed, 0.0) if by == "springs" else pushed

    def stress(self, force: Array, dt: float, body: Body, at: structure.At) -> StressAtPlaces:
        """Return the stress on the axis below the facet at the depth of the largest von Mises stress.

        The pressure on the facet is uniform, as for its port in the Green's function: p = N/(pi a^2). The stress is the
        static one in a half-space under the instantaneous force.

        Source: Timoshenko and Goodier, load over part of the boundary of a semi-infinite solid.
        """
        facet, poisson = self.geometry().contact_radius, self.material.mean.poisson
        depth = contact_stress.disk_shear_maximum(poisson=poisson).depth
        across, along = contact_stress.disk_axis_stress(np.array([depth]), poisson=poisson)
        unit = np.array([across[0], across[0], along[0], 0.0, 0.0, 0.0])
        tensors = np.outer(np.abs(force) / (math.pi * facet**2), unit)
        below = {f"{length_text(depth * facet)} below the facet": (depth * facet, tensors)}
        return StressAtPlaces(below, force, dt, is_inside=True)

    def struck_part(self) -> tuple[float, float, float]:
        return self.struck_area, self.geometry().contact_radius, self.diameter
