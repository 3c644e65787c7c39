"""What this computer can do: plans that would take too much are made coarser, and that is said."""

from __future__ import annotations

from typing import Final

from impact.runs.budget import safety
from seatfem.machine.memory import available_memory
from seatfem.machine.rates import Machine
from seatfem.study.planning.costs import predict_cost
from seatfem.study.planning.deciding import Choices, Decision
from seatfem.study.planning.plan import Cost, Plan, PlannedLevel
from seatfem.study.scene import Scene

LONGEST: Final = 600.0  # a seat that takes longer [s] is not chosen, only obeyed
MEMORY: Final = 0.8  # part of the available memory that is used
OF_THE_SEAT: Final = ("mesh", "assembly", "reduction", "mesh error")
"""Stages that a seat computed before does without."""


def cost_of(scene: Scene, level: PlannedLevel, machine: Machine | None, *, kept: bool = False) -> Cost:
    """Predicted cost of a filled scene; of one whose seat is ``kept``, without the seat's stages."""
    cost = predict_cost(scene, level, machine)
    if not kept:
        return cost
    parts = {stage: seconds for stage, seconds in cost.parts.items() if stage not in OF_THE_SEAT}
    return Cost(sum(parts.values()), cost.memory, parts)


def within_means(choices: Choices, wanted: Decision, target: float) -> Decision:
    """``wanted`` if memory and time allow it; else the cheapest for the target, or close to it, that they do."""
    memory = MEMORY * available_memory()
    if wanted.seat.seconds <= LONGEST and wanted.seat.memory <= memory:
        return wanted
    return choices.cheapest(target, LONGEST, memory)


def notes_on(plan: Plan, wanted: Decision, decision: Decision, machine: Machine | None) -> tuple[str, ...]:
    """Targets that are out of reach, and why."""
    found = []
    target = plan.scene.accuracy.target
    if wanted.seat != decision.seat:
        cost = cost_of(wanted.scene(), wanted.level, machine)
        meets = all(error <= target for error in wanted.error.values())
        aim = "accuracy.target" if meets else "to come as close as can be to accuracy.target"
        found.append(
            f"{aim} = {target:g} would take {cost.seconds:.2g} s and {cost.memory / 1e9:.2g} GB; this is what "
            f"{LONGEST:g} s and {MEMORY:.0%} of the available memory allow. State seat.mesh.size to insist"
        )
    missed = {name: error for name, error in plan.error.items() if error > target}
    if missed:
        words = ", ".join(f"{name} {100 * error:.2g} %" for name, error in missed.items())
        found.append(f"accuracy.target = {target:g} will be missed, predicted: {words}")
    surrogate = decision.seen.surrogate
    if surrogate.patch is None and not surrogate.exact:
        found.append(f"{surrogate.words}: a rough plan; the run measures what is left")
    if given := plan.scene.seat.given_mesh:
        found.append(
            f"what the mesh in {given} is off by is not known, and in no error bar: a finer mesh of the same seat tells"
        )
    if not decision.seen.sensitivity.bench.window.touches:
        found.append("no contact at a first look: the measures are zero unless run.duration is longer")
    elif surrogate.patch is not None:
        found.extend(_hardly_counts(decision, target))
    return tuple(found)


def _hardly_counts(decision: Decision, target: float) -> tuple[str, ...]:
    """Where a seat need not be computed at all."""
    seen = decision.seen
    guessed = {name: safety(name) * seen.sensitivity.guessed[name] for name in seen.scene.accuracy.measures}
    if max(guessed.values(), default=0.0) > target:
        return ()
    name = max(guessed, key=lambda measure: guessed[measure])
    return (
        f"a spring (seat.kind = 'spring') with a stiffness guessed within a factor of two has an error bar of "
        f"{100 * guessed[name]:.2g} % in {name}: for this target the seat hardly counts",
    )
