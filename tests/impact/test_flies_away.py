"""A striker that flies away from its target: the advice says which sign velocities have."""

import pytest

import impact


@pytest.mark.parametrize(("velocity", "side", "away"), [(2.0, 1, True), (-2.0, 1, False), (-2.0, -1, True)])
def test_the_sign_is_told(velocity: float, side: int, away: bool) -> None:
    ball = impact.rigid_mass(mass=1e-3, velocity=velocity)
    seat = impact.Body(impact.spring(stiffness=1e6))
    contact = impact.Contact(seat, gap=1e-6, side=side, law=impact.LinearSpring(1e6))
    result = impact.solve(impact.ContactProblem(ball, contacts=[contact]), dt=1e-7, duration=5e-5)
    told = [str(advice) for advice in result.advice if "flies away" in str(advice)]
    assert bool(told) == away
    if away:
        assert f"write velocity = {-velocity:g}" in told[0]
