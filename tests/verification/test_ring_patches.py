"""Patches on a ring by Fourier harmonics and by curved hexahedra of the same section: three, or all."""

import math

import numpy as np
import pytest
import skfem

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.materials import Material
from seatfem.structures.method import Aims
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.harmonics import ring_greens
from seatfem.structures.reduction.lip_modes import lip_greens
from seatfem.structures.reduction.ring_patches import RingPatch
from tests.ring_mesh import around

STEEL = Material(200e9, 0.3, 7850.0)
BAND, DURATION, ZETA = 150e3, 30e-6, 0.05
TIMES = np.linspace(0, DURATION, 121)
INNER, OUTER, HEIGHT = 4e-3, 7e-3, 5e-3


def meridian(n=(3, 4)):
    mesh = skfem.MeshQuad.init_tensor(np.linspace(INNER, OUTER, n[0] + 1), np.linspace(0, HEIGHT, n[1] + 1))
    lip = INNER + (OUTER - INNER) / n[0]
    return mesh.with_boundaries(
        {"contact": lambda x: np.isclose(x[1], HEIGHT) & (x[0] < lip), "fixed": lambda x: np.isclose(x[1], 0.0)}
    )


def solve(patches, tolerance):
    return ring_greens(
        meridian(), STEEL, patches, order=2, bandwidth=BAND, duration=DURATION, tolerance=tolerance,
        damping_ratio=ZETA,
    )  # fmt: skip


def response(greens):
    return greens.filtered_matrix(TIMES, 1 / BAND)


SLICES = 32


def revolved_hexahedra(patches):
    """The meridian turned into curved 27-node hexahedra, with the arcs of the lip as boundaries."""

    def arc(low, high):
        def chosen(x):
            turn = np.mod(np.arctan2(x[1], x[0]) - low, 2 * math.pi)
            on_lip = np.isclose(x[2], HEIGHT) & (np.hypot(x[0], x[1]) < INNER + (OUTER - INNER) / 3)
            return on_lip & (turn < high - low)

        return chosen

    named = {name: arc(p.angle - p.width / 2, p.angle + p.width / 2) for name, p in patches.items()}
    return around(meridian(), SLICES).with_boundaries({**named, "fixed": lambda x: np.isclose(x[2], 0.0)})


def test_three_patches_on_hexahedra_answer_alike():
    """Same section, same quadratic functions: only the 32 slices and the reductions differ. Uneven on purpose."""
    step = 2 * math.pi / SLICES
    patches = {
        "a": RingPatch(1 * step, 2 * step),
        "b": RingPatch(10 * step, 4 * step),
        "c": RingPatch(24 * step, 8 * step),
    }
    model = assemble(revolved_hexahedra(patches), STEEL, ports={name: name for name in patches})
    solid = greens_function(model, bandwidth=BAND, duration=DURATION, tolerance=3e-3, damping_ratio=ZETA)
    turned = solve(patches, 3e-3)
    one, other = response(solid), response(turned)
    scale = np.abs(other).max()
    areas = [port.area for port in model.ports.values()]
    assert areas == pytest.approx([p.width / 2 * (25e-6 - 16e-6) for p in patches.values()], rel=1e-4)
    # besides the reductions, 32 parabolic slices resolve the edges of the shortest arc: measured 0.36 %, others less
    assert np.abs(one - other).max() < 6e-3 * scale
    for i, j in ((0, 1), (0, 2), (1, 2)):
        assert np.abs(one[i, j] - other[i, j]).max() < 0.05 * np.abs(other[i, j]).max()
    c = math.sqrt(1.03)  # a modulus 3 % higher: g(t) -> g(c t)/c exactly
    stiffer = turned.filtered_matrix(TIMES * c, c / BAND) / c
    assert np.abs(one - stiffer).max() > 6e-3 * scale


def test_all_arcs_of_a_lip_on_hexahedra():
    """Eight arcs of four slices each: modes up to three times the band of the harmonics, statics of all, against the
    solid's statics and its Krylov vectors."""
    step = 2 * math.pi / 8
    patches = {f"arc_{k + 1}": RingPatch((k + 0.5) * step, step) for k in range(8)}
    model = assemble(revolved_hexahedra(patches), STEEL, ports={name: name for name in patches})

    def harmonic(n):
        return assemble_axisymmetric(meridian(), STEEL, harmonic=n, order=2)

    lip = lip_greens(harmonic, patches, Aims(3 * BAND, DURATION, 0.01), ZETA)
    static = model.port_matrix.T @ factorize(model.K).solve(model.port_matrix)
    same = lip.static_compliance()
    assert np.abs(static - same).max() < 5e-3 * same.max()  # measured 0.18 %: slices, and what harmonics leave
    assert static[0, 1] == pytest.approx(same[0, 1], rel=0.015)
    solid = greens_function(model, bandwidth=BAND, duration=DURATION, tolerance=3e-3, damping_ratio=ZETA)
    one, other = response(solid), response(lip)
    assert np.abs(one - other).max() < 0.01 * np.abs(one).max()  # measured 0.42 %
    c = math.sqrt(1.03)
    stiffer = lip.filtered_matrix(TIMES * c, c / BAND) / c
    assert np.abs(one - stiffer).max() > 0.02 * np.abs(one).max()
