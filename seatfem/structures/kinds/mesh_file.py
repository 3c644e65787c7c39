"""A mesh made elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Final, Literal

import numpy as np
from pydantic import Field

from impact.progress import Progress, silent
from seatfem.fields import ExistingFile, Gap
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.estimates.patch import Patch, of_shape
from seatfem.structures.inspection.opened import FileState, naming, state_of
from seatfem.structures.kinds.elastic import Elastic
from seatfem.structures.kinds.parts import METRES, LengthUnit
from seatfem.structures.kinds.structure import Finding
from seatfem.structures.method import Method
from seatfem.structures.outlines import BodyViews
from seatfem.structures.solved import Solved

if TYPE_CHECKING:
    from seatfem.structures.discretise import AnyMesh
    from seatfem.structures.estimates.costs import Numbers
    from seatfem.structures.inspection.parts import Part
    from seatfem.structures.lands import Land
    from seatfem.structures.mesh.meshing import SeatMesh
    from seatfem.structures.natural_modes import NaturalModes, Wanted

FLAT: Final = 0.01  # of unit normals, by coordinates of few digits: a face is flat

# Readers of meshes take half a second to load: each is imported by the function that needs it.


class MeshFile(Elastic):
    """A mesh made elsewhere, with named surface groups."""

    group: ClassVar[str] = "imported"
    has_faces: ClassVar[bool] = True

    sample: ClassVar[str] = """
file = "seat.msh"
"""

    kind: Literal["mesh"]
    file: ExistingFile = Field(description="the mesh file, relative to the scene's folder")
    unit: LengthUnit = Field("m", description="length unit of the file")
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
        """Return the mesh in the file; it is read once, as long as the file and all it includes stay."""
        from seatfem.structures.formats.meshio_files import all_files

        states = tuple(state_of(part) for part in all_files(self.file))
        progress("meshing", 0.0)
        mesh = _read(self.file, self.contact, self.fixed or None, METRES[self.unit], self.merge, self.parts, states)
        progress("meshing", 1.0)
        return mesh

    def problems(self) -> Iterator[Finding]:
        from seatfem.structures.inspection.mesh_file import regions_of
        from seatfem.structures.mesh.gmsh_process import MeshingError
        from seatfem.structures.mesh.io import MeshError
        from seatfem.structures.surface_outlines import struck_side_problem

        try:
            mesh = self.read()
        except MeshError as error:
            for field, message in error.problems:
                yield (field or "file",), naming(self.file, message)
        except (MeshingError, OSError) as error:
            yield ("file",), naming(self.file, str(error))
        else:
            yield from self.unknown_names(mesh.mesh.boundaries or {}, regions_of(mesh))
            from seatfem.structures.inspection.mesh_file import shape_of

            shape = shape_of(mesh)
            normals = shape.normals[shape.groups[self.struck_face]]
            if why := struck_side_problem(normals, shape, self.struck_face, self.held, self.bedded):
                yield ("contact",), naming(self.file, why)

    def part(self) -> Part:
        from seatfem.structures.inspection.parts import of_mesh

        return of_mesh(self.file.name, self.read(), ())

    def patch(self) -> Patch | None:
        from seatfem.structures.inspection.mesh_file import shape_of

        return of_shape(shape_of(self.read()), self.supports, self.material.mean)

    def views(self, at: float | None = None, *, coarse: bool = False) -> BodyViews:
        from seatfem.structures.inspection.mesh_file import faces_of, shape_of
        from seatfem.structures.surface_outlines import Surface, of_surface

        shape = shape_of(self.read())
        normals = shape.normals[shape.groups[self.struck_face]]
        normal = normals[0] if np.abs(normals - normals[0]).max() < FLAT else None
        rows = () if coarse else faces_of(shape)[1]
        return of_surface("mesh", Surface(shape, rows, self.struck_face, normal, self.held, self.bedded))

    def land(self) -> Land:
        from seatfem.structures.inspection.mesh_file import land_of_mesh

        return land_of_mesh(self.read(), self.struck_face)

    def mass(self) -> float:
        return self.material.density * self.read().quality.volume

    def numbers(self, method: Method, coarser: float = 1.0) -> Numbers | None:
        from seatfem.structures.estimates.costs import numbers_of_mesh

        return numbers_of_mesh(self.read(), self.slowest, method)

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: Progress, *, mesh_error: bool = True
    ) -> Solved:
        from seatfem.structures.finite_elements import from_mesh

        with watch("mesh"):
            mesh = self.read(progress)
        return from_mesh(self, mesh, method, duration, watch, progress)

    def meshes(self, method: Method, progress: Progress) -> tuple[AnyMesh, AnyMesh | None]:
        return self.read(progress), None

    def natural_modes(self, wanted: Wanted, watch: Stopwatch, progress: Progress) -> NaturalModes | None:
        from seatfem.structures.natural_modes import of_mesh

        with watch("mesh"):
            mesh = self.read(progress)
        return of_mesh(self, mesh, wanted, watch, progress)


@lru_cache(maxsize=2)
def _read(
    file: Path,
    contact: str,
    fixed: str | None,
    unit: float,
    merge: float | None,
    parts: int,
    states: tuple[FileState, ...],
) -> SeatMesh:
    from seatfem.structures.formats.mesh_files import read_mesh

    del states  # part of the key
    return read_mesh(file, contact=contact, fixed=fixed, unit=unit, merge=merge, parts=parts)
