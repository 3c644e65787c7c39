"""Modes of very thin bodies: bending far below the frequencies that the size of the elements suggests."""

import math
from dataclasses import replace

import numpy as np
import pytest
import skfem

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.materials import Material
from seatfem.structures.reduction.eigen_search import null_limit
from seatfem.structures.reduction.modes import solve_modes

STEEL = Material(200e9, 0.3, 7850.0)
RADIUS = 10e-3
TWO_DIAMETERS, ONE_CIRCLE = 5.358, 9.003  # lambda^2 of the free disc, nu = 0.3 (Itao & Crandall, J. Appl. Mech. 1979)


def free_disc(ratio, n):
    """Return a disc, thickness ``ratio`` times its radius, of one layer of hexahedra, 2 n across."""
    x = np.linspace(-1, 1, 2 * n + 1)
    square = skfem.MeshHex.init_tensor(x, x, np.array([0.0, ratio * RADIUS]))
    x, y, z = square.p
    round_ = np.stack([RADIUS * x * np.sqrt(1 - y**2 / 2), RADIUS * y * np.sqrt(1 - x**2 / 2), z])
    return assemble(skfem.MeshHex(round_, square.t), STEEL, fixed=(), ports={}, order=2)


def unit(ratio):
    """Return w / lambda^2 of Kirchhoff's plate [rad/s]."""
    return ratio / RADIUS * math.sqrt(STEEL.young / (12 * (1 - STEEL.poisson**2) * STEEL.density))


@pytest.fixture(scope="module")
def thin():
    return free_disc(0.005, 3)


@pytest.fixture(scope="module")
def modes(thin):
    return solve_modes(thin, 9)


@pytest.mark.slow
def test_free_thin_disc_has_six_rigid_modes_and_kirchhoffs_frequencies(modes):
    assert modes.complete
    assert np.all(modes.frequencies_hz[:6] == 0.0)
    # six straight elements across: the dodecagon's area is 4.5 % small, so the frequencies lie up to that much above
    excess = modes.omega[6:] / unit(0.005) / np.array([TWO_DIAMETERS, TWO_DIAMETERS, ONE_CIRCLE]) - 1
    assert np.all((excess > 0) & (excess < 0.045))


@pytest.mark.slow
def test_rigid_modes_are_told_from_bending_by_round_off_alone(thin, modes):
    """Matrices without known rigid shapes have six rigid modes and the same bending."""
    unknown = solve_modes(replace(thin, dofs=None), 9)
    assert np.all(unknown.frequencies_hz[:6] == 0.0)
    assert unknown.frequencies_hz[6:] == pytest.approx(modes.frequencies_hz[6:], rel=1e-4)


def held_column(height):
    """Return a column between smooth walls, clamped below; its lowest tetrahedra are ``height`` times as high."""
    mesh = skfem.MeshTet.init_tensor(*(np.linspace(0, 1, n + 1) for n in (2, 2, 3)))
    points = mesh.p.copy()
    points[2, np.isclose(points[2], 1 / 3)] *= height
    mesh = skfem.MeshTet(points, mesh.t).with_boundaries(
        {"fixed": lambda x: x[2] < 1e-12, "top": lambda x: x[2] > 1 - 1e-9}
        | {f"side {i}{e}": lambda x, i=i, e=e: np.abs(x[i] - e) < 1e-9 for i in (0, 1) for e in (0, 1)}
    )
    sides = [f"side {i}{e}" for i in (0, 1) for e in (0, 1)]
    return assemble(mesh, Material(1.0, 0.3, 1.0), fixed="fixed", sliding=sides, ports={"contact": "top"}, order=2)


@pytest.mark.parametrize("height", [1e-4, 1e-6, 1e-8])
def test_one_layer_of_flat_elements_turns_no_mode_of_a_held_body_into_a_rigid_one(height):
    """It raises max K/M, hence the limit, far beyond the lowest w^2 = (pi/2)^2 (lambda + 2 mu)."""
    model = held_column(height)
    lam, mu = Material(1.0, 0.3, 1.0).lame
    assert (null_limit(model) > (math.pi / 2) ** 2 * (lam + 2 * mu)) == (height < 1e-6)
    assert solve_modes(model, 1).omega[0] == pytest.approx(math.pi / 2 * math.sqrt(lam + 2 * mu), rel=1e-3)
