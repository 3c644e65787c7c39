"""Search for the largest stress, and for its hot spots."""

from collections.abc import Iterator

import numpy as np
import pytest

from impact.greens.base import Array
from seatfem.structures.fields.peaks import Integers, largest, norms
from seatfem.structures.fields.sites import local_maxima
from seatfem.structures.mesh.checks import nearest_distances


class Two:
    """One place, two coordinates that are the forces themselves."""

    points, radians = np.zeros((1, 3)), np.array([0.0, 1.0])

    def __init__(self, *tensors: tuple[float, float, float]) -> None:
        self.tensors = np.array([(*each, 0.0, 0.0, 0.0) for each in tensors])

    @property
    def bounds(self) -> Array:
        return norms(self.tensors)[None]

    def coordinates(self, force: Array, dt: float, stride: int) -> Iterator[Array]:
        return iter([force[::stride]])

    def stress(self, which: Integers, values: Array, kept: Integers) -> Iterator[Array]:
        yield np.asarray((self.tensors[kept].T @ values)[None, None])


def test_no_block_is_passed_over_that_holds_the_largest() -> None:
    """The search has 1.9 of one axis as principal, and 2 of a later (1, -1, -1) as von Mises stress."""
    field, force = Two((1.9, 0.0, 0.0), (1.0, -1.0, -1.0)), np.zeros((1000, 2))
    force[100, 0] = force[900, 1] = 1.0
    peaks = largest(field, force, 0.5).after_contact
    assert peaks.von_mises[0] == 2.0
    assert peaks.von_mises_time[0] == 450.0
    assert peaks.principal[0] == 1.9


def test_a_landing_cuts_the_record_for_both_stresses() -> None:
    """Von Mises is largest before the landing and tension after it; at t = 0 there is what a preload leaves."""
    field, force = Two((1.0, 0.0, 0.0), (1.0, -1.0, -1.0)), np.zeros((1000, 2))
    force[0, 0] = 0.5
    force[100, 1], force[601, 0] = 1.0, 1.5
    peaks = largest(field, force, 0.5, since=300.0)
    spans = peaks.spans
    before, since = peaks.within(spans.until(spans.landing)), peaks.within(spans.after(spans.landing))
    assert before.von_mises[0] == 2.0
    assert before.principal[0] == pytest.approx(1.0, rel=1e-12)
    assert (before.von_mises_time[0], before.principal_time[0]) == (50.0, 50.0)
    assert (since.von_mises[0], since.principal[0], since.von_mises_time[0]) == (1.5, 1.5, 300.5)
    assert (peaks.after_contact.von_mises[0], peaks.after_contact.principal[0]) == (2.0, 1.5)
    assert peaks.within(spans.start).von_mises[0] == 0.5
    assert peaks.initial.von_mises[0] == 0.0


@pytest.mark.slow
def test_hot_spots_are_the_tops_of_hills() -> None:
    """A line with three hills has three hot spots; the higher shoulder of the first is none."""
    x = np.linspace(0, 10, 1001)
    values = 3 * np.exp(-((x - 2) ** 2)) + 1.0 * np.exp(-((x - 6) ** 2)) + 0.2 * np.exp(-((x - 9.5) ** 2))
    points = np.column_stack([x, 0 * x, 0 * x])
    np.testing.assert_allclose(x[local_maxima(points, values, 0.5)], [2, 6, 9.5], atol=0.02)
    np.testing.assert_allclose(x[local_maxima(points, values, 0.5, least=0.1)], [2, 6], atol=0.02)
    np.testing.assert_allclose(x[local_maxima(points, values, 3.7)], [2], atol=0.02)
    assert len(local_maxima(points, np.ones(1001), 20.0)) == 1
    np.testing.assert_allclose(nearest_distances(points[:3], points[[2]]), [0.02, 0.01, 0.0])
    assert np.isinf(nearest_distances(points, np.zeros((0, 3)))).all()
