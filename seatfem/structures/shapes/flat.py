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
        """Of what touches [m]."""

    @property
    @abstractmethod
    def room(self) -> tuple[float, float]:
        """Radii of the smallest and the largest circle about the centre that lie on it [m]; 0: no hole is there."""

    @property
    def length(self) -> float:
        """The largest x of the outline [m]."""
        return self.centre[0] + self.room[1]

    @property
    @abstractmethod
    def area(self) -> float:
        """Of the outline [m^2]."""

    @property
    @abstractmethod
    def narrowest(self) -> float:
        """Width of the narrowest part that bends [m]."""

    @property
    def is_mirrored(self) -> bool:
        """Whether the line y = 0 mirrors it exactly, with all that is clamped: one half is meshed then."""
        return False

    @property
    def is_clamped(self) -> bool:
        """Whether a part of the outline is."""
        return True

    def clamped(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of (n, 2) points [m] lie where it is clamped."""
        return np.zeros(len(points), dtype=bool)

    def regions(self, points: NDArray[np.float64]) -> NDArray[np.str_]:
        """What the part of it is called on which each of (n, 2) points [m] lies."""
        return np.full(len(points), "plate")

    @property
    @abstractmethod
    def around(self) -> tuple[NDArray[np.float64], ...]:
        """Loops (n, 3) of `seatfem.structures.shapes.loops`, all anticlockwise: the outline, then its holes."""

    @property
    def drawn(self) -> tuple[NDArray[np.float64], ...]:
        """As `around`, with what lies within a clamp that cuts it off."""
        return self.around

    def sheet(self, occ: Any) -> int:
        """Tag of the outline's surface (millimetres), added to the given gmsh OpenCASCADE model."""
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
