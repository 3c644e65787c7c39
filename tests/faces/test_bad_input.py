"""Bad input as a user meets it: a scene, the program, one message that names file, key, value and remedy.

Keys, units and ranges of scenes: test_scene. Groups of meshes: test_mesh_checks. Matrices: test_assembly.
"""

import re
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.greens.sampled import SampledGreens
from seatfem.study.impacts.contact import check_length
from seatfem.study.scene.keys import scene_template
from tests.gallery import Told, load_text
from tests.refusals import lacks
from tests.steps import BAD_INPUT, GreensFunction, RunError, run_command, run_scene, save_greens

STEEL = 'material = { young = "200 GPa", density = "7850 kg/m^3" }\n'
BALL = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n'
REED = (
    '[reed]\nkind = "cantilever"\nlength = "25.4 mm"\nwidth = "10 mm"\nthickness = "0.305 mm"\n'
    'damping_ratio = 0.03\nn_modes = 20\nrelease = { tip_deflection = "1 mm" }\n' + STEEL
)
RUN = '[run]\nduration = "0.8 ms"\n'
SPRING = '[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n'
GREENS = '[seat]\nkind = "greens"\nfile = "seat.h5"\n'
ROD = {"young": 200e9, "density": 7850.0, "area": 1e-6, "length": 0.03}


def complaint(folder: Path, text: str, capsys: Told) -> str:
    """Return what `seatfem run` says of a scene that it refuses as bad input, and check that it leaves no file."""
    scene = folder / "scene.toml"
    scene.write_text(text, encoding="utf-8")
    assert run_command(["run", str(scene), "-o", str(folder / "out"), "--quiet"]) == BAD_INPUT
    assert not any((folder / "out").glob("*"))
    err = capsys.readouterr().err
    assert "Traceback" not in err
    return err


@pytest.mark.parametrize(
    ("greens", "message"),
    [
        (impact.free_rod(**ROD), "contact.law is rigid"),  # whose baseline is a rigid mass
        (SampledGreens(np.array([1.0, 0.5, 0.0]), 1e-5, static=np.array([[1e-8]])), "20 us.*shorten"),
        (SampledGreens(np.linspace(1.0, 0.0, 100), 1e-5), "compliance.*argument static"),
        (impact.single_mode(frequency_hz=1e4, mass=1.0).known_for(2e-5), r"seat\.file = seat\.h5: .*run\.duration"),
    ],
)
def test_a_greens_function_that_is_no_seat(greens: GreensFunction, message: str, tmp_path: Path, capsys: Told) -> None:
    save_greens(greens, tmp_path / "seat.h5")
    scene = tmp_path / "scene.toml"
    scene.write_text(GREENS + BALL + RUN, encoding="utf-8")
    assert run_command(["run", str(scene), "-o", str(tmp_path / "out"), "--quiet"]) == BAD_INPUT
    assert re.search(message, capsys.readouterr().err)


def test_a_step_that_the_filtered_force_cannot_be_read_from(tmp_path: Path, capsys: Told) -> None:
    """Found when the run is put together, it is told with its line like what the file alone shows."""
    text = SPRING + REED + RUN + 'time_step = "0.6 us"'
    message = complaint(tmp_path, text, capsys)
    assert message.startswith(f"seatfem: {tmp_path / 'scene.toml'}:{text.count(chr(10)) + 1}: run.time_step = 0.6 us ")
    assert re.search(r" 0\.5 us .*run\.filter_width = 1 us", message)


@pytest.mark.slow
def test_a_step_too_coarse_for_the_reed_is_a_warning_with_the_lost_energy(tmp_path: Path) -> None:
    """f_20 of the reed is 411 kHz: w h = 1.03 at 0.4 us. The run goes on; the limit is half a radian, 0.19 us."""

    def messages(step: str) -> tuple[str, ...]:
        stated = f'time_step = "{step}"\n' if step else 'filter_width = "8 us"\n'
        outcome = run_scene(
            load_text(tmp_path, SPRING + REED + RUN + stated + '[accuracy]\ntarget = "90 %"'),
            tmp_path / "out",
            pictures=False,
        )
        steps.append(float(str(outcome.summary["time_step_s"])))
        return outcome.messages

    steps: list[float] = []
    (warning,) = messages("0.4 us")
    assert re.search(r"reed's modes: .* = 1\.03 \(limit 0\.5\).* % .*run\.time_step <= 0\.19 us", warning)
    assert messages("0.1 us") == ()
    assert messages("") == ()  # chosen, and its error measured
    assert steps[-1] > 0.19e-6


def test_more_steps_than_can_be_stored(tmp_path: Path, capsys: Told) -> None:
    message = complaint(tmp_path, SPRING + REED + RUN + "time_step = '1 ps'", capsys)
    assert re.search(r"8e\+08 steps .*0\.001 ns .*run\.time_step.* 2e\+07", message)
    with pytest.raises(RunError, match=r"1.6e\+08 steps .*0.005 ns .*run.filter_width"):
        check_length(load_text(tmp_path, SPRING + REED + RUN), 5e-12)


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("bar.step", ("is a CAD part, no scene", "`seatfem faces bar.step`", "`seatfem init cad`")),
        ("seat.msh", ("is a mesh, no scene", "`seatfem init mesh`")),
        ("part.stl", ("is a surface, no scene", "`seatfem init cad`")),
        ("reed.DXF", ("is a drawing, no scene", "`seatfem init sheet`", "reed.file = 'reed.DXF'")),
        ("pulse.csv", ("is a table, no scene", "pressure = { file = 'pulse.csv' }", "`seatfem init frf`")),
        ("response.uff", ("is a universal file", "`seatfem init modes`")),
        ("mass.mtx", ("is a matrix", "`seatfem init matrices`")),
        ("result.h5", ("is a result", "`seatfem report`")),
        ("result", ("is a folder", "`seatfem report`")),
    ],
)
def test_another_file_in_place_of_a_scene_is_told_with_what_to_do(
    file: str, words: tuple[str, ...], tmp_path: Path, capsys: Told
) -> None:
    path = tmp_path / file
    path.write_text("no TOML", encoding="utf-8") if path.suffix else path.mkdir()
    assert run_command(["run", str(path)]) == BAD_INPUT
    out, err = capsys.readouterr()
    assert out == ""
    assert str(path) in err
    assert [each for each in words if each not in err] == []
    assert all(scene_template(kind) for kind in re.findall(r"init (\w+)", err))  # there are such


NAMES = re.compile(r"(?:'[\w+-]+'(?:, | or )?){4,}|(?:\.?\b\w+, ){2,}\.?\w+")
"""Lists of what is allowed, however long."""
PYTHON = re.compile(r"Traceback|\bNone\b|\bnan\b|<class|<function|Path\(|array\(|np\.float64|Error\(|\bobject at 0x")
WIDEST = 360  # with the words of a reader, or an example of a header


@pytest.mark.parametrize(
    ("keys", "file", "content"),
    [
        ('kind = "greens"\nfile = "a.h5"\n', "a.h5", "no HDF5"),
        ('kind = "mesh"\nfile = "a.msh"\nmaterial = "steel"\n', "a.msh", "$MeshFormat\n2.2 0 8\n"),
        ('kind = "mesh"\nfile = "a.inp"\nmaterial = "steel"\n', "a.inp", "*NODE\n1, 0, 0, x\n"),
        ('kind = "mesh"\nfile = "a.bdf"\nmaterial = "steel"\n', "a.bdf", "GRID,1,,a,0.,0.\n"),
        ('kind = "cad"\nfile = "a.step"\nmaterial = "steel"\n', "a.step", "no STEP"),
        ('kind = "frf"\nfile = "a.csv"\n', "a.csv", "frequency [Hz],magnitude [m/N]\n1,x\n"),
        ('kind = "matrices"\nstiffness = "a.mtx"\nmass = "a.mtx"\ncontact = "a.mtx"\n', "a.mtx",
         "%%MatrixMarket matrix coordinate real general\n2 2 1\n1 1 x\n"),
    ],
)  # fmt: skip
def test_a_bad_file_is_told_with_a_remedy(keys: str, file: str, content: str, tmp_path: Path, capsys: Told) -> None:
    """One line a problem, with its place and a remedy, and nothing of Python in it."""
    (tmp_path / file).write_text(content, encoding="utf-8")
    (tmp_path / "scene.toml").write_text(f"[seat]\n{keys}{BALL}{RUN}", encoding="utf-8")
    assert run_command(["plan", str(tmp_path / "scene.toml")]) == BAD_INPUT
    out, err = capsys.readouterr()
    lines = [line.removeprefix("seatfem: ").replace(f"{tmp_path}/", "") for line in err.splitlines()]
    assert out == ""
    assert any(file in line for line in lines)
    for line in lines:
        assert re.match(r"scene\.toml(?::\d+)?: ", line)
        assert not lacks(line), line
        assert not PYTHON.search(line.replace(content, ""))
        assert len(NAMES.sub("", line)) <= WIDEST, line
