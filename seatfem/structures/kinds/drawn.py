"""Base of the structures whose geometry is meshed by gmsh."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import ClassVar, Final, Literal, Self

from pydantic import Field, model_validator

from impact.notices import Progress
from seatfem import fields
from seatfem.structures import finite_elements, lands, memory_need, outlines
from seatfem.structures.inspection import mesh_file
from seatfem.structures.inspection.cad import Part, inspect_geometry
from seatfem.structures.kinds import elastic, parts, selectors, structure
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.method import (
    DISCRETE,
    PER_WAVELENGTH,
    AnyLevel,
    Applicability,
    Level,
    Method,
    Solved,
    Task,
    choose_level,
)
from seatfem.structures.patch import Patch, Sizes, bulky
from seatfem.structures.shapes import Geometry
from seatfem.structures.surface_outlines import draw_surface

WHOLE: Final = ("rod", "axisymmetric", "harmonics", "sector")  # values of the key model with a single port for a lip


class Drawn(elastic.Elastic):
    """Base of all bodies with a geometry that gmsh meshes."""

    @property
    def drawn(self) -> Drawn | None:
        return self

    mesh: parts.Mesh = fields.default({}, "how fine the finite elements are")
    model: Literal["auto", "spring", "rod", "axisymmetric", "harmonics", "sector", "3d"] = Field(
        "auto",
        description="how much of the body is modelled; auto: the cheapest that is accurate enough; spring: statics",
    )

    shape: ClassVar[type[Geometry]]
    """Class of the geometry; its fields are keys of the table."""

    def geometry(self) -> Geometry:
        """Return the geometry in SI units. Raises `GeometryError` if it cannot be built."""
        return fields.build_from_fields(self.shape, self)  # type: ignore[type-var]

    @property
    def lip_face(self) -> structure.LipFace:
        face = super().lip_face
        return replace(face, no_lip=face.no_lip or (struck_as_a_whole(self.model) if self.model in WHOLE else ""))

    def land(self) -> lands.Land:
        return inspect_geometry(self.geometry()).land(self.struck_face, self.own_axis)

    def struck_part(self) -> tuple[float, float, float]:
        """Return the area [m^2] and smallest width [m] of the contact face, and the depth of the body behind it [m]."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _geometry_can_be_built(self) -> Self:
        selectors.build_in_scene_words(self.geometry)
        return self

    @property
    def sectors(self) -> int:
        """Return the number of equal sectors, bounded by planes of symmetry, of body and load; 1: no symmetry."""
        return 1

    @property
    def copies(self) -> Mapping[AnyLevel, int]:
        return {"sector": self.sectors}

    def inputs(self) -> structure.Inputs:
        made = super().inputs()
        return structure.Inputs(made.content, (*made.classes, type(self.geometry())))

    def problems(self) -> Iterator[structure.Finding]:
        yield from self.unknown_names(self.geometry().patches, ("seat",))

    def part(self) -> Part:
        return mesh_file.describe_geometry(self.geometry(), f"seat, kind = {self.kind!r}")

    def views(self, *, coarse: bool = False) -> outlines.BodyViews:
        """Return the outlines, of a block by its sides, of other bodies by the triangulation of their surface."""
        shape, name = self.geometry(), self.kind.replace("_", " ")
        if (cuboid := shape.cuboid) is not None:
            views = outlines.draw_prism(name, cuboid.sides, cuboid.patch, cuboid.height)
            return views if self.clamped else replace(views, held=())
        inspected, struck = inspect_geometry(shape, picture=not coarse), self.struck_face
        normals = [face.normal for face in inspected.faces if struck in face.groups]
        normal = normals[0] if normals else None
        groups = struck, normal, self.held, self.bedded
        return draw_surface(name, inspected.shape, inspected.rows, *groups, self.own_axis)

    # Levels of modelling

    def levels(self) -> tuple[Applicability, ...]:
        reasons: dict[Level, str] = {
            "axisymmetric": "axisymmetric (body, supports and load)",
            "harmonics": "a body of revolution, loaded off its axis: Fourier harmonics in the angle",
            "sector": f"one of {self.sectors} sectors between planes of symmetry stands for the whole",
            "3d": "the whole body",
        }
        others = (
            Applicability.refused(level, why) if why else Applicability(level, True, 0.0, reasons[level])
            for level, why in self._obstacles.items()
        )
        return (self._rod(self.greens.bandwidth), *others)

    @property
    def _obstacles(self) -> dict[Level, str]:
        """Return for each discrete level the reason why it does not apply; "" if it does."""
        sector = "" if self.isotropic else "an orthotropic material turns from sector to sector"
        return {
            "axisymmetric": "the geometry is no solid of revolution",
            "harmonics": "the geometry is no solid of revolution",
            "sector": sector if self.sectors > 1 else "body and load cannot be cut into equal sectors",
            "3d": "",
        }

    def level(self, error: float) -> Applicability:
        return choose_level(self.levels(), error, self.model)

    def stated(self, error: float = 0.0, rings: int | None = 1) -> Method:
        method, mesh = super().stated(error, rings), self.mesh
        level = "spring" if self.model == "spring" else method.level
        return replace(method, level=level, size=mesh.size, contact_size=mesh.contact_size, order=mesh.order)

    def discrete(self, level: AnyLevel) -> Level:
        same_level = next((name for name in DISCRETE if name == level), None)
        if same_level is not None:
            return same_level
        applying = [each.level for each in self.levels() if each.applies]
        return next(name for name in DISCRETE if name in applying)

    def _rod(self, band: float) -> Applicability:
        return Applicability.refused("rod", "only a straight bar struck on its whole end is a rod")

    # Estimates without a mesh

    def patch(self) -> Patch:
        area, width, depth = self.struck_part()
        return bulky(self.material.mean, area, width, depth)

    def sizes(self, method: Method) -> Sizes:
        """Return the element sizes; those left open follow from the shortest shear wave in the band."""
        assert method.bandwidth is not None
        per_wavelength = PER_WAVELENGTH[self.elements_of(method)]
        size = method.size or self.slowest / (per_wavelength * method.bandwidth)
        return Sizes(size, method.contact_size or 0.4 * size)

    def mesh_spec(self, method: Method) -> MeshSpec:
        """Return the mesh of a method."""
        sizes = self.sizes(method)
        return MeshSpec(sizes.size, sizes.contact_size, order=method.order, rings=method.rings or 1)

    def rough_counts(self, spec: MeshSpec, level: Level) -> memory_need.Rough:
        """Return the order of magnitude of the numbers of a mesh, without generating one."""
        area, width, depth = self.struck_part()
        patch = bulky(self.material.mean, area / self.copies.get(level, 1), width, depth)
        return memory_need.rough_counts(spec, level, patch, self.measures_inside(level))

    def measures_inside(self, level: Level) -> float:
        """Return the volume of the modelled part [m^3], or the area of its half section [m^2]."""
        geometry = self.geometry()
        volume = inspect_geometry(geometry).filled if geometry.volume is None else geometry.volume
        return volume / self.copies.get(level, 1)

    def mass(self) -> float:
        return self.material.density * self.measures_inside("3d")

    # Computation

    def solve(self, task: Task) -> Solved:
        return finite_elements.from_geometry(self, task)

    def meshed(self, solved: Solved, method: Method, progress: Progress) -> Solved:
        spec, level = self.mesh_spec(method), self.elements_of(method)
        mesh = finite_elements.draw(self, spec, level, method, progress)
        return finite_elements.with_mesh(self, solved, mesh, method, progress)

    def meshes(
        self, method: Method, progress: Progress
    ) -> tuple[finite_elements.AnyMesh, finite_elements.AnyMesh | None]:
        spec, level = self.mesh_spec(method), self.elements_of(method)
        return finite_elements.draw_both(self, spec, level, Task(method, 0.0, progress=progress))


def struck_as_a_whole(model: str) -> str:
    """Return the reason why a body with this value of the key model has no lip."""
    return f"with model = {model!r} is struck as a whole, not in arcs; remove model, or the key"
