"""Bodies under lips that are no rings about their middles: kidney-shaped ports, strips, several faces."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import skfem

from impact.greens.base import Array
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.lands import FaceLip, land_of
from seatfem.structures.materials import Material
from seatfem.structures.method import Aims
from seatfem.structures.reduction.lip_modes import face_greens
from tests.structures.test_face_lip import KIDNEY, closed

AIMS = Aims(100e3, 40e-6, 0.01)
YOUNG, HEIGHT = 200e9, 3e-3
WITHOUT_POISSON = Material(YOUNG, 0.0, 7850.0)
STEEL = Material(YOUNG, 0.3, 7850.0)


@cache
def kidney_statics(steps: int, arcs: int) -> Array:
    """Return (arcs, arcs) of a clamped wall on the kidney's lip, with so many hexahedra along, 2 across, 3 high."""
    inner, outer = FaceLip(KIDNEY, 1).cuts(np.arange(steps) / steps)
    levels = np.linspace(0.0, HEIGHT, 4)
    cuts = zip(inner, outer, strict=True)
    points = np.array([(*(a + v * (b - a)), z) for a, b in cuts for v in (0, 0.5, 1) for z in levels])
    number = np.arange(len(points)).reshape(steps, 3, 4)
    around = np.concatenate([number, number[:1]])
    cells = [around[k : k + 2, v : v + 2, z : z + 2] for k in range(steps) for v in range(2) for z in range(3)]
    order = [(0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 0), (1, 1, 1)]
    corners = np.array([[cell[at] for at in order] for cell in cells]).T
    mesh = skfem.MeshHex(points.T.copy(), corners)
    mesh = mesh.with_boundaries(
        {"contact": lambda x: np.isclose(x[2], HEIGHT), "fixed": lambda x: np.isclose(x[2], 0.0)}
    )
    lip = FaceLip(KIDNEY, arcs) if arcs > 1 else None
    greens, _ = face_greens(assemble(mesh, STEEL, lip=lip), AIMS, static=True)
    return greens.static_compliance()


@pytest.mark.slow
def test_a_kidney_answers_as_a_whole() -> None:
    """A uniform pressure on all arcs is that on one port; the arcs are those of its mirror image. With twice and four
    times as many elements along it the arcs' compliances converge with the second power at least."""
    many = kidney_statics(40, 16)
    np.testing.assert_allclose(many, many.T, atol=1e-12 * many.max())
    assert many.mean() == pytest.approx(kidney_statics(40, 1)[0, 0], rel=1e-9)
    np.testing.assert_allclose(many, many[::-1, ::-1], atol=5e-3 * many.max())
    first, second, third = (kidney_statics(steps, 16) for steps in (20, 40, 80))
    coarse, fine = np.abs(second - first).max(), np.abs(third - second).max()
    assert coarse / fine > 3.0
    assert fine < 0.05 * third.max()  # measured 3.5 %, with linear elements


def block(arcs: int, rings: int, apart: float, material: Material) -> tuple[Array, FaceLip]:
    """Return statics of a bar of 12 by 1 mm under its top, but for the middle as far as ``apart``; its lip."""
    x = np.linspace(-6e-3, 6e-3, 37)
    mesh = skfem.MeshHex.init_tensor(x, np.linspace(-0.5e-3, 0.5e-3, 3), np.linspace(0, HEIGHT, 5))
    mesh = mesh.with_boundaries(
        {
            "contact": lambda x: np.isclose(x[2], HEIGHT) & (np.abs(x[0]) > apart),
            "fixed": lambda x: np.isclose(x[2], 0.0),
        }
    )
    ends = [(-6e-3, -apart), (apart, 6e-3)] if apart else [(-6e-3, 6e-3)]
    faces = [np.array([(a, -0.5e-3), (b, -0.5e-3), (b, 0.5e-3), (a, 0.5e-3)]) for a, b in ends]
    edges = np.array((0, 0, HEIGHT)) + np.concatenate([closed(face) for face in faces])
    lip = FaceLip(land_of(edges, (0, 0, 1)), arcs, rings)
    greens, _ = face_greens(assemble(mesh, material, lip=lip), AIMS, static=True)
    return greens.static_compliance(), lip


@pytest.mark.parametrize(("arcs", "rings"), [(8, 1), (10, 2)])
def test_a_strip_on_a_block_without_poissons_ratio(arcs: int, rings: int) -> None:
    """It is a column: under an even pressure every part of the strip sinks by F h/(E A), whatever the parts are."""
    compliance, lip = block(arcs, rings, 0.0, WITHOUT_POISSON)
    np.testing.assert_allclose(compliance @ lip.division.shares, HEIGHT / (YOUNG * 12e-6), rtol=1e-8)
    np.testing.assert_allclose(compliance, compliance.T, atol=1e-12 * compliance.max())
    assert np.ptp(np.diag(compliance)) > 0.1 * compliance.max()  # parts alone differ


@pytest.mark.slow
def test_two_faces_know_of_each_other() -> None:
    """Compliances of two faces are reciprocal, mirrored, and have the means of both; one hardly moves the other."""
    compliance, lip = block(8, 1, 2e-3, STEEL)
    assert lip.pieces == ((4, False), (4, False))
    np.testing.assert_allclose(compliance, compliance.T, atol=1e-12 * compliance.max())
    np.testing.assert_allclose(compliance, compliance[::-1, ::-1], atol=1e-9 * compliance.max())
    whole, _ = block(2, 1, 2e-3, STEEL)
    assert compliance.mean() == pytest.approx(whole.mean(), rel=1e-9)
    halves = compliance.reshape(2, 4, 2, 4).mean(axis=(1, 3))
    np.testing.assert_allclose(halves, whole, rtol=1e-9)
    assert abs(compliance[3, 4]) < 0.2 * compliance[3, 3]
