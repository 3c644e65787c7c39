"""Costs of plates, gas, stress and life: stages that depend on no mesh of the seat and no march."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from seatfem.machine.rates import Machine
from seatfem.structures.estimates.costs import SeatModel
from seatfem.study.impacts.measures import STRIKER
from seatfem.study.scene import Scene

MODE_OF_PLATE: Final = 0.007  # s for each mode of a plate that strikes, with those of a coarser mesh
BUDGET_OF_PLATE: Final = (0.9, 0.012)  # s, and s for each mode: other bands, other divisions of its lip
BUDGET_OF_GAS: Final = 0.7  # s
GAS_BARS: Final = 0.6  # s
PLACES: Final = 2000  # of a plate at which its stress is looked for, each step and mode costing the rate of a stress
LIFE_OF_BEAM: Final = 0.2  # s
SITES: Final = 40  # the same of a seat, for each square root of its surface's elements
SHEETS_OF_PLATE: Final = 4  # pictures of curves more, with its motion
SHEETS_OF_LIFE: Final = 6
SHEETS_OF_STRESS: Final = 12  # histories, hot spots, and the frames of the wave


def further_seconds(
    scene: Scene, seat: SeatModel | None, steps: float, modes: float, contact: float, rates: Machine
) -> Mapping[str, float]:
    """Return the seconds by stage, as the run's stopwatch names them; those of shared stages come on top.

    Args:
        scene: what is asked.
        seat: its finite elements; ``None`` of closed forms.
        steps: of the run.
        modes: of the reed.
        contact: seconds of one march.
        rates: of this computer; what is stated in seconds is of the default rates.
    """
    slower, plate = rates.start / Machine.start, scene.reed.thin_plate is not None
    parts: dict[str, float] = {}
    pictures = 0
    if plate:
        parts[STRIKER] = slower * MODE_OF_PLATE * modes
        parts["error budget"] = slower * (BUDGET_OF_PLATE[0] + BUDGET_OF_PLATE[1] * modes)
        pictures += SHEETS_OF_PLATE
    if scene.gas is not None:
        parts["error budget"] = parts.get("error budget", 0.0) + slower * BUDGET_OF_GAS
        parts["gas bars"] = slower * GAS_BARS
    everywhere = PLACES * rates.stress * steps * modes if plate else slower * LIFE_OF_BEAM
    if scene.stress is not None and seat is not None:
        parts["seat stress"] = rates.stress * SITES * seat.sizes.surface**0.5 * steps * seat.poles
        pictures += SHEETS_OF_STRESS
    if plate and scene.needs_stress:
        parts["reed stress"] = everywhere / 2
    if scene.life is not None:
        parts["life"] = everywhere
        pictures += SHEETS_OF_LIFE
        if scene.life.curves is not None:
            parts["life curves"] = sum(scene.life.curves.runs) / 2 * (contact + everywhere / 2)
    parts["pictures"] = pictures * rates.sheet
    return parts
