"""Stress of solids and bodies of revolution against closed forms, a time integration and refinement; its peaks."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import skfem

from impact.greens.base import Array
from seatfem.structures.fields.peaks import Integers, norms
from seatfem.structures.fields.recovery import StressField, histories, largest, recover, von_mises
from seatfem.structures.fields.sites import at_points, local_maxima, near, on_surface, peak_mesh_error, singular_points
from seatfem.structures.fields.solids import elements_of, solid_stress
from seatfem.structures.materials import Material, Orthotropic
from seatfem.structures.mesh.checks import nearest_distances
from seatfem.structures.mesh.plane_meshes import MeridianMesh, make_meridian
from tests.solids import AnnularSeat, MeshSpec, ModelError, assemble, assemble_axisymmetric, factorize

STEEL = Material(200e9, 0.3, 7850.0, "steel")
WOOD = Orthotropic(
    name="wood", young=(11e9, 0.9e9, 0.5e9), poisson=(0.37, 0.42, 0.47), shear=(0.7e9, 0.6e9, 0.04e9), density=450.0
)
SQUARE = 2e-3 * 3e-3  # of the block's face


def block(kind: Any) -> Any:
    """Return a block of 2 x 3 x 4 mm, held normally on x = 0, y = 0 and z = 0, and pushed at z = 4 mm."""
    mesh = kind().refined(1).scaled((2e-3, 3e-3, 4e-3))
    sides = {name: (lambda x, k=k: x[k] < 1e-9) for k, name in enumerate(("x0", "y0", "z0"))}
    return mesh.with_boundaries({**sides, "contact": lambda x: x[2] > 4e-3 - 1e-9})


@pytest.mark.parametrize(
    ("kind", "order", "material"), [(skfem.MeshTet, 1, STEEL), (skfem.MeshTet, 2, WOOD), (skfem.MeshHex, 2, WOOD)]
)
def test_uniform_tension_along_the_normal_is_exact(kind: Any, order: int, material: Any) -> None:
    mesh = block(kind)
    model = assemble(mesh, material, fixed=(), sliding=("x0", "y0", "z0"), order=order)
    elements = elements_of(mesh, order)
    for sites in (on_surface(elements), at_points(elements, np.array([(1.1e-3, 1.3e-3, 2.7e-3)]))):
        push = np.linalg.solve(model.K.toarray(), model.port_matrix)
        stress = (solid_stress(elements, material, model, sites) @ push).reshape(-1, 6)
        np.testing.assert_allclose(stress, [[0, 0, 1 / SQUARE, 0, 0, 0]] * len(sites), atol=1e-9 / SQUARE)


def section(rows: int, columns: int, length: float, radii: Any, kind: Any = skfem.MeshQuad2) -> Any:
    """Return curved elements between r = radii(z)[0] and [1]; z = 0 is "fixed", z = length "contact"."""
    straight = skfem.MeshQuad.init_tensor(np.linspace(0, 1, columns + 1), np.linspace(0, length, rows + 1))
    mesh = (straight if kind is skfem.MeshQuad2 else straight.to_meshtri()).with_boundaries(
        {"fixed": lambda x: x[1] < 1e-9, "contact": lambda x: x[1] > length - 1e-9, "inner": lambda x: x[0] < 1e-9}
    )
    curved = kind.from_mesh(mesh)
    inner, outer = radii(curved.doflocs[1])
    places = np.array([inner + curved.doflocs[0] * (outer - inner), curved.doflocs[1]])
    return kind(places, curved.t, _boundaries=mesh.boundaries)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [skfem.MeshQuad2, skfem.MeshTri2])
def test_a_thick_walled_ring_under_pressure_has_the_stress_of_lame(kind: Any) -> None:
    """Stress in plane strain at the ring's surfaces is Lame's; the error falls as h^2 at least."""
    a, b, height = 2e-3, 4e-3, 1e-3
    errors = []
    for columns in (4, 8):
        mesh = section(2, columns, height, lambda z: (a + 0 * z, b + 0 * z), kind)
        model = assemble_axisymmetric(mesh, STEEL, fixed=(), sliding=("fixed", "contact"), ports={"contact": "inner"})
        elements = elements_of(mesh)
        sites = on_surface(elements)
        push = np.linalg.solve(model.K.toarray(), model.port_matrix)[:, 0]
        of_one_pascal = -2 * np.pi * a * height * push  # inwards
        stress = (solid_stress(elements, STEEL, model, sites) @ of_one_pascal).reshape(-1, 6)
        ratio = (b / sites.points[:, 0]) ** 2
        hoop, radial = ((1 + s * ratio) * a**2 / (b**2 - a**2) for s in (1, -1))
        exact = np.stack([radial, hoop, STEEL.poisson * (radial + hoop), *np.zeros((3, len(ratio)))], axis=1)
        errors.append(np.abs(stress - exact).max() / np.abs(exact).max())
    assert errors[1] < 0.015
    assert np.log2(errors[0] / errors[1]) > 1.7


LENGTH, RADIUS, SPEED = 0.1, 1e-3, float(np.sqrt(200e9 / 7850.0))
AREA = np.pi * RADIUS**2


def half_sine(t: Array) -> Array:
    return np.where((t > 0) & (t < 0.5 * LENGTH / SPEED), np.sin(np.pi * t * SPEED / (0.5 * LENGTH)), 0.0)


def rod(vectors: int, dt: float) -> StressField:
    """Return a cylinder without Poisson's ratio, which is the textbook's rod, struck at z = LENGTH."""
    thin = Material(200e9, 0.0, 7850.0, "rod")
    mesh = section(200, 1, LENGTH, lambda z: (0 * z, RADIUS + 0 * z))
    model = assemble_axisymmetric(mesh, thin)
    elements = elements_of(mesh)
    points = np.array([(RADIUS / 2, LENGTH * (1 - x)) for x in (0.001, 0.1, 0.5)])
    functional = solid_stress(elements, thin, model, at_points(elements, points))
    return recover(model, functional, points, bandwidth=100e3, dt=dt, vectors=vectors)


@pytest.mark.slow
def test_a_rod_under_a_pulse_has_the_stress_of_its_waves_with_exact_delays() -> None:
    dt = LENGTH / SPEED / 800
    time = dt * np.arange(2001)
    force = half_sine(time - dt / 2)
    errors = []
    for vectors in (20, 80):
        stress = histories(rod(vectors, dt), -force, dt)[:, 2] * AREA
        exact = np.zeros_like(stress)
        for k, x in enumerate((0.001 * LENGTH, 0.1 * LENGTH, 0.5 * LENGTH)):
            for m, sign in enumerate((1, -1)):
                later = time - 2 * m * LENGTH / SPEED
                exact[k] -= sign * (half_sine(later - x / SPEED) + half_sine(later - (2 * LENGTH - x) / SPEED))
        errors.append(np.linalg.norm(stress - exact, axis=1) / np.linalg.norm(exact, axis=1))
    assert errors[1].max() < 0.01
    assert errors[1].max() < errors[0].max() / 3


def test_what_is_refused() -> None:
    mesh = section(2, 2, 1e-3, lambda z: (1e-3 + 0 * z, 2e-3 + 0 * z))
    elements, model = elements_of(mesh), assemble_axisymmetric(mesh, STEEL)
    with pytest.raises(ModelError, match="off the body"):
        at_points(elements, np.array([(2.5e-3, 0.5e-3)]))
    rubber = Material(1e7, 0.499, 1000.0, "rubber")
    with pytest.raises(ModelError, match="rubber"):
        solid_stress(elements, rubber, model, on_surface(elements))
    free = assemble_axisymmetric(mesh, STEEL, fixed=())
    functional = solid_stress(elements, STEEL, free, on_surface(elements))
    with pytest.raises(ModelError, match="nothing holds"):
        recover(free, functional, on_surface(elements).points, bandwidth=1e5, dt=1e-7)


@pytest.mark.parametrize("kind", [skfem.MeshHex, skfem.MeshTet])
def test_singular_edges_are_found(kind: Any) -> None:
    """An L has singular edges at x = y = 1 and around its clamped face x = 2, and no others."""
    mesh = kind.init_tensor(*[np.linspace(0, 2, 3)] * 2, np.linspace(0, 1, 2))
    centres = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.restrict(np.flatnonzero(~((centres[0] < 1) & (centres[1] < 1))))
    mesh = mesh.with_boundaries({"fixed": lambda x: x[0] > 2 - 1e-9})
    singular = singular_points(mesh, ("fixed",))
    reentrant = np.isclose(singular[:, :2], 1).all(axis=1)
    rim = np.isclose(singular[:, 0], 2) & (np.isin(singular[:, 1], (0, 2)) | np.isin(singular[:, 2], (0, 1)))
    assert (reentrant | rim).all()
    assert reentrant.any()
    assert rim.any()
    points = np.array([(1.0, 1.0, 0.5), (1.2, 1.0, 0.5), (1.4, 1.0, 0.0)])
    np.testing.assert_array_equal(near(points, singular, 0.3), [True, True, False])


def test_the_corner_of_a_section_is_found_and_the_axis_is_none() -> None:
    mesh = skfem.MeshQuad.init_tensor(*[np.linspace(0, 2, 3)] * 2)
    centres = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.restrict(np.flatnonzero(~(centres > 1).all(axis=0)))
    mesh = mesh.with_boundaries({"fixed": lambda x: x[1] < 1e-9})
    corners = {tuple(point) for point in singular_points(mesh, ("fixed",))}
    assert corners == {(1.0, 1.0), (2.0, 0.0)}


def test_what_a_mesh_leaves_is_looked_for_at_every_place() -> None:
    """A peak of 9 that was 7 on the coarser mesh may pass a converged one of 10: its error counts."""
    fine, coarse = (np.column_stack([x, 0 * x]) for x in (np.arange(0.0, 60.0, 0.5), np.arange(0.25, 60.0, 1.0)))

    def mesh_error(second: float, weight: float, factor: float = 1.0) -> float:
        def peaks(points: Array, height: float) -> Array:
            x = points[:, 0]
            return 10 * np.exp(-(((x - 15) / 8) ** 2)) + height * np.exp(-(((x - 45) / 8) ** 2))

        return peak_mesh_error(fine, peaks(fine, 9.0), coarse, factor * peaks(coarse, second), weight)

    assert mesh_error(7.0, 1.0) == pytest.approx(1.0, abs=0.1)
    assert mesh_error(7.0, 2.0) == pytest.approx(3.0, abs=0.1)
    assert mesh_error(9.0, 1.0) == pytest.approx(0.0, abs=0.1)
    assert mesh_error(9.0, 1.5, factor=0.8) == pytest.approx(3.0, abs=0.1)


FILLET, FOOT = 0.4e-3, (5e-3, 5e-3)
SEAT = AnnularSeat(
    lip_height=1e-3, lip_edge_radius=0.2e-3, lip_fillet=FILLET, outer_radius=8e-3, thickness=5e-3
)  # fmt: skip


def seat_mesh(finer: float) -> MeridianMesh:
    return make_meridian(SEAT, MeshSpec(0.8e-3 / finer, 0.2e-3 / finer, fillets=finer))


def fillet_stress(mesh: MeridianMesh) -> float:
    """Return the von Mises stress in the fillet under one newton at rest [Pa]."""
    model, elements = assemble_axisymmetric(mesh, STEEL), elements_of(mesh)
    sites = on_surface(elements)
    push = factorize(model.K).solve(model.port_matrix)
    stress = von_mises((solid_stress(elements, STEEL, model, sites) @ push).reshape(-1, 6))
    away = np.linalg.norm(sites.points - (np.array(FOOT) + FILLET), axis=1)  # from the middle of the fillet's arc
    return float(stress[np.abs(away - FILLET) < 1e-6 * FILLET].max())


@pytest.mark.slow
def test_the_largest_stress_in_the_fillet_converges() -> None:
    """The largest stress converges by more than order 1.4, and the elements of a run have it to 1 %."""
    exact = fillet_stress(seat_mesh(5.0))
    errors = [abs(fillet_stress(seat_mesh(finer)) / exact - 1) for finer in (0.25, 1.0)]
    assert errors[1] < 0.01
    assert math.log(errors[0] / errors[1], 4.0) > 1.4


class TwoForces:
    """One place, two coordinates that are the forces themselves."""

    points, radians = np.zeros((1, 3)), np.array([0.0, 1.0])

    def __init__(self, *tensors: tuple[float, float, float]) -> None:
        self.tensors = np.array([(*each, 0.0, 0.0, 0.0) for each in tensors])

    @property
    def bounds(self) -> Array:
        return norms(self.tensors)[None]

    def coordinates(self, force: Array, dt: float, stride: int) -> Iterator[Array]:
        return iter([force[::stride]])

    def stress(self, which: Integers, values: Array, kept: Integers) -> Iterator[Array]:
        yield np.asarray((self.tensors[kept].T @ values)[None, None])


def test_no_block_is_passed_over_that_holds_the_largest() -> None:
    """The search has 1.9 of one axis as principal, and 2 of a later (1, -1, -1) as von Mises stress."""
    field, force = TwoForces((1.9, 0.0, 0.0), (1.0, -1.0, -1.0)), np.zeros((1000, 2))
    force[100, 0] = force[900, 1] = 1.0
    peaks = largest(field, force, 0.5).after_contact
    assert peaks.von_mises[0] == 2.0
    assert peaks.von_mises_time[0] == 450.0
    assert peaks.principal[0] == 1.9


def test_a_landing_cuts_the_record_for_both_stresses() -> None:
    """Von Mises is largest before the landing and tension after it; at t = 0 there is what a preload leaves."""
    field, force = TwoForces((1.0, 0.0, 0.0), (1.0, -1.0, -1.0)), np.zeros((1000, 2))
    force[0, 0] = 0.5
    force[100, 1], force[601, 0] = 1.0, 1.5
    peaks = largest(field, force, 0.5, since=300.0)
    spans = peaks.spans
    before, since = peaks.within(spans.until(spans.landing)), peaks.within(spans.after(spans.landing))
    assert before.von_mises[0] == 2.0
    assert before.principal[0] == pytest.approx(1.0, rel=1e-12)
    assert (before.von_mises_time[0], before.principal_time[0]) == (50.0, 50.0)
    assert (since.von_mises[0], since.principal[0], since.von_mises_time[0]) == (1.5, 1.5, 300.5)
    assert (peaks.after_contact.von_mises[0], peaks.after_contact.principal[0]) == (2.0, 1.5)
    assert peaks.within(spans.start).von_mises[0] == 0.5
    assert peaks.initial.von_mises[0] == 0.0


@pytest.mark.slow
def test_hot_spots_are_the_tops_of_hills() -> None:
    """A line with three hills has three hot spots; the higher shoulder of the first is none."""
    x = np.linspace(0, 10, 1001)
    values = 3 * np.exp(-((x - 2) ** 2)) + 1.0 * np.exp(-((x - 6) ** 2)) + 0.2 * np.exp(-((x - 9.5) ** 2))
    points = np.column_stack([x, 0 * x, 0 * x])
    np.testing.assert_allclose(x[local_maxima(points, values, 0.5)], [2, 6, 9.5], atol=0.02)
    np.testing.assert_allclose(x[local_maxima(points, values, 0.5, least=0.1)], [2, 6], atol=0.02)
    np.testing.assert_allclose(x[local_maxima(points, values, 3.7)], [2], atol=0.02)
    assert len(local_maxima(points, np.ones(1001), 20.0)) == 1
    np.testing.assert_allclose(nearest_distances(points[:3], points[[2]]), [0.02, 0.01, 0.0])
    assert np.isinf(nearest_distances(points, np.zeros((0, 3)))).all()
