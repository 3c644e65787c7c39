"""One port in place of a lip's arcs, a beam in place of its plate: where they stand, and that each is what it says."""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import impact
from impact import measures
from seatfem.structures.patch import on_its_patch
from seatfem.structures.rings import OF_ONE, divided_less
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import record_of
from seatfem.study.impacts.validity import ONE_PORT, simpler_models
from seatfem.study.method import PORTS
from seatfem.study.runs.converge import refine_plan
from tests.as_stated import solved_striker
from tests.gallery import FLAPPER, load_text
from tests.steps import (
    Division,
    Limits,
    Lip,
    Plan,
    Round,
    Scene,
    Stopwatch,
    bed,
    begin_plan,
    rounds,
    silent,
    striker_of,
    values_of_record,
)

SCENE = f"""
seat = {{ kind = "annular", bore_radius = "5 mm", lip_width = "1 mm", lip_edge_radius = "0 mm", material = "steel", \
    model = "spring", mesh = {{ size = "2.5 mm", contact_size = "0.5 mm" }} }}
run = {{ duration = "60 us", filter_width = "5 us", time_step = "0.1 us" }}
accuracy = {{ target = "40 %", measures = ["impulse"] }}
[reed]
{FLAPPER}greens = {{ bandwidth = "40 kHz" }}
release = {{ velocity = "-2 m/s" }}
[contact]
gap = "1 um"
MORE
"""


def plan_of(folder: Path, more: str) -> Plan:
    return begin_plan(load_text(folder, SCENE.replace("MORE", more)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("one_port")


@cache
def first_round(folder: Path, ports: int = 1) -> Round:
    plan = plan_of(folder, f"ports = {ports}")
    *_, done = rounds(plan, folder, Stopwatch(), silent, limits=Limits(rounds=1))
    return done


@pytest.mark.slow
@pytest.mark.parametrize(("more", "ports"), [("", 1), ('tilt = "0.05 deg"', 16)])
def test_a_run_begins_with_one_contact_where_it_lands_flat(folder: Path, more: str, ports: int) -> None:
    plan = plan_of(folder, more)
    assert plan.method.ports == ports
    assert plan.is_open(PORTS)


@pytest.mark.slow
def test_the_bar_is_what_arcs_change(folder: Path) -> None:
    """The bar is the difference between one port and the whole seat over a half-space under 16 arcs."""
    done = first_round(folder)
    scene, method = done.plan.scene, done.plan.method
    whole, patch = done.seat.greens.modal, scene.seat.patch()
    lip = scene.geometry.segments()
    assert (lip.arcs, lip.rings) == (16, 3)
    many = on_its_patch(whole, lip, patch)
    reed = solved_striker(scene, method=replace(method.reed, lip=scene.geometry.on_the_reed(lip)), mesh_error=False)

    def impulse(striker: impact.Body, seat: impact.GreensFunction) -> float:
        return values_of_record(record_of(scene, problem_of(scene, striker, impact.Body(seat)), 2 * done.result.dt))[
            "impulse"
        ]

    arcs = impulse(striker_of(scene, greens=reed.greens), many)
    ones = [impulse(done.striker, seat) for seat in (divided_less(many, Division()), whole)]
    expected = OF_ONE * max(abs(arcs - one) for one in ones)
    assert expected > 0
    assert done.left.parts["lip"]["impulse"] == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
def test_rounds_end_where_one_port_leaves_too_much(folder: Path) -> None:
    """The file states it, and no other key undoes that."""
    done = first_round(folder)
    errors = {"landing_impulse": 0.4 * done.left.values["landing_impulse"]}
    budget = replace(done.left, parts={"lip": errors}, by_key={ONE_PORT: errors})
    plan, why = refine_plan(replace(done, left=budget))
    assert plan is None
    assert why == "single contact point instead of the lip leaves 60 % of impulse, and it cannot be made smaller"


STIFFNESS, DT, RADIUS, TILT = 2e8, 5e-8, 5.5e-3, math.radians(0.3)
LANDING = 'release = { velocity = "-1 m/s" }'
SIMPLE = (
    f'\nseat = {{ kind = "annular", bore_radius = "5 mm", lip_width = "1 mm", material = "steel" }}\n'
    f'contact = {{ gap = "1 um", tilt = "0.3 deg", ports = 8 }}\nrun = {{ duration = "0.4 ms" }}\n[reed]\n'
    f'{FLAPPER}greens = {{ bandwidth = "40 kHz" }}\nRELEASE\n'
)


def simple_scene(folder: Path, release: str = LANDING, more: str = "") -> Scene:
    return load_text(folder, SIMPLE.replace("RELEASE", release) + more)


@pytest.mark.slow
def test_one_port_is_the_plate_struck_by_the_whole_lip(tmp_path: Path) -> None:
    """One port is the plate's one ring on a spring over the mean gap; a beam is the only other model."""
    scene = simple_scene(tmp_path)
    models = simpler_models(scene, striker_of(scene), bed(Division(8), STIFFNESS), DT)
    assert list(models) == ["one_port", "beam"]
    ring = scene.reed.solved(replace(scene.reed.stated(), lip=Lip(*scene.seat.lip_face.ring))).greens
    gap = 1e-6 + (RADIUS + scene.seat.lip_face.ring[1] / 2) * math.tan(TILT)  # the rim is lowest
    body = scene.reed.body(ring)
    problem = impact.ContactProblem(body, impact.Body(impact.spring(stiffness=STIFFNESS)), gap=gap)
    expected = impact.solve(problem, dt=DT, duration=scene.run.duration)
    result = models["one_port"].seat
    assert result.gap[0] == pytest.approx(gap, rel=1e-6)
    assert measures.impulse(expected) > 0
    # what the modes left out, 1e-6 of the compliance, relaxes at eight rates here and at one there
    assert measures.impulse(result) == pytest.approx(measures.impulse(expected), rel=2e-3)
    assert measures.filtered_peak_force(result) == pytest.approx(measures.filtered_peak_force(expected), rel=2e-3)


def test_the_beam_has_the_plates_widths_and_starts_as_it_does(tmp_path: Path) -> None:
    scene = simple_scene(tmp_path)
    (beam,), outline = scene.reed.as_beams(striker_of(scene).greens), scene.reed.geometry()
    greens = beam.greens.modal
    centre, x = 15e-3 + math.sqrt(16e-3**2 - 6e-3**2) / 2, np.linspace(0.0, 15e-3, 20_001)
    width = np.interp(x, [0.0, 2e-3], [8e-3, 6e-3])
    at = np.linspace(15e-3, centre, 20_001)
    on_the_paddle = 2 * np.sqrt(8e-3**2 - (at - centre) ** 2)
    rigidity = 206e9 * 0.3e-3**3 / 12
    compliance = (
        np.trapezoid((centre - x) ** 2 / width, x) + np.trapezoid((centre - at) ** 2 / on_the_paddle, at)
    ) / rigidity
    assert greens.static_compliance()[0, 0] == pytest.approx(compliance, rel=1e-3)  # chords of a 64th
    assert greens.shapes[:, 0] @ beam.state.velocity == pytest.approx(-1.0, rel=1e-9)
    assert np.flatnonzero(beam.state.velocity).tolist() == [0]
    modes = scene.reed.solved(scene.reed.stated()).plate.modes
    assert greens.frequencies_hz[0] == pytest.approx(modes.frequencies_hz[0], rel=0.01)
    assert outline.centre[0] == pytest.approx(centre, rel=1e-12)


@pytest.mark.parametrize(
    ("release", "more"),
    [
        ('release = { deflection = "0.1 mm" }', ""),
        (LANDING + '\npressure = "1 bar"', ""),
        (LANDING, '[[load]]\nforce = "-1 N"\n'),
        (LANDING, '[stopper]\nkind = "spring"\nstiffness = "5 N/um"\ngap = "1 mm"\n'),
    ],
    ids=["deflected", "pressed", "loaded", "stopped"],
)
def test_no_beam_where_it_would_not_move_alike(release: str, more: str, tmp_path: Path) -> None:
    scene = simple_scene(tmp_path, release, more)
    assert list(simpler_models(scene, striker_of(scene), bed(Division(8), STIFFNESS), DT)) == ["one_port"]
