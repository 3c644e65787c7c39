"""Local maxima of stress, singular points (reentrant corners, ends of clamped faces), and mesh error of the maxima."""

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from seatfem.structures.elements.mindlin import PlateMesh, shapes_at
from seatfem.structures.fields.sites import outer_facets
from seatfem.structures.model import Array

SHARPEST: Final = math.radians(30)  # largest turn between two facets of a smooth surface


def singular_points(mesh: Any, clamped: Sequence[str]) -> Array:
    """Return the (k, d) points on singular edges of a mesh [m]: vertices, and of a solid also the edges' midpoints.

    An edge is singular where its two facets turn inwards by more than `SHARPEST`, or only one of them is clamped.
    """
    mesh = getattr(mesh, "mesh", mesh)
    held = np.zeros(mesh.facets.shape[1], dtype=bool)
    for name in clamped:
        held[np.asarray((mesh.boundaries or {})[name])] = True
    facets, elements, which = outer_facets(mesh)
    vertices = mesh.t[np.asarray(mesh.elem.refdom.facets)[which], elements[:, None]]
    middles, normals = mesh.p.T[vertices].mean(axis=1), _normals(mesh, vertices, elements)
    edges, sides = _edges(vertices, mesh.dim())
    order = np.lexsort(edges.T)
    edges, sides = edges[order], sides[order]
    pair = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    edge, one, two = edges[pair], sides[pair], sides[pair + 1]
    opening = np.einsum("ea,ea->e", normals[one], middles[two] - middles[one])
    turn = np.einsum("ea,ea->e", normals[one], normals[two])
    inwards = (opening > 0) & (turn < math.cos(SHARPEST))
    ends = held[facets[one]] != held[facets[two]]
    chosen = mesh.p.T[edge[inwards | ends]]
    return np.concatenate([chosen.reshape(-1, mesh.dim()), chosen.mean(axis=1)])


def near(points: Array, singular: Array, distance: float) -> NDArray[np.bool_]:
    """Return a (P,) mask of the points closer than ``distance`` [m] to a singular point."""
    return np.asarray(edge_distances(points, singular) < distance * (1 - 1e-9))


def _normals(mesh: Any, vertices: NDArray[np.int64], elements: NDArray[np.int64]) -> Array:
    """Return the (f, d) outward normals of flat facets through the vertices."""
    corners = mesh.p.T[vertices]
    if mesh.dim() == 2:
        along = corners[:, 1] - corners[:, 0]
        across = np.stack([along[:, 1], -along[:, 0]], axis=1)
    else:
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
    inside = mesh.p.T[mesh.t[:, elements].T].mean(axis=1)
    across *= np.sign(np.einsum("fa,fa->f", across, corners.mean(axis=1) - inside))[:, None]
    return np.asarray(across / np.linalg.norm(across, axis=1)[:, None])


def _edges(vertices: NDArray[np.int64], dim: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the sorted vertices (e, d - 1) of each edge of each facet, and the number (e,) of its facet."""
    count, size = vertices.shape
    if dim == 2:
        return vertices.reshape(-1, 1), np.repeat(np.arange(count), 2)
    ring = np.stack([vertices, np.roll(vertices, -1, axis=1)], axis=-1)
    return np.sort(ring.reshape(-1, 2), axis=1), np.repeat(np.arange(count), size)


def sharp_nodes(mesh: PlateMesh) -> Array:
    """Return the (k, 2) vertices of a plate's outline at which it turns inwards by more than `SHARPEST` [m]."""
    vertices = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
    tangents = np.einsum("qks,mkc->mqsc", shapes_at(vertices)[1], mesh.points[mesh.cells])
    one, two = tangents[:, :, 0] * -vertices[:, :1], tangents[:, :, 1] * -vertices[:, 1:]
    size = np.linalg.norm(one, axis=2) * np.linalg.norm(two, axis=2)
    angles = np.arccos(np.clip(np.sum(one * two, axis=2) / size, -1.0, 1.0))
    around = np.bincount(mesh.cells[:, :4].ravel(), angles.ravel(), len(mesh.points))
    return mesh.points[(around > math.pi + SHARPEST) & (around < 2 * math.pi - 1e-3)]


def local_maxima(points: Array, values: Array, apart: float, *, least: float = 0.0) -> NDArray[np.int64]:
    """Return the indices of the points (P, d) whose value (P,) is the largest within a radius ``apart`` [m], the
    largest first; of equal values the first counts. Values below ``least`` times the largest are ignored."""
    order = np.lexsort((np.arange(len(values)), -values))
    order = order[values[order] >= least * values.max(initial=0.0)]
    rank = np.full(len(values), len(values))
    rank[order] = np.arange(len(order))
    tree, maxima = cKDTree(points), []
    for number in order:
        if rank[tree.query_ball_point(points[number], apart)].min() == rank[number]:
            maxima.append(int(number))
    return np.array(maxima, dtype=np.int64)


def edge_distances(points: Array, singular: Array) -> Array:
    """Return the (P,) distances from each point to the nearest singular point [m]; ``inf`` if there is none."""
    if not len(singular):
        return np.full(len(points), np.inf)
    return np.asarray(cKDTree(singular).query(points)[0])


REACH: Final = 2.0  # radius in which maxima of two meshes are compared, over the spacing of the coarser mesh's points


def peak_mesh_error(points: Array, stress: Array, coarser_points: Array, on_coarser: Array, weight: float) -> float:
    """Return the mesh error of the largest ``stress`` (P,) at points (P, d) [Pa], by that (Q,) on a coarser mesh.

    At each point the stress is uncertain by ``weight`` times its change from the coarser mesh; the error bounds the
    maximum over all points within these intervals, as a hot spot that is resolved badly may exceed the present
    maximum. The points of two meshes differ: the maxima within `REACH` of each point are compared.
    """
    trees = cKDTree(points), cKDTree(coarser_points)
    coarse = trees[1]
    reach = REACH * float(np.median(coarse.query(coarser_points, k=[2])[0]))
    nearest = np.asarray(coarse.query(points)[1])
    near, coarse_near = (
        [np.asarray(each, dtype=int) for each in tree.query_ball_point(points, reach)] for tree in trees
    )
    fine_peaks = np.array([stress[each].max() for each in near])
    coarse_peaks = np.array([on_coarser[[*each, k]].max() for each, k in zip(coarse_near, nearest, strict=True)])
    change, peak = np.abs(coarse_peaks - fine_peaks), float(stress.max())
    return float(max((stress + weight * change).max() - peak, peak - (stress - weight * change).max()))
