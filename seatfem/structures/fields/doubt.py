"""What a mesh leaves in the largest stress of all places, by another mesh of the same body."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from seatfem.structures.model import Array

REACH: Final = 2.0  # over the distance of the coarser mesh's sites: within it either mesh has its own largest stress


def left_by_mesh(points: Array, stress: Array, coarser_points: Array, on_coarser: Array, weight: float) -> float:
    """Return the error of the largest ``stress`` (P,) at points (P, d), by that of a coarser mesh (Q,) at points (Q, d)
    [Pa].

    Any place may bear what it has, more or less ``weight`` times what the coarser mesh changes there; the largest of
    all places lies between the largest of either. The larger of two that lie apart may change little from mesh to
    mesh, and the other, where the mesh is too coarse, overtake it. Sites of two meshes are not the same: the largest
    stresses around each are compared.
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
