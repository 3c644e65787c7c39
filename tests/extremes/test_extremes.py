"""The battery at the extremes: how it judges, resumes and covers; a seeded part of it, and the ends of all axes."""

import math
import subprocess
import sys
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from seatfem.jobs.crew import Ask, crew
from tests.extremes import Cell, Finding, battery, carry_out, precise, runner, scenes, subset
from tests.extremes import __main__ as command
from tests.extremes.cell import Standing
from tests.extremes.plates_axes import DENSITY, POISSON, YOUNG
from tests.extremes.random_scenes import random_cells
from tests.extremes.scene_run import SceneRun, run_tables
from tests.extremes.scene_text import Table, material, run_table, si
from tests.extremes.table import TOGETHER
from tests.steps import GreensFunctionError, RunError

CELLS = battery()
# seconds each: the chosen ones stand for them
SLOW = ("run length", "energy over", "elements across", "scene file", "Zeno")
CHOSEN = (
    "run length in contact, steps = 100000", "run length in free motion, steps = 1e+06",
    "energy over 1e6 steps, conserving = Hertz, wall", "energy over 1e6 steps, conserving = rigid",
    "energy over 1e6 steps, passive = rigid, 5 modes", "scene file, rod of length = 1 mm",
    "scene file, duration / half swing = 0.001", "scene file, duration / half swing = 1e+08",
    "scene file, impact speed, m/s = 1e-13", "Zeno on a sinking wall, restitution = 0.99", "disc, diameter, m = 1e-07",
    "disc, thickness / diameter = 0.1", "flapper, band / 50 kHz = 0.001", "flapper, band / 50 kHz = 0.01",
    "arcs of a lip = 4", "valve spring, stiffness, N/m = 1e-06", "film, viscosity / stopping = 0.5",
    "base, amplitude / gap = 0.4", "base, speed of the seat, m/s = 1", "Hertz, speed, m/s = 1e-09",
    "seat stress, speed, m/s = 1", "life, load ratio = 0.5", "gas, cylinder / suction pressure = 0.5",
    "gas, clearance / swept volume = 0.001", "frf, noise / signal = 0.1",
)  # fmt: skip


def quick(cell: Cell) -> bool:
    return not cell.of_scene_file and not cell.axis.startswith(SLOW)


ENDS = [cell for cell in CELLS if cell.end and quick(cell)]
DRAWN = subset([cell for cell in CELLS if not cell.end and quick(cell)], 30, seed=1)
NAMED = [next(cell for cell in CELLS if cell.name == name) for name in CHOSEN]


@pytest.mark.slow(only=("scene file, rod", "arcs of a lip", "bounces", "gas,", "flapper, band", "frf,", "seat stress"))
@pytest.mark.parametrize("cell", [*NAMED, *ENDS, *DRAWN], ids=lambda cell: cell.name[:70])
def test_no_cell_is_wrong(cell: Cell) -> None:
    outcome = carry_out(cell)
    assert outcome.verdict != "wrong", outcome.reason
    if outcome.verdict == "refused":
        assert len(outcome.reason) > 30, "a refusal says what to do"
    if outcome.verdict in ("warned", "advised") and not cell.of_scene_file:
        assert "limit" in outcome.reason or "above accuracy.target" in outcome.reason, "number and limit"
        remedies = ("use ", "measure ", "start ", "merge ", "shorten ", "write ")
        assert any(word in outcome.reason for word in remedies)


def test_names_are_unique_and_every_axis_has_its_ends() -> None:
    assert len({cell.name for cell in CELLS}) == len(CELLS) > 400
    for axis in {cell.axis for cell in CELLS} - set(TOGETHER):
        assert sum(cell.end for cell in CELLS if cell.axis == axis) >= 2


def broken() -> Finding:
    raise RuntimeError("lost")


def stands(error: float, *, bar: float) -> Finding:
    """Return the standing of a number that is asked for to 1 %, and advised."""
    standing = Standing("impulse", error, bar, 1e-4, 1e-2)
    return Finding(error, standing.stated, ("too coarse",), "", standing)


def refusing() -> Finding:
    raise GreensFunctionError("zeta must be >= 0")


def warning() -> Finding:
    return Finding(float(np.log(np.zeros(1))[0]), 1.0)


@pytest.mark.parametrize(
    ("check", "verdict", "reason"),
    [
        (lambda: Finding(1e-3, 1e-2), "right", ""),
        (lambda: Finding(2e-2, 1e-2), "wrong", ""),
        (lambda: Finding(2e-2, 1e-2, ("too coarse",)), "warned", "too coarse"),
        (lambda: Finding(1e-3, 1e-2, ("too coarse",)), "advised", "too coarse"),
        (lambda: Finding(math.nan, 1e-2, ("too coarse",)), "wrong", "not finite"),
        (lambda: Finding(math.inf, math.inf), "wrong", "not finite"),
        (broken, "wrong", "RuntimeError: lost"),
        (refusing, "refused", "zeta must be >= 0"),
        (warning, "wrong", "RuntimeWarning"),
        (lambda: Finding(float("x"), 1.0), "wrong", "ValueError"),  # not one of ours
        (lambda: stands(2e-2, bar=1e-2), "wrong", "too coarse"),  # advice excuses nothing that has a bar
        (lambda: stands(2e-2, bar=3e-2), "barred", "too coarse"),
        (lambda: stands(9e-3, bar=3e-2), "advised", "too coarse"),
        (lambda: stands(0.9, bar=math.inf), "barred", "too coarse"),
        (lambda: stands(9e-3, bar=math.inf), "advised", "too coarse"),
        (lambda: replace(stands(9e-3, bar=3e-2), too_costly="9 s, above 1 s"), "slow", "9 s"),
        (lambda: replace(stands(2e-2, bar=1e-2), too_costly="9 s, above 1 s"), "wrong", "9 s"),
    ],
)
def test_verdicts(check: object, verdict: str, reason: str) -> None:
    outcome = carry_out(Cell("axis", "1", check))  # type: ignore[arg-type]
    assert outcome.verdict == verdict
    assert reason in outcome.reason


@pytest.mark.slow(but="4")
@pytest.mark.parametrize("number", [1, 4, 9])
def test_random_scenes_keep_their_balances(number: int) -> None:
    outcome = carry_out(random_cells(number + 1)[number])
    assert outcome.verdict not in ("wrong", "slow"), outcome.reason


@pytest.mark.parametrize("x", [0.0, 1e-9, 0.7, 1e7])
def test_precise_cosine(x: float) -> None:
    c, s = precise.cosine_sine(Decimal(x))
    assert float(c) == pytest.approx(math.cos(x), abs=2e-16)
    assert float(s) == pytest.approx(math.sin(x), abs=2e-16)
    assert abs(c * c + s * s - 1) < Decimal("1e-45")


def test_a_wrong_kernel_is_found() -> None:
    """The exponential of the clinging mass sees 3 % of the frequencies."""
    exact = scenes.clinging_force(scenes.modal_rod(5), 1.0, 0.5)
    slow = scenes.modal_rod(5)
    slow = replace(slow, omega=slow.omega * 1.03)
    assert abs(scenes.clinging_force(slow, 1.0, 0.5) / exact - 1) > 1e-4


@pytest.fixture(scope="module")
def one_crew() -> Iterator[Ask]:
    with crew(runner.WORKER) as ask:
        yield ask


@pytest.fixture
def one_worker(one_crew: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    """Give all parts of a run the same worker: its start takes longer than the cells."""
    monkeypatch.setattr(runner, "crew", lambda *given, **named: nullcontext(one_crew))


@pytest.mark.slow
@pytest.mark.usefixtures("one_worker")
def test_a_part_of_the_battery_by_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The command writes the table of a part, and computes nothing that its log holds."""
    words = ["--folder", str(tmp_path / "new"), "--subset", "2", "--seed", "3"]
    assert command.main(words) == 0
    output = capsys.readouterr().out
    assert output.startswith("2 cells: ")
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["extremes.csv", "extremes.jsonl"]
    assert len((tmp_path / "new" / "extremes.csv").read_text().splitlines()) == 3
    log = (tmp_path / "new" / "extremes.jsonl").read_text()
    assert command.main(words) == 0
    assert (tmp_path / "new" / "extremes.jsonl").read_text() == log


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


CLAMPED = {
    "kind": "annular", "bore_radius": "5 mm", "lip_width": "1 mm", "outer_radius": "12 mm", "thickness": "8 mm",
    "material": STEEL, "supports": [{"kind": "foundation", "on": "fixed", "normal": si(1e13, "N/m^3")}],
}  # fmt: skip


@pytest.mark.parametrize(
    ("seat", "measures", "words"),
    [
        (CLAMPED, "impulse", r"seat\.supports\.0\.on: the face 'fixed' is clamped: a support .* nothing; remove"),
        (SPRING, "gauge_strain", r"gauge_strain .*\[\[gauge\]\]"),
    ],
)
def test_what_would_change_or_tell_nothing_is_refused(seat: Table, measures: str, words: str) -> None:
    with pytest.raises(RunError, match=words):
        run_tables(seat=seat, reed=MASS, run=run_table(1e-4, 5e-6), accuracy={"measures": [measures]})


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
