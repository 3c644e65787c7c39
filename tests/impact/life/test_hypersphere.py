"""Smallest spheres: known ones, and the certificate that nothing smaller holds the points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import nnls

from impact.life.planes import enclosing_sphere
from impact.life.strength import LifeError

grid = arrays(np.float64, st.tuples(st.integers(1, 25), st.integers(1, 5)), elements=st.integers(-3, 3).map(float))


def gap(points: np.ndarray, centre: np.ndarray, radius: float) -> float:
    """How far the centre is from the hull of the points on the sphere, over the radius: 0 for the smallest sphere."""
    distance = np.linalg.norm(points - centre, axis=1)
    assert distance.max() <= radius * (1 + 1e-12) + 1e-15 * np.abs(points).max()
    if radius == 0:
        return 0.0
    on_it = points[distance > radius * (1 - 1e-7)]
    system = np.vstack([(on_it - centre).T / radius, np.ones(len(on_it))])
    return float(nnls(system, np.append(np.zeros(points.shape[1]), 1.0))[1])


@settings(deadline=None)
@given(grid)
def test_nothing_smaller_holds_points_of_a_grid(points: np.ndarray) -> None:
    """Grids are full of spheres through too many points, and of flat sets."""
    assert gap(points, *enclosing_sphere(points)) < 1e-7


@settings(deadline=None, max_examples=60)
@given(st.integers(1, 400), st.sampled_from(["cloud", "sphere", "curve", "far"]), st.integers(0, 10**6))
def test_nothing_smaller_holds_any_points(number: int, kind: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    points = random.normal(size=(number, 5))
    if kind == "sphere":
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    elif kind == "curve":
        turns = 2 * np.pi * np.arange(number)[:, None] / number
        points = np.sin(turns * np.array([1, 2, 3, 5, 7]) + random.uniform(0, 7, 5))
    elif kind == "far":
        points = 1e-3 * points + 1e3
    assert gap(points, *enclosing_sphere(points)) < (1e-7 if kind != "far" else 1e-5)  # 1e3/1e-3 of round-off


def test_spheres_by_hand() -> None:
    simplex = np.eye(6) - 1 / 6  # six corners as far from each other as sqrt 2: radius sqrt(5/12) times that
    assert enclosing_sphere(simplex)[1] == pytest.approx(np.sqrt(5 / 6), rel=1e-12)
    ellipse = np.deg2rad(np.arange(360))
    path = np.stack([5 * np.cos(ellipse) + 1, 3 * np.sin(ellipse)], axis=1)
    centre, radius = enclosing_sphere(path)
    assert radius == pytest.approx(5, rel=1e-12)
    np.testing.assert_allclose(centre, [1, 0], atol=1e-9)
    flat = np.array([[-4.0, 0], [4, 0], [0, 5]])  # circumscribed: 25 + ... : r = (16 + 25)/10
    assert enclosing_sphere(flat)[1] == pytest.approx(4.1, rel=1e-12)
    assert enclosing_sphere(flat * [1, 0.5])[1] == pytest.approx(4, rel=1e-12)


def test_one_place() -> None:
    centre, radius = enclosing_sphere(np.tile([3.0, 4.0], (7, 1)))
    assert (centre.tolist(), radius) == ([3, 4], 0)
    with pytest.raises(LifeError, match="must be finite"):
        enclosing_sphere(np.array([[0.0], [np.nan]]))
