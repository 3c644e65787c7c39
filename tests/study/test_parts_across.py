"""Parts across the arcs of a lip: openings of their own, in the error bars, made finer by rounds."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.runs.variations import SAFETY
from seatfem.structures.rings import Division, arc_rings_to_compare, ring_borders
from seatfem.study.impacts import contact
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import RunError, check_length
from seatfem.study.ladders.ladder import ComputedRun
from seatfem.study.ladders.patch import of_rings_across
from seatfem.study.method import PORTS, RINGS, stated_method
from seatfem.study.runs.converge import refine_plan
from tests.as_stated import seat_of, striker_of, values_of_problem
from tests.gallery import load_text
from tests.steps import Round, Scene, Stopwatch, begin_plan, rounds, silent

SHEET = """
seat = { kind = "annular", bore_radius = "3.5 mm", lip_width = "0.8 mm", lip_edge_radius = "0 mm", model = "spring", \
    material = { young = "20600 GPa", poisson = 0.3, density = "7800 kg/m^3" } }
reed = { kind = "sheet", outline = [["0 mm", "-6 mm"], ["28 mm", "-6 mm"], ["28 mm", "6 mm"], ["0 mm", "6 mm"]], \
    clamped = [["0 mm", "-6 mm"], ["0 mm", "6 mm"]], contact_at = ["21 mm", "0 mm"], thickness = "0.35 mm", \
    material = { young = "206 GPa", poisson = 0.3, density = "7800 kg/m^3" }, damping_ratio = 0.005, \
    greens = { bandwidth = "60 kHz" }, release = { mode = 1, velocity = "-1.5 m/s" } }
run = { duration = "0.15 ms", filter_width = "5 us", time_step = "250 ns" }
accuracy = { target = "3 %", measures = ["impulse"] }
[contact]
gap = "1 um"
tilt = "0.15 deg"
law = { kind = "spring", stiffness = "30 N/um" }
CONTACT
"""
"""A sheet that rolls onto a narrow lip, as stiff as can be: across it the sheet lands on an edge."""
ONE, THREE, SIX = Division(16, 1), Division(16, 3), Division(16, 6)


def scene_of(folder: Path, keys: str = "") -> Scene:
    return load_text(folder, SHEET.replace("CONTACT", keys))


def in_parts(folder: Path, division: Division) -> Scene:
    return scene_of(folder, f"ports = {division.arcs}\nrings = {division.rings}\n")


def landed(scene: Scene) -> tuple[impact.ContactProblem, float]:
    """Return the problem of the landing, and its impulse [N s]."""
    problem = problem_of(scene, striker_of(scene), impact.Body(seat_of(scene, mesh_error=False).greens))
    return problem, values_of_problem(scene, problem, 250e-9)["impulse"]


def test_parts_across_open_by_heights_of_their_own(tmp_path: Path) -> None:
    """Part k lies between shares of the area of the annulus; its centre line at the mean of its borders' radii; the
    outer rim is the lowest, however many parts there are."""
    scene = in_parts(tmp_path, Division(32, 3))
    gaps = scene.geometry.gaps(Division(32, 3)).reshape(32, 3)
    borders = np.sqrt(3.5e-3**2 + ring_borders(3) * (4.3e-3**2 - 3.5e-3**2))
    radii = (borders[:-1] + borders[1:]) / 2
    angles = 2 * np.pi * (np.arange(32) + 0.5) / 32
    heights = math.tan(math.radians(0.15)) * np.sinc(1 / 32) * np.sin(angles)[:, None] * radii
    expected = 1e-6 + heights + math.tan(math.radians(0.15)) * 4.3e-3
    np.testing.assert_allclose(gaps, expected, atol=2e-10)  # 128 points of each arc
    assert gaps.min() > 1e-6


@pytest.mark.slow
def test_the_bar_of_one_part_across_holds_what_more_of_them_find(tmp_path: Path) -> None:
    """Six parts across are 1.3 % above one: a part of the target alone. The term for three is a tenth of that for one,
    and holds what nine find."""
    landings = {division: landed(in_parts(tmp_path, division)) for division in (ONE, THREE, SIX)}
    impulses = {division: impulse for division, (_, impulse) in landings.items()}
    assert impulses[SIX] - impulses[ONE] > 0.01 * impulses[ONE]
    bars = {}
    for division in (ONE, THREE):
        scene = in_parts(tmp_path, division)
        solved = seat_of(scene, mesh_error=False)
        terms = of_rings_across(ComputedRun(scene, stated_method(scene), solved, landings[division][0]))
        ((variation,),) = terms
        assert len(variation.problem.contacts) == 16 * arc_rings_to_compare(division.rings)[0]
        one, other = (values_of_problem(scene, each, 250e-9) for each in (variation.against, variation.problem))
        bars[division] = SAFETY * variation.weight * abs(other["impulse"] - one["impulse"])
        assert abs(impulses[SIX] - impulses[division]) < bars[division]
    assert bars[THREE] < 0.2 * bars[ONE]


def last_of_each(scene: Scene, folder: Path) -> list[Round]:
    """Return the rounds of a scene, each as it was yielded last."""
    every = rounds(begin_plan(scene), folder, Stopwatch(), silent)
    return list({done.number: done for done in every}.values())


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> list[Round]:
    """Run the scene that states no parts."""
    folder = tmp_path_factory.mktemp("parts")
    return last_of_each(scene_of(folder), folder)


@pytest.mark.slow
def test_rounds_divide_across(done: list[Round]) -> None:
    first, second = done
    assert first.plan.method.seat.division == ONE
    assert SAFETY * first.left.by_key[RINGS]["landing_impulse"] > 0.03 * first.left.values["landing_impulse"]
    assert second.plan.method.seat.division == second.plan.method.reed.lip.division == THREE
    choice = second.plan.choice(RINGS)
    assert (choice.value, choice.given) == ("3", False)
    assert choice.reason.endswith(" % of impulse, measured")
    assert second.met


@pytest.mark.slow
@pytest.mark.parametrize(("key", "divided"), [(RINGS, THREE), (PORTS, Division(32, 1))])
def test_a_round_divides_by_what_leaves_most(done: list[Round], key: str, divided: Division) -> None:
    first = done[0]
    errors = {"landing_impulse": 0.05 * first.left.values["landing_impulse"]}
    budget = replace(first.left, parts={"patch": errors}, by_key={key: errors})
    plan, why = refine_plan(replace(first, left=budget))
    assert plan is not None, why
    assert plan.method.seat.division == divided


def test_more_contacts_than_memory_or_time_allow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = in_parts(tmp_path, Division(256, 4))
    check_length(scene, 100e-9)
    monkeypatch.setattr(contact, "available_memory", lambda: 1024 * 1000.0 * contact.CONTACT_BYTES * contact.LONG_BYTES)
    words = r"1024 contacts .*1.5e\+03 steps: .*0.0088 GB .*0.0059 GB .*contact.ports"
    with pytest.raises(RunError, match=words):
        check_length(scene, 100e-9)
    monkeypatch.setattr(contact, "available_memory", lambda: 1e15)
    with pytest.raises(RunError, match=r"and 26 h, .* 24 h are taken"):
        check_length(scene, 1e-11)
