"""The contact forces behind a stress, on other parts of a patch than they were found on; notes of what has no bar."""

import math
import re
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from seatfem.structures.kinds import Annular
from seatfem.study.impacts.forces import PatchForces
from seatfem.study.impacts.validity import ONE_PORT
from seatfem.study.method import BAND, SIZE, STEP
from seatfem.study.plan import Choice
from seatfem.study.runs.seat_stress import SeatStress
from seatfem.study.runs.stresses import RECOVERY, WAVES, stress_notes
from tests.steps import Division, Plan


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


ALONE: dict[str, Any] = {
    "peak": SimpleNamespace(von_mises=np.ones(1)), "spots": (0,), "where": 0, "judged": (1.0, 1.0), "by_key": {}
}  # fmt: skip
"""A stress at one place."""


@pytest.mark.parametrize(("bars", "named"), [((1.0, 2.0), 0), ((math.nan, 2.0), 1), ((math.nan, math.nan), 2)])
def test_a_stress_without_a_bar_is_told(bars: tuple[float, float], named: int) -> None:
    seat = cast("SeatStress", SimpleNamespace(bar=bars[0], bars=bars, **ALONE))
    plan = cast("Plan", SimpleNamespace(level="axisymmetric", shares={}, scene=SimpleNamespace(stress=None)))
    notes = stress_notes(plan, seat)
    assert len(notes) == (named > 0)
    assert "".join(notes).count("_Pa") == named
    assert stress_notes(plan, None) == ()


@pytest.mark.parametrize(
    ("by_key", "edge", "words"),
    [
        ({RECOVERY: 0.2, STEP: 0.1}, 1.0, r"30 %, most of it by the mesh at its place: state a smaller seat\.mesh"),
        ({RECOVERY: 0.2, STEP: 0.1}, 1e-4, r"mesh near a sharp edge: draw the edge with a fillet, or state"),
        ({WAVES: 0.2, STEP: 0.1}, 1.0, r"waves .*: raise seat\.greens\.bandwidth"),
        ({ONE_PORT: 0.2, STEP: 0.1}, 1.0, r"single contact point instead of the lip: .* contact\.ports"),
        ({BAND: 0.1, SIZE: 0.1, STEP: 0.1}, 1.0, ""),
        ({RECOVERY: 0.15, STEP: 0.05}, 1.0, ""),
    ],
)  # fmt: skip
def test_what_makes_most_of_a_large_bar_is_named(by_key: Mapping[str, float], edge: float, words: str) -> None:
    """Notes name what makes more than half of a bar of 30 %, and nothing of a bar of 20 %."""
    bar, stress = sum(by_key.values()), SimpleNamespace(surface=True, distance=1e-4)
    seat = SimpleNamespace(**{**ALONE, "by_key": by_key}, bar=bar, bars=(bar, 0.1), from_excluded=edge)
    scene = SimpleNamespace(stress=stress, reed=SimpleNamespace(thin_plate=None), seat=Annular.model_construct())
    plan = SimpleNamespace(level="axisymmetric", refused={}, scene=scene)
    notes = [note for note in stress_notes(cast("Plan", plan), cast("SeatStress", seat)) if "uncertainty" in note]
    assert len(notes) == (words != "")
    assert all(re.search(words, note) for note in notes)


def test_stress_behind_a_force_without_waves_says_so() -> None:
    seat = cast("SeatStress", SimpleNamespace(bar=1.0, bars=(1.0, 2.0), **ALONE))
    choices = (Choice("seat.model", "spring", "", given=False, leaves="3.1 % of peak force"),)
    plan = cast("Plan", SimpleNamespace(level="spring", choices=choices, scene=SimpleNamespace(stress=None)))
    (note,) = stress_notes(plan, seat)
    assert "without waves in the seat, which leaves 3.1 % of peak force" in note
    assert "state seat.model" in note
