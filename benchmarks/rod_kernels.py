"""A damped rod marched by poles or by exact step weights: where `damped_rods.BareFixedRod` changes over."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from table import Table, best, publish

import impact
from impact import ContactProblem
from impact.exact.damped_rods import BareFixedRod, DampedFixedRod
from impact.greens.base import StepKernel
from impact.greens.stated import step_weights
from impact.march.motion import mean_displacement

STEPS = (12_000, 48_000, 200_000)
POLES = (250, 500, 1000, 2000)


def main() -> None:
    """Both ways for runs of several lengths, and the number of poles at which they would take the same time."""
    rows = []
    for steps in STEPS:
        for what, run in (("the force and the seat's motion", _bare), ("the same with all energies", _full)):
            by_weights = _per_step(_ByWeights, run, max(POLES), steps)
            by_poles = [_per_step(_ByPoles, run, count, steps) for count in POLES]
            even = np.interp(by_weights, by_poles, POLES)
            shown = (*by_poles, by_weights)
            rows.append((f"{steps:,}", what, *(f"{1e9 * t:.0f}" for t in shown), f"{even:.0f}"))
    notes = (
        "Nanoseconds per step of a mass on a fixed rod. A body known by weights has its energy as work only; where no",
        f"energies are asked for, poles are marched up to {BareFixedRod.most_poles[0]}.",
    )
    poles = (f"{count} poles" for count in POLES)
    columns = ("steps", "what is computed", *poles, "step weights", "equal at poles")
    publish("rod_kernels", Table("Damped rods: poles or step weights", notes, columns, tuple(rows)))


class _ByPoles(DampedFixedRod):
    """Always by poles."""

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        return StepKernel(self.modes(self.lasting_modes(dt)), None, "poles")


class _ByWeights(DampedFixedRod):
    """Always by step weights."""

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        return StepKernel(None, step_weights(self, dt, n_steps), "weights")


def _per_step(
    kind: type[DampedFixedRod], run: Callable[[ContactProblem, float, int], object], poles: int, n: int
) -> float:
    """[s] with a step that ``poles`` modes outlive."""
    rod = kind(impedance=2.0, transit=1e-6, damping_ratio=0.1)
    dt = 1e-12 * rod.lasting_modes(1e-12) / poles
    problem = ContactProblem(impact.rigid_mass(mass=1e-6, velocity=-1.0), impact.Body(rod))
    run(problem, dt, 100)  # compiles
    return best(lambda: run(problem, dt, n), 3) / n


def _bare(problem: ContactProblem, dt: float, n: int) -> None:
    prepared = impact.prepare(problem, dt, n * dt)
    stepper = impact.ContactStepper(prepared)
    stepper.advance(n)
    mean_displacement(prepared.bodies[1], -stepper.force.T, np.ones(1))


def _full(problem: ContactProblem, dt: float, n: int) -> None:
    impact.solve(problem, dt=dt, duration=n * dt)


if __name__ == "__main__":
    main()
