"""Traps of CAD and mesh files as the program meets them: exit code 2, one message, no traceback."""

import re
from pathlib import Path

import pytest

from seatfem.faces.cli import BAD_INPUT, run_command

MESHES = Path(__file__).parents[2] / "meshes"
REST = (
    'material = { young = "200 GPa", density = "7850 kg/m^3" }\n'
    '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "0.8 ms"\n'
)
TWO = """*Node
1, 0, 0, 0
2, 1, 0, 0
3, 0, 1, 0
4, 0, 0, 1
5, 1, 1, 1
*Element, type=C3D4
1, 1, 2, 3, 4
2, 2, 3, 4, 5
*Nset, nset=contact
2, 4, 5
*Nset, nset=fixed
1, 2, 3
"""


def complaint(folder: Path, seat: str, capsys: pytest.CaptureFixture[str]) -> str:
    scene = folder / "scene.toml"
    scene.write_text(f"[seat]\n{seat}\n{REST}", encoding="utf-8")
    assert run_command(["run", str(scene), "-o", str(folder / "out"), "--quiet"]) == BAD_INPUT
    err = capsys.readouterr().err
    assert "Traceback" not in err
    return err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "part.step: is empty"),
        ("solid cube\nfacet", "part.step:.*STEP.*'solid cube"),
        (None, "part.step:.*'END-ISO-10303-21;'."),
    ],
)
def test_unreadable_cad(text: str | None, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = (MESHES / "bar.step").read_text(encoding="utf-8")
    (tmp_path / "part.step").write_text(whole[: len(whole) // 2] if text is None else text, encoding="utf-8")
    assert re.search(message, complaint(tmp_path, "kind = 'cad'\nfile = 'part.step'", capsys))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("2, 2, 3, 4, 5", "2, 3, 2, 4, 5", "1 inside-out elements"),
        ("5, 1, 1, 1", "5, 0.5, 0.5, 0", r"1.*\(no volume\).*\("),
        ("2, 2, 3, 4, 5\n", "2, 6, 7, 8, 9\n", "2 parts that share no node"),
        ("1, 2, 3\n", "2, 4, 5\n", r"'contact'.*\('fixed'\):"),
    ],
)
def test_bad_meshes(old: str, new: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    head, element, tail = TWO.partition("*Element")
    more = "6, 5, 0, 0\n7, 6, 0, 0\n8, 5, 1, 0\n9, 5, 0, 1\n" if "parts" in words else ""
    tail = tail.replace("2, 4, 5\n", "1, 2, 4\n") if "parts" in words else tail
    text = head.replace(old, new) + more + element + tail.replace(old, new)
    assert text != TWO
    (tmp_path / "part.inp").write_text(text, encoding="utf-8")
    assert re.search(words, complaint(tmp_path, "kind = 'mesh'\nfile = 'part.inp'\nunit = 'mm'", capsys))


def test_a_length_without_unit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = complaint(tmp_path, "kind = 'block'\nlength = 3", capsys)
    assert "seat.length" in told
    assert "unit" in told
