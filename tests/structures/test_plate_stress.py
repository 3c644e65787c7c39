"""Stress in the faces of Mindlin plates against beams and plates of the textbook."""

import numpy as np
import pytest
from scipy.linalg import eigh

from impact.bodies.body import Body, ModalState
from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.elements.mindlin import PlateMesh, assemble_plate
from seatfem.structures.fields.recovery import StressField, at_time, largest, von_mises
from seatfem.structures.fields.sites import plate_nodes, plate_points, plate_stress, sharp_nodes
from seatfem.structures.lip import Patch
from seatfem.structures.materials import Material
from seatfem.structures.model import Array, ModelError
from tests.plate_model import grid

LENGTH, WIDTH, THICKNESS = 20e-3, 2e-3, 0.2e-3


def strip(columns: int, rows: int) -> PlateMesh:
    return grid((columns, rows), (LENGTH, WIDTH))


def test_a_strip_under_a_tip_force_is_a_beam() -> None:
    """A plate without Poisson's ratio has the beam's stress to the root; F = 1 N acts over the last element's end."""
    beam = Material(200e9, 0.0, 7850.0)
    mesh = strip(20, 2)
    tip = Patch(np.array([(LENGTH, y) for y in np.linspace(0, WIDTH, 21)]), np.ones(21))
    model = assemble_plate(mesh, beam, THICKNESS, clamped="left", ports={"tip": tip})
    push = np.linalg.solve(model.K.toarray(), model.port_matrix)[:, 0]
    x = np.array([0.0, 0.25, 0.5]) * LENGTH
    sites = plate_points(mesh, np.column_stack([x, np.full(3, 0.4 * WIDTH)]))
    stress = (plate_stress(mesh, beam, THICKNESS, model, sites) @ push).reshape(-1, 6)
    exact = -6 * (LENGTH - x) / (WIDTH * THICKNESS**2)  # compressed where it bends towards
    np.testing.assert_allclose(stress[:, 0], exact, rtol=0.01)


def field_error(columns: int) -> float:
    """Return the error of the stress of w = (x/a)^4/24 at the nodes, with interpolated interior rotations."""
    material = Material(200e9, 0.3, 7850.0)
    mesh = strip(columns, 2)
    model = assemble_plate(mesh, material, THICKNESS)
    x = mesh.points[:, 0] / LENGTH
    unknowns = np.stack([x**4 / 24, mesh.side * x**3 / 6 / LENGTH, 0 * x], axis=1).ravel()
    computed = (plate_stress(mesh, material, THICKNESS, model, plate_nodes(mesh)) @ unknowns).reshape(-1, 6)
    edge = 200e9 * THICKNESS / 2 / (1 - 0.3**2) / LENGTH**2
    exact = -edge * np.stack([x**2 / 2, 0.3 * x**2 / 2, *np.zeros((4, len(x)))], axis=1)
    return float(np.abs(computed - exact).max() / edge)


def test_stress_at_the_nodes_is_of_second_order() -> None:
    coarse, fine = field_error(5), field_error(10)
    assert coarse < 0.01
    assert np.log2(coarse / fine) > 1.8


def test_pure_bending_is_exact() -> None:
    material = Material(200e9, 0.3, 7850.0)
    mesh = strip(3, 2)
    model = assemble_plate(mesh, material, THICKNESS)
    x, y = mesh.points.T

    def stress(xx: float, yy: float, xy: float) -> Array:
        w = xx * x**2 / 2 + yy * y**2 / 2 + xy * x * y
        unknowns = np.stack([w, mesh.side * (xx * x + xy * y), mesh.side * (yy * y + xy * x)], axis=1).ravel()
        sites = plate_nodes(mesh)
        return (plate_stress(mesh, material, THICKNESS, model, sites) @ unknowns).reshape(-1, 6)

    moment = 200e9 * THICKNESS**3 / 12 / (1 - 0.3**2) * np.array([1 + 0.3 * 2, 2 + 0.3 * 1, 0, 0, 0, 0.7 * 0.5])
    tensor = stress(1.0, 2.0, 0.5)
    np.testing.assert_allclose(tensor, np.tile(-6 * moment / THICKNESS**2, (len(tensor), 1)), rtol=1e-8, atol=10.0)


def test_points_off_the_plate_are_refused() -> None:
    with pytest.raises(ModelError, match=r"stress\.points"):
        plate_points(strip(2, 1), np.array([(2 * LENGTH, 0.0)]))


@pytest.mark.slow
def test_the_first_mode_of_a_strip_bears_root_3_rho_c_v_at_its_clamp() -> None:
    """The clamp bears root 3 rho c v of the tip's v after a quarter period, also under a force that hardly presses."""
    beam = Material(200e9, 0.0, 7850.0)
    mesh = strip(12, 1)
    tip = Patch(np.array([(LENGTH, WIDTH / 2)]), np.ones(1))
    model = assemble_plate(mesh, beam, THICKNESS, clamped="left", ports={"tip": tip})
    squares, modes = eigh(model.K.toarray(), model.M.toarray(), subset_by_index=[0, 4])
    omega, shapes = np.sqrt(squares), modes.T @ model.port_matrix
    sites = plate_points(mesh, np.array([(0.0, 0.5 * WIDTH), (0.5 * LENGTH, 0.5 * WIDTH)]))
    functional = plate_stress(mesh, beam, THICKNESS, model, sites)
    rest = np.linalg.solve(model.K.toarray(), model.port_matrix)
    static, modal = ((functional @ each).reshape(2, 6, -1) for each in (rest, modes))
    greens = ModalGreens(omega, np.zeros(5), shapes, Residual.none(1), ("tip",))
    speed, dt = 1.5, 2 * np.pi / omega[-1] / 50
    start = ModalState(np.zeros(5), np.array([speed / shapes[0, 0], 0, 0, 0, 0]))
    field = StressField(sites.points, static, modal, Body(greens, state=start))
    quarter = np.pi / 2 / omega[0]
    force = np.zeros(int(1.5 * quarter / dt))
    force[int(1.2 * quarter / dt) :] = 1e-6
    peaks = largest(field, force, dt)
    exact = np.sqrt(3 * 200e9 * 7850) * speed
    assert peaks.initial.von_mises[0] == pytest.approx(exact, rel=0.01)
    assert peaks.initial.von_mises_time[0] == pytest.approx(quarter, rel=0.01)
    assert peaks.after_contact.von_mises[0] == pytest.approx(exact * np.cos(0.2 * np.pi / 2), rel=0.02)
    at_once = at_time(field, force, dt, int(quarter / dt))
    assert von_mises(at_once)[0] == pytest.approx(exact, rel=0.01)


def test_reentrant_corners_of_an_outline_are_found() -> None:
    whole = strip(4, 4)
    centres = whole.points[whole.cells[:, 8]]
    kept = ~((centres[:, 0] < LENGTH / 2) & (centres[:, 1] < WIDTH / 2))
    used, cells = np.unique(whole.cells[kept], return_inverse=True)
    mesh = PlateMesh(whole.points[used], cells.reshape(-1, 9))
    np.testing.assert_allclose(sharp_nodes(mesh), [(LENGTH / 2, WIDTH / 2)])
