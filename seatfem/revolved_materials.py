"""Which material each cell of a meridian section is made of."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatfem.errors import ModelError
from seatfem.materials import Material, Orthotropic, Solid, material_from, stiffness_tensor
from seatfem.model import Array

Regions = tuple[tuple[Solid, NDArray[np.int64]], ...]
"""Each material with the cells made of it."""


def regions_of(mesh: Any, material: Solid | Mapping[str, Any]) -> Regions:
    """Materials by cells; every cell must have exactly one."""
    everything = np.arange(mesh.nelements)
    if isinstance(material, Material | Orthotropic):
        return ((_revolved(material), everything),)
    if not any(isinstance(value, Material | Orthotropic | Mapping) for value in material.values()):
        return ((material_from(material), everything),)
    named = mesh.subdomains or {}
    if unknown := [name for name in material if name not in named]:
        raise ModelError(f"material: no region {', '.join(unknown)}; the mesh has {', '.join(sorted(named)) or 'none'}")
    count = np.zeros(mesh.nelements, dtype=np.int64)
    for name in material:
        count[named[name]] += 1
    if np.any(count != 1):
        raise ModelError(
            f"material: {np.sum(count == 0)} elements lie in no region with a material and {np.sum(count > 1)} in two "
            f"(regions given: {', '.join(material)}; the mesh has {', '.join(sorted(named))})"
        )
    return tuple(
        (
            _revolved(value if isinstance(value, Material | Orthotropic) else material_from(value)),
            np.asarray(named[name]),
        )
        for name, value in material.items()
    )


def _revolved(solid: Solid) -> Solid:
    """``solid`` if its stiffness is the same in every meridian: turned by an eighth and by a quarter about z."""
    given = stiffness_tensor(solid.elasticity)
    for angle in (math.pi / 4, math.pi / 2):
        c, s = math.cos(angle), math.sin(angle)
        q = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        turned = np.einsum("ai,bj,ijkl,ck,dl->abcd", q, q, given, q, q, optimize=True)
        if (off := np.abs(turned - given).max() / np.abs(given).max()) > 1e-6:
            raise ModelError(
                f"material {solid.name!r}: its stiffness changes by {off:.1%} when it is turned by "
                f"{math.degrees(angle):g} degrees about z; an axisymmetric model needs E_1 = E_2, nu_13 = nu_23, "
                "G_13 = G_23 and G_12 = E_1/(2 (1 + nu_12)) with axis 3 along z: model the body in three dimensions"
            )
    return solid


def per_cell(regions: Regions, n_cells: int, value: Callable[[Solid], Array]) -> Array:
    """(n_cells, ...) a property of each cell's material."""
    first = value(regions[0][0])
    out = np.empty((n_cells, *first.shape))
    for solid, cells in regions:
        out[cells] = value(solid)
    return out
