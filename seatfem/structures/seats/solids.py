"""A scene's materials as finite elements take them."""

from __future__ import annotations

import numpy as np

from seatfem.structures.kinds.parts import AnyMaterial, OrthotropicMaterial
from seatfem.structures.materials import Material, Orthotropic

Solid = Material | Orthotropic


def solid(given: AnyMaterial) -> Solid:
    """A scene's material as finite elements take it."""
    if isinstance(given, OrthotropicMaterial):
        return Orthotropic(
            young=given.young,
            poisson=given.poisson,
            shear=given.shear,
            density=given.density,
            axes=_orthonormal(given.axes),
            name="seat.material",
            loss_factor=given.loss_factor,
        )
    return Material(young=given.young, poisson=given.poisson, density=given.density, loss_factor=given.loss_factor)


def _orthonormal(axes: tuple[tuple[float, float, float], ...]) -> tuple[tuple[float, ...], ...]:
    rows = np.asarray(axes, dtype=float)
    unit = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    return tuple(tuple(float(x) for x in row) for row in unit)
