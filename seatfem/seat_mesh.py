"""The mesh of a seat: what every road to it ends with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from seatfem.mesh_checks import check_mesh
from seatfem.mesh_io import MeshArrays, SolidMesh, to_skfem
from seatfem.mesh_quality import MeshQuality, measure

PLURALS = MappingProxyType({"tetrahedron": "tetrahedra", "hexahedron": "hexahedra"})


@dataclass(frozen=True)
class MeshProvenance:
    """Where a mesh came from. ``geometry`` and ``spec`` are plain data, empty where it was read from a file."""

    source: str
    content_hash: str
    gmsh_version: str
    geometry: Mapping[str, Any]
    spec: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class SeatMesh:
    """Mesh of a seat in metres, of tetrahedra or hexahedra.

    ``mesh``: scikit-fem's, with boundaries "contact" and "fixed" (and others) and the subdomain "seat" (and others):
    MeshTet or MeshHex for order 1, MeshTet2 or MeshHex2 (isoparametric) for order 2. ``shape``: of its elements,
    "tetrahedron" or "hexahedron".
    """

    mesh: SolidMesh
    order: int
    quality: MeshQuality
    provenance: MeshProvenance
    shape: str = "tetrahedron"

    def __str__(self) -> str:
        q = self.quality
        patches = ", ".join(f"{name} {1e6 * area:.5g} mm^2" for name, area in q.areas.items())
        return (
            f"{self.provenance.source}: {q.nodes} nodes ({3 * q.nodes} dof), {q.elements} {PLURALS[self.shape]} of "
            f"order {self.order}, volume {1e9 * q.volume:.6g} mm^3, {patches}, "
            f"smallest scaled Jacobian {q.min_scaled_jacobian:.2f}"
        )


def seat_mesh(
    arrays: MeshArrays,
    provenance: MeshProvenance,
    cad_volume: float | None = None,
    cad_areas: Mapping[str, float] = MappingProxyType({}),
    required: tuple[str, ...] = ("contact", "fixed"),
) -> SeatMesh:
    """Checked, measured and converted. Raises `MeshError` like `check_mesh` and `to_skfem`."""
    check_mesh(arrays, required)
    mesh = to_skfem(arrays)
    return SeatMesh(mesh, arrays.order, measure(mesh, arrays, cad_volume, cad_areas), provenance, arrays.shape)
