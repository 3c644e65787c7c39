"""Strings with units: right, or refused with a message that helps; scene files made to cost time or memory."""

import math
import os
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from seatfem.units import DIMENSIONS, UnitError, parse_fraction, parse_quantity
from tests.bounded import assert_refused, bounded
from tests.gallery import load_text
from tests.steps import BAD_INPUT, SceneError, run_command


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("3 mm", "length", 3e-3), ("25.4mm", "length", 0.0254), ("1 inch", "length", 0.0254),
        ("0.305 mm", "length", 0.000305), (" -1e-3 m ", "length", -1e-3), (".5 um", "length", 5e-7),
        ("1 µs", "time", 1e-6), ("1 μs", "time", 1e-6), ("1 ns", "time", 1e-9), ("200 GPa", "pressure", 2e11),
        ("7850 kg/m^3", "density", 7850.0), ("7850 kg/m3", "density", 7850.0), ("7.85 g/cm^3", "density", 7850.0),
        ("4.17e-7 m^2", "area", 4.17e-7), ("20 N/um", "stiffness", 2e7), ("1 MHz", "frequency", 1e6),
        ("10 1/s", "rate", 10.0), ("0.5 1/us", "rate", 5e5), ("-2 m/s", "velocity", -2.0), ("5 g", "mass", 5e-3),
    ],
)  # fmt: skip
def test_values_are_the_nearest_float(text: str, dimension: str, value: float) -> None:
    assert parse_quantity(text, dimension) == value


@pytest.mark.parametrize(
    ("text", "dimension", "message"),
    [
        ("0,3 mm", "length", "comma"),
        ("1 500 rpm", "rate", "space inside the number"),
        ("3 mil", "length", "number.*'3 mm'"),
        ("25 degC", "length", "temperature.*length"),
        ("3 kg", "length", "'3 kg'.*'3 mm'"),
        ("3 N", "stiffness", "is a force"),
        ("3", "length", "no unit"),
        ("nan mm", "length", "does not start with a number"),
        ("3 mm + 1 mm", "length", "not one number and one unit"),
        ("3 furlogs", "length", "unknown unit 'furlogs'"),
        ("200 gpa", "pressure", "did you mean 'GPa'"),
        ("6000 rpm", "frequency", "'rpm'.*frequency"),
        ("6 Hz", "rate", "is in 'Hz'; a rate is needed"),
        ("", "length", "does not start with a number"),
        ("1e999 mm", "length", "beyond the largest number"),
        ("0x10 mm", "length", "length is needed"),
    ],
)
def test_what_is_refused(text: str, dimension: str, message: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_quantity(text, dimension)
    assert re.search(message, str(caught.value))


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(sorted(DIMENSIONS)))
def test_si_values_survive_writing_and_reading(value: float, dimension: str) -> None:
    read = parse_quantity(f"{value!r} {DIMENSIONS[dimension].si}", dimension)
    # the decimal context keeps 28 digits, more than a double holds
    assert read == value


@pytest.mark.slow
@given(st.text(max_size=12))
def test_any_text_is_a_finite_number_or_refused(text: str) -> None:
    try:
        value = parse_quantity(text, "length")
    except UnitError:
        return
    assert math.isfinite(value)


@pytest.mark.parametrize(("text", "value"), [("1 %", 0.01), ("10%", 0.1), ("0.03", 0.03), ("1e-2", 0.01)])
def test_fractions(text: str, value: float) -> None:
    assert parse_fraction(text) == value


@pytest.mark.parametrize("text", ["1 mm", "one", "0,1", "% 1", ""])
def test_fractions_refused(text: str) -> None:
    with pytest.raises(UnitError, match="pure number"):
        parse_fraction(text)


SMALL = (
    '[seat]\nkind = "spring"\nstiffness = "20 N/um"\n'
    '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "20 us"\n'
)
MESHES = (".msh", ".inp", ".unv", ".bdf", ".vtu")
SLOW = 6.0  # s of the processor; each took a minute, or grew with a power of its length


@pytest.mark.slow(only=("text0", "text1", "text4"))
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("".join(f"k{k} = 1\n" for k in range(10_000)) + SMALL, "9900 more"),
        (SMALL + "".join(f"[t{k}]\n" for k in range(10_000)), "9900 more"),
        (".".join(["a"] * 100_000) + " = 1\n" + SMALL, "scene.toml:1:.*32 parts"),
        (SMALL + "[" + " . ".join(['"a b"'] * 100_000) + "]\n", "scene.toml:10:.*32 parts"),
        ("a = [" + "1,\n" * 100_000 + "]\n" + SMALL, "a: unknown key"),
        ("a = " + "[" * 100_000 + "]" * 100_000 + "\n" + SMALL, "nested too deeply"),
        ("a = " + "{a=" * 100_000 + "1" + "}" * 100_000 + "\n" + SMALL, "nested too deeply"),
        (SMALL.replace('"20 N/um"', '"20 ' + " " * 300_000 + 'x"'), "300004 characters.*80"),
        (SMALL.replace('"20 N/um"', '"20 m' + "*m" * 100_000 + '"'), "a quantity has at most 80"),
        (SMALL.replace('"20 N/um"', '"1e300 N/m"'), r"stiffness: '1e300 N/m'.*1e-12 to 1e\+21 N/m"),
        ("a = " + "9" * 5000 + "\n" + SMALL, r"scene\.toml"),
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
        load_text(tmp_path, SMALL + "#" * (1 << 20))


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
        (tmp_path / "scene.toml").write_text(SMALL.replace('kind = "spring"\nstiffness = "20 N/um"', own))
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
