"""A seat's lip in arcs: against all Fourier harmonics, the seat as a whole, and what a continuum begins with."""

import math

import numpy as np
import pytest

from impact.greens.modal import ModalGreens
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.lip import Lip
from seatfem.structures.materials import Material
from seatfem.structures.method import Aims
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.harmonics import RingPatch, ring_greens
from seatfem.structures.reduction.lip_modes import lip_greens
from seatfem.structures.reduction.modes import ConvergenceError, modes_near, solve_modes
from seatfem.structures.rings import as_a_whole
from tests.ring_mesh import INNER, meridian

STEEL = Material(200e9, 0.3, 7850.0)
BAND, DURATION, ZETA = 100e3, 30e-6, 0.05
TIMES = np.linspace(0, DURATION, 121)


MESH = meridian()
LIP = Lip(INNER + 0.5e-3, 1e-3, 8)
AREA = math.pi * 9e-6  # of the lip, from 4 to 5 mm


def patches(arcs: int) -> dict[str, RingPatch]:
    lip = Lip(LIP.radius, LIP.width, arcs)
    return {
        name: RingPatch(float(angle), 2 * math.pi / arcs)
        for name, angle in zip(lip.division.names, lip.angles, strict=True)
    }


def model(harmonic: int, material: Material = STEEL):
    return assemble_axisymmetric(MESH, material, harmonic=harmonic)


def in_arcs(arcs: int, band: float = BAND, damping: float = ZETA, static: bool = False) -> ModalGreens:
    return lip_greens(model, patches(arcs), Aims(band, DURATION, 0.01), damping, static=static)


@pytest.fixture(scope="module")
def eight() -> ModalGreens:
    """Return the lip in 8 arcs, solved to three times the band in which it is judged."""
    return in_arcs(8, 3 * BAND)


def off(one: ModalGreens, other: ModalGreens, c: float = 1.0) -> float:
    """Return the largest difference of g behind a pulse, of the largest; ``c``: of one with a modulus c^2 as high."""
    here, there = one.filtered_matrix(TIMES, 1 / BAND), other.filtered_matrix(TIMES * c, c / BAND) / c
    return float(np.abs(here - there).max() / np.abs(there).max())


@pytest.mark.slow
def test_against_all_harmonics_by_krylov_vectors(eight: ModalGreens) -> None:
    """Statics agree to 0.2 % of an arc's own, as each interpolates between other harmonics, and responses in the band
    to 1 % (measured 0.6 %)."""
    other = ring_greens(MESH, STEEL, patches(8), bandwidth=BAND, duration=DURATION, tolerance=1e-3, damping_ratio=ZETA)
    one, same = eight.static_compliance(), other.static_compliance()
    assert np.abs(one - same).max() < 2e-3 * same.max()
    assert off(eight, other) < 0.01
    assert off(eight, other, math.sqrt(1.03)) > 0.02


@pytest.mark.slow
def test_more_modes_converge(eight: ModalGreens) -> None:
    """Modes above what a pulse excites answer with their statics: errors fall like 1/cutoff^2 in the end (measured
    orders 1.35 and 1.83), and what is stated covers them."""
    errors, stated = zip(
        *((off(modes := in_arcs(8, k * BAND), eight), modes.error_estimate.reduction) for k in (0.5, 1, 2)), strict=True
    )
    assert math.log2(errors[0] / errors[1]) > 1.2
    assert math.log2(errors[1] / errors[2]) > 1.7
    assert all(bar > error for bar, error in zip(stated, errors, strict=True))


@pytest.mark.slow
def test_the_lip_as_a_whole_is_the_axisymmetric_seat(eight: ModalGreens) -> None:
    """The mean of all arcs has the seat's statics to round-off and its waves to 1 % (measured 0.4)."""
    ring = model(0)
    whole = as_a_whole(eight)
    static = float((ring.port_matrix.T @ factorize(ring.K).solve(ring.port_matrix))[0, 0])
    assert whole.static_compliance()[0, 0] == pytest.approx(static, rel=1e-10)
    assert as_a_whole(in_arcs(8, static=True)).static_compliance()[0, 0] == pytest.approx(static, rel=1e-10)
    g = greens_function(ring, bandwidth=BAND, duration=DURATION, tolerance=1e-3, damping_ratio=ZETA)
    assert off(whole, g) < 0.01
    assert off(whole, g, math.sqrt(1.03)) > 0.02


@pytest.mark.slow
@pytest.mark.parametrize("static", [False, True])
def test_every_arc_begins_as_a_continuum(static: bool) -> None:
    """An arc's g(0+) is 1/(rho c_p A_i), and nothing couples arcs at once."""
    greens = in_arcs(8, damping=0.0, static=static)
    alone = 8 / (STEEL.density * STEEL.c_p * AREA)
    np.testing.assert_allclose(greens.initial_value(), alone * np.eye(8), atol=1e-6 * alone)


def test_it_is_passive_and_reciprocal_and_the_same_all_around(eight: ModalGreens) -> None:
    static = eight.static_compliance()
    assert np.array_equal(static, static.T)
    assert np.linalg.eigvalsh(static).min() > 0.1 * static.max()
    assert np.linalg.eigvalsh(eight.residual.static()).min() >= 0
    assert eight.residual.rates.min() > 0
    g = eight.filtered_matrix(TIMES, 1 / BAND)
    np.testing.assert_allclose(g, g.transpose(1, 0, 2), atol=1e-12 * np.abs(g).max())
    turned = np.roll(g, (3, 3), (0, 1))
    np.testing.assert_allclose(g, turned, atol=1e-6 * np.abs(g).max())


def test_what_cannot_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("seatfem.structures.reduction.lip_modes.MOST", 6)
    with pytest.raises(ConvergenceError, match=r"\d.*compliance"):
        in_arcs(32)


def test_modes_of_a_harmonic_follow_from_those_before() -> None:
    """All modes of a harmonic are found from those of the two before, which alone are 3 % and more off, and none from
    what has nothing to do with them."""
    highest = 1e6
    before = [solve_modes(model(n), up_to_hz=1.2 * highest) for n in (4, 5)]
    whole = solve_modes(model(6), up_to_hz=highest)
    close = modes_near(model(6), np.concatenate([each.shapes for each in before], axis=1), highest, "auto")
    assert close is not None
    omega, shapes = close
    assert omega == pytest.approx(whole.omega, rel=1e-4)
    port, unit = model(6).port_matrix, np.eye(len(omega))
    assert shapes.T @ (model(6).M @ shapes) == pytest.approx(unit, abs=1e-6)
    felt, wanted = ((each.T @ port)[:, 0] ** 2 for each in (shapes, whole.shapes))
    assert felt == pytest.approx(wanted, abs=0.01 * wanted.max())
    assert abs(before[1].omega[0] / whole.omega[0] - 1) > 0.03
    few = solve_modes(model(5), 2).shapes
    assert modes_near(model(6), few, highest, "auto") is None
