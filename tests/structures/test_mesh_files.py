"""What a mesh must not be, and what is mended; mesh files that gmsh and VTK write: the same mesh comes out of each."""

import dataclasses
import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from seatfem.structures.mesh.checks import check_mesh, scaled_jacobian, straight_determinants
from seatfem.structures.mesh.io import CELL_KINDS, MeshArrays, to_skfem
from tests.solids import MeshError, read_mesh

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
@pytest.mark.parametrize(
    ("low", "high", "message"), [(0.0, -1.0, r"1 inside-out.*\(2"), (5.0, 0.0, r"two.inp: 1 flat .*\(2.*, 5000\) mm")]
)
def test_an_element_inside_out_or_flat_is_located(nodes, low, high, message):
    two = side_by_side(nodes, 1.0)
    two.points[nodes:, 2] = low + high * two.points[nodes:, 2]
    with pytest.raises(MeshError, match=message):
        check_mesh(two, NONE, parts=2)


@pytest.mark.parametrize("nodes", [8, 27])
def test_a_folded_hexahedron(nodes):
    one = reference_element(nodes)
    one.points[6] = [0.2, 0.2, 0.9]  # beyond the plane of its neighbours: det J < 0 at this vertex alone
    assert straight_determinants(one)[0] > 0.0
    with pytest.raises(MeshError, match=r"1 inverted .*Jacobian -"):
        check_mesh(one, NONE)


CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
PLACES = dict(enumerate(CUBE, 1)) | {k: (x + 1, y, z) for k, (x, y, z) in enumerate(CUBE, 12)}
PLACES |= {12: (1.00001, 0, 0), 99: (7, 7, 7)}
"""Two cubes, each with its own nodes between them, one of which is off, and a node of none."""
DECK = "*Node\n" + "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in PLACES.items())
DECK += "*Element, type=C3D8\n1, 1, 2, 3, 4, 5, 6, 7, 8\n2, 12, 13, 14, 15, 16, 17, 18, 19\n"
DECK += "*Nset, nset=Left\n1, 4, 5, 8\n*Nset, nset=Right\n13, 14, 17, 18\n"


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


CONTACT, FIXED = np.array([[1, 2, 3]]), np.array([[0, 2, 1]])


def one_tet() -> MeshArrays:
    return dataclasses.replace(reference_element(4), surfaces={"contact": CONTACT, "fixed": FIXED})


def test_faces_that_are_none():
    arrays = dataclasses.replace(reference_element(8), surfaces={"contact": np.array([[0, 1, 2, 6]])})
    with pytest.raises(MeshError, match=r"one.inp: 1.*1.*'contact'"):
        to_skfem(arrays)
    with pytest.raises(MeshError, match=r"'contact' .*3 vertices.*quadrilaterals"):
        to_skfem(dataclasses.replace(arrays, surfaces={"contact": np.array([[0, 1, 2]])}))
    with pytest.raises(MeshError, match=r"\(1, 6\):.*\(m, 4\)"):
        dataclasses.replace(arrays, cells=np.zeros((1, 6), dtype=int))


@pytest.mark.parametrize(
    ("surfaces", "message"),
    [
        ({"fixed": FIXED}, r"one.inp:.*'contact'.*'fixed'"),
        ({"contact": CONTACT}, r"'fixed'.*'contact'"),
        ({}, r"the mesh has: none"),
        ({"contact": CONTACT[:0], "fixed": FIXED}, r"one.inp:.*'contact'"),
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


UNIT = 1e-2  # metres; the files of `write_mesh_files` are in centimetres
RING = 3 * math.pi / 4 * UNIT**3


def ring(files, name, **options):
    groups = {"contact": "PID 6", "fixed": "PID 1"} if name.endswith("bdf") else {}
    return read_mesh(files / name, unit=UNIT, **(groups | options))


def sorted_nodes(seat):
    """Nodes in an order that does not depend on their numbers."""
    places = np.round(seat.mesh.doflocs.T / UNIT, 5)
    return places[np.lexsort(places.T)]


CASES = [
    *itertools.product(("tet-2", "hex-2"), ("msh2.msh", "msh2bin.msh", "msh4bin.msh", "med")),
    *itertools.product(("tet-2", "hex20-2"), ("unv", "bdf")),
    *itertools.product(("tet-1", "hex-1"), ("msh2.msh", "med", "unv", "bdf")),
    *itertools.product(("tet-1", "tet-2", "hex-1", "hex-2", "hex20-2"), ("inp",)),
]


@pytest.fixture(scope="module")
def reference(written_meshes):
    return {name: ring(written_meshes, f"{name}-2.msh4.msh") for name in ("tet-1", "tet-2", "hex-1", "hex-2")}


@pytest.mark.slow(only=("tet-2-msh2",))
@pytest.mark.parametrize(("name", "ending"), CASES)
def test_every_format_gives_the_same_mesh(written_meshes, reference, name, ending):
    seat, same = ring(written_meshes, f"{name}-2.{ending}"), reference[name.replace("hex20", "hex")]
    # The small fields of .bdf hold six digits.
    tolerance = 3e-6 if ending == "bdf" else 1e-12
    assert (seat.order, seat.shape) == (same.order, same.shape)
    assert seat.quality.elements == same.quality.elements
    assert seat.quality.volume == pytest.approx(same.quality.volume, rel=tolerance)
    for patch in ("contact", "fixed"):
        assert seat.quality.areas[patch] == pytest.approx(same.quality.areas[patch], rel=tolerance)
        place = seat.mesh.p[:, seat.mesh.facets[:, seat.mesh.boundaries[patch]]]
        assert np.allclose(place[2], UNIT if patch == "contact" else 0.0, atol=1e-9)
    assert len(seat.mesh.subdomains["PID 1" if ending == "bdf" else "steel"]) == seat.quality.elements
    assert np.allclose(sorted_nodes(seat), sorted_nodes(same), atol=2e-5)
    assert str(seat.shape)[:5] in str(seat)


@pytest.mark.parametrize(("name", "order"), [("tet-1", 2), ("hex-1", 2), ("tet-2", 4), ("hex-2", 4), ("hex20-2", 4)])
def test_curved_volume_converges(written_meshes, name, order):
    # A chord misses a circle's sector by O(h^2), the parabola through three of its points by O(h^4). From two to four
    # elements on the quarter the next term of the series is 2 % of the first, which moves the order by 0.03.
    errors = [RING - ring(written_meshes, f"{name}-{n}.inp").quality.volume for n in (2, 4)]
    assert errors[0] > errors[1] > 0.0
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)


# One element whose nodes stand at F(reference place), F = (x + A x z, y + B x^2, z): det F' = 1 + A z, and areas of the
# faces z = 0 and z = 1 in closed form. Reference places as the manuals print them.
A, B = 0.3, 0.2


def moved(places, curved):
    x, y, z = np.array(places, dtype=float).T
    return np.c_[x + A * x * z, y + (B * x**2 if curved else 0), z]


VTK = {"vtkTetra": 10, "vtkQuadraticTetra": 24, "vtkHexahedron": 12, "vtkQuadraticHexahedron": 25}
VTK |= {"vtkTriQuadraticHexahedron": 29}
VTK_FACES = {4: 5, 10: 22, 8: 9, 20: 23, 27: 28}  # cell type of the face of a cell of so many nodes


@pytest.mark.slow
@pytest.mark.parametrize("name", VTK)
def test_vtu_by_vtk_itself(tmp_path, name):
    pyvista = pytest.importorskip("pyvista")
    vtk = pytest.importorskip("vtk")
    cell = getattr(vtk, name)()
    nodes = cell.GetNumberOfPoints()
    places = np.array([cell.GetParametricCoords()[k] for k in range(3 * nodes)]).reshape(-1, 3)
    tet = nodes in (4, 10)
    for k in range(nodes):
        cell.GetPointIds().SetId(k, k)
    axis, level = (0, 0.0) if tet else (2, 1.0)
    sides = map(cell.GetFace, range(cell.GetNumberOfFaces()))
    faces = ([side.GetPointId(k) for k in range(side.GetNumberOfPoints())] for side in sides)
    face = next(ids for ids in faces if np.all(places[ids, axis] == level))
    grid = pyvista.UnstructuredGrid(
        np.array([nodes, *range(nodes), len(face), *face]),
        np.array([VTK[name], VTK_FACES[nodes]]),
        moved(places, nodes > 8),
    )
    grid.cell_data["contact"] = np.array([0, 1])
    grid.cell_data["material"] = np.array([7, 0])
    grid.cell_data["pressure"] = np.array([0.0, 1.0])
    grid.point_data["base"] = (places[:, 2] == 0).astype(np.uint8)
    path = tmp_path / "seat.vtu"
    grid.save(path)
    seat = read_mesh(path, fixed="base", unit=1.0)
    # First order: the tetrahedron's vertices stay where they are; the hexahedron's map is trilinear, F itself.
    exact = 1 / 6 if nodes == 4 else 1 / 6 + A / 24 if tet else 1 + A / 2
    assert seat.quality.volume == pytest.approx(exact, rel=1e-12)
    areas = {"contact": 0.5 if tet else 1 + A, "fixed": 0.5 if tet else 1.0}
    assert {name: seat.quality.areas[name] for name in areas} == pytest.approx(areas, rel=1e-12)
    assert seat.quality.nodes == {4: 4, 10: 10, 8: 8, 20: 27, 27: 27}[nodes]
    assert list(seat.mesh.subdomains) == ["seat", "material 7"]


def test_bricks_of_27_nodes_in_unv(written_meshes):
    with pytest.raises(MeshError, match=r"hex-2-2.unv:108: .*2412.*type 115.*27 nodes:.*8"):
        ring(written_meshes, "hex-2-2.unv")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"unit": 100.0}, r"200 x 200 x 100 m.*\(unit = 100 m\).*2 x 2 x 1"),
        ({"unit": 1e-5}, "give the unit"),
        ({"unit": 0.0}, "unit = 0: must be > 0"),
        ({"merge": -1.0}, "merge = -1 m: must be >= 0"),
        ({"contact": "fixed"}, "contact.*'fixed'"),
    ],
)
def test_bad_requests(written_meshes, options, message):
    with pytest.raises(MeshError, match=message):
        read_mesh(written_meshes / "hex-1-2.inp", **({"unit": UNIT} | options))


@pytest.mark.slow
def test_a_vtu_that_is_none(tmp_path):
    path = tmp_path / "a.vtu"
    path.write_text("<VTKFile")
    with pytest.raises(MeshError, match=r"a\.vtu: not readable"):
        read_mesh(path)
    with pytest.raises(MeshError, match=r"\.msh, \.med, \.unv, \.inp"):
        read_mesh(Path(__file__))
