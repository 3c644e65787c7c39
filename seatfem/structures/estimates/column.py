"""What is known of a body by hand: the column of material under the face that is struck."""

from __future__ import annotations

from dataclasses import dataclass


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
