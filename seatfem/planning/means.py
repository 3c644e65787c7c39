"""What this computer can do: plans that would take too much are made coarser, and that is said."""

from __future__ import annotations

import math
from typing import Final

from seatfem.planning.costs import predict_cost
from seatfem.planning.deciding import Choices, Decision
from seatfem.planning.machine import Machine
from seatfem.planning.plan import Cost, Plan
from seatfem.runs.budget import safety
from seatfem.scene import Scene
from seatfem.seats.memory_need import available_memory

LONGEST: Final = 600.0  # a seat that takes longer [s] is not chosen, only obeyed
MEMORY: Final = 0.8  # part of the available memory that is used
OF_THE_SEAT: Final = ("mesh", "assembly", "reduction", "mesh error")
"""Stages that a seat computed before does without."""


def cost_of(scene: Scene, decision: Decision, machine: Machine | None, *, kept: bool = False) -> Cost:
    """Predicted cost of a filled scene; of one whose seat is ``kept``, without the seat's stages."""
    cost = predict_cost(scene, decision.level, machine)
    if not kept:
        return cost
    parts = {stage: seconds for stage, seconds in cost.parts.items() if stage not in OF_THE_SEAT}
    return Cost(sum(parts.values()), cost.memory, parts)


def within_means(choices: Choices, target: float) -> Decision:
    """The cheapest that meets the target, among the seats that memory and time allow."""
    there = available_memory()
    return choices.cheapest(target, LONGEST, math.inf if there is None else MEMORY * there)


def notes_on(plan: Plan, wanted: Decision, decision: Decision, machine: Machine | None) -> tuple[str, ...]:
    """Targets that are out of reach, and why."""
    found = []
    target = plan.scene.accuracy.target
    if wanted.seat != decision.seat:
        cost = cost_of(wanted.scene(), wanted, machine)
        found.append(
            f"accuracy.target = {target:g} would take {cost.seconds:.2g} s and {cost.memory / 1e9:.2g} GB; this is the "
            f"finest mesh within {LONGEST:g} s and {MEMORY:.0%} of the available memory. State seat.mesh.size to insist"
        )
    missed = {name: error for name, error in plan.error.items() if error > target}
    if missed:
        words = ", ".join(f"{name} {100 * error:.2g} %" for name, error in missed.items())
        found.append(f"accuracy.target = {target:g} will be missed, predicted: {words}")
    surrogate = decision.seen.surrogate
    if surrogate.patch is None and not surrogate.exact:
        found.append(f"{surrogate.words}: a rough plan; the run measures what is left")
    guessed = {name: safety(name) * decision.seen.sensitivity.guessed[name] for name in plan.error}
    if surrogate.patch is not None and max(guessed.values(), default=0.0) <= target:
        name = max(guessed, key=lambda measure: guessed[measure])
        found.append(
            f"a spring (seat.kind = 'spring') with a stiffness guessed within a factor of two has an error bar of "
            f"{100 * guessed[name]:.2g} % in {name}: for this target the seat hardly counts"
        )
    window = decision.seen.sensitivity.bench.window
    if not window.touches:
        found.append("no contact at a first look: the measures are zero unless run.duration is longer")
    return tuple(found)
