"""Scene files made to cost time or memory, and files that are none."""

import os
import re
import time

import pytest

from seatfem.units import UnitError, parse_fraction, parse_quantity
from tests.bounded import assert_refused, run_bounded
from tests.gallery import load_text
from tests.steps import BAD_INPUT, SceneError, run_command

SCENE = (
    '[seat]\nkind = "spring"\nstiffness = "20 N/um"\n'
    '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "20 us"\n'
)
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
        (SCENE.replace('"20 N/um"', '"' + "1" * 300_000 + ' N/m"'), "a quantity has at most 80"),
        (SCENE.replace('"20 N/um"', '"1e300 N/m"'), r"stiffness: '1e300 N/m'.*1e-12 to 1e\+21 N/m"),
        (SCENE.replace('"1 g"', '"1e-30 kg"'), r"mass: '1e-30 kg'.*1e-18 to 1e\+12 kg"),
        ("a = " + "9" * 5000 + "\n" + SCENE, r"scene\.toml"),
    ],
)
def test_a_scene_of_many_of_a_kind(text, message, tmp_path):
    start = time.process_time()
    with pytest.raises(SceneError) as refused:
        load_text(tmp_path, text)
    assert re.search(message, str(refused.value))
    assert len(refused.value.problems) <= 101
    assert time.process_time() - start < SLOW


@pytest.mark.parametrize("blank", [" ", "\t", "/", "* "])
def test_a_unit_of_blanks(blank):
    start = time.process_time()
    for text in ("3 m" + blank * 70 + "!", "3 m" + blank * 100_000 + "!", "3" + blank * 100_000):
        with pytest.raises(UnitError):
            parse_quantity(text, "length")
    with pytest.raises(UnitError, match="at most 80"):
        parse_fraction("3" + blank * 100_000 + "x")
    assert time.process_time() - start < SLOW
    assert parse_quantity(" " * 1000 + "3 mm" + " " * 1000, "length") == 0.003


def test_a_scene_larger_than_is_read(tmp_path):
    with pytest.raises(SceneError, match=r"scene\.toml:.*1\.\d+ MB.*1 MB"):
        load_text(tmp_path, SCENE + "#" * (1 << 20))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize(("verb", "kind"), [("run", "pipe"), ("plan", "device"), ("greens", "folder")])
def test_pipes_devices_and_folders_are_no_scenes(verb, kind, tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    if kind == "pipe":
        os.mkfifo(scene)
    elif kind == "device":
        scene.symlink_to("/dev/zero")
    else:
        scene.mkdir()
    assert run_command([verb, str(scene)]) == BAD_INPUT
    assert re.search(f"scene.toml: .* {kind}; .*regular file", capsys.readouterr().err)


@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
@pytest.mark.parametrize(
    "seat",
    [
        'kind = "greens"\nfile = "F"',
        'kind = "mesh"\nfile = "F.msh"\nmaterial = { young = "200 GPa", density = "7850 kg/m^3" }',
        'kind = "cad"\nfile = "F.step"\nmaterial = { young = "200 GPa", density = "7850 kg/m^3" }',
        'kind = "frf"\nfile = "F.csv"',
    ],
)
def test_pipes_devices_and_folders_that_a_scene_names(seat, kind, tmp_path, capsys):
    named = tmp_path / seat.split('"')[3]
    if kind == "pipe":
        os.mkfifo(named)
    elif kind == "device":
        named.symlink_to("/dev/zero")
    else:
        named.mkdir()
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.replace('kind = "spring"\nstiffness = "20 N/um"', seat))
    assert run_command(["run", str(scene), "-o", str(tmp_path / "out")]) == BAD_INPUT
    err = capsys.readouterr().err
    assert f"seat.file: {named}: is a {kind}; a regular file is needed" in err


CONE = """
seat = { kind = "conical", bore_radius = "4 mm", face_width = "2 mm", material = "steel", damping_ratio = 0.02, \
    arc = "1e-6 rad" }
reed = { kind = "rigid_mass", mass = "1 g", velocity = "-1 m/s" }
run = { duration = "100 us" }
"""


@pytest.mark.slow
def test_what_takes_long_is_refused_first(tmp_path):
    """An arc of 4 nm on a cone is refused with key and limits within the time allowed."""
    (tmp_path / "cone.toml").write_text(CONE)
    (cone,) = run_bounded([["run", "cone.toml"]], tmp_path)
    assert_refused(cone, "cone.toml:2: seat.arc: 5.72958e-05 deg", "0.36 and 360 deg")
