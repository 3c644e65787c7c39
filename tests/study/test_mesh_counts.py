"""Predicted element counts against real meshes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatfem.structures.estimates.coarse import count_elements
from seatfem.structures.estimates.sizes import MARGIN, counts_of, memory_need, predicted_sizes
from seatfem.structures.kinds.blocks import BarSeat
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.plane_meshes import make_meridian
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import AnnularSeat, Bar, Block, CadPart, ConicalSeat, Stopper, ValvePlate
from tests.steps import load_scene

EXAMPLES = Path(__file__).parents[2] / "examples"
MESHES = EXAMPLES.parent / "meshes"
SPEC = MeshSpec(size=2e-3, contact_size=0.7e-3)
COARSE = MeshSpec(size=5e-3, contact_size=2e-3)
BODIES = [
    (AnnularSeat(), 4), (AnnularSeat(lip_height=0.0, lip_edge_radius=0.0), 4), (ConicalSeat(), 4), (Stopper(), 4),
    (Stopper(dome_radius=30e-3), 4), (ValvePlate(ports=4, thickness=3e-3), 8), (ValvePlate(ports=3, layout="row"), 4),
    (Bar(30e-3, 5e-3, 5e-3), 4), (Block(20e-3, 20e-3, 8e-3, 3e-3, 3e-3), 4),
]  # fmt: skip
NAMES = ["annular", "flat", "conical", "stopper", "dome", "plate", "row", "bar", "block"]


@pytest.mark.slow(but="bar")
@pytest.mark.parametrize(("body", "parts"), BODIES, ids=NAMES)
def test_volumes_are_those_of_the_meshes(body, parts):
    """Curved elements of order 2: circles of four are 1.3 % off."""
    assert parts * make_mesh(body, SPEC, sector=parts).quality.volume == pytest.approx(body.volume, rel=0.015)


@pytest.mark.parametrize("body", [BODIES[k][0] for k in (0, 1, 2, 4)], ids=[NAMES[k] for k in (0, 1, 2, 4)])
def test_half_sections_have_the_area_of_their_elements(body):
    mesh = make_meridian(body, COARSE).mesh
    corners = mesh.p[:, mesh.t[:3]]
    (a, b), (c, d) = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    assert body.profile.section_area == pytest.approx(float(np.abs(a * d - b * c).sum()) / 2, rel=0.005)


@pytest.mark.slow(but="block, sector")
@pytest.mark.parametrize(
    ("body", "cut"),
    [*BODIES, *((BODIES[k][0], 1) for k in (0, 5, 8))],
    ids=[*(f"{name}, sector" for name in NAMES), *(f"{NAMES[k]}, 3d" for k in (0, 5, 8))],
)
def test_counts_of_solids_are_those_of_the_mesh(body, cut):
    """Within 25 %: gmsh meshes plates of two elements' thickness unevenly."""
    level = "3d" if cut == 1 else "sector"
    mesh = make_mesh(body, SPEC, sector=cut)
    sizes = predicted_sizes(body, SPEC, level, cut, COARSE)
    real = counts_of(mesh)
    assert sizes.elements == pytest.approx(mesh.quality.elements, rel=0.25)
    assert sizes.counts.dof == pytest.approx(real.dof, rel=0.25)
    assert sizes.counts.nnz == pytest.approx(real.nnz, rel=0.25)
    need, real_need = memory_need(sizes.counts), memory_need(real)
    assert need == pytest.approx(real_need, rel=0.4)  # the factor grows with n^(4/3)


@pytest.mark.slow(but="1.0")
@pytest.mark.parametrize("length", [1.0, 3.0])
def test_elements_of_a_bar_thinner_than_they_are_follow_one_another(length):
    """Volume and surface alone say a fifth of them; of 310 m gmsh took hours over what was predicted to take 1 s."""
    body, spec = Bar(length, 4e-3, 6e-3), MeshSpec(size=19e-3, contact_size=8e-3)
    real = make_mesh(body, spec, sector=4)
    sizes = predicted_sizes(body, spec, "sector", 4, MeshSpec(size=length, contact_size=8e-3))
    assert sizes.elements == pytest.approx(real.quality.elements, rel=0.15)
    assert sizes.counts.dof == pytest.approx(counts_of(real).dof, rel=0.15)
    seat = BarSeat(kind="bar", length=f"{length} m", width="4 mm", height="6 mm", material="steel")
    rough = [seat.rough_sizes(replace(spec, size=size), "sector").elements for size in (19e-3, 9.5e-3)]
    assert rough[0] == pytest.approx(real.quality.elements, rel=0.3)
    assert rough[1] == pytest.approx(2 * rough[0], rel=0.01)


@pytest.mark.parametrize(("body", "parts"), BODIES[:4], ids=NAMES[:4])
def test_counts_of_half_sections_are_those_of_the_mesh(body, parts):
    spec = MeshSpec(size=0.8e-3, contact_size=0.3e-3)
    mesh = make_meridian(body, spec)
    sizes = predicted_sizes(body, spec, "axisymmetric", 1, COARSE)
    assert sizes.elements == pytest.approx(mesh.quality.elements, rel=0.25)
    assert sizes.nodes == pytest.approx(mesh.quality.nodes, rel=0.25)


@pytest.mark.slow
def test_counts_follow_the_power_of_the_size():
    """Halved everywhere: eight times the elements of a solid, four times those of a section, for fine meshes."""
    fine = MeshSpec(size=0.1e-3, contact_size=0.1e-3)
    finer = MeshSpec(size=0.05e-3, contact_size=0.05e-3)
    for level, ratio in (("3d", 8), ("axisymmetric", 4)):
        one, other = (predicted_sizes(ConicalSeat(), spec, level, 1, COARSE).elements for spec in (fine, finer))
        assert other / one == pytest.approx(ratio, rel=0.05)


def test_finer_at_the_contact_costs_more():
    specs = [MeshSpec(1e-3, contact) for contact in (1e-3, 5e-4, 2e-4, 1e-4, 5e-5)]
    counts = [predicted_sizes(AnnularSeat(), spec, "3d", 1, COARSE).elements for spec in specs]
    assert counts == sorted(counts)
    assert counts[-1] > 8 * counts[0]


@pytest.mark.parametrize(("name", "drawn"), [("annular_seat", AnnularSeat()), ("conical_seat", ConicalSeat())])
def test_a_cad_part_is_counted_like_the_same_body_drawn_here(name, drawn):
    """From the coarse elements of its inspection."""
    part = CadPart(MESHES / f"{name}.step")
    for spec in (MeshSpec(4e-3, 1.6e-3), MeshSpec(2e-3, 0.8e-3), MeshSpec(2e-3, 0.3e-3)):
        found, known = (predicted_sizes(geometry, spec, "3d", 1, COARSE) for geometry in (part, drawn))
        assert found.elements == pytest.approx(known.elements, rel=0.3)


def test_no_element_of_the_coarse_mesh_is_lost_in_a_finer_one():
    """A fillet keeps its elements however large the others may be, and they become more where sizes are smaller."""
    body = AnnularSeat(lip_edge_radius=0.1e-3)
    counted = [
        count_elements(body, replace(COARSE, size=size, contact_size=size / 2), COARSE, "section")
        for size in (20e-3, 5e-3, 1e-3)
    ]
    mesh = make_meridian(body, COARSE)
    assert counted[0].elements == pytest.approx(mesh.quality.elements, rel=0.1)
    assert [each.elements for each in counted] == sorted(each.elements for each in counted)


@pytest.mark.slow
def test_a_mesh_is_roughly_counted_before_any_is_made():
    """Within the margin of what is refused; small meshes, of which the surface asks for more, are not."""
    for level, spec in (("3d", MeshSpec(0.9e-3, 0.3e-3)), ("axisymmetric", MeshSpec(0.15e-3, 0.03e-3))):
        seat = load_scene(EXAMPLES / "flapper_on_annular_seat.toml").seat
        real = make_mesh(seat.geometry(), spec) if level == "3d" else make_meridian(seat.geometry(), spec)
        rough = seat.rough_sizes(spec, level)
        assert 1 / MARGIN < rough.elements / real.quality.elements < MARGIN
        assert 1 / MARGIN < rough.nodes / real.quality.nodes < MARGIN
