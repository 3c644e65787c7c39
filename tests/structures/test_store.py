"""The store of Green's functions: found by content, whole or absent, damaged entries told."""

import os
from pathlib import Path

import numpy as np
import pytest

import impact
from seatfem.machine.code import cache_folder
from seatfem.structures import sheets
from seatfem.structures.cache import VARIABLE, CacheWarning, Store, StoreError, content_key
from seatfem.structures.materials import Material
from seatfem.structures.shapes.outlined import Outlined
from seatfem.structures.sheets import Sheet, modes_in_process, plate_modes

KEY = content_key({"seat": "a"})
SEAT = impact.single_mode(frequency_hz=1e4, mass=0.01, damping_ratio=0.02)


def test_what_was_put_is_got(tmp_path: Path) -> None:
    store = Store(tmp_path / "new" / "folder")
    assert store.get(KEY) is None
    assert store.entries() == ()
    path = store.put(KEY, SEAT)
    assert path.name == f"{KEY}.h5"
    read = store.get(KEY)
    t = np.linspace(0, 1e-3, 50)
    assert np.array_equal(read.impulse_response(t), SEAT.impulse_response(t))
    assert [(entry.key, entry.size) for entry in store.entries()] == [(KEY, path.stat().st_size)]


def test_pruning_by_size(tmp_path: Path) -> None:
    store = Store(tmp_path)
    keys = [content_key({"seat": k}) for k in range(3)]
    for age, key in enumerate(keys):
        os.utime(store.put(key, SEAT), (1000.0 - age, 1000.0 - age))
    assert [entry.key for entry in store.entries()] == keys
    size = store.entries()[0].size
    assert [entry.key for entry in store.prune(most_bytes=2 * size)] == [keys[2]]
    assert store.get(keys[1]) is not None  # now the last used
    assert [entry.key for entry in store.prune(most_bytes=size)] == [keys[0]]
    (tmp_path / "notes.h5").write_text("not an entry")
    assert len(store.entries()) == 1


def test_the_key_is_of_the_content(tmp_path: Path) -> None:
    one, two = tmp_path / "one.step", tmp_path / "two.step"
    one.write_text("SOLID")
    two.write_text("SOLID")
    base = {"file": one, "size": 1.5, "points": np.arange(3.0), "list": [1, "a", None], "raw": b"x"}
    assert content_key(base) == content_key(dict(reversed(base.items())))
    assert content_key(base) == content_key(base | {"file": two})
    two.write_text("SOLID!")
    changes: list[dict[str, object]] = [
        {"file": two},
        {"size": 1.5000001},
        {"points": np.arange(3)},
        {"points": np.arange(3.0)[:, None]},
        {"list": [1, "a", "None"]},
        {"raw": b"y"},
        {"more": 1},
        {"size": np.float64(2.5)},
    ]
    keys = {content_key(base), *(content_key(base | change) for change in changes)}
    assert len(keys) == 1 + len(changes)
    with pytest.raises(TypeError, match="made of a set"):
        content_key({"a": {1}})


def test_what_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"'\.\./escape'.*content"):
        Store(tmp_path).get("../escape")
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match=r"file:.*SEATFEM_STORE"):
        Store(tmp_path / "file").put(KEY, SEAT)


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
    assert one.modes.shapes.strides == other.modes.shapes.strides  # products of other orders have other last digits
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


def test_all_plates_together_are_bounded(monkeypatch):
    plate_modes(ASKED)
    monkeypatch.setattr(sheets, "MOST", files()[0].stat().st_size * 1.5)
    plate_modes(ASKED, 1.4)
    assert len(files()) == 1


def test_a_folder_that_cannot_be_written_to_costs_a_warning(monkeypatch, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    monkeypatch.setenv(VARIABLE, str(blocked))
    with pytest.warns(CacheWarning, match="not kept"):
        assert len(plate_modes(ASKED).modes.omega) > 1
