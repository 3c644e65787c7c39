"""Bodies in closed form: the massless spring, the rigid mass and the elastic rod."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Annotated, ClassVar, Final, Literal, Self

import numpy as np
from pydantic import Field, model_validator

import impact
from impact.after import rods
from impact.bodies.body import Body
from impact.exact.closed_form import ExactRod
from impact.greens.base import Array, GreensFunction
from impact.quantities import in_units
from seatfem.fields import Approach, Area, DampingRatio, Density, KeyProblem, Length, Mass, Modulus, Stiffness, Usual
from seatfem.structures.kinds import motion, structure
from seatfem.structures.outlines import BodyViews, draw_prism

NO_MODES: Final = "a rod in closed form has no modes to be set in motion; take kind = 'bar' with model = 'sector'"


class Spring(structure.Structure):
    """A massless spring: the model of the seat that has no waves."""

    traits: ClassVar[structure.Traits] = structure.Traits(plane=True)

    sample: ClassVar[str] = """
stiffness = "50 N/um"
"""

    kind: Literal["spring"]
    stiffness: Stiffness = Field(description="force per displacement of the contact")

    @property
    def _model_words(self) -> str:
        return "spring"

    def views(self, *, coarse: bool = False) -> BodyViews:
        return BodyViews(f"spring {1e-6 * self.stiffness:.4g} N/um", symbol="spring")

    def closed_form(self) -> GreensFunction:
        return impact.spring(stiffness=self.stiffness)


class RigidMass(structure.Structure):
    """A rigid striker in free flight, as in a drop test."""

    group: ClassVar[str] = "strikers"
    traits: ClassVar[structure.Traits] = structure.Traits(has_weight=True, moved_by=("velocity",))

    sample: ClassVar[str] = """
mass = "5 g"
"""
    sample_scene: ClassVar[structure.SampleScene] = structure.SampleScene('velocity = "-1 m/s"', "stopper")

    kind: Literal["rigid_mass"]
    mass: Mass = Field(description="mass")
    velocity: Approach = Field(description='velocity at the start; towards the seat it is negative, as in "-2 m/s"')

    @property
    def loose(self) -> str:
        return "seat.kind = 'rigid_mass' is free to move"

    def views(self, *, coarse: bool = False) -> BodyViews:
        return BodyViews(f"rigid mass {in_units(self.mass, 'kg')}", symbol="mass")

    def closed_form(self) -> GreensFunction:
        return impact.rigid_mass(mass=self.mass, velocity=0.0).greens

    def weight(self, body: Body) -> tuple[Array, float]:
        return self.pushed_at(body, None)[:, 0], self.mass

    def body(self, greens: GreensFunction | None = None, n_modes: int = 0, at: structure.At = None) -> Body:
        return impact.rigid_mass(mass=self.mass, velocity=self.velocity)


class Rod(motion.Moving):
    """The straight elastic rod in one dimension, clamped or free at its far end, in closed form."""

    traits: ClassVar[structure.Traits] = replace(motion.Moving.traits, is_solved=False, plane=True)

    sample: ClassVar[str] = """
young = "206 GPa"
density = "7850 kg/m^3"
length = "30 mm"
width = "5 mm"
thickness = "5 mm"
damping_ratio = 0.02
"""

    kind: Literal["rod"]
    young: Modulus = Field(description="Young's modulus")
    density: Density = Field(description="mass per volume")
    length: Length = Field(description="length along the impact")
    area: Area | None = Field(None, description="cross-section; or give width and thickness")
    width: Length | None = Field(None, description="width of a rectangular cross-section")
    thickness: Annotated[Length, Usual(1e-8, 1.0)] | None = Field(
        None, description="thickness of a rectangular cross-section"
    )
    damping_ratio: DampingRatio = Field(0.0, description="modal damping, the same for every mode")
    far_end: Literal["fixed", "free", "endless"] = Field(
        "fixed",
        description="a free rod strikes with a velocity; from an endless one nothing comes back, and [[wave]] may come "
        "along it; its length is then that of the spring which it is compared with",
    )

    @model_validator(mode="after")
    def _one_cross_section(self) -> Self:
        if self.area is not None and (self.width or self.thickness):
            raise KeyProblem("area", "width or thickness is given too; keep the area or both of these")
        if self.area is None and not (self.width and self.thickness):
            raise KeyProblem("area", "the cross-section is missing: give area, or width and thickness")
        return self

    @property
    def cross_section(self) -> float:
        """Return the area of the cross-section [m^2]."""
        return self.area if self.area is not None else (self.width or 0.0) * (self.thickness or 0.0)

    @property
    def loose(self) -> str:
        return "" if self.far_end != "free" else "seat.far_end = 'free' holds nothing"

    @model_validator(mode="after")
    def _motion_without_modes(self) -> Self:
        if self.far_end != "free" and self.velocity is not None:
            raise KeyProblem("velocity", "a rod that is held cannot translate; set far_end = 'free'")
        for key in ("deflection", "force"):
            if getattr(self, key) is not None:
                free = "a free rod in closed form has no modes to be set in motion; use velocity"
                raise KeyProblem(key, free if self.far_end == "free" else NO_MODES)
        return self

    def views(self, *, coarse: bool = False) -> BodyViews:
        """Return a column of the cross-section that is given, or of a square one of the same area."""
        side = math.sqrt(self.cross_section)
        sides = (side, side) if self.width is None or self.thickness is None else (self.width, self.thickness)
        views = draw_prism("rod", (sides[0] / 2, sides[1] / 2), None, self.length)
        return views if self.far_end == "fixed" else replace(views, held=())

    @property
    def endless_stiffness(self) -> float:
        return self.young * self.cross_section / self.length if self.far_end == "endless" else 0.0

    def closed_form(self) -> GreensFunction:
        rods: Mapping[str, Callable[..., GreensFunction]] = {
            "fixed": impact.fixed_rod,
            "free": impact.free_rod,
            "endless": impact.semi_infinite_rod,
        }
        return rods[self.far_end](**self._sizes, damping_ratio=self.damping_ratio)

    @property
    def _sizes(self) -> dict[str, float]:
        return {"young": self.young, "density": self.density, "area": self.cross_section, "length": self.length}

    def check_place(self, place: structure.Place, key: str) -> None:
        """Raise `KeyProblem` unless the place is the back end of a free rod, which a stopper may meet."""
        if place is None:
            return
        if self.far_end != "free" or self.damping_ratio or place != self.length:
            raise KeyProblem(
                key,
                "a rod is met at its struck end, or free and undamped at its back: give its length, or remove the key",
            )

    def find_plan_distance(self, place: float, at: float) -> float:
        """Return zero: its back is behind its front."""
        return 0.0

    def body(self, greens: GreensFunction | None = None, n_modes: int = 0, at: structure.At = None) -> Body:
        """Return the rod, with a port at each end if it has two contacts ``at``."""
        if isinstance(at, tuple) and greens is None:
            greens = impact.rod_of_two_ends(**self._sizes)
        return super().body(greens, n_modes, at)

    @property
    def wave_speed(self) -> float:
        return 0.0 if self.far_end != "endless" or self.damping_ratio else math.sqrt(self.young / self.density)

    def check_gauge(self, at: float, table: str, role: str) -> None:
        key = f"{table}.at"
        if self.damping_ratio and self.far_end != "fixed":
            raise KeyProblem(key, "strain is known along rods without damping, and fixed ones; remove damping_ratio")
        if self.far_end != "endless":
            structure.check_along(self.kind, self.length, at, key)

    def strain_at(self, place: float, force: Array, dt: float, body: Body, at: structure.At = None) -> Array:
        """Return the strain by superposition of the waves from the contact forces at both ends."""
        pressed = force.reshape(len(force), -1) * np.array([1.0, -1.0])[: 1 if force.ndim == 1 else force.shape[1]]
        ends = zip(pressed.T, (place, self.length - place), strict=False)
        borne = [rods.axial_force(push, dt, self._step_response(away)) for push, away in ends]
        return np.asarray(sum(borne) / -(self.young * self.cross_section))

    def _step_response(self, away: float) -> Callable[[Array], Array]:
        """Return the axial force at a distance ``away`` from an end as a function of time after a unit step force at
        that end."""
        if speed := self.wave_speed:
            return lambda time: np.asarray(time >= away / speed, dtype=float)
        free = impact.rod_with_end_impedance
        rod: ExactRod = free(**self._sizes, end_impedance=0.0)
        if self.far_end == "fixed":
            rod = impact.fixed_rod(**self._sizes, damping_ratio=self.damping_ratio)
        return lambda time: rods.force_response(rod, time, at=away / self.length)
