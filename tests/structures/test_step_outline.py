"""Outlines in STEP files: plane faces and thin plates, their holes and arcs, and files that hold something else."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from seatfem.structures.inspection.outline import held_edge, outline_in
from seatfem.structures.shapes import Flapper, Outlined, loops
from seatfem.structures.shapes.selectors import NumberedFace
from tests.solids import GeometryError, Material, Sheet, plate_modes

MESHES = Path(__file__).parents[2] / "meshes"
REED = Flapper(8e-3, 2e-3, 6e-3, 15e-3, 16e-3, 0.3e-3)  # that of meshes/make_meshes.py
ROOT = ((0.0, -4e-3), (0.0, 4e-3))
STEEL = Material(206e9, 0.3, 7800.0)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sheets")
    script = Path(__file__).with_name("draw_sheets.py")
    subprocess.run([sys.executable, str(script), str(folder)], check=True, stdout=subprocess.DEVNULL, timeout=100)
    return folder


def sheet_in(path: Path, shape: Flapper = REED) -> Outlined:
    found = outline_in(path)
    assert found.thickness == pytest.approx(shape.thickness, rel=1e-9)
    return Outlined(found.outline, shape.thickness, shape.centre, segment=ROOT, holes=found.holes)


def test_the_flapper_of_a_file_is_the_flapper() -> None:
    """Its arcs are arcs: the same area, frequencies to 1e-4 on meshes of 0.3 %, whose difference converges."""
    found = sheet_in(MESHES / "flapper.step")
    assert found.area == pytest.approx(REED.area, rel=1e-9)
    assert found.room == pytest.approx(REED.room)
    assert found.narrowest == pytest.approx(REED.narrowest)
    mine, own = (plate_modes(Sheet(shape, STEEL, 8e3)).modes.frequencies_hz[:4] for shape in (found, REED))
    assert mine == pytest.approx(own, rel=1e-4)


@pytest.mark.slow
def test_slot_and_hole_are_kept(drawn: Path) -> None:
    """The neck keeps its slot and the paddle its hole, about which the contact lies."""
    shape = Flapper(8e-3, 2e-3, 6e-3, 15e-3, 16e-3, 0.3e-3, slot_width=2e-3, slot_length=8e-3, hole_diameter=6e-3)
    found = sheet_in(drawn / "slotted.step", shape)
    assert len(found.openings) == 2
    assert found.area == pytest.approx(shape.area, rel=1e-9)
    assert found.room == pytest.approx(shape.room)


@pytest.mark.slow
def test_a_round_hole_is_held_by_its_faces(drawn: Path) -> None:
    """Faces 8 to 11 of a slotted flapper close a circle; the paddle's and the slot's do not."""
    path = drawn / "slotted.step"
    frame = outline_in(path).frame
    assert frame is not None
    ((x, y),) = held_edge(path, (NumberedFace((8, 9, 10, 11)),), frame)
    assert math.hypot(x - REED.centre[0], y) == pytest.approx(3e-3, rel=1e-6)
    for part in ((8, 9), (3, 4), (12, 13, 15, 16)):
        with pytest.raises(GeometryError, match=f"face {part[0]} is a cylinder; select all faces of a round hole"):
            held_edge(path, (NumberedFace(part),), frame)


def test_a_face_in_another_plane(drawn: Path) -> None:
    """Normal x: y and z are its coordinates; it has no thickness."""
    found = outline_in(drawn / "rectangle.step")
    assert found.thickness == 0
    corners = np.array(found.outline)[:, :2]
    assert corners.min(axis=0) == pytest.approx((0.0, -4e-3), abs=1e-12)
    assert corners.max(axis=0) == pytest.approx((20e-3, 4e-3))
    (hole,) = (loops.as_loop(each) for each in found.holes)
    assert abs(loops.area(hole)) == pytest.approx(math.pi * 4e-6, rel=1e-9)
    assert loops.nearest(hole, np.array([14e-3, 0.0])) == pytest.approx(2e-3)


def test_other_curves_become_arcs(drawn: Path) -> None:
    """32 arcs of an ellipse: its area to 1e-5."""
    found = outline_in(drawn / "ellipse.step")
    assert abs(loops.area(loops.as_loop(found.outline))) == pytest.approx(math.pi * 60e-6, rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("oblique", r"\(0, -0.2955, 0.9553\)"),
        ("two_faces", "2 faces.*export"),
        ("two_solids", "holds 2 solids"),
        ("conical", "solid.*thickness"),
        ("bent", "plane.*Cylinder"),
        ("wire", "it holds no face, only curves"),
    ],
)
def test_what_is_no_sheet_is_refused(drawn: Path, name: str, message: str) -> None:
    with pytest.raises(GeometryError, match=rf"^Outlined.file = {name}.step: .*{message}"):
        outline_in(drawn / f"{name}.step")


@pytest.mark.parametrize("kept", [0, 20_000])
def test_a_damaged_file_is_refused(tmp_path: Path, kept: int) -> None:
    path = tmp_path / "reed.step"
    path.write_bytes((MESHES / "flapper.step").read_bytes()[:kept])
    with pytest.raises(GeometryError, match=r"^Outlined.file = .*reed.step: .*(empty|cut off)"):
        outline_in(path)
