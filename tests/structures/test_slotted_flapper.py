"""Flappers with a slot in the neck or a hole in the paddle: outline, widths, mesh, frequencies."""

from dataclasses import replace

import numpy as np
import pytest

from seatfem.structures.materials import Material
from seatfem.structures.method import COARSENING
from seatfem.structures.shapes import Flapper, GeometryError, decode, encode
from seatfem.structures.sheets import Sheet, plate_modes

REED = Flapper(8e-3, 2e-3, 6e-3, 15e-3, 16e-3, 0.3e-3)
SLOTTED = replace(REED, slot_width=2e-3, slot_length=8e-3)
HOLED = replace(REED, hole_diameter=6e-3)
STEEL = Material(206e9, 0.3, 7800.0)


@pytest.mark.parametrize(("reed", "less"), [(REED, 0.0), (SLOTTED, np.pi * 1e-6 + 12e-6), (HOLED, np.pi * 9e-6)])
def test_area_and_widths(reed: Flapper, less: float) -> None:
    """Widths along the axis make up the outline; chords of a circle lose as the square of their number."""
    assert reed.area == pytest.approx(290.709e-6 - less, rel=1e-5)  # 14 + 78 + 198.709 mm^2 of the whole one
    assert reed.length == pytest.approx(0.015 + np.sqrt(64 - 9) * 1e-3 + 8e-3)
    off = []
    for n in (30, 60):
        x, width = np.array(reed.widths(n)).T
        assert (np.diff(x) > 0).all()
        assert (width[:-1] > 0).all()
        assert width[0] == pytest.approx(8e-3)
        assert width[-1] == 0.0
        assert x[-1] == pytest.approx(reed.length)
        off.append(abs(np.trapezoid(width, x) / reed.area - 1))
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.05)
    assert off[1] < 1e-4
    assert decode(encode(reed)) == reed


@pytest.mark.parametrize("reed", [SLOTTED, replace(SLOTTED, hole_diameter=1e-3, slot_width=0.5e-3)])
def test_the_mesh_has_its_holes(reed: Flapper) -> None:
    fine, coarse = (plate_modes(Sheet(reed, STEEL, 20e3), factor) for factor in (1.0, COARSENING))
    assert fine.mesh.area == pytest.approx(reed.area, rel=1e-5)
    assert fine.modes.complete
    assert fine.modes.frequencies_hz[:4] == pytest.approx(coarse.modes.frequencies_hz[:4], rel=3e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"slot_width": 1e-3}, r"Flapper.slot_length = None: slot_width is given, a slot needs both"),
        ({"slot_length": 1e-3}, r"Flapper.slot_width = None: slot_length is given"),
        ({"slot_width": 5.4e-3, "slot_length": 8e-3}, r"Flapper.slot_width = 5.4 mm: must be < 5.4 mm \(neck"),
        ({"slot_width": 1e-3, "slot_length": 13e-3}, r"Flapper.slot_length = 13 mm: must be < 13 mm \(neck_length"),
        ({"slot_width": 1e-3, "slot_length": 1e-3}, r"Flapper.slot_length = 1 mm: must be > 1 mm \(slot_width"),
        ({"hole_diameter": 15.4e-3}, r"Flapper.hole_diameter = 15.4 mm: must be < 15.4 mm \(paddle_diameter"),
        ({"hole_diameter": 0.0}, r"Flapper.hole_diameter = 0 mm: must be a finite length > 0"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, float], message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        replace(REED, **change)
