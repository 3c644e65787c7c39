"""The mesh of a seat: what every way to it ends with."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from impact.brief import brief
from seatfem.structures.mesh.cell_kinds import distinct
from seatfem.structures.mesh.checks import check_mesh
from seatfem.structures.mesh.io import MeshArrays, MeshError, SolidMesh, to_skfem
from seatfem.structures.mesh.quality import MeshQuality, measure

PLURALS = MappingProxyType({"tetrahedron": "tetrahedra", "hexahedron": "hexahedra"})


@dataclass(frozen=True)
class MeshProvenance:
    """The origin of a mesh.

    ``geometry`` and ``spec`` are plain data, empty where it was read from a file; ``gmsh_version``: "" where gmsh had
    no part in it; ``notes``: what was mended on the way.
    """

    source: str
    content_hash: str
    gmsh_version: str
    geometry: Mapping[str, Any]
    spec: Mapping[str, Any]
    notes: tuple[str, ...] = ()


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

    __repr__ = brief

    def __str__(self) -> str:
        q = self.quality
        patches = ", ".join(f"{name} {1e6 * area:.5g} mm^2" for name, area in q.areas.items())
        return (
            f"{self.provenance.source}: {q.nodes} nodes ({3 * q.nodes} dof), {q.elements} {PLURALS[self.shape]} of "
            f"order {self.order}, volume {1e9 * q.volume:.6g} mm^3, {patches}, "
            f"smallest scaled Jacobian {q.min_scaled_jacobian:.2f}"
            + "".join(f"; {note}" for note in self.provenance.notes)
        )


def seat_mesh(
    arrays: MeshArrays,
    provenance: MeshProvenance,
    cad_volume: float | None = None,
    cad_areas: Mapping[str, float] = MappingProxyType({}),
    required: tuple[str, ...] = ("contact", "fixed"),
    parts: int = 1,
) -> SeatMesh:
    """Return the mesh checked, converted and measured. Raises `MeshError` like `check_mesh` and `to_skfem`."""
    checked = check_mesh(arrays, required, parts)
    notes = list(provenance.notes)
    if checked is not arrays:
        notes.append("all elements were in mirrored node order and are reordered")
    if loose := len(arrays.points) - len(distinct(arrays.cells)):
        notes.append(f"{loose} nodes of no element are dropped")
    mesh = to_skfem(checked)
    _check_outside(mesh, required, arrays.source)
    quality = measure(mesh, checked, cad_volume, cad_areas)
    return SeatMesh(mesh, arrays.order, quality, dataclasses.replace(provenance, notes=tuple(notes)), arrays.shape)


def _check_outside(mesh: SolidMesh, names: tuple[str, ...], source: str) -> None:
    for name in names:
        facets = mesh.boundaries[name]
        inside = int(np.sum(mesh.f2t[1, facets] >= 0))
        if inside:
            raise MeshError(
                f"{source}: {inside} of {len(facets)} faces of {name!r} lie inside the mesh: must be outside"
            )
