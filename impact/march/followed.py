"""Loads that depend on the opening, once that is known: what they were in a run that is over."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from impact.bodies.body import Body, Load
from impact.greens.base import Array
from impact.march.stepper import FOLLOW


def foreseen(opening: Array) -> tuple[NDArray[np.int64], Array]:
    """Return the numbers of the steps after which loads follow anew, and the mean opening that they then take for
    `FOLLOW` steps [m], as `impact.ContactStepper` foresees it; ``opening`` (n + 1,).
    """
    first = np.arange(0, len(opening) - 1, FOLLOW)
    now, before = opening[first], opening[np.maximum(first - 1, 0)]
    return first, np.asarray(now + FOLLOW / 2 * (now - before))


def as_marched(body: Body, opening: Array, dt: float) -> Body:
    """Return the striker of a run with steps ``dt`` [s], its loads that follow the mean ``opening`` (n + 1,) of the
    seats [m] replaced by the courses that they had in the march.
    """
    if not any(load.follows for load in body.loads):
        return body
    first, ahead = foreseen(opening)
    times = np.asarray(dt * first, dtype=np.float64)
    return replace(body, loads=tuple(_as_marched(load, times, ahead, FOLLOW * dt) for load in body.loads))


def _as_marched(load: Load, times: Array, ahead: Array, span: float) -> Load:
    """Return the load as marched, which takes each of the openings ``ahead`` from one of the ``times`` on [s]."""
    amplitude, factors = load.amplitude, np.ones(len(ahead))
    if load.feedback is not None:
        state = load.feedback.start()
        fed = [load.feedback.advance(state, float(t), span, float(lift)) for t, lift in zip(times, ahead, strict=True)]
        amplitude = held_course(np.array(fed), span)
    if load.by_opening is not None:
        factors = np.array([load.by_opening(float(lift)) for lift in ahead])
    factor = held_course(factors, span)
    return Load(load.shape, lambda t: np.asarray(amplitude(t)) * factor(t))


def held_course(values: Array, span: float) -> Callable[[Array], Array]:
    """Return the course that keeps each of the values for a span [s]."""
    return lambda t: values[np.clip((np.asarray(t) / span).astype(np.int64), 0, len(values) - 1)]
