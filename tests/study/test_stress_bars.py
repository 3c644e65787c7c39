"""The contact forces behind a stress, on other parts of a patch than they were found on; notes of what has no bar."""

import math
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from seatfem.structures.rings import Division, ring_shares
from seatfem.study.runs.seat_stress import SeatStress
from seatfem.study.runs.stresses import Forces, stress_notes


def test_forces_keep_their_sum_and_their_place_along_the_lip() -> None:
    force = np.random.default_rng(0).uniform(0, 5, (3, 8))
    four = Forces(force, Division(4, 2), None, 1e-7)
    assert four.by(Division(4, 2)) is force
    np.testing.assert_allclose(four.by(Division())[:, 0], force.sum(axis=1))
    arcs = force.reshape(3, 4, 2).sum(axis=2)
    np.testing.assert_allclose(four.by(Division(2)), arcs.reshape(3, 2, 2).sum(axis=2))
    np.testing.assert_allclose(four.by(Division(8)), np.repeat(arcs / 2, 2, axis=1))
    np.testing.assert_allclose(four.by(Division(4, 3)), (arcs[:, :, None] * ring_shares(3)).reshape(3, 12))


@pytest.mark.parametrize(("bars", "named"), [((1.0, 2.0), 0), ((math.nan, 2.0), 1), ((math.nan, math.nan), 2)])
def test_a_stress_without_a_bar_is_told(bars: tuple[float, float], named: int) -> None:
    seat = cast("SeatStress", SimpleNamespace(bar=bars[0], tension_bar=bars[1]))
    notes = stress_notes(seat)
    assert len(notes) == (named > 0)
    assert "".join(notes).count("_Pa") == named
    assert stress_notes(None) == ()
