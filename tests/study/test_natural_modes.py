"""`seatfem modes`: every mode of the seat, whatever its load excites."""

import csv
import math

import numpy as np
import pytest
import scipy.linalg
from scipy import sparse
from scipy.io import mmwrite

from seatfem.structures.natural_modes import Wanted, modes_of
from seatfem.study.runs import pictures
from seatfem.study.runs.pipeline import write_modes
from tests.gallery import load_text
from tests.known_answers.grids import section
from tests.solids import Material, assemble_axisymmetric, solve_modes
from tests.steps import ModelError, RunError, Stopwatch, silent

RUN = '[reed]\nkind = "rigid_mass"\nmass = "5 g"\nvelocity = "-2 m/s"\n[run]\nduration = "1 ms"\n'
STEEL = 'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }\n'
ANNULAR = (
    f'[seat]\nkind = "annular"\nbore_radius = "4 mm"\nlip_width = "1 mm"\n{STEEL}'
    'mesh = { size = "2.5 mm", contact_size = "1 mm" }\n'
)
BAR = (
    f'[seat]\nkind = "bar"\nlength = "12 mm"\nwidth = "2 mm"\nheight = "2 mm"\n{STEEL}'
    'mesh = { size = "1 mm", contact_size = "1 mm" }\n'
)


def seat_of(text, tmp_path):
    return load_text(tmp_path, text + RUN)


def solve_text(text, tmp_path, count=None, up_to_hz=None):
    return modes_of(seat_of(text, tmp_path).seat, Wanted.from_limits(count, up_to_hz), Stopwatch(), silent)


@pytest.fixture(scope="module")
def annular(tmp_path_factory):
    return solve_text(ANNULAR, tmp_path_factory.mktemp("annular"), 16)


@pytest.mark.slow
def test_a_body_of_revolution_has_pairs_and_torsion_beside_what_its_ring_excites(annular, tmp_path):
    whole = solve_text(ANNULAR.replace("[seat]", '[seat]\nmodel = "3d"'), tmp_path, 16)
    # both meshes leave errors of their own: the solid's tetrahedra are straight across 2.5 mm
    assert annular.frequencies_hz[:16] == pytest.approx(whole.frequencies_hz[:16], rel=0.02)
    assert {mode.family for mode in annular.modes} == {"", "cos", "sin", "torsion"}
    for one, other in zip(annular.modes, annular.modes[1:], strict=False):
        if one.family == "cos":
            assert (other.family, other.frequency_hz) == ("sin", one.frequency_hz)
    assert all(mode.share == 0.0 for mode in annular.modes if mode.diameters or mode.family == "torsion")


@pytest.mark.slow
def test_shares_are_parts_of_the_static_compliance(tmp_path):
    """All modes of a bar together hold its whole compliance; the end's mean moves along the bar."""
    whole = solve_text(BAR, tmp_path, 10**6)
    shares = [mode.share for mode in whole.modes]
    assert min(shares) >= 0.0
    assert sum(shares) == pytest.approx(1.0, rel=1e-6)
    axial = whole.modes[int(np.argmax(shares))]
    # lateral inertia and the clamp
    assert axial.frequency_hz == pytest.approx(math.sqrt(200e9 / 7850) / (4 * 12e-3), rel=0.02)
    assert axial.share == pytest.approx(8 / math.pi**2, rel=0.02)  # the first of a rod's 8/(pi (2 k - 1))^2


@pytest.mark.slow
def test_a_bar_that_is_a_rod_for_its_load_bends(tmp_path):
    """Two bending modes of one frequency lie below the only one that the load on the end excites."""
    modes = solve_text(BAR, tmp_path, 3).modes
    assert modes[0].frequency_hz == pytest.approx(modes[1].frequency_hz, rel=1e-3)
    beam = 1.8751**2 * 2e-3 / math.sqrt(12) * math.sqrt(200e9 / 7850) / (2 * math.pi * (12e-3) ** 2)
    assert 0.9 * beam < modes[0].frequency_hz < 1.02 * beam  # shear and rotary inertia, slenderness 6
    assert max(mode.share for mode in modes[:2]) < 1e-6


@pytest.mark.slow
def test_a_limit_in_hertz(annular, tmp_path):
    limit = float(annular.frequencies_hz[7]) * 1.001
    up_to = solve_text(ANNULAR, tmp_path, None, limit)
    assert up_to.frequencies_hz == pytest.approx(annular.frequencies_hz[annular.frequencies_hz < limit], rel=1e-9)
    assert len(solve_text(ANNULAR, tmp_path, None, 10.0).modes) == 0
    assert len(solve_text(ANNULAR, tmp_path, 2, limit).modes) <= 3
    with pytest.raises(ModelError, match="--count 0"):
        Wanted.from_limits(0, None)


def test_torsion_of_a_free_cylinder_turns_it_and_has_no_harmonic():
    material, mesh = Material(200e9, 0.3, 7850.0), section(np.linspace(2e-3, 5e-3, 4), np.linspace(0.0, 20e-3, 9))
    free = assemble_axisymmetric(mesh, material, torsion=True, fixed=(), order=2)
    assert solve_modes(free, 1).frequencies_hz[0] == 0.0
    with pytest.raises(ModelError, match="must be 0 with torsion"):
        assemble_axisymmetric(mesh, material, harmonic=1, torsion=True, fixed="bottom")


@pytest.fixture
def undrawn(monkeypatch):
    def write(pictures, folder, progress, painter):
        for name, draw in pictures:
            draw(path=folder / name) if name == "modes.vtu" else (folder / name).write_text("picture")
        return tuple(folder / name for name, _ in pictures), ()

    monkeypatch.setattr(pictures, "draw_all", write)


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_the_table_on_file(tmp_path):
    outcome = write_modes(seat_of(ANNULAR, tmp_path), tmp_path / "out", count=6)
    with (tmp_path / "out" / "modes.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["frequency_hz"]) for row in rows] == pytest.approx(outcome.summary["frequencies_hz"], rel=1e-8)
    assert {row["nodal_diameters"] for row in rows} >= {"0", "1"}
    assert outcome.summary["complete"] is True
    assert "the inertia count confirms this" in outcome.messages[0]
    drawn = {"mesh.png", "modes.png", "mode_1.gif", "modes.vtu", "modes.h5"}
    assert {path.name for path in outcome.files} == {"modes.csv"} | drawn
    body = pytest.importorskip("pyvista").read(tmp_path / "out" / "modes.vtu")
    assert len(body.array_names) == sum(float(row["frequency_hz"]) > 0 for row in rows)
    assert body.array_names[0].startswith("mode 01, ")


def test_matrices_have_modes_and_springs_have_none(tmp_path):
    n = 30
    K = sparse.diags_array([2.0 * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1]) * 3e7
    M = sparse.diags_array([4.0 * np.ones(n), np.ones(n - 1), np.ones(n - 1)], offsets=[0, 1, -1]) * 1e-3
    mmwrite(tmp_path / "K.mtx", K.tocoo(), symmetry="symmetric", precision=17)
    mmwrite(tmp_path / "M.mtx", M.tocoo(), symmetry="symmetric", precision=17)
    (tmp_path / "port.csv").write_text(f"dof,weight\n{n},1\n", encoding="utf-8")
    text = '[seat]\nkind = "matrices"\nmass = "M.mtx"\nstiffness = "K.mtx"\ncontact = "port.csv"\nsystem = "SI"\n'
    outcome = write_modes(seat_of(text + 'greens = { bandwidth = "5 kHz" }\n', tmp_path), tmp_path / "out", count=5)
    exact = np.sqrt(scipy.linalg.eigvalsh(K.toarray(), M.toarray())[:5]) / (2 * np.pi)
    assert outcome.summary["frequencies_hz"] == pytest.approx(exact, rel=1e-9)
    spring = seat_of('[seat]\nkind = "spring"\nstiffness = "1 MN/m"\n', tmp_path)
    with pytest.raises(RunError, match=r"elements.*matrices"):
        write_modes(spring, tmp_path / "none")
