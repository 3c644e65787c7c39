"""The shape of a flat reed that is not flat: what it is without stress."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Final, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from impact.greens.base import Array
from seatfem.fields import ExistingFile, KeyProblem, Position, Table
from seatfem.structures.formats.columns import ColumnsError, between, check_scattered, read_columns

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
