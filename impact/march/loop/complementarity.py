"""Rigid and linear-spring contacts at one time level: force >= 0, W force >= pen, complementary.

Solved exactly by block principal pivoting, warm-started from the last step's contacts.
Source: Judice & Pires, Comput. Oper. Res. 21 (1994) 587; Kim & Park, SIAM J. Sci. Comput. 33 (2011) 3261.
"""

from __future__ import annotations

import numpy as np

from impact.march.loop.compiled import compiled


@compiled()
def active_set(w, pen, force):
    """Return the force (p,) with force >= 0, w force >= pen, complementary; ``force`` on entry warm-starts the active
    set."""
    active_set_from(w, pen, force, np.empty(w.shape), np.full(pen.size + 1, -1))


@compiled()
def active_set_from(w, pen, force, low, held):
    """Return the same; ``low`` and ``held`` as `_spd_solve` left them, of the same ``w``.

    Whole blocks are exchanged while that lowers the number of violations, up to three times without progress; where
    that fails (w singular but for round-off), `_descend` ends in finitely many steps. A violation is a gap below
    -1e-13 of the terms that it is the sum of.
    """
    p, flies = pen.size, True
    for c in range(p):
        flies = flies and force[c] == 0.0 and pen[c] <= 0.0
    if flies:
        return
    active, bad = np.empty(p, dtype=np.bool_), np.empty(p, dtype=np.bool_)
    for c in range(p):
        active[c] = force[c] > 0.0
    fewest, tries = p + 1, 3
    gap, limit = np.empty(p), np.empty(p)
    while True:
        index = _members(active)
        pressed = _spd_solve(w, index, pen, low, held)
        force[:] = 0.0
        for i in range(index.size):
            force[index[i]] = pressed[i]
        _gaps(w, pen, force, gap, limit)
        count = 0
        for c in range(p):
            bad[c] = force[c] < 0.0 if active[c] else gap[c] < -limit[c]
            count += 1 if bad[c] else 0
        if count == 0:
            return
        tries -= 1
        if count < fewest:
            fewest, tries = count, 3
        if tries < 0:
            _descend(w, pen, force, low, held)
            return
        for c in range(p):
            active[c] = active[c] != bad[c]


@compiled()
def _descend(w, pen, force, low, held):
    """Return the same by steps that each lower force w force/2 - pen force: the contact most open to pressure joins,
    those that would pull leave. Source: Lawson & Hanson, Solving Least Squares Problems (1974), ch. 23."""
    p = pen.size
    active, barred = np.zeros(p, dtype=np.bool_), np.zeros(p, dtype=np.bool_)
    gap, limit = np.empty(p), np.empty(p)
    force[:] = 0.0
    for _ in range(10 * p):
        _gaps(w, pen, force, gap, limit)
        new = -1
        for c in range(p):
            if not active[c] and not barred[c] and gap[c] < -limit[c] and (new < 0 or gap[c] < gap[new]):
                new = c
        if new < 0:
            return
        active[new] = True
        while True:
            index = _members(active)
            if index.size == 0:
                break
            aim = _spd_solve(w, index, pen, low, held)
            share, first = 1.0, -1
            for i in range(index.size):
                if aim[i] <= 0.0:
                    now = force[index[i]]
                    part = now / (now - aim[i]) if now > 0.0 else 0.0
                    if first < 0 or part < share:
                        share, first = part, i
            for i in range(index.size):
                c = index[i]
                force[c] = aim[i] if first < 0 else force[c] + share * (aim[i] - force[c])
                if i == first or force[c] <= 0.0:
                    force[c], active[c] = 0.0, False
            if first < 0:
                break
        if active[new]:
            barred[:] = False
        else:
            barred[new] = True  # round-off alone had called for it


@compiled()
def _members(active):
    """Return where ``active`` (p,) is true; numpy's own functions take seconds to compile."""
    index, count = np.empty(active.size, dtype=np.int64), 0
    for c in range(active.size):
        if active[c]:
            index[count] = c
            count += 1
    return index[:count]


@compiled()
def _gaps(w, pen, force, gap, limit):
    """Return gap = w force - pen, and what round-off may make of it; w is symmetric."""
    for c in range(pen.size):
        gap[c], limit[c] = -pen[c], abs(pen[c])
    for d in range(pen.size):
        if force[d] != 0.0:
            column, f = w[d], force[d]
            for c in range(pen.size):
                term = column[c] * f
                gap[c] += term
                limit[c] += abs(term)
    for c in range(pen.size):
        limit[c] *= 1e-13


@compiled()
def _spd_solve(w, index, pen, low, held):
    """Solve w[index, index] x = pen[index] by Cholesky; a pivot lost to round-off (two ports almost at one place) is
    held at 1e-14 of its diagonal.

    ``low`` (p, p) keeps the factor and ``held`` (p + 1,) the number of contacts that it is of (-1: of none), and which.
    """
    n = index.size
    same = held[0] == n
    for i in range(n):
        same = same and held[i + 1] == index[i]
    if not same:
        held[0] = n
        for i in range(n):
            held[i + 1] = index[i]
            for j in range(i + 1):
                value = w[index[i], index[j]] - _dot(low[i], low[j], j)
                if i == j:
                    low[i, i] = np.sqrt(max(value, 1e-14 * w[index[i], index[i]]))
                else:
                    low[i, j] = value / low[j, j]
    x = np.empty(n)
    for i in range(n):
        x[i] = (pen[index[i]] - _dot(low[i], x, i)) / low[i, i]
    for i in range(n - 1, -1, -1):
        x[i] /= low[i, i]
        for k in range(i):
            x[k] -= low[i, k] * x[i]
    return x


@compiled(fastmath={"reassoc", "contract", "nsz"})
def _dot(a, b, n):
    """Return the sum of the first ``n`` products."""
    total = 0.0
    for k in range(n):
        total += a[k] * b[k]
    return total
