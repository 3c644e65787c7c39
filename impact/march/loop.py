"""The compiled march: laws, several contacts at one time level, and the loop over steps.

All that the loop calls is in this file: numba's cache is renewed when the caller's own file changes, not when another
file that it calls into does.

Several contacts: find N >= 0 with N_c = law_c(pen_c - (W N)_c), W symmetric positive definite. Rigid and linear-spring
contacts form a linear complementarity problem (a spring k adds 1/k to its diagonal), solved exactly by block principal
pivoting, warm-started from the last step's contacts. Other laws are solved by sweeps of exact scalar solves (nonlinear
Gauss-Seidel), which descend the strictly convex energy of the step; films in the gaps (`impact.march.film`), too: their
force does not decrease with the penetration at the end of the step either.
Source: Judice & Pires, Comput. Oper. Res. 21 (1994) 587; Kim & Park, SIAM J. Sci. Comput. 33 (2011) 3261.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from impact.march.film import FAR
from impact.march.laws import BLENDED, HERTZ, HUNT_CROSSLEY, PASSIVE, SIGNORINI, SPRING, USER

LANES = 16  # scenes marched side by side
RIGID = 1e4  # Psi'' W0 from which on the blended rule is the passive one, to 1e-8 of the force
WAIT = 32  # steps before a stride is tried again that was too long
FLOOR = 1e-140  # added to every state at every step: damped-out modes never reach slow denormal numbers


@njit(cache=True)
def law_force(code, a, b, c, user, pen, pen_start, dt):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """N [N] >= 0 at the penetration ``pen``; ``pen_start`` is that at the start of the step."""
    if pen <= 0.0:
        return 0.0
    if code == SPRING:
        return a * pen
    if code == HERTZ:
        return a * pen * math.sqrt(pen)
    if code == HUNT_CROSSLEY:
        return a * pen**c * max(0.0, 1.0 + b * (pen - pen_start) / dt)
    if code == USER:
        force = user(pen, pen_start, dt)
        return 0.0 if force <= 0.0 else force  # a force that is not a number stays one, and is refused in the end
    return math.inf


@njit(cache=True)
def law_potential(code, a, b, c, pen):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Psi [J] of the laws that have one."""
    if pen <= 0.0:
        return 0.0
    if code == SPRING:
        return 0.5 * a * pen * pen
    if code == HERTZ:
        return 0.4 * a * pen * pen * math.sqrt(pen)
    return a * pen ** (c + 1.0) / (c + 1.0)


@njit(cache=True)
def _elastic_force(code, a, b, c, pen):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """dPsi/dpen [N]."""
    return 0.0 if pen <= 0.0 else a * pen if code == SPRING else a * pen ** (1.5 if code == HERTZ else c)


@njit(cache=True)
def _stiffness(code, a, b, c, pen):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """d2Psi/dpen2 [N/m]; of a spring also before it is touched."""
    if code == SPRING:
        return a
    exponent = 1.5 if code == HERTZ else c
    return 0.0 if pen <= 0.0 else exponent * a * pen ** (exponent - 1.0)


@njit(cache=True)
def contact_force(code, rule, a, b, c, user, pen, pen_start, w0, together, dt):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """The N >= 0 of one step by one of the rules of `impact.march.laws`.

    Each is one increasing scalar equation in N with one root; ``pen`` is the penetration at the end without N.
    ``together`` is what it yields per newton if all contacts press at once, ``w0`` if it presses alone.
    """
    unresolved = _stiffness(code, a, b, c, pen_start) * together if rule == BLENDED else 0.0
    if rule != PASSIVE and unresolved < RIGID:
        share = unresolved**2 / (1.0 + unresolved**2)
        return _by_energy(code, a, b, c, pen, pen_start, w0, dt, share)
    if pen <= 0.0:
        return 0.0
    if code == SIGNORINI:
        return pen / w0
    if code == SPRING:
        return a * pen / (1.0 + a * w0)
    if code == HERTZ:
        return _hertz_force(a, pen, w0)
    return _bracketed(code, a, b, c, user, pen, pen_start, w0, dt)


@njit(cache=True)
def _hertz_force(k, pen, w0):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Root of k (pen - w0 N)^1.5 - N in [0, pen/w0], by Newton on d = sqrt(pen - w0 N): d^2 + w0 k d^3 = pen.

    The polynomial is increasing and convex for d > 0, so Newton from above falls monotonically; both d^2 <= pen and
    w0 k d^3 <= pen bound the root, the smaller bound is the start.
    """
    d = math.sqrt(pen)
    if w0 > 0.0:
        d = min(d, (pen / (w0 * k)) ** (1.0 / 3.0))
    for _ in range(60):
        step = (d * d + w0 * k * d * d * d - pen) / (2.0 * d + 3.0 * w0 * k * d * d)
        d -= step
        if step <= 1e-16 * d:
            break
    return k * d * d * d


@njit(cache=True)
def _bracketed(code, a, b, c, user, pen, pen_start, w0, dt):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Root of N - law(pen - w0 N) by bisection-guarded regula falsi (Illinois)."""
    high = law_force(code, a, b, c, user, pen, pen_start, dt)
    if high <= 0.0 or w0 <= 0.0 or math.isnan(high):
        return high
    high = min(high, pen / w0)
    low, r_low = 0.0, -law_force(code, a, b, c, user, pen, pen_start, dt)
    r_high = high - law_force(code, a, b, c, user, pen - w0 * high, pen_start, dt)
    if r_high <= 0.0:
        return high
    n, top, side = high, high, 0
    for count in range(200):
        n = (low * r_high - high * r_low) / (r_high - r_low) if count % 4 < 3 else 0.5 * (low + high)
        r = n - law_force(code, a, b, c, user, pen - w0 * n, pen_start, dt)
        if r == 0.0 or high - low <= 4e-16 * top:
            break
        if math.isnan(r):
            return r
        if r > 0.0:
            high, r_high = n, r
            if side == 1:
                r_low *= 0.5
            side = 1
        else:
            low, r_low = n, r
            if side == -1:
                r_high *= 0.5
            side = -1
    return n


@njit(cache=True)
def _by_energy(code, a, b, c, pen, pen_start, w0, dt, share):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Root of p + w0 F(p) = pen by guarded regula falsi (Illinois) on p, F the `_step_force`.

    F does not decrease with p, hence N >= 0 and one root. Found in p, N keeps its relative accuracy for laws far
    stiffer than 1/w0.
    """
    force = _step_force(code, a, b, c, pen, pen_start, dt, share)
    if force <= 0.0 or w0 <= 0.0:
        return force
    low, high, r_high, side = pen - w0 * force, pen, w0 * force, 0
    if pen_start <= 0.0:
        low = max(low, 0.0)  # pen > 0 here, and where the end is open there is no force
    r_low = low + w0 * _step_force(code, a, b, c, low, pen_start, dt, share) - pen
    for count in range(200):
        p = (low * r_high - high * r_low) / (r_high - r_low) if count % 4 < 3 and r_high > r_low else 0.5 * (low + high)
        force = _step_force(code, a, b, c, p, pen_start, dt, share)
        r = p + w0 * force - pen
        if abs(r) <= 2e-16 * max(abs(pen), w0 * force) or high - low <= 2e-16 * max(abs(low), abs(high)):
            break
        if r > 0.0:
            high, r_high = p, r
            if side == 1:
                r_low *= 0.5
            side = 1
        else:
            low, r_low = p, r
            if side == -1:
                r_high *= 0.5
            side = -1
    return force


@njit(cache=True)
def _step_force(code, a, b, c, p, p0, dt, share):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """The secant slope of Psi from ``p0`` to ``p``, a ``share`` of it that at the end instead, times its damping."""
    force = _secant(code, a, b, c, p, p0)
    if share > 0.0:
        force += share * (_elastic_force(code, a, b, c, p) - force)
    if code == HUNT_CROSSLEY:
        force *= max(0.0, 1.0 + b * (p - p0) / dt)
    return force


@njit(cache=True)
def _secant(code, a, b, c, p, p0):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """(Psi(p) - Psi(p0))/(p - p0), without cancellation for p near p0."""
    if p <= 0.0 and p0 <= 0.0:
        return 0.0
    if p > 0.0 and p0 > 0.0:
        if code == SPRING:
            return 0.5 * a * (p + p0)
        if code == HERTZ:
            x, y = math.sqrt(p), math.sqrt(p0)  # (x^5 - y^5)/(x^2 - y^2)
            return 0.4 * a * (x**4 + x**3 * y + x * x * y * y + x * y**3 + y**4) / (x + y)
        middle, apart = 0.5 * (p + p0), (p - p0) / (p + p0)
        if abs(apart) < 1e-3:
            square = apart * apart
            series = 1.0 + c * (c - 1.0) / 6.0 * square * (1.0 + (c - 2.0) * (c - 3.0) / 20.0 * square)
            return a * middle**c * series
    return (law_potential(code, a, b, c, p) - law_potential(code, a, b, c, p0)) / (p - p0)


@njit(cache=True)
def _film(k, floor, tension, gap_start, gap, dt):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """The film's force over a step between two gaps, see `impact.march.film`."""
    x, y = min(max(gap_start, 0.0) + floor, FAR * floor), min(max(gap, 0.0) + floor, FAR * floor)
    return max(0.5 * k / dt * ((x - y) * (x + y)) / (x * y) ** 2, -tension)


@njit(cache=True)
def _film_alone(k, floor, tension, opening, gap_start, w0, dt):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Its force where it keeps the gap open that would be ``opening`` without it.

    G - a/G^2 is increasing and concave in G = gap + floor, so that Newton from below rises to the one root.
    """
    far = FAR * floor
    x, free, a = min(max(gap_start, 0.0) + floor, far), opening + floor, 0.5 * w0 * k / dt
    aim, y = free - a / (x * x), a ** (1.0 / 3.0)
    if aim >= 0.0:
        y = max(y, aim)
    else:
        y = math.sqrt(a / (min(y, math.sqrt(-a / aim)) - aim))
    if a > 0.0:
        for _ in range(60):
            step = (aim - y + a / (y * y)) / (1.0 + 2.0 * a / (y * y * y))
            y += step
            if step <= 1e-16 * y:
                break
    if y < far and 2.0 * a > y * y * y:  # where the film rules, its force follows from the gap
        return max((y - free) / w0, -tension)
    return _film(k, floor, tension, gap_start, y - floor, dt)


@njit(cache=True)
def filmed_force(code, rule, a, b, c, user, film, pen, pen_start, w0, together, dt):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """(the law's force, the film's) of one step, found together; the arguments as in `contact_force`.

    Closed at the end, the film is squeezed down to its floor, a known force; open, the law has none, unless a step that
    conserves leaves a penetration.
    """
    k, floor, tension = film
    squeezed = _film(k, floor, tension, -pen_start, 0.0, dt)
    pressed = contact_force(code, rule, a, b, c, user, pen - w0 * squeezed, pen_start, w0, together, dt)
    leaving = rule != PASSIVE and pen_start > 0.0
    if pen > w0 * (squeezed + pressed if leaving else squeezed):
        return pressed, squeezed
    if leaving:
        return _leaving(code, rule, a, b, c, film, pen, pen_start, w0, together, dt)
    return 0.0, _film_alone(k, floor, tension, -pen, -pen_start, w0, dt)


@njit(cache=True)
def _leaving(code, rule, a, b, c, film, pen, pen_start, w0, together, dt):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """The same of a step from a penetration ``pen_start`` > 0 to an open gap: the root p of p + w0 (both) = pen, by
    guarded regula falsi (Illinois) between what the largest forces leave and p = 0."""
    k, floor, tension = film
    stiff = _stiffness(code, a, b, c, pen_start) * together if rule == BLENDED else 0.0
    share = stiff * stiff / (1.0 + stiff * stiff)
    pressed, pulled, side = _step_force(code, a, b, c, 0.0, pen_start, dt, share), 0.0, 0
    low, high, r_low, r_high = pen - w0 * pressed, 0.0, 0.0, w0 * pressed - pen
    for count in range(200):
        p = (low * r_high - high * r_low) / (r_high - r_low) if count % 4 < 3 else 0.5 * (low + high)
        pressed = _step_force(code, a, b, c, p, pen_start, dt, share)
        pulled = _film(k, floor, tension, -pen_start, -p, dt)
        r = p + w0 * (pressed + pulled) - pen
        if abs(r) <= 4e-16 * max(abs(pen), w0 * (pressed - pulled)) or high - low <= 2e-16 * abs(low):
            break
        if r > 0.0:
            high, r_high = p, r
            if side == 1:
                r_low *= 0.5
            side = 1
        else:
            low, r_low = p, r
            if side == -1:
                r_high *= 0.5
            side = -1
    if w0 > 0.0:
        pulled = max((pen - p) / w0 - pressed, -tension)  # to round-off of the gap, as where a film acts alone
    return pressed, pulled


@njit(cache=True)
def active_set(w, pen, force):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Force (p,) with force >= 0, w force >= pen, complementary; ``force`` on entry warm-starts the active set."""
    _active_set(w, pen, force, np.empty(w.shape), np.full(pen.size + 1, -1))


@njit(cache=True)
def _active_set(w, pen, force, low, held):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """The same; ``low`` and ``held`` as `_spd_solve` left them, of the same ``w``.

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


@njit(cache=True)
def _members(active):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Where ``active`` (p,) is true; numpy's own functions take seconds to compile."""
    index, count = np.empty(active.size, dtype=np.int64), 0
    for c in range(active.size):
        if active[c]:
            index[count] = c
            count += 1
    return index[:count]


@njit(cache=True)
def _gaps(w, pen, force, gap, limit):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """gap = w force - pen, and what round-off may make of it; w is symmetric."""
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


@njit(cache=True)
def _descend(w, pen, force, low, held):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """The same by steps that each lower force w force/2 - pen force: the contact most open to pressure joins, those
    that would pull leave. Source: Lawson & Hanson, Solving Least Squares Problems (1974), ch. 23."""
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


@njit(cache=True)
def _spd_solve(w, index, pen, low, held):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
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


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _dot(a, b, n):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Sum of the first ``n`` products."""
    total = 0.0
    for k in range(n):
        total += a[k] * b[k]
    return total


@njit(cache=True)
def _linear(codes, rules, numbers, w):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """(whether all laws are linear in N, w with what their springs yield)."""
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


@njit(cache=True)
def contact_forces(codes, rules, numbers, user, pen, pen_start, w, dt, force):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """All forces of one step without films, in place; ``numbers`` (p, 3) parameters of the laws, ``pen`` (p,) without
    the forces.

    Returns whether they were found, as `_sweep` says.
    """
    linear, shifted = _linear(codes, rules, numbers, w)
    if linear:
        active_set(shifted, pen, force)
        return True
    return _sweep(codes, rules, numbers, user, None, pen, pen_start, w, dt, force)


@njit(cache=True)
def _sweep(codes, rules, numbers, user, films, pen, pen_start, w, dt, force):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """The same of laws that are not linear, and of films, one after the other; where that crawls, by `_newton`.

    A film's force is known to what round-off of its gap leaves; forces of stiff laws that depend on the speed may go
    round in a cycle of round-off, of parts in 1e14, and count as found where that is below 1e-12.
    """
    p = pen.size
    for sweep in range(2000):
        change, size = 0.0, 0.0
        for c in range(p):
            pressed, pulled = _alone(codes, rules, numbers, user, films, pen, pen_start, w, dt, force, c, 0.0)
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


@njit(cache=True)
def _slack(films, pen, w, force, c):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """What round-off leaves unknown of the gap of contact ``c`` with a film."""
    size = films[c, 1] + abs(pen[c])
    for d in range(pen.size):
        size += abs(w[c, d] * force[d])
    return 1e-15 * size


@njit(cache=True)
def _alone(codes, rules, numbers, user, films, pen, pen_start, w, dt, force, c, more):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """(the law's, the film's) force of contact ``c`` if the others' stay, its penetration raised by ``more``."""
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


@njit(cache=True)
def _newton(codes, rules, numbers, user, films, pen, pen_start, w, dt, force, worst):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Newton's method on N_c = force of c alone; the best iterate is kept if it beats ``worst`` = max |difference|.

    The sweeps crawl where stiff contacts act almost at one place.
    """
    p = pen.size
    gain, matrix, trial = np.empty(p), np.empty((p, p)), np.empty(p)
    for c in range(p):
        trial[c] = force[c]
    for count in range(16):
        left = 0.0
        for c in range(p):
            pressed, pulled = _alone(codes, rules, numbers, user, films, pen, pen_start, w, dt, trial, c, 0.0)
            now = pressed + pulled
            gain[c] = now - trial[c]
            left = max(left, abs(gain[c]))
            small = 1e-7 * (w[c, c] * abs(now) + abs(pen[c])) + 1e-300
            pressed, pulled = _alone(codes, rules, numbers, user, films, pen, pen_start, w, dt, trial, c, small)
            slope = (pressed + pulled - now) / small
            for d in range(p):
                matrix[c, d] = slope * w[c, d] if d != c else 1.0 + 1e-15
        if count > 0 and left < worst:
            worst = left
            for c in range(p):
                force[c] = trial[c]
        if not _solve(matrix, gain):
            return
        for c in range(p):
            trial[c] = max(trial[c] + gain[c], 0.0 if films is None else -films[c, 2])


@njit(cache=True)
def _solve(a, b):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Gauss with partial pivots, a^-1 b in the place of b, whether it is finite; LAPACK takes seconds to compile."""
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


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _advance(rows, q, p, force):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """One contact: one step of all poles after the last step's force; returns their sum, the gap's part."""
    a11, a21, a22, c1, c2 = rows
    u = 0.0
    for k in range(q.size):
        qk, pk = q[k], p[k]
        r = a11[k] * qk + (pk + c1[k] * force)
        q[k] = r
        p[k] = a21[k] * qk + (a22[k] * pk + (c2[k] * force + FLOOR))
        u += r
    return u


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _advance_many(rows, psi, along, q, p, drive, force, opening):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """The same for several contacts: ``opening`` (p,) gains the poles' part; ``along`` as of `Poles.along`."""
    a11, a21, a22, c1, c2 = rows
    group, size, directions = along
    if group.size == 0:
        directions = psi
    total = drive[: directions.shape[1]]
    total[:] = 0.0
    for c in range(force.size):
        if force[c] != 0.0:
            seen, f = directions[c], force[c]
            for k in range(total.size):
                total[k] += seen[k] * f
    if group.size == 0:
        for k in range(q.size):
            qk, pk, f = q[k], p[k], drive[k]
            q[k] = a11[k] * qk + (pk + c1[k] * f)
            p[k] = a21[k] * qk + (a22[k] * pk + (c2[k] * f + FLOOR))
        total = q
    else:
        for k in range(q.size):
            qk, pk, f = q[k], p[k], size[k] * total[group[k]]
            q[k] = a11[k] * qk + (pk + c1[k] * f)
            p[k] = a21[k] * qk + (a22[k] * pk + (c2[k] * f + FLOOR))
        total[:] = 0.0
        for k in range(q.size):
            total[group[k]] += size[k] * q[k]
    for c in range(force.size):
        seen, u = directions[c], 0.0
        for k in range(total.size):
            u += seen[k] * total[k]
        opening[c] += u


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _past(recent, force, rest, first, n):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """What the forces of steps ``first``..``n``-1 beyond ``rest`` do at the end of step ``n``; ``recent`` holds the
    weights of one block in reverse order, so that both are read forwards."""
    stop = recent.size - 1
    w, f = recent[stop - (n - first) : stop], force[first:n]
    u = 0.0
    for m in range(f.size):
        u += w[m] * (f[m] - rest)
    return u


@njit(cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz"})
def displaced(rows, state, w0, force):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """(n,) what the march of one contact adds to the gap under a known ``force`` (n,); rows and state as there."""
    a11, a21, a22, c1, c2 = rows
    q, p = state
    out, last = np.empty(force.size), 0.0
    for n in range(force.size):
        u = w0 * force[n]
        for k in range(q.size):  # `_advance`, written out: twice as fast without the march around it
            qk, pk = q[k], p[k]
            r = a11[k] * qk + (pk + c1[k] * last)
            q[k] = r
            p[k] = a21[k] * qk + (a22[k] * pk + (c2[k] * last + FLOOR))
            u += r
        out[n], last = u, force[n]
    return out


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _stride(power, swing, psi, q, p, ahead, line):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Where one stride of `impact.march.strides` would take all poles, in ``ahead`` (2, K); of each contact in ``line``
    (3, p) their part of the gap now and then, and how far it may stray from the line between; psi (p, K)."""
    b11, b12, b21, b22, err = power[0], power[1], power[2], power[3], power[4]
    q0, p0, u, v = swing[0], swing[1], swing[2], swing[3]
    far, near = ahead[0], ahead[1]
    for k in range(q.size):
        x, y = q[k] - q0[k], p[k] - p0[k]
        z = v[k] * y + u[k] * x
        far[k] = err[k] * math.sqrt(x * x + z * z)
    for c in range(psi.shape[0]):
        seen, now, strays = psi[c], 0.0, 0.0
        for k in range(q.size):
            now += seen[k] * q[k]
            strays += abs(seen[k]) * far[k]
        line[0, c], line[2, c] = now, strays
    for k in range(q.size):
        x, y = q[k] - q0[k], p[k] - p0[k]
        far[k] = q0[k] + b11[k] * x + b12[k] * y
        near[k] = p0[k] + b21[k] * x + b22[k] * y
    for c in range(psi.shape[0]):
        seen, then = psi[c], 0.0
        for k in range(q.size):
            then += seen[k] * far[k]
        line[1, c] = then


@njit(cache=True, fastmath={"reassoc", "contract", "nsz", "nnan"})
def _least(n, m, line, free, carried, clear):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """By how much any contact may be open at least, beyond the gap ``clear`` (p,), in ``m`` steps from ``n`` on; free
    (n, p)."""
    contacts, least = carried.size, np.inf
    slope, base = np.empty(contacts), np.empty(contacts)
    for c in range(contacts):
        slope[c], base[c] = (line[1, c] - line[0, c]) / m, line[0, c] - line[2, c] - carried[c] - clear[c]
    for j in range(m):
        for c in range(contacts):
            least = min(least, free[n + j, c] + base[c] + slope[c] * (j + 1))
    return least


@njit(cache=True)
def _flight(n, stop, strides, level, psi, q, p, ahead, line, free, carried, clear, gap):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """One stride from step ``n`` on, of ``level`` or shorter: (steps flown, level for the next one).

    gap (n + 1, p) is filled, on the way by the line.
    """
    lengths, powers, swing = strides
    while level >= 0:
        m = lengths[level]
        if n + m <= stop:
            _stride(powers[level], swing, psi, q, p, ahead, line)
            if _least(n, m, line, free, carried, clear) > 0.0:
                for k in range(q.size):
                    q[k], p[k] = ahead[0, k], ahead[1, k]
                for j in range(m):
                    share = (j + 1) / m
                    for c in range(carried.size):
                        part = line[0, c] + share * (line[1, c] - line[0, c])
                        gap[n + j + 1, c] = free[n + j, c] + part - carried[c]
                return m, min(level + 1, lengths.size - 1)
        level -= 1
    return 0, 0


@njit(cache=True, nogil=True)
def march_one(  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    start, stop, rows, state, free, memory, recent, block, w0, law, film, user, dt, rest, strides, force, gap, pulls
):
    """Steps ``start``..``stop``-1 of one contact; force (n,) and gap (n + 1,) are filled in place.

    rows: `Poles.folded`; state: (q, p). free (n,): gap at the end of each step without contact. memory (n,): what
    finished blocks add. recent: `BlockedSum.recent`. law: (code, rule, three numbers). film: its three numbers; None: a
    march without any is compiled on its own. rest: force carried since ever. strides: lengths, powers and
    swing of `Strides`; where there are any, force is zero beforehand. pulls (n,): the film's part of the force.
    """
    q, p = state
    code, rule, a, b, c = law
    level, n, wait = 0, start, start
    psi, ahead, line, carried = np.empty((1, q.size)), np.empty((2, q.size)), np.empty((3, 1)), np.empty(1)
    carried[0], opens, gaps = w0 * rest, free.reshape(-1, 1), gap.reshape(-1, 1)
    clear = np.zeros(1)
    if film is not None:
        clear[0] = FAR * film[1]
    for k in range(q.size):
        psi[0, k] = 1.0
    while n < stop:
        if strides[0].size > 0 and n >= wait and n > 0 and force[n - 1] == 0.0 and gap[n] > clear[0]:
            flown, level = _flight(n, stop, strides, level, psi, q, p, ahead, line, opens, carried, clear, gaps)
            n += flown
            if flown > 0:
                continue
            wait = n + WAIT
        last = force[n - 1] - rest if n > 0 else 0.0
        opening = free[n] + _advance(rows, q, p, last)
        if recent.size > 0:
            opening += memory[n] + _past(recent, force, rest, n - n % block, n)
        opening -= w0 * rest
        if film is not None:
            pressed, pulled = filmed_force(code, rule, a, b, c, user, film, -opening, -gap[n], w0, w0, dt)
            f, pulls[n] = pressed + pulled, pulled
        else:
            f = contact_force(code, rule, a, b, c, user, -opening, -gap[n], w0, w0, dt)
        force[n] = f
        gap[n + 1] = opening + w0 * f
        n += 1


@njit(cache=True, nogil=True)
def march_many(  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    start, stop, poles, state, free, memory, recent, block, w0, laws, films, user, dt, rest, strides, force, gap, pulls
):
    """The same for p contacts: force, pulls and memory (p, n), gap (n + 1, p), free (n, p), recent (p, p, block),
    w0 (p, p), films (p, 3), the first number 0 of a contact without one. Returns how many steps' forces were not found,
    as `_sweep` says."""
    rows, psi, along = poles
    unsolved = 0
    q, v = state
    codes, rules, numbers = laws
    contacts = rest.size
    carried, pen, before = np.zeros(contacts), np.empty(contacts), np.empty(contacts)
    opening, last, warm = np.empty(contacts), np.zeros(contacts), np.zeros(contacts)
    drive = np.empty(q.size)
    linear, shifted = _linear(codes, rules, numbers, w0)
    low, held = np.empty((contacts, contacts)), np.full(contacts + 1, -1)
    clear = np.zeros(contacts)
    if films is not None:
        linear = False
    heard = np.zeros((contacts, contacts), dtype=np.bool_)  # a seat and a stopper do not hear each other
    for c in range(contacts):  # written out: numpy's assignments and products take seconds to compile
        warm[c] = force[c, start - 1] if start > 0 else 0.0
        if films is not None and films[c, 0] > 0.0:
            clear[c] = FAR * films[c, 1]
        for d in range(contacts):
            carried[c] += w0[c, d] * rest[d]
            for m in range(recent.shape[2]):
                if recent[c, d, m] != 0.0:
                    heard[c, d] = True
                    break
    level, n, wait = 0, start, start
    ahead, line = np.empty((2, q.size)), np.empty((3, contacts))
    while n < stop:
        if strides[0].size > 0 and n >= wait and n > 0:
            apart = True
            for c in range(contacts):
                apart = apart and force[c, n - 1] == 0.0 and gap[n, c] > clear[c]
            if apart:
                flown, level = _flight(n, stop, strides, level, psi, q, v, ahead, line, free, carried, clear, gap)
                n += flown
                if flown > 0:
                    continue
                wait = n + WAIT
        for c in range(contacts):
            last[c] = force[c, n - 1] - rest[c] if n > 0 else 0.0
            opening[c] = free[n, c] - carried[c]
        _advance_many(rows, psi, along, q, v, drive, last, opening)
        for c in range(contacts):
            if recent.size > 0:
                opening[c] += memory[c, n]
                for d in range(contacts):
                    if heard[c, d]:
                        opening[c] += _past(recent[c, d], force[d], rest[d], n - n % block, n)
            pen[c], before[c] = -opening[c], -gap[n, c]
        if linear:
            _active_set(shifted, pen, warm, low, held)
        elif not _sweep(codes, rules, numbers, user, films, pen, before, w0, dt, warm):
            unsolved += 1
        closed = gap[n + 1]
        for c in range(contacts):
            closed[c] = opening[c]
        for d in range(contacts):
            if warm[d] != 0.0:
                for c in range(contacts):
                    closed[c] += w0[d, c] * warm[d]
        for c in range(contacts):
            force[c, n] = warm[c]
            if films is not None and films[c, 0] > 0.0:
                pressed, pulled = _alone(codes, rules, numbers, user, films, pen, before, w0, dt, warm, c, 0.0)
                pulls[c, n] = pulled if pressed > 0.0 else warm[c]
        n += 1
    return unsolved


@intrinsic
def _advance_lanes(typing: Any, rows: Any, state: Any, force: Any, total: Any) -> Any:  # pragma: no cover - compiled
    """`_advance` for LANES scenes at once, in vector instructions: rows (K, 5), state (K, 2, LANES), force and total
    (LANES,). Written as LLVM vectors: the loop vectoriser does not find this form, as the arrays might overlap."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        arrays = [context.make_array(t)(context, builder, a) for t, a in zip(signature.args, arguments, strict=True)]
        poles = builder.extract_value(arrays[0].shape, 0)
        number, lane = poles.type, ir.IntType(32)
        vector = ir.VectorType(ir.DoubleType(), LANES)
        empty, first = ir.Constant(vector, ir.Undefined), ir.Constant(ir.VectorType(lane, LANES), [0] * LANES)

        def at(array: Any, index: Any) -> Any:
            return builder.bitcast(builder.gep(array.data, [index]), vector.as_pointer())

        def load(array: Any, index: Any) -> Any:
            value = builder.load(at(array, index))
            value.align = 8
            return value

        def everywhere(index: Any) -> Any:
            value = builder.load(builder.gep(arrays[0].data, [index]))
            return builder.shuffle_vector(builder.insert_element(empty, value, lane(0)), empty, first)

        def fused(x: Any, y: Any, z: Any) -> Any:
            return builder.fadd(builder.fmul(x, y, flags=("contract",)), z, flags=("contract",))

        f = load(arrays[2], number(0))
        floor = ir.Constant(vector, [FLOOR] * LANES)
        u = cgutils.alloca_once_value(builder, ir.Constant(vector, [0.0] * LANES))  # type: ignore[no-untyped-call]
        with cgutils.for_range(builder, poles) as loop:
            row = builder.mul(loop.index, number(5))
            a11, a21, a22, c1, c2 = (everywhere(builder.add(row, number(i))) for i in range(5))
            here = builder.mul(loop.index, number(2 * LANES))
            there = builder.add(here, number(LANES))
            q, p = load(arrays[1], here), load(arrays[1], there)
            r = fused(a11, q, fused(c1, f, p))
            builder.store(r, at(arrays[1], here), align=8)
            builder.store(fused(a21, q, fused(a22, p, fused(c2, f, floor))), at(arrays[1], there), align=8)
            builder.store(builder.fadd(builder.load(u), r), u)
        builder.store(builder.load(u), at(arrays[3], number(0)), align=8)
        return context.get_dummy_value()

    return types.void(rows, state, force, total), build


@njit(cache=True, nogil=True)
def march_lanes(rows, state, free, scales, w0, law, user, dt, force, approach):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """LANES scenes of one contact; state (K + 1, 2, LANES) zero, its last row is scratch; force (n, LANES) is filled.

    free (3, n + 1): gap without contact, per unit of the scales (3, LANES) after the first row, which all share with
    scales[0] as their initial gap. approach (LANES,): closing speed over the step before the first contact.
    """
    code, rule, a, b, c = law
    last, total = state[-1, 0], state[-1, 1]
    gap, before = np.empty(LANES), np.empty(LANES)
    met = np.zeros(LANES, dtype=np.bool_)
    for i in range(LANES):
        gap[i] = scales[0, i] + free[0, 0] + free[1, 0] * scales[1, i] + free[2, 0] * scales[2, i]
    before[:] = gap
    for n in range(force.shape[0]):
        _advance_lanes(rows, state, last, total)  # type: ignore[call-arg]
        base, moved, released = free[0, n + 1], free[1, n + 1], free[2, n + 1]
        for i in range(LANES):
            opening = scales[0, i] + base + moved * scales[1, i] + released * scales[2, i] + total[i]
            f = 0.0
            if opening < 0.0 or rule != PASSIVE:
                f = contact_force(code, rule, a, b, c, user, -opening, -gap[i], w0, w0, dt)
            if f > 0.0 and not met[i]:
                met[i] = True
                if n > 0:
                    approach[i] = (before[i] - gap[i]) / dt
            before[i] = gap[i]
            gap[i] = opening + w0 * f
            last[i] = f
            force[n, i] = f
