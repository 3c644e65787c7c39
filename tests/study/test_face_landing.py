"""A flapper lands on lips of faces: openings, the annular seat from its drawing, meshes, plans, what is refused."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from impact.after.histories import best_plane
from impact.pictures.lip_plots import plot_lip
from seatfem.structures.lands import FaceLip
from seatfem.study.impacts.touches import measured
from seatfem.study.ladders.ladder import ComputedRun
from seatfem.study.ladders.mesh import PER_ARC
from seatfem.study.method import stated_method
from seatfem.study.scene.lips import closed_line
from tests.as_stated import seat_of, striker_of
from tests.gallery import FLAPPER, load_text
from tests.steps import Division, ModelError, Scene, SceneError, begin_plan, check_files, error_budget, run_contacts

MESHES = Path(__file__).parents[2] / "meshes"
STEEL = 'material = { young = "206 GPa", poisson = 0.3, density = "7800 kg/m^3" }\n'
SLOT = f'kind = "cad"\nfile = "{MESHES / "slot_seat.step"}"\n{STEEL}'
PLATE = (
    'kind = "plate"\nlayout = "circle"\nports = 4\nport_radius = "3 mm"\npitch = "10 mm"\nmargin = "5 mm"\n'
    'thickness = "3 mm"\nland_width = "1 mm"\nclamp_width = "2 mm"\n' + STEEL
)
MESHED = f'kind = "mesh"\nfile = "{MESHES / "annular_seat.msh"}"\n{STEEL}greens = {{ bandwidth = "20 kHz" }}\n'
LANDING = FLAPPER + 'greens = { bandwidth = "60 kHz" }\nrelease = { velocity = "-2 m/s" }\n'
GAP = 1e-6


def scene_text(seat: str, contact: str, duration: float = 0.12) -> str:
    return (
        f'[seat]\n{seat}[reed]\n{LANDING}[contact]\ngap = "1 um"\n{contact}[run]\nduration = "{duration} ms"\n'
        'filter_width = "5 us"\n[accuracy]\ntarget = "5 %"\n'
    )


def scene_of(folder: Path, seat: str, contact: str, duration: float = 0.12) -> Scene:
    return load_text(folder, scene_text(seat, contact, duration))


def cad(name: str) -> str:
    return f'kind = "cad"\nfile = "{MESHES / name}.step"\n{STEEL}'


@pytest.mark.slow
def test_a_face_is_divided_where_the_scene_says_so(tmp_path: Path) -> None:
    """A plate meets a lip in segments, also where the scene says nothing; with the contact that it states, if any."""
    stated = load_text(tmp_path, scene_text(SLOT, "").replace("[contact]", 'contact_radius = "1 mm"\n[contact]'))
    assert stated.geometry.lip() is None
    for contact, arcs in (
        ("", 16),
        ("ports = 24\n", 24),
        ('tilt = "0.1 deg"\n', 32),
        ('offset = ["1 mm", "0 mm"]\n', 32),
    ):
        lip = scene_of(tmp_path, SLOT, contact).geometry.lip()
        assert isinstance(lip, FaceLip)
        assert lip.arcs == arcs
    whole = scene_of(tmp_path, SLOT, "ports = 1\n").geometry.lip()  # one port, but as wide as the lip
    assert isinstance(whole, FaceLip)
    assert whole.area == pytest.approx(1e-3 * (10e-3 + 6e-3 * math.pi), rel=1e-3)
    struck = scene_of(tmp_path, PLATE + "struck = 2\n", "ports = 16\n").geometry.lip()
    assert (struck.inner, struck.outer) == pytest.approx((3e-3, 4e-3), rel=1e-3)
    assert isinstance(scene_of(tmp_path, MESHED, "ports = 16\n").geometry.lip(), FaceLip)


@pytest.mark.parametrize(("axis", "slopes"), [(0.0, (0, 1)), (90.0, (-1, 0)), (30.0, (-0.5, 0.75**0.5))])
def test_a_tilt_opens_a_slot_by_a_plane(tmp_path: Path, axis: float, slopes: tuple[float, float]) -> None:
    """Openings are the means over arcs of tan(tilt) (y cos axis - x sin axis) over the outer rim's lowest point, half
    the slot's length or width below the middle."""
    scene = scene_of(tmp_path, SLOT, f'ports = 48\ntilt = "0.3 deg"\ntilt_axis = "{axis} deg"\n')
    lip = replace(scene.seat.region(), arcs=48)
    gaps, rise = scene.geometry.gaps(Division(48)), math.tan(math.radians(0.3))
    (mean, *fitted) = best_plane(gaps[None], closed_line(lip))[0]
    np.testing.assert_allclose(fitted, rise * np.array(slopes), atol=1e-6 * rise)
    if axis in (0.0, 90.0):
        assert mean - GAP == pytest.approx(rise * (3.5e-3 if axis == 0.0 else 6e-3), rel=2e-3)
    assert gaps.min() >= GAP + 0.99 * rise * 0.5e-3  # the straight side that lies lowest, on its centre line


@pytest.mark.slow
def test_a_pitched_landing_around_a_slot_is_its_mirror_image(tmp_path: Path) -> None:
    """A pitched landing mirrors in y but for the meshes; its figure shows arcs where they are, by their angles."""
    pytest.importorskip("matplotlib")
    seat = SLOT + 'model = "spring"\nmesh = { size = "4 mm", contact_size = "1.2 mm" }\n'
    scene = scene_of(tmp_path, seat, 'ports = 16\ntilt = "0.2 deg"\ntilt_axis = "90 deg"\n')
    greens = seat_of(scene, mesh_error=False).greens
    touches, lip = run_contacts(scene, striker_of(scene), greens, 1e-7), replace(scene.seat.region(), arcs=16)
    pushed = touches.parts.force.sum(axis=0)
    np.testing.assert_allclose(pushed, pushed[::-1], atol=0.01 * pushed.max())
    first = np.argmax(touches.parts.force > 0, axis=0)
    assert set(np.flatnonzero(first == first.min())) <= {0, 15}  # the arcs on either side of the x axis
    assert touches.seat.energy.residual < 1e-9
    np.testing.assert_allclose(touches.line.lengths, lip.lengths)
    assert touches.line.degrees_at(0.25) == pytest.approx(90, abs=1e-3)
    assert touches.line.degrees_at(1 / 8) == pytest.approx(math.degrees(lip.edges[2]), abs=0.5)
    by_arc = closed_line(lip)
    plot_lip(touches.parts, None, tmp_path / "lip.svg", radius=by_arc, share=1 / 8, filter_width=5e-6)
    written = (tmp_path / "lip.svg").read_text(encoding="utf-8")
    assert ">Height over the lip, by 1/16 of it<" in written
    assert ">Impulse per length [mN s/m], over 3.6 mm<" in written


@pytest.mark.slow
def test_a_drawing_of_a_seat_answers_as_the_seat(tmp_path: Path) -> None:
    """The annular seat from its STEP file in space lands a tilted reed as by Fourier harmonics: impulse, peak and force
    per length are within the drawing's bars, and statics to 2 %, as two elements across the lip leave 1.5 % of an arc
    (measured; one leaves 3.5 %, three 0.9 %)."""
    annular = 'kind = "annular"\nbore_radius = "4 mm"\nlip_width = "1 mm"\n' + STEEL
    band = 'greens = {{ bandwidth = "40 kHz" }}\nmesh = {{ size = "{}", contact_size = "{}" }}\n'
    landings = []
    for seat, sizes in ((annular, ("2 mm", "0.3 mm")), (cad("annular_seat"), ("3 mm", "0.5 mm"))):
        scene = scene_of(tmp_path, seat + band.format(*sizes), 'ports = 16\ntilt = "0.3 deg"\n')
        solved = seat_of(scene)
        touches = run_contacts(scene, striker_of(scene), solved.greens, 1e-7)
        landings.append((scene, solved, touches, measured(touches, scene.run.filter_width)))
    (_, reference, _, right), (scene, solved, touches, values) = landings
    assert Division.from_greens(solved.greens) == Division(16)
    assert solved.about["seat_level"] == "3d"
    statics, exact = (each.greens.static_compliance() for each in (solved, reference))
    assert np.abs(statics - exact).max() < 0.02 * exact.max()
    assert touches.seat.energy.residual < 1e-9
    assert values["impulse"] == pytest.approx(right["impulse"], rel=2e-3)
    assert values["filtered_peak"] == pytest.approx(right["filtered_peak"], rel=0.02)
    budget = error_budget(ComputedRun(scene, stated_method(scene), solved, striker_of(scene)), touches)
    for name in ("impulse", "filtered_peak", "line_force"):
        assert 0 < abs(values[name] - right[name]) < budget.bar(name), name


@pytest.mark.slow
def test_a_mesh_that_is_given(tmp_path: Path) -> None:
    """A given mesh is divided into twice as many arcs for the error bar, and at most into its elements."""
    scene = scene_of(tmp_path, MESHED, "ports = 8\n")
    solved = seat_of(scene)
    assert Division.from_greens(solved.in_rings) == Division(16)
    assert solved.greens.ports == Division(8).names
    with pytest.raises(ModelError, match=r"contact\.ports = 128: .*5\d elements .*fewer"):
        seat_of(scene_of(tmp_path, MESHED, "ports = 128\n"))


@pytest.mark.slow
def test_plans_mesh_each_arc(tmp_path: Path) -> None:
    """The plan gives each arc an element at least; a coarser stated size is refused with one that would do."""
    plan = begin_plan(scene_of(tmp_path, SLOT + 'model = "spring"\n', 'ports = 48\ntilt = "0.2 deg"\n', 0.04))
    lip = plan.method.seat.lip
    assert isinstance(lip, FaceLip)
    assert plan.method.ports == 48
    assert plan.method.seat.contact_size <= PER_ARC * lip.length / 48 * (1 + 1e-9)
    sizes = 'model = "spring"\nmesh = { size = "3 mm", contact_size = "1.5 mm" }\n'
    with pytest.raises(ModelError, match=r"contact\.ports = 48: .*seat\.mesh\.contact_size.*0\.6 mm"):
        seat_of(scene_of(tmp_path, SLOT + sizes, "ports = 48\n"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seat", "contact", "words"),
    [
        (SLOT + 'model = "sector"\n', "ports = 8\n", "contact.ports.*model = 'sector'"),
        (
            'kind = "bar"\nlength = "9 mm"\nwidth = "3 mm"\nheight = "3 mm"\n' + STEEL,
            "ports = 8\n",
            "not struck on a flat ring",
        ),
        (cad("valve_plate"), "ports = 8\n", "contact.ports:.*8 segments.*take 12"),
        (cad("kidney_seat"), 'waviness = [["0 deg", "1 um"]]\n', "contact.waviness:.*struck"),
    ],
)
def test_keys_that_a_lip_has_no_place_for(tmp_path: Path, seat: str, contact: str, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        check_files(scene_of(tmp_path, seat, contact))


def test_a_lip_of_several_faces_has_whole_arcs_on_each(tmp_path: Path) -> None:
    """A disc over six faces gets six arcs on each, where the scene states no number."""
    disc = 'kind = "disc"\ndiameter = "80 mm"\nthickness = "2 mm"\nvelocity = "-1 m/s"\n'
    text = scene_text(cad("valve_plate"), 'tilt = "0.1 deg"\n').replace(LANDING, disc)
    lip = load_text(tmp_path, text).geometry.lip()
    assert lip.arcs == 36
    assert lip.pieces == ((6, True),) * 6


@pytest.mark.slow
def test_a_slot_partly_off_the_reed(tmp_path: Path) -> None:
    """It reaches 6 mm from its middle, the paddle 8 mm: off by 2.5 mm half of its width at one end lies under it."""
    lip = scene_of(tmp_path, SLOT, 'ports = 8\noffset = ["2.5 mm", "0 mm"]\n').geometry.lip()
    assert max(float(line[:, 0].max()) for line in lip.cuts(np.arange(4000) / 4000)) == pytest.approx(5.5e-3, rel=1e-3)
    with pytest.raises(SceneError, match=r"contact\.offset: .*leaves a port open"):
        check_files(scene_of(tmp_path, SLOT, 'ports = 8\noffset = ["3 mm", "0 mm"]\n'))
