"""Small bodies by other programs: each must find what we find, and see a coefficient that is wrong."""

import numpy as np
import pytest
import skfem

from benchmarks.peers import calculix, calculix_impact, plain_impact, siconos_impact, switching
from benchmarks.peers import impact_scene as scene
from tests.solids import Material, assemble, solve_modes
from tests.steps import ModalGreens, ModelError, Residual

STEEL = Material(200e9, 0.3, 7850.0)
SIDES = (8e-3, 6e-3, 4e-3)
OMEGA, SHARES = 2 * np.pi * np.array([50e3, 120e3, 310e3]), np.array([6.0, 5.0, 4.0])


def block(kind=skfem.MeshTet, cells=(3, 2, 2)):
    """Return a block, clamped below, pushed above."""
    mesh = kind.init_tensor(*(np.linspace(0, side, n + 1) for side, n in zip(SIDES, cells, strict=True)))
    named = {"contact": lambda x: x[2] > SIDES[2] - 1e-9, "fixed": lambda x: x[2] < 1e-9}
    return assemble(mesh.with_boundaries(named), STEEL, order=2)


def seat(factor=1.0):
    """Return a seat of three undamped modes."""
    return ModalGreens(factor * OMEGA, 0 * OMEGA, SHARES[:, None], Residual.none())


def ours(greens, dt):
    return scene.course(scene.impact_of(greens, dt), 0.0)


@pytest.fixture(scope="module")
def exact():
    return switching.march(OMEGA, SHARES, 10e-9)


def test_the_march_tends_to_the_exact_motion_at_second_order(exact):
    errors = [scene.apart(ours(seat(), dt), exact)[0] for dt in (160e-9, 80e-9, 40e-9)]
    assert errors[-1] < 0.05
    assert np.log2(errors[0] / errors[-1]) / 2 > 1.7
    assert scene.apart(ours(seat(1.03), 40e-9), exact)[0] > 5 * errors[-1]


def test_newmark_of_scipy_finds_the_same(exact):
    """0.1 % is a few times its error at this step; 3 % of the frequencies move the force by more."""
    dt = 40e-9
    right, wrong = (scene.of_points(plain_impact.by_modes((f * OMEGA) ** 2, SHARES, dt), dt, 0.0) for f in (1.0, 1.03))
    assert scene.apart(right, exact)[0] < 0.1 < scene.apart(wrong, exact)[0]


@pytest.mark.skipif(bool(siconos_impact.absent()), reason=siconos_impact.absent())
def test_siconos_finds_the_same(exact):
    """The theta rule agrees at second order."""
    errors = [scene.apart(course, exact)[0] for course in siconos_impact.march(OMEGA, SHARES, (160e-9, 80e-9))]
    assert np.log2(errors[0] / errors[1]) > 1.7
    assert errors[1] < 0.2


@pytest.mark.slow
@pytest.mark.skipif(bool(calculix.absent()), reason=calculix.absent())
def test_the_contact_of_calculix_finds_the_same():
    """CalculiX's contact has the force of a march with its mass and step; 3 % of the modulus would be seen.

    Its damping moves 0.07 %. The momentum that its mass loses is the integral of the force read off the penetration.
    """
    model, dt = block(cells=(2, 2, 1)), 0.1e-6
    theirs, lost = calculix_impact.march(model, dt)
    assert lost == pytest.approx(scene.impulse(theirs), rel=1e-5)
    modes = solve_modes(calculix.with_its_mass(model, STEEL), model.size)
    [port] = model.ports.values()
    squares, shares = (2 * np.pi * modes.frequencies_hz) ** 2, port.vector @ modes.shapes
    right, wrong = (scene.of_points(plain_impact.by_modes(f * squares, shares, dt), dt, 0.0) for f in (1.0, 1.03))
    assert scene.apart(theirs, right)[0] < 0.2
    assert scene.apart(theirs, wrong)[0] > 1.0


@pytest.mark.skipif(bool(calculix.absent()), reason=calculix.absent())
def test_the_mass_explains_what_the_frequencies_differ_by():
    """Our frequencies with the four points of its mass agree with all seven digits that it prints."""
    model = block()
    same = calculix.with_its_mass(model, STEEL)
    theirs = calculix.frequencies(model, STEEL, 5).values
    assert np.abs(theirs / solve_modes(same, 5).frequencies_hz - 1).max() < 1e-6


def test_hexahedra_are_refused():
    with pytest.raises(ModelError, match="tetrahedra of order 2"):
        calculix.same_mass(block(skfem.MeshHex), STEEL)
