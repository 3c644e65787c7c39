"""Histories of a run: spans of time, and averages and Fourier transforms of a force that is constant over each step.

A ``length`` is the length of the whole line [m], divided into equal arcs, or the (N,) lengths of its arcs. A line is
one closed loop, or several ``pieces``, each (number of arcs, closed or not). An average never spans two pieces.

Where contact runs along a line, the force at one place is a moving front: its peak grows without limit as the arcs are
refined. Means over a fixed part of the line and a fixed time converge.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.march.grid import blocks
from impact.notices import SeatfemError

Window = Literal["moving average", "hann"]
MOVING_AVERAGE: Window = "moving average"
MERGE = 30e-6  # longest opening [s] that does not end a contact group


def closed_steps(force: Array | NDArray[np.bool_]) -> Array:
    """Return the (n, 2) first step and step after the last of each run of steps with ``force`` > 0, or flagged true."""
    closed = np.concatenate([[False], force > 0, [False]])
    return np.asarray(np.flatnonzero(np.diff(closed.astype(np.int8))).reshape(-1, 2))


def merged(raw: Array, merge: float = MERGE) -> Array:
    """Return intervals (n, 2) [s], merged across openings shorter than ``merge`` [s]."""
    if len(raw) == 0:
        return raw
    new = np.concatenate([[True], raw[1:, 0] - raw[:-1, 1] >= merge])
    last = np.concatenate([new[1:], [True]])
    return np.column_stack([raw[new, 0], raw[last, 1]])


def averaged(force: Array, dt: float, width: float, window: Window) -> Array:
    """Return the (n + 1,) average over ``width`` [s] around t = 0, dt ... n dt of ``force`` (n,) [N], zero outside."""
    n = len(force)
    if window == MOVING_AVERAGE:
        integral, half = np.concatenate([[0.0], np.cumsum(force) * dt]), width / (2 * dt)
        return np.asarray((_shifted(integral, half) - _shifted(integral[::-1], half)[::-1]) / width)
    reach = min(int(width / (2 * dt)) + 1, n)  # steps that the window covers on either side
    edges = np.clip(np.arange(-reach, reach + 1) * dt / width, -0.5, 0.5)
    weights = np.diff(edges + np.sin(2 * np.pi * edges) / (2 * np.pi))
    size = 1 << (n + 2 * reach).bit_length()
    whole = np.fft.irfft(np.fft.rfft(weights, size) * np.fft.rfft(force, size), size)
    return np.asarray(whole[reach - 1 : reach + n])


def largest_average(force: Array, steps: float | Array, width: float) -> float:
    """Return the largest moving average [N] of ``force`` (n,) over ``width`` [s], reached at an edge of a step.

    ``steps``: length of the steps, or the (n + 1,) times at which they begin and end [s].
    """
    return float(largest_averages(force[:, None], steps, width)[0])


def largest_averages(force: Array, steps: float | Array, width: float, weights: Array | None = None) -> Array:
    """Return the (N,) `largest_average` of each column of ``force`` (n, N), or of its (N, k) weighted sums."""
    edges = edges_of(steps, len(force))
    spans, move = np.diff(edges)[:, None], _find_moves(edges, steps, width)

    def find(part: slice) -> Array:
        values = force[:, part] if weights is None else force @ weights[:, part]
        integral = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values * spans, axis=0)])
        later, earlier = move(integral)
        return np.asarray(np.maximum((later - integral).max(axis=0), (integral - earlier).max(axis=0)) / width)

    columns = force.shape[1] if weights is None else weights.shape[1]
    return np.concatenate([find(part) for part in blocks(columns, max(1, TOGETHER // len(edges)))])


TOGETHER: Final = 2**16  # values of force that are averaged at once: of a long run a few columns, which fit in a cache


def edges_of(steps: float | Array, number: int) -> Array:
    """Return the (n + 1,) times at which n ``steps`` begin and end [s]."""
    return np.asarray(steps * np.arange(number + 1) if np.ndim(steps) == 0 else steps, dtype=np.float64)


def _find_moves(edges: Array, steps: float | Array, width: float) -> Callable[[Array], tuple[Array, Array]]:
    """Return the function of values (n + 1, N) at the ``edges`` of steps that returns them a ``width`` [s] later and
    earlier, on the line between them; the last and the first one beyond."""
    if np.ndim(steps) == 0:
        ahead = width / float(steps)
        return lambda values: (_shifted(values, ahead), _shifted(values[::-1], ahead)[::-1])
    later, earlier = _places(edges + width, edges), _places(edges - width, edges)
    return lambda values: (_between(values, *later), _between(values, *earlier))


def _shifted(values: Array, ahead: float) -> Array:
    """Return ``values`` (n + 1, ...) a number of equal steps ``ahead``, on the line between them; the last one
    beyond."""
    whole = min(math.floor(ahead), len(values) - 1)
    share = min(ahead - whole, 1.0)
    further = np.concatenate([values[whole:], np.repeat(values[-1:], whole + 1, axis=0)])
    return np.asarray((1 - share) * further[:-1] + share * further[1:])


def _places(at: Array, time: Array) -> tuple[NDArray[np.intp], Array]:
    """Return the index of the time that follows each of the times ``at``, and its share on the line to it from the one
    before; the first and the last one beyond."""
    if len(time) < 2:
        return np.zeros(len(at), dtype=np.intp), np.ones((len(at), 1))
    after = np.clip(np.searchsorted(time, at, side="right"), 1, len(time) - 1)
    return after, np.clip((at - time[after - 1]) / (time[after] - time[after - 1]), 0.0, 1.0)[:, None]


def _between(values: Array, after: NDArray[np.intp], share: Array) -> Array:
    """Return ``values`` (n + 1, N) at `_places`, for all columns."""
    return np.asarray((1 - share) * values[after - 1] + share * values[after])


def transform(force: Array, dt: float, size: int) -> tuple[Array, Array]:
    """Return the frequencies [Hz] and |N(f)| [N s] of ``force`` (n,) [N], followed by zeros up to ``size`` steps."""
    frequencies = np.asarray(np.fft.rfftfreq(size, dt), dtype=np.float64)
    return frequencies, np.asarray(np.abs(np.fft.rfft(force, size)) * dt * np.sinc(frequencies * dt))


ON_A_STEP = 1e-6  # largest time before a step, over the step, at which a landing counts as beginning at that step


@dataclass(frozen=True)
class Spans:
    """Spans of time over which peaks are taken; each begins after one cut and includes the next.

    ``touch``: index of the recorded time at which the first contact begins; -1 under a preload, inf without contact.
    ``landing``: index of the time at which a landing begins; inf where no landing time is given.
    """

    touch: float
    landing: float = np.inf

    @classmethod
    def from_forces(cls, force: Array, dt: float, since: float = math.nan) -> Spans:
        """Return the spans of a run with contact forces (n + 1, ...) at steps ``dt``; a landing begins at ``since``
        [s], which is nan without one."""
        return cls(first_touch(force), np.inf if math.isnan(since) else float(np.floor(since / dt + ON_A_STEP)))

    @property
    def cuts(self) -> Array:
        """Return the (c,) indices of the last recorded time of each span but the last, in ascending order."""
        return np.unique([0.0, self.touch, self.landing])

    @property
    def count(self) -> int:
        """Return the number of spans."""
        return len(self.cuts) + 1

    @property
    def start(self) -> slice:
        """Return the span that consists of t = 0 alone."""
        number = self._span(0.0)
        return slice(number, number + 1)

    def until(self, cut: float) -> slice:
        """Return the spans up to a cut, ``touch`` or ``landing``."""
        return slice(self._span(cut) + 1)

    def after(self, cut: float) -> slice:
        """Return the spans after a cut, ``touch`` or ``landing``."""
        return slice(self._span(cut) + 1, None)

    def find_numbers(self, times: NDArray[np.int64]) -> NDArray[np.intp]:
        """Return the (m,) numbers of the spans that contain the recorded times with the indices ``times`` (m,)."""
        return np.searchsorted(self.cuts, times)

    def _span(self, time: float) -> int:
        return int(np.searchsorted(self.cuts, time))


def first_touch(force: Array) -> float:
    """Return the index of the time at which contact begins, inf without contact; ``force[m]`` acts from time m - 1."""
    touching = np.flatnonzero(force if force.ndim == 1 else np.any(force, axis=1))
    return float(touching[0]) - 1 if touching.size else np.inf


class StressError(SeatfemError, ValueError):
    """A stress that this record cannot give; the message names number, limit and remedy."""


@dataclass(frozen=True)
class PeakStress:
    """The largest |bending stress| of a reed [Pa], its distance from the clamp [m] and its time [s]; nan if not
    known."""

    value: float = math.nan
    at: float = math.nan
    time: float = math.nan

    @property
    def is_known(self) -> bool:
        """Return whether there is a stress."""
        return not math.isnan(self.value)


NO_STRESS = PeakStress(0.0, 0.0, 0.0)
UNKNOWN_PEAK = PeakStress()


@dataclass(frozen=True)
class ReedStress:
    """The largest |bending stress| of a reed in parts of a run; nothing is known without arguments.

    Attributes:
        initial: peak from the release until the first contact; zero under a preload, where contact begins at t = 0.
        after_contact: peak since the first contact began; unknown without contact.
        at_start: peak at t = 0, due to the release, the preload and the loads in equilibrium at the start.
        before_landing: peak until the landing begins, t = 0 included; unknown where no landing time is given.
        after_landing: peak since the landing began; unknown where no landing time is given.
    """

    initial: PeakStress = UNKNOWN_PEAK
    after_contact: PeakStress = UNKNOWN_PEAK
    at_start: PeakStress = UNKNOWN_PEAK
    before_landing: PeakStress = UNKNOWN_PEAK
    after_landing: PeakStress = UNKNOWN_PEAK

    @property
    def is_known(self) -> bool:
        """Return whether the stress of this reed is known."""
        return self.initial.is_known

    @property
    def largest(self) -> PeakStress:
        """Return the peak of the whole record."""
        return self.after_contact if self.after_contact.value >= self.initial.value else self.initial


UNKNOWN_STRESS = ReedStress()


def stress_by_spans(spans: Spans, largest: Callable[[slice], PeakStress]) -> ReedStress:
    """Return the `ReedStress` of a run whose peak in a slice of ``spans`` is ``largest(slice)``."""
    return ReedStress(
        largest(spans.until(spans.touch)),
        largest(spans.after(spans.touch)) if np.isfinite(spans.touch) else UNKNOWN_PEAK,
        largest(spans.start),
        largest(spans.until(spans.landing)) if np.isfinite(spans.landing) else UNKNOWN_PEAK,
        largest(spans.after(spans.landing)) if np.isfinite(spans.landing) else UNKNOWN_PEAK,
    )


Pieces = tuple[tuple[int, bool], ...]


@dataclass(frozen=True)
class ClosedLine:
    """A line of N arcs around a centre, closed unless its ``pieces`` say otherwise.

    ``lengths`` (N,): lengths of the arcs [m]; ``edges`` (N + 1,): angles of their ends, from 0 to 2 pi [rad], empty
    where the angle does not determine the point; ``places`` (N, 2): mean x and y over each arc from the centre [m];
    ``names``: of the pieces.
    """

    lengths: Array
    edges: Array
    places: Array
    pieces: Pieces = ()
    names: tuple[str, ...] = ()

    @property
    def has_angles(self) -> bool:
        """Return whether an angle determines a point of the line."""
        return len(self.edges) > 0

    @property
    def borders(self) -> Array:
        """Return the (N + 1,) arc lengths along the line at which its arcs begin and end [m]."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @property
    def rings(self) -> list[slice]:
        """Return the arcs of each ring of a line of several rings; empty for others."""
        if len(self.pieces) < 2 or not all(closed for _, closed in self.pieces):
            return []
        ends = np.cumsum([0, *(number for number, _ in self.pieces)]).tolist()
        return [slice(start, end) for start, end in itertools.pairwise(ends)]

    def place_on_ring(self, arc: int) -> tuple[int, float]:
        """Return the number of the ring of an arc, from 1, and the angle of its middle about that ring's centre [rad],
        from 0 to 2 pi. Raises `StopIteration` for a line that is not several rings."""
        number, ring = next((k, ring) for k, ring in enumerate(self.rings, start=1) if ring.start <= arc < ring.stop)
        x, y = self.places[arc] - np.average(self.places[ring], axis=0, weights=self.lengths[ring])
        return number, round(float(np.arctan2(y, x)), 9) % (2 * math.pi)  # not 2 pi for -1e-17

    @staticmethod
    def circle(radius: float, arcs: int) -> ClosedLine:
        """Return a circle in equal arcs, the first beginning on the x axis; the mean of an arc lies inside the
        circle."""
        angles, reach = 2 * np.pi * (np.arange(arcs) + 0.5) / arcs, radius * np.sinc(1 / arcs)
        places = reach * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return ClosedLine(np.full(arcs, 2 * np.pi * radius / arcs), 2 * np.pi * np.arange(arcs + 1) / arcs, places)


def average_over_arcs(force: Array, share: float, length: float | Array, pieces: Pieces = ()) -> Array:
    """Return the (n, 2 N) mean force per length [N/m] over the parts of the line that begin at each of N arcs, and over
    those that end there: among them is the largest over any such part, as the force is uniform along each arc.

    ``force``: (n, N) forces on the arcs [N]. On an open piece, parts that would pass an end are moved back to it.
    ``share``: length of a part over that of the line, raised to the longest arc's and limited to a whole piece; an arc
    partly inside counts in proportion. ``length``: of the line, or (N,) of its arcs [m].
    """
    lengths = lengths_of(length, force.shape[1])
    weights, first = np.zeros((len(lengths), 2 * len(lengths))), 0
    for arcs, starts, width, closed in _parts(share, lengths, pieces):
        of_piece, turns = lengths[arcs], 2 if closed else 1
        ends = np.cumsum(np.tile(of_piece, turns))
        begins = ends - np.tile(of_piece, turns)
        within = np.minimum(ends[:, None], starts + width) - np.maximum(begins[:, None], starts)
        within = np.maximum(within, 0.0).reshape(turns, len(of_piece), -1).sum(axis=0)
        weights[arcs, first : first + len(starts)] = within / of_piece[:, None] / width
        first += len(starts)
    return np.asarray(force @ weights)


def _parts(share: float, lengths: Array, pieces: Pieces) -> Iterator[tuple[slice, Array, float, bool]]:
    """Yield for each piece its arcs, the starts and the length of the parts of `average_over_arcs` on it [m], and
    whether it is closed."""
    width, first = widest(share, lengths) * lengths.sum(), 0
    for number, closed in pieces or ((len(lengths), True),):
        arcs = slice(first, first + number)
        begins, whole = np.cumsum(lengths[arcs]) - lengths[arcs], float(lengths[arcs].sum())
        span = min(width, whole)
        starts = np.concatenate([begins, begins + lengths[arcs] - span])
        yield arcs, starts % whole if closed else np.clip(starts, 0.0, whole - span), span, closed
        first += number


def lengths_of(length: float | Array, number: int) -> Array:
    """Return the (N,) lengths of the arcs [m]."""
    return np.full(number, length / number) if np.ndim(length) == 0 else np.asarray(length)


def widest(share: float, lengths: Array) -> float:
    """Return the fraction of the line averaged over: ``share``, or the fraction of the longest arc if larger."""
    return float(np.clip(share, lengths.max() / lengths.sum(), 1.0))


def per_length(force: Array, dt: float, width: float, length: float | Array) -> Array:
    """Return the (n + 1, N) force per length of each arc, averaged over ``width`` [s] around each recorded time [N/m].

    ``force``: (n + 1, N) [N] at steps ``dt`` [s], zero outside the record; ``length``: the line's, or (N,) arcs' [m].
    """
    means = [averaged(each, dt, width, "moving average") for each in force[1:].T]
    return np.asarray(np.stack(means, axis=1) / lengths_of(length, force.shape[1]))


def best_plane(gaps: Array, line: float | ClosedLine) -> Array:
    """Return the (n, 3) mean [m] and slopes along x and y of the plane a + b x + c y fitted to gaps by least squares.

    ``gaps``: (n, N) on N >= 3 arcs [m]; ``line``: the line, or the radius of a circle in equal arcs [m].
    """
    line = line if isinstance(line, ClosedLine) else ClosedLine.circle(line, gaps.shape[1])
    plane = np.column_stack([np.ones(len(line.places)), line.places])
    return np.asarray(np.linalg.lstsq(plane, gaps.T, rcond=None)[0].T)


def line_force_peak(
    force: Array, steps: float | Array, width: float, length: float | Array, share: float, pieces: Pieces = ()
) -> tuple[float, float]:
    """Return the largest force per length [N/m], averaged over ``width`` [s] and a ``share`` of the line; its place.

    ``force``: (n, N) on N arcs, constant over each step [N]; ``steps``: length of the steps, or the (n + 1,) times at
    which they begin and end [s]; ``length``: the line's, or (N,) arcs' [m]. The place is the middle of the averaged
    part, as a fraction of the line from the beginning of the first arc.
    """
    lengths, when = lengths_of(length, force.shape[1]), np.flatnonzero(np.any(force, axis=1))
    part = slice(when[0], when[-1] + 1) if when.size else slice(0, 1)  # there is no force before and after
    weights, edges = average_over_arcs(np.eye(len(lengths)), share, lengths, pieces), edges_of(steps, len(force))
    each = largest_averages(force[part], edges[part.start : part.stop + 1], width, weights)
    return float(each.max()), float(_middles(lengths, share, pieces)[int(np.argmax(each))])


def line_impulse(
    force: Array, steps: float | Array, length: float | Array, share: float, pieces: Pieces = ()
) -> tuple[Array, Array]:
    """Return the (2 N,) impulses per length averaged over a ``share`` of the line [N s/m], and their places, ascending.

    Arguments and places are as in `line_force_peak`.
    """
    lengths = lengths_of(length, force.shape[1])
    whole = np.diff(edges_of(steps, len(force))) @ force
    impulses = average_over_arcs(whole[None], share, lengths, pieces)[0]
    places = _middles(lengths, share, pieces)
    order = np.argsort(places, kind="stable")
    return impulses[order], places[order]


def line_impulse_peak(
    force: Array, steps: float | Array, length: float | Array, share: float, pieces: Pieces = ()
) -> tuple[float, float]:
    """Return the largest value of `line_impulse` [N s/m] and its place."""
    each, places = line_impulse(force, steps, length, share, pieces)
    return float(each.max()), float(places[int(np.argmax(each))])


def _middles(lengths: Array, share: float, pieces: Pieces) -> Array:
    """Return the (2 N,) middles of the parts that begin and end at each arc, as fractions of the line."""
    places, before = [], 0.0
    for arcs, starts, width, closed in _parts(share, lengths, pieces):
        whole, middles = float(lengths[arcs].sum()), starts + width / 2
        places.append(before + (middles % whole if closed else middles))
        before += whole
    return np.asarray(np.concatenate(places) / lengths.sum())
