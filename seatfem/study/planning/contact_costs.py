"""What the contact costs: steps, poles, and the runs behind the error bars."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from impact.exact.damped_rods import BareFixedRod, DampedFixedRod
from impact.greens.base import GreensFunction
from seatfem.machine.rates import Machine
from seatfem.structures.estimates.costs import SeatModel, highest_pole
from seatfem.study.impacts.contact import striker_of, time_step
from seatfem.study.scene import Scene, method_of

BUDGET_RUNS: Final = 5.0  # of an elastic seat, with a step twice as long
CLOSED_RUNS: Final = 2.0  # of a closed form, which has no error of mesh and reduction
COARSE_STRESS: Final = 0.4  # of the search for the stress, where only its size is asked for
ARRAYS: Final = 44  # histories that live at once
SAVED: Final = 22  # histories written to the file
WEIGHTS: Final = 30  # poles that take as long as exact step weights


@dataclass(frozen=True)
class ContactModel:
    """A march in numbers.

    Attributes:
        steps: of the run.
        poles, reed: of seat and reed.
        coarse_poles: of the seat at a step twice as long.
        runs: behind the error bars.
    """

    steps: float
    poles: float
    reed: float
    coarse_poles: float
    runs: float

    @property
    def memory(self) -> float:
        """Bytes of the histories."""
        return 8 * ARRAYS * self.steps


def contact_model(scene: Scene, seat: SeatModel | None) -> ContactModel:
    """Of a filled scene; ``seat``: its finite elements, ``None`` for a closed form."""
    rod = scene.seat.rod() if seat is None else None
    dt = scene.run.time_step or _step(scene, striker_of(scene).greens, seat, rod)
    steps = max(1.0, scene.run.duration / dt)
    modes = float(scene.reed.beam_modes or 1)
    if seat is not None:
        return ContactModel(steps, seat.poles, modes, seat.poles, BUDGET_RUNS)
    if rod is None:
        return ContactModel(steps, 0.0, modes, 0.0, CLOSED_RUNS)
    bare = BareFixedRod(rod.impedance, rod.transit, rod.damping_ratio)
    poles, coarse = _rod_poles(rod, dt, steps), _rod_poles(bare, 2 * dt, steps / 2)
    return ContactModel(steps, poles, modes, coarse, CLOSED_RUNS)


def contact_seconds(model: ContactModel, rates: Machine) -> Mapping[str, float]:
    """[s] by stage."""
    stress = rates.stress * model.reed if model.reed > 1 else 0.0

    def run(poles: float) -> float:
        return rates.step + rates.pole * (poles + model.reed)

    n = model.steps
    return {
        "contact": rates.compiled + n * run(model.poles),
        "spring baseline": n * run(0.0),
        "reed stress": (2 * rates.compiled if stress else 0.0) + 2 * n * stress,
        "error budget": model.runs / 2 * n * (run(model.coarse_poles) + COARSE_STRESS * stress),
        "files": SAVED * n * rates.value,
    }


def _step(scene: Scene, reed: GreensFunction, seat: SeatModel | None, rod: GreensFunction | None) -> float:
    dt = time_step(scene, reed, reed if rod is None else rod)
    if seat is None:
        return dt
    method = method_of(scene)
    assert method.bandwidth is not None
    return min(dt, 1 / (4 * 2 * math.pi * highest_pole(seat, method.tolerance) * method.bandwidth))


def _rod_poles(rod: DampedFixedRod, dt: float, steps: float) -> float:
    """Poles that are marched, or as many as take the time of exact step weights."""
    return rod.lasting_modes(dt) if rod.marches(dt, steps) else WEIGHTS * math.log2(steps + 2)
