"""The passive march: what it refuses, what it conserves, how fast it converges."""

import math
from dataclasses import replace

import numpy as np
import pytest

import impact
from impact import Body, ContactError, ContactProblem, ModalGreens, Residual

ROD = {"young": 4.0, "density": 1.0, "area": 3.0, "length": 2.0}  # c = 2, Z = 6, l/c = 1, mass 6


def mass_on(greens: impact.GreensFunction, **more: object) -> ContactProblem:
    striker = impact.rigid_mass(mass=6.0, velocity=-1.0)
    return ContactProblem(striker, Body(greens), **more)  # type: ignore[arg-type]


def test_rigid_contact_of_bodies_that_do_not_yield_at_once_is_refused() -> None:
    bare = impact.single_mode(frequency_hz=1.0, mass=1.0)
    with pytest.raises(ContactError, match=r"1/dt.*impact\.Residual"):
        impact.solve(mass_on(bare), dt=0.01, duration=1.0)
    impact.solve(mass_on(bare, law=impact.Hertz(stiffness=1.0)), dt=0.01, duration=0.1)
    yielding = replace(bare, residual=Residual.exponential(1e-3, 0.1))
    impact.solve(mass_on(yielding), dt=0.01, duration=0.1)


@pytest.mark.parametrize(
    ("dt", "duration", "words"),
    [
        (0.0, 1.0, "dt = 0.0 s"),
        (math.nan, 1.0, "dt = nan s"),
        (0.1, -1.0, "duration = -1.0 s"),
        (0.1, math.inf, "duration = inf s"),
        (0.1, 0.05, "must be at least one step"),
    ],
)
def test_impossible_steps_and_gaps_are_refused(dt: float, duration: float, words: str) -> None:
    rod = impact.fixed_rod(**ROD)
    with pytest.raises(ContactError, match=words):
        impact.solve(mass_on(rod), dt=dt, duration=duration)
    with pytest.raises(ContactError, match="gap = nan"):
        mass_on(rod, gap=math.nan)


def test_record_covers_the_duration_and_tells_progress() -> None:
    heard: list[float] = []
    problem = mass_on(impact.fixed_rod(**ROD))
    result = impact.solve(problem, dt=0.1, duration=0.95, progress=lambda _, done: heard.append(done))
    assert len(result.time) == len(result.force) == len(result.gap) == len(result.energy.stored) == 11
    assert result.time[-1] == pytest.approx(1.0)
    assert heard == sorted(heard)
    assert heard[-1] == 1.0
    assert len(impact.solve(problem, dt=0.1, duration=1.0).time) == 11  # 1.0/0.1 is ten steps, not eleven


def test_advice_when_the_step_is_too_coarse_for_the_highest_mode() -> None:
    fast = ModalGreens(np.array([1.0, 100.0]), np.zeros(2), np.ones((2, 1)), Residual.exponential(1e-3, 0.1))
    modes, contacts = impact.solve(mass_on(fast), dt=0.02, duration=1.0).advice
    assert modes.value == pytest.approx(2.0)
    assert "use dt <= 0.005 s" in str(modes)
    assert "contacts of fewer than 10 steps" in contacts.name
    assert contacts.value == pytest.approx(1.0, rel=1e-12)
    assert not impact.solve(mass_on(fast), dt=0.004, duration=1.0).advice


@pytest.mark.parametrize(("velocity", "side", "away"), [(2.0, 1, True), (-2.0, 1, False), (-2.0, -1, True)])
def test_a_striker_that_flies_away_is_told_the_sign_of_velocities(velocity: float, side: int, away: bool) -> None:
    contact = impact.Contact(impact.spring(stiffness=1e6), gap=1e-6, side=side, law=impact.LinearSpring(1e6))
    problem = ContactProblem(impact.rigid_mass(mass=1e-3, velocity=velocity), contacts=[contact])
    advice = " ".join(map(str, impact.solve(problem, dt=1e-7, duration=5e-5).advice))
    assert ("flies away" in advice) == (f"write velocity = {-velocity:g}" in advice) == away
