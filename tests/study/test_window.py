"""The part of a run with the judged impact: as the whole run has it."""

from dataclasses import replace

import pytest

from seatfem.study.impacts.contact import run_contacts
from seatfem.study.impacts.window import Excerpt, advanced, window_of
from tests.as_stated import striker_of
from tests.study.small_scenes import ANNULAR, REED, SPRING, scene_of

STEP = 20e-9


def test_free_flight_is_exact() -> None:
    """A window of the run is the run: same filtered peak and duration, whatever is left out before."""
    scene = scene_of(ANNULAR, REED)
    seat, striker = scene.seat.estimate(), striker_of(scene, 30)
    touches = run_contacts(scene, striker, seat, STEP)
    window = window_of(scene, striker, touches.seat.force[1:], STEP, landings=touches.landings.seat)
    assert window.start > 0.5e-3
    excerpt = Excerpt(scene, window, seat, striker)
    whole = replace(excerpt, window=replace(window, start=0.0, duration=window.start + window.duration))
    (inside,), (outside,) = (each.measures([STEP]) for each in (excerpt, whole))
    assert {"impulse", "filtered_peak", "contact_duration"} <= set(inside)
    for name, value in outside.items():
        assert inside[name] == pytest.approx(value, rel=1e-6), name


def test_a_body_is_advanced_like_its_free_motion() -> None:
    body = striker_of(scene_of(SPRING, REED), 3)
    later = advanced(advanced(body, 1e-4), 2e-4)
    at_once = advanced(body, 3e-4)
    assert later.state.displacement == pytest.approx(at_once.state.displacement, rel=1e-9)
