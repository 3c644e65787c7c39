"""What an impact run leaves: data only."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from impact.advice import Advice
from impact.after.energy import EnergyLedger
from impact.brief import brief, cut, some
from impact.greens.base import Array


@dataclass(frozen=True)
class ImpactResult:
    """Time histories of one contact, all (n + 1,), or of p contacts, (n + 1, p), SI.

    ``force[m]`` is constant over the step that ends at ``time[m]`` (``force[0]`` = 0), so that the impulse is exactly
    ``sum(force) * dt``. Displacements are along the normal from target to striker; ``gap`` > 0 is open.

    Attributes:
        time: uniform from 0 [s].
        force: contact force >= 0 [N].
        gap: opening [m].
        striker_displacement, target_displacement: of the contact point [m].
        energy: the ledger [J].
        dt: step [s].
        striker_mass, target_mass: of rigid translation, ``inf`` when held [kg].
        striker_velocity, target_velocity: initial translation [m/s].
        engine: what remembered the past, in words.
        advice: warnings, empty when all is well.
    """

    time: Array
    force: Array
    gap: Array
    striker_displacement: Array
    target_displacement: Array
    energy: EnergyLedger
    dt: float
    striker_mass: float
    target_mass: float
    striker_velocity: float
    target_velocity: float
    engine: str
    advice: tuple[Advice, ...] = ()

    __repr__ = brief

    def __str__(self) -> str:
        contacts = 1 if self.force.ndim == 1 else self.force.shape[1]
        steps, pushed = len(self.time) - 1, float(np.sum(self.force[1:])) * self.dt
        return (
            f"ImpactResult, {contacts} contact{'s'[: contacts > 1]}, {steps} steps of {self.dt:g} s\n"
            f"  largest force {float(self.force.max()):.6g} N, impulse {pushed:.6g} N s, "
            f"energy residual {self.energy.residual:.2g}\n  {cut(self.engine, 160)}\n  "
            + (some([advice.name for advice in self.advice]) or "no advice")
        )


def as_one(result: ImpactResult, shares: Array) -> ImpactResult:
    """Several contacts of one face, seen as one: the sum of the forces, the mean of the displacements and gaps.

    Args:
        result: of p contacts that one port of the striker presses.
        shares: (p,) of the face's area, which sum to 1.
    """
    if result.force.ndim == 1:
        return result
    means = {name: getattr(result, name) @ shares for name in ("gap", "striker_displacement", "target_displacement")}
    return replace(result, force=result.force.sum(axis=1), **means)
