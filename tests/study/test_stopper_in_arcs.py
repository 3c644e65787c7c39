"""A plate meets its stopper in arcs: uniform loads, ledger and momentum, tilt, what is refused."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.march.motion import modal_coordinates
from seatfem.structures.inspection.cad import Shape
from seatfem.structures.rings import Division, join_all_parts
from seatfem.study.impacts.bodies import problem_of, stopper_of
from seatfem.study.impacts.contact import marched, run_contacts
from seatfem.study.impacts.forces import Forces
from seatfem.study.impacts.plate_stress import plate_field
from seatfem.study.impacts.touches import Touches, stopper_values
from seatfem.study.ladders.table import ladder_of
from seatfem.study.method import stated_method
from seatfem.study.scene import Scene, SceneError
from seatfem.study.scene.lips import STOPPER
from tests.as_stated import solved_striker, striker_of
from tests.gallery import load_text
from tests.steps import SAFETY, ComputedRun, Lip, ModelError, Plan, Solved, check_files, error_budget, run_scene

STEEL = 'material = { young = "206 GPa", poisson = 0.3, density = "7800 kg/m^3" }\n'
SEAT = 'kind = "spring"\nstiffness = "50 N/um"\n'
REED = (
    'kind = "flapper"\nroot_width = "8 mm"\ntaper_length = "2 mm"\nneck_width = "6 mm"\nneck_length = "15 mm"\n'
    'paddle_diameter = "16 mm"\nthickness = "0.3 mm"\ndamping_ratio = 0.0\ngreens = { bandwidth = "15 kHz" }\n'
    'release = { deflection = "-1 mm" }\n'
)
FREE = (
    'kind = "ring_plate"\nouter_diameter = "16 mm"\ninner_diameter = "6 mm"\nthickness = "1 mm"\n'
    'greens = { bandwidth = "20 kHz" }\nmesh = { size = "2 mm" }\nvelocity = "-1 m/s"\n'
)
DISC = (
    'kind = "stopper"\nradius = "9 mm"\nthickness = "4 mm"\ncontact_radius = "6 mm"\n'
    'model = "spring"\nmesh = { size = "1 mm" }\n' + STEEL
)
SPRING = 'kind = "spring"\nstiffness = "5 N/um"\n'
BROAD = DISC.replace('"9 mm"', '"12 mm"').replace('"6 mm"', '"9 mm"')
GAP = 20e-6


def of_file(name: str) -> str:
    """Return the keys of a body of a file."""
    kind = "mesh" if name.endswith(".msh") else "cad"
    return f'kind = "{kind}"\nfile = "{Path(__file__).parents[2] / "meshes" / name}"\n{STEEL}'


def scene_of(folder: Path, stopper: str, reed: str = REED, more: str = "", duration: str = "1.5 ms") -> Scene:
    return load_text(
        folder,
        f'[seat]\n{SEAT}[reed]\n{reed}[stopper]\n{stopper}gap = "20 um"\n[run]\nduration = "{duration}"\n'
        'filter_width = "5 us"\n[accuracy]\ntarget = "20 %"\nmeasures = ["impulse"]\n[contact]\ngap = "1.5 mm"\n'
        + more,
    )


def struck(scene: Scene, dt: float = 1e-7) -> Touches:
    return run_contacts(scene, striker_of(scene), impact.spring(stiffness=5e7), dt)


def test_what_is_met(tmp_path: Path) -> None:
    """The plate meets the stopper's own disc or the reed's contact, as a whole if the scene asks for no parts."""
    assert scene_of(tmp_path, DISC).geometry.stopper_lip() is None
    assert scene_of(tmp_path, DISC + "arcs = 12\nrings = 2\n").geometry.stopper_lip() == Lip(3e-3, 6e-3, 12, 2)
    own = scene_of(tmp_path, SPRING + 'tilt = "0.1 deg"\n').geometry.stopper_lip()
    assert (own.arcs, own.outer) == (32, pytest.approx(scene_of(tmp_path, SPRING).reed.own_lip.outer))  # type: ignore[attr-defined]


@pytest.mark.slow
def test_uniform_load_on_all_arcs_is_that_on_one_port(tmp_path: Path) -> None:
    """A stopper's 32 arcs in two rings have under a uniform pressure the compliance of its disc on the same mesh,
    symmetric; the reed's own ports likewise."""
    many, one = (stopper_of(scene_of(tmp_path, DISC + keys)) for keys in ("arcs = 32\nrings = 2\n", ""))
    assert many.greens.ports == Division(32, 2).names
    compliance = many.greens.static_compliance()
    np.testing.assert_allclose(compliance, compliance.T, atol=1e-9 * compliance.max())
    whole = join_all_parts(many.greens).static_compliance()[0, 0]
    assert whole == pytest.approx(one.greens.static_compliance()[0, 0], rel=2e-3)
    plate = solved_striker(scene_of(tmp_path, SPRING + "arcs = 32\n"), mesh_error=False)
    names, g = [STOPPER + name for name in Division(32).names], plate.greens.static_compliance()
    of = [plate.greens.port_index(name) for name in names]
    assert g[np.ix_(of, of)].mean() == pytest.approx(g[0, 0], rel=1e-6)  # its own disc


@pytest.mark.slow
def test_a_free_ring_is_pushed_against_its_stopper(tmp_path: Path) -> None:
    """A free ring pressed by 14 N closes the ledger, its arcs share the force alike, and the forces on the ports move
    its own modes as the march has it, but for what other modes leave."""
    free = FREE.replace("-1 m/s", "-0.01 m/s")
    scene = scene_of(tmp_path, SPRING + "arcs = 8\n", free, '[[load]]\nforce = "14 N"\n', "0.2 ms")
    touches, body = struck(scene), striker_of(scene)
    assert touches.seat.energy.residual < 1e-9
    force = touches.stopper_parts.force
    np.testing.assert_allclose(force.sum(axis=1), touches.stopper.force, rtol=1e-12)
    np.testing.assert_allclose(force.sum(axis=0), force.sum() / 8, rtol=0.02 * force.sum() / 8)  # the mesh is uneven
    spring = impact.spring(stiffness=5e7)
    pushed = Forces.from_touches(scene.geometry, spring, touches).find_striker_forces(body.greens)[1:].T
    assert -pushed.sum() * 1e-7 == pytest.approx(impact.measures.impulse(touches.stopper), rel=1e-12)
    coordinates, modal = modal_coordinates(body, pushed, 1e-7, 1), body.greens.modal
    of = [body.greens.port_index(STOPPER + name) for name in Division(8).names]
    moved, free_steps = coordinates @ modal.shapes[:, of], ~force.any(axis=1)
    seen = touches.stopper_parts.striker_displacement
    np.testing.assert_allclose(moved[free_steps[: len(moved)]], seen[: len(moved)][free_steps[: len(moved)]], atol=1e-8)
    off = modal_coordinates(body, 1.03 * pushed, 1e-7, 1) @ modal.shapes[:, of] - moved
    assert np.abs(off).max() > 1e-7  # momentum: 3 % more force moves it that much farther


@pytest.mark.slow
def test_a_tilted_stopper_is_met_on_one_flank_first(tmp_path: Path) -> None:
    """Openings rise by tan(tilt) (y cos - x sin) over the lowest point of the rim, 6 mm off the middle, y of the reed,
    opposite to that of the stopper's face, which looks down; arcs are met in their order, and a tilt of the other sign
    is the mirror image. Twice the tilt is a peak smaller by more than 3 %."""
    keys = 'arcs = 16\nlaw = { kind = "spring", stiffness = "20 N/um" }\n'
    scene = scene_of(tmp_path, DISC + keys + 'tilt = "0.1 deg"\n')
    gaps, lip = scene.geometry.stopper_gaps(), scene.geometry.stopper_lip()
    means = -math.tan(math.radians(0.1)) * lip.line()[..., 1].mean(axis=1)
    np.testing.assert_allclose(np.diff(gaps), np.diff(means), atol=1e-12)
    assert gaps.mean() - GAP == pytest.approx(math.tan(math.radians(0.1)) * 6e-3, rel=1e-6)
    results = {}
    for tilt in ("0", "0.1", "-0.1", "0.2"):
        scene = scene_of(tmp_path, DISC + keys + f'tilt = "{tilt} deg"\n')
        touches = struck(scene, 2e-7)
        assert touches.seat.energy.residual < 1e-9
        force = touches.stopper_parts.force
        first = np.where(force.any(axis=0), (force > 0).argmax(axis=0), 10**6)
        results[tilt] = (first, impact.measures.filtered_peak_force(touches.stopper, 5e-6), force.sum(axis=0))
    first = results["0.1"][0]
    assert int(first.argmin()) in (1, 2, 3)  # between the sides of the reed's -y and of the tip, which comes up first
    np.testing.assert_allclose(results["-0.1"][2], results["0.1"][2][::-1], atol=0.02 * results["0.1"][2].max())
    assert results["0.2"][1] < 0.97 * results["0.1"][1] < 0.97 * results["0"][1]


@pytest.mark.slow
def test_stress_of_a_plate_that_meets_its_stopper_in_arcs(tmp_path: Path) -> None:
    """Equal forces on all arcs bend it as one on the whole ring, its own face; what a march did to each arc is what
    its results say, and the run has a stress."""
    reed = REED.replace('deflection = "-1 mm"', 'velocity = "-1 m/s"')
    scene = scene_of(tmp_path, SPRING + 'arcs = 4\ntilt = "0.1 deg"\n', reed)
    accuracy = scene.accuracy.model_copy(update={"measures": ("impulse", "stress")})
    near = scene.contact.model_copy(update={"gap": 2e-5})
    scene = scene.model_copy(update={"accuracy": accuracy, "contact": near})
    striker, seat = striker_of(scene), impact.Body(impact.spring(stiffness=5e7))
    field = plate_field(scene.geometry, striker, Division())
    arcs = [striker.greens.port_index(STOPPER + name) for name in Division(4).names]
    bent = field.static[:, :, arcs].mean(axis=2)
    np.testing.assert_allclose(bent, field.static[:, :, 0], atol=1e-3 * np.abs(bent).max())
    run = marched(problem_of(scene, striker, seat), 2e-7, scene.run.duration)
    pushed, force = Forces.from_march(run).find_striker_forces(striker.greens), run.force[:, 1:]
    np.testing.assert_array_equal(pushed[:, arcs], -force)
    known = Forces.from_touches(scene.geometry, seat.greens, struck(scene, 2e-7))
    np.testing.assert_array_equal(pushed, known.find_striker_forces(striker.greens))
    assert np.ptp(force.sum(axis=0)) > 0.1 * force.sum(axis=0).max()
    summary = run_scene(scene, tmp_path / "out", pictures=False).summary
    assert summary["landing_peak_reed_stress_Pa"] > 0
    assert (summary["stopper_arcs"], summary["stopper_tilt_deg"]) == (4, pytest.approx(0.1))


MASS = 'kind = "rigid_mass"\nmass = "0.1 g"\nvelocity = "-1 m/s"\n'


@pytest.mark.parametrize(
    ("stopper", "reed", "step", "words"),
    [
        (SPRING + "arcs = 8\n", MASS, check_files, "stopper.arcs:.*'rigid_mass'"),
        (SPRING + 'tilt = "1 deg"\n', MASS, check_files, "stopper.tilt:.*'rigid_mass'"),
        (SPRING + 'tilt = "31 deg"\n', REED, check_files, "stopper.tilt: 31 deg.*30 deg"),
        (SPRING + 'arcs = 1\ntilt = "1 deg"\n', REED, check_files, "stopper.arcs: .*mean gap"),
        (SPRING + "arcs = 2100\nrings = 2\n", REED, check_files, "stopper.arcs: 2100 segments.*2 rings.*4096"),
        (of_file("annular_seat.msh") + "arcs = 64\n", REED, stopper_of, r"stopper\.arcs = 64: .*5\d elements .*fewer$"),
        (BROAD + "arcs = 8\n", REED, struck, r"stopper\.arcs:.*face.*0.*9 mm .*8 mm"),
        (of_file("conical_seat.step"), REED, check_files, r"stopper\.contact: .*not flat.* mm.*choose a flat face"),
    ],
)
def test_keys_and_faces_that_do_not_fit(
    tmp_path: Path, stopper: str, reed: str, step: Callable[[Scene], object], words: str
) -> None:
    """They are refused as the scene is read, or by a step after it; a flat face of a file is met."""
    with pytest.raises((SceneError, ModelError), match=words):
        step(scene_of(tmp_path, stopper, reed))
    check_files(scene_of(tmp_path, of_file("annular_seat.step")))


@pytest.mark.parametrize("radius", [0.2, 2.0])
def test_the_rise_of_a_face_is_its_sagitta(radius: float) -> None:
    """A cylinder's face rises by L^2/(8 R), however it lies in space."""
    x, y = np.meshgrid(np.linspace(-0.015, 0.015, 61), np.linspace(-0.005, 0.005, 3), indexing="ij")
    points = np.stack([x, y, radius - np.sqrt(radius**2 - x**2)], axis=-1).reshape(-1, 3)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    shape = Shape(points @ turn.T, np.arange(183).reshape(61, 3), {"struck": np.arange(61)}, 0.0)
    rise, _ = shape.rise("struck")
    assert rise == pytest.approx(0.03**2 / (8 * radius), rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("more", ["", 'tilt = "0.3 deg"\n'], ids=["flat", "tilted"])
def test_what_few_arcs_leave_is_in_the_bars_of_the_stopper_s_force(more: str, tmp_path: Path) -> None:
    """The arcs' share of the peak's bar holds what 8 arcs leave against 64, and is not much larger."""
    peak = "stopper_filtered_peak_force_N"
    few, many = (scene_of(tmp_path, f"{SPRING}arcs = {arcs}\n{more}") for arcs in (8, 64))
    touches, truth = struck(few, 4e-7), struck(many, 4e-7).stopper_force
    seat = Solved(impact.spring(stiffness=5e7), plane=True)
    budget = error_budget(ComputedRun(few, stated_method(few), seat, striker_of(few)), touches)
    off = abs(budget.values[peak] - stopper_values(truth, 4e-7, few.run.filter_width)[peak])
    assert 1e-3 * budget.values[peak] < off < SAFETY * budget.parts["stopper"][peak] < 4 * off


PARTS = "arcs = 24\nrings = 4\n"


@pytest.mark.slow
def test_rings_of_a_whole_stopper_are_compared_with_arcs(tmp_path: Path) -> None:
    """Its disc in two and in four rings, without arcs: the bar reaches what arcs make of a tip that comes first."""
    peak, seat = "stopper_filtered_peak_force_N", Solved(impact.spring(stiffness=5e7), plane=True)
    truth = struck(fine := scene_of(tmp_path, DISC + PARTS), 4e-7).stopper_force
    for rings in (2, 4):
        scene = scene_of(tmp_path, f"{DISC}arcs = 1\nrings = {rings}\n")
        budget = error_budget(ComputedRun(scene, stated_method(scene), seat, striker_of(scene)), struck(scene, 4e-7))
        off = abs(budget.values[peak] - stopper_values(truth, 4e-7, fine.run.filter_width)[peak])
        assert budget.unknown == ()
        assert 0.05 * budget.values[peak] < off < SAFETY * budget.parts["stopper"][peak] < 4 * off


@pytest.mark.slow
def test_a_stated_contact_on_another_face_is_in_the_bar_of_the_stopper_s_force(tmp_path: Path) -> None:
    """Stated for the seat, a disc of 1 mm meets the stopper's of 6 mm, too: the bar reaches what all of it makes, at
    once and in parts."""
    peak, seat = "stopper_filtered_peak_force_N", Solved(impact.spring(stiffness=5e7), plane=True)
    stated = scene_of(tmp_path, DISC, REED + 'contact_radius = "1 mm"\n')
    budget = error_budget(ComputedRun(stated, stated_method(stated), seat, striker_of(stated)), struck(stated, 4e-7))
    off = []
    for parts in ("", PARTS):
        truth = struck(own := scene_of(tmp_path, DISC + parts), 4e-7).stopper_force
        off.append(abs(budget.values[peak] - stopper_values(truth, 4e-7, own.run.filter_width)[peak]))
    assert 0.05 * budget.values[peak] < max(off) <= SAFETY * budget.parts["stopper"][peak] < 4 * max(off)


LEANING = REED.replace('deflection = "-1 mm"', 'mode = 1, velocity = "1.8 m/s"')


@pytest.mark.slow
def test_what_the_division_of_a_stopper_leaves_is_in_all_bars_of_its_landing(tmp_path: Path) -> None:
    """A flapper swings up and meets a flat stopper with its tip first: with all of it at once, in arcs, and in arcs
    and rings. Time, closing speed and impulse of the finest lie within the bars of both others, which become smaller
    with each, and are not those of the finest, by far."""
    seat, keys = Solved(impact.spring(stiffness=5e7), plane=True), ("time_s", "closing_speed_m_per_s", "impulse_Ns")
    budgets = []
    for parts in ("", "arcs = 16\n", PARTS):
        scene = scene_of(tmp_path, DISC.replace("6 mm", "3 mm") + parts, LEANING, duration="0.4 ms")
        stopper = scene.stopper.model_copy(update={"gap": 4e-4})  # type: ignore[union-attr]
        scene = scene.model_copy(update={"stopper": stopper})
        touches = struck(scene, 2e-7)
        budget = error_budget(ComputedRun(scene, stated_method(scene), seat, striker_of(scene)), touches)
        budgets.append({key: (budget.values[f"stopper 0 {key}"], budget.bar(f"stopper 0 {key}")) for key in keys})
    for key in keys:
        (whole, of_whole), (arcs, of_arcs), (finest, of_finest) = (each[key] for each in budgets)
        assert 4 * of_finest < abs(finest - whole) < of_whole
        assert abs(finest - arcs) < of_arcs
        assert of_finest < of_arcs < of_whole


def test_rounds_divide_a_stopper_that_the_file_leaves_whole(tmp_path: Path) -> None:
    """Rounds divide a whole face up to 192 parts, in reed and plan alike; what the file states stays."""
    ladder, scene = ladder_of("stopper.arcs"), scene_of(tmp_path, DISC)
    plan, seen = Plan(scene, stated_method(scene), ()), []
    while (method := ladder.refine(plan, 2.0)) != plan.method:  # type: ignore[union-attr]
        plan = replace(plan, method=method)
        assert method.reed.behind == plan.scene.geometry.place_behind_reed()
        assert plan.scene.stopper.parts == method.stopper  # type: ignore[union-attr]
        seen.append((method.value("stopper.arcs"), method.value("stopper.rings")))
    assert seen == [(16, 3), (32, 6)]
    assert stated_method(scene).with_values(scene.geometry, plan.method.values) == plan.method
    for keys, finer in {"arcs = 16\n": Division(16, 3), 'rings = 2\ntilt = "0.1 deg"\n': Division(64, 2)}.items():
        stated = scene_of(tmp_path, DISC + keys)
        assert ladder.refine(Plan(stated, stated_method(stated), ()), 2.0).stopper == finer  # type: ignore[union-attr]
    for keys in ("arcs = 1\n", "arcs = 16\nrings = 1\n"):
        stated = scene_of(tmp_path, DISC + keys)
        plan = Plan(stated, stated_method(stated), ())
        assert ladder.refine(plan, 2.0) == plan.method  # type: ignore[union-attr]
