"""What a mesh must not be: flat, inside out, in pieces, unmerged, without its groups; and what is mended."""

import dataclasses

import numpy as np
import pytest

from seatfem.structures.errors import MeshError
from seatfem.structures.formats.mesh_files import read_mesh
from seatfem.structures.mesh.checks import (
    check_coincident,
    check_mesh,
    check_parts,
    part_of_element,
    scaled_jacobian,
    straight_determinants,
)
from seatfem.structures.mesh.io import CELL_KINDS, TET_EDGES, MeshArrays, to_skfem

NONE = ()


def reference_element(nodes):
    return MeshArrays(CELL_KINDS[nodes].nodes.copy(), np.arange(nodes)[None, :], {}, {}, "one.inp")


def side_by_side(nodes, gap):
    """Return two equal elements, the second moved along x; no node is shared."""
    one = reference_element(nodes)
    points = np.vstack([one.points, one.points + np.array([1.0 + gap, 0.0, 0.0])])
    return MeshArrays(points, np.arange(2 * nodes).reshape(2, nodes), {}, {}, "two.inp")


@pytest.mark.parametrize("nodes", CELL_KINDS)
def test_a_mirrored_mesh_is_turned_right_side_out(nodes):
    one = reference_element(nodes)
    mirrored = dataclasses.replace(one, points=one.points * [1.0, 1.0, -1.0])
    assert straight_determinants(mirrored)[0] < 0.0
    mended = check_mesh(mirrored, NONE)
    assert sorted(mended.cells[0]) == list(range(nodes))
    # Right for the nodes on edges and faces too: the map is a mirror image, so det J = 1 everywhere.
    assert scaled_jacobian(mended)[0] == pytest.approx(1.0, rel=1e-12)
    assert check_mesh(one, NONE) is one


@pytest.mark.parametrize("nodes", CELL_KINDS)
def test_one_inside_out_element_is_an_error(nodes):
    two = side_by_side(nodes, 1.0)
    two.points[nodes:] *= [1.0, 1.0, -1.0]
    with pytest.raises(MeshError, match=r"1 inside-out.*\(2"):
        check_mesh(two, NONE, parts=2)


@pytest.mark.parametrize("nodes", CELL_KINDS)
def test_flat_elements_are_located(nodes):
    two = side_by_side(nodes, 1.0)
    two.points[nodes:, 2] = 5.0
    with pytest.raises(MeshError, match=r"two.inp: 1 flat .*\(2.*, 5000\) mm"):
        check_mesh(two, NONE, parts=2)


@pytest.mark.parametrize("nodes", [8, 27])
def test_a_folded_hexahedron(nodes):
    one = reference_element(nodes)
    one.points[6] = [0.2, 0.2, 0.9]  # beyond the plane of its neighbours: det J < 0 at this vertex alone
    assert straight_determinants(one)[0] > 0.0
    with pytest.raises(MeshError, match=r"1 inverted .*Jacobian -"):
        check_mesh(one, NONE)


def test_parts_are_counted_and_accepted():
    two = side_by_side(8, 0.5)
    assert list(part_of_element(two)) == [0, 1]
    with pytest.raises(
        MeshError,
        match=r"2 parts .*\(2000, 500, 500\) mm.*parts = 2",
    ):
        check_parts(two)
    check_parts(two, 2)
    check_coincident(two)
    joined = dataclasses.replace(two, cells=two.cells.copy())
    joined.cells[1, 0] = joined.cells[0, 1]  # one common vertex holds them together
    check_parts(joined)


def test_unmerged_meshes_say_so():
    with pytest.raises(MeshError, match=r'4 nodes .*\(1000, 0, 0\).* merge = "20 um"'):
        check_coincident(side_by_side(8, 0.0))


DECK = """*Node
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
12, 1.00001, 0, 0
13, 2, 0, 0
14, 2, 1, 0
15, 1, 1, 0
16, 1, 0, 1
17, 2, 0, 1
18, 2, 1, 1
19, 1, 1, 1
99, 7, 7, 7
*Element, type=C3D8
1, 1, 2, 3, 4, 5, 6, 7, 8
2, 12, 13, 14, 15, 16, 17, 18, 19
*Nset, nset=Left
1, 4, 5, 8
*Nset, nset=Right
13, 14, 17, 18
"""


def test_merging_on_reading(tmp_path):
    path = tmp_path / "two.inp"
    path.write_text(DECK)
    with pytest.raises(MeshError, match=r"3 nodes.*another"):
        read_mesh(path, contact="Left", fixed="Right", unit=1.0)
    with pytest.raises(MeshError, match="2 parts that share no node"):
        read_mesh(path, contact="Left", fixed="Right", unit=1.0, merge=0.0)
    apart = read_mesh(path, contact="Left", fixed="Right", unit=1.0, merge=0.0, parts=2)
    assert apart.quality.nodes == 16
    whole = read_mesh(path, contact="Left", fixed="Right", unit=1.0, merge=1e-4)
    assert whole.quality.nodes == 12
    assert whole.quality.volume == pytest.approx(2.0, rel=1e-5)
    assert whole.quality.areas == pytest.approx({"contact": 1.0, "fixed": 1.0})
    assert whole.provenance.notes[-1].startswith("5 nodes ")
    assert "dropped" in str(whole)
    assert whole.provenance.content_hash != apart.provenance.content_hash


def test_a_patch_inside_the_mesh(tmp_path):
    path = tmp_path / "two.inp"
    path.write_text(
        DECK.replace("*Nset, nset=Right", "*Element, type=S4, elset=Middle\n3, 2, 3, 7, 6\n*Nset, nset=Right")
    )
    with pytest.raises(MeshError, match=r"1.*1.*'contact'.*inside"):
        read_mesh(path, contact="Middle", fixed="Right", unit=1.0, merge=1e-4)


CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
CONTACT, FIXED = np.array([[1, 2, 3]]), np.array([[0, 2, 1]])


def one_tet(order: int = 1) -> MeshArrays:
    middle = [(CORNERS[i] + CORNERS[j]) / 2 for i, j in TET_EDGES]
    points = np.vstack([CORNERS, middle]) if order == 2 else CORNERS
    tets = np.arange(len(points))[None, :]
    return MeshArrays(points, tets, {"contact": CONTACT, "fixed": FIXED}, {}, "one.msh")


def grid(nodes: int) -> MeshArrays:
    """Return 2 x 2 x 1 hexahedra of 8 or 27 nodes on [0, 2] x [0, 2] x [0, 1]."""
    shifts = np.array([(i, j, 0) for i in range(2) for j in range(2)], dtype=float)
    every = (CELL_KINDS[nodes].nodes[None] + shifts[:, None]).reshape(-1, 3)
    points, cells = np.unique(every, axis=0, return_inverse=True)
    number = {tuple(point): k for k, point in enumerate(points)}
    top = np.array([[number[i + x, j + y, 1.0] for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))] for i, j, _ in shifts])
    return MeshArrays(points, cells.reshape(-1, nodes), {"contact": top}, {}, "grid")


def test_faces_that_are_none():
    arrays = dataclasses.replace(grid(8), surfaces={"contact": np.array([[0, 1, 2, 17]])})
    with pytest.raises(MeshError, match=r"grid: 1.*1.*'contact'"):
        to_skfem(arrays)
    with pytest.raises(MeshError, match=r"'contact' .*3 vertices.*quadrilaterals"):
        to_skfem(dataclasses.replace(arrays, surfaces={"contact": np.array([[0, 1, 2]])}))
    with pytest.raises(MeshError, match=r"\(1, 6\):.*\(m, 4\)"):
        dataclasses.replace(arrays, cells=np.zeros((1, 6), dtype=int))


@pytest.mark.parametrize(
    ("surfaces", "message"),
    [
        ({"fixed": FIXED}, r"one.msh:.*'contact'.*'fixed'"),
        ({"contact": CONTACT}, r"'fixed'.*'contact'"),
        ({}, r"the mesh has: none"),
        ({"contact": CONTACT[:0], "fixed": FIXED}, r"one.msh:.*'contact'"),
    ],
)
def test_bad_groups(surfaces, message):
    with pytest.raises(MeshError, match=message):
        check_mesh(dataclasses.replace(one_tet(), surfaces=surfaces))


def test_coordinates_must_be_finite():
    broken = one_tet()
    broken.points[2, 1] = np.nan
    with pytest.raises(MeshError, match=r"1.*coordinates"):
        check_mesh(broken)


def test_wrong_kind_of_file(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such mesh file"):
        read_mesh(tmp_path / "none.msh")
    step = tmp_path / "a.step"
    step.write_text("")
    with pytest.raises(MeshError, match=r"make_mesh\(CadPart"):
        read_mesh(step)
