"""Mindlin plates of nine-node quadrilaterals: closed forms, rigid modes, distorted elements; a strip lands."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse.linalg

import impact
from impact.beams.timoshenko import TimoshenkoCantilever
from seatfem.structures.elements.mindlin import PlateMesh, Unknown, assemble_plate, average, everywhere
from seatfem.structures.lip import Lip, Patch
from seatfem.structures.model import Array, DofMap, ModelError
from seatfem.structures.reduction.modal import with_modes
from tests.plate_model import grid
from tests.solids import Aims, Material, solve_modes

STEEL = Material(206e9, 0.3, 7800.0)


def bulged(points: Array) -> Array:
    """Return the unit square with curved elements inside and straight sides."""
    x, y = points.T
    bulge = 0.06 * np.sin(np.pi * x) * np.sin(np.pi * y)
    return np.stack([x + bulge * np.cos(2 * y), y - bulge], axis=1)


def rigidity(h: float, material: Material = STEEL) -> float:
    return material.young * h**3 / (12 * (1 - material.poisson**2))


@pytest.mark.slow
def test_a_free_plate_has_three_rigid_modes_and_no_spurious_one() -> None:
    """The deflection that reduced integration leaves without energy lies above 20 elastic modes: they are the same
    on a mesh of half the size. First ones of a thin square: 13.468, 19.596, 24.270 (Leissa 1973, 4.1)."""
    h = 1 / 300
    plates = (assemble_plate(grid((n, n), (1.0, 1.0)), STEEL, h) for n in (12, 24))
    coarse, fine = (solve_modes(plate, 23).omega * np.sqrt(STEEL.density * h / rigidity(h)) for plate in plates)
    assert list(coarse[:3]) == [0.0, 0.0, 0.0]
    assert coarse[3:6] == pytest.approx([13.468, 19.596, 24.270], rel=2e-3)
    assert coarse[3:] == pytest.approx(fine[3:], rel=5e-3)
    model = assemble_plate(grid((3, 2), (1.0, 1.0), bulged), STEEL, h)
    values = scipy.linalg.eigvalsh(model.K.toarray(), model.M.toarray())
    assert np.abs(values[:3]).max() < 1e-6 * values[3]
    assert np.sqrt(values[3] * STEEL.density * h / rigidity(h)) > 12  # no fourth without energy, on curved elements


def test_rigid_motions_and_masses() -> None:
    """w = 1, x, y have no energy; their inertia is that of the plate, rho h^3/12 of its rotation included."""
    h, mesh = 0.05, grid((3, 3), (1.0, 1.0), bulged)
    model = assemble_plate(mesh, STEEL, h)
    assert model.dofs is not None
    rigid = model.dofs.rigid
    assert rigid is not None
    assert np.abs(model.K @ rigid).max() < 1e-9 * abs(model.K).max()
    inertia = rigid.T @ model.M @ rigid
    assert inertia[0, 0] == pytest.approx(STEEL.density * h * 1.0, rel=1e-9)
    x = mesh.points[:, 0] - mesh.points[:, 0].mean()
    assert rigid[::3, 1] == pytest.approx(x)
    second = STEEL.density * h * (1 / 12 + (0.5 - mesh.points[:, 0].mean()) ** 2 + h**2 / 12)
    assert inertia[1, 1] == pytest.approx(second, rel=1e-4)  # the area is exact, the curved elements' moments are not


def test_a_strip_without_contraction_is_a_timoshenko_beam() -> None:
    material = Material(206e9, 0.0, 7800.0)
    beam = TimoshenkoCantilever(206e9, 7800.0, 0.1, 0.002, 0.01, poisson=0.0)
    held: dict[str, tuple[Unknown, ...]] = {"top": ("a_y",), "bottom": ("a_y",)}  # no twist
    model = assemble_plate(grid((24, 1), (0.1, 0.002)), material, 0.01, clamped="left", held=held)
    assert solve_modes(model, 4).omega == pytest.approx(beam.frequencies(4), rel=2e-4)


@pytest.mark.parametrize("h", [0.2, 1e-3])
def test_constant_curvature_on_distorted_elements(h: float) -> None:
    """Distorted elements pass the patch test: no forces inside, and the exact energy."""
    mesh = grid((4, 4), (1.0, 1.0))
    inside = np.all((mesh.points > 1e-9) & (mesh.points < 1 - 1e-9), axis=1)
    moved = mesh.points + 0.06 * inside[:, None] * np.random.default_rng(1).uniform(-1, 1, mesh.points.shape)
    points, cells = moved.copy(), mesh.cells  # the vertices are elsewhere, with straight sides between them
    for k in range(4):
        points[cells[:, 4 + k]] = (moved[cells[:, k]] + moved[cells[:, (k + 1) % 4]]) / 2
    points[cells[:, 8]] = moved[cells[:, :4]].mean(axis=1)
    mesh = PlateMesh(points, cells, mesh.lines)
    x, y = mesh.points.T  # w = x^2/2 - x y + y^2 and its slopes
    u = np.stack([x**2 / 2 - x * y + y**2, mesh.side * (x - y), mesh.side * (2 * y - x)], axis=1).ravel()
    model = assemble_plate(mesh, STEEL, h)
    # 2 U on the unit square: D ((1 + 2)^2 - 2 (1 - nu) (1 * 2 - 1))
    assert u @ model.K @ u == pytest.approx(rigidity(h) * (9 - 2 * (1 - STEEL.poisson)), rel=1e-9)
    forces = (model.K @ u).reshape(-1, 3)
    assert np.abs(forces[inside]).max() < 1e-10 * (abs(model.K) @ np.abs(u)).max()


@pytest.mark.parametrize("load", ["pressure", "gravity"])
def test_a_uniform_load_bends_a_strip_as_a_beam(load: str) -> None:
    """The tip sinks by q L^4/(8 E I), by K and by modes; shear adds E h^2/(3 kappa G L^2) = 2e-5."""
    length, width, thickness = 50e-3, 5e-3, 0.25e-3
    material = Material(206e9, 0.0, 7800.0)
    mesh = grid((20, 2), (length, width))
    model = assemble_plate(mesh, material, thickness, clamped="left")
    assert isinstance(model.dofs, DofMap)
    mean = everywhere(mesh)[model.dofs.free]
    force = 100.0 * mesh.area if load == "pressure" else 9.81 * material.density * thickness * mesh.area
    beam = force / length * length**4 / (8 * material.young * width * thickness**3 / 12)
    tip = average(mesh, Patch(np.array([[length, width / 2]]), np.ones(1)))[0][model.dofs.free]
    assert tip @ scipy.sparse.linalg.spsolve(model.K.tocsc(), force * mean) == pytest.approx(beam, rel=1e-3)
    modes = solve_modes(model, up_to_hz=2e4)
    seen = modes.shapes.T @ np.stack([tip, mean], axis=1)
    assert force * np.sum(seen[:, 0] * seen[:, 1] / modes.omega**2) == pytest.approx(beam, rel=1e-3)
    if load == "gravity":  # the weight by the consistent mass: the same, but for what the clamped nodes carry
        fallen = assemble_plate(mesh, material, thickness)
        assert isinstance(fallen.dofs, DofMap)
        np.testing.assert_allclose(
            fallen.M @ fallen.dofs.rigid[:, 0], material.density * thickness * mesh.area * everywhere(mesh), atol=1e-18
        )


PLAIN = grid((2, 2), (1.0, 1.0))
FOLDED = np.array(PLAIN.points)
FOLDED[PLAIN.cells[0, 2]] = [0.1, 0.1]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: assemble_plate(PLAIN, STEEL, 0.0), r"thickness = .*positive"),
        (lambda: assemble_plate(PLAIN, STEEL, float("nan")), r"thickness = .*positive"),
        (lambda: PlateMesh(PLAIN.points[:, ::-1], PLAIN.cells), r"4.*4 elements.*inside"),
        (lambda: PlateMesh(FOLDED, PLAIN.cells), "inside out or folded"),
        (lambda: assemble_plate(PLAIN, STEEL, 0.1, clamped="root"), r"'root'.*left, right, bottom, top"),
        (lambda: assemble_plate(PLAIN, STEEL, 0.1, ports=Lip.disc(0.1).patches((0.95, 0.5))), "reaches off it"),
        (lambda: PlateMesh(PLAIN.points, PLAIN.cells[:, :8]), r"\(4, 8\)"),
        (lambda: PlateMesh(np.vstack([PLAIN.points, [[2.0, 2.0]]]), PLAIN.cells), "each must be in one"),
    ],
)
def test_what_cannot_be_is_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        make()


def test_a_strip_lands_as_a_beam() -> None:
    """A strip of L/13 without contraction across, nu = 0: with it, its root would be stiffer than a beam's. Struck on
    a line across its tip, it does not twist. 16 modes of bending lie below 400 kHz; on a spring that they resolve the
    force, averaged over 10 us, differs by 0.3 % of its largest."""
    length, width, h, speed = 25.4e-3, 2e-3, 0.4e-3, 2.0
    beam, material = TimoshenkoCantilever(206e9, 7800.0, length, width, h, poisson=0.0), Material(206e9, 0.0, 7800.0)
    across, weights = np.polynomial.legendre.leggauss(6)
    line = Patch(np.stack([np.full(6, length), width / 2 * (1 + across)], axis=1), weights)
    model = assemble_plate(grid((100, 1), (length, width)), material, h, clamped="left", ports={"contact": line})
    modes = solve_modes(model, up_to_hz=400e3)
    greens = with_modes(model, model.damping, modes, 400e3, Aims(130e3, 1e-4, 0.5), [0])
    bends = np.abs(greens.shapes[:, 0]) > 1e-6 * np.abs(greens.shapes).max()
    assert modes.omega[bends] == pytest.approx(beam.frequencies(int(bends.sum())), rel=3e-4)
    rate = np.zeros(len(modes.omega))
    rate[0] = -speed / greens.shapes[0, 0]
    as_plate = impact.Body(greens, state=impact.ModalState(np.zeros_like(rate), rate))
    as_beam = impact.reed(beam, n_modes=int(bends.sum()), release=impact.ModeShape(1, velocity=-speed))
    landings = (impact.ContactProblem(body, impact.spring(stiffness=2e5), gap=1e-6) for body in (as_plate, as_beam))
    one, other = (impact.solve(landing, dt=1e-7, duration=1e-3).force[1:] for landing in landings)
    assert one.sum() == pytest.approx(other.sum(), rel=1e-3)
    means = [np.convolve(force, np.full(100, 1 / 100), "same") for force in (one, other)]
    assert np.abs(means[0] - means[1]).max() < 0.01 * means[1].max()
