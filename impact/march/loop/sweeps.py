"""Several contacts at one time level: N >= 0 with N_c = law_c(pen_c - (W N)_c), W symmetric positive definite.

Linear laws form a linear complementarity problem, a spring k adding 1/k to its diagonal. Others are solved by sweeps of
exact scalar solves (nonlinear Gauss-Seidel), which descend the strictly convex energy of the step; films in the gaps,
too: their force does not decrease with the penetration at the end of the step either.
"""

from __future__ import annotations

import math

import numpy as np

from impact.march.laws import BLENDED, PASSIVE, SIGNORINI, SPRING
from impact.march.loop.compiled import compiled
from impact.march.loop.films import filmed_force
from impact.march.loop.forces import RIGID, contact_force


@compiled()
def linear_laws(codes, rules, numbers, w):
    """Return (whether all laws are linear in N, w with what their springs yield)."""
    p = len(codes)
    shifted = np.empty((p, p))
    linear = True
    for c in range(p):
        together = 0.0
        for d in range(p):
            shifted[c, d] = w[c, d]
            together += abs(w[c, d])
        passive = rules[c] == PASSIVE or (rules[c] == BLENDED and numbers[c, 0] * together >= RIGID)
        linear = linear and (codes[c] == SIGNORINI or (codes[c] == SPRING and passive))
        if codes[c] == SPRING:
            shifted[c, c] += 1.0 / numbers[c, 0]
    return linear, shifted


@compiled()
def by_sweeps(codes, rules, numbers, user, films, pen, pen_start, w, dt, force):
    """Find all forces of one step, in place, one after the other; where that crawls, by `_newton`.

    ``numbers`` (p, 3): parameters of the laws; ``films`` (p, 3) or None; ``pen`` (p,): without the forces. Returns
    whether they were found. A film's force is known to what round-off of its gap leaves; forces of stiff laws that
    depend on the speed may go round in a cycle of round-off, of parts in 1e14, and count as found below 1e-12.
    """
    p = pen.size
    for sweep in range(2000):
        change, size = 0.0, 0.0
        for c in range(p):
            pressed, pulled = alone(codes, rules, numbers, user, films, pen, pen_start, w, dt, force, c, 0.0)
            new = pressed + pulled
            if films is None or w[c, c] * abs(new - force[c]) > _slack(films, pen, w, force, c):
                change = max(change, abs(new - force[c]))
            size = max(size, abs(new))
            force[c] = new
        if change <= (1e-14 if sweep < 200 else 1e-12) * size:
            return True
        if sweep % 10 == 9:
            _newton(codes, rules, numbers, user, films, pen, pen_start, w, dt, force, change)
    return False


@compiled()
def alone(codes, rules, numbers, user, films, pen, pen_start, w, dt, force, c, more):
    """Return (the law's, the film's) force of contact ``c`` if the others' stay, its penetration raised by ``more``."""
    others, together = pen[c] + more, 0.0
    for d in range(pen.size):
        together += abs(w[c, d])
        if d != c:
            others -= w[c, d] * force[d]
    a, b, exponent = numbers[c]
    code, rule, start, w0 = codes[c], rules[c], pen_start[c], w[c, c]
    if films is not None and films[c, 0] > 0.0:
        film = (films[c, 0], films[c, 1], films[c, 2])
        return filmed_force(code, rule, a, b, exponent, user, film, others, start, w0, together, dt)
    return contact_force(code, rule, a, b, exponent, user, others, start, w0, together, dt), 0.0


@compiled()
def _slack(films, pen, w, force, c):
    """Return what round-off leaves unknown of the gap of contact ``c`` with a film."""
    size = films[c, 1] + abs(pen[c])
    for d in range(pen.size):
        size += abs(w[c, d] * force[d])
    return 1e-15 * size


@compiled()
def _newton(codes, rules, numbers, user, films, pen, pen_start, w, dt, force, worst):
    """Apply Newton's method to N_c = force of c alone; the best iterate is kept if it beats ``worst`` = max
    |difference|.

    The sweeps crawl where stiff contacts act almost at one place.
    """
    p = pen.size
    gain, matrix, trial = np.empty(p), np.empty((p, p)), np.empty(p)
    for c in range(p):
        trial[c] = force[c]
    for count in range(16):
        residual = 0.0
        for c in range(p):
            pressed, pulled = alone(codes, rules, numbers, user, films, pen, pen_start, w, dt, trial, c, 0.0)
            now = pressed + pulled
            gain[c] = now - trial[c]
            residual = max(residual, abs(gain[c]))
            small = 1e-7 * (w[c, c] * abs(now) + abs(pen[c])) + 1e-300
            pressed, pulled = alone(codes, rules, numbers, user, films, pen, pen_start, w, dt, trial, c, small)
            slope = (pressed + pulled - now) / small
            for d in range(p):
                matrix[c, d] = slope * w[c, d] if d != c else 1.0 + 1e-15
        if count > 0 and residual < worst:
            worst = residual
            for c in range(p):
                force[c] = trial[c]
        if not _solve(matrix, gain):
            return
        for c in range(p):
            trial[c] = max(trial[c] + gain[c], 0.0 if films is None else -films[c, 2])


@compiled()
def _solve(a, b):
    """Put a^-1 b in the place of b by Gauss with partial pivots, and return whether it is finite; LAPACK takes seconds
    to compile."""
    n = b.size
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if not abs(a[best, k]) > 0.0:
            return False
        for j in range(k, n):
            a[k, j], a[best, j] = a[best, j], a[k, j]
        b[k], b[best] = b[best], b[k]
        for i in range(k + 1, n):
            share = a[i, k] / a[k, k]
            for j in range(k + 1, n):
                a[i, j] -= share * a[k, j]
            b[i] -= share * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= a[k, j] * b[j]
        b[k] /= a[k, k]
        if not math.isfinite(b[k]):
            return False
    return True
