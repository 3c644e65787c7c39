"""What is printed of bad input: one line a problem, with its place and a remedy, and nothing of Python in it."""

import re
from pathlib import Path

import pytest

from seatfem.faces.cli import BAD_INPUT, run_command
from tests.refusals import lacks

NAMES = re.compile(r"(?:'[\w+-]+'(?:, | or )?){4,}|(?:\.?\b\w+, ){2,}\.?\w+")
"""Lists of what is allowed, however long."""
PYTHON = re.compile(r"Traceback|\bNone\b|\bnan\b|<class|<function|Path\(|array\(|np\.float64|Error\(|\bobject at 0x")
WIDEST = 120
BALL = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "1 ms"\n'
STEEL = 'material = "steel"\n'


def refusal_lines(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Return what `seatfem plan` says of a scene that it refuses, a line a problem, without the folder."""
    scene = folder / "scene.toml"
    scene.write_text(text, encoding="utf-8")
    assert run_command(["plan", str(scene)]) == BAD_INPUT
    out, err = capsys.readouterr()
    assert out == ""
    return [line.removeprefix("seatfem: ").replace(f"{folder}/", "") for line in err.splitlines()]


def check(lines: list[str], written: str, widest: int) -> None:
    assert lines
    for line in lines:
        assert re.match(r"scene\.toml(?::\d+)?: ", line)
        assert not lacks(line), line
        assert not PYTHON.search(line.replace(written, ""))
        assert len(NAMES.sub("", line)) <= widest, line


@pytest.mark.parametrize(
    ("keys", "file", "content"),
    [
        ('kind = "greens"\nfile = "a.h5"\n', "a.h5", "no HDF5"),
        ('kind = "mesh"\nfile = "a.msh"\n' + STEEL, "a.msh", "$MeshFormat\n2.2 0 8\n"),
        ('kind = "mesh"\nfile = "a.inp"\n' + STEEL, "a.inp", "*NODE\n1, 0, 0, x\n"),
        ('kind = "mesh"\nfile = "a.bdf"\n' + STEEL, "a.bdf", "GRID,1,,a,0.,0.\n"),
        ('kind = "cad"\nfile = "a.step"\n' + STEEL, "a.step", "no STEP"),
        ('kind = "frf"\nfile = "a.csv"\n', "a.csv", "frequency [Hz],magnitude [m/N]\n1,x\n"),
        ('kind = "matrices"\nstiffness = "a.mtx"\nmass = "a.mtx"\ncontact = "a.mtx"\n', "a.mtx",
         "%%MatrixMarket matrix coordinate real general\n2 2 1\n1 1 x\n"),
    ],
)  # fmt: skip
def test_a_bad_file_is_told_with_a_remedy(
    keys: str, file: str, content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / file).write_text(content, encoding="utf-8")
    lines = refusal_lines(f"[seat]\n{keys}{BALL}", tmp_path, capsys)
    assert any(file in line for line in lines)
    check(lines, content, 3 * WIDEST)  # with the words of a reader, or an example of a header
