"""Predicted element counts against real meshes, costs that grow with the work."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from time import process_time

import numpy as np
import pytest

from seatfem.machine.libraries import has_pardiso
from seatfem.structures.estimates import costs as seat_costs
from seatfem.structures.estimates.coarse import count_elements
from seatfem.structures.estimates.sizes import MARGIN, counts_of, memory_need, predicted_sizes
from seatfem.structures.kinds.blocks import BarSeat
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.plane_meshes import make_meridian
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.method import ITERATED_FROM
from seatfem.structures.reduction import modal
from seatfem.structures.shapes import AnnularSeat, Bar, Block, CadPart, ConicalSeat, Stopper, ValvePlate
from seatfem.study.method import MODEL, stated_method
from seatfem.study.planning.costs import predict_cost
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
        seat = demo().seat
        real = make_mesh(seat.geometry(), spec) if level == "3d" else make_meridian(seat.geometry(), spec)
        rough = seat.rough_sizes(spec, level)
        assert 1 / MARGIN < rough.elements / real.quality.elements < MARGIN
        assert 1 / MARGIN < rough.nodes / real.quality.nodes < MARGIN


def demo(size=None, bandwidth=None, steps=None, model="axisymmetric"):
    """The demo's scene, filled."""
    scene = load_scene(EXAMPLES / "flapper_on_annular_seat.toml")
    mesh, greens, run = scene.seat.mesh, scene.seat.greens, scene.run
    if size is not None:
        mesh = mesh.model_copy(update={"size": size, "contact_size": 0.4 * size})
    if bandwidth is not None:
        greens = greens.model_copy(update={"bandwidth": bandwidth})
    if steps is not None:
        run = run.model_copy(update={"time_step": run.duration / steps})
    seat = scene.seat.model_copy(update={"mesh": mesh, "greens": greens, "model": model})
    return scene.model_copy(update={"seat": seat, "run": run})


def cost_at(scene, level):
    """As stated, but for the level."""
    return predict_cost(scene, stated_method(scene).replaced({MODEL: level}))


@pytest.mark.slow(but="axisymmetric")
@pytest.mark.parametrize("level", ["axisymmetric", "sector", "3d"])
def test_finer_meshes_cost_more_time_and_memory(level):
    costs = [cost_at(demo(size, steps=1e5), level) for size in (1.5e-3, 1e-3, 0.5e-3, 0.3e-3)]
    for one, other in pairwise(costs):
        assert one.seconds < other.seconds
        assert one.memory <= other.memory
        assert one.parts["reduction"] < other.parts["reduction"]


def test_more_steps_and_wider_bands_cost_more():
    few, many = (cost_at(demo(steps=n), "axisymmetric") for n in (1e5, 1e6))
    for stage in ("contact", "spring baseline", "reed stress", "error budget", "files"):
        assert few.parts[stage] < many.parts[stage]
    assert many.memory - few.memory == pytest.approx(8 * 44 * 9e5)  # histories
    narrow, wide = (cost_at(demo(1e-3, band, 1e5), "sector") for band in (2e5, 1e6))
    assert narrow.parts["reduction"] < wide.parts["reduction"]


def test_parts_add_up_and_carry_the_stopwatch_s_names():
    cost = cost_at(demo(), "axisymmetric")
    assert cost.seconds == pytest.approx(sum(cost.parts.values()))
    named = {"mesh", "assembly", "reduction", "mesh error", "contact", "spring baseline", "error budget", "pictures"}
    assert named <= set(cost.parts)


@pytest.mark.slow(but="mass_on_meshed_seat")
@pytest.mark.parametrize(
    "name", [path.stem for path in sorted({*EXAMPLES.glob("*.toml")} - {*EXAMPLES.glob("*_study.toml")})]
)
def test_every_example_has_a_cost(name):
    scene = load_scene(EXAMPLES / f"{name}.toml")
    level = {"annular": "axisymmetric", "plate": "3d", "stopper": "axisymmetric", "bar": "sector"}.get(scene.seat.kind)
    if getattr(scene.seat, "arc", None) is not None:
        level = "harmonics"
    cost = cost_at(scene, level or "closed form")
    assert 1.0 < cost.seconds < 2e4  # of what nobody has planned: the life of a flapper by all its arcs and modes
    assert 1e8 < cost.memory < 5e9


def test_a_spring_and_a_rod_need_no_reduction_of_the_seat():
    spring, waves = (cost_at(demo(0.3e-3), level) for level in ("spring", "axisymmetric"))
    assert spring.parts["reduction"] < waves.parts["reduction"]
    assert "mesh" not in cost_at(load_scene(EXAMPLES / "mass_on_bar.toml"), "rod").parts


@pytest.mark.slow(but="1")
@pytest.mark.skipif(not has_pardiso(), reason="no MKL")
@pytest.mark.parametrize(("rings", "solver"), [(8, "single"), (1, "two grids")])
def test_large_seats_are_predicted_by_what_solves_for_them(rings, solver):
    """On two grids from 100,000 unknowns a part of the face on; 0.4 mm make eight times as many at most."""
    scene = demo(0.4e-3)
    method = replace(stated_method(scene).seat, level="3d", tolerance=1e-2, rings=rings)
    large = seat_costs.seat_model(scene.seat, method, 1e-3)
    assert ITERATED_FROM < large.sizes.counts.dof < 8 * ITERATED_FROM
    assert large.solver == solver
    assert seat_costs.seat_model(scene.seat, method, 1e-3, 8.0).solver == "double"  # a coarser one
    assert seat_costs.seat_model(scene.seat, replace(method, tolerance=9e-4), 1e-3).solver == "double"
    double = replace(large, solver="double")
    both = [seat_costs.seat_seconds(each)["reduction"] for each in (large, double)]
    assert both[0] < both[1]
    assert seat_costs.seat_memory(large)[0] < 0.8 * seat_costs.seat_memory(double)[0]


@pytest.mark.slow
def test_predicting_is_quick():
    """Once the shape is known; the first time also stays far below a second."""
    scene = load_scene(EXAMPLES / "flapper_on_valve_plate.toml")
    cost_at(scene, "3d")
    times = []
    for _ in range(5):
        start = process_time()
        cost_at(scene, "3d")
        times.append(process_time() - start)
    assert min(times) < 0.05


def test_memory_of_the_demo_s_mesh_follows_the_law():
    scene = demo(1e-3, model="3d")
    sizes = scene.seat.sizes(scene.seat.mesh_spec(stated_method(scene).seat), "3d")
    assert cost_at(scene, "3d").memory > memory_need(sizes.counts)


def test_plan_and_run_agree_on_which_seats_are_small() -> None:
    assert seat_costs.ALL_MODES == modal.ALL_MODES
