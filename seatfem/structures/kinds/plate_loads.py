"""Starts of a plate (mode, static shape or field), its stress-free curvature, and its loads (pressure, gravity,
forces), which are integrated over the plate's own modes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Final, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from impact.bodies.body import Body, Load, ModalState
from impact.greens.base import Array, GreensFunction
from seatfem import units
from seatfem.fields import Acceleration, Approach, ExistingFile, KeyProblem, Length, Position, Table
from seatfem.structures import errors, lip, sheets
from seatfem.structures.columns import ColumnsError, between, read_columns
from seatfem.structures.inspection.cad import read_once
from seatfem.structures.kinds import motion, structure, thin_plate

HEIGHTS: Final = [["0 mm", "0 um"], ["15 mm", "20 um"], ["30 mm", "60 um"]]
COLUMNS: Final = {"x": "length", "y": "length", "height": "length"}


def _read_heights(path: Path) -> dict[str, Array]:
    return read_columns(path, COLUMNS, ("x", "height"))


class Curvature(Table):
    """The stress-free shape of a curved reed, as its height over the flat one, positive away from the seat. It changes
    the openings by its mean over each part of the lip, on the centre line; the theory is linear, so it changes nothing
    else. As with tilt, contact.gap is the smallest opening."""

    sample: ClassVar[str] = 'deflection = "20 um"'

    heights: tuple[tuple[Position, Position], ...] | None = Field(
        None, min_length=2, max_length=10_000, description="[x, height] in order, linear between", examples=[HEIGHTS]
    )
    file: ExistingFile | None = Field(
        None,
        description="instead of heights: CSV with columns such as `x [mm],height [um]` or `x [mm],y [mm],height [um]`",
    )
    deflection: Position | None = Field(
        None, description="instead of heights: height at the contact's centre, of the shape named by shape"
    )
    shape: Literal["mode", "force", "pressure"] | None = Field(
        None,
        description="with deflection: that of the first mode, or static under a force at the contact's centre or a "
        "pressure where pressure acts; absent: mode",
    )

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if sum(way is not None for way in (self.heights, self.file, self.deflection)) != 1:
            raise KeyProblem("heights", "give exactly one of heights, file and deflection")
        if self.shape is not None and self.deflection is None:
            raise KeyProblem("shape", "only a deflection has one; remove the key, or give deflection")
        if self.heights is not None and np.any(np.diff([x for x, _ in self.heights]) <= 0):
            raise KeyProblem("heights", "x must increase from one to the next")
        if self.file is not None:
            try:
                self._table()
            except (ColumnsError, OSError) as error:
                raise KeyProblem("file", str(error)) from error
        return self

    def _table(self) -> Mapping[str, Array]:
        assert self.file is not None
        table = read_once(_read_heights, (self.file,))
        if "y" not in table and (len(table["x"]) < 2 or np.any(np.diff(table["x"]) <= 0)):
            raise ColumnsError(f"{self.file}: at least two rows are needed, and x must increase from one to the next")
        return table

    def given(self, points: Array) -> Array:
        """Return the (n,) tabulated heights at points (n, 2) [m]. Raises `KeyProblem` for points outside the table."""
        if self.heights is not None:
            at, height = np.array(self.heights).T
        else:
            table = self._table()
            at, height = table["x"], table["height"]
            if "y" in table:
                heights = between(table, "height", points)
                if np.isnan(heights).any():
                    x, y = 1e3 * points[np.isnan(heights)][0]
                    raise KeyProblem("file", f"its points must surround ({x:.4g}, {y:.4g}) mm, where the lip lies")
                return heights
        if (x := points[:, 0]).min() < at[0] or x.max() > at[-1]:
            key = "file" if self.heights is None else "heights"
            raise KeyProblem(
                key,
                f"x from {1e3 * at[0]:g} to {1e3 * at[-1]:g} mm must cover the lip, {1e3 * x.min():g} to "
                f"{1e3 * x.max():g} mm",
            )
        return np.asarray(np.interp(x, at, height))


AT_REST: Final = 1e-3  # relative amplitude of a mode at the paddle's centre below which it is at rest, as in a twist
FIELD: Final = {"x": "length", "y": "length", "w": "length", "velocity": "velocity"}
MOST_LOST: Final = 0.05  # largest part of a field's square, integrated over the mass, that is no sum of the modes


class PlateRelease(Table):
    """The initial state of a plate: undeformed, with the velocities of one of its modes; at rest in a static shape; or
    with the deflections and velocities of a field. A field is projected on the modes, q = Phi'M w. It is refused if
    more than 5 % of its square, integrated over the mass (for a velocity: of its kinetic energy), is outside the modes.
    """

    where: ClassVar[str] = " at the contact"
    """Place of the deflection, in drawings."""

    mode: int = Field(1, strict=True, ge=1, description="number of the mode, with velocity")
    velocity: Approach | None = Field(
        None, description='at the paddle\'s centre; towards the seat it is negative, as in "-2 m/s"'
    )
    deflection: Position | None = Field(
        None, description="instead of velocity: deflection of the paddle's centre, at rest"
    )
    shape: Literal["force", "pressure"] = Field(
        "force",
        description="with deflection: static, under a force at the paddle's centre or a uniform pressure where "
        "pressure acts",
    )
    field: ExistingFile | None = Field(
        None,
        description="instead of velocity: CSV of scattered points around the reed, such as "
        "`x [mm],y [mm],w [um],velocity [m/s]`, with w, velocity or both; linear between them",
    )

    @model_validator(mode="before")
    @classmethod
    def _one_way(cls, given: object) -> object:
        if not isinstance(given, Mapping):
            return given
        way = next((key for key in ("field", "deflection") if key in given), "")
        for key in ("velocity", "mode", *(("deflection", "shape") if way == "field" else ())):
            if way and key in given:
                raise KeyProblem(key, f"{way} is given too; keep one of the two")
        if not way and "velocity" not in given:
            raise KeyProblem("velocity", "required key is missing: at the paddle's centre; or give deflection")
        if not way and "shape" in given:
            raise KeyProblem("shape", "the shape is that of the mode; remove the key, or give deflection")
        return given

    @model_validator(mode="after")
    def _readable(self) -> PlateRelease:
        if self.field is not None:
            try:
                self._table()
            except (ColumnsError, OSError) as error:
                raise KeyProblem("field", str(error)) from error
        return self

    def _table(self) -> Mapping[str, Array]:
        assert self.field is not None
        table = read_columns(self.field, FIELD, ("x", "y"))
        if len(table) < 3:
            raise ColumnsError(f"{self.field}: neither w nor velocity; one of these columns is needed")
        return table

    def _at(self, name: str, points: Array) -> Array:
        """Return the (n,) values of a column at points (n, 2), nan outside the table; zero if the column is absent."""
        table = self._table()
        return between(table, name, points) if name in table else np.zeros(len(points))

    def start_at(self, centre: tuple[float, float]) -> float:
        """Return the deflection of the contact's centre at the start [m]."""
        if self.field is not None:
            return float(np.nan_to_num(self._at("w", np.array([centre]))[0]))
        return self.deflection or 0.0

    def start_from_field(self, plate: sheets.PlateModes) -> ModalState:
        """Return the field as initial state of the modes. Raises `ModelError` if it does not cover the plate, or the
        modes do not represent it."""
        return ModalState(self._projected("w", plate), self._projected("velocity", plate))

    def _projected(self, name: str, plate: sheets.PlateModes) -> Array:
        values = self._at(name, plate.mesh.points)
        if np.isnan(values).any():
            x, y = 1e3 * plate.mesh.points[np.isnan(values)][0]
            raise errors.ModelError(
                f"reed.release.field = {self.field}: its points do not surround ({x:.4g}, {y:.4g}) mm of the reed; add "
                "some beyond its outline"
            )
        amplitudes, lost = plate.projected(values)
        if lost > MOST_LOST:
            raise errors.ModelError(
                f"reed.release.field = {self.field}: the {len(amplitudes)} modes below three times "
                f"reed.greens.bandwidth leave {lost:.2g} of the square of {name} (limit {MOST_LOST:g}); give a "
                "smoother field, one that vanishes where the reed is clamped, or raise reed.greens.bandwidth"
            )
        return amplitudes

    def static(self, push: Array, plate: sheets.PlateModes) -> ModalState:
        """Return the state at rest q_k = F s_k/omega_k^2 under a static load with modal forces s_k, ``push``."""
        assert self.deflection is not None
        each = push / plate.modes.omega**2
        return ModalState(self.deflection / float(plate.centre @ each) * each, np.zeros_like(each))

    def start_from_mode(self, plate: sheets.PlateModes, about: str) -> ModalState:
        """Return an undeformed state with the velocity of one mode. Raises `ModelError` for an unknown mode, or one
        that does not move the contact."""
        centre, omega = plate.centre, plate.modes.omega
        rate = np.zeros_like(omega)
        assert self.velocity is not None
        if (mode := self.mode - 1) >= len(omega):
            raise errors.ModelError(
                f"reed.release.mode = {mode + 1}: there are {len(omega)} modes below three times "
                "reed.greens.bandwidth; release one of these, or raise it"
            )
        moving = 1 + np.flatnonzero(np.abs(centre) >= AT_REST * np.abs(centre).max())
        if self.mode not in moving:
            raise errors.ModelError(
                f"reed.release.mode = {self.mode}: it does not move {about}; state mode = {moving[0]}"
            )
        rate[mode] = self.velocity / centre[mode]
        return ModalState(np.zeros_like(omega), rate)


class ClampedPlate(thin_plate.ThinPlate):
    """Base of all plates that are clamped at their root and strike with their paddle.

    Loads act on the modes only; the static deflection of the truncated modes is neglected. For a paddle of 16 mm by
    0.3 mm on a neck of 15 mm that is 3e-6 of the static deflection under a uniform pressure (whole plate or a disc of
    10 mm) with the 16 modes of a band of 10 kHz, 3e-4 under a force at the centre; 2e-7 and 3e-5 with 117 modes of
    100 kHz.
    """

    group: ClassVar[str] = "reeds"
    traits: ClassVar[structure.Traits] = replace(
        thin_plate.ThinPlate.traits, moved_by=("release", "deflection", "force", "pressure", "point_force", "gravity")
    )
    _beside_greens: ClassVar[frozenset[str]] = thin_plate.ThinPlate._beside_greens | {
        *("pressure", "pressure_radius", "point_force", "gravity", "curvature")
    }

    release: PlateRelease | None = Field(None, description="of a reed: how it starts; absent: at rest")
    pressure: motion.AnyPressure | None = Field(
        None, description="on the whole plate, or on a disc; a constant one may be written as text"
    )
    pressure_radius: Length | None = Field(
        None,
        description="radius of the disc about the paddle's centre on which pressure acts; usually that of the port",
    )
    point_force: motion.AnyPointForce | None = Field(None, description="on one place of its axis")
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
                f"{units.write_quantity(wide, 'length')} must be at most what the plate has about {self.about}, "
                f"{units.write_quantity(most, 'length')}",
            )
        return self

    def place(self, at: float | None) -> float:
        return self.geometry().centre[0]

    def start_at(self, at: float) -> float:
        if self.release is not None:
            return self.release.start_at(self.geometry().centre)
        return super().start_at(at)

    def body(self, greens: GreensFunction | None = None, n_modes: int = 0, at: structure.At = None) -> Body:
        body = super().body(greens, n_modes, at)
        state = body.state if self.release is None else self._state(self.plate(body.greens), self.release)
        return replace(body, state=state, loads=(*body.loads, *self._loads(body)))

    def check_place(self, place: structure.Place, key: str) -> None:
        if not isinstance(place, np.ndarray):
            structure.check_along(self.kind, self.geometry().length, place, key)

    def pushed_at(self, body: Body, place: structure.Place, by: structure.Push = "force") -> Array:
        if by == "pressure":
            return _average_on_disc(self.plate(body.greens), self.radius)[0][:, None]
        if isinstance(place, np.ndarray):
            return super().pushed_at(body, place, by)
        plate = self.plate(body.greens)
        if place is None:
            return plate.centre[:, None]
        point = lip.Patch(np.array([(place, plate.sheet.shape.centre[1])]), np.ones(1))
        return plate.at(point, "the point of a force")[:, None]

    def heights(self, points: Array) -> Array:
        places = np.asarray(self.geometry().centre) + points
        if (shape := self.curvature) is None:
            return super().heights(points)
        if shape.deflection is None:
            try:
                return shape.given(places)
            except KeyProblem as problem:
                raise KeyProblem(f"curvature.{problem.key}", str(problem)) from None
        plate = sheets.plate_modes(self.sheet())
        push = self._pressed(plate)[0] if shape.shape == "pressure" else plate.centre
        each = push / plate.modes.omega**2
        if shape.shape in (None, "mode"):
            each = np.where(np.arange(len(each)) == 0, plate.centre, 0.0)
        return plate.shape_at(shape.deflection / float(plate.centre @ each) * each, places)

    def _pressed(self, plate: sheets.PlateModes) -> tuple[Array, float]:
        """Return the (m,) mean of each mode over the area on which the pressure acts [1/sqrt(kg)], and that area."""
        if self.pressure_radius is None:
            return plate.mean, plate.mesh.area
        return _average_on_disc(plate, self.pressure_radius)

    def _loads(self, body: Body) -> Iterator[Load]:
        if self.pressure is not None:
            mean, area = self._pressed(self.plate(body.greens))
            yield Load(mean, motion.scaled(self.pressure.course, area))
        if self.point_force is not None:
            yield Load(self.pushed_at(body, self.point_force.at)[:, 0], self.point_force.course)
        if self.gravity is not None:
            shape, mass = self.weight(body)
            yield Load(shape, motion.scaled(motion.constant(self.gravity), mass))

    def _state(self, plate: sheets.PlateModes, release: PlateRelease) -> ModalState:
        if release.field is not None:
            return release.start_from_field(plate)
        if release.deflection is not None:
            return release.static(plate.centre if release.shape == "force" else self._pressed(plate)[0], plate)
        return release.start_from_mode(plate, self.about)


def _average_on_disc(plate: sheets.PlateModes, radius: float) -> tuple[Array, float]:
    """Return the (m,) mean of each mode on a disc about the paddle's centre [1/sqrt(kg)], and its area [m^2]."""
    (patch,) = lip.Lip.disc(radius).patches(plate.sheet.shape.centre).values()
    return plate.at(patch, "the disc that is pressed"), float(patch.weights.sum())
