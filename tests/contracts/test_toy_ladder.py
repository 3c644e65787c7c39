"""A new key is one ladder: no file knows this one, and the error budget, the plan and the trade ask for it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from impact.runs.variations import SAFETY, Budget, Terms
from seatfem.study.ladders.ladder import ComputedRun, Ladder, Neighbour, Option
from seatfem.study.ladders.table import DECLARED
from seatfem.study.method import STEP, RunMethod, stated_method
from seatfem.study.planning.deciding import Choices
from seatfem.study.prerun.context import PlanningContext
from seatfem.study.scene import Run, Scene
from seatfem.study.trade.rungs import Rungs
from tests.gallery import load_text
from tests.steps import error_budget, plan_scene, run_contacts, seat_of, striker_of

SCENE = """
seat = { kind = "spring", stiffness = "20 N/um" }
reed = { kind = "rigid_mass", mass = "5 g", velocity = "-1 m/s" }
run = { duration = "0.1 ms", filter_width = "4 us", time_step = "20 ns" }
accuracy = { target = "5 %", measures = ["impulse", "filtered_peak"] }
"""
SOFTER = 1.1
"""Neighbours of the toy have so much more g: the filtered peak of a spring is as its root."""
LEFT = {"coarse": 0.2, "fine": 0.001}
"""What its values leave in a plan, the coarse one beyond any target; the fine one costs ..."""
PRICE = 7.0  # ... s


@dataclass(frozen=True)
class Toy(Ladder):
    """A key that no run has."""

    def neighbours(self, run: ComputedRun) -> Terms | None:
        return ((run.with_greens("seat", run.seat.greens.scaled(SOFTER)),),)

    def extend(self, context: PlanningContext, option: Option) -> Iterable[Option]:
        for value, left in LEFT.items():
            errors = dict.fromkeys(context.sensitivity.base, left)
            yield replace(
                option, changes={**option.changes, self.key: errors}, seconds=option.seconds + PRICE * (value == "fine")
            )

    def beside(self, run: Run, reed: object, centre: RunMethod) -> Iterator[Neighbour]:
        yield Neighbour("toy", "toys", {STEP: 1e-8})


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return load_text(tmp_path, SCENE)


@pytest.fixture
def toy() -> Iterator[Toy]:
    ladder = Toy("toy.key", "model")
    DECLARED.append(ladder)
    yield ladder
    DECLARED.remove(ladder)


def budget(scene: Scene) -> Budget:
    method = stated_method(scene)
    seat, striker = seat_of(scene, method=method.seat), striker_of(scene)
    touches = run_contacts(scene, striker, seat.greens, 20e-9)
    return error_budget(scene, method, seat, striker, touches)


def test_the_error_budget_runs_its_neighbour(scene: Scene, toy: Toy) -> None:
    part, value = budget(scene).parts["model"]["filtered_peak"], budget(scene).values["filtered_peak"]
    assert part / value == pytest.approx(1 - SOFTER**-0.5, rel=0.03)
    DECLARED.remove(toy)
    assert budget(scene).parts["model"]["filtered_peak"] < part / 10
    DECLARED.append(toy)


def test_the_plan_chooses_its_value(scene: Scene, toy: Toy) -> None:
    """The fine one, although it costs more; its share is the model's, and the plan says so."""
    plan = plan_scene(scene)
    assert plan.meets_target
    assert plan.shares["model"]["landing_impulse"] == pytest.approx(LEFT["fine"])
    assert plan.error["landing_impulse"] >= SAFETY * LEFT["fine"]


def test_a_plan_pays_for_what_it_needs_alone(scene: Scene, toy: Toy) -> None:
    surrogate = scene.seat.surrogate(scene.run.duration, scene.reed.face)
    choices = Choices(PlanningContext.from_scene(scene, surrogate))
    fine, coarse = (choices.cheapest(target).seat for target in (0.05, 0.9))
    assert fine.seconds - coarse.seconds == pytest.approx(PRICE)


def test_a_key_of_the_march_is_paid_for_too(scene: Scene, toy: Toy) -> None:
    DECLARED[DECLARED.index(toy)] = of_march = replace(toy, of_seat=False)
    try:
        surrogate = scene.seat.surrogate(scene.run.duration, scene.reed.face)
        choices = Choices(PlanningContext.from_scene(scene, surrogate))
        steps = {option.method.time_step for option in choices.contacts}
        prices = sorted(option.seconds for option in choices.contacts)
        assert len(steps) == 1
        assert prices[1] - prices[0] == pytest.approx(PRICE)
    finally:
        DECLARED[DECLARED.index(of_march)] = toy


def test_the_trade_has_its_neighbour(scene: Scene, toy: Toy) -> None:
    (point,) = (point for point in Rungs(scene).points() if point.name == "toy")
    assert point.varied == "toys"
    assert "run.time_step" in point.settings
