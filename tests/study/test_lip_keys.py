"""Keys of a contact along a lip that do not fit: each is named, with its limit and what would do."""

import re
from pathlib import Path

import pytest

from tests.gallery import FLAPPER, LIP, load_text, mass, refusal, spring
from tests.steps import ModelError, Scene, striker_of

REED = FLAPPER + 'greens = { bandwidth = "20 kHz" }\nrelease = { velocity = "-2 m/s" }\n'
MASS, SPRING = mass(0.1, "-1 m/s"), spring("20 N/um")


def scene_of(folder: Path, contact: str, reed: str = REED, seat: str = LIP) -> Scene:
    return load_text(folder, f'[seat]\n{seat}[reed]\n{reed}[contact]\n{contact}[run]\nduration = "0.1 ms"\n')


@pytest.mark.parametrize(
    ("contact", "key", "words"),
    [
        ("ports = 1000000000000000000000000", "ports", "must be at most 4096"),
        ("ports = 0", "ports", "must be at least 1"),
        ("ports = -32", "ports", "must be at least 1"),
        ("ports = 2.5", "ports", "integer"),
        ("ports = 131", "ports", "131 segments.*1"),
        ('ports = 1\ntilt = "0.1 deg"', "ports", "contact.*several"),
        ('tilt = "-31 deg"', "tilt", "-31 deg must be at most 30 deg"),
        ('line_arc = "0 deg"', "line_arc", "0 deg.*0.*360 deg"),
        ('line_arc = "361 deg"', "line_arc", "361 deg must be above 0"),
        ('waviness = [["9 deg", "0 um"], ["5 deg", "1 um"]]', "waviness", "5 deg.*9 deg:"),
        ('waviness = [["9 deg", "0 um"], ["9 deg", "1 um"]]', "waviness", "its angles must rise"),
        ('waviness = [["-10 deg", "0 um"], ["350 deg", "1 um"]]', "waviness", "within 360 deg"),
        ('waviness = [["9 deg"]]', "waviness.0.1", "required key is missing"),
        ('offset = ["1 mm"]', "offset", "required key is missing"),
    ],
)
def test_keys_alone(tmp_path: Path, contact: str, key: str, words: str) -> None:
    message = refusal(scene_of, tmp_path, contact + "\n")
    assert f"contact.{key}" in message
    assert re.search(words, message)
    assert "scene.toml:" in message  # and the line


@pytest.mark.parametrize(
    ("contact", "reed", "seat", "key", "words"),
    [
        ('tilt = "1 deg"', REED, SPRING, "tilt", "'spring'.*struck"),
        ('waviness = [["0 deg", "1 um"]]', REED, SPRING, "waviness", "struck.*remove"),
        ('offset = ["0 mm", "1 mm"]', REED, SPRING, "offset", "struck.*remove"),
        ("ports = 16", MASS, SPRING, "ports", "struck.*remove"),
        ("ports = 16", REED, LIP + 'arc = "90 deg"\n', "ports", "struck.*part"),
        *(
            ("ports = 16", REED, f'{LIP}model = "{model}"\n', "ports", f"with model = '{model}' is struck as a whole")
            for model in ("3d", "sector", "rod", "harmonics")
        ),
        ('tilt = "1 deg"', MASS, LIP + 'model = "3d"\n', "tilt", "model = '3d'"),
        ('offset = ["1 mm", "0 mm"]', MASS, LIP, "offset", "touches.*remove"),
    ],
)
def test_keys_beside_others(tmp_path: Path, contact: str, reed: str, seat: str, key: str, words: str) -> None:
    message = refusal(scene_of, tmp_path, contact + "\n", reed, seat)
    assert f"contact.{key}" in message
    assert re.search(words, message)


def test_a_seat_modelled_in_space_is_struck_as_a_whole(tmp_path: Path) -> None:
    """A seat whose stated model is in space keeps it, and has no arcs."""
    assert scene_of(tmp_path, "", seat=LIP + 'model = "3d"\n').geometry.lip() is None
    lip = scene_of(tmp_path, "").geometry.lip()
    assert lip.arcs == 32


def test_an_uneven_lip_has_arcs(tmp_path: Path) -> None:
    """A tilted, wavy or offset lip has arcs even under a rigid face, and no more than its rings allow."""
    for contact, arcs in (('tilt = "0.1 deg"', 32), ('waviness = [["0 deg", "1 um"]]\nrings = 16', 16)):
        lip = scene_of(tmp_path, contact + "\n", MASS).geometry.lip()
        assert lip.arcs == arcs
    assert scene_of(tmp_path, "", MASS).geometry.lip() is None
    disc = REED + 'contact_radius = "3 mm"\n'  # what touches if nothing is said of the lip
    assert scene_of(tmp_path, "", disc).geometry.lip() is None
    lip = scene_of(tmp_path, 'offset = ["0.5 mm", "0 mm"]\n', disc).geometry.lip()
    assert lip.arcs == 32


@pytest.mark.slow
def test_a_lip_over_a_hole_of_the_reed(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"contact\.offset: .*lip.* 5\.5 .*8 mm"):
        striker_of(scene_of(tmp_path, "", REED + 'hole_diameter = "11 mm"\n'))
