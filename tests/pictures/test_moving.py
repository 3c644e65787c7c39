"""What is seen of bodies: closed surfaces wound outward; they are read as they were written, and damage is told."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import skfem

from impact.storage.hdf5 import StorageError
from seatfem.pictures import moving
from seatfem.pictures.frames import mode_frames
from seatfem.pictures.moving import FINEST, UNTOLD, load_moving, moving_bodies, save_moving
from seatfem.pictures.skins import OPENED, SLICES, Skin, skin_of, wound_outward
from tests.moving_block import END, SIDES, block, block_modes, block_wave
from tests.solids import Material, assemble, assemble_axisymmetric


def test_it_is_read_as_it_was_written(tmp_path: Path) -> None:
    """Displacements come back to half a step of the largest, stress to half a step of its scale."""
    wave = block_wave()
    save_moving(wave, tmp_path / "stress_wave.h5")
    read_back = moving_bodies(tmp_path)["stress_wave.h5"]
    assert read_back.values is not None
    assert wave.values is not None
    np.testing.assert_allclose(read_back.points, wave.points, atol=1e-9)
    np.testing.assert_array_equal(read_back.triangles, wave.triangles)
    np.testing.assert_allclose(read_back.displacement, wave.displacement, atol=0.51e-6 / FINEST)
    np.testing.assert_allclose(read_back.values, wave.values, atol=0.51 * END / (UNTOLD - 1))
    for name in ("title", "labels", "quantity", "unit", "low", "high", "note"):
        assert getattr(read_back, name) == getattr(wave, name)
    assert read_back.before == len(wave.triangles)


@pytest.mark.slow
def test_what_is_left_out_of_a_body_keeps_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A thinned body keeps its corners with their displacements, and its surface is as large; no more than so many
    points are read."""
    monkeypatch.setattr(moving, "MOST_TRIANGLES", 300)
    body = block_modes()
    save_moving(body, tmp_path / "modes.h5")
    read_back = load_moving(tmp_path / "modes.h5")
    assert len(read_back.triangles) <= 310 < len(body.triangles) == read_back.before
    numbers = [int(np.linalg.norm(body.points - point, axis=1).argmin()) for point in read_back.points]
    np.testing.assert_allclose(read_back.points, body.points[numbers], atol=1e-9)
    np.testing.assert_allclose(read_back.displacement, body.displacement[:, numbers], atol=1 / FINEST)
    a, b, c = SIDES
    corners = read_back.points[read_back.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(2 * (a * b + b * c + c * a), rel=0.01)
    monkeypatch.setattr(moving, "MOST_POINTS", 100)
    with pytest.raises(StorageError, match=r"\d+ points.*frames.*100"):
        load_moving(tmp_path / "modes.h5")


def test_modes_are_scaled_and_go_around() -> None:
    """A section's mode n = 2 goes around as u_r cos 2 th, u_th sin 2 th, and is scaled to 1."""
    angles = np.array([0.0, np.pi / 4, np.pi / 2])
    points = np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=1)
    skin = Skin(points, np.array([[0, 1, 2]]), np.array([0]), np.zeros(3, dtype=np.int64), angles)
    around = skin.moved(np.array([[3.0, 4.0, 5.0]]), 2)
    s = np.sqrt(0.5)
    np.testing.assert_allclose(around, [[3, 0, 5], [-4 * s, 4 * s, 0], [0, -3, -5]], atol=1e-12)
    turned = skin.moved(np.array([[3.0, 4.0, 5.0]]), 2, turned=np.pi / 4)
    np.testing.assert_allclose(turned[1], [3 * s, 3 * s, 5], atol=1e-12)
    frames = mode_frames(skin, [around], ["1"], "")
    assert frames.largest == pytest.approx(1.0)
    assert frames.time is None


def _another(name: str, values: Any) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file[name]
        file[name] = values

    return change


@pytest.mark.slow(but="change-damaged3")
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_another("triangles", np.array([[0, 1, 10**6]])), "damaged"),
        (_another("points", np.full((386, 3), np.nan)), "not finite"),
        (_another("displacement", np.zeros((5, 4, 3), dtype=np.int16)), "damaged"),
        (_another("span", [0.0, 1.0, 0.0]), "no size"),
        (_another("span", [0.0, 1.0, 1e308]), "damaged"),
        (_another("points", np.float64(1.0)), "damaged"),
        (_another("triangles", np.int32(0)), "damaged"),
        (lambda file: file.attrs.__setitem__("about", "[]"), "damaged"),
    ],
)
def test_damage_is_told(tmp_path: Path, change: Callable[[h5py.File], None], message: str) -> None:
    path = tmp_path / "stress_wave.h5"
    save_moving(block_wave(), path)
    path.write_bytes(path.read_bytes()[512:])  # without its seal
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(StorageError, match=message):
        load_moving(path)


STEEL = Material(200e9, 0.3, 7850.0, "steel")


def area(skin: Skin) -> float:
    corners = skin.points[skin.triangles]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(crossed, axis=1).sum() / 2)


@pytest.mark.parametrize("kind", [skfem.MeshTet, skfem.MeshHex])
@pytest.mark.parametrize("order", [1, 2])
def test_a_box_has_six_faces(kind: Any, order: int) -> None:
    mesh = kind().refined(1).scaled((1e-3, 2e-3, 3e-3))
    mesh = mesh.with_boundaries({"fixed": lambda x: x[2] < 1e-9, "contact": lambda x: x[2] > 3e-3 - 1e-9})
    skin = skin_of(assemble(mesh, STEEL, order=order))
    assert area(skin) == pytest.approx(2 * (2 + 3 + 6) * 1e-6, rel=1e-9)
    assert skin.size == pytest.approx(3e-3)
    moved = np.arange(3.0 * len(skin.nodes)).reshape(-1, 3)
    np.testing.assert_array_equal(skin.moved(moved), moved[skin.which])


def test_a_tube_is_laid_open() -> None:
    """The skin has chords of walls and ends over the angle drawn, and both cuts, and is closed."""
    a, b, height = 1e-3, 3e-3, 4e-3
    mesh = skfem.MeshQuad.init_tensor(np.linspace(a, b, 4), np.linspace(0, height, 5))
    mesh = mesh.with_boundaries({"fixed": lambda x: x[1] < 1e-9, "contact": lambda x: x[1] > height - 1e-9})
    skin = skin_of(assemble_axisymmetric(mesh, STEEL))
    slice_ = (OPENED[1] - OPENED[0]) / SLICES
    walls = SLICES * 2 * math.sin(slice_ / 2) * (a + b) * height
    ends = SLICES * math.sin(slice_) * (b**2 - a**2)
    assert area(skin) == pytest.approx(walls + ends + 2 * (b - a) * height, rel=1e-9)
    sides = np.sort(np.concatenate([skin.triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    assert (np.unique(sides, axis=0, return_counts=True)[1] == 2).all()
    outwards = skin.moved(np.tile([1.0, 0.0, 2.0], (len(skin.nodes), 1)))
    assert skin.angles is not None
    np.testing.assert_allclose(outwards[:, 0], np.cos(skin.angles))
    np.testing.assert_allclose(outwards[:, 1], np.sin(skin.angles))
    np.testing.assert_allclose(outwards[:, 2], 2.0)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_triangles_are_wound_outward_however_they_were(share: float) -> None:
    """The triangles of two blocks face outward again after a share of them was turned over."""
    body = block("Block", ("1",))
    points = np.concatenate([body.points, body.points + np.array([1.0, 0.0, 0.0])])
    triangles = np.concatenate([body.triangles, body.triangles + len(body.points)])
    over = np.random.default_rng(1).random(len(triangles)) < share
    wound = wound_outward(points, np.where(over[:, None], triangles[:, ::-1], triangles))
    assert (np.sort(wound, axis=1) == np.sort(triangles, axis=1)).all()
    a, b, c = np.moveaxis(points[wound], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(2 * np.prod(SIDES), rel=1e-9)
    first = wound[: len(body.triangles)]
    a, b, c = np.moveaxis(points[first], 1, 0)
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), (a + b + c) / 3 - np.array(SIDES) / 2)
    assert (outward > 0).all()
