"""The flapper: a flat reed with a tapered root, a straight neck and a round paddle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from seatfem.structures.shapes.flat import Flat
from seatfem.structures.shapes.selectors import Patches, PlaneFace
from seatfem.structures.shapes.shape import require_above, require_below, require_positive


@dataclass(frozen=True)
class Flapper(Flat):
    """Sheet along the x axis, clamped at x = 0, underside at z = 0 (metres).

    The root narrows to the neck over ``taper_length``; the neck meets the paddle's circle at x = ``neck_length``. The
    group "contact" is the upper side, "fixed" the root's end face.
    """

    family: ClassVar[str] = "flapper"

    root_width: float
    taper_length: float
    neck_width: float
    neck_length: float
    paddle_diameter: float
    thickness: float

    def __post_init__(self) -> None:
        require_positive(self, *vars(self))
        require_below(self, "neck_width", self.root_width, "root_width: the root narrows to the neck", inclusive=True)
        require_below(self, "taper_length", self.neck_length, "neck_length, from the root to the paddle")
        require_above(self, "paddle_diameter", self.neck_width, "neck_width: the paddle is wider than the neck")
        require_below(self, "thickness", self.neck_width, "neck_width: a sheet is thinner than it is wide")

    @property
    def centre(self) -> tuple[float, float]:
        """Of the paddle [m]."""
        return self.neck_length + math.sqrt(self.paddle_diameter**2 - self.neck_width**2) / 2, 0.0

    @property
    def room(self) -> tuple[float, float]:
        return 0.0, self.paddle_diameter / 2

    @property
    def length(self) -> float:
        """From the root to the tip [m]."""
        return self.centre[0] + self.paddle_diameter / 2

    @property
    def area(self) -> float:
        """Of the outline [m^2]."""
        radius = self.paddle_diameter / 2
        cut = 2 * math.asin(self.neck_width / self.paddle_diameter)  # angle of the circle that the neck covers
        paddle = math.pi * radius**2 - radius**2 / 2 * (cut - math.sin(cut))
        straight = (self.neck_length - self.taper_length) * self.neck_width
        return straight + self.taper_length * (self.root_width + self.neck_width) / 2 + paddle

    @property
    def narrowest(self) -> float:
        return self.neck_width

    def clamped(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.asarray(np.abs(points[:, 0]) < 1e-6 * self.length)

    @property
    def patches(self) -> Patches:
        return {**super().patches, "fixed": (PlaneFace((-1.0, 0.0, 0.0), 0.0),)}

    def sheet(self, occ: Any) -> int:
        """The outline's surface (millimetres), anticlockwise; the circle in two arcs that meet at the tip."""
        root, neck = 0.5e3 * self.root_width, 0.5e3 * self.neck_width
        taper, joint = 1e3 * self.taper_length, 1e3 * self.neck_length
        corners = [(0.0, -root), (taper, -neck), (joint, -neck), (1e3 * self.length, 0.0), (joint, neck), (taper, neck)]
        points = [occ.addPoint(x, y, 0.0) for x, y in (*corners, (0.0, root))]
        centre = occ.addPoint(1e3 * self.centre[0], 0.0, 0.0)
        curves = [
            occ.addLine(points[0], points[1]),
            occ.addLine(points[1], points[2]),
            occ.addCircleArc(points[2], centre, points[3]),
            occ.addCircleArc(points[3], centre, points[4]),
            occ.addLine(points[4], points[5]),
            occ.addLine(points[5], points[6]),
            occ.addLine(points[6], points[0]),
        ]
        occ.remove([(0, centre)])
        return int(occ.addPlaneSurface([occ.addCurveLoop(curves)]))
