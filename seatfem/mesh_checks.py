"""What must hold of a mesh before it is used."""

from __future__ import annotations

import numpy as np

from seatfem.mesh_io import MeshArrays, MeshError
from seatfem.mesh_quality import scaled_jacobian


def check_mesh(arrays: MeshArrays, required: tuple[str, ...] = ("contact", "fixed")) -> None:
    """Raise `MeshError` for a missing or empty group, coordinates that are not finite, and inverted elements."""
    check_groups(arrays, required)
    check_elements(arrays)


def check_groups(arrays: MeshArrays, required: tuple[str, ...]) -> None:
    """Every required surface group is there, and no group is empty."""
    for name in required:
        if name not in arrays.surfaces:
            there = ", ".join(map(repr, sorted(arrays.surfaces))) or "none"
            raise MeshError(f"{arrays.source}: no surface group named {name!r}; the mesh has: {there}")
    for kind, groups in (("surface", arrays.surfaces), ("volume", arrays.volumes)):
        for name, members in groups.items():
            if len(members) == 0:
                raise MeshError(f"{arrays.source}: {kind} group {name!r} is empty")


def check_elements(arrays: MeshArrays) -> None:
    """Finite coordinates and no inverted element."""
    if not np.all(np.isfinite(arrays.points)):
        raise MeshError(f"{arrays.source}: {np.sum(~np.isfinite(arrays.points))} node coordinates are not finite")
    jacobian = scaled_jacobian(arrays)
    inverted = np.flatnonzero(~(jacobian > 0.0))
    if len(inverted):
        worst = inverted[np.argmin(jacobian[inverted])]
        x, y, z = 1e3 * arrays.points[arrays.vertices[worst]].mean(axis=0)
        raise MeshError(
            f"{arrays.source}: {len(inverted)} inverted elements, the worst (scaled Jacobian {jacobian[worst]:.3g}) "
            f"near ({x:.4g}, {y:.4g}, {z:.4g}) mm; use smaller elements there, or curved = False"
        )
