"""Criteria of several axes: calibration, invariances, quadrature, closed forms, spheres. Strengths are invented."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from impact.life import multiaxial
from impact.life.multiaxial import Crossland, DangVan, Multiaxial, Papadopoulos, deviators, enclosing_sphere
from impact.life.strength import LifeError

TORSION, BENDING = 310e6, 500e6
TIME = 2 * np.pi * np.arange(720) / 720
PLACES = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
CRITERIA: tuple[type[Multiaxial], ...] = (Crossland, DangVan, Papadopoulos)


def bending_and_torsion(sa: float, ta: float, *, lag: float = 0.0, mean: float = 0.0) -> np.ndarray:
    """Return (n, 6) stresses of bending and torsion, in MPa."""
    stress = np.zeros((len(TIME), 6))
    stress[:, 0] = 1e6 * (sa * np.sin(TIME) + mean)
    stress[:, 5] = 1e6 * ta * np.sin(TIME - lag)
    return stress


@pytest.mark.slow(but="0.8-Crossland")
@pytest.mark.parametrize("kind", CRITERIA)
@pytest.mark.parametrize("ratio", [0.58, 0.62, 0.8])
def test_both_limits_are_met_exactly(kind: type[Multiaxial], ratio: float) -> None:
    judge = kind(ratio * BENDING, BENDING)
    for stress in (bending_and_torsion(500, 0), bending_and_torsion(0, ratio * 500)):
        assert judge.value(stress) == pytest.approx(ratio * BENDING, rel=1e-9)
        assert judge.margin(stress) == pytest.approx(1, rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "ratio"),
    [
        (Crossland, 0.577),
        (Crossland, 1.01),
        (DangVan, 0.5),
        (DangVan, 1.01),
        (Papadopoulos, 0.577),
        (Papadopoulos, 0.81),
    ],
)
def test_limits_that_make_no_criterion(kind: type[Multiaxial], ratio: float) -> None:
    with pytest.raises(LifeError, match=rf"= {ratio}: {kind.name}"):
        kind(ratio * BENDING, BENDING)


@pytest.mark.slow
@settings(deadline=None, max_examples=12)
@given(st.integers(1, 30), st.integers(0, 10**6), st.floats(0.2, 5.0))
def test_axes_order_and_scale_do_not_count(number: int, seed: int, factor: float) -> None:
    """Turned bodies and shuffled times have equal values; all criteria are of first degree.

    The mean over planes is as exact as asked for; a turn changes where its nodes lie.
    """
    random = np.random.default_rng(seed)
    stress = 1e8 * random.normal(size=(number, 6))
    turn = Rotation.random(rng=seed).as_matrix()
    full = np.zeros((number, 3, 3))
    for k, (i, j) in enumerate(PLACES):
        full[:, i, j] = full[:, j, i] = stress[:, k]
    full = turn @ full @ turn.T
    turned = np.stack([full[:, i, j] for i, j in PLACES], axis=1)
    shuffled = random.permutation(stress)
    for judge, rel in ((Crossland(TORSION, BENDING), 1e-9), (DangVan(TORSION, BENDING), 1e-6)):
        expected = judge.value(stress)
        assert judge.value(turned) == pytest.approx(expected, rel=rel)
        assert judge.value(shuffled) == pytest.approx(expected, rel=rel)
        assert judge.value(factor * stress) == pytest.approx(factor * expected, rel=rel)
    planes = Papadopoulos(TORSION, BENDING, tolerance=1e-4)
    assert planes.value(turned) == pytest.approx(planes.value(stress), rel=3e-4)


@pytest.mark.slow
def test_shear_of_means_does_no_harm() -> None:
    """A constant shear stress moves the path and leaves its size."""
    base = bending_and_torsion(300, 150)
    shifted = base + 1e8 * np.array([0, 0, 0, 1.0, -2.0, 0.5])
    for kind in CRITERIA:
        judge = kind(TORSION, BENDING)
        assert judge.value(shifted) == pytest.approx(judge.value(base), rel=1e-7)


@pytest.mark.slow
@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6))
def test_the_mean_over_planes_of_harmonic_stress(seed: int) -> None:
    """5 <Ta^2> = J2(A) + J2(B), whatever the phases: polygons of 180 corners lack (pi/180)^2/3 on the mean."""
    in_phase, out = np.random.default_rng(seed).normal(size=(2, 6))
    stress = np.outer(np.cos(TIME), in_phase) + np.outer(np.sin(TIME), out) + 7.0
    expected = (deviators(np.stack([in_phase, out])) ** 2).sum()
    assert 5 * multiaxial.mean_square_shear(stress[::4], 1e-4) == pytest.approx(expected, rel=3e-4)


@pytest.mark.slow
def test_the_quadrature_is_of_third_order_and_meets_its_tolerance() -> None:
    """Paths with corners, the mean square over several of them: single errors change sign."""
    paths = [np.random.default_rng(seed).normal(size=(6, 6)) for seed in range(10)]
    exact = np.array([multiaxial._average(path, *multiaxial._polar(160)) for path in paths])
    numbers = np.array([8, 16, 32, 64])
    means = [[multiaxial._average(path, *multiaxial._polar(n)) for path in paths] for n in numbers]
    errors = [np.sqrt(np.mean((each / exact - 1) ** 2)) for each in means]
    order = -np.polyfit(np.log(numbers), np.log(errors), 1)[0]
    assert 2.6 < order < 3.8
    for path, expected in zip(paths, exact, strict=True):
        for tolerance in (1e-3, 1e-4, 1e-5):
            assert multiaxial.mean_square_shear(path, tolerance) == pytest.approx(expected, rel=tolerance)


@pytest.mark.slow
def test_a_mean_that_does_not_settle_says_so() -> None:
    path = np.random.default_rng(1).normal(size=(5, 6))
    with pytest.raises(LifeError, match=r"128 .*256 .*1e-12"):
        multiaxial.mean_square_shear(path, 1e-12)


@pytest.mark.slow
@settings(deadline=None, max_examples=12)
@given(st.integers(1, 12), st.integers(0, 10**6))
def test_what_a_path_is_made_of_does_not_count(number: int, seed: int) -> None:
    """Blocks taken twice, held, begun elsewhere, backwards, or with points between its own: the path is the same."""
    stress = 1e8 * np.random.default_rng(seed).normal(size=(number, 6))
    path = np.concatenate([stress, stress[:1]])
    between = np.concatenate([path[:-1] + share * np.diff(path, axis=0) for share in (0.0, 0.3, 0.6)])
    same = [np.tile(stress, (2, 1)), np.repeat(stress, 3, axis=0), np.roll(stress, number // 2, axis=0), stress[::-1]]
    for judge in (Crossland(TORSION, BENDING), DangVan(TORSION, BENDING)):
        expected = judge.value(stress)
        assert [judge.value(each) for each in [*same, between]] == pytest.approx([expected] * 5, rel=1e-6)
    planes = Papadopoulos(TORSION, BENDING, tolerance=1e-3)
    expected = planes.value(stress)
    assert [planes.value(each) for each in [*same, between]] == pytest.approx([expected] * 5, rel=3e-3)


@pytest.mark.slow(but="150.0-0.0")
@pytest.mark.parametrize("lag", [0.0, np.pi / 4, np.pi / 2])
@pytest.mark.parametrize("ta", [75.0, 150.0, 250.0])
def test_bending_and_torsion_in_closed_form(ta: float, lag: float) -> None:
    """Papadopoulos is sqrt(sa^2/3 + ta^2) + (3 t/f - sqrt 3) sa/3 at any lag; Crossland has in place of the root the
    ellipse's longer half axis, whose square is an eigenvalue of ((a^2, a t cos), (a t cos, t^2)), a = sa/sqrt 3."""
    stress, slant = bending_and_torsion(300, ta, lag=lag), (3 * TORSION / BENDING - np.sqrt(3)) * 100
    a, cross = 300 / np.sqrt(3), 300 / np.sqrt(3) * ta * np.cos(lag)
    radius = np.sqrt(np.linalg.eigvalsh([[a**2, cross], [cross, ta**2]])[1])
    crossland, planes = (kind(TORSION, BENDING).value(stress) / 1e6 for kind in (Crossland, Papadopoulos))
    assert crossland == pytest.approx(radius + slant, rel=2e-5)
    assert planes == pytest.approx(np.hypot(a, ta) + slant, rel=2e-5)


grid = arrays(np.float64, st.tuples(st.integers(1, 25), st.integers(1, 5)), elements=st.integers(-3, 3).map(float))


@pytest.mark.slow
@settings(deadline=None)
@given(grid)
def test_nothing_smaller_holds_points_of_a_grid(points: np.ndarray) -> None:
    """Grids are full of spheres through too many points, and of flat sets: the centre of the smallest sphere is in the
    hull of the points on it."""
    centre, radius = enclosing_sphere(points)
    distance = np.linalg.norm(points - centre, axis=1)
    assert distance.max() <= radius * (1 + 1e-12) + 1e-15 * np.abs(points).max()
    if radius > 0:
        on_it = points[distance > radius * (1 - 1e-7)]
        system = np.vstack([(on_it - centre).T / radius, np.ones(len(on_it))])
        assert nnls(system, np.append(np.zeros(points.shape[1]), 1.0))[1] < 1e-7


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
