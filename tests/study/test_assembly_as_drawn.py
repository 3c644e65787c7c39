"""[assembly]: where a reed lies over its seat, from the coordinates of two STEP files, against how they were drawn."""

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.gallery import load_text
from tests.steps import Scene, SceneError, check_files

EXAMPLE = Path(__file__).parents[2] / "examples" / "cad_assembly.toml"
GAP, ROOT = 20e-6, -22e-3  # of meshes/valve_plate_assembly.py
LIP_RADIUS = 4.6e-3  # mean
LENGTH, ANGLE = 1e-6, 1e-4  # m, rad


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    drawn = tmp_path_factory.mktemp("assemblies")
    script = Path(__file__).with_name("draw_assemblies.py")
    subprocess.run([sys.executable, str(script), str(drawn)], check=True, stdout=subprocess.DEVNULL, timeout=100)
    return drawn


def loaded(folder: Path, seat: str, reed: str, *changes: tuple[str, str]) -> Scene:
    text = EXAMPLE.read_text(encoding="utf-8")
    files = [("../meshes/assembly_plate.step", f"{seat}.step"), ("../meshes/assembly_flapper.step", f"{reed}.step")]
    for old, new in (*files, *changes):
        assert old in text
        text = text.replace(old, new)
    scene = load_text(folder, text)
    check_files(scene)
    return scene


@pytest.mark.slow
@pytest.mark.parametrize("moved", ["", "turned_", "tumbled_"])
def test_a_pair_lies_as_it_is_drawn_wherever_it_is_moved(folder: Path, moved: str) -> None:
    """Gap, place and tilt stay as drawn; the reed's x axis leads from clamp to lip, so that one half is meshed."""
    scene = loaded(folder, f"{moved}plate", f"{moved}flapper")
    contact, reed = scene.contact, scene.reed.geometry()
    assert contact.gap == pytest.approx(GAP, abs=LENGTH)
    assert contact.tilt == 0.0
    assert contact.offset == pytest.approx((0.0, 0.0), abs=LENGTH)
    assert reed.centre == pytest.approx((-ROOT, 0.0), abs=LENGTH)
    assert np.abs(reed.segment) == pytest.approx(np.array([(0.0, 4e-3), (0.0, 4e-3)]), abs=LENGTH)
    assert reed.is_mirrored
    lip = replace(scene.seat.region(), arcs=4)
    assert lip.cuts(np.zeros(1))[1] == pytest.approx(np.array([(5.2e-3, 0.0)]), abs=2e-5)  # a border on the reed's axis


@pytest.mark.slow
def test_a_tilted_reed(folder: Path) -> None:
    """The reed is turned by 0.4 deg about 35 deg, 20 um over the lip, and raised by 30 um."""
    contact = loaded(folder, "plate", "tilted_flapper").contact
    assert contact.tilt == pytest.approx(math.radians(0.4), abs=ANGLE)
    assert contact.tilt_axis == pytest.approx(math.radians(35), abs=ANGLE)
    assert contact.gap == pytest.approx(GAP + 30e-6 - LIP_RADIUS * math.tan(math.radians(0.4)), abs=LENGTH)


@pytest.mark.slow
def test_a_tilted_reed_that_all_but_touches(folder: Path) -> None:
    """The gap is that over the middle of the lip, 1 um: its outer edge, 4 um nearer to the reed, is no overlap."""
    contact = loaded(folder, "plate", "low_flapper").contact
    assert contact.gap == pytest.approx(1e-6, abs=0.2e-6)


@pytest.mark.slow
def test_a_tilted_pair_that_is_turned(folder: Path) -> None:
    """Tilt, its axis, the gap and the arcs of the lip are those of the pair before, on the axes of the reed."""
    before, after = (loaded(folder, f"{moved}plate", f"{moved}tilted_flapper") for moved in ("", "turned_"))
    for key in ("tilt", "tilt_axis", "gap"):
        assert getattr(after.contact, key) == pytest.approx(getattr(before.contact, key), rel=1e-6)
    here, there = (replace(scene.seat.region(), arcs=8) for scene in (before, after))
    assert there.line() == pytest.approx(here.line(), abs=1e-9)


@pytest.mark.slow
def test_a_reed_that_lies_off_the_port(folder: Path) -> None:
    """A shift by (0.4, -0.3) mm moves the contact with the lip, or the lip off a stated contact."""
    scene = loaded(folder, "plate", "off_flapper")
    assert scene.reed.geometry().centre == pytest.approx((-ROOT - 0.4e-3, 0.3e-3), abs=LENGTH)
    assert scene.contact.offset == pytest.approx((0.0, 0.0), abs=LENGTH)
    scene = loaded(folder, "plate", "off_flapper", ("clamped =", AT))
    assert scene.contact.offset == pytest.approx((-0.4e-3, 0.3e-3), abs=LENGTH)
    assert scene.contact.gap == pytest.approx(GAP + 10e-6, abs=LENGTH)


AT = 'contact_at = ["0.4 mm", "-0.3 mm"]\nclamped ='
PLANE = '{ normal = [-1, 0, 0], offset = "22 mm" }'
HOLE = '{ hole = ["0 mm", "0 mm"] }'
SAME = '[["-22 mm", "4 mm"], ["-22 mm", "4 mm"]]'
SEGMENT = '[["-22 mm", "4 mm"], ["-22 mm", "-4 mm"]]'


@pytest.mark.parametrize("clamped", [PLANE, SEGMENT, '{ point = ["-22 mm", "0 mm", "6.6 mm"] }'])
def test_ways_to_say_what_is_clamped(folder: Path, clamped: str) -> None:
    """Plane, place and both ends in the file's coordinates name one edge: the end of the root, as by its number."""
    reed = loaded(folder, "plate", "flapper", ("{ number = 1 }", clamped)).reed.geometry()
    assert np.abs(reed.segment) == pytest.approx(np.array([(0.0, 4e-3), (0.0, 4e-3)]), abs=LENGTH)


NUMBER = "{ number = 13 }", '{ normal = [0, 0, 1], offset = "6.5 mm" }'
OTHERS = ["face 5 looks away", "6.52 mm behind", "nearest are 13 (centre (0, 0, 6.5) mm, 0.02 mm", "3 (centre"]
WRONG = [
    ("plate half_off_flapper", (), "assembly.placed", ["covers 6", "move one of the parts"]),
    ("plate far_flapper", (), "assembly.placed", ["beside the reed in far_flapper.step", "12.5 mm", "is in mm"]),
    ("plate sunk_flapper", (), "assembly.placed", ["cuts into the contact face 13 of plate.step by 0.08 mm"]),
    ("plate small_flapper", (), "assembly.placed", ["1000 times larger, the reed would fit", "is in mm"]),
    ("plate inch_flapper", (), "assembly.placed", ["25.4 times larger", "60 x 40 x 6.5 mm"]),
    ("plate large_flapper", (), "assembly.placed", ["1000 times smaller"]),
    ("pin flapper", NUMBER, "assembly.placed", ["pin.step rises through the reed"]),
    ("plate flapper", ("number = 13", "number = 5"), "seat.contact", OTHERS),
    ("plate flapper", ("number = 13", "number = 6"), "seat.contact", ["inclined by 90 deg", "limit 30 deg"]),
    ("plate flapper", ("number = 13", "number = 12"), "seat.contact", ["12 is not flat", "13 ("]),
    ("plate flapper", ("number = 1 ", "number = 3 "), "reed.clamped", ["face 3 is a cylinder", "face 1: c"]),
    ("plate flapper", ("number = 1 ", "number = 99 "), "reed.clamped", ["number 99", "face 7: Plane"]),
    ("plate flapper", ("number = 1 ", "numbers = [1, 2] "), "reed.clamped", ["do not lie in one line"]),
    ("tumbled_plate tumbled_flapper", ("{ number = 1 }", SEGMENT), "reed.clamped", ["square to no axis"]),
    ("plate flapper", ("[run]", '[contact]\ntilt = "0 deg"\n\n[run]'), "contact.tilt", ["remove it"]),
    ("plate flapper", ("damping_ratio", "along = [1, 0, 0]\ndamping_ratio"), "seat.along", ["remove it"]),
    ("plate flapper", ('kind = "cad"', 'kind = "mesh"'), "assembly.placed", ["'mesh' has no CAD file"]),
    ("plate flapper", ("{ number = 1 }", SAME), "reed.clamped", ["both ends are the same"]),
    ("plate flapper", ("{ number = 1 }", HOLE), "reed.clamped", ["edge of a hole", "remove [assembly]"]),
]


@pytest.mark.parametrize(("pair", "change", "key", "words"), WRONG)
def test_what_does_not_fit_together(
    folder: Path, pair: str, change: tuple[str, ...], key: str, words: list[str]
) -> None:
    with pytest.raises(SceneError) as caught:
        loaded(folder, *pair.split(), *([change] if change else []))
    messages = {problem.key: problem.message for problem in caught.value.problems}
    assert [each for each in words if each not in messages[key]] == [], messages[key]


@pytest.mark.slow
def test_a_frame_that_is_stated(folder: Path) -> None:
    """An oblique reed has its own frame without [assembly]; a normal that is not the plate's is refused."""
    placed = loaded(folder, "tumbled_plate", "tumbled_flapper").reed.frame
    origin = ", ".join(f'"{each!r} m"' for each in placed.origin)
    alone = '[assembly]\nplaced = "as drawn"\n', ""
    stated = f'contact_at = ["22 mm", "0 mm"]\nframe = {{ origin = [{origin}], along = {list(placed.along)}, normal = '
    scene = loaded(
        folder, "tumbled_plate", "tumbled_flapper", alone, ("clamped =", f"{stated}{list(placed.normal)} }}\nclamped =")
    )
    assert scene.reed.geometry().centre == pytest.approx((22e-3, 0.0))
    assert scene.reed.geometry().is_mirrored
    with pytest.raises(SceneError, match=r"reed\.frame\.normal:.*tumbled_flapper\.step"):
        loaded(folder, "tumbled_plate", "tumbled_flapper", alone, ("clamped =", f"{stated}[0, 0, 1] }}\nclamped ="))
