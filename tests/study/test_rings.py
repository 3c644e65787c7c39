"""A struck patch in rings: shares, ports, contact, and what a run states of it."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.after.result import join_contacts
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.rings import face_compliance, left_by, ring_borders, ring_names, ring_shares
from seatfem.structures.shapes import AnnularSeat, Block, ConicalSeat, Stopper
from tests.gallery import load_text
from tests.solids import Material, MeshSpec, SecondOrderModel, assemble, factorize, make_meridian, make_mesh
from tests.steps import ModalGreens, Residual, Scene, run_contacts, run_scene, striker_of

STEEL = Material(2e11, 0.3, 7850.0)


def strip(borders: np.ndarray) -> float:
    """Return pi E/(2 (1 - nu^2)) w L/F of a rigid face on a strip of half width 1, up to a constant: -ln|x|."""

    def twice(d: float) -> float:  # second antiderivative of ln
        return d * d / 2 * math.log(abs(d)) - 3 * d * d / 4 if d else 0.0

    ends = 2 * borders - 1
    count, width = len(ends) - 1, np.diff(2 * borders)
    mean = [
        [
            twice(ends[j + 1] - ends[i]) + twice(ends[j] - ends[i + 1])
            - twice(ends[j + 1] - ends[i + 1]) - twice(ends[j] - ends[i])
            for j in range(count)
        ]
        for i in range(count)
    ]  # fmt: skip
    compliance = 5.0 - np.array(mean) / np.outer(width, width)
    return face_compliance(
        ModalGreens(
            np.zeros(0), np.zeros(0), np.zeros((0, count)), Residual.spring(compliance), ring_names("contact", count)
        )
    ) - 5.0  # fmt: skip


def test_a_rigid_face_on_a_strip_is_reached_with_order_two() -> None:
    """Rings tend to the exact ln 2 from 3/2 - ln 2 with order two, rings of equal width with order one."""
    errors = {p: strip(ring_borders(p)) - math.log(2) for p in (1, 2, 3, 4, 8, 16, 32)}
    assert errors[1] == pytest.approx(1.5 - math.log(4), rel=1e-12)
    assert errors[2] == pytest.approx(errors[1], rel=1e-12)  # by symmetry
    assert math.log2(errors[8] / errors[16]) == pytest.approx(2.0, abs=0.06)
    assert math.log2(errors[16] / errors[32]) == pytest.approx(2.0, abs=0.03)
    equal = [strip(np.linspace(0, 1, p + 1)) - math.log(2) for p in (16, 32)]
    assert math.log2(equal[0] / equal[1]) == pytest.approx(1.0, abs=0.02)
    for p in (3, 4, 8, 16):  # what is stated holds, and is not idle
        assert 1.0 <= left_by(p) * (errors[1] - errors[p]) / errors[p] < 1.45


def compliance(model: SecondOrderModel) -> np.ndarray:
    return np.asarray(model.port_matrix.T @ factorize(model.K).solve(model.port_matrix))


@pytest.mark.parametrize("geometry", [AnnularSeat(), ConicalSeat(), Stopper(dome_radius=20e-3)])
def test_meridians_have_nodes_at_the_borders(geometry: AnnularSeat | ConicalSeat | Stopper) -> None:
    mesh = make_meridian(geometry, MeshSpec(2e-3, 0.5e-3, rings=4))
    one, four = (assemble_axisymmetric(mesh, STEEL, rings=rings) for rings in (1, 4))
    area = one.ports["contact"].area
    assert tuple(four.ports) == ring_names("contact", 4)
    areas = [port.area for port in four.ports.values()]
    np.testing.assert_allclose(areas, area * ring_shares(4), rtol=1e-9)
    whole = sum(share * port.vector for share, port in zip(ring_shares(4), four.ports.values(), strict=True))
    np.testing.assert_allclose(whole, one.port_matrix[:, 0], atol=1e-9 * np.abs(whole).max())
    struck = np.unique(mesh.mesh.facets[:, mesh.mesh.boundaries["contact"]])
    radii = np.sort(mesh.mesh.p[0, struck])
    borders = [np.sqrt(radii[0] ** 2 + s * (radii[-1] ** 2 - radii[0] ** 2)) for s in ring_borders(4)]
    assert all(np.abs(radii - border).min() < 2e-3 * radii[-1] for border in borders)  # a dome's area is not r^2's


@pytest.mark.slow
def test_a_rectangle_is_divided_by_the_distance_from_its_rim() -> None:
    """The outer of four rings of a patch 2 x 4 mm lies at its rim: within d of it are 8 - (2 - 2d)(4 - 2d)."""
    mesh = make_mesh(Block(12e-3, 12e-3, 6e-3, 2e-3, 4e-3), MeshSpec(2e-3, 0.4e-3))
    whole = assemble(mesh, STEEL)
    model = assemble(mesh, STEEL, rings=4)
    vector = sum(share * port.vector for share, port in zip(ring_shares(4), model.ports.values(), strict=True))
    np.testing.assert_allclose(vector, whole.port_matrix[:, 0], atol=1e-9 * np.abs(vector).max())
    outer = model.dofs.expand(model.ports["contact_1"].vector)[2]
    x, y = 1e3 * model.dofs.points[:2]
    depth = 1 - math.sqrt(1 - (ring_shares(4)[0]))  # of a like strip, in half widths; at least the ring's
    inside = (np.abs(x) < 1 - 3 * depth - 0.4) & (np.abs(y) < 2 - 3 * depth - 0.4)
    assert np.abs(outer[inside]).max(initial=0.0) < 1e-3 * np.abs(outer).max()


SCENE = (
    '\n[seat]\nkind = "annular"\nbore_radius = "4 mm"\nlip_width = "1 mm"\n'
    'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }\ndamping_ratio = 0.05\n'
    'mesh = { size = "2 mm", contact_size = "0.4 mm" }\ngreens = { bandwidth = "300 kHz", tolerance = 0.01 }\n[reed]\n'
    'kind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[contact]\n%s\n[run]\nduration = "12 us"\n'
    'time_step = "20 ns"\n[accuracy]\ntarget = 0.3\n'
)


def scene_of(folder: Path, contact: str = "") -> Scene:
    return load_text(folder, SCENE % contact)


@pytest.mark.parametrize("law", ['"signorini"', '{ kind = "spring", stiffness = "1 GN/m" }'])
def test_one_face_on_rings_that_move_alike_is_one_contact(tmp_path: Path, law: str) -> None:
    """Rings on a spring of their own, each in proportion to its area, are one spring: force, motion and energies."""
    scene = scene_of(tmp_path, f"law = {law}")
    striker = striker_of(scene)
    one = run_contacts(scene, striker, impact.spring(stiffness=1e9), 2e-8).seat
    apart = ModalGreens(
        np.zeros(0), np.zeros(0), np.zeros((0, 4)), Residual.spring(np.diag(1e-9 / ring_shares(4))),
        ring_names("contact", 4),
    )  # fmt: skip
    by_rings = run_contacts(scene, striker, apart, 2e-8).parts
    alike = by_rings.force.sum(axis=1)[:, None] * ring_shares(4)
    close = 1e-4  # several compliant contacts are solved by iteration, to 1e-5
    np.testing.assert_allclose(by_rings.force, alike, atol=close * alike.max())
    several = join_contacts(by_rings, ring_shares(4))
    np.testing.assert_allclose(several.force, one.force, atol=close * one.force.max())
    np.testing.assert_allclose(several.gap, one.gap, atol=close * np.abs(one.gap).max())
    np.testing.assert_allclose(several.energy.stored, one.energy.stored, rtol=close)
    assert several.energy.residual < 1e-12
    assert impact.measures.impulse(several) == pytest.approx(impact.measures.impulse(one), rel=close)


def test_a_face_does_not_pull_at_rings() -> None:
    """The last ring would be pulled: without it the compliance is that of the first two."""
    static = np.array([[2.0, 1.0, 3.0], [1.0, 2.0, 3.0], [3.0, 3.0, 8.0]])
    greens = ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, 3)), Residual.spring(static), ring_names("contact", 3))
    assert face_compliance(greens) == pytest.approx(1.5)


@pytest.mark.slow
def test_a_scene_asks_for_rings(tmp_path: Path) -> None:
    one = run_scene(scene_of(tmp_path), tmp_path / "one", pictures=False)
    four = run_scene(scene_of(tmp_path, "rings = 4"), tmp_path / "four", pictures=False)
    for summary in (one, four):
        assert summary.summary["error_unknown"] == ""
        for key in ("impulse_Ns", "filtered_peak_force_N", "contact_duration_s", "max_seat_displacement_m"):
            assert f"error_patch_{key}" in summary.summary
    peak = "filtered_peak_force_N"
    values = [json.loads((tmp_path / name / "summary.json").read_text())[peak] for name in ("one", "four")]
    change = abs(values[1] - values[0])
    assert 0.005 < change / values[1] < 0.05
    patch, less = (float(str(summary.summary[f"error_patch_{peak}"])) for summary in (one, four))
    assert patch > change
    assert 0 < less < 0.6 * patch
    assert float(str(four.summary["seat_static_stiffness_N_per_m"])) > float(
        str(one.summary["seat_static_stiffness_N_per_m"])
    )
    assert float(str(four.summary["energy_residual"])) < 1e-9
    results = impact.load_results(tmp_path / "four" / "result.h5")
    rings, wave = results["rings"], results["wave"]
    assert rings.force.shape == (len(wave.time), 4)
    np.testing.assert_allclose(rings.force.sum(axis=1), wave.force, rtol=1e-12)
    again = run_scene(scene_of(tmp_path, "rings = 4"), tmp_path / "four", pictures=False)
    assert again.summary["seat_reused"]
    assert again.summary[f"error_patch_{peak}"] == pytest.approx(less, rel=1e-9)
    text = '[seat]\nkind = "greens"\nfile = "four/seat.h5"\n[reed]' + (SCENE % "").partition("[reed]")[2]
    from_file = run_scene(load_text(tmp_path, text), tmp_path / "file", pictures=False)
    assert from_file.summary[peak] == pytest.approx(values[1], rel=1e-9)
