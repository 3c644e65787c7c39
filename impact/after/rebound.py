"""Coefficients of restitution of landings."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from impact.after.landings import Landing
from impact.greens.base import Array
from impact.march.problem import ContactProblem

Stored = Callable[[Sequence[int]], Array | None]
"""The energy stored in the striker after each of some numbers of steps, increasing [J]; ``None``: not known."""


def restitutions(
    problem: ContactProblem,
    force: Array,
    dt: float,
    landings: Sequence[Landing],
    stored: Stored,
    loads: Array,
    *,
    side: int = 1,
) -> tuple[float | None, ...]:
    """Return the coefficient of restitution of each landing, in order of time, on the contacts of one ``side``.

    Of a striker that is held: sqrt(E'/E) of its energy after and before, by ``stored``; other contacts and loads at
    work meanwhile count. Of one free to translate: the speed at which the bodies' translations part over that at which
    they closed, the mean of the contacts, motion of bases included. ``None`` of a landing that does not end apart, and
    where the energy is not known. ``force`` (n, p) of all contacts [N], ``loads`` (L, n) amplitudes of the striker's
    [N].
    """
    apart = [not (landing.pressed_on or landing.cut_off) for landing in landings]
    if not any(apart):
        return (None,) * len(landings)
    last = len(force)
    steps = [(round(one.start / dt), min(round(one.end / dt) + 1, last)) for one in landings]
    if math.isinf(problem.striker.mass):
        numbers = sorted({step for pair in steps for step in pair})
        if (energies := stored(numbers)) is None:
            return (None,) * len(landings)
        known = np.zeros(last + 1)
        known[numbers] = energies
    else:
        known = _closing_speeds(problem, force, dt, loads, side)
    each: list[float | None] = []
    for (first, second), parts in zip(steps, apart, strict=True):
        ratio = float(known[second] / known[first]) if parts and known[first] > 0 else None
        held = math.isinf(problem.striker.mass)
        each.append(None if ratio is None else math.sqrt(max(ratio, 0.0)) if held else -ratio)
    return tuple(each)


def _closing_speeds(problem: ContactProblem, force: Array, dt: float, loads: Array, side: int) -> Array:
    """Return the (n + 1,) mean closing speed of the bodies' translations at the contacts of one side [m/s]."""
    face = np.array([contact.side == side for contact in problem.contacts])
    impulses = np.concatenate([np.zeros((1, force.shape[1])), np.cumsum(force, axis=0) * dt])
    speed = np.zeros(len(impulses))
    for body in problem.bodies:
        turn = problem.directions(body)
        seen = turn[:, face].mean(axis=1)
        start = np.array([body.velocity_of(port) for port in range(len(seen))])
        inverse = body.greens.inverse_mass()
        speed += seen @ start + impulses @ (turn.T @ np.where(np.isfinite(inverse), inverse, 0.0) @ seen)
    modal = problem.striker.greens.modal
    if modal is not None and len(loads):
        rigid, seen = modal.omega == 0, problem.directions(problem.striker)[:, face].mean(axis=1)
        for load, amplitude in zip(problem.striker.loads, loads, strict=True):
            moved = float((modal.shapes[rigid] @ seen) @ load.shape[rigid])
            speed[1:] += moved * dt * np.cumsum(amplitude)
    if (carried := problem.carried(np.asarray(dt * np.arange(len(speed)), dtype=np.float64))) is not None:
        speed += np.gradient(carried[:, face].mean(axis=1), dt)
    return -speed
