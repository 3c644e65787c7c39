"""A beam that strikes a lip: how much of the lip it covers, and a lip behind the clamp."""

from pathlib import Path

import pytest

from seatfem.study.scene import Scene, SceneError
from tests.gallery import load_text

SCENE = """
seat = {{ kind = "annular", bore_radius = "4 mm", lip_width = "1 mm", lip_edge_radius = "0 mm", material = "steel" }}
reed = {{ kind = "cantilever", length = "30 mm", width = "{width} mm", thickness = "0.3 mm", material = "steel", \
    release = {{ tip_deflection = "1 mm" }} }}
contact = {{ at = "{at} mm" }}
run = {{ duration = "1 ms" }}
"""


def scene(folder: Path, at: float, width: float = 12) -> Scene:
    return load_text(folder, SCENE.format(at=at, width=width))


@pytest.mark.parametrize(("at", "width", "share"), [(30, 12, "50 %"), (24, 4.5, "33 %")])
def test_a_note_says_how_much_of_the_lip_is_covered(tmp_path: Path, at: float, width: float, share: str) -> None:
    """A reed of half the lip's mean diameter covers 2/pi asin(1/2) = 1/3 of its circle."""
    ((key, note),) = scene(tmp_path, at, width).geometry.cover_doubts()
    assert key == ("contact", "at")
    assert f"covers {share} of the lip, whose outer diameter is 10 mm" in note


def test_a_lip_behind_the_clamp_is_refused(tmp_path: Path) -> None:
    scene(tmp_path, 5.0)
    with pytest.raises(SceneError, match=r"contact.at: .*4.9 mm .*5 mm.*behind"):
        scene(tmp_path, 4.9)
