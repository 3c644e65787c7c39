"""Bodies from files of other programs: CAD solids and meshes."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from impact.notices import Progress, silent
from seatfem.fields import ExistingFile, Gap, KeyProblem, default
from seatfem.structures import errors, finite_elements, lands, outlines
from seatfem.structures.formats import mesh_files
from seatfem.structures.inspection import mesh_file
from seatfem.structures.inspection.cad import Part, inspect_geometry, naming, read_once
from seatfem.structures.kinds import drawn, elastic, structure
from seatfem.structures.kinds.parts import METRES, LengthUnit
from seatfem.structures.kinds.selectors import BLUE_FACES, RED_FACES, ClampSelector, Direction, FaceSelector, Region
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.method import Method, Solved, Task
from seatfem.structures.patch import Patch, find_patch
from seatfem.structures.shapes import CadPart, GeometryError, Group
from seatfem.structures.surface_outlines import draw_surface, struck_side_problem

if TYPE_CHECKING:
    from seatfem.structures.mesh.meshing import SeatMesh

OTHER_NAMES: Final = {"path": "file"}
"""Key of the scene by the field of `CadPart`, where their names differ."""


def _solid(given: object) -> object:
    if (isinstance(given, str) and given) or (isinstance(given, int) and given is not True and given > 0):
        return given
    raise ValueError(f"{given!r} is neither a solid's number, from 1, nor its name; `seatfem faces FILE` lists them")


class Cad(drawn.Drawn):
    """A solid drawn in a CAD program, read from a STEP or BREP file. `seatfem faces FILE` numbers its faces."""

    group: ClassVar[str] = "imported"
    has_faces: ClassVar[bool] = True
    traits: ClassVar[structure.Traits] = replace(drawn.Drawn.traits, face_as_drawn=True)

    sample: ClassVar[str] = """
file = "seat.step"
"""

    kind: Literal["cad"]
    file: ExistingFile = Field(description="the file, relative to the scene's folder")
    unit: LengthUnit | None = Field(None, description="length unit of a file that states none, as BREP files do")
    contact: FaceSelector = Field(
        RED_FACES, description="faces that are struck, as in { number = 11 }; by default those painted pure red"
    )
    fixed: ClampSelector = Field(
        BLUE_FACES, description="faces that are clamped, as in { number = 8 }; by default those painted pure blue"
    )
    solid: Annotated[int | str, BeforeValidator(_solid)] | None = Field(
        None,
        description="the only solid of the file that counts, by number or name, as `seatfem faces FILE` lists them; "
        "absent: the one that has the struck face, and those that hang together with it",
        examples=[2],
    )
    along: Direction | None = Field(
        None,
        description="direction in the file that lies along the reed, from its clamp to its tip; absent: the file's x "
        "axis along the struck face, or its y axis where that lies across x",
        examples=[[1.0, 0.0, 0.0]],
    )
    groups: dict[str, FaceSelector] = default({}, "further faces by name, for supports")
    regions: dict[str, Region] = default({}, "solids by name, for materials; the others are solid_1, solid_2, ...")

    @model_validator(mode="after")
    def _check_along(self) -> Self:
        if self.along is not None and not any(self.along):
            raise KeyProblem("along", "[0, 0, 0] has no direction; give one")
        return self

    @property
    def clamped(self) -> bool:
        return self.fixed.kind != "nothing"

    def geometry(self) -> CadPart:
        return CadPart(
            path=self.file,
            unit=None if self.unit is None else METRES[self.unit],
            contact=self.contact.selectors(),
            fixed=self.fixed.selectors(),
            groups=tuple(Group(name, faces.selectors()) for name, faces in self.groups.items()),
            regions=tuple(region.named(name) for name, region in self.regions.items()),
            solid=self.solid,
        )

    @property
    def own_axis(self) -> tuple[float, ...]:
        return self.along or ()

    def problems(self) -> Iterator[structure.Finding]:
        try:
            inspected = inspect_geometry(self.geometry())
        except (MeshingError, OSError) as error:
            yield ("file",), naming(self.file, str(error))
            return
        single = len(inspected.problems) == 1
        for field, message in inspected.problems:
            first, *rest = field.split(".", 1)
            key = OTHER_NAMES.get(first, first)
            if key == "unit" and self.unit is None:
                key = "file"
            first_line, _, faces = message.partition("\n")
            if faces and not single:  # only a single message lists all faces
                message = f"{first_line} seatfem faces {shlex.quote(self.file.name)} shows them"
            yield (key, *rest), naming(self.file, message)
        if inspected.faces:
            yield from self.unknown_names(self.geometry().patches, inspected.regions)
        struck = [face.normal for face in inspected.faces if self.struck_face in face.groups]
        flat = [normal for normal in struck if normal is not None]
        if flat and len(flat) == len(struck) and not inspected.problems:
            sides = np.array(flat), inspected.shape, self.struck_face, self.held, self.bedded
            if why := struck_side_problem(*sides):
                yield ("contact",), naming(self.file, why)

    def part(self) -> Part:
        return mesh_file.describe_geometry(self.geometry(), self.file.name)

    def rise(self) -> tuple[float, float]:
        return inspect_geometry(self.geometry()).shape.rise(self.struck_face)

    def counted(self) -> str:
        inspected = inspect_geometry(self.geometry())
        numbers = [str(solid.number) for solid in inspected.solids]
        return "" if len(numbers) == inspected.in_file else f"solid {', '.join(numbers)} of {inspected.in_file} alone"

    def patch(self) -> Patch:
        """Return the patch by the contact faces in the file; raises `GeometryError` if there are none."""
        inspected = inspect_geometry(self.geometry())
        if "contact" not in inspected.shape.groups:
            raise GeometryError("\n".join(message for _, message in inspected.problems))
        return find_patch(inspected.shape, self.supports, self.material.mean)

    def struck_part(self) -> tuple[float, float, float]:
        patch = self.patch()
        return patch.area, patch.width, patch.depth


FLAT: Final = 0.01  # largest scatter of the unit normals of a flat face: coordinates have few digits


class MeshFile(elastic.Elastic):
    """A mesh made elsewhere, with named surface groups."""

    group: ClassVar[str] = "imported"
    has_faces: ClassVar[bool] = True

    sample: ClassVar[str] = """
file = "seat.msh"
"""

    kind: Literal["mesh"]
    file: ExistingFile = Field(description="the mesh file, relative to the scene's folder")
    unit: LengthUnit | None = Field(
        None, description="length unit of the file; absent: as a universal file states, otherwise m"
    )
    contact: str = Field("contact", description="name of the surface group that is struck")
    fixed: str = Field("fixed", description="name of the surface group that is clamped; empty for a free body")
    merge: Gap | None = Field(
        None, description="nodes nearer than this become one; 0 mm keeps all; absent: coincident nodes are an error"
    )
    parts: int = Field(1, strict=True, ge=1, description="number of parts that share no node")

    @property
    def clamped(self) -> bool:
        return bool(self.fixed)

    def read(self, progress: Progress = silent) -> SeatMesh:
        """Return the mesh in the file, cached while the file and those it includes are unchanged."""
        names = {"contact": self.contact, "fixed": self.fixed or None, "parts": self.parts}
        unit = None if self.unit is None else METRES[self.unit]
        progress("meshing", 0.0)
        others = mesh_files.all_files(self.file)
        mesh = read_once(mesh_files.read_mesh, (str(self.file),), *others, **names, unit=unit, merge=self.merge)
        progress("meshing", 1.0)
        return mesh

    def problems(self) -> Iterator[structure.Finding]:
        try:
            mesh = self.read()
        except errors.MeshError as error:
            for field, message in error.problems:
                yield (field or "file",), naming(self.file, message)
        except (MeshingError, OSError) as error:
            yield ("file",), naming(self.file, str(error))
        else:
            yield from self.unknown_names(mesh.mesh.boundaries or {}, mesh_file.regions_of(mesh))
            shape = mesh_file.shape_of(mesh)
            normals = shape.normals[shape.groups[self.struck_face]]
            if why := struck_side_problem(normals, shape, self.struck_face, self.held, self.bedded):
                yield ("contact",), naming(self.file, why)

    def part(self) -> Part:
        return mesh_file.describe_mesh(self.file.name, self.read(), ())

    def rise(self) -> tuple[float, float]:
        return mesh_file.shape_of(self.read()).rise(self.struck_face)

    def file_notes(self) -> tuple[str, ...]:
        return self.read().provenance.notes

    def patch(self) -> Patch:
        return find_patch(mesh_file.shape_of(self.read()), self.supports, self.material.mean)

    def views(self, *, coarse: bool = False) -> outlines.BodyViews:
        shape = mesh_file.shape_of(self.read())
        normals = shape.normals[shape.groups[self.struck_face]]
        normal = normals[0] if np.abs(normals - normals[0]).max() < FLAT else None
        rows = () if coarse else mesh_file.faces_of(shape)[1]
        return draw_surface("mesh", shape, rows, self.struck_face, normal, self.held, self.bedded)

    def land(self) -> lands.Land:
        return mesh_file.land_of_mesh(self.read(), self.struck_face)

    def mass(self) -> float:
        return self.material.density * self.read().quality.volume

    def solve(self, task: Task) -> Solved:
        with task.watch("mesh"):
            mesh = self.read(task.progress)
        return finite_elements.from_mesh(self, mesh, task)

    def meshed(self, solved: Solved, method: Method, progress: Progress) -> Solved:
        return finite_elements.with_mesh(self, solved, self.read(progress), method, progress)

    def meshes(
        self, method: Method, progress: Progress
    ) -> tuple[finite_elements.AnyMesh, finite_elements.AnyMesh | None]:
        return self.read(progress), None
