"""Modes of a symmetric plate as even and odd ones, and those beyond a band that are found from the ones within it."""

from dataclasses import replace
from typing import Final

import numpy as np
import pytest

from seatfem.structures import sheets
from seatfem.structures.materials import Material
from seatfem.structures.reduction.modes import modes_by_parity, solve_modes
from seatfem.structures.shapes.flat import Disc, Flapper, Flat

STEEL: Final = Material(206e9, 0.3, 7800.0)
SHAPES: Final = (
    Flapper(thickness=0.3e-3, root_width=8e-3, taper_length=2e-3, neck_width=6e-3, neck_length=15e-3,
            paddle_diameter=16e-3),
    Disc(thickness=0.5e-3, diameter=20e-3),
)  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES, ids=lambda each: type(each).__name__)
def test_even_and_odd_modes_are_all_modes(shape: Flat) -> None:
    """Frequencies are those of the whole plate, shapes solve its equations, and each is even or odd."""
    plate = sheets.plate_modes(sheets.Sheet(shape, STEEL, 30e3))
    whole = solve_modes(plate.model, up_to_hz=sheets.CUTOFF * 30e3)
    own = plate.modes
    elastic = own.omega > 0
    assert own.frequencies_hz[elastic] == pytest.approx(whole.frequencies_hz[whole.omega > 0], rel=1e-7)
    assert int(np.sum(~elastic)) == int(np.sum(whole.omega == 0)) == (0 if shape.is_clamped else 3)
    gram = own.shapes.T @ (plate.model.M @ own.shapes)
    assert np.abs(gram - np.eye(len(gram))).max() < 1e-6
    left = plate.model.K @ own.shapes - plate.model.M @ own.shapes * own.omega**2
    assert np.abs(left).max() < 1e-5 * np.abs(plate.model.K @ own.shapes).max()
    middle = plate.mesh.points[:, 1] == 0
    for shape_of_mode in own.shapes.T:
        full = np.zeros((len(plate.mesh.points), 3))
        full.ravel()[plate.dofs.free] = shape_of_mode
        bent, turned = np.abs(full[middle, 0]).max(), np.abs(full[middle, 2]).max()
        assert min(bent, turned) == 0  # an odd mode has w = 0 there, an even one no slope across


def test_no_mode_within_a_band_is_computed_again() -> None:
    """Modes of a wider band begin with those of the narrower one, and are those that are found without them."""
    sheet = sheets.Sheet(SHAPES[0], STEEL, 30e3)
    plate = sheets.plate_modes(sheet)
    known = sheets.CUTOFF * 30e3, plate.modes
    wide = modes_by_parity(plate.model, plate.mesh.points, up_to_hz=2 * known[0], known=known)
    fresh = modes_by_parity(plate.model, plate.mesh.points, up_to_hz=2 * known[0])
    assert wide.frequencies_hz == pytest.approx(fresh.frequencies_hz, rel=1e-7)
    assert wide.solves < 0.8 * fresh.solves
    beyond = sheets.in_wider_band(plate)
    assert beyond is not None
    assert beyond[0].mesh is plate.mesh
    assert beyond[0].sheet == replace(sheet, bandwidth=beyond[1] * 30e3)


def test_a_plate_without_symmetry_has_its_modes_at_once() -> None:
    """A mesh that is moved off the line y = 0 has no even and odd modes, and the same frequencies."""
    plate = sheets.plate_modes(sheets.Sheet(SHAPES[0], STEEL, 10e3))
    at_once = modes_by_parity(plate.model, plate.mesh.points + np.array([0.0, 1e-3]), up_to_hz=30e3)
    assert at_once.frequencies_hz == pytest.approx(plate.modes.frequencies_hz, rel=1e-7)
