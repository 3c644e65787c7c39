"""Surfaces whose triangles are wound alike, so that a section can tell their inside from their outside."""

import numpy as np
import pytest
import skfem

from seatfem.pictures.cell_grid import skin_of_section, wound_outward
from tests.moving_block import SIDES, block


def _volume(points: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_triangles_are_wound_outward_however_they_were(share: float) -> None:
    """Of two blocks apart from each other, a share of whose triangles is turned over."""
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


def test_a_surface_with_a_rim_has_no_inside() -> None:
    body = block("Block", ("1",))
    assert wound_outward(body.points, body.triangles[1:]) is None
