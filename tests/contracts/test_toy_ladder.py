"""A new key is one ladder: no file knows this one, and the error budget, the rounds and the trade ask for it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from impact.runs.variations import Budget, Terms
from seatfem.study.ladders.ladder import ComputedRun, Ladder
from seatfem.study.ladders.table import LADDERS
from seatfem.study.method import STEP, RunMethod, stated_method
from seatfem.study.plan import Plan
from seatfem.study.runs.converge import LEAST, begin_method, mark, refine_plan
from seatfem.study.scene import Scene
from seatfem.study.trade.trade import around
from tests.gallery import load_text
from tests.steps import Limits, Stopwatch, begin_plan, error_budget, rounds, run_contacts, seat_of, silent, striker_of

SCENE = """
seat = { kind = "spring", stiffness = "20 N/um" }
reed = { kind = "rigid_mass", mass = "5 g", velocity = "-1 m/s" }
run = { duration = "0.1 ms", filter_width = "4 us", time_step = "20 ns" }
accuracy = { target = "5 %", measures = ["impulse", "filtered_peak"] }
"""
SOFTER = 1.1
"""Neighbours of the toy have so much more g: the filtered peak of a spring is as its root."""


@dataclass(frozen=True)
class Toy(Ladder):
    """A key that no run has."""

    def neighbours(self, run: ComputedRun) -> Terms:
        return ((run.with_greens("seat", run.seat.greens.scaled(SOFTER)),),)


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return load_text(tmp_path, SCENE)


@pytest.fixture
def toy() -> Iterator[Toy]:
    ladder = Toy("toy.key", "model")
    LADDERS.append(ladder)
    yield ladder
    LADDERS.remove(ladder)


def budget(scene: Scene) -> Budget:
    method = stated_method(scene)
    seat, striker = seat_of(scene, method=method.seat), striker_of(scene)
    touches = run_contacts(scene, striker, seat.greens, 20e-9)
    return error_budget(ComputedRun(scene, method, seat, striker), touches)


def test_the_error_budget_runs_its_neighbour(scene: Scene, toy: Toy) -> None:
    part, value = budget(scene).parts["model"]["filtered_peak"], budget(scene).values["filtered_peak"]
    assert part / value == pytest.approx(1 - SOFTER**-0.5, rel=0.03)
    LADDERS.remove(toy)
    assert budget(scene).parts["model"]["filtered_peak"] < part / 10
    LADDERS.append(toy)


@dataclass(frozen=True)
class RefinedToy(Toy):
    """A key whose finer value shows in the time step, which no error asks for here."""

    def refine(self, plan: Plan, factor: float) -> RunMethod:
        assert plan.method.time_step is not None
        return plan.method.replaced({STEP: plan.method.time_step / factor})


@pytest.mark.slow
@pytest.mark.parametrize("refined", [False, True])
def test_a_round_refines_it_or_names_it(scene: Scene, toy: Toy, tmp_path: Path, refined: bool) -> None:
    """It leaves 4.7 % of the peak, far more than any other key; and is named if it has no finer value."""
    LADDERS[LADDERS.index(toy)] = other = RefinedToy("toy.key", "model") if refined else toy
    try:
        *_, done = rounds(begin_plan(scene), tmp_path, Stopwatch(), silent, limits=Limits(1))
        factors = dict(mark(done).factors)
        plan, why = refine_plan(done)
    finally:
        LADDERS[LADDERS.index(other)] = toy
    if refined:
        assert set(factors) == {"toy.key"}
        assert plan is not None
        assert plan.method == done.plan.method.replaced({STEP: 20e-9 / factors["toy.key"]})
    else:
        assert (plan, factors) == (None, {})
        assert "(toy.key) leaves 7.9 %" in why
        assert why.endswith("of peak force, and it cannot be made smaller")


def test_the_trade_has_its_finer_value(scene: Scene, toy: Toy) -> None:
    start = begin_method(scene)
    plan = Plan(scene, start, ())
    assert [point for point in around(plan, start) if point.varied == "toy.key"] == []
    LADDERS[LADDERS.index(toy)] = other = RefinedToy("toy.key", "model")
    try:
        (point,) = (point for point in around(plan, start) if point.varied == "toy.key")
    finally:
        LADDERS[LADDERS.index(other)] = toy
    assert point.values[STEP] == pytest.approx(start.value(STEP) / LEAST)
