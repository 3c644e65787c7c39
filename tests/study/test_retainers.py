"""A reed that rolls on a curved retainer: statics of Euler and Bernoulli, a plain program of springs, refusals."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from impact.bodies.body import Body
from seatfem.fields import KeyProblem
from seatfem.study.impacts.bodies import striker_of
from seatfem.study.impacts.contact import record_of
from seatfem.study.impacts.layout import layout_of
from seatfem.study.scene.retainers import Profile, Retainer
from tests.gallery import load_text
from tests.steps import Division, Scene, SceneError, Touches, check_files, load_scene, problem_of, run_contacts
from tests.study.small_scenes import ANNULAR, scene_of

YOUNG, DENSITY, LENGTH, WIDTH, THICKNESS = 200e9, 7850.0, 25e-3, 10e-3, 0.3e-3
STIFFNESS = YOUNG * WIDTH * THICKNESS**3 / 12
RADIUS = 0.2

MESHES = Path(__file__).parents[2] / "meshes"

BEAM = f"""
seat = {{ kind = "spring", stiffness = "50 N/um" }}
reed = {{ kind = "cantilever", length = "{1e3 * LENGTH} mm", width = "{1e3 * WIDTH} mm", \
    thickness = "{1e3 * THICKNESS} mm", n_modes = 120, point_force = "1 N" }}
stopper = {{ kind = "spring", stiffness = "1 N/nm", gap = "0 mm", arcs = 32, profile.radius = "{1e3 * RADIUS} mm" }}
contact = {{ gap = "0.2 mm" }}
run = {{ duration = "0.1 ms" }}
"""


def beam_scene(folder: Path, **keys: object) -> Scene:
    return load_text(folder, BEAM, changed=keys)


def run(scene: Scene, dt: float) -> Touches:
    seat = scene.seat.closed_form()
    assert seat is not None
    return run_contacts(scene, striker_of(scene), seat, dt)


@pytest.mark.parametrize("tip_force", [1.2, 2.0, 6.0])
def test_a_beam_under_a_force_at_its_tip_wraps_as_euler_and_bernoulli_say(tmp_path: Path, tip_force: float) -> None:
    """On a parabola x^2/(2 R), of the curvature 1/R, a cantilever has EI/R = F (L - a) where it leaves at a, as the
    curvature is continuous there."""
    parabola, x = tmp_path / "retainer.csv", np.linspace(0.0, LENGTH, 501)
    rows = [f"{1e3 * a},{1e3 * a**2 / (2 * RADIUS)}" for a in x]
    parabola.write_text("\n".join(["along [mm],height [mm]", *rows]))
    free = STIFFNESS / (RADIUS * tip_force)
    contact = LENGTH - free
    bent = contact**2 / (2 * RADIUS) + contact * free / RADIUS
    tip = bent + tip_force * free**3 / (3 * STIFFNESS)
    errors = []
    for arcs in (16, 64):
        scene = beam_scene(
            tmp_path,
            **{
                "stopper.arcs": arcs,
                "stopper.profile": {"file": str(parabola)},
                "reed.point_force": f"{tip_force} N",
                "contact.preload": True,
            },
        )
        touches = run(scene, 1e-6)
        pushed, at = touches.stopper_forces, scene.geometry.contact_at
        assert pushed is not None
        assert isinstance(at, tuple)
        places = np.array(at[1:])
        assert places == pytest.approx(LENGTH * (np.arange(arcs) + 0.5) / arcs, abs=1e-3 * LENGTH)
        assert np.ptp(touches.seat.gap) < 1e-4 * tip  # it stays at rest
        last = float(places[pushed[1] > 1e-6 * tip_force].max())
        assert abs(last - contact) < 2.5 * LENGTH / arcs  # the last reaction rests on two segments
        assert float(pushed[1].sum()) == pytest.approx(tip_force, rel=2 / arcs)  # the clamp bears no force
        errors.append(abs(float(touches.seat.gap[1]) - 0.2e-3 - tip) / tip)
    assert errors[1] < 5e-4  # 3 % of R, or of EI, move the tip by 1 to 3 %
    assert errors[1] < max(errors[0] / 4, 1e-4)  # at least of first order in the length of a segment


def test_heights_of_a_circle_and_of_a_file_are_those_of_the_gaps(tmp_path: Path) -> None:
    scene = beam_scene(tmp_path, **{"stopper.gap": "0.1 mm", "stopper.profile.start": "5 mm"})
    at = scene.geometry.contact_at
    assert isinstance(at, tuple)
    places = np.array(at[1:])
    assert places.min() > 5e-3
    heights = RADIUS - np.sqrt(RADIUS**2 - (places - 5e-3) ** 2)
    assert scene.geometry.stopper_gaps() == pytest.approx(0.1e-3 + heights, rel=1e-3)


def test_a_lift_is_that_of_the_reed_at_its_contact(tmp_path: Path) -> None:
    scene = beam_scene(tmp_path, **{"stopper.gap": None, "stopper.lift": "3 mm", "contact.gap": "0 mm"})
    height = RADIUS - math.sqrt(RADIUS**2 - LENGTH**2)
    assert scene.geometry.stopper_gap == pytest.approx(3e-3 - height, rel=1e-9)
    assert scene.geometry.stopper_gap_at_contact == pytest.approx(3e-3, rel=1e-9)


PARTS, PRESSURE, DURATION, TIP_FORCE = 50, 0.4e5, 0.8e-3, 1.0


def plain_wrap(dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the force on the retainer [N] and the deflection of the tip [m] at steps, by finite differences in space
    and central differences in time, with a stiff one-sided spring at each place."""
    h = LENGTH / PARTS
    curvature = (
        np.diag(np.full(PARTS, -2.0)) + np.diag(np.ones(PARTS - 1), 1) + np.diag(np.ones(PARTS - 1), -1)
    ) / h**2
    curvature[-1] = 0.0  # the tip has no moment
    at_clamp = np.zeros(PARTS)
    at_clamp[0] = 2 / h**2
    stiffness = STIFFNESS * h * (curvature.T @ curvature + np.outer(at_clamp, at_clamp) / 2)
    share = np.full(PARTS, h)
    share[-1] = h / 2
    mass, load = DENSITY * WIDTH * THICKNESS * share, PRESSURE * WIDTH * share
    load[-1] += TIP_FORCE
    x = h * np.arange(1, PARTS + 1)
    gap = RADIUS - np.sqrt(RADIUS**2 - x**2)
    u = before = np.zeros(PARTS)
    forces, tips = [], []
    for _ in range(round(DURATION / dt)):
        pressed = 1e5 * share / h * np.maximum(u - gap, 0.0)
        u, before = 2 * u - before + dt**2 * (load - stiffness @ u - pressed) / mass, u
        forces.append(pressed.sum())
        tips.append(u[-1])
    return np.array(forces), np.array(tips)


@pytest.mark.slow
def test_a_plain_program_with_many_springs_wraps_as_the_run_does(tmp_path: Path) -> None:
    forces, tips = plain_wrap(1e-7)
    scene = beam_scene(
        tmp_path,
        **{
            "stopper.arcs": 50,
            "stopper.stiffness": "5 N/um",  # as many springs of 0.1 N/um
            "reed.pressure": "0.4 bar",
            "reed.n_modes": 80,
            "run.duration": "0.8 ms",
        },
    )
    touches = run(scene, 2e-7)
    assert touches.stopper_force is not None
    tip = np.asarray(touches.seat.gap) - 0.2e-3
    assert float(tip.max()) == pytest.approx(tips.max(), rel=0.01)
    assert int(tip.argmax()) * 2e-7 == pytest.approx(int(tips.argmax()) * 1e-7, rel=0.01)
    impulse = float(touches.stopper_force[1:].sum()) * 2e-7
    assert impulse == pytest.approx(float(forces.sum()) * 1e-7, rel=0.02)


def test_a_wrap_without_damping_keeps_its_energy(tmp_path: Path) -> None:
    scene = beam_scene(tmp_path, **{"reed.pressure": "0.4 bar", "run.duration": "0.6 ms", "reed.n_modes": 40})
    touches = run(scene, 5e-7)
    assert touches.stopper_force is not None
    assert touches.stopper_force.max() > 0
    assert touches.seat.energy.residual < 1e-9


RUN = '[run]\nduration = "1 ms"\n'

FLAPPER = f"""
{ANNULAR}
reed = {{ kind = "flapper", root_width = "10 mm", taper_length = "2 mm", neck_width = "7 mm", neck_length = "18 mm", \
    paddle_diameter = "13 mm", thickness = "0.3 mm", release = {{ mode = 1, velocity = "-1 m/s" }} }}
[stopper]
gap = "0.1 mm"
"""


def test_a_plate_meets_the_part_of_the_retainer_that_lies_over_it() -> None:
    spring = 'kind = "spring"\nstiffness = "1000 N/um"\nprofile = { radius = "200 mm", width = "6 mm" }'
    scene = scene_of(FLAPPER, spring, RUN)
    lip = scene.geometry.stopper_lip()
    assert lip is not None
    assert lip.arcs == 32
    across = np.linalg.norm(np.subtract(*lip.lines_across(2).transpose(1, 0, 2, 3)), axis=-1)
    assert across[:-2] == pytest.approx(6e-3, rel=1e-6)  # before the round end of the paddle
    assert float(lip.lengths.sum()) == pytest.approx(30e-3, rel=0.06)
    gaps = scene.geometry.stopper_gaps()
    assert np.all(np.diff(gaps) > 0)
    assert gaps[-1] == pytest.approx(0.1e-3 + 29.5e-3**2 / (2 * 0.2), rel=0.03)


def test_the_drawing_shows_the_curved_face(tmp_path: Path) -> None:
    stopper = layout_of(beam_scene(tmp_path)).bodies["stopper"]
    (section,) = stopper.section
    height = section[:, 1].max() - section[:, 1].min()
    assert height > RADIUS - math.sqrt(RADIUS**2 - LENGTH**2)
    assert "200 mm" in stopper.name


@pytest.mark.parametrize(
    ("keys", "key", "words"),
    [
        ({"stopper.profile.file": "none.csv"}, "stopper.profile.file", "none.csv"),
        ({"stopper.profile": {}}, "stopper.profile.radius", "radius, file"),
        ({"stopper.profile.end": "0.001 mm", "stopper.profile.start": "2 mm"}, "stopper.profile.end", "larger"),
        ({"stopper.profile.radius": "20 mm"}, "stopper.profile.radius", "larger"),
        ({"stopper.arcs": 1}, "stopper.arcs", "profile"),
        ({"stopper.at": "10 mm"}, "stopper.at", "remove"),
        ({"stopper.tilt": "1 deg"}, "stopper.tilt", "profile.file, remove"),
        ({"stopper.gap": None, "stopper.lift": "1 mm", "contact.gap": "0 mm"}, "stopper.lift", "inside, add"),
        ({"stopper.profile.own_face": True, "stopper.profile.radius": None}, "stopper.profile.own_face", "file"),
        ({"reed.kind": "clamped_clamped"}, "stopper.profile.radius", "both, file"),
        ("along [mm],height [mm]\n0,0\n10,1\n5,2", "heights.csv", "rise"),
        ("x [mm],height [mm]\n0,0\n10,1", "heights.csv", "must be 'along [unit]', rename it"),
        ("along,height [mm]\n0,0\n10,1", "heights.csv", "write 'along [unit]'"),
    ],
)
def test_a_profile_that_cannot_be_is_refused_by_key(
    tmp_path: Path, keys: dict[str, object] | str, key: str, words: str
) -> None:
    """Keys of a scene, or the head and two rows of a file of heights."""
    if isinstance(keys, str):
        (tmp_path / "heights.csv").write_text(f"{keys}\n")
        keys = {"stopper.profile": {"file": str(tmp_path / "heights.csv")}}
    with pytest.raises(SceneError) as refusal:
        beam_scene(tmp_path, **keys).geometry.stopper_gaps()
    assert key in str(refusal.value)
    for word in words.split(", "):
        assert word in str(refusal.value)


def test_a_curved_face_of_a_part_has_its_own_heights(tmp_path: Path) -> None:
    """The radius of the file's cylinder is 200 mm; the side view of its triangles gives its heights within 5 um."""
    (tmp_path / "retainer.step").write_bytes((MESHES / "retainer.step").read_bytes())
    (tmp_path / "scene.toml").write_text(FLAPPER + 'kind = "cad"\nfile = "retainer.step"\nmaterial = "steel"\n' + RUN)
    with pytest.raises(SceneError, match=r"stopper\.contact.*not flat.*own_face = true"):
        check_files(load_scene(tmp_path / "scene.toml"))
    scene = load_scene(tmp_path / "scene.toml", {"stopper.profile": {"own_face": True}})
    check_files(scene)
    assert scene.stopper is not None
    assert scene.stopper.profile is not None
    x = np.linspace(0.0, 29.9e-3, 100)
    heights = Retainer(scene.stopper.profile, scene.stopper.body).heights(x)
    assert heights == pytest.approx(RADIUS - np.sqrt(RADIUS**2 - x**2), abs=5e-6)
    assert scene.geometry.stopper_gaps()[0] == pytest.approx(0.1e-3, abs=5e-6)


def test_strain_at_a_gauge_is_known_in_any_number_of_segments(tmp_path: Path) -> None:
    """A run is compared with one of twice as many segments; where the reed lies on it its strain is t/(2 R)."""
    keys = {"reed.point_force": "6 N", "contact.preload": True, "accuracy.measures": ["gauge_strain"]}
    keys["run.duration"] = "20 us"
    scene = load_text(tmp_path, BEAM, '[[gauge]]\nname = "root"\nof = "reed"\nat = "10 mm"\n', changed=keys)
    finer = scene.model_copy(update={"stopper": scene.stopper.divided(Division(64))})
    striker, seat = striker_of(finer), finer.seat.closed_form()
    record = record_of(scene, problem_of(finer, striker, Body(seat)), 1e-6)
    (largest,) = (value for name, value in record.others.items() if "largest" in name)
    assert abs(largest) == pytest.approx(THICKNESS / (2 * RADIUS), rel=0.03)


def test_a_hole_over_the_retainer_is_refused(tmp_path: Path) -> None:
    views = beam_scene(tmp_path).reed.views()
    hole = 4e-3 * np.array([[math.cos(a), math.sin(a)] for a in np.linspace(0, 2 * math.pi, 40)]) - np.array([12e-3, 0])
    holed = replace(views, plan=(*views.plan, hole[::-1]))
    with pytest.raises(KeyProblem, match="slotted"):
        Retainer(Profile(radius="200 mm"), beam_scene(tmp_path).seat).face(holed)
