"""The sheet: a flat reed of any outline, by plate elements."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, ClassVar, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from seatfem.fields import ExistingFile, KeyProblem, Length, Position, Table
from seatfem.structures.formats.dxf_outline import read_outline
from seatfem.structures.kinds.parts import METRES, LengthUnit
from seatfem.structures.kinds.plate_loads import ClampedPlate
from seatfem.structures.shapes.outlined import Outlined

Place = tuple[Position, Position]
CORNERS = [["0 mm", "-4 mm"], ["20 mm", "-4 mm"], ["20 mm", "4 mm"], ["0 mm", "4 mm"]]


class Clamp(Table):
    """What is clamped of a sheet: a straight part of its outline, or all that lies beyond the line n.x = offset."""

    segment: tuple[Place, Place] | None = Field(
        None, description="both ends of a straight part of the outline", examples=[[CORNERS[3], CORNERS[0]]]
    )
    normal: tuple[float, float] | None = Field(None, description="n, towards what is clamped", examples=[[-1.0, 0.0]])
    offset: Position | None = Field(None, description="distance of the line from the origin, along the normal")

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.segment is None) == (self.normal is None):
            raise KeyProblem("segment", "give exactly one of segment and normal, with its offset")
        if (self.normal is None) != (self.offset is None):
            raise KeyProblem("offset", "normal and offset belong together")
        if self.normal is not None and not any(self.normal):
            raise KeyProblem("normal", "[0, 0] has no direction")
        return self


_checked = lru_cache(maxsize=8)(Outlined)  # of many corners, the checks take a while


def _as_segment(given: object) -> object:
    """clamped = [p, q] is clamped = { segment = [p, q] }."""
    return given if isinstance(given, Mapping | Table) else {"segment": given}


class OutlinedSheet(ClampedPlate):
    """A flat reed of even thickness and any outline, clamped along a straight part of it or beyond a line; it
    touches with a disc or a ring about a point. By Mindlin plate elements: it twists, and bends across."""

    about: ClassVar[str] = "contact_at"

    kind: Literal["sheet"]
    outline: tuple[Place, ...] | None = Field(
        None, description="its corners in order, [x, y] each; or give file", examples=[CORNERS]
    )
    file: ExistingFile | None = Field(
        None, description="DXF file of one closed loop of lines, arcs and polylines; arcs in chords of 5 degrees"
    )
    unit: LengthUnit | None = Field(None, description="length unit of the file; absent: as its header says")
    clamped: Annotated[Clamp, BeforeValidator(_as_segment)] = Field(
        description="what is clamped; both ends of a straight part of the outline may be written as a list"
    )
    contact_at: Place = Field(description="[x, y], where its contact is centred", examples=[["16 mm", "0 mm"]])
    contact_radius: Length | None = Field(
        None,
        description="radius of the disc that touches, or mean radius of the ring; absent: an eighth of the way from "
        "contact_at to the nearest edge",
    )

    @model_validator(mode="before")
    @classmethod
    def _one_outline(cls, given: object) -> object:
        if isinstance(given, Mapping) and ("outline" in given) == ("file" in given):
            raise KeyProblem("outline", "give exactly one of outline and file")
        if isinstance(given, Mapping) and "unit" in given and "file" not in given:
            raise KeyProblem("unit", "only a file has one; lengths in the scene state their own")
        return given

    @property
    def _metres(self) -> float | None:
        return None if self.unit is None else METRES[self.unit]

    def geometry(self) -> Outlined:
        held, side = self.clamped, None
        if held.normal is not None and held.offset is not None:
            side = (*held.normal, held.offset)
        outline = self.outline if self.file is None else read_outline(self.file, self._metres)
        return _checked(outline or (), self.thickness, self.contact_at, held.segment, side)

    @property
    def usual_radius(self) -> float:
        return self.geometry().room[1] / 8
