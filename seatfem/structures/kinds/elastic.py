"""Structures described by mass and stiffness matrices, and those of finite elements: material, damping, supports."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Final, Self

from pydantic import Field, model_validator

from impact.greens.base import GreensFunction
from impact.notices import Progress
from impact.runs.variations import NARROWER, narrow_greens
from seatfem.fields import Contradictions, DampingRatio, KeyProblem, default
from seatfem.structures import lands
from seatfem.structures.errors import ModelError
from seatfem.structures.inspection.cad import listed
from seatfem.structures.kinds import motion, parts, structure
from seatfem.structures.method import AnyLevel, Applicability, Level, Method
from seatfem.structures.method import memory as forgotten_after
from seatfem.structures.patch import rod_behind
from seatfem.units import write_quantity

if TYPE_CHECKING:
    from seatfem.structures.finite_elements import AnyMesh
    from seatfem.structures.lands import Land
    from seatfem.structures.lip import AnyLip
    from seatfem.structures.materials import Material, Orthotropic

LIP_ORDER: Final = 1.3  # order of convergence of landings on a lip with the seat's band: 1.3 to 2.2 from 100 to 630 kHz


class Reduced(motion.Moving):
    """Base of all bodies described by mass and stiffness matrices."""

    traits: ClassVar[structure.Traits] = replace(motion.Moving.traits, is_reduced=True)

    damping_ratio: DampingRatio = Field(0.0, description="modal damping, the same for every mode")
    greens: parts.GreensSettings = default({}, "how the Green's function is computed")

    def levels(self) -> tuple[Applicability, ...]:
        return (Applicability("3d", True, 0.0, "as the file has it"),)

    def stated(self, error: float = 0.0, rings: int | None = 1) -> Method:
        settings = self.greens
        return replace(
            super().stated(error, rings),
            bandwidth=settings.bandwidth,
            tolerance=settings.tolerance,
            reduction=settings.method,
            max_vectors=settings.max_vectors,
        )

    def memory(self, method: Method, duration: float) -> float:
        """Return the time [s] up to which g must be accurate in a run of ``duration`` [s]: earlier if uniform damping
        makes motions at a tenth of the bandwidth decay to a thousandth before."""
        assert method.bandwidth is not None
        return min(duration, forgotten_after(self.damping_ratio, method.bandwidth))


class Elastic(Reduced):
    """Base of all bodies made of finite elements."""

    traits: ClassVar[structure.Traits] = replace(Reduced.traits, needs_gmsh=True, has_rings=True)
    has_faces: ClassVar[bool] = False
    """This says whether the contact face may consist of flat faces of any outline."""

    material: parts.AnyMaterial = Field(description="the body's material: a table, or a name alone")
    materials: dict[str, parts.AnyMaterial] = default({}, "other materials, by the name of their region")
    rayleigh: parts.Rayleigh | None = Field(None, description="Rayleigh damping, instead of damping_ratio")
    supports: tuple[parts.AnySupport, ...] = default((), "supports in addition to its clamped faces")

    @model_validator(mode="after")
    def _one_damping(self) -> Self:
        if self.rayleigh is not None and self.damping_ratio > 0.0:
            raise KeyProblem("rayleigh", "damping_ratio is given too; keep one of the two")
        return self

    @property
    def elastic(self) -> Elastic | None:
        return self

    def stated(self, error: float = 0.0, rings: int | None = 1) -> Method:
        return super().stated(error, rings or 1)

    @property
    def clamped(self) -> bool:
        """Return whether some face is clamped."""
        return True

    @property
    def held(self) -> tuple[str, ...]:
        """Return the names of the clamped faces."""
        return ("fixed",) if self.clamped else ()

    @property
    def loose(self) -> str:
        if self.clamped or any(support.holds for support in self.supports):
            return ""
        return "seat.fixed names no face and no entry of seat.supports holds the seat"

    @property
    def bedded(self) -> tuple[str, ...]:
        """Return the names of the faces that supports hold."""
        return tuple(support.on for support in self.supports if support.holds)

    @property
    def struck_arc(self) -> float:
        """Return the angular width of the part of a ring that is struck [rad]; 0: all of it, or no ring."""
        return 0.0

    @property
    def lip_face(self) -> structure.LipFace:
        return structure.LipFace() if self.has_faces else super().lip_face

    @property
    def local_share(self) -> structure.LocalShare:
        words = "is struck on faces whose distance from the body's edges is not known; take a block, stopper or ball"
        return structure.LocalShare(unknown=words)

    def find_half_space_share(
        self, compliance: Callable[..., float], room: float, sizes: tuple[str, ...]
    ) -> structure.LocalShare:
        """Return the share of a patch with a ``compliance`` (young=, poisson=) on a half-space, ``room`` times half its
        own width away from the body's edges."""
        if not self.isotropic or self.materials:
            return structure.LocalShare(unknown="has no single isotropic material under its patch; state one")
        if room < 1:
            words = f"is struck nearer an edge than half of its patch's width; make {' and '.join(sizes)} smaller"
            return structure.LocalShare(unknown=words)
        solid = self.material.mean
        return structure.LocalShare(compliance(young=solid.young, poisson=abs(solid.poisson)), sizes)

    def land(self) -> Land:
        """Return the flat contact faces. Raises `ModelError` unless they are rings or strips."""
        raise NotImplementedError

    def region(self) -> AnyLip | None:
        return lands.face_lip(self.land(), 1, 1) if self.has_faces else None

    def covered_problems(self, width: float | None) -> Contradictions:
        if not self.has_faces and self.region() is None:
            words = f"required key is missing: a seat of kind {self.kind!r}, as it is given here, has no flat ring or"
            yield "reed.contact_radius", f"{words} disc that the reed could meet all over"
        elif width is not None:
            words = f"{write_quantity(width, 'length')} has no effect without reed.contact_radius: the reed meets the"
            remedy = "add reed.contact_radius, the ring's mean radius, or remove it"
            yield "reed.contact_width", f"{words} whole struck face; {remedy}"

    def field_problems(self) -> Iterator[str]:
        yield from ()

    @property
    def copies(self) -> Mapping[AnyLevel, int]:
        """Return, by level, the number of copies of the modelled part in the whole body; 1 for levels not listed."""
        return {}

    @property
    def isotropic(self) -> bool:
        """Return whether every material is the same in all directions."""
        return all(material.isotropic for material in (self.material, *self.materials.values()))

    @property
    def slowest(self) -> float:
        """Return the speed of the slowest shear waves of its materials [m/s]."""
        return min(material.solid.c_s for material in (self.material, *self.materials.values()))

    def solids(self, regions: tuple[str, ...]) -> Material | Orthotropic | dict[str, Material | Orthotropic]:
        """Return the material of the body, or of each region: ``material`` for regions not named in ``materials``.

        Raises:
            ModelError: the name of a region that the mesh does not have.
        """
        if not self.materials:
            return self.material.solid
        if unknown := [name for name in self.materials if name not in regions]:
            raise ModelError(f"seat.materials.{unknown[0]}: the mesh has no such region; it has {', '.join(regions)}")
        return {name: self.materials.get(name, self.material).solid for name in regions}

    def meshes(self, method: Method, progress: Progress) -> tuple[AnyMesh, AnyMesh | None]:
        """Return the mesh of a method, and one coarser by `COARSENING` where the body is drawn."""
        raise NotImplementedError

    def narrow_bands(self, greens: GreensFunction, *, in_arcs: bool) -> tuple[tuple[GreensFunction, float], ...]:
        """Return one without the modes within a factor `NARROWER` of the last, as a Krylov space has modes far beyond
        its band; along a lip two, as the change by one may be small by accident."""
        if (modal := greens.modal) is None or len(modal.omega) == 0:
            return ()
        highest = float(modal.frequencies_hz.max())
        if not in_arcs:
            return ((narrow_greens(modal, highest / NARROWER), 1.0),)
        return tuple((narrow_greens(modal, highest / r), 1 / (r**LIP_ORDER - 1)) for r in (NARROWER, NARROWER**2))

    def discrete(self, level: AnyLevel) -> Level:
        """Return the level of the finite elements; for a spring, the cheapest that applies."""
        return "3d"

    def elements_of(self, method: Method) -> Level:
        """Return the level: "3d" for a lip in arcs, which has no equal sectors."""
        return "3d" if method.in_arcs else self.discrete(method.level)

    def estimate(self) -> GreensFunction | None:
        patch = self.patch()
        return None if patch is None else rod_behind(patch, self.damping_ratio + self.material.loss_factor / 2)

    def mass(self) -> float:
        """Return the mass [kg], with ``material`` in all regions."""
        raise NotImplementedError

    def unknown_names(self, faces: Collection[str], regions: Collection[str]) -> Iterator[structure.Finding]:
        """Yield problems: supports on clamped or unknown faces, and materials of unknown regions."""
        for number, support in enumerate(self.supports):
            if support.on in self.held:
                words = f"the face {support.on!r} is clamped: a support there changes nothing"
                yield ("supports", number, "on"), f"{words}; remove the support, or the face from what is clamped"
            if support.on not in faces:
                yield ("supports", number, "on"), f"no face named {support.on!r}; there are: {listed(faces)}"
        for name in self.materials:
            if name not in regions:
                yield ("materials", name), f"no region named {name!r}; there are: {listed(regions)}"
