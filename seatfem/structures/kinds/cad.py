"""A solid drawn in a CAD program."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Final, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from seatfem.fields import ExistingFile, KeyProblem, default
from seatfem.structures.estimates.patch import Column, Patch, of_shape
from seatfem.structures.inspection.opened import naming
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.kinds.parts import METRES, LengthUnit
from seatfem.structures.kinds.selectors import BLUE_FACES, RED_FACES, ClampSelector, Direction, FaceSelector, Region
from seatfem.structures.kinds.structure import Finding, Traits
from seatfem.structures.shapes import CadPart, GeometryError, Group
from seatfem.structures.shapes.faces import Vector

if TYPE_CHECKING:
    from seatfem.structures.inspection.parts import Part

OTHER_NAMES: Final = {"path": "file"}
"""Keys that are called otherwise in the geometry's specification."""


class Cad(Drawn):
    """A solid drawn in a CAD program, read from a STEP or BREP file. `seatfem faces FILE` numbers its faces."""

    group: ClassVar[str] = "imported"
    has_faces: ClassVar[bool] = True
    traits: ClassVar[Traits] = replace(Drawn.traits, face_as_drawn=True)

    sample: ClassVar[str] = """
file = "seat.step"
"""

    kind: Literal["cad"]
    file: ExistingFile = Field(description="the file, relative to the scene's folder")
    unit: LengthUnit | None = Field(None, description="length unit of the file; a STEP file states its own")
    contact: FaceSelector = Field(
        RED_FACES, description="faces that are struck, as in { number = 11 }; by default those painted pure red"
    )
    fixed: ClampSelector = Field(
        BLUE_FACES, description="faces that are clamped, as in { number = 8 }; by default those painted pure blue"
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
    def _along_some_way(self) -> Self:
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
        )

    @property
    def own_axis(self) -> Vector | None:
        return self.along

    def problems(self) -> Iterator[Finding]:
        from seatfem.structures.inspection.cad import inspect_geometry  # of drawings in files only
        from seatfem.structures.mesh.gmsh_process import MeshingError
        from seatfem.structures.surface_outlines import struck_side_problem

        try:
            inspected = inspect_geometry(self.geometry())
        except (MeshingError, OSError) as error:
            yield ("file",), naming(self.file, str(error))
            return
        alone = len(inspected.problems) == 1
        for field, message in inspected.problems:
            first, *rest = field.split(".", 1)
            key = OTHER_NAMES.get(first, first)
            if key == "unit" and self.unit is None:
                key = "file"
            text = message if alone else _without_list(message, f"seatfem faces {shlex.quote(self.file.name)}")
            yield (key, *rest), naming(self.file, text)
        if inspected.faces:
            yield from self.unknown_names(self.geometry().patches, inspected.regions)
        struck = [face.normal for face in inspected.faces if self.struck_face in face.groups]
        flat = [normal for normal in struck if normal is not None]
        if flat and len(flat) == len(struck) and not inspected.problems:
            sides = np.array(flat), inspected.shape, self.struck_face, self.held, self.bedded
            if why := struck_side_problem(*sides):
                yield ("contact",), naming(self.file, why)

    def part(self) -> Part:
        from seatfem.structures.inspection.parts import of_geometry  # of `seatfem faces` only

        return of_geometry(self.geometry(), self.file.name)

    def patch(self) -> Patch | None:
        """Return the patch as the faces in the file are; raises `GeometryError` without any."""
        from seatfem.structures.inspection.cad import inspect_geometry  # of drawings in files only

        inspected = inspect_geometry(self.geometry())
        if "contact" not in inspected.shape.groups:
            raise GeometryError("\n".join(message for _, message in inspected.problems))
        return of_shape(inspected.shape, self.supports, self.material.mean)

    def column(self) -> Column | None:
        return None


def _without_list(message: str, command: str) -> str:
    """Return the message without its list: where several selectors are wrong, the faces are not listed with each."""
    first, _, more = message.partition("\n")
    return f"{first} {command} shows them" if more else message
