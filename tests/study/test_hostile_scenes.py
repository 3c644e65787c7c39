"""Scene files made to cost time or memory, and files that are none."""

import os
import re

import pytest

from seatfem.units import UnitError, parse_fraction, parse_quantity
from tests.bounded import assert_refused, bounded
from tests.gallery import load_text
from tests.steps import BAD_INPUT, SceneError, run_command

SCENE = (
    '[seat]\nkind = "spring"\nstiffness = "20 N/um"\n'
    '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "20 us"\n'
)
MESHES = (".msh", ".inp", ".unv", ".bdf", ".vtu")
SLOW = 6.0  # s of the processor; each took a minute, or grew with a power of its length


@pytest.mark.slow(only=("text0", "text1", "text4"))
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("".join(f"k{k} = 1\n" for k in range(10_000)) + SCENE, "9900 more"),
        (SCENE + "".join(f"[t{k}]\n" for k in range(10_000)), "9900 more"),
        (".".join(["a"] * 100_000) + " = 1\n" + SCENE, "scene.toml:1:.*32 parts"),
        (SCENE + "[" + " . ".join(['"a b"'] * 100_000) + "]\n", "scene.toml:10:.*32 parts"),
        ("a = [" + "1,\n" * 100_000 + "]\n" + SCENE, "a: unknown key"),
        ("a = " + "[" * 100_000 + "]" * 100_000 + "\n" + SCENE, "nested too deeply"),
        ("a = " + "{a=" * 100_000 + "1" + "}" * 100_000 + "\n" + SCENE, "nested too deeply"),
        (SCENE.replace('"20 N/um"', '"20 ' + " " * 300_000 + 'x"'), "300004 characters.*80"),
        (SCENE.replace('"20 N/um"', '"20 m' + "*m" * 100_000 + '"'), "a quantity has at most 80"),
        (SCENE.replace('"20 N/um"', '"1e300 N/m"'), r"stiffness: '1e300 N/m'.*1e-12 to 1e\+21 N/m"),
        ("a = " + "9" * 5000 + "\n" + SCENE, r"scene\.toml"),
    ],
)
def test_a_scene_of_many_of_a_kind(text, message, tmp_path):
    with bounded(SLOW), pytest.raises(SceneError) as refused:
        load_text(tmp_path, text)
    assert re.search(message, str(refused.value))
    assert len(refused.value.problems) <= 101


@pytest.mark.parametrize("blank", [" ", "\t", "/", "* "])
def test_a_unit_of_blanks(blank):
    with bounded(SLOW):
        for text in ("3 m" + blank * 70 + "!", "3 m" + blank * 100_000 + "!", "3" + blank * 100_000):
            with pytest.raises(UnitError):
                parse_quantity(text, "length")
        with pytest.raises(UnitError, match="at most 80"):
            parse_fraction("3" + blank * 100_000 + "x")
    assert parse_quantity(" " * 1000 + "3 mm" + " " * 1000, "length") == 0.003


def test_a_scene_larger_than_is_read(tmp_path):
    with pytest.raises(SceneError, match=r"scene\.toml:.*1\.\d+ MB.*1 MB"):
        load_text(tmp_path, SCENE + "#" * (1 << 20))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
@pytest.mark.parametrize(
    ("verb", "name", "seat"),
    [
        ("run", "scene.toml", ""), ("plan", "scene.toml", ""), ("greens", "scene.toml", ""),
        ("run", "F.h5", 'kind = "greens"'), ("run", "F.csv", 'kind = "frf"'),
        ("run", "F.uff", 'kind = "modes"\nnode = 7\ndirection = "+z"'),
        ("run", "F.step", 'kind = "cad"\nmaterial = "steel"'),
        *(("run", f"F{ending}", 'kind = "mesh"\nmaterial = "steel"') for ending in MESHES),
    ],
)  # fmt: skip
def test_pipes_devices_and_folders_are_no_files(verb, name, seat, kind, tmp_path, capsys):
    """A scene, and a file that it names, must be regular; nothing is read of what is not."""
    path = tmp_path / name
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
    if seat:
        own = f'{seat}\nfile = "{name}"'
        (tmp_path / "scene.toml").write_text(SCENE.replace('kind = "spring"\nstiffness = "20 N/um"', own))
    assert (
        run_command([verb, str(tmp_path / "scene.toml"), *(["-o", str(tmp_path / "out")] if seat else [])]) == BAD_INPUT
    )
    assert re.search(rf"{name}: .* {kind}; .*regular file", capsys.readouterr().err)


CONE = """
seat = { kind = "conical", bore_radius = "4 mm", face_width = "2 mm", material = "steel", damping_ratio = 0.02, \
    arc = "1e-6 rad" }
reed = { kind = "rigid_mass", mass = "1 g", velocity = "-1 m/s" }
run = { duration = "100 us" }
"""


def test_what_takes_long_is_refused_first(tmp_path, capfd):
    """An arc of 4 nm on a cone is refused with key and limits within the time allowed."""
    (tmp_path / "cone.toml").write_text(CONE)
    words = "cone.toml:2: seat.arc: 5.72958e-05 deg", "0.36 and 360 deg"
    assert_refused(["run", str(tmp_path / "cone.toml")], capfd, *words)
