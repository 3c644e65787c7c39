"""Plates on file: what comes back is what was found, whatever happened to the file in between."""

import numpy as np
import pytest

from seatfem.machine.code import cache_folder
from seatfem.structures import sheets
from seatfem.structures.cache import VARIABLE, CacheWarning
from seatfem.structures.materials import Material
from seatfem.structures.shapes.outlined import Outlined
from seatfem.structures.sheets import Sheet, modes_in_process, plate_modes

CORNERS = ((0.0, -2e-3), (12e-3, -2e-3), (12e-3, 2e-3), (0.0, 2e-3))
STRIP = Outlined(CORNERS, 0.3e-3, (10e-3, 0.0), (CORNERS[3], CORNERS[0]))
ASKED = Sheet(STRIP, Material(206e9, 0.3, 7800.0), 5e3)


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "store"))
    modes_in_process.cache_clear()
    yield
    modes_in_process.cache_clear()


def _again():
    modes_in_process.cache_clear()
    return plate_modes(ASKED)


def files():
    return sorted((cache_folder() / "plates").glob("*.h5"))


def same(one, other):
    assert np.array_equal(one.modes.shapes, other.modes.shapes)
    assert np.array_equal(one.modes.frequencies_hz, other.modes.frequencies_hz)
    assert np.array_equal(one.mesh.points, other.mesh.points)
    assert np.array_equal(one.mesh.cells, other.mesh.cells)
    assert (one.model.K != other.model.K).nnz == 0
    assert one.modes.complete is other.modes.complete is True


def test_a_plate_comes_back_bit_for_bit_without_mesher_and_eigensolver(monkeypatch):
    first = plate_modes(ASKED)
    assert len(files()) == 1
    for name in ("mesh_sheet", "modes_by_parity"):
        monkeypatch.setattr(f"seatfem.structures.sheets.{name}", lambda *a, **k: pytest.fail("computed again"))
    same(first, _again())


@pytest.mark.parametrize("harm", ["cut", "flipped", "other"])
def test_a_damaged_file_is_told_and_replaced(harm):
    first = plate_modes(ASKED)
    (path,) = files()
    whole = path.read_bytes()
    if harm == "cut":
        path.write_bytes(whole[:-1000])
    elif harm == "flipped":
        path.write_bytes(whole[:-5000] + bytes([whole[-5000] ^ 1]) + whole[-4999:])
    else:
        other = plate_modes(Sheet(STRIP, Material(200e9, 0.3, 7800.0), 5e3))
        (its,) = set(files()) - {path}
        path.write_bytes(its.read_bytes())
        assert len(other.modes.omega)
    with pytest.warns(CacheWarning, match="set aside"):
        same(first, _again())
    assert path.read_bytes() == whole


def test_a_folder_that_cannot_be_written_to_costs_a_warning(monkeypatch, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    monkeypatch.setenv(VARIABLE, str(blocked))
    with pytest.warns(CacheWarning, match="not kept"):
        assert len(plate_modes(ASKED).modes.omega) > 1


def test_all_plates_together_are_bounded(monkeypatch):
    plate_modes(ASKED)
    monkeypatch.setattr(sheets, "MOST", files()[0].stat().st_size * 1.5)
    plate_modes(ASKED, 1.4)
    assert len(files()) == 1
