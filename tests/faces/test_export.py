"""Runs in the formats of other programs, read back."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.greens.modal import ModalGreens, Residual
from impact.storage.hdf5 import load_greens, load_results
from seatfem.faces.cli import BAD_INPUT, DONE, run_command
from seatfem.structures.formats.uff import UffError, read_frf_uff
from seatfem.structures.formats.uff_writing import write_receptance_uff

SCENE = """\
[seat]
kind = "annular"
bore_radius = "4 mm"
lip_width = "1 mm"
material = "steel"
damping_ratio = 0.05
mesh = { size = "3 mm", contact_size = "1 mm" }
greens = { bandwidth = "50 kHz", tolerance = "5 %" }
[reed]
kind = "rigid_mass"
mass = "1 g"
velocity = "-1 m/s"
[run]
duration = "0.3 ms"
time_step = "0.2 us"
filter_width = "10 us"
[accuracy]
target = "20 %"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    where = tmp_path_factory.mktemp("export")
    (where / "scene.toml").write_text(SCENE, encoding="utf-8")
    assert run_command(["run", str(where / "scene.toml"), "-o", str(where / "r"), "--quiet", "--no-pictures"]) == DONE
    return where / "r"


def test_spreadsheets(folder: Path, tmp_path: Path) -> None:
    assert run_command(["export", str(folder), "--to", "csv", "-o", str(tmp_path), "--quiet"]) == DONE
    run = load_results(folder / "result.h5")["wave"]
    with (tmp_path / "force.csv").open(encoding="utf-8", newline="") as file:
        heads, *rows = list(csv.reader(file))
    assert heads[:3] == ["time [s]", "force [N]", "force, mean over 10 us [N]"]
    values = np.array(rows, dtype=float)
    np.testing.assert_array_equal(values[:, 0], run.time)
    np.testing.assert_array_equal(values[:, 1], run.force)
    assert values[:, 2].max() == impact.measures.filtered_peak_force(run, 10e-6)
    with (tmp_path / "summary.csv").open(encoding="utf-8", newline="") as file:
        told = {row["key"]: row for row in csv.DictReader(file)}
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert float(told["impulse_Ns"]["value"]) == summary["impulse_Ns"]
    assert float(told["impulse_Ns"]["error bar"]) == summary["error_bar_impulse_Ns"]
    assert float(told["impulse_Ns"]["spring baseline"]) == summary["spring_impulse_Ns"]


def test_a_receptance_comes_back(folder: Path, tmp_path: Path) -> None:
    assert run_command(["export", str(folder), "--to", "uff", "-o", str(tmp_path), "--quiet"]) == DONE
    read = read_frf_uff(tmp_path / "receptance.uff", ports={"contact": (1, "+z")})
    exact = load_greens(folder / "seat.h5").transfer(2j * np.pi * read.frequency)
    np.testing.assert_allclose(read.receptance, exact, rtol=1e-6)
    assert read.frequency[-1] == pytest.approx(1.25 / 10e-6)


def test_two_ports_are_two_nodes(tmp_path: Path) -> None:
    shapes = np.array([[1.0, 0.5], [0.3, -1.0]])
    omega, zeta = np.array([1e3, 5e3]), np.array([0.02, 0.05])
    greens = ModalGreens(omega, zeta, shapes, Residual.none(2), ("a", "b"))
    f = np.linspace(10, 2000, 200)
    write_receptance_uff(greens, f, tmp_path / "two.uff")
    read = read_frf_uff(tmp_path / "two.uff", ports={"a": (1, "+z"), "b": (2, "-z")})
    signs = np.array([[1, -1], [-1, 1]])
    np.testing.assert_allclose(read.receptance, signs * greens.transfer(2j * np.pi * f), rtol=1e-6)


def test_uneven_frequencies(tmp_path: Path) -> None:
    with pytest.raises(UffError, match="even, rising steps"):
        write_receptance_uff(impact.spring(stiffness=1e6), [1.0, 2.0, 4.0], tmp_path / "x.uff")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "message"), [(["--to", "vtp"], "none of csv, uff"), (["--to", "csv"], "no summ")]
)
def test_bad_input(
    tmp_path: Path, arguments: list[str], message: str, capfd: pytest.CaptureFixture[str], folder: Path
) -> None:
    place = folder if "vtp" in arguments else tmp_path
    assert run_command(["export", str(place), *arguments, "--quiet"]) == BAD_INPUT
    assert message in capfd.readouterr().err
