"""What is known of a seat without finite elements: the column of material under the face that is struck."""

from __future__ import annotations

import math
from dataclasses import dataclass

from seatfem.structures.kinds.parts import OrthotropicMaterial
from seatfem.study import scene as scenes


@dataclass(frozen=True)
class Column:
    """A straight column: area [m^2] of the struck face, height [m] down to the clamp, narrowest width [m] of the face.

    Its stiffness E A/h is the usual guess at a seat's.
    """

    area: float
    height: float
    width: float
    young: float
    density: float

    @property
    def stiffness(self) -> float:
        """E A/h [N/m]."""
        return self.young * self.area / self.height


def column_of(seat: scenes.DrawnSeat) -> Column | None:
    """The column under the struck face; ``None`` for a CAD part, whose sizes are in its file."""
    sizes = _sizes(seat)
    if sizes is None:
        return None
    material = seat.material
    young = material.young[2] if isinstance(material, OrthotropicMaterial) else material.young
    return Column(*sizes, young, material.density)


def _sizes(seat: scenes.DrawnSeat) -> tuple[float, float, float] | None:
    """Area, height and width."""
    match seat:
        case scenes.Annular():
            inner, width = seat.bore_radius + seat.lip_edge_radius, seat.lip_width - 2 * seat.lip_edge_radius
            return _ring(inner, width, seat.arc), seat.thickness + seat.lip_height, width
        case scenes.Conical():
            width = seat.contact_width or seat.face_width
            across = width * math.sin(seat.half_angle)
            inner = seat.bore_radius + (seat.face_width * math.sin(seat.half_angle) - across) / 2
            return _ring(inner, across, seat.arc), seat.thickness, width
        case scenes.StopperSeat():
            return _ring(0.0, seat.contact_radius, seat.arc), seat.thickness, seat.contact_radius
        case scenes.Plate():
            ports = seat.ports if seat.struck is None else 1
            return ports * _ring(seat.port_radius, seat.land_width, None), seat.thickness, seat.land_width
        case scenes.BarSeat():
            return seat.width * seat.height, seat.length, min(seat.width, seat.height)
        case scenes.BlockSeat():
            sides = (seat.patch_width, seat.patch_depth)
            return sides[0] * sides[1], seat.thickness, min(sides)
        case _:
            return None


def _ring(inner: float, width: float, arc: float | None) -> float:
    """Area [m^2] of a ring, or of an arc of it."""
    return (arc or 2 * math.pi) * width * (inner + width / 2)
