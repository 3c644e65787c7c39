"""What scenes at their ends have found: each was a traceback, or a wrong answer without a word."""

import subprocess
import sys

import pytest

from seatfem.study.runs.pipeline import RunError
from tests.extremes.plates_axes import DENSITY, POISSON, YOUNG
from tests.extremes.scene_run import SceneRun, run_tables, run_text
from tests.extremes.scene_text import material, run_table, scene_text, si

STEEL = material(YOUNG, DENSITY, POISSON)
MASS = {"kind": "rigid_mass", "mass": "2 g", "velocity": "-1 m/s"}
SPRING = {"kind": "spring", "stiffness": "1e7 N/m"}


def disc(band: str) -> SceneRun:
    """Return the run of a free disc, 10 mm by 0.5 mm, that meets a spring stiffer than itself."""
    return run_tables(
        seat={"kind": "spring", "stiffness": "2e7 N/m"},
        reed={
            "kind": "disc", "diameter": "10 mm", "thickness": "0.5 mm", "material": STEEL, "velocity": "-0.5 m/s",
            "greens": {"bandwidth": band},
        },
        run=run_table(6e-5, 2e-6),
        accuracy={"target": "5 %"},
    )  # fmt: skip


@pytest.mark.slow
def test_a_plate_whose_band_holds_rigid_motions_only_has_a_bar_that_knows_its_bending() -> None:
    rigid, bending = disc("100 Hz"), disc("300 kHz")
    key = "landing_filtered_peak_force_N"
    error = abs(rigid.number(key) - bending.number(key))
    assert error > 2 * bending.bar(key)  # it is wrong ...
    assert rigid.bar(key) > error  # ... and says so


@pytest.mark.slow
def test_a_stopper_of_elements_has_no_band_of_modes_of_its_own() -> None:
    stopper = {"kind": "stopper", "radius": "5 mm", "thickness": "5 mm", "contact_radius": "1.5 mm", "material": STEEL}
    sizes = {"length": "25 mm", "width": "5 mm", "thickness": "0.5 mm", "release": {"tip_deflection": "0.15 mm"}}
    run = run_tables(
        seat=SPRING,
        reed={"kind": "cantilever", **sizes, "material": STEEL},
        contact={"gap": "0.01 mm"},
        stopper={**stopper, "gap": "0.16 mm", "greens": {"bandwidth": "300 kHz"}},
        run=run_table(5e-4, 5e-6),
        accuracy={"target": "10 %"},
    )
    assert run.summary["error_unknown"] == ""
    assert abs(run.number("energy_residual")) < 1e-9


def test_a_support_on_a_clamped_face_is_refused() -> None:
    seat = {
        "kind": "annular", "bore_radius": "5 mm", "lip_width": "1 mm", "outer_radius": "12 mm", "thickness": "8 mm",
        "material": STEEL, "supports": [{"kind": "foundation", "on": "fixed", "normal": si(1e13, "N/m^3")}],
    }  # fmt: skip
    words = r"seat\.supports\.0\.on: the face 'fixed' is clamped: a support there changes nothing; remove"
    with pytest.raises(RunError, match=words):
        run_tables(seat=seat, reed=MASS, run=run_table(1e-4, 5e-6))


def test_a_strain_of_no_gauge_is_refused() -> None:
    accuracy = {"target": "5 %", "measures": ["gauge_strain"]}
    with pytest.raises(RunError, match=r"gauge_strain .*\[\[gauge\]\]"):
        run_tables(seat=SPRING, reed=MASS, run=run_table(1e-4, 5e-6), accuracy=accuracy)


PLATE = """
from pathlib import Path
from seatfem.structures import sheets
from seatfem.structures.materials import Material
from seatfem.structures.shapes import Disc

sheets._kept = lambda asked, coarser, compute: compute()
sheet = sheets.Sheet(Disc(diameter=0.01, thickness=1e-4), Material(2e11, 0.3, 8000.0), 150e3)
peak = lambda: 1024 * int(Path("/proc/self/status").read_text().partition("VmHWM:")[2].split()[0])
before = peak()
modes = len(sheets.plate_modes(sheet).modes.omega)
print((peak() - before) / sheet.memory(modes))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone tells the peak of a process by itself")
def test_the_memory_of_a_plate_is_foreseen() -> None:
    """A plate of 12,675 unknowns and 142 modes takes the foreseen memory within a fifth and what libraries keep."""
    process = subprocess.run([sys.executable, "-c", PLATE], capture_output=True, text=True, check=True)
    assert 0.6 < float(process.stdout) < 1.4


@pytest.mark.slow
def test_a_scene_that_takes_too_long_is_stopped() -> None:
    """The same scene runs within the time that the others have."""
    text = scene_text(seat=SPRING, reed=MASS, run=run_table(1e-3, 5e-6))
    with pytest.raises(RunError, match=r"^stopped in .* takes longer than"):
        run_text(text, most_seconds=0.0)
    assert run_text(text, most_seconds=60.0).number("peak_force_N") > 0
