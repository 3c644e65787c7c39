"""The place of the first touch along a lip: of a segment that touches, not between two of them."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from impact.after.landings import Landing
from impact.march.grid import TimeGrid
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs.summary import _line_keys
from seatfem.study.scene.measures import Line

DT, ARCS, RADIUS = 1e-7, 8, 5e-3


def keys_of(pressed: dict[int, int], *, first_parts: tuple[int, ...] = (), angles: bool = True) -> dict[str, Any]:
    """Return the keys of arcs (45 deg wide, the first one about 0) that are ``pressed`` from steps on; ``first_parts``:
    by the first landing."""
    grid = TimeGrid.of_equal_steps(DT, 10)
    force = np.zeros((11, ARCS))
    for arc, step in pressed.items():
        force[step:, arc] = 1.0
    edges = 2 * math.pi * (np.arange(ARCS + 1) - 0.5) / ARCS
    line = Line(force, grid, 2 * math.pi * RADIUS, 1 / 8, edges if angles else None)
    start = DT * (min(pressed.values(), default=1) - 1)
    landing = Landing(start, 1.0, 0.5, 0, 1.0, 1.0, 0.0, 1.0, 1.0, False, False, first_parts=first_parts)
    parts = SimpleNamespace(rows=SimpleNamespace(force=np.zeros((11, 2 * ARCS))))  # two rings
    landings = SimpleNamespace(seat=(landing,) if first_parts else ())
    touches: Touches = SimpleNamespace(line=line, parts=parts, landings=landings)  # type: ignore[assignment]
    return _line_keys(touches, 1e-6)


@pytest.mark.parametrize(
    ("pressed", "first_parts", "degrees", "count"),
    [
        ({1: 3, 7: 3, 0: 5}, (), 45, 2),  # mirror parts, whose mean angle is 0
        ({2: 3, 6: 3}, (4, 5, 12, 13), 90, 2),  # the same by a landing, in two rings
        ({1: 3, 5: 3, 6: 3}, (12,), 270, 1),  # the one that closes first within the step
        ({5: 1}, (), 225, 1),
    ],
)
def test_the_first_touch_is_at_a_segment_that_touches(
    pressed: dict[int, int], first_parts: tuple[int, ...], degrees: float, count: int
) -> None:
    keys = keys_of(pressed, first_parts=first_parts)
    assert keys["first_touch_at_deg"] == pytest.approx(degrees, abs=1e-5)  # as angles are rounded
    assert keys["first_touch_segments"] == count
    along = math.radians(degrees + 22.5) * RADIUS
    assert keys["first_touch_at_m"] == pytest.approx(along, rel=1e-9)


def test_without_angles_it_is_the_first_along_the_lip_and_without_contact_nowhere() -> None:
    keys = keys_of({3: 2, 6: 2}, angles=False)
    assert keys["first_touch_at_deg"] is None
    assert keys["first_touch_at_m"] == pytest.approx(3.5 * math.pi / 4 * RADIUS, rel=1e-9)
    none = keys_of({})
    assert (none["first_touch_at_m"], none["first_touch_segments"]) == (None, 0)
