"""One port in place of a lip's arcs: where a plan chooses it, what its bar is made of, and how a round undoes it."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import impact
from seatfem.structures.estimates.surrogate import on_its_patch
from seatfem.structures.rings import Division, divided_less
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import record_of
from seatfem.study.impacts.validity import ONE_PORT
from seatfem.study.method import PORTS, chooses_one_port
from seatfem.study.safety import LIP_SHARE, ONE_PORT_BAR
from tests.as_stated import solved_striker, striker_of
from tests.gallery import FLAPPER, load_text
from tests.steps import Limits, Plan, Round, Stopwatch, plan_scene, refine, rounds, silent, values_of_record

SCENE = f"""
seat = {{ kind = "annular", bore_radius = "5 mm", lip_width = "1 mm", lip_edge_radius = "0 mm", material = "steel", \
    model = "spring", mesh = {{ size = "2.5 mm", contact_size = "0.5 mm" }} }}
run = {{ duration = "60 us", filter_width = "5 us", time_step = "0.1 us" }}
accuracy = {{ target = "TARGET %", measures = ["impulse"ALSO] }}
[reed]
{FLAPPER}greens = {{ bandwidth = "40 kHz" }}
release = {{ velocity = "-2 m/s" }}
[contact]
gap = "1 um"
MORE
"""


@cache
def plan_of(folder: Path, more: str = "", target: float = 40, also: str = "") -> Plan:
    text = SCENE.replace("MORE", more).replace("TARGET", f"{target:g}").replace("ALSO", also)
    return plan_scene(load_text(folder, text))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("one_port")


@cache
def first_round(folder: Path) -> Round:
    *_, done = rounds(plan_of(folder), folder, Stopwatch(), silent, limits=Limits(rounds=1))
    return done


@pytest.mark.slow
def test_a_flat_landing_whose_total_force_is_asked_for_goes_through_one_port(folder: Path) -> None:
    plan = plan_of(folder)
    assert plan.method.ports == 1
    assert chooses_one_port(plan.scene.contact, plan.method)
    assert plan.is_open(PORTS)
    assert "a single contact point instead of lip segments: " in plan.choice(PORTS).reason
    assert 0 < 1.5 * plan.shares["lip"]["impulse"] <= LIP_SHARE * plan.scene.accuracy.target


@pytest.mark.slow
@pytest.mark.parametrize(
    ("more", "target", "also", "why"),
    [
        ('tilt = "0.05 deg"', 40, "", "tilt"),
        ("", 40, ', "line_impulse"', "line_impulse.*segments"),
        ("", 0.5, "", "single contact"),
    ],
)
def test_what_one_port_cannot_tell_or_not_so_well_takes_arcs(folder, more, target, also, why):
    plan = plan_of(folder, more, target, also)
    assert (plan.method.ports or 0) >= 16
    assert re.search(why, plan.choice(PORTS).reason)
    assert "lip" not in plan.shares


@pytest.mark.slow
def test_stated_ports_are_obeyed(folder: Path) -> None:
    for ports in (1, 8):
        plan = plan_of(folder, f"ports = {ports}")
        assert plan.method.ports == ports
        assert not plan.is_open(PORTS)
        assert ("lip" in plan.shares) == (ports == 1)


@pytest.mark.slow
def test_the_bar_is_what_arcs_change(folder: Path) -> None:
    """Computed here from the bodies: the seat's answer as a whole over a half-space under 16 arcs, against one port."""
    done = first_round(folder)
    scene, method = done.plan.scene, done.plan.method
    whole, patch = done.seat.greens.modal, scene.seat.surrogate(scene.run.duration, scene.reed.face).patch
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
    expected = ONE_PORT_BAR * max(abs(arcs - one) for one in ones)
    planned = done.plan.shares["lip"]["impulse"] * done.left.values["impulse"]
    assert expected > 0
    assert done.left.parts["lip"]["impulse"] == pytest.approx(max(expected, planned), rel=1e-6)


@pytest.mark.slow
def test_the_bar_holds_against_arcs(folder: Path) -> None:
    done = first_round(folder)
    scene = plan_of(folder, "ports = 64").scene
    *_, arcs = rounds(plan_scene(scene), folder, Stopwatch(), silent, limits=Limits(rounds=1))
    off = abs(arcs.left.values["impulse"] - done.left.values["impulse"])
    assert 0 < off <= 1.5 * (done.left.parts["lip"]["impulse"] + done.left.parts["patch"]["impulse"])


@pytest.mark.slow
@pytest.mark.parametrize("source", ["lip", "patch"])
def test_a_round_undoes_it(folder: Path, source: str) -> None:
    plan = plan_of(folder)
    finer = refine(plan, source)
    assert (finer.method.ports or 0) >= 16
    assert finer.without == (ONE_PORT,)
    assert "lip" not in finer.shares


@pytest.mark.slow
def test_rounds_take_arcs_where_one_port_leaves_too_much(folder: Path) -> None:
    """The target of the same plan made tighter: one port is what is made finer."""
    plan = plan_of(folder)
    accuracy = plan.scene.accuracy.model_copy(update={"target": 0.8 * first_round(folder).left.relative("impulse")})
    plan = replace(plan, scene=plan.scene.model_copy(update={"accuracy": accuracy}))
    *_, last = rounds(plan, folder, Stopwatch(), silent, limits=Limits(rounds=2))
    assert (last.plan.method.ports or 0) >= 16
