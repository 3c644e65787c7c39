"""How a plate starts and what loads it: pressure, gravity and forces, by the plate's own integrals over its modes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from impact.bodies.body import Body, Load, ModalState
from impact.greens.base import Array, GreensFunction
from seatfem.fields import Acceleration, KeyProblem, Length
from seatfem.structures.kinds.motion import AnyPressure, ForceCourse, as_value
from seatfem.structures.kinds.plate_release import Curvature, PlateRelease
from seatfem.structures.kinds.striking import At, check_along
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.structures.lip import Lip, Patch
from seatfem.units import write_quantity

if TYPE_CHECKING:
    from seatfem.structures.sheets import PlateModes


class PlateForce(ForceCourse):
    """A force at one place of a plate, constant or in time; positive away from the seat."""

    at: Length | None = Field(None, description="distance from the root, along the axis; absent: the paddle's centre")


class ClampedPlate(ThinPlate):
    """Base of all plates that are clamped at their root and strike with their paddle.

    Their loads move the modes alone. What the modes left out would yield to them at once is neglected: for a paddle of
    16 mm by 0.3 mm on a neck of 15 mm, 3e-6 of the static deflection of paddle or lip under a uniform pressure, on the
    whole plate or a disc of 10 mm, with the 16 modes of a band of 10 kHz, and 3e-4 under a force at the centre; with
    the 117 modes of 100 kHz 2e-7 and 3e-5.
    """

    group: ClassVar[str] = "reeds"
    _beside_greens: ClassVar[frozenset[str]] = ThinPlate._beside_greens | {
        *("pressure", "pressure_radius", "point_force", "gravity", "curvature")
    }

    release: PlateRelease | None = Field(None, description="of a reed: how it starts; absent: at rest")
    pressure: AnyPressure | None = Field(
        None, description="on the whole plate, or on a disc; a constant one may be written as text"
    )
    pressure_radius: Length | None = Field(
        None,
        description="radius of the disc about the paddle's centre on which pressure acts; usually that of the port",
    )
    point_force: Annotated[PlateForce, BeforeValidator(as_value)] | None = Field(
        None, description="on one place of its axis"
    )
    gravity: Acceleration | None = Field(
        None, description="component of the acceleration along the normal; negative presses the reed on the seat"
    )

    curvature: Curvature | None = Field(None, description="of a reed: its stress-free shape, where it is not flat")

    @model_validator(mode="after")
    def _one_start(self) -> Self:
        if self.velocity is not None:
            raise KeyProblem("velocity", 'a clamped reed cannot translate; write release = { velocity = "-2 m/s" }')
        if self.release is not None and self.deflection is not None:
            raise KeyProblem("release", "deflection is given too; keep one of the two")
        if self.point_force is not None:
            self.check_place(self.point_force.at, "point_force.at")
        pressed = "pressure" in (self.release and self.release.shape, self.curvature and self.curvature.shape)
        if self.pressure_radius is not None and self.pressure is None and not pressed:
            raise KeyProblem("pressure_radius", "there is no pressure; remove the key, or give pressure")
        if (wide := self.pressure_radius) is not None and wide > (most := self.geometry().room[1]):
            raise KeyProblem(
                "pressure_radius",
                f"{write_quantity(wide, 'length')} must be at most what the plate has about {self.about}, "
                f"{write_quantity(most, 'length')}",
            )
        return self

    @property
    def moved_by(self) -> tuple[str, ...]:
        return ("release", "deflection", "force", "pressure", "point_force", "gravity")

    def start_at(self, at: float | None) -> float:
        if self.release is not None:
            return self.release.start_at(self.geometry().centre)
        return super().start_at(at)

    def body(self, greens: GreensFunction | None = None, n_modes: int | None = None, at: At = None) -> Body:
        body = super().body(greens, n_modes, at)
        state = body.state if self.release is None else self._state(self.plate(body.greens), self.release)
        return replace(body, state=state, loads=(*body.loads, *self._loads(body)))

    def check_place(self, place: float | Array | None, key: str) -> None:
        if not isinstance(place, np.ndarray):
            check_along(self.kind, self.geometry().length, place, key)

    def pushed_at(self, body: Body, place: float | Array | None) -> Array:
        if isinstance(place, np.ndarray):
            return super().pushed_at(body, place)
        plate = self.plate(body.greens)
        if place is None:
            return plate.centre[:, None]
        point = Patch(np.array([(place, plate.sheet.shape.centre[1])]), np.ones(1))
        return plate.at(point, "the point of a force")[:, None]

    def blown(self, body: Body) -> Array:
        return _on_disc(self.plate(body.greens), self.radius)[0]

    @property
    def is_curved(self) -> bool:
        return self.curvature is not None

    def heights(self, points: Array) -> Array:
        places = np.asarray(self.geometry().centre) + points
        if (shape := self.curvature) is None:
            return super().heights(points)
        if shape.deflection is None:
            try:
                return shape.given(places)
            except KeyProblem as problem:
                raise KeyProblem(f"curvature.{problem.key}", str(problem)) from None
        from seatfem.structures.sheets import plate_modes  # as above

        plate = plate_modes(self.sheet())
        push = self._pressed(plate)[0] if shape.shape == "pressure" else plate.centre
        each = push / plate.modes.omega**2
        if shape.shape in (None, "mode"):
            each = np.where(np.arange(len(each)) == 0, plate.centre, 0.0)
        return plate.shape_at(shape.deflection / float(plate.centre @ each) * each, places)

    def _pressed(self, plate: PlateModes) -> tuple[Array, float]:
        """Return the (m,) mean of the modes where the pressure acts [1/sqrt(kg)], and the area [m^2]."""
        if self.pressure_radius is None:
            return plate.mean, plate.mesh.area
        return _on_disc(plate, self.pressure_radius)

    def _loads(self, body: Body) -> Iterator[Load]:
        if self.pressure is not None:
            mean, area = self._pressed(self.plate(body.greens))
            yield Load(mean, scaled(self.pressure.course, area))
        if self.point_force is not None:
            yield Load(self.pushed_at(body, self.point_force.at)[:, 0], self.point_force.course)
        if self.gravity is not None:
            shape, mass = self.weight(body)
            yield Load(shape, scaled(constant(self.gravity), mass))

    def _state(self, plate: PlateModes, release: PlateRelease) -> ModalState:
        if release.field is not None:
            return release.of_field(plate)
        if release.deflection is not None:
            return release.static(plate.centre if release.shape == "force" else self._pressed(plate)[0], plate)
        return release.of_mode(plate, self.about)


def _on_disc(plate: PlateModes, radius: float) -> tuple[Array, float]:
    """Return the (m,) mean of the modes on a disc about the paddle's centre [1/sqrt(kg)], and its area [m^2]."""
    (patch,) = Lip.disc(radius).patches(plate.sheet.shape.centre).values()
    return plate.at(patch, "the disc that is pressed"), float(patch.weights.sum())


def constant(value: float) -> Callable[[Array], Array]:
    """Return a course that stays."""
    return lambda t: np.full(np.shape(t), value)


def scaled(course: Callable[[Array], Array], factor: float) -> Callable[[Array], Array]:
    """Return a pressure as a force, an acceleration as a force."""
    return lambda t: factor * np.asarray(course(t))
