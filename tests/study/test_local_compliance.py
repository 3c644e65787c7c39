"""Contact laws in scenes: what they become, that a run obeys them, and that a struck patch's compliance counts once."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.exact.contact_stress import hertz_impact
from impact.exact.half_space import disk_compliance, rectangle_compliance, square_compliance
from seatfem.study.scene.local import law_of_part
from tests.gallery import load_text, refusal, summary_of
from tests.steps import Scene, SceneError, run_contacts, run_scene, striker_of

YOUNG, POISSON = 200e9, 0.3
STEEL = 'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }\n'
MASS = '[reed]\nkind = "rigid_mass"\nmass = "1 kg"\nvelocity = "-3.132 m/s"\n'
HERTZ = 'law = { kind = "hertz", stiffness = "25.9 GN/m^1.5" }\n'
DISC = '[seat]\nkind = "stopper"\nradius = "150 mm"\nthickness = "150 mm"\ncontact_radius = "5 mm"\n' + STEEL
BLOCK = '[seat]\nkind = "block"\nwidth = "20 mm"\ndepth = "20 mm"\nthickness = "10 mm"\n' + STEEL
ANNULAR = f'[seat]\nkind = "annular"\nbore_radius = "5 mm"\nlip_width = "1 mm"\n{STEEL}'
ROUGH = '{ kind = "rough_joint", force = "8 kN", closure = "2 um" }'
STEP = '[run]\nduration = "0.25 ms"\n'


def scene_of(seat: str, tmp_path: Path, contact: str = HERTZ, reed: str = MASS, more: str = "") -> Scene:
    return load_text(tmp_path, f"{seat}{reed}[contact]\n{contact}{STEP}{more}")


def law_in(scene: Scene) -> object:
    return law_of_part(scene.contact.law, 1.0, scene.seat, scene.reed)


def test_the_law_leaves_the_half_spaces_share_to_the_patch(tmp_path: Path) -> None:
    """The law subtracts the half-space under a disc, a rectangle, and both bodies where an elastic ball strikes."""
    c = disk_compliance(young=YOUNG, poisson=POISSON, radius=5e-3)
    assert law_in(scene_of(DISC, tmp_path)) == impact.HertzOnPatch(25.9e9, c)
    lossy = HERTZ.replace('"hertz"', '"hunt_crossley"').replace(" }", ', damping = "0.1 s/m" }')
    assert law_in(scene_of(DISC, tmp_path, lossy)) == impact.HertzOnPatch(25.9e9, c, 0.1)
    patched = BLOCK + 'patch_width = "4 mm"\npatch_depth = "2 mm"\n'
    rectangle = rectangle_compliance(young=YOUNG, poisson=POISSON, sides=(4e-3, 2e-3))
    assert law_in(scene_of(patched, tmp_path)) == impact.HertzOnPatch(25.9e9, rectangle)
    ball = f'[reed]\nkind = "ball"\ndiameter = "60 mm"\ncontact_radius = "4 mm"\nvelocity = "-1 m/s"\n{STEEL}'
    facet = disk_compliance(young=YOUNG, poisson=POISSON, radius=4e-3)
    assert law_in(scene_of(DISC, tmp_path, reed=ball)) == impact.HertzOnPatch(25.9e9, c + facet)
    for law in ('"signorini"', '{ kind = "spring", stiffness = "1 GN/m" }', ROUGH):  # of the joint alone
        joint = scene_of(DISC, tmp_path, f"law = {law}\n")
        assert law_in(joint) == joint.contact.law.law()
        assert scene_of(ANNULAR, tmp_path, f"law = {law}\nports = 16\n").contact.ports == 16


def test_a_rectangle_is_a_square_where_its_sides_are_equal() -> None:
    """Equal sides give the square's value, and 1 by 3 the mean of 1/r by quadrature, 1.5988441176."""
    of = {"young": 1.0, "poisson": 0.3}
    square = square_compliance(**of, side=2.0)
    assert rectangle_compliance(**of, sides=(2.0, 2.0)) == pytest.approx(square, rel=1e-14)
    assert rectangle_compliance(**of, sides=(1.0, 3.0)) == pytest.approx(1.5988441176 * 0.91 / math.pi, rel=1e-9)


@pytest.mark.parametrize(
    ("seat", "contact", "more", "said"),
    [
        (ANNULAR, HERTZ, "", "contact.law: .*'annular', is struck on a ring.*stopper.*spring"),
        (DISC.replace('"150 mm"\nth', '"8 mm"\nth'), HERTZ, "", "contact.law: .*an edge.*contact_radius smaller"),
        (BLOCK + 'patch_width = "12 mm"\npatch_depth = "2 mm"\n', HERTZ, "", "an edge.*patch_width and patch_depth"),
        (DISC, HERTZ + "rings = 3\n", "", "contact.law: .*3 parts .*take contact.ports = 1 and contact.rings"),
        (DISC + "arc = \"60 deg\"\n", HERTZ, "", "contact.law: .*arc"),
        ('[seat]\nkind = "spring"\nstiffness = "1 GN/m"\n', "",
         ANNULAR.replace("seat", "stopper") + f'gap = "1 mm"\n{HERTZ}', "stopper.law: .*'annular'"),
    ],
)  # fmt: skip
def test_unknown_shares_are_refused(seat: str, contact: str, more: str, said: str, tmp_path: Path) -> None:
    assert re.search(said, refusal(scene_of, seat, tmp_path, contact, more=more))


@pytest.mark.slow
def test_a_patch_smaller_than_the_contact_is_refused(tmp_path: Path) -> None:
    """A patch of 1.2 mm is refused for a contact of 2.4 mm: the law ends at 1.67 times the patch."""
    scene = scene_of(DISC.replace('"5 mm"', '"1.2 mm"'), tmp_path)
    with pytest.raises(SceneError, match=r"contact.law: .*larger.*patch.*seat.contact_radius at least 1\.\d+ times"):
        run_scene(scene, tmp_path / "out", pictures=False)


@pytest.mark.slow
def test_the_force_of_a_ball_does_not_depend_on_the_patch(tmp_path: Path) -> None:
    """A steel ball of 1 kg at 3.132 m/s, contact radius 2.4 mm, on patches of 2.4 to 40 mm of a steel block.

    Hertz: 65.83 kN, 175.1 us, 6.264 N s. The block's own compliance between a disc and a clamped face 150 mm below is
    less than a half-space's, by about (1 - nu^2)/(pi E H) = 1e-11 m/N, or 0.35 % of the indentation: 0.2 % more force.
    With c 3 % off the smallest patch would be 0.6 % off, the largest 0.04 %.
    """
    exact = hertz_impact(stiffness=25.9e9, mass=1.0, speed=3.132)
    peaks = []
    for radius in (2.4, 5, 10, 40):
        scene = scene_of(DISC.replace('"5 mm"', f'"{radius} mm"\nmodel = "spring"'), tmp_path)
        summary = summary_of(scene, tmp_path / f"{radius}")
        peaks.append(summary["peak_force_N"])
        assert summary["peak_force_N"] == pytest.approx(exact.force, rel=5e-3)
        assert summary["impulse_Ns"] == pytest.approx(2 * 3.132, rel=2e-3)
        assert summary["contact_duration_s"] == pytest.approx(exact.duration, rel=5e-3)
        assert abs(summary["peak_force_N"] - exact.force) < summary["error_bar_filtered_peak_force_N"]
    assert max(peaks) / min(peaks) - 1 < 3e-3


BALL = f'[reed]\nkind = "ball"\ndiameter = "5 mm"\ncontact_radius = "0.3 mm"\nvelocity = "-1 m/s"\n{STEEL}'
RIGID = f'[reed]\nkind = "rigid_mass"\nmass = "{7850 * math.pi / 6 * 5e-3**3!r} kg"\nvelocity = "-1 m/s"\n'


@pytest.mark.slow
@pytest.mark.parametrize(("reed", "within", "facet"), [(RIGID, 5e-3, 0.0), (BALL, 2e-2, 6e-3)])
def test_a_small_ball_of_finite_elements_or_rigid(reed: str, within: float, facet: float, tmp_path: Path) -> None:
    """5 mm of steel at 1 m/s on a plate of 50 mm: 107.2 N, contact radius 0.12 mm, patches of 0.3 mm.

    With the ball's waves and facet both shares are taken out of the law; its mesh has an error of 1 to 2 % of c,
    of which the force follows 2/5: ``facet``.
    """
    stiffness = 4 / 3 * YOUNG / (2 * (1 - POISSON**2)) * math.sqrt(2.5e-3)
    seat = f'[seat]\nkind = "stopper"\nradius = "50 mm"\nthickness = "50 mm"\ncontact_radius = "0.3 mm"\n{STEEL}'
    law = f'law = {{ kind = "hertz", stiffness = "{stiffness!r} N/m^1.5" }}\n'
    scene = load_text(tmp_path, f'{seat}{reed}[contact]\n{law}[run]\nduration = "40 us"\n[accuracy]\ntarget = "2 %"\n')
    summary = summary_of(scene, tmp_path / "out")
    exact = hertz_impact(stiffness=stiffness, mass=7850 * math.pi / 6 * 5e-3**3, speed=1.0)
    assert exact.force == pytest.approx(107.3, abs=0.1)
    assert summary["peak_force_N"] == pytest.approx(exact.force, rel=within)
    tolerance = summary["error_bar_filtered_peak_force_N"] + facet * exact.force
    assert abs(summary["peak_force_N"] - exact.force) < tolerance
    assert summary["contact_duration_s"] == pytest.approx(exact.duration, rel=within)


ON_RIGID = (
    '[seat]\nkind = "spring"\nstiffness = "1e15 N/m"\n[reed]\nkind = "rigid_mass"\nmass = "5 g"\nvelocity = "-2 m/s"\n'
    '{law}\n[run]\nduration = "1 ms"\n'
)
RIGID_SEAT = impact.spring(stiffness=1e15)


def scene_with_law(law, folder):
    return load_text(folder, ON_RIGID.format(law=law))


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        ("", impact.Signorini()),
        ('[contact]\nlaw = "signorini"', impact.Signorini()),
        ('[contact]\nlaw = { kind = "signorini" }', impact.Signorini()),
        ('[contact]\nlaw = { kind = "spring", stiffness = "20 N/um" }', impact.LinearSpring(20e6)),
        ('[contact]\nlaw = { kind = "hertz", stiffness = "5 GN/m^1.5" }', impact.Hertz(5e9)),
        ('[contact.law]\nkind = "hunt_crossley"\nstiffness = "1 N/mm^1.5"\ndamping = "0.2 s/m"',
         impact.HuntCrossley(1e3**1.5, 0.2)),
        ('[contact]\nlaw = { kind = "rough_joint", force = "8 kN", closure = "2 um" }',
         impact.RoughJoint.through(force=8e3, closure=2e-6)),
        ('[contact.law]\nkind = "rough_joint"\nforce = "8 kN"\nclosure = "2 um"\nexponent = 3\nrecovery = 0.4',
         impact.RoughJoint.through(force=8e3, closure=2e-6, exponent=3.0, recovery=0.4)),
    ],
)  # fmt: skip
def test_a_scenes_law(law, expected, tmp_path):
    assert scene_with_law(law, tmp_path).contact.law.law() == expected


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (ROUGH.replace(" }", ", recovery = 1.1 }"), "contact.law.recovery: 1.1"),
        (f'{ROUGH}\nfilm = {{ viscosity = "18 uPa s", floor = "2 um", width = "1 mm", length = "9 mm" }}',
         "contact.film:.*fluid"),
        ("unloading", "contact.law.file: .*column 'unloading'"),
        ("2,8,9", "contact.law.file: .*(softer|closure)"),
        ("3,18,17", "contact.law.file: .*one force in both columns"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(law, words, tmp_path):
    """A law of a scene, or what stands in a table of a joint in place of a part of it."""
    right = {"unloading": "unloading [kN]", "2,8,9": "2,8,0", "3,18,17": "3,18,18"}.get(law, "")
    (tmp_path / "joint.csv").write_text(TABLE.replace(right, law) if right else TABLE)
    with pytest.raises(SceneError, match=words):
        scene_with_law(f"[contact]\nlaw = {JOINT if right else law}", tmp_path)


TABLE = "closure [um],loading [kN],unloading [kN]\n1,2,0\n2,8,0\n3,18,18\n"
JOINT = '{ kind = "table_joint", file = "joint.csv" }'


def test_a_joint_is_read_from_its_table(tmp_path):
    (tmp_path / "joint.csv").write_text(TABLE)
    law = scene_with_law(f"[contact]\nlaw = {JOINT}", tmp_path).contact.law
    np.testing.assert_allclose(law.law(0.5).closures, (1e-6, 2e-6, 3e-6), rtol=1e-14)
    assert law.law(0.5).loading == (1e3, 4e3, 9e3)
    assert law.law(0.5).unloading == (0.0, 0.0, 9e3)


def test_a_run_obeys_the_law(tmp_path):
    """A mass on a stiff seat has Hertz's duration 2.94 d/v and largest force, and the spring's v sqrt(k m)."""
    mass, speed, k = 5e-3, 2.0, 5e9
    scene = scene_with_law('[contact]\nlaw = { kind = "hertz", stiffness = "5 GN/m^1.5" }', tmp_path)
    result = run_contacts(scene, striker_of(scene), RIGID_SEAT, 2e-8).seat
    depth = (1.25 * mass * speed**2 / k) ** 0.4
    # passive steps of 2e-8 s in a blow of some 3e-5 s: each end of the blow is known to a step, the force to 1e-3
    assert impact.measures.peak_force(result) == pytest.approx(k * depth**1.5, rel=3e-3)
    start, end = impact.measures.contact_groups(result)[0]
    assert end - start == pytest.approx(2.9432751 * depth / speed, rel=5e-3)
    soft = scene_with_law('[contact]\nlaw = { kind = "spring", stiffness = "20 N/um" }', tmp_path)
    result = run_contacts(soft, striker_of(soft), RIGID_SEAT, 2e-8).seat
    assert impact.measures.peak_force(result) == pytest.approx(speed * math.sqrt(20e6 * mass), rel=3e-3)
