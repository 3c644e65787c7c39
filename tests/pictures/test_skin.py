"""What is seen of bodies: closed surfaces of the right area, and displacements turned with the section."""

import math
from typing import Any

import numpy as np
import pytest
import skfem

from seatfem.pictures.cell_grid import OPENED, SLICES, Skin, skin_of, skin_of_plate
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.materials import Material

STEEL = Material(200e9, 0.3, 7850.0, "steel")


def area(skin: Skin) -> float:
    corners = skin.points[skin.triangles]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(crossed, axis=1).sum() / 2)


@pytest.mark.parametrize("kind", [skfem.MeshTet, skfem.MeshHex])
@pytest.mark.parametrize("order", [1, 2])
def test_a_box_has_six_faces(kind: Any, order: int) -> None:
    mesh = kind().refined(1).scaled((1e-3, 2e-3, 3e-3))
    mesh = mesh.with_boundaries({"fixed": lambda x: x[2] < 1e-9, "contact": lambda x: x[2] > 3e-3 - 1e-9})
    skin = skin_of(assemble(mesh, STEEL, order=order))
    assert area(skin) == pytest.approx(2 * (2 + 3 + 6) * 1e-6, rel=1e-9)
    assert skin.size == pytest.approx(3e-3)
    moved = np.arange(3.0 * len(skin.nodes)).reshape(-1, 3)
    np.testing.assert_array_equal(skin.moved(moved), moved[skin.which])


def test_a_tube_is_laid_open() -> None:
    """Walls and ends over the angle that is drawn, by chords, and the two cuts; closed everywhere."""
    a, b, height = 1e-3, 3e-3, 4e-3
    mesh = skfem.MeshQuad.init_tensor(np.linspace(a, b, 4), np.linspace(0, height, 5))
    mesh = mesh.with_boundaries({"fixed": lambda x: x[1] < 1e-9, "contact": lambda x: x[1] > height - 1e-9})
    skin = skin_of(assemble_axisymmetric(mesh, STEEL))
    slice_ = (OPENED[1] - OPENED[0]) / SLICES
    walls = SLICES * 2 * math.sin(slice_ / 2) * (a + b) * height
    ends = SLICES * math.sin(slice_) * (b**2 - a**2)
    assert area(skin) == pytest.approx(walls + ends + 2 * (b - a) * height, rel=1e-9)
    sides = np.sort(np.concatenate([skin.triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    assert (np.unique(sides, axis=0, return_counts=True)[1] == 2).all()
    outwards = skin.moved(np.tile([1.0, 0.0, 2.0], (len(skin.nodes), 1)))
    assert skin.angles is not None
    np.testing.assert_allclose(outwards[:, 0], np.cos(skin.angles))
    np.testing.assert_allclose(outwards[:, 1], np.sin(skin.angles))
    np.testing.assert_allclose(outwards[:, 2], 2.0)


def test_a_plate_shows_one_face() -> None:
    points = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0)], dtype=float)
    skin = skin_of_plate(PlateMesh(points, np.arange(9)[None, :]))
    assert area(skin) == pytest.approx(4.0)
    assert len(skin.nodes) == 9
