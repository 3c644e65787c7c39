"""A flat face as a strip between two lines, matched point by point.

A strip is a ring between two closed lines, however it winds, or a band with two ends. Cuts across it join points p and
q of its two lines, of arc lengths s and t, so that the integral of |q - p|^2 (ds + dt) along it is the least. With unit
tangents a and b there they lie square across both alike,

    (q - p) . (a + b) = 0

normals between parallel lines, rays between concentric circles; about a corner they fan out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from impact.greens.base import Array
from seatfem.structures.errors import ModelError
from seatfem.structures.shapes.loops import cross, inside, polygon_area

STEPS: Final = 1200  # fewest steps of each line
SLENDER: Final = 2.0  # least length over width of a face that is a strip
ROUND: Final = 0.5  # width over the radius of a bend above which it belongs to an end, not to a side
FOLDED: Final = 1e-3  # largest share of the area in which cuts may cross
FINER: Final = 4  # cuts between neighbouring ones at which a strip is cut off: within a hundredth of its width
LEAST: Final = 0.1  # share of a cut across, and of the face, under a reed that counts: less seals nothing
SAME: Final = 1e-6  # difference that counts as none, over a step or a turn


@dataclass(frozen=True, eq=False)
class Strip:
    """A part of a plane between two lines.

    Attributes:
        left, right: (k, 2) ends of cuts across it, in their order along it, the left line to the left [m].
        closed: whether the last cut is the first; the left line is then the inner one, and runs anticlockwise.
    """

    left: Array
    right: Array
    closed: bool

    @cached_property
    def middles(self) -> Array:
        """Return the (k, 2) middles of the cuts: its centre line."""
        return np.asarray((self.left + self.right) / 2)

    @cached_property
    def swept(self) -> Array:
        """Return the (k,) area up to each cut [m^2]."""
        across = self.right - self.left
        parts = cross((across[1:] + across[:-1]) / 2, np.diff(self.middles, axis=0))
        return np.concatenate([[0.0], np.cumsum(parts)])

    def check_narrow(self) -> None:
        """Raise `ModelError` of a broad face without a hole, on which a reed does not seal along a line."""
        outline = np.concatenate([self.left, self.right[::-1], self.left[:1]])
        area, around = float(self.swept[-1]), float(np.hypot(*np.diff(outline, axis=0).T).sum())
        if not self.closed and (ratio := area / _width_of(area, around) ** 2) < SLENDER:
            raise ModelError(
                f"a struck face without a hole is only {ratio:.2g} times as long as it is wide: lip segments need "
                f"rings, or strips at least {SLENDER:g} times as long as wide; strike it as a whole"
            )

    @cached_property
    def centroid(self) -> Array:
        """Return the (2,) centroid."""
        corners = np.concatenate([self.left, self.right[::-1]])
        ahead = np.roll(corners, -1, axis=0)
        twice = cross(corners, ahead)
        return np.asarray((twice[:, None] * (corners + ahead)).sum(axis=0) / (3 * twice.sum()))

    def moved(self, by: Array) -> Strip:
        """Return the strip moved by a vector (2,)."""
        return Strip(self.left + by, self.right + by, self.closed)

    def begun_on_the_axis(self) -> Strip:
        """Return a closed one from where its centre line crosses the x axis of its own centroid farthest out, or
        reaches farthest along it where it does not; an open one from its end at the lesser x."""
        x, y = (self.middles - self.centroid).T
        if not self.closed:
            turn = (x[-1], y[-1]) < (x[0], y[0])
            return Strip(self.right[::-1], self.left[::-1], closed=False) if turn else self
        up = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
        share = -y[up] / (y[up + 1] - y[up])
        at = x[up] + share * (x[up + 1] - x[up])
        k, part = int(np.argmax(x[:-1])), 0.0
        if len(at) and at.max() > 0:
            k, part = int(up[at.argmax()]), float(share[at.argmax()])
        lines = []
        for line in (self.left, self.right):
            first = line[k : k + 1] + part * (line[k + 1] - line[k])
            lines.append(np.concatenate([first, line[k + 1 : -1], line[: k + 1], first]))
        return Strip(lines[0], lines[1], closed=True)

    def within(self, loops: tuple[Array, ...]) -> tuple[Strip, ...]:
        """Return what of the strip lies within loops (n, 2), without cuts of which less than `LEAST` does, or several
        parts do. A closed one stays closed where no cut is left out."""
        at = np.linspace(0, len(self.left) - 1, FINER * (len(self.left) - 1) + 1)
        left, right = (_along(line, at, closed=self.closed) for line in (self.left, self.right))
        cut = (right - left)[:, None]
        starts, sides = np.concatenate(loops), np.concatenate([np.roll(loop, -1, axis=0) - loop for loop in loops])
        away, turn = starts - left[:, None], cross(cut, sides)
        with np.errstate(divide="ignore", invalid="ignore"):
            across, along = cross(away, sides) / turn, cross(away, cut) / turn
        met = (across > 0) & (across < 1) & (along >= 0) & (along < 1)
        begins, odd = inside(loops, left), met.sum(axis=1) % 2 == 1
        low = np.where(begins, 0.0, np.where(met, across, np.inf).min(axis=1))[:, None]
        high = np.where(begins ^ odd, 1.0, np.where(met, across, -np.inf).max(axis=1))[:, None]
        held = (high - low >= LEAST)[:, 0] & (begins + met.sum(axis=1) <= 2)
        low, high = (np.where(held[:, None], each, 0.5) for each in (low, high))
        left, right = left + low * (right - left), left + high * (right - left)
        if held.all():
            return (Strip(left, right, self.closed),)
        if self.closed:  # begun where it is left out
            order = np.roll(np.arange(len(held) - 1), -int(np.argmin(held)))
            left, right, held = left[order], right[order], held[order]
        ends = np.flatnonzero(np.diff(held, prepend=False, append=False)).reshape(-1, 2)
        return tuple(Strip(left[a:b], right[a:b], closed=False) for a, b in ends.tolist() if b - a > 1)


def strip_of(outer: Array, holes: list[Array]) -> Strip:
    """Return the strip of a face. Raises `ModelError` of one that is neither a ring nor a strip."""
    if len(holes) > 1:
        raise ModelError(
            f"a struck face has {len(holes)} holes, lip segments allow at most one: take ring-shaped faces, as of one "
            "port each, or strike it as a whole"
        )
    strip = _matched(*(_ring(holes[0], outer) if holes else _sides(outer)), closed=bool(holes))
    if np.minimum(np.diff(strip.swept), 0.0).sum() < -FOLDED * strip.swept[-1]:
        raise ModelError(
            "the struck face is no strip of slowly changing width: cuts across it cross each other; take a narrower "
            "face, or strike it as a whole"
        )
    return strip


def _fine(loop: Array) -> Array:
    """Return the (m + 1, 2) points of a closed line from one of its corners on, in at least `STEPS` steps, all corners
    kept."""
    closed = np.concatenate([loop, loop[:1]])
    lengths = np.hypot(*np.diff(closed, axis=0).T)
    counts = np.maximum(1, np.ceil(lengths / (lengths.sum() / STEPS)).astype(int))
    shares = np.concatenate([np.arange(count) / count for count in counts])
    which = np.repeat(np.arange(len(loop)), counts)
    points = closed[which] + shares[:, None] * (closed[which + 1] - closed[which])
    return np.concatenate([points, points[:1]])


def _ring(inner: Array, outer: Array) -> tuple[Array, Array, tuple[int, int], tuple[int, int]]:
    """Return both lines from the shortest cut on, as `_sides`."""
    left_line, right_line = _fine(inner), _fine(outer)
    away, nearest = scipy.spatial.cKDTree(right_line[:-1]).query(left_line[:-1])
    k = int(np.argmin(away))
    firsts = (k, int(np.asarray(nearest)[k]))
    left_line, right_line = (
        np.concatenate([line[n:-1], line[: n + 1]]) for line, n in zip((left_line, right_line), firsts, strict=True)
    )
    return left_line, right_line, (0, 0), (0, 0)


def _sides(loop: Array) -> tuple[Array, Array, tuple[int, int], tuple[int, int]]:
    """Return both long sides of a strip from one end to the other, and how many steps of either belong to the ends.

    Its ends are where its outline turns round within little more than the strip's width; half of each belongs to either
    side. Between a quarter and three quarters of that turn lies what a cut leaves of it: all of a straight end.
    """
    line = _fine(loop)
    steps = np.diff(line, axis=0)
    lengths = np.hypot(*steps.T)
    around, area = float(lengths.sum()), polygon_area(loop)
    width = _width_of(area, around)
    turn = steps[:, 0] + 1j * steps[:, 1]
    turned, count = np.angle(turn / np.roll(turn, 1)), len(turn)  # at each point
    excess = np.concatenate([[0.0], np.cumsum(np.tile(turned - ROUND * lengths / width, 2))])
    first, reach = np.arange(count)[:, None], np.arange(1, count // 3)
    travelled = np.concatenate([[0.0], np.cumsum(np.tile(lengths, 2))])
    scores, middles, ends = excess[first + reach] - excess[first], (travelled[first] + travelled[first + reach]) / 2, []
    place = travelled[:count]
    for _ in range(2):
        begin, more = divmod(int(np.argmax(scores)), scores.shape[1])
        stretch = (begin + np.arange(more + 1)) % count
        shares = np.cumsum(turned[stretch]) / turned[stretch].sum()
        low, high = (int(np.argmax(shares > quarter)) for quarter in (0.25 - SAME, 0.75 - SAME))
        away = (place[stretch] - place[begin]) % around
        middle = int(np.argmin(np.abs(away - (away[low] + away[high]) / 2)))
        ends.append((int(stretch[middle]), middle - low, high - middle))
        apart = np.abs((middles - place[stretch[middle]] + around / 2) % around - around / 2)
        scores[apart < around / 3] = -np.inf  # of a square the next side is a quarter away
    (a, before, behind), (b, before_last, behind_last) = sorted(ends)
    left_line, right_line = np.concatenate([line[b:-1], line[: a + 1]])[::-1], line[a : b + 1]
    return left_line, right_line, (before, behind), (behind_last, before_last)


def _width_of(area: float, around: float) -> float:
    """Return the width of a rectangle of this area and outline, or a quarter of the outline if there is none."""
    return (around / 2 - math.sqrt(max(around**2 / 4 - 4 * area, 0.0))) / 2


def _matched(left: Array, right: Array, start: tuple[int, int], end: tuple[int, int], *, closed: bool) -> Strip:
    """Return the points of both lines, those at one place joined by a cut. ``start``, ``end``: steps of both at their
    ends."""
    p, q = (line[:, 0] + 1j * line[:, 1] for line in (left, right))
    last = np.array([len(p) - 1, len(q) - 1])
    steps = np.array(start) + _walk(p[start[0] : len(p) - end[0]], q[start[1] : len(q) - end[1]])
    places = _square_across(p, q, steps, closed=closed)
    if closed:  # the first cut is where the walk ends: none of them is only near
        inner = places[(places.sum(axis=1) > 0) & (places.sum(axis=1) < last.sum())]
        places = np.concatenate([inner[-1:] - last, inner, inner[:1] + last])
    else:
        places = np.concatenate([[(0, 0), start], places, [last - end, last]])
    total = places.sum(axis=1)
    corners = [np.interp(np.arange(len(line)), places[:, k], total) for k, line in enumerate((p, q))]
    at = np.unique(np.concatenate([total, *corners]).clip(0.0, last.sum()))
    at = at[np.diff(at, prepend=-1.0) > SAME]
    of_left = np.interp(at, total, places[:, 0])
    return Strip(_along(left, of_left, closed=closed), _along(right, at - of_left, closed=closed), closed)


def _walk(p: Array, q: Array) -> NDArray[np.int64]:
    """Return the (m + n - 1, 2) numbers of points of both lines, one step of either at a time, from both first to both
    last, that have the least integral of |q - p|^2 along the steps."""
    cut = np.abs(q[None] - p[:, None]) ** 2
    along = np.zeros(cut.shape)
    np.cumsum((cut[:, 1:] + cut[:, :-1]) / 2 * np.abs(np.diff(q)), axis=1, out=along[:, 1:])
    least, by_left = along[0], np.zeros(cut.shape, dtype=bool)
    for i, step in enumerate(np.abs(np.diff(p)), 1):
        over = least + step * (cut[i - 1] + cut[i]) / 2
        least = along[i] + np.minimum.accumulate(over - along[i])
        by_left[i] = over <= least * (1 + 1e-14)
    i, j = len(p) - 1, len(q) - 1
    walk = [(i, j)]
    while i or j:
        i, j = (i - 1, j) if j == 0 or by_left[i, j] else (i, j - 1)
        walk.append((i, j))
    return np.array(walk[::-1])


def _square_across(p: Array, q: Array, steps: NDArray[np.int64], *, closed: bool) -> Array:
    """Return the (k, 2) places between those steps of a walk where cuts lie square across both lines."""
    (i, j), (a, b) = steps.T, (_tangents(line, closed=closed) for line in (p, q))
    lean = ((q[j] - p[i]) * (a[i] + b[j]).conj()).real
    at = np.flatnonzero(lean[:-1] * lean[1:] <= 0)
    before, after = lean[at], lean[at + 1]
    share = np.divide(before, before - after, out=np.ones(len(at)), where=before != after)
    return np.asarray(steps[at] + share[:, None] * (steps[at + 1] - steps[at]))


def _tangents(line: Array, *, closed: bool) -> Array:
    """Return the unit vectors along a line (m,) of complex points, at each of them."""
    steps = np.diff(line) / np.abs(np.diff(line))
    before = np.concatenate([steps[-1:] if closed else steps[:1], steps])
    mean = before + np.concatenate([steps, steps[:1] if closed else steps[-1:]])
    return np.asarray(mean / np.maximum(np.abs(mean), 1e-12))


def _along(line: Array, at: Array, *, closed: bool) -> Array:
    """Return the (k, 2) points of a line (m, 2) at places in steps, of a closed one beyond its ends, too."""
    steps = np.arange(len(line))
    at = at % (len(line) - 1) if closed else at
    return np.column_stack([np.interp(at, steps, line[:, 0]), np.interp(at, steps, line[:, 1])])
