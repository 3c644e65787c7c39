"""Free plates and balls in scenes: they fly, land and give their momentum back; a ball's modes and compliance."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import impact
from seatfem.structures.natural_modes import Wanted, modes_of
from tests.gallery import FLAPPER, load_text, refusal, summary_of
from tests.steps import RunError, Scene, Stopwatch, key_of, run_scene, striker_of

RING = 'kind = "ring_plate"\nouter_diameter = "20 mm"\ninner_diameter = "10 mm"\nthickness = "0.5 mm"\n'
DISC = 'kind = "disc"\ndiameter = "20 mm"\nthickness = "0.5 mm"\n'
COARSE = 'greens = { bandwidth = "50 kHz" }\n'
SPRING = 'kind = "spring"\nstiffness = "20 N/um"\n'
FLIGHT = 'velocity = "-2 m/s"\n'
RUN = '[contact]\ngap = "1 um"\n[run]\nduration = "12 ms"\ntime_step = "0.5 us"\n[accuracy]\ntarget = "20 %"\n'
SLOT, HOLE = 'slot_width = "2 mm"\nslot_length = "8 mm"\n', 'hole_diameter = "6 mm"\n'
SHEET = """kind = "sheet"
outline = [["0 mm", "-4 mm"], ["20 mm", "-3 mm"], ["20 mm", "3 mm"], ["0 mm", "4 mm"]]
clamped = [["0 mm", "-4 mm"], ["0 mm", "4 mm"]]
contact_at = ["17 mm", "0 mm"]
thickness = "0.5 mm"
"""
BALL = """kind = "ball"
diameter = "10 mm"
contact_radius = "0.6 mm"
material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }
greens = { bandwidth = "400 kHz" }
mesh = { size = "0.8 mm", contact_size = "0.15 mm" }
"""
STEP = Path(__file__).parents[2] / "meshes" / "flapper.step"
LANDING = 'release = { velocity = "-2 m/s" }\n'
BRIEF = RUN.replace("12 ms", "2 ms")
DENSITY, SPEED = 7850.0, 2.0
MASSES = {RING: DENSITY * 0.5e-3 * math.pi * 75e-6, DISC: DENSITY * 0.5e-3 * math.pi * 1e-4}


def scene_of(folder: Path, reed: str, seat: str = SPRING, run: str = RUN) -> Scene:
    return load_text(folder, f"[seat]\n{seat}[reed]\n{reed}{run}")


@pytest.mark.slow
@pytest.mark.parametrize("plate", MASSES)
def test_momentum_is_the_impulse(plate: str, tmp_path: Path) -> None:
    """Its vibrations die out (exp(-30)), and the centre of mass has left with what the impulse gave it."""
    scene = scene_of(tmp_path, plate + COARSE + FLIGHT + "damping_ratio = 0.05\n")
    problem = impact.ContactProblem(striker_of(scene), impact.spring(stiffness=20e6))
    result = impact.solve(problem, dt=0.5e-6, duration=12e-3)
    assert not result.force[-20000:].any()
    u = result.striker_displacement
    speed = (u[-1] - u[-2001]) / (2000 * result.dt)
    impulse = impact.measures.impulse(result)
    assert impulse == pytest.approx(MASSES[plate] * (speed + SPEED), rel=1e-9)
    assert SPEED / 2 < speed < SPEED


@pytest.mark.slow
def test_the_contact_that_is_not_stated(tmp_path: Path) -> None:
    """A contact that is not stated lies in the middle of the annulus, a quarter as wide; each has its own key."""
    reeds = [
        scene_of(tmp_path, RING + COARSE + FLIGHT + more).reed
        for more in ("", 'contact_radius = "7.5 mm"\ncontact_width = "1.25 mm"\n', 'contact_width = "2 mm"\n')
    ]
    first, same, wider = (reed.body().greens for reed in reeds)
    t = np.linspace(0, 1e-4, 50)
    assert first.filtered(t, 2e-5) == pytest.approx(same.filtered(t, 2e-5), rel=1e-9)
    assert np.abs(first.filtered(t, 2e-5) - wider.filtered(t, 2e-5)).max() > 0
    assert len({key_of(reed, reed.stated()) for reed in reeds}) == 3


@pytest.mark.parametrize(
    ("plate", "change", "key", "message"),
    [
        (RING, 'contact_radius = "5.2 mm"\n', "reed.contact_radius", "begin.*5 mm"),
        (RING, 'contact_radius = "9.8 mm"\n', "reed.contact_radius", "centre.*stay"),
        (DISC, 'contact_width = "3 mm"\n', "reed.contact_width", "contact_radius, 1.25 mm"),
        (FLAPPER, 'thickness = "7 mm"\n', "reed.thickness", r"must be < 6 mm \(neck_width"),
        (FLAPPER, 'neck_width = "9 mm"\n', "reed.neck_width", r"must be <= 8 mm \(root_width"),
        (FLAPPER, 'paddle_diameter = "5 mm"\n', "reed.paddle_diameter", r"must be > 6 mm \(neck_width"),
        (FLAPPER, 'contact_radius = "9 mm"\n', "reed.contact_radius", "reaches 9 mm"),
        (FLAPPER, 'contact_width = "3 mm"\n', "reed.contact_width", "twice contact_radius, 1 mm"),
        (FLAPPER, 'velocity = "-2 m/s"\n', "reed.velocity", "clamped.*translate"),
        (FLAPPER, 'deflection = "1 mm"\n', "reed.release", "keep one of the two"),
        (BALL, 'contact_radius = "2.5 mm"\n', "reed.contact_radius", r"< 2.5 mm \(half"),
        (BALL, 'arc = "90 deg"\n', "reed.arc", "touches.*whole"),
        (BALL, 'fixed = "underside"\n', "reed.fixed", "'nothing'"),
        (FLAPPER, 'slot_width = "2 mm"\n', "reed.slot_length", "slot_width.*given"),
        (FLAPPER, SLOT.replace('"2 mm"', '"6 mm"'), "reed.slot_width", r"must be < 5.4 mm \(neck_width"),
        (FLAPPER, HOLE + 'contact_radius = "3.2 mm"\n', "reed.contact_radius", "begin.*3 mm"),
        (SHEET, 'outline = [["0 mm", "0 mm"], ["9 mm", "9 mm"], ["9 mm", "0 mm"], ["0 mm", "9 mm"]]\n', "reed.outline",
         "edges 1 and 3"),
        (SHEET, 'clamped = [["0 mm", "-4 mm"], ["1 mm", "0 mm"]]\n', "reed.clamped", r"\(0.001, 0\) m"),
        (SHEET, 'clamped = { hole = ["20 mm", "0 mm"] }\n', "reed.clamped", r"hole \(0.02, 0\) m.*one of its holes"),
        (SHEET, 'clamped = { normal = [1, 0], offset = "30 mm" }\n', "reed.clamped", "the line must cut the sheet"),
        (SHEET, 'contact_at = ["21 mm", "0 mm"]\n', "reed.contact_at", r"\(0.021, 0\)"),
        (SHEET, 'contact_radius = "3.5 mm"\n', "reed.contact_radius", "3.5 mm.*contact_at"),
        (SHEET, 'thickness = "7 mm"\n', "reed.thickness", "narrowest.*thinner"),
        (DISC, 'deflection = "1 mm"\n', "reed.deflection", "give it a velocity"),
    ],
)  # fmt: skip
def test_keys_that_do_not_fit(tmp_path: Path, plate: str, change: str, key: str, message: str) -> None:
    motion = LANDING if plate in (FLAPPER, SHEET) else FLIGHT if "deflection" not in change else ""
    name = change.partition(" ")[0]
    kept = "".join(f"{line}\n" for line in plate.splitlines() if not line.startswith(f"{name} "))
    answer = refusal(scene_of, tmp_path, kept + change + motion)
    assert key in answer
    assert re.search(message, answer)


def test_as_a_seat_it_is_refused(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, 'kind = "rigid_mass"\nmass = "1 g"\n' + FLIGHT, DISC)
    with pytest.raises(RunError, match=r"seat.kind = 'disc'"):
        run_scene(scene, tmp_path / "out")


@pytest.mark.slow
def test_a_flapper_with_slot_and_hole_lands(tmp_path: Path) -> None:
    """The ring about its hole lands, at the velocity that is stated for it."""
    scene = scene_of(tmp_path, FLAPPER + SLOT + HOLE + COARSE.replace("50", "20") + LANDING, run=BRIEF)
    body = striker_of(scene)
    start = body.modal_start()
    assert not start.displacement.any()
    speed = start.velocity @ body.greens.modal.shapes[:, 0]  # type: ignore[union-attr]
    assert speed == pytest.approx(-SPEED, rel=1e-6)  # of the contact that is not stated: the ring midway
    summary = summary_of(scene, tmp_path / "out")
    assert summary["contact_count"] > 0
    assert float(str(summary["energy_residual"])) < 1e-9


@pytest.mark.slow
def test_a_sheet_from_a_dxf_file(tmp_path: Path) -> None:
    """Its Green's function depends on what the file holds, and on the part that is clamped."""
    circle = "0\nCIRCLE\n10\n20\n20\n0\n40\n{}\n"
    section = "0\nSECTION\n2\nENTITIES\n" + circle + "0\nENDSEC\n0\nEOF\n"
    keys = 'kind = "sheet"\nfile = "reed.dxf"\nunit = "mm"\nthickness = "0.5 mm"\ncontact_at = ["24 mm", "0 mm"]\n'
    clamped = 'clamped = { normal = [-1, 0], offset = "-12 mm" }\n'
    hashes = set()
    for radius in ("10", "11"):
        (tmp_path / "reed.dxf").write_text(section.format(radius), encoding="utf-8")
        scene = scene_of(tmp_path, keys + clamped + COARSE + LANDING, run=BRIEF)
        hashes.add(key_of(scene.reed, scene.reed.stated()))
    assert len(hashes) == 2
    summary = summary_of(scene, tmp_path / "out")
    assert summary["contact_count"] > 0
    assert float(str(summary["energy_residual"])) < 1e-9


@pytest.mark.parametrize(
    ("change", "key", "message"),
    [
        ('file = "reed.dxf"\n', "reed.file", "reed.dxf: no DXF file"),
        ('file = "reed.dxf"\n' + SHEET.splitlines()[1] + "\n", "reed.outline", "exactly.*outline"),
        ("", "reed.outline", "exactly.*outline"),
        ('file = "reed.dxf"\nholes = []\n', "reed.holes", "inner loops"),
        ('file = "reed.step"\nunit = "mm"\n', "reed.unit", "only a DXF file has one"),
        ('file = "reed.step"\n', "reed.thickness", "reed.step.*0.3 mm"),
        ('file = "cut.step"\n', "reed.file", "cut.step: .*cut off"),
        (SHEET.splitlines()[1] + '\nunit = "mm"\n', "reed.unit", "only a DXF file has one"),
    ],
)
def test_outlines_and_files(tmp_path: Path, change: str, key: str, message: str) -> None:
    (tmp_path / "reed.dxf").write_text("solid\nfacet\n", encoding="utf-8")
    (tmp_path / "reed.step").write_bytes(STEP.read_bytes())
    (tmp_path / "cut.step").write_bytes(STEP.read_bytes()[:9000])
    kept = "".join(f"{line}\n" for line in SHEET.splitlines() if not line.startswith("outline"))
    answer = refusal(scene_of, tmp_path, kept + change + LANDING)
    assert key in answer
    assert re.search(message, answer)


YOUNG, POISSON, RADIUS, FACET = 200e9, 0.3, 5e-3, 0.6e-3
SHEAR_WAVE = math.sqrt(YOUNG / (2 * (1 + POISSON)) / DENSITY)
RATIO = 2 * (1 - POISSON) / (1 - 2 * POISSON)  # (c_p/c_s)^2


def breathing(x: float) -> float:
    """Return 0 at the radial mode of a free sphere, x = w R/c_p. Source: A. E. H. Love, Elasticity, article 196."""
    return math.cos(x) / math.sin(x) * x - 1 + RATIO / 4 * x**2


def twist(x: float) -> float:
    """Return 0 at the lowest toroidal mode, d/dr (j_2(r)/r) = 0 at r = x = w R/c_s: x j_2' = j_2."""
    j = (3 / x**3 - 1 / x) * math.sin(x) - 3 / x**2 * math.cos(x)
    before = math.sin(x) / x**2 - math.cos(x) / x
    return x * (before - 3 / x * j) - j


@pytest.mark.slow
def test_modes_of_a_free_sphere(tmp_path: Path) -> None:
    """Its facet is a 100th of its section and moves them by less than a part in a thousand; six are rigid."""
    modes = modes_of(scene_of(tmp_path, BALL + FLIGHT).reed, Wanted(48), Stopwatch(), lambda *given: None)
    scaled = 2 * np.pi * modes.frequencies_hz * RADIUS / SHEAR_WAVE
    assert np.sum(scaled == 0) == 6
    torsion = brentq(twist, 2.0, 3.0)
    assert torsion == pytest.approx(2.5011, rel=1e-4)
    assert scaled[6:11] == pytest.approx([torsion] * 5, rel=1e-3)
    radial = brentq(breathing, 1.5, 3.0) * math.sqrt(RATIO)
    assert np.abs(scaled / radial - 1).min() < 1e-3


@pytest.mark.slow
def test_its_facet_has_the_compliance_of_a_disc_on_a_half_space(tmp_path: Path) -> None:
    """The mean compliance under a uniform pressure is 16 (1 - nu^2)/(3 pi^2 E a) as a/R goes to zero; a free sphere
    differs by the first order in a/R, which two facets extrapolate to 1 %."""
    relative = []
    for facet in (FACET, FACET / 2):
        keys = BALL.replace("0.6 mm", f"{1e3 * facet:g} mm").replace("0.15 mm", f"{250 * facet:g} mm")
        modal = striker_of(scene_of(tmp_path, keys + FLIGHT)).greens.modal
        elastic = modal.omega > 0
        assert np.sum(~elastic) == 1
        shapes = modal.shapes[elastic, 0] / modal.omega[elastic]
        compliance = float(shapes @ shapes) + modal.residual.static()[0, 0]
        relative.append(compliance * 3 * math.pi**2 * YOUNG * facet / (16 * (1 - POISSON**2)))
    assert relative[0] < relative[1] < 1
    assert 2 * relative[1] - relative[0] == pytest.approx(1.0, abs=0.01)
