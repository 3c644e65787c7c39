"""The flat reed whose width varies along it."""

from __future__ import annotations

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

import impact
from impact.greens.base import GreensFunctionError
from seatfem.fields import Gap, KeyProblem, Length, of_same_names
from seatfem.structures.kinds.beam import Beam

WIDTHS = [["0 mm", "8 mm"], ["2 mm", "6 mm"], ["15 mm", "6 mm"], ["15 mm", "16 mm"], ["30 mm", "16 mm"]]


class Stepped(Beam):
    """A flat reed of varying width, clamped at its root: an Euler-Bernoulli beam. Its width is linear between the
    positions given; the same position twice is a step."""

    long: ClassVar[str] = "the last position in reed.widths"

    sample: ClassVar[str] = """
widths = [["0 mm", "10 mm"], ["15 mm", "6 mm"], ["25 mm", "6 mm"]]
thickness = "0.3 mm"
material = "steel"
damping_ratio = 0.02
"""
    sample_motion: ClassVar[str] = 'release = { tip_deflection = "1 mm" }'

    kind: Literal["stepped"]
    widths: tuple[tuple[Gap, Gap], ...] = Field(
        min_length=2,
        max_length=1000,
        description="[position, width] from the root, at 0 mm, to the tip, which may be a point",
        examples=[WIDTHS],
    )
    thickness: Length = Field(description="thickness, in the direction of the motion")

    @model_validator(mode="after")
    def _widths_make_a_beam(self) -> Self:
        try:
            self.beam()
        except GreensFunctionError as error:
            raise KeyProblem("widths", str(error).partition(": ")[2]) from error
        return self

    @property
    def span(self) -> float:
        return self.widths[-1][0]

    @property
    def widths_along(self) -> tuple[tuple[float, float], ...]:
        return self.widths

    @property
    def mean_width(self) -> float:
        return self.beam().mean_width

    def beam(self) -> impact.SteppedCantilever:
        return of_same_names(impact.SteppedCantilever, self, self.material)
