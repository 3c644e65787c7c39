"""What every geometry answers: faces, recipe, how it may be cut, swept and sampled; checks of its fields."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes.profile import Profile
from seatfem.structures.shapes.selectors import Patches

EVERYWHERE = ""
"""The area that is the whole plan."""
Array = NDArray[np.float64]
PlanSamples = tuple[Array, Array, Array, Array, Callable[[Array], Array]]
"""Points (n, 2) of a plan, the area around each, points of its outline, the length around each, and the distance of any
points from the struck area, negative inside [m, m^2]."""


def require_positive(spec: object, *fields: str) -> None:
    """Raise `GeometryError` unless every named field of ``spec`` is a finite length > 0 (in metres)."""
    for field in fields:
        value = getattr(spec, field)
        if not (math.isfinite(value) and value > 0.0):
            raise GeometryError(f"{type(spec).__name__}.{field} = {value:g} m: must be a finite length > 0")


def require_below(spec: object, field: str, limit: float, meaning: str, *, inclusive: bool = False) -> None:
    """Raise `GeometryError` unless ``spec.field`` is below ``limit`` (metres), which ``meaning`` explains."""
    value = getattr(spec, field)
    if not (value < limit or (inclusive and value == limit)):
        sign = "<=" if inclusive else "<"
        raise GeometryError(f"{type(spec).__name__}.{field} = {value:g} m: must be {sign} {limit:g} m ({meaning})")


def require_above(spec: object, field: str, limit: float, meaning: str) -> None:
    """Raise `GeometryError` unless ``spec.field`` is above ``limit`` (metres), which ``meaning`` explains."""
    value = getattr(spec, field)
    if not value > limit:
        raise GeometryError(f"{type(spec).__name__}.{field} = {value:g} m: must be > {limit:g} m ({meaning})")


def check_quarters(shape: object, sectors: int) -> None:
    """Raise `GeometryError` of a rectangular solid that is cut into other sectors than halves and quarters."""
    if sectors not in (2, 4):
        name = type(shape).__name__
        raise GeometryError(f"sector = {sectors}: a {name} has 2 or 4 equal sectors between planes of symmetry")


@dataclass(frozen=True)
class Plan:
    """``height``: of the solid above z = 0 (metres). ``top``, ``bottom``: group -> names of areas of the plan."""

    height: float
    top: Mapping[str, tuple[str, ...]]
    bottom: Mapping[str, tuple[str, ...]]

    @property
    def areas(self) -> tuple[str, ...]:
        """Names of all areas but the whole."""
        groups = (*self.top.values(), *self.bottom.values())
        return tuple(dict.fromkeys(area for names in groups for area in names if area != EVERYWHERE))


@dataclass(frozen=True)
class Rectangle:
    """A plan centred on the origin: half its sides along x and y, and those of the patch; ``None``: all is struck."""

    sides: tuple[float, float]
    patch: tuple[float, float] | None = None


class Shape(ABC):
    """A geometry in SI units: a frozen dataclass that checks itself.

    A family is a subclass with a ``family`` of its own, in one file. The gmsh process finds it there: recipes receive
    the OpenCASCADE part of a gmsh model and work in millimetres, as CAD does. A solid of revolution is a `Turning`.
    """

    family: ClassVar[str]

    @property
    @abstractmethod
    def patches(self) -> Patches:
        """Selectors of the faces of each group, "contact" and "fixed" among them."""

    @abstractmethod
    def build(self, occ: Any) -> None:
        """Build the solid in the given gmsh OpenCASCADE model."""

    @property
    def source(self) -> str:
        """Where it comes from, for messages."""
        return type(self).__name__

    @property
    def is_imported(self) -> bool:
        """Whether its solids come from a file, and are known once that is read."""
        return False

    @property
    def unit_of_model(self) -> float:
        """Metres per length unit of the gmsh model that its recipe builds."""
        return 1e-3

    @property
    def profile(self) -> Profile | None:
        """The half section of a solid of revolution."""
        return None

    @property
    def plan(self) -> Plan | None:
        """Of a solid that is extruded along z: it can be meshed by hexahedra."""
        return None

    @property
    def rectangle(self) -> Rectangle | None:
        """The plan, where it is a rectangle: a grid that needs no mesher."""
        return None

    def areas(self, occ: Any) -> dict[str, list[int]]:
        """The plan (millimetres), split into its areas, in the given gmsh OpenCASCADE model: their surface tags."""
        raise NotImplementedError

    def plan_samples(self) -> PlanSamples:
        """The plan, for counts of elements."""
        raise NotImplementedError

    @property
    def dome(self) -> Callable[[Array], Array] | None:
        """Height of the upper side at points (n, 2) of the plan; ``None``: flat."""
        return None

    def check_sectors(self, sectors: int) -> None:  # noqa: B027 - most have nothing to say
        """Raise `GeometryError` where it is known not to be that many equal sectors, 2 and more, between planes."""

    def patches_in(self, sectors: int) -> Patches:
        """The groups in the first of that many equal sectors."""
        return self.patches


def families(base: type[Shape] = Shape) -> Iterator[type[Shape]]:
    """Every family that there is."""
    for each in base.__subclasses__():
        if "family" in vars(each):
            yield each
        yield from families(each)
