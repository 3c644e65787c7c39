"""Error bars of the gas that passes a reed valve in each cycle."""

from __future__ import annotations

import math

import impact
from impact.gas.compressor import Compressor, gas_history
from impact.runs.budget import Values
from seatfem.study.impacts.gas import cycle_masses, gas_of
from seatfem.study.runs.left_in import left_in
from seatfem.study.runs.round import Round


def gas_bars(done: Round) -> dict[str, list[float | None]]:
    """Return for summary.json error_bar_KEY of each mass: what the step, with which the gas follows the reed, and the
    bodies leave in it; it knows nothing of the effective areas' own. Empty without gas."""
    scene = done.plan.scene
    if scene.gas is None:
        return {}
    drive = gas_of(scene)

    def look(stepper: impact.ContactStepper) -> Values:
        history = gas_history(drive, stepper.opening, stepper.prepared.dt)
        masses = cycle_masses(scene, history, of_other=isinstance(drive, Compressor))
        return {f"{key} {cycle}": mass for key, each in masses.items() for cycle, mass in enumerate(each)}

    bars: dict[str, list[float | None]] = {}
    for name, bar in left_in(done, look).items():
        bars.setdefault(f"error_bar_{name.partition(' ')[0]}", []).append(bar if math.isfinite(bar) else None)
    return bars
