"""Flat corners of plane meshes are found by their curved edges, and cut away without changing the union."""

import numpy as np
import pytest

from seatfem.structures.mesh._gmsh_worker import FLAT, corner_angles, without_flat_corners


def area(points, cells) -> float:
    total = 0.0
    for cell in cells:
        x, y = points[list(cell)].T
        total += float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2
    return total


def angles_of(points, cells):
    angles = {}
    for cell in cells:
        x = points[list(cell)]
        nodes = np.vstack([x, (x + np.roll(x, -1, axis=0)) / 2, *([x.mean(axis=0)] * (len(cell) == 4))])
        angles[cell] = corner_angles(nodes, np.arange(len(nodes))[None, :])[0]
    return angles


def test_angles_follow_the_curved_edges():
    # the quarter circle from (1, 0) to (0, 1) in two quadratic edges and the chord: pi at the vertex between them
    c, s = np.cos(np.pi / np.array([8, 4])), np.sin(np.pi / np.array([8, 4]))
    corners = np.array([[1.0, 0.0], [c[1], s[1]], [0.0, 1.0]])
    middles = np.array([[c[0], s[0]], [s[0], c[0]], [0.5, 0.5]])
    angles = corner_angles(np.vstack([corners, middles]), np.arange(6)[None, :])[0]
    assert angles[1] == pytest.approx(np.pi, abs=0.05)
    assert angles[[0, 2]] == pytest.approx(np.pi / 4, abs=0.03)


@pytest.mark.parametrize(
    ("points", "cells"),
    [
        ([(0, 0), (1, 0), (2, 0), (1, 2)], [(0, 1, 2, 3)]),  # a quadrilateral with a flat corner
        ([(0, 0), (1, -0.05), (2, 0), (1, 2)], [(0, 2, 3), (0, 1, 2)]),  # an ear beside a triangle
        ([(0, 0), (1, -0.05), (2, 0), (2, 2), (0, 2)], [(0, 2, 3, 4), (0, 1, 2)]),  # beside a quadrilateral
    ],
)
def test_the_union_stays(points, cells):
    points = np.array(points, dtype=float)
    removed, added = without_flat_corners(points, angles_of(points, cells))
    assert removed
    kept = [cell for cell in cells if cell not in removed]
    assert area(points, kept + added) == pytest.approx(area(points, cells), rel=1e-14)
    assert max(angle.max() for angle in angles_of(points, kept + added).values()) < FLAT
