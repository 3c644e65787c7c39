"""A plate without a stated contact meets the struck face all over: the region is that of the geometry."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from impact import measures
from meshes.valve_plate_assembly import Bodies, write
from seatfem.study.impacts.bodies import stopper_of
from seatfem.study.impacts.layout import layout_of
from tests.gallery import load_text
from tests.steps import Division, Scene, SceneError, check_files, run_contacts, seat_of, stated_method, striker_of

ROOT = Path(__file__).parents[2]
STEEL = 'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }\n'
FLAPPER = (
    'kind = "flapper"\nroot_width = "9 mm"\ntaper_length = "3 mm"\nneck_width = "7 mm"\nneck_length = "20 mm"\n'
    f'paddle_diameter = "13 mm"\nthickness = "0.25 mm"\ndamping_ratio = 0.02\n{STEEL}'
)
PORTS = (
    'kind = "plate"\nports = 2\nlayout = "row"\nstruck = 1\nport_radius = "4 mm"\npitch = "12 mm"\nmargin = "6 mm"\n'
    f'thickness = "6 mm"\nland_width = "1 mm"\nclamp_width = "2 mm"\n{STEEL}'
)
ANNULAR = f'kind = "annular"\nbore_radius = "4 mm"\nlip_width = "1 mm"\n{STEEL}'
STOPPER = f'kind = "stopper"\nradius = "8 mm"\nthickness = "5 mm"\ncontact_radius = "2 mm"\n{STEEL}'
BAR = f'kind = "bar"\nwidth = "8 mm"\nheight = "8 mm"\nlength = "20 mm"\n{STEEL}'
RING = 'contact_radius = "4.5 mm"\ncontact_width = "1 mm"\n'
HOLE = FLAPPER + 'hole_diameter = "3 mm"\ncontact_width = "1 mm"\n'
IN_MODE = 'release = { mode = 1, velocity = "-2 m/s" }\n'
PEAK, IMPULSE = 104.0, 838e-6
"""Filtered peak [N] and impulse [N s] of the flapper on the first port, by a plate and a seat in spectral elements that
meet at points: another program, which is unsure of 4 N and 10 uN s."""


def scene_of(folder: Path, seat: str, reed: str = FLAPPER + IN_MODE, more: str = "") -> Scene:
    text = f'[seat]\n{seat}[reed]\n{reed}{more}[run]\nduration = "0.4 ms"\nfilter_width = "5 us"\n'
    return load_text(folder, text + '[accuracy]\ntarget = "10 %"\n')


def patch_of(scene: Scene) -> tuple[float, float, float]:
    """Return area [mm^2], least and largest distance [mm] from its centre of what the reed is met with."""
    lip = stated_method(scene).reed.lip
    assert lip is not None
    return tuple(np.round([1e6 * lip.area, 1e3 * lip.inner, 1e3 * lip.outer], 2))


@pytest.mark.slow
@pytest.mark.parametrize("model", ["", 'model = "spring"\n', 'model = "3d"\n'])
@pytest.mark.parametrize(
    ("seat", "area", "ends"), [(PORTS, 9 * math.pi, (4, 5)), (ANNULAR, 0.8 * math.pi * 9, (4.1, 4.9))]
)
def test_the_region_is_the_struck_land(
    tmp_path: Path, seat: str, area: float, ends: tuple[float, float], model: str
) -> None:
    """The region is the struck land's, however much of the seat is modelled."""
    assert patch_of(scene_of(tmp_path, seat + model)) == pytest.approx((area, *ends), rel=2e-3)


@pytest.mark.parametrize(
    ("seat", "reed", "named"),
    [
        (BAR, FLAPPER, "reed.contact_radius: required key is missing.*'bar'.*no flat ring or disc"),
        (ANNULAR + 'arc = "90 deg"\n', FLAPPER, "reed.contact_radius: required key is missing"),
        (STOPPER + 'dome_radius = "50 mm"\n', FLAPPER, "reed.contact_radius: required key is missing"),
        (ANNULAR, HOLE, r"reed\.contact_width: 1 mm has no effect.*add reed\.contact_radius"),
        (PORTS, HOLE, r"reed\.contact_width: 1 mm has no effect.*add reed\.contact_radius"),
    ],
)
def test_a_contact_that_is_stated_by_half_is_refused(tmp_path: Path, seat: str, reed: str, named: str) -> None:
    """A face that is no land asks for the reed's contact. A width without a radius would change nothing where the reed
    meets the whole face; beside a seat without a face it is the width of the ring about a hole."""
    with pytest.raises(SceneError, match=named):
        scene_of(tmp_path, seat, reed + IN_MODE)
    scene_of(tmp_path, 'kind = "spring"\nstiffness = "20 N/um"\n', HOLE + IN_MODE)


@pytest.mark.slow
def test_a_broad_face_of_a_drawing_asks_for_the_contact(tmp_path: Path) -> None:
    """The whole top of a plate as contact is refused unless the reed's own face is stated."""
    file = ROOT / "meshes" / "assembly_plate.step"
    broad = f'kind = "cad"\nfile = "{file}"\ncontact = {{ number = 3 }}\nfixed = {{ number = 5 }}\n{STEEL}'
    with pytest.raises(SceneError, match=r"seat\.contact: .*5 holes.*as a whole: state .*reed\.contact_radius"):
        check_files(scene_of(tmp_path, broad))
    check_files(scene_of(tmp_path, broad, FLAPPER + RING + IN_MODE))
    block = f'kind = "cad"\nfile = "{ROOT / "meshes" / "block.step"}"\ncontact = {{ number = 5 }}\n'
    block += f"fixed = {{ number = 6 }}\n{STEEL}"
    with pytest.raises(SceneError, match=r"seat\.contact: .*times as long as it is wide.*reed\.contact_radius"):
        check_files(scene_of(tmp_path, block))
    stopper = f'[stopper]\ngap = "0.4 mm"\narcs = 8\n{block}'
    check_files(scene_of(tmp_path, PORTS, more=stopper))  # a pad that limits the lift


@pytest.mark.slow
def test_an_open_port_is_met_along_its_land(tmp_path: Path) -> None:
    """Impulse and peak are another program's; a disc in the middle of the port had 21 N, 949 uN s."""
    scene = scene_of(tmp_path, PORTS + 'model = "spring"\n', FLAPPER + IN_MODE + 'greens = { bandwidth = "160 kHz" }\n')
    assert stated_method(scene).ports == 16
    run = run_contacts(scene, striker_of(scene), seat_of(scene, mesh_error=False).greens, 1e-7).seat
    assert measures.impulse(run) == pytest.approx(IMPULSE, rel=0.015)
    assert measures.filtered_peak_force(run, 5e-6) == pytest.approx(PEAK, rel=0.05)


COARSE = 'model = "spring"\nmesh = { size = "3 mm", contact_size = "0.7 mm" }\n'
DISC = f'kind = "disc"\ndiameter = "10 mm"\nthickness = "0.6 mm"\nvelocity = "-2 m/s"\n{STEEL}'
BAND = (
    'kind = "sheet"\noutline = [["0 mm", "-6 mm"], ["20 mm", "-6 mm"], ["20 mm", "6 mm"], ["0 mm", "6 mm"]]\n'
    'clamped = [["0 mm", "-6 mm"], ["0 mm", "6 mm"]]\ncontact_at = ["17 mm", "0 mm"]\nthickness = "0.4 mm"\n'
    f'damping_ratio = 0.02\n{STEEL}{IN_MODE}greens = {{ bandwidth = "60 kHz" }}\n'
)


def land(width: str) -> str:
    return PORTS.replace('land_width = "1 mm"', f'land_width = "{width}"').replace('"12 mm"', '"14 mm"') + COARSE


def block(folder: Path, length: float) -> str:
    """Return a block with a strip of 1 mm across its top, ``length`` long [mm], as a table of a seat."""

    def part(occ: Any) -> Bodies:
        body, strip = occ.addBox(-8, -14, -6, 16, 28, 6), occ.addRectangle(-0.5, -length / 2, 0, 1, length)
        return [each for each in occ.fragment([(3, body)], [(2, strip)])[0] if each[0] == 3]

    write(folder / f"{length:g}.step", part)
    return (
        f'kind = "cad"\nfile = "{folder}/{length:g}.step"\ncontact = {{ point = ["0 mm", "0 mm", "0 mm"] }}\n'
        f'fixed = {{ normal = [0, 0, -1], offset = "6 mm" }}\ndamping_ratio = 0.02\n{STEEL}{COARSE}'
    )


def landing_of(scene: Scene) -> tuple[float, float, float]:
    """Return static compliance of the first segment [m/N], impulse [N s] and filtered peak [N]."""
    check_files(scene)
    seat = seat_of(scene, mesh_error=False).greens
    run = run_contacts(scene, striker_of(scene), seat, 1e-7).seat
    return seat.static_compliance()[0, 0], measures.impulse(run), measures.filtered_peak_force(run, 5e-6)


@pytest.mark.slow
def test_a_land_is_met_as_far_as_the_reed_reaches(tmp_path: Path) -> None:
    """A disc of 10 mm meets a land from 4 to 6 mm like one from 4 to 5 mm of the same plate, although the mesh of the
    wider one has no line at 5 mm."""
    wide, narrow = (scene_of(tmp_path, land(width), DISC) for width in ("2 mm", "1 mm"))
    assert patch_of(wide) == pytest.approx((9 * math.pi, 4, 5), rel=3e-3)
    there, alone = landing_of(wide), landing_of(narrow)
    assert there[0] == pytest.approx(alone[0], rel=0.01)
    assert there[1:] == pytest.approx(alone[1:], rel=2e-3)


@pytest.mark.slow
def test_a_strip_is_met_as_far_as_the_reed_is_wide(tmp_path: Path) -> None:
    """A sheet of 12 mm meets a strip of 20 mm like one of 12 mm on the same block."""
    longer, shorter = (scene_of(tmp_path, block(tmp_path, length), BAND) for length in (20, 12))
    assert patch_of(longer) == pytest.approx((12, 0.5, math.hypot(6, 0.5)), rel=3e-3)
    line, alone = stated_method(longer).seat.lip, stated_method(shorter).seat.lip
    np.testing.assert_allclose(line.lengths, alone.lengths, rtol=2e-3)
    there, other = landing_of(longer), landing_of(shorter)
    assert there[0] == pytest.approx(other[0], rel=0.02)
    assert there[1:] == pytest.approx(other[1:], rel=2e-3)
    drawn = layout_of(longer, line.division)
    assert np.abs(np.concatenate(drawn.seat.contact)).max(axis=0) == pytest.approx([0.5e-3, 6e-3], rel=2e-3)
    assert np.abs(drawn.arcs[..., 1]).max() < 6.01e-3


@pytest.mark.slow
def test_a_stopper_is_met_as_far_as_the_reed_reaches(tmp_path: Path) -> None:
    """A strip as a stopper meets the reed with that part of it which lies behind the reed."""
    stopper = f'[stopper]\ngap = "1 mm"\n{block(tmp_path, 20)}'
    scene = scene_of(tmp_path, block(tmp_path, 12), BAND, stopper)
    behind = scene.geometry.place_behind_reed()
    assert 1e6 * behind.area == pytest.approx(12, rel=3e-3)
    own, whole = (
        stopper_of(each).greens.static_compliance()[0, 0]
        for each in (scene, scene_of(tmp_path, block(tmp_path, 12), BAND, stopper.replace("/20.", "/12.")))
    )
    assert own == pytest.approx(whole, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seat", "reed", "more", "words"),
    [
        (land("2 mm").replace("struck = 1\n", ""), DISC, "", "covers 25 %.*leaves a port open"),
        (land("2 mm"), DISC, 'offset = ["1.2 mm", "0 mm"]\n', "leaves a port open; limit: 10 % of its land's width"),
        (land("2 mm"), DISC, 'offset = ["30 mm", "0 mm"]\n', "covers 0 %.*limit: 10 %.*change the offset"),
        ("strip", BAND.replace("17 mm", "0.6 mm"), "", "up to its clamp; limit: 0.4 mm away"),
        ("strip", BAND, 'offset = ["0 mm", "15 mm"]\n', "covers 5 %.*limit: 10 % of the face"),
    ],
)
def test_too_little_under_the_reed_is_refused(tmp_path: Path, seat: str, reed: str, more: str, words: str) -> None:
    seat = block(tmp_path, 20) if seat == "strip" else seat
    with pytest.raises(SceneError, match=words):
        check_files(scene_of(tmp_path, seat, reed, f"[contact]\n{more}" if more else ""))


@pytest.mark.slow
@pytest.mark.parametrize("arcs", [1, 6])
def test_a_stopper_that_is_drawn_above_the_reed_is_met_where_it_is_drawn(tmp_path: Path, arcs: int) -> None:
    """A strip at 30 degrees to the reed: its ports move each mode, torsion among them, by its mean over the drawn
    strip, and a tilt opens the parts at y > 0."""
    turn = math.radians(30)

    def part(occ: Any) -> Bodies:
        body, strip = occ.addBox(-8, -8, 0, 16, 16, 6), occ.addRectangle(-5, -0.5, 0, 10, 1)
        occ.rotate([(2, strip)], 0, 0, 0, 0, 0, 1, turn)
        return [each for each in occ.fragment([(3, body)], [(2, strip)])[0] if each[0] == 3]

    write(tmp_path / "guard.step", part)
    stopper = (
        f'[stopper]\ngap = "1 mm"\ntilt = "{0.1 if arcs > 1 else 0} deg"\narcs = {arcs}\nkind = "cad"\n'
        f'file = "{tmp_path}/guard.step"\ncontact = {{ point = ["0 mm", "0 mm", "0 mm"] }}\n'
        f'fixed = {{ normal = [0, 0, 1], offset = "6 mm" }}\n{STEEL}{COARSE}'
    )
    reed = BAND.replace('"-6 mm"', '"-7 mm"').replace('"6 mm"', '"7 mm"').replace('["17 mm"', '["14 mm"')
    scene = scene_of(tmp_path, block(tmp_path, 12), reed, stopper)
    check_files(scene)
    greens = striker_of(scene).greens
    plate, along = scene.reed.thin_plate.plate(greens), np.array([math.cos(turn), math.sin(turn)])
    borders, gaps = np.linspace(-5e-3, 5e-3, arcs + 1), scene.geometry.stopper_gaps()
    for k, name in enumerate(Division(arcs).names):
        places = borders[k] + (borders[k + 1] - borders[k]) * (np.arange(40) + 0.5) / 40
        points = np.array([14e-3, 0.0]) + places[:, None] * along
        means = [float(plate.shape_at(mode, points).mean()) for mode in np.eye(len(greens.modal.omega))[:6]]
        shapes = greens.modal.shapes[:6, greens.port_index("stopper_" + name)]
        np.testing.assert_allclose(shapes, means, atol=0.01 * np.abs(means).max())  # the strip is 1 mm wide
        opening = math.tan(math.radians(0.1)) * places.mean() * math.sin(turn) if arcs > 1 else 0.0
        assert gaps[k] - gaps.mean() == pytest.approx(opening, abs=1e-9)


def test_a_round_stopper_that_reaches_off_the_reed_is_refused(tmp_path: Path) -> None:
    """A round stopper wider than the reed is refused, in arcs or whole, but for a stated face of the reed."""
    seat = 'kind = "spring"\nstiffness = "20 N/um"\n'
    wide = f'[stopper]\ngap = "1 mm"\n{STOPPER}'.replace('"2 mm"', '"7 mm"')
    for more in (wide, wide + "arcs = 8\n"):
        with pytest.raises(SceneError, match=r"stopper: in plan .* 8\d % .*limit: all of it.*reed\.contact_radius"):
            check_files(scene_of(tmp_path, seat, more=more))
    for reed, more in ((FLAPPER + RING + IN_MODE, wide), (FLAPPER + IN_MODE, wide.replace('"7 mm"', '"6 mm"'))):
        check_files(scene_of(tmp_path, seat, reed, more))
