"""What of a mesh from a file counts for a plan: its surface and its regions."""

from __future__ import annotations

import numpy as np

from seatfem.structures.inspection.shape import Array, Integers, Shape
from seatfem.structures.mesh.meridian import MeridianMesh
from seatfem.structures.mesh.seat_mesh import SeatMesh


def shape_of(mesh: SeatMesh) -> Shape:
    """The surface of the mesh with its named faces, as straight triangles that look outwards, two per quadrilateral."""
    solid = mesh.mesh
    outside = np.unique(np.concatenate([solid.boundary_facets(), *(solid.boundaries or {}).values()]))
    corners = solid.facets[:, outside].T
    points = np.ascontiguousarray(solid.doflocs[:, : int(solid.t.max()) + 1].T)
    if corners.shape[1] == 4:
        corners = _around(corners, points)
    inner = points[solid.t[:, solid.f2t[0, outside]]].mean(axis=0)
    edges = points[corners[:, 1:3]] - points[corners[:, :1]]
    inwards = np.einsum("ij,ij->i", np.cross(edges[:, 0], edges[:, 1]), points[corners[:, 0]] - inner) < 0
    corners[inwards] = corners[inwards][:, ::-1]
    halves = [corners[:, [0, k, k + 1]] for k in range(1, corners.shape[1] - 1)]
    triangles = np.concatenate(halves)
    row = np.full(solid.facets.shape[1], -1)
    row[outside] = np.arange(len(outside))
    groups = {
        name: np.concatenate([row[facets] + part * len(outside) for part in range(len(halves))])
        for name, facets in (solid.boundaries or {}).items()
    }
    return Shape(points, triangles, groups, np.zeros((0, 4), np.int64), mesh.quality.volume)


def _around(quadrilaterals: Integers, points: Array) -> Integers:
    """(n, 4) vertices in order around each quadrilateral, by their angles about its middle."""
    arms = points[quadrilaterals] - points[quadrilaterals].mean(axis=1, keepdims=True)
    crosses = np.cross(arms[:, :1], arms[:, 1:])
    normal = crosses[np.arange(len(arms)), np.linalg.norm(crosses, axis=2).argmax(axis=1)]
    across = np.cross(normal, arms[:, 0])
    across *= (np.linalg.norm(arms[:, 0], axis=1) / np.linalg.norm(across, axis=1))[:, None]
    angles = np.arctan2(np.einsum("nij,nj->ni", arms, across), np.einsum("nij,nj->ni", arms, arms[:, 0]))
    return np.asarray(np.take_along_axis(quadrilaterals, angles.argsort(axis=1), axis=1))


def regions_of(mesh: SeatMesh | MeridianMesh) -> tuple[str, ...]:
    """Names of its volumes that materials may be given to; of a mesh that names none "seat"."""
    return tuple(name for name in mesh.mesh.subdomains or () if name != "seat") or ("seat",)
