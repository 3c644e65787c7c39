"""The sheet: a flat reed of any outline, by plate elements."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from seatfem.fields import ExistingFile, KeyProblem, Position, Table, Thickness
from seatfem.structures import errors, lands
from seatfem.structures.inspection import outline as outline_faces
from seatfem.structures.inspection.outline import held_edge, outline_in
from seatfem.structures.kinds import plate_loads, selectors
from seatfem.structures.kinds.parts import METRES, LengthUnit
from seatfem.structures.kinds.structure import SampleScene, Traits
from seatfem.structures.kinds.thin_plate import FRONTS
from seatfem.structures.shapes import cad, inspect
from seatfem.structures.shapes.outlined import Outlined
from seatfem.structures.shapes.selectors import Frame

Place = tuple[Position, Position]
DIMENSIONS: Final = 3  # components of a vector in space; a normal with fewer is one in the plane of the sheet
SQUARE: Final = 1e-9  # largest 1 - cos of the angle between parallel normals: 4e-5 rad
SAME: Final = 1e-4  # largest relative difference between the thicknesses in the scene and in the file
CORNERS = [["0 mm", "-4 mm"], ["20 mm", "-4 mm"], ["20 mm", "4 mm"], ["0 mm", "4 mm"]]
HOLE = [["2 mm", "-1 mm"], ["6 mm", "-1 mm"], ["6 mm", "1 mm"], ["2 mm", "1 mm"]]


class Clamp(Table):
    """The clamp holds a straight part of a sheet's outline, the edge of a hole, or all beyond the line n.x = offset."""

    kind: Literal["line"]
    segment: tuple[Place, Place] | None = Field(
        None, description="both ends of a straight part of the outline", examples=[[CORNERS[3], CORNERS[0]]]
    )
    hole: Place | None = Field(
        None,
        description="a point in the hole whose edge is clamped, as where a sheet is screwed on in its middle",
        examples=[["4 mm", "0 mm"]],
    )
    normal: tuple[float, float] | None = Field(None, description="n, towards what is clamped", examples=[[-1.0, 0.0]])
    offset: Position | None = Field(None, description="distance of the line from the origin, along the normal")

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if sum(each is not None for each in (self.segment, self.hole, self.normal)) != 1:
            raise KeyProblem("segment", "give exactly one of segment, hole, and normal with its offset")
        if (self.normal is None) != (self.offset is None):
            raise KeyProblem("offset", "give normal and offset together")
        if self.normal is not None and not any(self.normal):
            raise KeyProblem("normal", "[0, 0] has no direction; give one")
        return self


_checked = lru_cache(maxsize=8)(Outlined)  # cached: checking many corners is slow


class SheetFrame(Table):
    """Where the coordinates of a sheet lie in its STEP file, which may then be drawn in any position."""

    origin: selectors.Place3 = Field(description="x = y = 0", examples=[["0 mm", "0 mm", "6 mm"]])
    along: selectors.Way = Field(description="direction of x in the file", examples=[[1.0, 0.0, 0.0]])
    normal: selectors.Way = Field(description="of the sheet, away from its seat", examples=[[0.0, 0.0, 1.0]])

    @model_validator(mode="after")
    def _not_along_the_normal(self) -> Self:
        try:
            lands.axes_along(self.normal, self.along)
        except errors.ModelError:
            raise KeyProblem("along", "it lies along the normal; give a direction in the plane of the sheet") from None
        return self

    def frame(self) -> Frame:
        """Return the frame with orthonormal axes."""
        x, y, _ = lands.axes_along(self.normal, self.along)
        return Frame(self.origin, inspect.triple(x), inspect.triple(y))


def _as_clamp(given: object) -> object:
    """Read clamped = [p, q] as clamped = { segment = [p, q] }, and add the kind that the keys of a table imply."""
    if isinstance(given, Table) or (isinstance(given, Mapping) and "kind" in given):
        return given
    if not isinstance(given, Mapping):
        return {"kind": "line", "segment": given}
    normal = given.get("normal")
    if "segment" in given or "hole" in given or (isinstance(normal, Sequence) and len(normal) < DIMENSIONS):
        return {"kind": "line", **given}
    meant = selectors.kind_by_keys(given)
    return meant if isinstance(meant, Mapping) and "kind" in meant else {"kind": "line", **given}


AnyClamp = Annotated[
    Clamp
    | selectors.ByColour
    | selectors.ByPlane
    | selectors.ByPoint
    | selectors.ByName
    | selectors.ByNumber
    | selectors.AnyOf,
    Field(discriminator="kind"),
    BeforeValidator(_as_clamp),
]


class OutlinedSheet(plate_loads.ClampedPlate):
    """A flat reed of constant thickness and any outline, of Mindlin plate elements: it twists, and bends across. It is
    clamped along a straight part of the outline, beyond a line or at the edge of a hole, and touches with a disc or a
    ring about a point. A file may give outline and holes: a DXF drawing, or a STEP file with one plane face or a solid
    plate of constant thickness. Coordinates are those of the file. A STEP face must be perpendicular to an axis of the
    file: x and y are the file's own if that axis is z, y and z if it is x, z and x if it is y. For a face in any other
    position `frame` defines x and y. `kind = "plate"` with `outline` or `file` means the same."""

    group: ClassVar[str] = "imported"
    traits: ClassVar[Traits] = replace(plate_loads.ClampedPlate.traits, reed_as_drawn=True)
    about: ClassVar[str] = "contact_at"
    also: ClassVar[Mapping[str, tuple[str, ...]]] = MappingProxyType({"plate": ("outline", "file")})

    sample: ClassVar[str] = """
outline = [["0 mm", "-7 mm"], ["28 mm", "-7 mm"], ["28 mm", "7 mm"], ["0 mm", "7 mm"]]
clamped = [["0 mm", "-7 mm"], ["0 mm", "7 mm"]]
contact_at = ["20 mm", "0 mm"]
thickness = "0.3 mm"
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('release = { mode = 1, velocity = "-2 m/s" }', "annular", FRONTS)

    kind: Literal["sheet"]
    outline: tuple[Place, ...] | None = Field(
        None, description="its corners in order, [x, y] each; or give file", examples=[CORNERS]
    )
    holes: tuple[tuple[Place, ...], ...] = Field(
        (), max_length=100, description="with outline: corners of each hole in order", examples=[[HOLE]]
    )
    file: ExistingFile | None = Field(
        None,
        description="DXF file of closed loops of lines, arcs, polylines, splines and ellipses, in blocks too, or STEP "
        "file of a plane face or a plate; loops within the largest are holes",
    )
    unit: LengthUnit | None = Field(None, description="length unit of a DXF file; absent: as its header says")
    frame: SheetFrame | None = Field(
        None, description="where x and y lie in a STEP file that is drawn in another position; absent: see above"
    )
    thickness: Thickness = Field(
        description="thickness, in the direction of the motion; may be left out where a STEP file holds a solid plate"
    )
    clamped: AnyClamp = Field(
        description="what is clamped; both ends of a straight part of the outline may be written as a list. Of a solid "
        "in a STEP file also a straight side as a face, as in { number = 1 }, or all faces of a round hole, as in "
        "{ numbers = [8, 9] }: `seatfem faces FILE` numbers them"
    )
    contact_at: Place = Field(description="[x, y], where its contact is centred", examples=[["16 mm", "0 mm"]])

    @model_validator(mode="before")
    @classmethod
    def _one_outline(cls, given: object, info: ValidationInfo) -> object:
        if not isinstance(given, Mapping):
            return given
        if ("outline" in given) == ("file" in given):
            raise KeyProblem("outline", "give exactly one of outline and file")
        if "holes" in given and "file" in given:
            raise KeyProblem("holes", "those of a file are its inner loops; remove the key")
        suffix = Path(str(given.get("file", ""))).suffix.lower()
        if "frame" in given and suffix not in cad.STEP_SUFFIXES:
            raise KeyProblem("frame", "only a STEP file is drawn in space; remove the key")
        if "unit" in given and ("file" not in given or suffix in cad.STEP_SUFFIXES):
            raise KeyProblem("unit", "only a DXF file has one; lengths in the scene, and a STEP file, state their own")
        if suffix in cad.STEP_SUFFIXES and "thickness" not in given:
            path = ((info.context or {}).get("folder", Path()) / str(given["file"])).resolve()
            if path.is_file() and (thickness := _drawn(path, 0.0, oblique="frame" in given).thickness):
                return {**given, "thickness": f"{thickness!r} m"}
        return given

    @model_validator(mode="after")
    def _thickness_of_the_file(self) -> Self:
        drawn = 0.0 if self.file is None else self._from_file.thickness
        if drawn and not math.isclose(drawn, self.thickness, rel_tol=SAME):
            raise KeyProblem(
                "thickness",
                f"{1e3 * self.thickness:g} mm, but the plate in {Path(str(self.file)).name} is {1e3 * drawn:g} mm "
                "thick; remove the key, or correct it",
            )
        return self

    @property
    def _from_file(self) -> outline_faces.DrawnOutline:
        assert self.file is not None
        drawn = _drawn(self.file, METRES[self.unit] if self.unit else 0.0, oblique=self.frame is not None)
        if self.frame is None or drawn.frame is None:
            return drawn
        frame = self.frame.frame()
        if abs(abs(float(frame.normal @ drawn.frame.normal)) - 1) > SQUARE:
            words = ", ".join(f"{each:.4g}" for each in drawn.frame.normal + 0.0)
            raise KeyProblem("frame.normal", f"it is not square to the plate in {self.file.name}; take ({words})")
        return drawn.seen_in(frame)

    @property
    def _clamp(self) -> Clamp:
        """Return what is clamped in coordinates [m], also where faces of a file are selected."""
        if isinstance(self.clamped, Clamp):
            return self.clamped
        if self.file is None or (frame := self._from_file.frame) is None:
            raise KeyProblem("clamped", "faces are those of a STEP file; give both ends of a straight part")
        ends = held_edge(self.file, self.clamped.selectors(), frame)
        stated = {"segment": ends} if len(ends) > 1 else {"hole": ends[0]}
        return Clamp.model_construct(kind="line", **stated)

    def geometry(self) -> Outlined:
        held, side = self._clamp, None
        if held.normal is not None and held.offset is not None:
            side = (*held.normal, held.offset)
        stated = (self.thickness, self.contact_at, held.segment, side)
        if self.file is None:
            return _checked(self.outline or (), *stated, self.holes, held.hole)
        drawn = self._from_file
        try:
            return _checked(drawn.outline, *stated, drawn.holes, held.hole)
        except errors.GeometryError as error:
            message = str(error)
            for field in ("outline", "holes"):
                message = message.replace(f"Outlined.{field} = ", f"Outlined.file = {self.file.name}: {field}, ")
            raise errors.GeometryError(message) from error


def _drawn(file: Path, unit: float, *, oblique: bool = False) -> outline_faces.DrawnOutline:
    """Return the outline in a file; raises `KeyProblem`."""
    return selectors.build_in_scene_words(lambda: outline_in(file, unit, oblique=oblique))
