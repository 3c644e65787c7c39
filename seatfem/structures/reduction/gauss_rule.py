"""Nodes and weights of a Gauss rule from its recursion coefficients."""

from __future__ import annotations

import math

import numba
import numpy as np

from seatfem.structures.model import Array


def gauss_rule(diagonal: Array, below: Array) -> tuple[Array, Array]:
    """Return (values (k,) ascending, first components (k,)) of the eigenpairs of a symmetric tridiagonal matrix.

    Implicit QL with Wilkinson's shift, applied to the first row of the vectors only: O(k^2) time, O(k) memory, and no
    trouble with the clusters of equal values that Lanczos leaves, on which LAPACK's dstemr can fail.
    Source: Golub and Welsch, Math. Comp. 23 (1969) 221.

    Args:
        diagonal, below: (k,) and (k - 1,).
    """
    values, first = np.array(diagonal, dtype=float), np.zeros(len(diagonal))
    first[0] = 1.0
    _ql(values, np.append(below, 0.0), first)
    order = np.argsort(values)
    return values[order], first[order]


@numba.njit(cache=True)
def _ql(d: Array, e: Array, z: Array) -> None:
    """Diagonalise in place: ``d`` becomes the values, ``z`` (the first row of the unit matrix) their components."""
    n = len(d)
    for low in range(n):
        while True:
            high = low
            while high < n - 1 and abs(e[high]) > 2.3e-16 * (abs(d[high]) + abs(d[high + 1])):
                high += 1
            if high == low:
                break
            ratio = (d[low + 1] - d[low]) / (2 * e[low])
            g = d[high] - d[low] + e[low] / (ratio + math.copysign(math.hypot(ratio, 1.0), ratio))
            sine, cosine, moved, split = 1.0, 1.0, 0.0, False
            for i in range(high - 1, low - 1, -1):
                f, b = sine * e[i], cosine * e[i]
                r = math.hypot(f, g)
                e[i + 1] = r
                if r == 0.0:
                    d[i + 1] -= moved
                    e[high] = 0.0
                    split = True
                    break
                sine, cosine = f / r, g / r
                g = d[i + 1] - moved
                r = (d[i] - g) * sine + 2 * cosine * b
                moved = sine * r
                d[i + 1] = g + moved
                g = cosine * r - b
                z[i + 1], z[i] = sine * z[i] + cosine * z[i + 1], cosine * z[i] - sine * z[i + 1]
            if not split:
                d[low] -= moved
                e[low] = g
                e[high] = 0.0
