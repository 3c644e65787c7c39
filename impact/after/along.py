"""Forces along a line in arcs: per length, averaged over a stated part of it and a stated time.

A ``length`` is that of the whole line [m], whose arcs are then equal, or those of its arcs, (N,). A line is closed, or
made of several ``pieces``: the number of arcs in each, and whether it is closed. What is averaged lies on one piece.

Where contact runs along a line, the force at one place is a moving front: its peak grows with ever more arcs and never
settles. Means over a part of the line and a time do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from impact.after.spectrum import averaged, largest_averages
from impact.greens.base import Array

Pieces = tuple[tuple[int, bool], ...]


@dataclass(frozen=True)
class ClosedLine:
    """A line in N arcs about a point, closed unless its ``pieces`` are not.

    ``lengths`` (N,) of the arcs [m]; ``edges`` (N + 1,): angles at which they begin and end, from 0 to 2 pi [rad],
    ``None`` where angles do not give places; ``places`` (N, 2): means over them of x and y from the point [m].
    """

    lengths: Array
    edges: Array | None
    places: Array
    pieces: Pieces = ()

    @property
    def borders(self) -> Array:
        """Return the (N + 1,) lengths along it at which arcs begin and end [m]."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @staticmethod
    def circle(radius: float, arcs: int) -> ClosedLine:
        """Return a circle in equal arcs, of which the first begins on the x axis; their means lie inside the circle."""
        angles, reach = 2 * np.pi * (np.arange(arcs) + 0.5) / arcs, radius * np.sinc(1 / arcs)
        places = reach * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return ClosedLine(np.full(arcs, 2 * np.pi * radius / arcs), 2 * np.pi * np.arange(arcs + 1) / arcs, places)


def over_arcs(force: Array, share: float, length: float | Array | None = None, pieces: Pieces = ()) -> Array:
    """Turn (n, N) forces of N arcs [N] into the (n, N) mean force per length over a part of the line that begins at
    each.

    On an open piece parts that would reach beyond its end are moved back to it. ``share``: of the whole line, up to 1,
    at least the longest arc's, at most a whole piece; an arc that lies in it in part counts by that part. ``length``:
    by default 1 m of each arc, for the mean force of an arc.
    """
    lengths = lengths_of(float(force.shape[1]) if length is None else length, force.shape[1])
    weights = np.zeros((len(lengths), len(lengths)))
    for arcs, starts, width, closed in _parts(share, lengths, pieces):
        own, again = lengths[arcs], 2 if closed else 1
        ends = np.cumsum(np.tile(own, again))
        begins = ends - np.tile(own, again)
        within = np.minimum(ends[:, None], starts + width) - np.maximum(begins[:, None], starts)
        within = np.maximum(within, 0.0).reshape(again, len(own), -1).sum(axis=0)
        weights[arcs, arcs] = within / own[:, None] / width
    return np.asarray(force @ weights)


def _parts(share: float, lengths: Array, pieces: Pieces) -> Iterator[tuple[slice, Array, float, bool]]:
    """Yield for each piece its arcs, where on it the parts of `over_arcs` begin and how long they are [m], and if
    closed."""
    width, first = widest(share, lengths) * lengths.sum(), 0
    for number, closed in pieces or ((len(lengths), True),):
        arcs = slice(first, first + number)
        starts, whole = np.cumsum(lengths[arcs]) - lengths[arcs], float(lengths[arcs].sum())
        span = min(width, whole)
        yield arcs, starts if closed else np.minimum(starts, whole - span), span, closed
        first += number


def lengths_of(length: float | Array, number: int) -> Array:
    """Return the (N,) lengths of the arcs [m]."""
    return np.full(number, length / number) if np.ndim(length) == 0 else np.asarray(length)


def widest(share: float, lengths: Array) -> float:
    """Return the part of the line that is averaged over: ``share``, or that of the longest arc where that is more."""
    return float(np.clip(share, lengths.max() / lengths.sum(), 1.0))


def per_length(force: Array, dt: float, width: float, length: float | Array) -> Array:
    """Return the (n + 1, N) force per length of each arc, averaged over ``width`` [s] around each recorded time [N/m].

    ``force``: (n + 1, N) [N] at steps ``dt`` [s], zero outside the record; ``length``: of the line, or (N,) [m].
    """
    means = [averaged(each, dt, width, "moving average") for each in force[1:].T]
    return np.asarray(np.stack(means, axis=1) / lengths_of(length, force.shape[1]))


def best_plane(gaps: Array, line: float | ClosedLine) -> Array:
    """Return the (n, 3) mean [m] and slopes along x and y of the plane a + b x + c y next to the gaps along a line.

    ``gaps``: (n, N) of N >= 3 arcs [m]; ``line``: or the radius of a circle in equal arcs from the x axis on [m].
    """
    line = line if isinstance(line, ClosedLine) else ClosedLine.circle(line, gaps.shape[1])
    plane = np.column_stack([np.ones(len(line.places)), line.places])
    return np.asarray(np.linalg.lstsq(plane, gaps.T, rcond=None)[0].T)


def line_force_peak(
    force: Array, dt: float, width: float, length: float | Array, share: float, pieces: Pieces = ()
) -> tuple[float, float]:
    """Return the largest force per length, averaged over any ``width`` [s] and a ``share`` of the line, and where [N/m,
    1].

    ``force``: (n, N) of N arcs, constant over each step ``dt`` [N, s]; ``length``: of the line, or (N,) [m]. The place
    is the middle of its part, as a share of the line from the first arc's beginning.
    """
    lengths, when = lengths_of(length, force.shape[1]), np.flatnonzero(np.any(force, axis=1))
    first, last = (when[0], when[-1]) if when.size else (0, 0)  # there is no force before and after
    means = over_arcs(force[first : last + 1], share, lengths, pieces)
    each = largest_averages(means, dt, width)
    return float(each.max()), float(_middles(lengths, share, pieces)[int(np.argmax(each))])


def line_impulse(
    force: Array, dt: float, length: float | Array, share: float, pieces: Pieces = ()
) -> tuple[Array, Array]:
    """Return the (N,) impulses per length averaged over a ``share`` of the line [N s/m], and the shares of the line
    where.

    The arguments are those of `line_force_peak`.
    """
    lengths = lengths_of(length, force.shape[1])
    impulses = over_arcs(force.sum(axis=0, keepdims=True), share, lengths, pieces)[0] * dt
    places = _middles(lengths, share, pieces)
    order = np.argsort(places, kind="stable")
    return impulses[order], places[order]


def line_impulse_peak(
    force: Array, dt: float, length: float | Array, share: float, pieces: Pieces = ()
) -> tuple[float, float]:
    """Return the largest impulse per length [N s/m], averaged over a ``share`` of the line; else as
    `line_force_peak`."""
    each, places = line_impulse(force, dt, length, share, pieces)
    return float(each.max()), float(places[int(np.argmax(each))])


def _middles(lengths: Array, share: float, pieces: Pieces) -> Array:
    """Return the (N,) middles of the parts that begin at each arc, as shares of the line."""
    places, before = [], 0.0
    for arcs, starts, width, closed in _parts(share, lengths, pieces):
        whole, middles = float(lengths[arcs].sum()), starts + width / 2
        places.append(before + (middles % whole if closed else middles))
        before += whole
    return np.asarray(np.concatenate(places) / lengths.sum())
