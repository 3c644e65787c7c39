"""What is seen of bodies: closed surfaces of the right area, wound outward, turned with the section."""

import math
from typing import Any

import numpy as np
import pytest
import skfem

from seatfem.pictures.skins import OPENED, SLICES, Skin, skin_of, skin_of_section, wound_outward
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.materials import Material
from tests.moving_block import SIDES, block

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
    """The skin has chords of walls and ends over the angle drawn, and both cuts, and is closed."""
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


def _volume(points: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_triangles_are_wound_outward_however_they_were(share: float) -> None:
    """The triangles of two blocks face outward again after a share of them was turned over."""
    body = block("Block", ("1",))
    points = np.concatenate([body.points, body.points + np.array([1.0, 0.0, 0.0])])
    triangles = np.concatenate([body.triangles, body.triangles + len(body.points)])
    over = np.random.default_rng(1).random(len(triangles)) < share
    wound = wound_outward(points, np.where(over[:, None], triangles[:, ::-1], triangles))
    assert (np.sort(wound, axis=1) == np.sort(triangles, axis=1)).all()
    assert _volume(points, wound) == pytest.approx(2 * np.prod(SIDES), rel=1e-9)
    first = wound[: len(body.triangles)]
    a, b, c = np.moveaxis(points[first], 1, 0)
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), (a + b + c) / 3 - np.array(SIDES) / 2)
    assert (outward > 0).all()


def test_a_body_of_revolution_that_is_laid_open_is_closed() -> None:
    """Its volume is that of the section times the way of its centre, less what 48 chords leave out: 0.07 %."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(5e-3, 9e-3, 5), np.linspace(0.0, 6e-3, 4))
    skin = skin_of_section(mesh, *mesh.p)
    wound = wound_outward(skin.points, skin.triangles)
    assert wound is not None
    way = np.radians(240.0) * 7e-3
    assert _volume(skin.points, wound) == pytest.approx(24e-6 * way, rel=2e-3)
