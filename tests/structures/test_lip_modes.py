"""A seat's lip in arcs: against all Fourier harmonics, the seat as a whole, and what a continuum begins with."""

from __future__ import annotations

import math

import numpy as np
import pytest
import skfem

from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.lip import Lip
from seatfem.structures.materials import Material
from seatfem.structures.method import Aims
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.harmonics import ring_greens
from seatfem.structures.reduction.lip_modes import lip_greens
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.reduction.ring_patches import RingPatch
from seatfem.structures.rings import as_a_whole, divided_less, Division
from impact.greens.modal import ModalGreens

STEEL = Material(200e9, 0.3, 7850.0)
INNER, OUTER, HEIGHT = 4e-3, 7e-3, 5e-3
BAND, DURATION, ZETA = 100e3, 30e-6, 0.05
TIMES = np.linspace(0, DURATION, 121)


def meridian():
    mesh = skfem.MeshQuad.init_tensor(np.linspace(INNER, OUTER, 4), np.linspace(0, HEIGHT, 5))
    return mesh.with_boundaries(
        {
            "contact": lambda x: np.isclose(x[1], HEIGHT) & (x[0] < INNER + (OUTER - INNER) / 3),
            "fixed": lambda x: np.isclose(x[1], 0.0),
        }
    )


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
    return in_arcs(8)


def test_against_all_harmonics_by_krylov_vectors(eight: ModalGreens) -> None:
    other = ring_greens(
        MESH, STEEL, patches(8), bandwidth=BAND, duration=DURATION, tolerance=1e-3, damping_ratio=ZETA
    )
    one, same = eight.static_compliance(), other.static_compliance()
    print("static", np.abs(one - same).max() / np.abs(same).max())
    a, b = eight.filtered_matrix(TIMES, 1 / BAND), other.filtered_matrix(TIMES, 1 / BAND)
    print("g", np.abs(a - b).max() / np.abs(b).max(), eight.error_estimate, len(eight.omega), len(other.omega))
    c = math.sqrt(1.03)
    stiffer = other.filtered_matrix(TIMES * c, c / BAND) / c
    print("3 %", np.abs(a - stiffer).max() / np.abs(b).max())


def test_as_a_whole(eight: ModalGreens) -> None:
    ring = model(0)
    static = float((ring.port_matrix.T @ factorize(ring.K).solve(ring.port_matrix))[0, 0])
    whole = as_a_whole(eight)
    print(whole.static_compliance()[0, 0] / static - 1)
    g = greens_function(ring, bandwidth=BAND, duration=DURATION, tolerance=1e-3, damping_ratio=ZETA)
    a, b = whole.filtered(TIMES, 1 / BAND), g.filtered(TIMES, 1 / BAND)
    print(np.abs(a - b).max() / np.abs(b).max())


def test_structure(eight):
    static, start = eight.static_compliance(), eight.initial_value()
    print(np.linalg.eigvalsh(static)[:3] / np.abs(static).max(), np.abs(static - static.T).max())
    print(start * STEEL.density * STEEL.c_p * AREA / 8)
    t = np.linspace(0, 1e-5, 9)
    print(eight.impulse_response(t, 0, 3) - eight.impulse_response(t, 3, 0), eight.impulse_response(t, 0, 3) - eight.impulse_response(t, 2, 5))
    r = eight.residual.static()
    print(np.linalg.eigvalsh(r) / r.max())


def test_joined():
    many, few = in_arcs(32), in_arcs(8)
    j = divided_less(many, Division(8))
    print(np.abs(j.static_compliance() - few.static_compliance()).max() / few.static_compliance().max())
    a, b = j.filtered_matrix(TIMES, 1 / BAND), few.filtered_matrix(TIMES, 1 / BAND)
    print(np.abs(a - b).max() / np.abs(b).max())
    print(len(many.omega), len(few.omega))


def test_bands():
    ref = in_arcs(8, 3 * BAND)
    for f in (1, 2):
        g = in_arcs(8, BAND * f)
        a, b = g.filtered_matrix(TIMES, 1 / BAND), ref.filtered_matrix(TIMES, 1 / BAND)
        print(np.abs(a - b).max() / np.abs(b).max(), g.error_estimate.reduction, len(g.omega))
