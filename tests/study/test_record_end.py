"""Where the end of the record cuts a touch, or comes shortly before one, the bar of the impulse knows."""

from pathlib import Path

import numpy as np
import pytest

import impact
from seatfem.study.error_budget import CLOCK
from tests.gallery import load_text
from tests.steps import Budget, Solved, error_budget, run_contacts, stated_method, striker_of

STIFFNESS, MASS, SPEED = 40e6, 1e-4, 1.0
WAY = 30e-6  # from spring to spring [m]
STEP = 2e-9  # it delays the eighth touch by about 4 us, most of a touch [s]
SCENE = """
seat = {{ kind = "spring", stiffness = "40 N/um" }}
reed = {{ kind = "rigid_mass", mass = "0.1 g", velocity = "-1 m/s" }}
stopper = {{ kind = "spring", stiffness = "40 N/um", gap = "20 um" }}
contact = {{ gap = "10 um" }}
run = {{ duration = "{end} us" }}
"""
TOUCH = np.pi * np.sqrt(MASS / STIFFNESS)  # half a period
PERIOD = 2 * (WAY / SPEED + TOUCH)
FIRST = 10e-6 / SPEED
IMPULSE = 2 * MASS * SPEED


def impulse_until(end: float) -> float:
    """Return the seat's impulse in closed form: a mass between two springs loses nothing and returns every period."""
    whole, rest = divmod(end - FIRST, PERIOD)
    part = 0.5 * (1 - np.cos(np.pi * min(rest / TOUCH, 1.0)))
    return float(IMPULSE * (whole + part))


def budget_at(end: float, folder: Path, more: str = "") -> Budget:
    scene, spring = load_text(folder, SCENE.format(end=1e6 * end) + more), impact.spring(stiffness=STIFFNESS)
    striker = striker_of(scene)
    touches = run_contacts(scene, striker, spring, STEP)
    return error_budget(scene, stated_method(scene), Solved(spring, plane=True), striker, touches)


@pytest.mark.slow
def test_an_end_within_the_delay_of_a_touch_is_in_the_bar_of_the_impulse(tmp_path: Path) -> None:
    """The bar holds the last touch of the seat, which came later than known and is not finished."""
    late = FIRST + 7 * PERIOD + 1.2 * TOUCH
    budget = budget_at(late, tmp_path)
    error = abs(budget.values["impulse"] - impulse_until(late))
    assert error > 0.02 * budget.values["impulse"]  # an eighth of it is at stake
    assert error <= budget.bar("impulse") <= 2.5 * IMPULSE  # safety, and what was there before
    assert budget.dominant("impulse") == "time_step"
    assert CLOCK not in budget.values
    assert all(CLOCK not in part for part in budget.parts.values())
