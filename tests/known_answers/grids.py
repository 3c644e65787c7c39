"""Meshes of boxes and meridian sections for the verification cases, and unknowns held one component at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray

from seatfem.structures.model import Array, Port, SecondOrderModel

Mask = NDArray[np.bool_]
Where = Callable[[Array], Mask]
"""Coordinates (dim, n) -> (n,) which of the points."""


def plane(axis: int, value: float) -> Where:
    """Return the condition that points are on a coordinate plane."""
    return lambda x: np.abs(x[axis] - value) < 1e-9 * max(1.0, abs(value))


def box(*axes: Array, cells: Any = skfem.MeshHex) -> Any:
    """Return a box of hexahedra (or `MeshTet`) with boundaries x0, x1, y0, y1, z0, z1."""
    sides = {f"{'xyz'[i]}{e}": plane(i, axis[-e]) for i, axis in enumerate(axes) for e in (0, 1)}
    return cells.init_tensor(*axes).with_boundaries(sides)


def section(r: Array, z: Array) -> Any:
    """Return a rectangular meridian section of quadrilaterals with boundaries inner, outer, bottom, top."""
    sides = {"inner": plane(0, r[0]), "outer": plane(0, r[-1]), "bottom": plane(1, z[0]), "top": plane(1, z[-1])}
    return skfem.MeshQuad.init_tensor(r, z).with_boundaries(
        {name: where for name, where in sides.items() if name != "inner" or r[0] > 0}
    )


def split(places: Sequence[float], n: int) -> Array:
    """Return every interval of the places in n equal parts."""
    ends = np.asarray(places, dtype=np.float64)
    inner = ends[:-1, None] + np.diff(ends)[:, None] * np.arange(n) / n
    return np.append(inner.ravel(), ends[-1])


def hold(model: SecondOrderModel, *conditions: tuple[tuple[int, ...], Where]) -> SecondOrderModel:
    """Return the model without displacement components where the conditions say; its ports stay as far as free."""
    assert model.dofs is not None
    node, component = np.divmod(model.dofs.free, len(model.dofs.points))
    places = model.dofs.points[:, node]
    free = np.ones(model.size, dtype=bool)
    for components, where in conditions:
        free &= ~(np.isin(component, components) & where(places))
    keep = np.flatnonzero(free)
    ports = {name: Port(port.vector[keep], port.area, port.impedance) for name, port in model.ports.items()}
    return SecondOrderModel(model.M[keep][:, keep], None, model.K[keep][:, keep], ports)
