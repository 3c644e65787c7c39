"""Arrays -> scikit-fem meshes, on meshes small enough to write by hand, and the reading of .msh files."""

import dataclasses

import numpy as np
import pytest

from seatfem.structures.formats.mesh_files import read_mesh
from seatfem.structures.mesh.checks import check_mesh
from seatfem.structures.mesh.io import CELL_KINDS, TET_EDGES, MeshArrays, MeshError, to_skfem

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
CONTACT, FIXED = np.array([[1, 2, 3]]), np.array([[0, 2, 1]])


def one_tet(order: int = 1) -> MeshArrays:
    middle = [(CORNERS[i] + CORNERS[j]) / 2 for i, j in TET_EDGES]
    points = np.vstack([CORNERS, middle]) if order == 2 else CORNERS
    tets = np.arange(len(points))[None, :]
    return MeshArrays(points, tets, {"contact": CONTACT, "fixed": FIXED}, {}, "one.msh")


def grid(nodes: int) -> MeshArrays:
    """2 x 2 x 1 hexahedra of 8 or 27 nodes on [0, 2] x [0, 2] x [0, 1]."""
    shifts = np.array([(i, j, 0) for i in range(2) for j in range(2)], dtype=float)
    every = (CELL_KINDS[nodes].nodes[None] + shifts[:, None]).reshape(-1, 3)
    points, cells = np.unique(every, axis=0, return_inverse=True)
    number = {tuple(point): k for k, point in enumerate(points)}
    top = np.array([[number[i + x, j + y, 1.0] for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))] for i, j, _ in shifts])
    return MeshArrays(points, cells.reshape(-1, nodes), {"contact": top}, {}, "grid")


def test_faces_that_are_none():
    arrays = dataclasses.replace(grid(8), surfaces={"contact": np.array([[0, 1, 2, 17]])})
    with pytest.raises(MeshError, match=r"grid: 1 of 1 quadrilaterals of 'contact' must be faces of its elements"):
        to_skfem(arrays)
    with pytest.raises(MeshError, match=r"faces of 'contact' have 3 vertices, must be quadrilaterals"):
        to_skfem(dataclasses.replace(arrays, surfaces={"contact": np.array([[0, 1, 2]])}))
    with pytest.raises(MeshError, match=r"cells of shape \(1, 6\): must be \(m, 4\) or"):
        dataclasses.replace(arrays, cells=np.zeros((1, 6), dtype=int))


@pytest.mark.parametrize(
    ("surfaces", "message"),
    [
        ({"fixed": FIXED}, r"one.msh: no surface group named 'contact'; the mesh has: 'fixed'"),
        ({"contact": CONTACT}, r"no surface group named 'fixed'; the mesh has: 'contact'"),
        ({}, r"the mesh has: none"),
        ({"contact": CONTACT[:0], "fixed": FIXED}, r"one.msh: surface group 'contact' is empty"),
    ],
)
def test_bad_groups(surfaces, message):
    with pytest.raises(MeshError, match=message):
        check_mesh(dataclasses.replace(one_tet(), surfaces=surfaces))


def test_coordinates_must_be_finite():
    broken = one_tet()
    broken.points[2, 1] = np.nan
    with pytest.raises(MeshError, match="1 node coordinates must be finite"):
        check_mesh(broken)


def test_wrong_kind_of_file(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such mesh file"):
        read_mesh(tmp_path / "none.msh")
    step = tmp_path / "a.step"
    step.write_text("")
    with pytest.raises(MeshError, match=r"make_mesh\(CadPart"):
        read_mesh(step)
