"""Interface of every geometry: faces, building in gmsh, division into sectors; checks of its fields."""

from __future__ import annotations

import hashlib
import math
import sys
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import Field, dataclass, fields
from dataclasses import field as new_field
from importlib.util import module_from_spec, spec_from_file_location
from operator import attrgetter
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, Final, Literal

from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes.profile import Profile
from seatfem.structures.shapes.selectors import HalfPlaneFace, Patches
from seatfem.units import parse_quantity, write_quantity

_ELSEWHERE: Final = "seatfem_shapes_of_"


def home_of(spec: type[Any]) -> list[str]:
    """Return file and name of a class of another package.

    Raises:
        GeometryError: the gmsh process cannot import it: it is in no file or in a function, or its file is just being
            imported by that process.
    """
    file, name = getattr(sys.modules.get(spec.__module__), "__file__", None), spec.__qualname__
    if not file:
        raise GeometryError(f"the shape {name!r} is in no file, where gmsh's process could find it: write it into one")
    if "<locals>" in name:
        raise GeometryError(f"{file}: the shape {name} is made by a function; define it at the top of the file")
    if spec.__module__.startswith(_ELSEWHERE):
        raise GeometryError(
            f"{file} is read for its shape {name}, and would mesh it meanwhile: put what it does, besides defining, "
            'under if __name__ == "__main__":'
        )
    return [str(Path(file).resolve()), name]


def load_from_home(file: str, name: str) -> type[Any]:
    """Return the class of this name from a file, which is executed once in the process under a private module name."""
    private = _ELSEWHERE + hashlib.sha256(file.encode()).hexdigest()[:16]
    kind: type[Any] = attrgetter(name)(sys.modules.get(private) or _run(file, private))
    return kind


def _run(file: str, name: str) -> ModuleType:
    """Return a file as a module of this name; its folder is last on the import path meanwhile."""
    spec = spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    sys.modules[name] = module = module_from_spec(spec)
    sys.path.append(str(Path(file).parent))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.pop()
    return module


@dataclass(frozen=True)
class Key:
    """Metadata of a field of a shape that is also a key of scenes.

    Attributes:
        description: text for the documentation.
        reads: "length" > 0, "gap" >= 0, both in metres, or "angle" in radians.
        written: default as text of a scene; ``None``: the key is required, or absent means `None`.
    """

    description: str
    reads: Literal["length", "gap", "angle"]
    written: str | None


def key(
    description: str, default: float | str | None = math.nan, reads: Literal["length", "gap", "angle"] = "length"
) -> Any:
    """Return a dataclass field with `Key` metadata.

    ``default``: text of a scene, such as "0.5 mm"; a number is a default in Python only; nan: no default.
    """
    written = default if isinstance(default, str) else None
    value = parse_quantity(written, "angle" if reads == "angle" else "length") if written is not None else default
    metadata = {"key": Key(description, reads, written)}
    return new_field(metadata=metadata) if value != value else new_field(default=value, metadata=metadata)


def require_positive(spec: object, *names: str) -> None:
    """Raise `GeometryError` unless every named field of ``spec`` is a finite length > 0 (in metres)."""
    for name in names:
        value = getattr(spec, name)
        if not (math.isfinite(value) and value > 0.0):
            raise _refusal(spec, name, "a finite length > 0")


def require_below(spec: object, name: str, limit: float, meaning: str, *, inclusive: bool = False) -> None:
    """Raise `GeometryError` unless the field is below ``limit`` (metres), which ``meaning`` explains."""
    value = getattr(spec, name)
    if not (value <= limit if inclusive else value < limit):
        raise _refusal(spec, name, f"{'<=' if inclusive else '<'} {write_quantity(limit, 'length')} ({meaning})")


def require_above(spec: object, name: str, limit: float, meaning: str) -> None:
    """Raise `GeometryError` unless the field is above ``limit`` (metres), which ``meaning`` explains."""
    if not getattr(spec, name) > limit:
        raise _refusal(spec, name, f"> {write_quantity(limit, 'length')} ({meaning})")


def _refusal(spec: object, name: str, what: str) -> GeometryError:
    value = write_quantity(getattr(spec, name), "length")
    return GeometryError(f"{type(spec).__name__}.{name} = {value}: must be {what}")


@dataclass(frozen=True)
class Cuboid:
    """A rectangular solid on z = 0 about the z axis: half its sides along x and y, its height, and half the sides of
    the patch on its top; ``None``: the patch is the whole top [m]."""

    sides: tuple[float, float]
    height: float
    patch: tuple[float, float] | None = None


class Shape(ABC):
    """A geometry in SI units: a frozen dataclass that checks itself.

    A family of shapes is a subclass with a name ``family``. Its method `build` runs in the gmsh process, with the
    OpenCASCADE part of a gmsh model, in millimetres. A solid of revolution is a `Turning`.
    """

    family: ClassVar[str]

    def __init_subclass__(cls) -> None:
        """Add the descriptions of fields with `Key` metadata to the docstring."""
        keys = {name: each for name, each in vars(cls).items() if isinstance(each, Field) and each.metadata}
        said = [f"        {name}: {each.metadata['key'].description}." for name, each in keys.items()]
        if said:
            cls.__doc__ = "\n".join([(cls.__doc__ or "").rstrip(), "", "    Attributes:", *said, "    "])

    def __post_init__(self) -> None:
        """Raise `GeometryError` unless each length among its keys is positive, and each gap zero or positive."""
        for field in fields(self):  # type: ignore[arg-type]
            value, reads = getattr(self, field.name), getattr(field.metadata.get("key"), "reads", "")
            if value is not None and (reads == "length" or (reads == "gap" and value != 0.0)):
                require_positive(self, field.name)

    @property
    @abstractmethod
    def patches(self) -> Patches:
        """Return the selectors of the faces of each group, "contact" and "fixed" among them."""

    @abstractmethod
    def build(self, occ: Any) -> None:
        """Build the solid in the given gmsh OpenCASCADE model."""

    @property
    def source(self) -> str:
        """Return the name of the class or file, for messages."""
        return type(self).__name__

    @property
    def unit_of_model(self) -> float:
        """Return metres per length unit of the gmsh model by `build`."""
        return 1e-3

    @property
    def profile(self) -> Profile | None:
        """Return the half section of a solid of revolution; ``None`` for other solids."""
        return None

    @property
    def cuboid(self) -> Cuboid | None:
        """Return a rectangular solid's measures; ``None`` for other solids."""
        return None

    @property
    def volume(self) -> float | None:
        """Return the volume [m^3]; ``None`` if it is known only after building the solid."""
        if self.profile is not None:
            return self.profile.volume
        return None if self.cuboid is None else 4 * math.prod(self.cuboid.sides) * self.cuboid.height

    def check_sectors(self, sectors: int) -> None:
        """Raise `GeometryError` if it is known not to consist of ``sectors`` >= 2 equal sectors between planes."""
        if self.cuboid is not None and sectors not in (2, 4):
            raise GeometryError(
                f"sector = {sectors}: must be 2 or 4, the equal sectors of a {type(self).__name__} between planes of "
                "symmetry"
            )

    def patches_in(self, sectors: int) -> Patches:
        """Return the groups in the first of that many equal sectors."""
        return self.patches


def families(base: type[Shape] = Shape) -> Iterator[type[Shape]]:
    """Yield all subclasses with a name ``family``."""
    for each in base.__subclasses__():
        if "family" in vars(each):
            yield each
        yield from families(each)


REACH = 8.0  # size of the cutting wedge, over that of the solids


def check_sectors(shape: Shape, sectors: int) -> None:
    """Raise `GeometryError` if the shape is known not to consist of that many equal sectors between symmetry planes."""
    if sectors < 1:
        raise GeometryError(f"sector = {sectors}: must be >= 1 (1: the whole {type(shape).__name__})")
    if sectors > 1:
        shape.check_sectors(sectors)


def patches_in(shape: Shape, sectors: int) -> Patches:
    """Return the groups of one sector: those of the whole, and the cut faces "symmetry_0" and "symmetry_1"."""
    if sectors == 1:
        return shape.patches
    cuts: Patches = {"symmetry_0": (HalfPlaneFace(0.0),), "symmetry_1": (HalfPlaneFace(2 * math.pi / sectors),)}
    return shape.patches_in(sectors) | cuts


def cut(occ: Any, dimension: int, sectors: int) -> list[list[tuple[int, int]]]:
    """Keep one sector of all solids (``dimension`` 3) or surfaces at z = 0 (2); return the pieces of each, in order."""
    whole = occ.getEntities(dimension)
    bounds = [occ.getBoundingBox(*entity) for entity in whole]
    size = REACH * max(abs(value) for box in bounds for value in box)
    wedge = _wedge(occ, sectors, size, -size if dimension == 3 else 0.0)
    tool = (2, wedge)
    if dimension == 3:
        tool = next(entity for entity in occ.extrude([tool], 0, 0, 2 * size) if entity[0] == 3)
    _, pieces = occ.intersect(whole, [tool])
    if dimension == 3:
        occ.remove([(2, wedge)], recursive=True)
    if sectors > 2:
        return [list(piece) for piece in pieces[: len(whole)]]
    # Both cut faces of a half lie in one plane: faces across the axis are split there.
    kept = occ.getEntities(dimension)
    middle = occ.addPoint(0, 0, 0)
    axis = (0, middle) if dimension == 2 else (1, occ.addLine(occ.addPoint(0, 0, -size), occ.addPoint(0, 0, size)))
    _, split = occ.fragment(kept, [axis])
    after = dict(zip(kept, split[: len(kept)], strict=True))
    return [[new for old in piece for new in after[old]] for piece in pieces[: len(whole)]]


def _wedge(occ: Any, sectors: int, size: float, z: float) -> int:
    if sectors == 2:
        return int(occ.addRectangle(-size, 0, z, 2 * size, size))
    angle = 2 * math.pi / sectors
    corners = [(0.0, 0.0), (size, 0.0), (size * math.cos(angle), size * math.sin(angle))]
    points = [occ.addPoint(x, y, z) for x, y in corners]
    lines = [occ.addLine(points[k - 1], points[k]) for k in range(3)]
    return int(occ.addPlaneSurface([occ.addCurveLoop(lines)]))
