"""Arrays -> scikit-fem meshes, on meshes small enough to write by hand, and the reading of .msh files."""

import dataclasses

import numpy as np
import pytest

from seatfem.structures.formats.mesh_files import read_mesh
from seatfem.structures.mesh.checks import check_mesh, scaled_jacobian
from seatfem.structures.mesh.io import CELL_KINDS, TET_EDGES, MeshArrays, MeshError, serendipity_to_27, to_skfem

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


def test_twenty_nodes_become_twentyseven():
    arrays = grid(27)
    x, y, z = arrays.points.T
    # All products of the 20 shape functions' space up to x y z^2.
    arrays.points[:] += 0.05 * np.c_[x * y * z**2 - y**2, x**2 * y + z, x * z - y * z**2]
    used, cells = np.unique(arrays.cells[:, :20], return_inverse=True)
    points, filled = serendipity_to_27(arrays.points[used], cells.reshape(-1, 20))
    assert len(points) == len(arrays.points)
    assert np.allclose(points[filled], arrays.points[arrays.cells], rtol=0, atol=1e-14)


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


def test_folded_elements_are_located():
    folded = one_tet(2)
    folded.points[4] += [0.0, 0.4, 0.0]  # 1.6 L0 L1 along y takes away more than the element's own gradient at node 1
    assert scaled_jacobian(folded)[0] < 0.0
    with pytest.raises(MeshError, match=r"1 inverted elements, folded.*near \(250, 250, 250\) mm"):
        check_mesh(folded)


def test_coordinates_must_be_finite():
    broken = one_tet()
    broken.points[2, 1] = np.nan
    with pytest.raises(MeshError, match="1 node coordinates must be finite"):
        check_mesh(broken)


MSH2 = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
2 1 "top"
2 2 "fixed"
3 3 "seat"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
$EndNodes
$Elements
3
1 2 2 1 1 2 3 4
2 2 2 2 2 1 3 2
3 4 2 3 1 1 2 3 4
$EndElements
"""


def test_msh_version_2_with_own_names_and_unit(tmp_path):
    path = tmp_path / "part.msh"
    path.write_text(MSH2)
    seat = read_mesh(path, contact="top", unit=1e-3)
    assert seat.order == 1
    assert set(seat.mesh.boundaries) == {"contact", "fixed"}
    assert seat.quality.volume == pytest.approx(1e-9 / 6, rel=1e-12)
    assert seat.quality.cad_volume is None
    with pytest.raises(MeshError, match=r"part.msh: no surface group named 'contact'; the file has: 'fixed', 'top'"):
        read_mesh(path)


def test_wrong_kind_of_file(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such mesh file"):
        read_mesh(tmp_path / "none.msh")
    step = tmp_path / "a.step"
    step.write_text("")
    with pytest.raises(MeshError, match=r"make_mesh\(CadPart"):
        read_mesh(step)
