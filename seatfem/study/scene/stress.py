"""[stress]: where the stress of the finite elements is looked for."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from seatfem.fields import Gap, KeyProblem, Position, Table, default

MOST = 100


class Stress(Table):
    """Stress in the seat's finite elements under the contact forces of the run, by mode acceleration; off where the
    table is absent. Of a seat that is struck in arcs of its lip, each arc's own force counts.
    """

    points: tuple[tuple[Position, Position, Position], ...] = Field(
        (),
        max_length=MOST,
        description="named places x, y, z in the seat's own coordinates, whose histories are kept; of a body of "
        "revolution about z that is struck all around the angle does not matter",
    )
    surface: bool = Field(
        True, strict=True, description="whether the largest is looked for on the surface; else at the points alone"
    )
    distance: Gap = default(
        "0.2 mm",
        "from singular edges, reentrant without a fillet or the rim of a clamped face, within which none is told",
    )
    apart: Gap = default("1 mm", "within which the largest of the stress is one hot spot")

    @model_validator(mode="after")
    def _somewhere(self) -> Self:
        if not self.surface and not self.points:
            raise KeyProblem("points", "no point is named and surface = false: name one, or remove the table")
        return self
