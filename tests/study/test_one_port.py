"""One port in place of a lip's arcs: only where the file states it, and what its bar is made of."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import impact
from seatfem.structures.patch import on_its_patch
from seatfem.structures.rings import OF_ONE, Division, divided_less
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.validity import ONE_PORT
from seatfem.study.method import PORTS
from seatfem.study.runs.converge import refine_plan
from tests.as_stated import solved_striker, striker_of, values_of_problem
from tests.gallery import FLAPPER, load_text
from tests.steps import Limits, Plan, Round, Stopwatch, begin_plan, rounds, silent

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
        problem = problem_of(scene, striker, impact.Body(seat))
        return values_of_problem(scene, problem, 2 * done.result.dt)["impulse"]

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
