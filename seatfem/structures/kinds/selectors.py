"""Tables of scenes that select faces and solids of a CAD file; a new selector is a class and its name in `_Simple`."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Annotated, ClassVar, Final, Literal, Self, TypeVar

from annotated_types import Ge, Le
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from seatfem.fields import Angle, Gap, KeyProblem, Length, Position, Table, build_from_fields, default
from seatfem.structures.shapes import (
    CONTACT_COLOUR,
    FIXED_COLOUR,
    ColourFace,
    ConeFace,
    CylinderFace,
    GeometryError,
    NamedFace,
    NumberedFace,
    PlaneFace,
    PointFace,
    Selector,
)
from seatfem.structures.shapes import Region as SolidRegion

_Spec = TypeVar("_Spec")
_Channel = Annotated[int, Ge(0), Le(255)]
_Colour = tuple[_Channel, _Channel, _Channel]
Direction = tuple[float, float, float]
Place3 = tuple[Position, Position, Position]
_ORIGIN = ("0 mm", "0 mm", "0 mm")
_PLACE = ("12 mm", "0 mm", "8 mm")
_UP = (0.0, 0.0, 1.0)


def _some_way(value: Direction) -> Direction:
    if not any(value):
        raise ValueError("[0, 0, 0] has no direction; give one")
    return value


Way = Annotated[Direction, AfterValidator(_some_way)]
"""A direction that is not zero."""


def build_in_scene_words(build: Callable[[], _Spec]) -> _Spec:
    """Return the result of ``build``, with a `GeometryError` about a field turned into a `KeyProblem` of that key."""
    try:
        return build()
    except GeometryError as error:
        if error.field:
            raise KeyProblem(error.field, str(error)) from error
        if field := re.match(r"\w+\.(\w+) = (.*)", str(error), re.DOTALL):
            raise KeyProblem(field[1], field[2]) from error
        raise


class FaceChoice(Table):
    """Base of all selectors."""

    face: ClassVar[type[Selector]]
    """Selector of `seatfem.structures.shapes` with the same keys."""

    def selectors(self) -> tuple[Selector, ...]:
        """Return selectors whose union is chosen. Raises `GeometryError` for one that can select nothing."""
        return (build_from_fields(self.face, self),)

    @model_validator(mode="after")
    def _can_select(self) -> Self:
        build_in_scene_words(self.selectors)
        return self


class ByColour(FaceChoice):
    """The faces painted in one colour in the CAD program."""

    kind: Literal["colour"]
    colour: _Colour = Field(description="red, green, blue, each 0 to 255", examples=[[255, 0, 0]])

    def selectors(self) -> tuple[Selector, ...]:
        return (ColourFace((*self.colour, 255)),)


class ByPlane(FaceChoice):
    """The flat face with a given outward normal n in the plane n.x = offset."""

    face: ClassVar[type[Selector]] = PlaneFace

    kind: Literal["plane"]
    normal: Direction = Field(description="outward normal of the face", examples=[_UP])
    offset: Position = Field(description="distance of the plane from the origin, along the normal")
    radius_min: Gap = default("0 mm", "keep faces at least this far from the axis along the normal")
    radius_max: Length | None = Field(None, description="keep faces at most this far from that axis")
    axis_point: Place3 = default(_ORIGIN, "a point on that axis", _PLACE)
    several: bool = Field(False, strict=True, description="take faces that do not touch each other")


class ByCylinder(FaceChoice):
    """The cylindrical face of a radius; without axis and axis_point about any line, rather about the z axis."""

    face: ClassVar[type[Selector]] = CylinderFace

    kind: Literal["cylinder"]
    radius: Length = Field(description="of the cylinder")
    axis: Direction | None = Field(None, description="direction of the axis", examples=[_UP])
    axis_point: Place3 | None = default(None, "a point on the axis", _PLACE)
    several: bool = Field(False, strict=True, description="take faces that do not touch each other")


class ByCone(FaceChoice):
    """The conical face of a half angle about an axis."""

    face: ClassVar[type[Selector]] = ConeFace

    kind: Literal["cone"]
    half_angle: Angle = Field(description="between the cone's generators and the axis")
    axis: Direction = Field(_UP, description="direction of the axis", examples=[_UP])
    axis_point: Place3 = default(_ORIGIN, "a point on the axis", _PLACE)
    radius_min: Gap = default("0 mm", "keep faces at least this far from the axis")
    radius_max: Length | None = Field(None, description="keep faces at most this far from the axis")
    several: bool = Field(False, strict=True, description="take faces that do not touch each other")


class ByPoint(FaceChoice):
    """The one face that a point lies on."""

    face: ClassVar[type[Selector]] = PointFace

    kind: Literal["point"]
    point: Place3 = Field(description="a point inside the face, not on its edge", examples=[_PLACE])


class ByName(FaceChoice):
    """The faces that the CAD file gives a name."""

    face: ClassVar[type[Selector]] = NamedFace

    kind: Literal["name"]
    name: str = Field(description="of the faces")


class ByNumber(FaceChoice):
    """Faces by number, as `seatfem faces` shows them: their order in the file, valid until the file changes."""

    sample: ClassVar[str] = "number = 1"

    kind: Literal["number"]
    number: int | None = Field(None, strict=True, ge=1, description="of the face; or give numbers")
    numbers: tuple[Annotated[int, Ge(1)], ...] | None = Field(None, min_length=1, description="of several faces")

    @model_validator(mode="after")
    def _one_key(self) -> Self:
        if (self.number is None) == (self.numbers is None):
            raise ValueError("give exactly one of number and numbers")
        return self

    def selectors(self) -> tuple[Selector, ...]:
        numbers = self.numbers if self.number is None else (self.number,)
        return (NumberedFace(numbers or ()),)


class Nothing(FaceChoice):
    """No face: a body without a clamp, free or held by supports."""

    kind: Literal["nothing"]

    def selectors(self) -> tuple[Selector, ...]:
        return ()


def kind_by_keys(given: object) -> object:
    """Read { number = 7 } as { kind = "number", number = 7 }: a key that only one kind has implies that kind."""
    if isinstance(given, Mapping) and "kind" not in given:
        kind = next((kind for key, kind in _KIND_BY_KEY.items() if key in given), None)
        return given if kind is None else {"kind": kind, **given}
    return given


_KIND_BY_KEY: Final[Mapping[str, str]] = {
    "number": "number", "numbers": "number", "colour": "colour", "normal": "plane", "radius": "cylinder",
    "half_angle": "cone", "point": "point", "name": "name", "of": "union",
}  # fmt: skip
"""Keys that only one kind of selector has, and that kind."""

_Simple = ByColour | ByPlane | ByCylinder | ByCone | ByPoint | ByName | ByNumber
SimpleSelector = Annotated[_Simple, Field(discriminator="kind"), BeforeValidator(kind_by_keys)]


class AnyOf(FaceChoice):
    """All faces that match at least one of several selectors."""

    kind: Literal["union"]
    of: tuple[SimpleSelector, ...] = Field(min_length=1, description="the selectors")

    def selectors(self) -> tuple[Selector, ...]:
        return tuple(selector for choice in self.of for selector in choice.selectors())


FaceSelector = Annotated[_Simple | AnyOf, Field(discriminator="kind"), BeforeValidator(kind_by_keys)]
ClampSelector = Annotated[_Simple | AnyOf | Nothing, Field(discriminator="kind"), BeforeValidator(kind_by_keys)]
RED_FACES = ByColour(kind="colour", colour=CONTACT_COLOUR[:3])
BLUE_FACES = ByColour(kind="colour", colour=FIXED_COLOUR[:3])


class Region(Table):
    """Solids of a CAD file, by exactly one of their keys: the region that a material of that name is given to."""

    order: int | None = Field(None, strict=True, ge=1, description="the solid's place in the file, from 1")
    colour: _Colour | None = Field(None, description="red, green, blue, each 0 to 255", examples=[[255, 170, 0]])
    solid: str | None = Field(None, description="the solid's name in the file")

    @model_validator(mode="after")
    def _one_key(self) -> Self:
        if sum(key is not None for key in (self.order, self.colour, self.solid)) != 1:
            raise ValueError("give exactly one of order, colour and solid")
        return self

    def named(self, name: str) -> SolidRegion:
        return SolidRegion(name, self.order or 0, (*self.colour, 255) if self.colour else (), self.solid or "")
