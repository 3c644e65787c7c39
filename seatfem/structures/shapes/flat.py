"""Sheets of even thickness, the plans of plates."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from seatfem.structures.shapes import loops
from seatfem.structures.shapes.selectors import Patches, PlaneFace
from seatfem.structures.shapes.shape import Plan, Shape

THINNER: Final = 'a sheet is thinner than it is wide; a solid reed is kind = "cad" or "mesh"'


class Flat(Shape):
    """A sheet with its underside at z = 0 (metres): a frozen dataclass with a ``thickness`` among its fields.

    The group "contact" is the upper side.
    """

    thickness: float

    @property
    @abstractmethod
    def centre(self) -> tuple[float, float]:
        """Return the centre of what touches [m]."""

    @property
    @abstractmethod
    def room(self) -> tuple[float, float]:
        """Return the radii of the smallest and the largest circle about the centre that lie on it [m]; 0: no hole is
        there."""

    @property
    def length(self) -> float:
        """Return the largest x of the outline [m]."""
        return self.centre[0] + self.room[1]

    @property
    @abstractmethod
    def area(self) -> float:
        """Return the area of the outline [m^2]."""

    @property
    @abstractmethod
    def narrowest(self) -> float:
        """Return the width of the narrowest part that bends [m]."""

    @property
    def is_mirrored(self) -> bool:
        """Return whether the line y = 0 mirrors it exactly, with all that is clamped: one half is meshed then."""
        return False

    @property
    def is_clamped(self) -> bool:
        """Return whether a part of the outline is clamped."""
        return True

    def clamped(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of (n, 2) points [m] lie where it is clamped."""
        return np.zeros(len(points), dtype=bool)

    def regions(self, points: NDArray[np.float64]) -> NDArray[np.str_]:
        """Return what the part of it is called on which each of (n, 2) points [m] lies."""
        return np.full(len(points), "plate")

    @property
    @abstractmethod
    def around(self) -> tuple[NDArray[np.float64], ...]:
        """Return loops (n, 3) of `seatfem.structures.shapes.loops`, all anticlockwise: the outline, then its holes."""

    @property
    def drawn(self) -> tuple[NDArray[np.float64], ...]:
        """Return the loops as `around`, with what lies within a clamp that cuts it off."""
        return self.around

    def sheet(self, occ: Any) -> int:
        """Return the tag of the outline's surface (millimetres), added to the given gmsh OpenCASCADE model."""
        return int(occ.addPlaneSurface([loops.curve_loop(occ, loop) for loop in self.around]))

    @property
    def patches(self) -> Patches:
        return {"contact": (PlaneFace((0.0, 0.0, 1.0), self.thickness),)}

    @property
    def plan(self) -> Plan:
        return Plan(self.thickness, {"contact": ("sheet",)}, {})

    def areas(self, occ: Any) -> dict[str, list[int]]:
        return {"sheet": [self.sheet(occ)]}

    def build(self, occ: Any) -> None:
        """Add the sheet (millimetres) to the given gmsh OpenCASCADE model."""
        occ.extrude([(2, self.sheet(occ))], 0.0, 0.0, 1e3 * self.thickness)
