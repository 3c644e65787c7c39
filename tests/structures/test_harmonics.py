"""Patches on a ring: Fourier sums, first velocities, whole rings and covered rings, messages."""

import math

import numpy as np
import pytest

from seatfem.structures.elements.supports import Dashpot, Foundation
from seatfem.structures.reduction.harmonics import (
    RingPatch,
    every_harmonic,
    first_velocities_beyond,
    ring_greens,
    summed,
)
from tests.ring_mesh import meridian
from tests.solids import Material, ModelError, SecondOrderModel, assemble_axisymmetric, greens_function

STEEL = Material(200e9, 0.3, 7850.0)
BAND, DURATION, ZETA = 150e3, 30e-6, 0.05
TIMES = np.linspace(0, DURATION, 121)


def solve(patches, tolerance=1e-2, **more):
    return ring_greens(
        meridian(), STEEL, patches, order=2, bandwidth=BAND, duration=DURATION, tolerance=tolerance, damping_ratio=ZETA,
        **more,
    )  # fmt: skip


def response(greens):
    return greens.filtered_matrix(TIMES, 1 / BAND)


def equally(patches, harmonics):
    """Return the sum of the weights of all pairs of patches on one ring."""
    return summed(patches, harmonics, np.ones((1, 1, len(harmonics))), [0] * len(patches))


def test_fourier_series_of_patches_sums_to_their_own_pressure():
    """All weights sum by Parseval to 2 pi/w on a patch and 0 between two; the rest falls like 1/n."""
    patches = {"a": RingPatch(0.2, 0.5), "b": RingPatch(1.5, 1.0)}
    total = 1 + 2 * equally(patches, np.arange(1, 20_001))
    np.testing.assert_allclose(total, np.diag([2 * math.pi / 0.5, 2 * math.pi]), atol=2e-3)
    beyond = first_velocities_beyond(patches, {"contact": 1.0}, 3)
    by_sum = 2 * equally(patches, np.arange(4, 20_001))
    np.testing.assert_allclose(beyond, by_sum, atol=2e-3)


@pytest.mark.slow
def test_stated_error_covers_a_ten_times_finer_tolerance():
    """Three patches 120 degrees apart, of 0.6 rad, the first turned by 0.3 rad."""
    patches = {name: RingPatch(0.3 + 2 * math.pi * k / 3, 0.6) for k, name in enumerate("abc")}
    three, fine = solve(patches), solve(patches, 1e-3)
    assert fine.origin["harmonics"] > three.origin["harmonics"]
    error = np.abs(response(three) - response(fine)).max() / np.abs(response(fine)).max()
    assert 1e-5 < error < three.error.reduction <= 1e-2
    assert fine.error.reduction <= 1e-3
    static = fine.static_compliance()
    np.testing.assert_allclose(three.static_compliance(), static, atol=1e-3 * static[0, 0])


@pytest.mark.slow
def test_patches_that_cover_the_ring_are_the_ring():
    """A force shared by three patches of 120 degrees is uniform: the mean of all g_ij is the harmonic 0."""
    thirds = solve({str(k): RingPatch(2 * math.pi * k / 3, 2 * math.pi / 3) for k in range(3)})
    model = assemble_axisymmetric(meridian(), STEEL, order=2)
    ring = greens_function(model, bandwidth=BAND, duration=DURATION, tolerance=1e-4, damping_ratio=ZETA)
    whole = ring.filtered(TIMES, 1 / BAND)
    # the thirds' weights cancel to round-off, so only the reduction of harmonic 0 differs
    assert np.abs(response(thirds).mean(axis=(0, 1)) - whole).max() < 4e-3 * np.abs(whole).max()


@pytest.mark.parametrize(
    ("patches", "words"),
    [
        ({}, "no ring patch"),
        ({"a": RingPatch(0.0, 1.0), "b": RingPatch(6.0, 0.5)}, "'a' and 'b' overlap"),
        ({"a": RingPatch(0.0, 1.0, "lip")}, "no boundary 'lip'"),
    ],
)
def test_bad_patches_are_named(patches, words):
    with pytest.raises(ModelError, match=words):
        solve(patches)


@pytest.mark.parametrize("width", [0.0, -1.0, 7.0, math.nan])
def test_width_of_a_patch_is_checked(width):
    with pytest.raises(ModelError, match="width"):
        RingPatch(0.0, width)


@pytest.mark.parametrize("harmonic", [3, 7, 50, 1000])
@pytest.mark.parametrize("poisson", [0.3, 0.49])
def test_matrices_of_all_harmonics_follow_from_three(harmonic: int, poisson: float) -> None:
    """K is quadratic in n from 2 on, also on a bed, with damping, and of a nearly incompressible material."""
    bed = [Foundation("fixed", 1e12, 1e11), Dashpot("fixed", 1e5)]
    material = Material(5e9, poisson, 1300.0, loss_factor=0.1)

    def assembled(n: int) -> SecondOrderModel:
        return assemble_axisymmetric(
            meridian(), material, harmonic=n, order=2, fixed=(), supports=bed, rayleigh=(10.0, 1e-8)
        )

    own, found = assembled(harmonic), every_harmonic(assembled)(harmonic)
    for name in ("M", "K", "C", "loss"):
        one, other = getattr(own, name), getattr(found, name)
        assert abs(one - other).max() < 1e-12 * abs(one).max()
    assert found.damping == own.damping
    assert (found.damping.loss is None) == (own.damping.loss is None)
    assert found.port_matrix == pytest.approx(own.port_matrix)
