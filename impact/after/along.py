"""Forces along a closed line of equal arcs: per length, averaged over a stated part of it and a stated time.

Where contact runs along a line, the force at one place is a moving front: its peak grows with ever more arcs and never
settles. Means over a part of the line and a time do.
"""

from __future__ import annotations

import numpy as np

from impact.after.spectrum import averaged, largest_average
from impact.greens.base import Array


def over_arcs(force: Array, share: float) -> Array:
    """(n, N) forces of N arcs [N] -> (n, N) mean force of an arc over a part of the line that begins at each arc.

    Args:
        force: (n, N), arc by arc around the line.
        share: of the whole line, 1/N <= share <= 1; an arc that lies in it in part counts by that part.
    """
    number = force.shape[1]
    width = float(np.clip(share * number, 1.0, number))
    whole, rest = int(width), width - int(width)
    around = np.concatenate([np.zeros((len(force), 1)), np.cumsum(np.tile(force, 2), axis=1)], axis=1)
    first = np.arange(number)
    summed = around[:, first + whole] - around[:, first]
    if rest > 0:
        summed = summed + rest * force[:, (first + whole) % number]
    return np.asarray(summed / width)


def per_length(force: Array, dt: float, width: float, length: float) -> Array:
    """(n + 1, N) force per length of each arc, averaged over ``width`` [s] around each recorded time [N/m].

    Args:
        force: (n + 1, N) of N equal arcs, as in `impact.ImpactResult` [N].
        dt: step [s].
        width: of the average in time, zero force outside the record [s].
        length: of the whole line [m].
    """
    means = [averaged(each, dt, width, "moving average") for each in force[1:].T]
    return np.asarray(np.stack(means, axis=1) * force.shape[1] / length)


def best_plane(gaps: Array, radius: float) -> Array:
    """(n, 3) mean [m] and slopes along x and y of the plane a + b x + c y next to the gaps along a circle.

    Args:
        gaps: (n, N) mean gap of each of N >= 3 equal arcs, which begin on the x axis [m].
        radius: of the circle [m].
    """
    number = gaps.shape[1]
    angles = 2 * np.pi * (np.arange(number) + 0.5) / number
    reach = radius * np.sinc(1 / number)  # the mean of an arc lies inside the circle
    plane = np.stack([np.ones(number), reach * np.cos(angles), reach * np.sin(angles)], axis=1)
    return np.asarray(np.linalg.lstsq(plane, gaps.T, rcond=None)[0].T)


def line_force_peak(force: Array, dt: float, width: float, length: float, share: float) -> tuple[float, float]:
    """Largest force per length [N/m] averaged over any span of ``width`` [s] and a ``share`` of the line, and where.

    Args:
        force: (n, N) of N equal arcs, constant over each step [N].
        dt: step [s].
        width: of the average in time [s].
        length: of the whole line [m].
        share: of the line that is averaged over.

    Returns:
        The peak and the middle of its part of the line, as a share of the line from the first arc's beginning.
    """
    number = force.shape[1]
    means = over_arcs(force, share) * number / length
    each = [largest_average(means[:, k], dt, width) for k in range(number)]
    return float(max(each)), _middle(int(np.argmax(each)), number, share)


def line_impulse(force: Array, dt: float, length: float, share: float) -> tuple[Array, Array]:
    """Impulse per length averaged over a ``share`` of the line around it, (N,) [N s/m], and where, (N,): shares of the
    line from the first arc's beginning. The arguments are those of `line_impulse_peak`."""
    number = force.shape[1]
    found = over_arcs(force.sum(axis=0, keepdims=True), share)[0] * number * dt / length
    places = np.array([_middle(first, number, share) for first in range(number)])
    order = np.argsort(places)
    return found[order], places[order]


def line_impulse_peak(force: Array, dt: float, length: float, share: float) -> tuple[float, float]:
    """Largest impulse per length [N s/m], averaged over a ``share`` of the line; else as `line_force_peak`."""
    each, places = line_impulse(force, dt, length, share)
    return float(each.max()), float(places[int(np.argmax(each))])


def _middle(first: int, number: int, share: float) -> float:
    return (first / number + max(share, 1 / number) / 2) % 1.0
