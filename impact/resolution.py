"""Whether the step resolves the contacts that it found."""

from __future__ import annotations

import numpy as np

from impact.greens import Array
from impact.result import Advice

FEWEST_STEPS = 10  # of a contact that counts as resolved; the impulse of shorter ones is off by a per cent and more
UNRESOLVED_LIMIT = 0.1  # of the impulse


def contact_advice(force: Array, dt: float) -> tuple[Advice, ...]:
    """Share of the impulse of ``force`` (n, p) [N] that contacts of fewer than `FEWEST_STEPS` steps carry.

    A contact that the record's end cuts is counted where it has ended by then.
    """
    total = float(force.sum())
    short, shortest = 0.0, FEWEST_STEPS
    for column in force.T:
        lengths, sums = _contacts(column)
        brief = lengths < FEWEST_STEPS
        short += float(sums[brief].sum())
        shortest = min(shortest, int(lengths[brief].min(initial=FEWEST_STEPS)))
    share = short / total if total > 0 else 0.0
    if share <= UNRESOLVED_LIMIT:
        return ()
    return (
        Advice(
            f"share of the impulse in contacts of fewer than {FEWEST_STEPS} steps",
            share,
            UNRESOLVED_LIMIT,
            "the step does not resolve them: their force and rebound are set by the step",
            f"use dt <= {dt * shortest / (2 * FEWEST_STEPS):.2g} s",
        ),
    )


def _contacts(force: Array) -> tuple[Array, Array]:
    """Lengths [steps] and sums of the contacts of one force (n,) that have ended."""
    closed = np.concatenate([[False], force > 0, [False]])
    edges = np.flatnonzero(closed[1:] != closed[:-1])
    starts, stops = edges[::2], edges[1::2]
    ended = stops < len(force)
    running = np.concatenate([[0.0], np.cumsum(force)])
    return np.asarray(stops - starts, dtype=float)[ended], (running[stops] - running[starts])[ended]
