"""The largest stress of many points over a long record, in blocks of times: memory does not grow with the run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from impact.after.histories import Spans
from impact.march.loop.compiled import compiled
from seatfem.machine.compiling import threads
from seatfem.structures.model import Array

TIMES_PER_RADIAN: Final = 2  # instants per radian of the highest frequency retained at which peaks are looked for
LITTLE: Final = 1e-3  # largest stress of the coordinates left out, over the largest stress
BETWEEN: Final = 5e-3  # largest miss between two instants, over the largest stress; sqrt(3/2) of it of von Mises
_BLOCK: Final = 1024  # instants of a block
_PLACES: Final = 16  # fewest places that a thread evaluates at once
_NUMBERS: Final = 2**18  # numbers that a thread holds, where one place has fewer

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Largest:
    """The largest von Mises and the largest (tensile) principal stress of each of P points [Pa] and their times [s]."""

    von_mises: Array
    von_mises_time: Array
    principal: Array
    principal_time: Array


@dataclass(frozen=True)
class LargestStress:
    """The largest stress of each point in each of the ``spans`` of a run, (s, 4, P): its values and times as `Largest`
    has them; zero where a span has no times."""

    spans: Spans
    by_span: Array

    @property
    def initial(self) -> Largest:
        """Return the largest until the first touch."""
        return self.within(self.spans.until(self.spans.touch))

    @property
    def after_contact(self) -> Largest:
        """Return the largest since the first touch."""
        return self.within(self.spans.after(self.spans.touch))

    def within(self, chosen: slice) -> Largest:
        """Return the largest of some of the spans."""
        spans = self.by_span[chosen]
        if not len(spans):
            return Largest(*np.zeros_like(self.by_span[0]))
        mises, principal = (spans[:, number].argmax(axis=0)[None] for number in (0, 2))
        of_each = ((0, mises), (1, mises), (2, principal), (3, principal))
        return Largest(*(np.take_along_axis(spans[:, number], best, axis=0)[0] for number, best in of_each))


class Field(Protocol):
    """Stress at G places, each at A angles [one], as a sum of K coordinates in time."""

    @property
    def points(self) -> Array:
        """Return the (G A, d) places [m]."""

    @property
    def radians(self) -> Array:
        """Return the (K,) angular frequency of each coordinate; 0 for a followed force [rad/s]."""

    @property
    def bounds(self) -> Array:
        """Return the (G, K) largest norm of the stress that each coordinate makes at a place, at any angle."""

    def at(self, which: NDArray[np.int64] | NDArray[np.bool_]) -> Field:
        """Return the field of some of its points, each at its own angle."""

    def coordinates(self, force: Array, dt: float, stride: int) -> Iterator[Array]:
        """Yield (..., K) blocks of coordinates under port forces, at every ``stride``-th time from t = 0 on."""

    def stress(self, which: Integers, values: Array, kept: Integers) -> Iterator[Array]:
        """Yield the (g, A, 6, m) stress at some places, a few at once and in order, by ``values`` (k, m) of the
        coordinates ``kept`` (k,) [Pa]; each may be overwritten by the next."""


def largest(
    field: Field, force: Array, dt: float, *, since: float | None = None, workers: int | None = None
) -> LargestStress:
    """Return the largest stress [Pa] at each point, looked for at `TIMES_PER_RADIAN` of the highest frequency retained.

    The force (n + 1, p) is as in `seatfem.structures.fields.recovery.histories`. Blocks of times at which even the sum
    of every coordinate's share is below what a place has seen are passed over there. ``since``: the time at which a
    landing begins, before and after which the largest is told apart, too [s]. ``workers`` threads, by default all that
    compiled code may use, share the places; their number changes nothing.
    """
    bounds, stride = field.bounds, stride_of(field, dt)
    spans = Spans.of_run(force, dt, since)
    peaks = np.zeros((spans.count, 4, len(bounds), len(field.points) // max(1, len(bounds))))
    with ThreadPoolExecutor(workers or threads()) as pool:
        for number, part in blocks_of_times(field, force, dt, stride):
            times = number * stride
            numbers = spans.of_times(times)
            for span in np.unique(numbers):
                chosen = np.flatnonzero(numbers == span)
                when = dt * times[chosen].astype(np.float64)
                _look(pool, field, part[chosen], when, bounds, peaks[span])
    return LargestStress(spans, peaks.reshape(spans.count, 4, -1))


def stride_of(field: Field, dt: float) -> int:
    """Return how many steps ``dt`` [s] apart the times are that are looked at, `TIMES_PER_RADIAN`."""
    return max(1, int(1.0 / (TIMES_PER_RADIAN * float(field.radians.max()) * dt)))


def blocks_of_times(field: Field, force: Array, dt: float, stride: int) -> Iterator[tuple[Integers, Array]]:
    """Yield the numbers of the times and (m, K) coordinates, `_BLOCK` at once."""
    first = 0
    for part in field.coordinates(force, dt, stride):
        for start in range(0, len(part), _BLOCK):
            some = part[start : start + _BLOCK]
            yield first + start + np.arange(len(some), dtype=np.int64), some
        first += len(part)


def _look(pool: Executor, field: Field, part: Array, times: Array, bounds: Array, found: Array) -> None:
    """Update ``found`` (4, G, A) by the stress at these times."""
    most = max(found[0].max(initial=0.0), found[2].max(initial=0.0))
    part, times, kept = thinned(part, times, bounds.max(axis=0, initial=0.0), most)
    if not kept.size:
        return
    seen = np.minimum(found[0] / math.sqrt(1.5), found[2]).min(axis=1)
    near = np.flatnonzero(bounds[:, kept] @ np.abs(part).max(axis=0) > seen)
    values = np.ascontiguousarray(part.T)
    at_once = max(_PLACES, _NUMBERS // (6 * found.shape[2] * len(times)))

    def look(remaining: Integers) -> None:
        for stress in field.stress(remaining, values, kept):
            some, remaining = remaining[: len(stress)], remaining[len(stress) :]
            of_some = found[:, some].reshape(4, -1)
            _largest(stress.reshape(-1, 6, len(times)), times, of_some)
            found[:, some] = of_some.reshape(4, len(some), -1)

    for _ in pool.map(look, [near[start : start + at_once] for start in range(0, len(near), at_once)]):
        pass


def thinned(part: Array, times: Array, bound: Array, largest: float) -> tuple[Array, Array, Integers]:
    """Return fewer times and coordinates, and which of these.

    The coordinates left out add up to `LITTLE` of ``largest`` [Pa]. Between two times s steps apart that are looked
    at, the stress is off the line through both by s^2/8 of its second difference at most, which is below `BETWEEN` of
    it; and on a line a norm is nowhere larger than at its ends.
    """
    weight = bound * np.abs(part).max(axis=0)
    order = np.argsort(weight)
    kept = np.sort(order[np.cumsum(weight[order]) >= LITTLE * largest]).astype(np.int64)
    part = part[:, kept]
    bend = float((np.abs(np.diff(part, 2, axis=0)) @ bound[kept]).max(initial=0.0))
    step = max(1, int(min(math.sqrt(8 * BETWEEN * largest / bend) if bend else np.inf, len(part))))
    looked = np.append(np.arange(0, len(part) - 1, step), len(part) - 1)
    return part[looked], times[looked], kept


EACH: Final = 4  # points of each region
_AT_ONCE: Final = 256  # places whose stress over one block of times is held at once


def mises_range(field: Field, force: Array, dt: float, *, since: int = 0) -> Array:
    """Return (P,) sqrt 3 times the diagonal of the box, in Ilyushin's space, that holds each point's deviators [Pa].

    Under proportional stress it is the von Mises stress of the difference of the two states furthest apart, otherwise
    that at least and sqrt 5 times it at most: no point with a large range is passed over. The times and the coordinates
    that are looked at are those of `largest`.

    Args:
        field: stress of a body.
        force, dt: as in `seatfem.structures.fields.recovery.histories`.
        since: number of the step from which on.
    """
    bounds, stride = field.bounds, stride_of(field, dt)
    strongest, places = bounds.max(axis=0, initial=0.0), np.arange(len(bounds))
    shape = (len(bounds), len(field.points) // max(1, len(bounds)), 5)
    low, high, size = np.full(shape, np.inf), np.full(shape, -np.inf), 0.0
    for numbers, part in blocks_of_times(field, force, dt, stride):
        if not len(later := part[numbers >= since // stride]):
            continue
        later, _, fields = thinned(later, numbers.astype(np.float64), strongest, size)
        if not fields.size:  # next to no stress
            low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
            continue
        values = np.ascontiguousarray(later.T)
        for first in range(0, len(places), _AT_ONCE):
            for stress in field.stress(places[first : first + _AT_ONCE], values, fields):
                widen(stress, low[first : first + len(stress)], high[first : first + len(stress)])
                first += len(stress)
        size = float((high - low).max(initial=0.0))
    return np.asarray(np.sqrt(3) * np.linalg.norm(high - low, axis=-1).ravel())


def hottest(ranges: Array, regions: NDArray[np.str_], each: int = EACH) -> NDArray[np.int64]:
    """Return the numbers of the points (P,) with the largest ranges, so many of each region."""
    order = np.argsort(-ranges, kind="stable")
    return np.concatenate([order[regions[order] == name][:each] for name in np.unique(regions)]).astype(np.int64)


def norms(stress: Array) -> Array:
    """Return the (...) Frobenius norm of (..., 6): a bound of principal stresses, sqrt(3/2) of it of von Mises's."""
    return np.asarray(np.sqrt(np.sum(stress[..., :3] ** 2, axis=-1) + 2 * np.sum(stress[..., 3:] ** 2, axis=-1)))


def von_mises(stress: Array) -> Array:
    """Return the (...) stress of (..., 6) [Pa]."""
    deviator = stress[..., :3] - stress[..., :3].mean(axis=-1, keepdims=True)
    return np.asarray(np.sqrt(1.5 * np.sum(deviator**2, axis=-1) + 3 * np.sum(stress[..., 3:] ** 2, axis=-1)))


def principal(stress: Array) -> Array:
    """Return the (..., 3) principal stresses of (..., 6), the largest last [Pa]."""
    tensors = stress[..., [0, 5, 4, 5, 1, 3, 4, 3, 2]].reshape(*stress.shape[:-1], 3, 3)
    return np.asarray(np.linalg.eigvalsh(tensors))


@compiled(nogil=True)
def _largest(stress, times, found):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Update the largest by stress (P, 6, m): the largest root of the characteristic cubic is looked for where mean + 2
    sqrt(J2/3), which it cannot exceed, is above what was seen, and top I - stress, by its leading minors, is not
    positive definite."""
    points, _, count = stress.shape
    invariant, above = np.empty(count), np.empty(count)
    for p in range(points):
        mises, top = found[0, p] ** 2 / 3, found[2, p]
        xx, yy, zz, yz, xz, xy = stress[p]
        for m in range(count):
            mean = (xx[m] + yy[m] + zz[m]) / 3
            a, b, c, d, e, f = xx[m] - mean, yy[m] - mean, zz[m] - mean, yz[m], xz[m], xy[m]
            invariant[m] = 0.5 * (a * a + b * b + c * c) + d * d + e * e + f * f
            above[m] = 4 / 3 * invariant[m] - (top - mean) * abs(top - mean)
        highest = np.argmax(above)  # first: few times are above it then
        for k in range(-1, count):
            m = int(highest) if k < 0 else k
            second = invariant[m]
            if second > mises:
                mises = second
                found[0, p], found[1, p] = np.sqrt(3 * mises), times[m]
            if above[m] <= 0:
                continue
            d, e, f = yz[m], xz[m], xy[m]
            x, y, z = top - xx[m], top - yy[m], top - zz[m]
            minor = x * y - f * f
            if x > 0 and minor > 0 and minor * z - x * d * d - y * e * e - 2 * d * e * f > 0:
                continue
            mean = (xx[m] + yy[m] + zz[m]) / 3
            a, b, c = xx[m] - mean, yy[m] - mean, zz[m] - mean
            reach = 2 * np.sqrt(second / 3)
            third = a * (b * c - d * d) - f * (f * c - d * e) + e * (f * d - b * e)
            size = 0.5 * reach**3
            angle = np.arccos(min(1.0, max(-1.0, 2 * third / size))) / 3 if size > 0 else 0.0
            value = mean + reach * np.cos(angle)
            if value > top:
                top = value
                found[2, p], found[3, p] = value, times[m]


@compiled(nogil=True)
def widen(stress, low, high):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Widen boxes (g, A, 5) from ``low`` to ``high`` by the deviators in Ilyushin's space, as `deviators` has them, of
    stress (g, A, 6, m)."""
    for g in range(stress.shape[0]):
        for a in range(stress.shape[1]):
            xx, yy, zz, yz, xz, xy = stress[g, a]
            for m in range(xx.size):
                one, two = (2 * xx[m] - yy[m] - zz[m]) / (2 * np.sqrt(3.0)), (yy[m] - zz[m]) / 2
                for k, value in enumerate((one, two, yz[m], xz[m], xy[m])):
                    low[g, a, k] = min(low[g, a, k], value)
                    high[g, a, k] = max(high[g, a, k], value)
