"""Kinds of flat reeds, each with its beam theory."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Final, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from impact.after import histories, stresses
from impact.beams import euler_bernoulli, stepped, timoshenko
from impact.bodies.body import Body
from impact.greens.base import Array, GreensFunctionError
from seatfem.fields import Gap, KeyProblem, Mass, Thickness, build_from_fields
from seatfem.structures.kinds.beam import Beam, UniformBeam
from seatfem.structures.kinds.structure import At, SampleScene, Traits, check_along

PLACES: Final = 17
"""Number of evenly spaced places along a reed, from root to tip, at which fatigue is evaluated."""
WIDTHS: Final = [["0 mm", "8 mm"], ["2 mm", "6 mm"], ["15 mm", "6 mm"], ["15 mm", "16 mm"], ["30 mm", "16 mm"]]


class Cantilever(UniformBeam):
    """A flat reed, clamped at its root: an Euler-Bernoulli beam; by default as wide and thick as the paper's."""

    traits: ClassVar[Traits] = replace(Beam.traits, stress="closed form")
    sample: ClassVar[str] = """
length = "25 mm"
width = "10 mm"
thickness = "0.3 mm"
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('release = { tip_deflection = "1 mm" }', "annular")

    kind: Literal["cantilever"]

    def beam(self) -> euler_bernoulli.Cantilever:
        return build_from_fields(euler_bernoulli.Cantilever, self, self.material)

    def stress(self, force: Array, dt: float, body: Body, at: At) -> BeamStress:
        return BeamStress(self.beam(), force, dt, body, at)

    def check_gauge(self, at: float, table: str, role: str) -> None:
        if role != "reed":
            raise KeyProblem(f"{table}.of", "of beams strain is known along the reed; put the gauge there")
        check_along(self.kind, self.span, at, f"{table}.at")

    def strain_at(self, place: float, force: Array, dt: float, body: Body, at: At = None) -> Array:
        """Return the bending strain in the face towards the seat."""
        stress = stresses.bending_stress(force, dt, body, self.beam(), [place], contact_at=at)[0]
        return np.asarray(stress / self.material.young)


@dataclass(frozen=True)
class BeamStress:
    """The bending stress of a cantilever under contact forces.

    Attributes:
        beam: beam in closed form.
        force: contact forces, (n + 1,) or (n + 1, p) [N].
        dt: time step [s].
        body: the reed with its initial conditions and loads.
        at: distances of the contacts from the root [m].
    """

    beam: euler_bernoulli.Cantilever
    force: Array
    dt: float
    body: Body
    at: At

    def largest(self, *, coarsely: bool, since: float = math.nan) -> histories.ReedStress:
        known = self.force, self.dt, self.body, self.beam
        return stresses.reed_stress(*known, contact_at=self.at, coarsely=coarsely, since=since)

    def histories(self, also: Collection[float] = ()) -> Iterator[tuple[str, Array]]:
        """Yield the bending stress of both faces at the root, the contacts, ``also`` and `PLACES`."""
        for name, _, stress in self._along([*np.linspace(0.0, self.beam.length, PLACES), *also]):
            yield f"{name}, face towards the seat", stress
            yield f"{name}, face away from the seat", -stress

    def spots(self, worst: float) -> Iterator[tuple[str, Array, Array]]:
        """Yield the bending stress of the face towards the seat at the root, the contacts and the ``worst`` place."""
        return self._along([worst])

    def _along(self, others: Collection[float]) -> Iterator[tuple[str, Array, Array]]:
        """Yield name, position and bending stress of the root, the contacts and ``others``, from the root on."""
        at = self.at
        met = (at,) if isinstance(at, float) else at or ()
        names = ("contact", "stopper") if len(met) == 2 else ("contact",)  # on a retainer it is met all along
        named = {**dict(zip(met, names, strict=False)), 0.0: "root"}
        places = np.unique([*named, *others])
        bending = stresses.bending_stress(self.force, self.dt, self.body, self.beam, places, contact_at=at)
        for place, stress in zip(places, bending, strict=True):
            yield named.get(place, f"{1e3 * place:.4g} mm from the root"), np.array([place]), stress


class ClampedClamped(UniformBeam):
    """A flat leaf, clamped at both ends: an Euler-Bernoulli beam. By default it strikes with its middle."""

    theory: ClassVar[type[Any]] = euler_bernoulli.ClampedClamped
    both_held: ClassVar[bool] = True
    sample: ClassVar[str] = Cantilever.sample.replace("25", "40")
    sample_scene: ClassVar[SampleScene] = SampleScene('release = { mode = 1, velocity = "-2 m/s" }', "annular")

    kind: Literal["clamped_clamped"]


class Timoshenko(UniformBeam):
    """A reed, clamped at its root, that may be thick: a Timoshenko beam, with shear and rotary inertia."""

    theory: ClassVar[type[Any]] = timoshenko.TimoshenkoCantilever
    sample: ClassVar[str] = Cantilever.sample.replace("0.3", "1")
    sample_scene: ClassVar[SampleScene] = SampleScene('release = { tip_deflection = "0.2 mm" }', "annular")

    kind: Literal["timoshenko"]
    shear_factor: float = Field(5 / 6, gt=0, le=1, description="shear area over area; 5/6 for a rectangle")

    def too_thick(self) -> str:
        return ""

    def shear_error(self, at: float | None) -> float:
        return 0.0


class TipMass(UniformBeam):
    """A flat reed, clamped at its root, with a point mass at its tip: an Euler-Bernoulli beam."""

    theory: ClassVar[type[Any]] = euler_bernoulli.TipMassCantilever
    sample: ClassVar[str] = Cantilever.sample + 'tip_mass = "0.1 g"\n'
    sample_scene: ClassVar[SampleScene] = Cantilever.sample_scene

    kind: Literal["tip_mass"]
    tip_mass: Mass = Field(description="mass at the tip")


class Stepped(Beam):
    """A flat reed of varying width, clamped at its root: an Euler-Bernoulli beam. The width is linear between the given
    positions; a repeated position is a step."""

    long: ClassVar[str] = "the last position in reed.widths"
    sample: ClassVar[str] = """
widths = [["0 mm", "10 mm"], ["15 mm", "6 mm"], ["25 mm", "6 mm"]]
thickness = "0.3 mm"
"""
    sample_scene: ClassVar[SampleScene] = Cantilever.sample_scene

    kind: Literal["stepped"]
    widths: tuple[tuple[Gap, Gap], ...] = Field(
        min_length=2,
        max_length=1000,
        description="[position, width] from the root, at 0 mm, to the tip, which may be a point",
        examples=[WIDTHS],
    )
    thickness: Thickness = Field(description="thickness, in the direction of the motion")

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

    def beam(self) -> stepped.SteppedCantilever:
        return build_from_fields(stepped.SteppedCantilever, self, self.material)
