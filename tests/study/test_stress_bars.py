"""The contact forces behind a stress, on other parts of a patch than they were found on; notes of what has no bar."""

import numpy as np

from seatfem.study.impacts.forces import PatchForces
from tests.steps import Division


def test_forces_keep_their_sum_and_their_place_on_the_lip() -> None:
    force = np.random.default_rng(0).uniform(0, 5, (3, 8))
    four = PatchForces(force, Division(4, 2))
    assert four.by(Division(4, 2)) is force
    np.testing.assert_allclose(four.by(Division())[:, 0], force.sum(axis=1))
    arcs = force.reshape(3, 4, 2).sum(axis=2)
    np.testing.assert_allclose(four.by(Division(2)), arcs.reshape(3, 2, 2).sum(axis=2))
    np.testing.assert_allclose(four.by(Division(8)), np.repeat(arcs / 2, 2, axis=1))
    rings = force.reshape(3, 4, 2)  # borders at 0, 1/2, 1 of the area, those of three at 0, 1/4, 3/4, 1
    across = np.stack([rings[..., 0] / 2, rings.mean(axis=2), rings[..., 1] / 2], axis=2)
    np.testing.assert_allclose(four.by(Division(4, 3)), across.reshape(3, 12))
