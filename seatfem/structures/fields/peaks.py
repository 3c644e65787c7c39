"""The largest stress over time at many points, block by block of the record: memory does not grow with its length."""

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
from seatfem.machine.resources import compiled_threads
from seatfem.structures.model import Array

TIMES_PER_RADIAN: Final = 2  # samples of stress per radian of the highest retained frequency
LITTLE: Final = 1e-3  # stress bound of the coordinates that may be dropped, over the largest stress
BETWEEN: Final = 5e-3  # largest error of a peak between samples, over the largest stress; von Mises: sqrt(3/2) times
_BLOCK: Final = 1024  # time samples of a block
FEW: Final = 6  # least number of coordinates a place from which on all of them are evaluated at all times
_PLACES: Final = 16  # fewest places that a thread evaluates at once
_NUMBERS: Final = 2**18  # stress values that a thread holds, unless `_PLACES` places need more

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
    """The largest stress [Pa] of each point in each time span of a run: (s, 4, P), the four arrays of `Largest` for
    each of ``spans``; zero where a span has no samples."""

    spans: Spans
    by_span: Array

    @property
    def initial(self) -> Largest:
        """Return the largest stress until the first touch."""
        return self.within(self.spans.until(self.spans.touch))

    @property
    def after_contact(self) -> Largest:
        """Return the largest stress since the first touch."""
        return self.within(self.spans.after(self.spans.touch))

    def within(self, chosen: slice) -> Largest:
        """Return the largest stress over the chosen spans."""
        spans = self.by_span[chosen]
        if not len(spans):
            return Largest(*np.zeros_like(self.by_span[0]))
        mises, principal = (spans[:, number].argmax(axis=0)[None] for number in (0, 2))
        of_each = ((0, mises), (1, mises), (2, principal), (3, principal))
        return Largest(*(np.take_along_axis(spans[:, number], best, axis=0)[0] for number, best in of_each))


class Field(Protocol):
    """Stress at G places, each at A angles (A = 1 unless the body is of revolution), as a sum of K time coordinates."""

    @property
    def points(self) -> Array:
        """Return the (G A, d) places [m]."""

    @property
    def radians(self) -> Array:
        """Return the (K,) angular frequency of each coordinate [rad/s]; 0 for the static part of a force."""

    @property
    def bounds(self) -> Array:
        """Return the (G, K) largest norm, over the angles, of each place's stress under a unit coordinate."""

    def at(self, which: NDArray[np.int64] | NDArray[np.bool_]) -> Field:
        """Return the field of some of its points, each at its own angle."""

    def coordinates(self, force: Array, dt: float, stride: int) -> Iterator[Array]:
        """Yield (..., K) blocks of coordinates under port forces, at every ``stride``-th time from t = 0 on."""

    def stress(self, which: Integers, values: Array, kept: Integers) -> Iterator[Array]:
        """Yield the (g, A, 6, m) stress [Pa] at the places ``which``, a few at once and in order, from the ``values``
        (k, m) of the coordinates numbered ``kept`` (k,); the next block may overwrite the array."""


def largest(
    field: Field, force: Array, dt: float, *, since: float = math.nan, workers: int | None = None
) -> LargestStress:
    """Return the largest stress [Pa] at each point, sampled `TIMES_PER_RADIAN` times a radian.

    The force (n + 1, p) is as in `seatfem.structures.fields.recovery.histories`. A place is skipped in blocks of times
    in which the sum of its bounds is below its present maximum. ``since``: start of a landing [s], which divides the
    record into further spans; nan without one. ``workers`` threads (default: as many as compiled code may use)
    share the places; the result does not depend on their number.
    """
    spans = Spans.from_forces(force, dt, since)
    if not len(field.points):
        return LargestStress(spans, np.zeros((spans.count, 4, 0)))
    bounds, stride = field.bounds, stride_of(field, dt)
    peaks = np.zeros((spans.count, 4, len(bounds), len(field.points) // len(bounds)))
    with ThreadPoolExecutor(workers or compiled_threads()) as pool:
        for number, part in blocks_of_times(field, force, dt, stride):
            times = number * stride
            numbers = spans.find_numbers(times)
            for span in np.unique(numbers):
                chosen = np.flatnonzero(numbers == span)
                when = dt * times[chosen].astype(np.float64)
                _update_peaks(pool, field, part[chosen], when, bounds, peaks[span])
    return LargestStress(spans, peaks.reshape(spans.count, 4, -1))


def stride_of(field: Field, dt: float) -> int:
    """Return the number of steps ``dt`` [s] between two samples of stress, from `TIMES_PER_RADIAN`."""
    return max(1, int(1.0 / (TIMES_PER_RADIAN * float(field.radians.max()) * dt)))


def blocks_of_times(field: Field, force: Array, dt: float, stride: int) -> Iterator[tuple[Integers, Array]]:
    """Yield (m,) sample numbers and the (m, K) coordinates then, at most `_BLOCK` at once."""
    first = 0
    for part in field.coordinates(force, dt, stride):
        for start in range(0, len(part), _BLOCK):
            some = part[start : start + _BLOCK]
            yield first + start + np.arange(len(some), dtype=np.int64), some
        first += len(part)


def _update_peaks(pool: Executor, field: Field, part: Array, times: Array, bounds: Array, peaks: Array) -> None:
    """Update the ``peaks`` (4, G, A), arrays of `Largest`, with the stress at the ``times`` (m,) of a block."""
    retained = np.arange(part.shape[1])
    if FEW * bounds.shape[0] * peaks.shape[2] > len(retained):  # for fewer places thinning takes longer than the stress
        largest = max(peaks[0].max(initial=0.0), peaks[2].max(initial=0.0))
        part, times, retained = thinned(part, times, bounds.max(axis=0, initial=0.0), largest)
    if not retained.size:
        return
    lowest = np.minimum(peaks[0] / math.sqrt(1.5), peaks[2]).min(axis=1)
    candidates = np.flatnonzero(bounds[:, retained] @ np.abs(part).max(axis=0) > lowest)
    values = np.ascontiguousarray(part.T)
    at_once = max(_PLACES, _NUMBERS // (6 * peaks.shape[2] * len(times)))

    def update(remaining: Integers) -> None:
        for stress in field.stress(remaining, values, retained):
            places, remaining = remaining[: len(stress)], remaining[len(stress) :]
            place_peaks = peaks[:, places].reshape(4, -1)
            _largest(stress.reshape(-1, 6, len(times)), times, place_peaks)
            peaks[:, places] = place_peaks.reshape(4, len(places), -1)

    shares = [candidates[start : start + at_once] for start in range(0, len(candidates), at_once)]
    for _ in pool.map(update, shares) if len(shares) > 1 else map(update, shares):
        pass


def thinned(part: Array, times: Array, bound: Array, largest: float) -> tuple[Array, Array, Integers]:
    """Return fewer coordinates (m', k) at fewer times (m',), and the (k,) numbers of the retained coordinates.

    The dropped coordinates add up to at most `LITTLE` of ``largest`` [Pa]. Between two samples s steps apart the
    stress departs from linear interpolation by at most s^2/8 of its second difference, and s is chosen such that this
    is below `BETWEEN` of ``largest``; along a straight line a norm is largest at an end.
    """
    weight = bound * np.abs(part).max(axis=0)
    order = np.argsort(weight)
    retained = np.sort(order[np.cumsum(weight[order]) >= LITTLE * largest]).astype(np.int64)
    part = part[:, retained]
    bend = float((np.abs(np.diff(part, 2, axis=0)) @ bound[retained]).max(initial=0.0))
    step = max(1, int(min(math.sqrt(8 * BETWEEN * largest / bend) if bend else np.inf, len(part))))
    samples = np.append(np.arange(0, len(part) - 1, step), len(part) - 1)
    return part[samples], times[samples], retained


_AT_ONCE: Final = 256  # places whose stress over one block of times is held at once


def mises_range(field: Field, force: Array, dt: float, *, since: int = 0) -> Array:
    """Return (P,) sqrt 3 times the diagonal of the box, in Ilyushin's space, that encloses a point's deviators [Pa].

    Under proportional stress this is the von Mises range (of the difference of the two most distant states), otherwise
    1 to sqrt 5 times that range: no point with a large range is missed. Times are sampled as in `largest`.

    Args:
        field: stress of a body.
        force, dt: as in `seatfem.structures.fields.recovery.histories`.
        since: number of the first time step that counts.
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


def hottest(ranges: Array, regions: NDArray[np.str_], each: int) -> NDArray[np.int64]:
    """Return the indices of the points (P,) with the largest stress ranges, ``each`` of every region."""
    order = np.argsort(-ranges, kind="stable")
    return np.concatenate([order[regions[order] == name][:each] for name in np.unique(regions)]).astype(np.int64)


def norms(stress: Array) -> Array:
    """Return the (...) Frobenius norms of stress (..., 6), bounds of principal and of sqrt(2/3) von Mises stress."""
    return np.asarray(np.sqrt(np.sum(stress[..., :3] ** 2, axis=-1) + 2 * np.sum(stress[..., 3:] ** 2, axis=-1)))


def von_mises(stress: Array) -> Array:
    """Return the (...) von Mises stress of stress tensors (..., 6) [Pa]."""
    deviator = stress[..., :3] - stress[..., :3].mean(axis=-1, keepdims=True)
    return np.asarray(np.sqrt(1.5 * np.sum(deviator**2, axis=-1) + 3 * np.sum(stress[..., 3:] ** 2, axis=-1)))


def principal(stress: Array) -> Array:
    """Return the (..., 3) principal stresses of stress tensors (..., 6), the largest last [Pa]."""
    tensors = stress[..., [0, 5, 4, 5, 1, 3, 4, 3, 2]].reshape(*stress.shape[:-1], 3, 3)
    return np.asarray(np.linalg.eigvalsh(tensors))


@compiled(nogil=True)
def _largest(stress, times, peaks):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Update the peaks (4, P) with stress (P, 6, m). The largest principal stress (root of the characteristic cubic) is
    computed only where its bound mean + 2 sqrt(J2/3) exceeds the present peak (top) and top I - stress is not positive
    definite by its leading minors."""
    points, _, count = stress.shape
    invariant, above = np.empty(count), np.empty(count)
    for p in range(points):
        mises, top = peaks[0, p] ** 2 / 3, peaks[2, p]
        xx, yy, zz, yz, xz, xy = stress[p]
        for m in range(count):
            mean = (xx[m] + yy[m] + zz[m]) / 3
            a, b, c, d, e, f = xx[m] - mean, yy[m] - mean, zz[m] - mean, yz[m], xz[m], xy[m]
            invariant[m] = 0.5 * (a * a + b * b + c * c) + d * d + e * e + f * f
            above[m] = 4 / 3 * invariant[m] - (top - mean) * abs(top - mean)
        highest = np.argmax(above)  # evaluated first: few other times exceed it
        for k in range(-1, count):
            m = int(highest) if k < 0 else k
            second = invariant[m]
            if second > mises:
                mises = second
                peaks[0, p], peaks[1, p] = np.sqrt(3 * mises), times[m]
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
                peaks[2, p], peaks[3, p] = value, times[m]


@compiled(nogil=True)
def widen(stress, low, high):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Widen the boxes from ``low`` to ``high`` (g, A, 5) in Ilyushin's space until they enclose the deviators of stress
    (g, A, 6, m); the five components are those of `deviators`."""
    for g in range(stress.shape[0]):
        for a in range(stress.shape[1]):
            xx, yy, zz, yz, xz, xy = stress[g, a]
            for m in range(xx.size):
                one, two = (2 * xx[m] - yy[m] - zz[m]) / (2 * np.sqrt(3.0)), (yy[m] - zz[m]) / 2
                for k, value in enumerate((one, two, yz[m], xz[m], xy[m])):
                    low[g, a, k] = min(low[g, a, k], value)
                    high[g, a, k] = max(high[g, a, k], value)
