"""What is read off an impact: functions of an `ImpactResult`."""

from __future__ import annotations

import math

import numpy as np

from impact.greens import Array
from impact.result import ImpactResult

MERGE = 30e-6  # openings shorter than this [s] do not end a contact group


class MeasureError(ValueError):
    """A measure that this result cannot give; the message names the remedy."""


def impulse(result: ImpactResult) -> float:
    """Integral of the contact force [N s], exact for the stepwise force."""
    return float(np.sum(result.force)) * result.dt


def peak_force(result: ImpactResult) -> float:
    """Largest force of any step [N]; at a velocity jump it converges only slowly, see `filtered_peak_force`."""
    return float(np.max(result.force))


def filtered_force(result: ImpactResult, width: float = 1e-6) -> Array:
    """(n + 1,) centred moving average of the force over ``width`` [s], zero force outside the record [N].

    The stepwise force is averaged exactly: (I(t + width/2) - I(t - width/2))/width, I its integral, at the recorded
    times.

    Raises:
        MeasureError: ``width`` below two steps, which the record does not resolve.
    """
    if not width >= 2 * result.dt * (1 - 1e-9):
        raise MeasureError(
            f"filter width {width:g} s is below two steps of {result.dt:g} s: the filtered force is not resolved; "
            f"use dt <= {width / 2:g} s or a wider filter"
        )
    integral = np.cumsum(result.force) * result.dt
    after = np.interp(result.time + width / 2, result.time, integral)
    before = np.interp(result.time - width / 2, result.time, integral)
    return np.asarray((after - before) / width)


def filtered_peak_force(result: ImpactResult, width: float = 1e-6) -> float:
    """Largest value of `filtered_force` [N]."""
    return float(np.max(filtered_force(result, width)))


def contact_intervals(result: ImpactResult) -> Array:
    """(n, 2) start and end [s] of each maximal run of steps with force > 0."""
    closed = np.concatenate([result.force > 0, [False]])
    edges = np.flatnonzero(np.diff(closed.astype(np.int8)))
    return np.asarray(result.time[edges].reshape(-1, 2))


def contact_groups(result: ImpactResult, merge: float = MERGE) -> Array:
    """(n, 2) contact intervals [s] with openings shorter than ``merge`` [s] closed: what a user calls one impact."""
    raw = contact_intervals(result)
    if len(raw) == 0:
        return raw
    new = np.concatenate([[True], raw[1:, 0] - raw[:-1, 1] >= merge])
    last = np.concatenate([new[1:], [True]])
    return np.column_stack([raw[new, 0], raw[last, 1]])


def impact_velocity(result: ImpactResult) -> float:
    """Closing speed -d(gap)/dt over the last step before the first contact [m/s]; ``nan`` without contact."""
    closed = np.flatnonzero(result.force > 0)
    if closed.size == 0:
        return math.nan
    m = int(closed[0])
    if m < 2:  # in contact from the first step: the approach is that of the free motion
        return result.target_velocity - result.striker_velocity
    return float(result.gap[m - 2] - result.gap[m - 1]) / result.dt


def restitution(result: ImpactResult) -> float:
    """Coefficient of restitution.

    With a striker free to translate: ratio of the relative centre-of-mass velocities of the bodies after and before,
    (V_s' - V_t')/(V_t - V_s), from the impulse (a held target has V = 0). With a held striker (a reed): the energetic
    coefficient sqrt(E'/E) of the striker's energy just after and just before the first contact group.

    Raises:
        MeasureError: no contact, contact not over at the end of the record, or no approach.
    """
    groups = contact_groups(result)
    if len(groups) == 0:
        raise MeasureError("no contact in this record: the coefficient of restitution is not defined; run longer")
    if math.isinf(result.striker_mass):
        if groups[0, 1] >= result.time[-1]:
            raise MeasureError("the bodies are still in contact at the end of the record; run longer")
        before = int(np.searchsorted(result.time, groups[0, 0]))
        after = min(int(np.searchsorted(result.time, groups[0, 1])) + 1, len(result.time) - 1)
        if not result.energy.striker[before] > 0:
            raise MeasureError(
                "the held striker has no energy before the contact: let the body that moves be the striker"
            )
        return math.sqrt(max(result.energy.striker[after], 0.0) / result.energy.striker[before])
    if result.force[-1] > 0:
        raise MeasureError("the bodies are still in contact at the end of the record; run longer")
    approach = result.target_velocity - result.striker_velocity
    if approach <= 0:
        raise MeasureError(f"the bodies do not approach (closing speed {approach:g} m/s)")
    total = impulse(result)
    rebound = (result.striker_velocity + total / result.striker_mass) - (
        result.target_velocity - total / result.target_mass
    )
    return rebound / approach
