"""Plane meshes: half sections of solids of revolution, and mid-surfaces of thin plates."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from skfem import Basis, ElementTriP0, MeshTri, MeshTri2
from skfem.quadrature import get_quadrature

from impact.greens.base import Array
from impact.notices import Progress, silent
from impact.quantities import brief, percent
from seatfem.structures import errors
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.mesh import checks, io, meshing
from seatfem.structures.mesh.gmsh_process import STAGE, run_gmsh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import Flat, Geometry, GeometryError, Profile, encode

PlaneMesh: TypeAlias = MeshTri | MeshTri2
QUADRATURE = 8


@dataclass(frozen=True, eq=False)
class MeridianMesh:
    """Half section of a solid of revolution: x = r and y = z in metres.

    ``mesh``: scikit-fem's, of triangles (isoparametric for order 2), with the geometry's groups as boundaries:
    "contact", "fixed", and "axis" where the section touches r = 0.
    """

    mesh: PlaneMesh
    order: int
    quality: checks.MeshQuality
    provenance: meshing.MeshProvenance

    __repr__ = brief


def make_meridian(geometry: Geometry, spec: MeshSpec, progress: Progress = silent) -> MeridianMesh:
    """Mesh the half section of a solid of revolution with gmsh, graded like `make_mesh`.

    Raises `GeometryError` for a geometry that is no solid of revolution, and `MeshingError` where gmsh fails.
    """
    profile = getattr(geometry, "profile", None)
    if not isinstance(profile, Profile):
        raise GeometryError(f"{type(geometry).__name__} is no solid of revolution and has no meridian; use make_mesh")
    section = run_gmsh({"task": "section", "geometry": encode(geometry), "spec": asdict(spec)}, progress)
    mesh = plane_mesh(section)
    source = f"meridian of {type(geometry).__name__}"
    provenance = meshing.MeshProvenance(source, meshing.content_hash(geometry, spec, 0), spec.size)
    quality = _measure(mesh, profile)
    if not quality.min_scaled_jacobian > 0.0:
        raise GeometryError(f"{source}: an element is folded; use smaller elements, or curved = False")
    progress(STAGE, 1.0)
    return MeridianMesh(mesh, spec.order, quality, provenance)


def plane_mesh(section: Mapping[str, NDArray[Any]]) -> PlaneMesh:
    """Return scikit-fem's mesh of "points" (n, 2) = (r, z), "cells", and every "line:NAME" as a boundary."""
    cells, points = section["cells"], section["points"]
    used, t = np.unique(cells[:, :3], return_inverse=True)
    t = np.ascontiguousarray(t.reshape(-1, 3).T)
    number = np.full(len(points), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    flat = MeshTri(np.ascontiguousarray(points[used].T), t)
    lines = io.groups(section, "line")
    boundaries = {name: io.matched_facets(flat, number[ends], name, "meridian") for name, ends in lines.items()}
    if cells.shape[1] == 3:
        return MeshTri(flat.doflocs, t, boundaries)
    unsorted = MeshTri(flat.doflocs, t, sort_t=False)  # meshes of order 2 do not sort the vertices of an element
    places = io.node_places(unsorted, MeshTri2.elem(), points, cells, range(cells.shape[1]))
    return MeshTri2(places, t, boundaries)


def _measure(mesh: PlaneMesh, profile: Profile) -> checks.MeshQuality:
    cells = Basis(mesh, ElementTriP0(), intorder=QUADRATURE)
    places, weights = get_quadrature(mesh.brefdom, QUADRATURE)
    areas = {}
    for name, facets in mesh.boundaries.items():  # a FacetBasis would invert the elements' maps, to an absolute 1e-12
        lengths = np.abs(mesh.mapping().detDG(places, find=facets)) * weights
        areas[name] = float(2 * np.pi * np.sum(mesh.mapping().G(places, find=facets)[0] * lengths))
    corners = mesh.elem.doflocs[~np.isnan(mesh.elem.doflocs).any(axis=1)].T
    det = mesh.mapping().detDF(corners)
    mean = det.mean(axis=1)  # either sign: scikit-fem may reverse the vertex order
    return checks.MeshQuality(
        nodes=mesh.doflocs.shape[1],
        elements=mesh.nelements,
        min_scaled_jacobian=float(np.min((det * np.sign(mean[:, None])).min(axis=1) / np.abs(mean))),
        volume=float(2 * np.pi * np.sum(cells.global_coordinates().value[0] * cells.dx)),
        areas=areas,
        cad_volume=profile.volume,
        cad_areas={name: profile.area(name) for name in profile.names},
    )


CLAMPED: Final = "clamped"
IMAGE: Final = (0, 3, 2, 1, 7, 6, 5, 4, 8)  # node order that makes a mirrored element anticlockwise again
ON_THE_LINE: Final = 1e-9  # largest distance of a node on the line of symmetry, over the mesh's size
FINER: Final = (1.0, 0.7, 0.5)  # shares of the element size that are tried: large elements along a small hole may fold
AREA_TOLERANCE: Final = 0.01  # largest relative error of the area; that of a circle of eight curved elements is 1e-3


def mesh_sheet(shape: Flat, size: float) -> PlateMesh:
    """Return a sheet, meshed evenly with quadrilaterals of nine nodes that follow its outline.

    One that is symmetric about y = 0 is meshed on one side and mirrored, so that the mesh is symmetric as well. The
    nodes of a clamp are the line "clamped" of the mesh. Where elements fold, they are made smaller (`FINER`).

    ``size``: element size [m].

    Raises:
        GeometryError: a size that is not positive. MeshingError: gmsh fails. MeshError: an area that differs from the
        drawing's, or a clamp without nodes. ModelError: folded elements, also of the smallest size.
    """
    *larger, smallest = (share * size for share in FINER)
    for each in larger:
        with suppress(errors.ModelError):
            return _mesh_sheet(shape, each)
    return _mesh_sheet(shape, smallest)


def _mesh_sheet(shape: Flat, size: float) -> PlateMesh:
    parts = 2 if shape.is_mirrored else 1
    spec = asdict(MeshSpec(size))
    arrays = run_gmsh({"task": "plan", "geometry": encode(shape), "spec": spec, "sectors": parts})
    used, rows = np.unique(arrays["cells"], return_inverse=True)
    points, cells, lines = arrays["points"][used], rows.reshape(arrays["cells"].shape), {}
    if parts == 2:
        points, cells = with_image(points, cells)
    if shape.is_clamped:
        lines[CLAMPED] = np.flatnonzero(shape.clamped(points))
        if not len(lines[CLAMPED]):
            raise errors.MeshError(f"{shape.source}: no node lies where it is clamped; mesh finer")
    mesh, drawn = PlateMesh(points, cells, lines), parts * float(arrays["area"])
    if abs(mesh.area / drawn - 1) > AREA_TOLERANCE:
        raise errors.MeshError(
            f"{shape.source}: the mesh has {percent(mesh.area / drawn - 1, sign=True)} more area than the drawing"
        )
    return mesh


def with_image(points: Array, cells: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Return points (n, 2) and cells (m, 9) together with their image about y = 0; nodes on that line are shared."""
    off = np.abs(points[:, 1]) > ON_THE_LINE * np.ptp(points)
    half = points * np.column_stack([np.ones(len(points)), off])
    image = np.where(off, len(points) + np.cumsum(off) - 1, np.arange(len(points)))
    return np.vstack([half, half[off] * (1, -1)]), np.vstack([cells, image[cells][:, IMAGE]])
