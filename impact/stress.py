"""Stress in the bodies, recovered from the contact force."""

from __future__ import annotations

import numpy as np

from impact.closed_form import DelayRod
from impact.greens import Array
from impact.result import ImpactResult


class StressError(ValueError):
    """A stress that this record cannot give; the message names number, limit and remedy."""


def rod_stress(result: ImpactResult, rod: DelayRod, *, area: float, at: float = 1.0) -> Array:
    """(n + 1,) axial stress, > 0 in compression [Pa], of a rod struck by ``result.force``; exact for its steps.

    The contact sends out the wave of particle velocity a(t) = N(t)/Z + R a(t - T); at the distance x it meets the
    wave that returns from the far end:  sigma A = Z (a(t - x/c) - R a(t - T + x/c)).  Like the force,
    ``stress[m]`` holds over the step that ends at ``result.time[m]``.

    Args:
        result: its force acts on the rod's end.
        rod: its Green's function.
        area: of its section [m^2].
        at: x/l, 0 at the contact ... 1 at the far end.

    Raises:
        StressError: a position off the rod, an area that is not positive, or a delay that is no multiple of the step.

    Source: Timoshenko & Goodier, Theory of Elasticity, longitudinal impact of bars.
    """
    if not 0.0 <= at <= 1.0:
        raise StressError(f"at = {at:g} is off the rod, 0 (contact) ... 1 (far end)")
    if not area > 0:
        raise StressError(f"area = {area:g} m^2 must be positive")
    trip = _steps(rod.round_trip, result.dt)
    there = _steps(at * rod.round_trip / 2, result.dt)
    outgoing = result.force / rod.impedance
    for m in range(trip, len(outgoing)):
        outgoing[m] += rod.reflection * outgoing[m - trip]
    force = _delayed(outgoing, there) - rod.reflection * _delayed(outgoing, trip - there)
    return np.asarray(rod.impedance / area * force)


def _delayed(values: Array, steps: int) -> Array:
    return np.concatenate([np.zeros(steps), values])[: len(values)]


def _steps(delay: float, dt: float) -> int:
    count = round(delay / dt)
    if abs(delay / dt - count) > 1e-6:
        raise StressError(
            f"the wave needs {delay:g} s, {delay / dt:.6g} steps of {dt:g} s, not a whole number; "
            f"use dt = {delay / max(count, 1):.17g} s"
        )
    return count
