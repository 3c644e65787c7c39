"""The local compliance of a struck patch counts once: Hertz's law leaves it to the patch."""

import math
import re
from pathlib import Path

import pytest

from impact import HertzOnPatch, LinearSpring, RoughJoint, Signorini
from impact.exact.contact_stress import hertz_impact
from impact.exact.half_space import disk_compliance, rectangle_compliance, square_compliance
from seatfem.study.scene.laws import ContactLaw
from seatfem.study.scene.local import law_of_part
from tests.gallery import load_text, refusal
from tests.steps import Scene, SceneError, load_scene, run_scene

YOUNG, POISSON = 200e9, 0.3
STEEL = 'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }\n'
MASS = '[reed]\nkind = "rigid_mass"\nmass = "1 kg"\nvelocity = "-3.132 m/s"\n'
HERTZ = 'law = { kind = "hertz", stiffness = "25.9 GN/m^1.5" }\n'
DISC = '[seat]\nkind = "stopper"\nradius = "150 mm"\nthickness = "150 mm"\ncontact_radius = "5 mm"\n' + STEEL
BLOCK = '[seat]\nkind = "block"\nwidth = "20 mm"\ndepth = "20 mm"\nthickness = "10 mm"\n' + STEEL
ANNULAR = f'[seat]\nkind = "annular"\nbore_radius = "5 mm"\nlip_width = "1 mm"\n{STEEL}'
STEP = '[run]\nduration = "0.25 ms"\n'


def scene_of(seat: str, tmp_path: Path, contact: str = HERTZ, reed: str = MASS, more: str = "") -> Scene:
    return load_text(tmp_path, f"{seat}{reed}[contact]\n{contact}{STEP}{more}")


def law_in(scene: Scene) -> object:
    return law_of_part(scene.contact.law, 1.0, scene.seat, scene.reed)


def test_the_law_leaves_the_half_spaces_share_to_the_patch(tmp_path: Path) -> None:
    """The law subtracts the half-space under a disc, a rectangle, and both bodies where an elastic ball strikes."""
    c = disk_compliance(young=YOUNG, poisson=POISSON, radius=5e-3)
    assert law_in(scene_of(DISC, tmp_path)) == HertzOnPatch(25.9e9, c)
    lossy = HERTZ.replace('"hertz"', '"hunt_crossley"').replace(" }", ', damping = "0.1 s/m" }')
    assert law_in(scene_of(DISC, tmp_path, lossy)) == HertzOnPatch(25.9e9, c, 0.1)
    patched = BLOCK + 'patch_width = "4 mm"\npatch_depth = "2 mm"\n'
    rectangle = rectangle_compliance(young=YOUNG, poisson=POISSON, sides=(4e-3, 2e-3))
    assert law_in(scene_of(patched, tmp_path)) == HertzOnPatch(25.9e9, rectangle)
    ball = f'[reed]\nkind = "ball"\ndiameter = "60 mm"\ncontact_radius = "4 mm"\nvelocity = "-1 m/s"\n{STEEL}'
    facet = disk_compliance(young=YOUNG, poisson=POISSON, radius=4e-3)
    assert law_in(scene_of(DISC, tmp_path, reed=ball)) == HertzOnPatch(25.9e9, c + facet)


@pytest.mark.parametrize(
    ("law", "kind"),
    [
        ('law = "signorini"\n', Signorini),
        ('law = { kind = "spring", stiffness = "1 GN/m" }\n', LinearSpring),
        ('law = { kind = "rough_joint", force = "10 kN", closure = "2 um" }\n', RoughJoint),
    ],
)
def test_nothing_is_taken_from_laws_of_the_joint_alone(law: str, kind: type, tmp_path: Path) -> None:
    """Laws of a joint, and own ones unless they hold the indentation, stay; a lip in parts does too."""
    assert isinstance(law_in(scene_of(DISC, tmp_path, law)), kind)
    assert scene_of(ANNULAR, tmp_path, law + "ports = 16\n").contact.ports == 16
    assert not ContactLaw.holds_indentation


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
    path = tmp_path / "scene.toml"
    path.write_text(f"{DISC}{MASS}[contact]\n{HERTZ}{STEP}".replace('"5 mm"', '"1.2 mm"'), encoding="utf-8")
    with pytest.raises(
        SceneError, match=r"contact.law: .*larger than.*patch.*seat.contact_radius at least 1\.\d+ times"
    ):
        run_scene(load_scene(path), tmp_path / "out", pictures=False)


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
        path = tmp_path / f"{radius}.toml"
        seat = DISC.replace('"5 mm"', f'"{radius} mm"\nmodel = "spring"')
        path.write_text(f"{seat}{MASS}[contact]\n{HERTZ}{STEP}", encoding="utf-8")
        summary = run_scene(load_scene(path), tmp_path / f"{radius}", pictures=False).summary
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
    path = tmp_path / "scene.toml"
    path.write_text(
        f'{seat}{reed}[contact]\n{law}[run]\nduration = "40 us"\n[accuracy]\ntarget = "2 %"\n', encoding="utf-8"
    )
    summary = run_scene(load_scene(path), tmp_path / "out", pictures=False).summary
    exact = hertz_impact(stiffness=stiffness, mass=7850 * math.pi / 6 * 5e-3**3, speed=1.0)
    assert exact.force == pytest.approx(107.3, abs=0.1)
    assert summary["peak_force_N"] == pytest.approx(exact.force, rel=within)
    tolerance = summary["error_bar_filtered_peak_force_N"] + facet * exact.force
    assert abs(summary["peak_force_N"] - exact.force) < tolerance
    assert summary["contact_duration_s"] == pytest.approx(exact.duration, rel=within)
