"""How a plate starts, in a mode, a static shape or a given field; and the shape of one that is not flat."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Final, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from impact.bodies.body import ModalState
from impact.greens.base import Array
from seatfem.fields import Approach, ExistingFile, KeyProblem, Position, Table
from seatfem.structures.errors import ModelError
from seatfem.structures.formats.columns import ColumnsError, between, check_scattered, read_columns

if TYPE_CHECKING:
    from seatfem.structures.sheets import PlateModes

HEIGHTS: Final = [["0 mm", "0 um"], ["15 mm", "20 um"], ["30 mm", "60 um"]]
COLUMNS: Final = {"x": "length", "y": "length", "height": "length"}


class Curvature(Table):
    """The stress-free shape of a reed that is not flat, as its height over the flat one, positive away from the seat.

    It changes the openings by its mean over each part of the lip, on the centre line, and, as the theory is linear,
    nothing else. As with tilt, contact.gap stays the smallest opening.
    """

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
        table = read_columns(self.file, COLUMNS, ("x", "height"))
        if "y" not in table and (len(table["x"]) < 2 or np.any(np.diff(table["x"]) <= 0)):
            raise ColumnsError(f"{self.file}: at least two rows are needed, and x must increase from one to the next")
        if "y" in table:
            check_scattered(self.file, table)
        return table

    def given(self, points: Array) -> Array:
        """Return (n,) heights at points (n, 2) [m], as given. Raises `KeyProblem` of points that they do not cover."""
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


AT_REST: Final = 1e-3  # of the mode that moves the paddle's centre the most: a mode that twists leaves it where it is
FIELD: Final = {"x": "length", "y": "length", "w": "length", "velocity": "velocity"}
MOST_LOST: Final = 0.05  # of a field's square, integrated over the mass: what the modes may leave out


class PlateRelease(Table):
    """How a plate starts: undeformed, with the velocities of one of its modes; at rest in a static shape; or with the
    deflections and velocities of a field.

    A field is projected on the modes by the mass, q = Phi'M w; one of which they leave more than 5 %, of its square
    integrated over the mass (for a velocity: its kinetic energy), is refused.
    """

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
        check_scattered(self.field, table)
        return table

    def _at(self, name: str, points: Array) -> Array:
        """Return the (n,) values of a column at points (n, 2), nan where none surround them; zero of a column that is
        not there."""
        table = self._table()
        return between(table, name, points) if name in table else np.zeros(len(points))

    def start_at(self, centre: tuple[float, float]) -> float:
        """Return the deflection of the contact's centre at the start [m]."""
        if self.field is not None:
            return float(np.nan_to_num(self._at("w", np.array([centre]))[0]))
        return self.deflection or 0.0

    def of_field(self, plate: PlateModes) -> ModalState:
        """Return the start by the field. Raises `ModelError` of nodes that it lacks or the modes do not hold."""
        return ModalState(self._projected("w", plate), self._projected("velocity", plate))

    def _projected(self, name: str, plate: PlateModes) -> Array:
        values = self._at(name, plate.mesh.points)
        if np.isnan(values).any():
            x, y = 1e3 * plate.mesh.points[np.isnan(values)][0]
            raise ModelError(
                f"reed.release.field = {self.field}: its points do not surround ({x:.4g}, {y:.4g}) mm of the reed; add "
                "some beyond its outline"
            )
        amplitudes, lost = plate.projected(values)
        if lost > MOST_LOST:
            raise ModelError(
                f"reed.release.field = {self.field}: the {len(amplitudes)} modes below three times "
                f"reed.greens.bandwidth leave {lost:.2g} of the square of {name} (limit {MOST_LOST:g}); give a "
                "smoother field, one that vanishes where the reed is clamped, or raise reed.greens.bandwidth"
            )
        return amplitudes

    def static(self, push: Array, plate: PlateModes) -> ModalState:
        """Return a start at rest under a force that moves the modes so, q_k = F s_k/omega_k^2."""
        assert self.deflection is not None
        each = push / plate.modes.omega**2
        return ModalState(self.deflection / float(plate.centre @ each) * each, np.zeros_like(each))

    def of_mode(self, plate: PlateModes, about: str) -> ModalState:
        """Return an undeformed start. Raises `ModelError` of a mode that is not there, or leaves the contact where it
        is."""
        centre, omega = plate.centre, plate.modes.omega
        rate = np.zeros_like(omega)
        assert self.velocity is not None
        if (mode := self.mode - 1) >= len(omega):
            raise ModelError(
                f"reed.release.mode = {mode + 1}: there are {len(omega)} modes below three times "
                "reed.greens.bandwidth; release one of these, or raise it"
            )
        if abs(centre[mode]) < AT_REST * np.abs(centre).max():
            raise ModelError(f"reed.release.mode = {mode + 1}: it does not move {about}; release another")
        rate[mode] = self.velocity / centre[mode]
        return ModalState(np.zeros_like(omega), rate)
