"""The loop over steps of different lengths: fine steps where bodies touch and ring, leaps where the motion is smooth.

All bodies are sums of poles, whose coordinates contain the initial state, the loads and the contact forces. A *leap* is
one step as long as m fine ones, with its own matrices. It is rejected, and repeated with a quarter of its length, if a
contact opens or closes in it, if an open contact might close on the way, if a gap deviates too far from the straight
line, or if the forces deviate from the line through the last two by more than is allowed. A *level* is a step length.
"""

from __future__ import annotations

import math

import numpy as np

from impact.march.laws import FAR, ROUGH
from impact.march.loop.compiled import compiled
from impact.march.loop.forces import FLOOR, add_gaps, advance, advance_many, contact_force, filmed_force, load_poles
from impact.march.loop.joints import joint_step, update_deepest
from impact.march.loop.marches import active_set_from, alone, sweep_forces

STEP, ROW, LEVEL, SINCE, CALM, WAIT, PENDING, UNSOLVED, PLACE = range(9)
"""Places in the state of the loop: fine steps done, rows written, present level, rows written since it was entered, how
many of the last rows were smooth, fine step before which no longer step is tried, whether the last force has yet to act
on the poles (1; -1: rates are unscaled), steps whose forces did not converge, place in the steps that are followed."""
PATIENCE = 32  # fine steps after which a leap is tried again
SMOOTH = 8  # smooth rows before a longer step is tried; they are compared over four and eight rows
BEFORE = 2.0  # fine steps between a leap and the next touch, for the closing speed
STRAIGHT = 0.1  # largest deviation of a load from a line within a leap, over the one allowed to the forces
RISE = 4  # ratio of the lengths of neighbouring levels


@compiled(fastmath={"reassoc", "contract", "nsz"})
def restore_rates(q, p, scale, gains, pushed):
    """Apply the last force, as modal loads ``pushed`` (K,), to the poles, and turn their scaled rates ``p`` into rates
    [1/s]."""
    for k in range(q.size):
        q[k] += gains[0, k] * pushed[k]
        p[k] = (p[k] / scale[k] if abs(scale[k]) > 1e-100 else 0.0) + gains[1, k] * pushed[k]


@compiled(fastmath={"reassoc", "contract", "nsz"})
def _advance_leap(rows, gains, ramps, psi, drive, amplitude, q, p, ahead, opening):
    """Write into ``ahead`` (3, K) the coordinates and rates of the poles after one step without contact, and their
    modal loads; add their part of the gaps to ``opening`` (p,).

    rows (4, K): a11, a12, a21, a22; gains, ramps (2, K): effects of a unit force, and of one that rises linearly by a
    unit with the mean 0; drive (L, S): load shapes on the first poles; amplitude (2, L): means and rises of the loads.
    """
    a11, a12, a21, a22 = rows[0], rows[1], rows[2], rows[3]
    far, rate, load = ahead[0], ahead[1], ahead[2]
    for k in range(q.size):
        far[k] = a11[k] * q[k] + a12[k] * p[k]
        rate[k] = a21[k] * q[k] + a22[k] * p[k] + FLOOR
        load[k] = 0.0
    for i in range(amplitude.shape[1]):
        a, b, shape = amplitude[0, i], amplitude[1, i], drive[i]
        for k in range(shape.size):
            load[k] += shape[k] * a
            far[k] += shape[k] * (gains[0, k] * a + ramps[0, k] * b)
            rate[k] += shape[k] * (gains[1, k] * a + ramps[1, k] * b)
    add_gaps(psi, far, opening)


@compiled(fastmath={"reassoc", "contract", "nsz"})
def _add_contact_forces(gains, strays, rest, pushed, q, p, ahead):
    """Add the effect of the modal contact forces ``pushed`` (K,) to ``ahead``, and write into its last row how far each
    pole may deviate from the straight line between the ends of the step.

    rest (3, K): static displacement of each pole per unit of force, and u, v of its amplitude about it, A^2 = x^2 +
    (u x + v q')^2; strays (2, K): largest deviation over A, and, of a rigid-body mode, per unit of force.
    """
    far, rate, load = ahead[0], ahead[1], ahead[2]
    for k in range(q.size):
        f = pushed[k]
        far[k] += gains[0, k] * f
        rate[k] += gains[1, k] * f
        f += load[k]
        x = q[k] - rest[0, k] * f
        z = rest[1, k] * x + rest[2, k] * p[k]
        load[k] = strays[0, k] * math.sqrt(x * x + z * z) + strays[1, k] * abs(f)


@compiled(fastmath={"reassoc", "contract", "nsz"})
def _bound_deviation(seen, load):
    """Return how far a gap with the shapes ``seen`` (K,) may deviate from the straight line within a step, from the
    deviations ``load`` (K,) of the poles."""
    u = 0.0
    for k in range(load.size):
        u += abs(seen[k]) * load[k]
    return u


@compiled(fastmath={"reassoc", "contract", "nsz"})
def _norm(values):
    """Return the Euclidean norm."""
    total = 0.0
    for k in range(values.size):
        total += values[k] * values[k]
    return math.sqrt(total)


@compiled()
def _solve(law, rough, films, own, shifts, level, swept, single, pen, before, dt, warm, low, held):
    """Write the forces of one step into ``warm`` (p,), which holds the first guess, as `march_many` does; return
    whether they converged."""
    codes, rules, numbers, user = law
    if single is not None:
        code, rule, w0 = codes[0], rules[0], own[0, 0]
        a, b, c = numbers[0, 0], numbers[0, 1], numbers[0, 2]
        if films is not None:
            film = (films[0, 0], films[0, 1], films[0, 2])
            pressed, pulled = filmed_force(code, rule, a, b, c, user, film, pen[0], before[0], w0, w0, dt)
            warm[0] = pressed + pulled
        elif rough is not None and code >= ROUGH:
            warm[0] = joint_step(code, rule, numbers, 0, pen[0], before[0], w0, w0, dt)
        else:
            warm[0] = contact_force(code, rule, a, b, c, user, pen[0], before[0], w0, w0, dt)
    if shifts is not None:
        active_set_from(shifts[level], pen, warm, low, held)
    if swept is not None:
        return sweep_forces(codes, rules, numbers, user, rough, films, pen, before, own, dt, warm)
    return True


@compiled()
def _measure_bend(force, row):
    """Return the deviation of the forces from a line over the last eight rows, summed over the contacts; infinite if a
    contact was open in one of the rows compared and closed in another."""
    total, r = 0.0, row
    for c in range(force.shape[1]):
        now, then, once = force[r, c], force[r - 4, c], force[r - 8, c]
        if (now != 0.0) != (then != 0.0) or (then != 0.0) != (once != 0.0):
            return math.inf
        total += abs(now - 2.0 * then + once)
    return total


@compiled(nogil=True)
def march_ladder(
    stop, control, share, lengths, dt, fine, leaps, state, loads, contacts, law, rough, films, own, shifts, swept,
    single, followed, written,
):  # fmt: skip
    """March from the fine step ``control[STEP]`` to ``stop``, or until no row is left to write into; ``control`` (9,)
    is the state of the loop.

    share (5,): allowed deviation of the forces from the line over their largest sum so far; that sum [N]; allowed
    deviation of open gaps over the widest so far on their side; the widest of both sides [m].
    lengths (J,): steps of each level, the first 1; dt: fine step [s]. fine: rows of `Poles.steps`, scale of the rates
    and groups of `Poles.along`; leaps: (J, 4, K) transitions, (J, 2, K) gains, ramps and strays of each level, psi
    (p, K), and rest as in `_add_contact_forces`. state: q and p (K,); on level 0 p is scaled, and the last force has
    yet to act. loads: shapes (L, S) on the first poles, the (L, p) gap by each in one fine step, amplitudes (L, n) and
    their sums (L, n + 1) from step ``first`` on, the largest so far (L,). contacts: gaps without motion (p,), their
    changes by moving bases (n + 1, p) or (0, p) from step ``first`` on, and the places in share of the widest gap on
    their side (p,), 3 or 4. law: codes, rules, parameters, the user's law; own: W (J, p, p); shifts: W with the
    compliances of linear laws added, or None; swept: True where forces are solved by sweeps, or None. followed: ends of
    the steps of a neighbouring run, which are taken unless contacts open or close in them, or (0,).
    written: fine step at the end of each row, force, gap and force of films; rows up to ``control[ROW]`` are read.
    """
    rows, scale, along = fine
    moves, gains, ramps, strays, psi, rest = leaps
    q, p = state
    shapes, lifts, amplitudes, sums, largest, first = loads
    opened, carried, sides = contacts
    ends, force, gap, pulls = written
    codes, rules, numbers, user = law
    many, count = opened.size, shapes.shape[0]
    n, row, level = control[STEP], control[ROW], control[LEVEL]
    since, calm, wait, pending = control[SINCE], control[CALM], control[WAIT], control[PENDING]
    pen, before, opening = np.empty(many), np.empty(many), np.empty(many)
    warm, last, clear, norms = np.empty(many), np.empty(many), np.zeros(many), np.empty(many)
    ahead, drive, amplitude = np.empty((3, q.size)), np.empty(q.size), np.empty((2, count))
    low, held, factored = np.empty((many, many)), np.full(many + 1, -1), level
    for c in range(many):
        warm[c], norms[c] = force[row, c], _norm(psi[c])
        if films is not None and films[c, 0] > 0.0:
            clear[c] = FAR * films[c, 1]
    place, begun_at, is_followed = control[PLACE], np.int64(-1), False
    while n < stop and row + 1 < ends.size:
        is_followed = False
        if begun_at != n:  # it equals n after a step that was taken back
            while place + 1 < followed.size and followed[place] < n:
                place += 1
            if place + 1 < followed.size and followed[place] == n:
                is_followed, begun_at, level = True, n, np.int64(0)
                while lengths[level] < followed[place + 1] - n:
                    level += 1
        while level > 0 and n + lengths[level] > stop:
            level, since, calm = level - 1, np.int64(0), np.int64(0)
        m = lengths[level]
        if level != factored:  # the factor is of another step's W
            factored, held[0] = level, -1
        if level > 0 and pending >= 0:  # to true rates
            for c in range(many):
                last[c] = force[row, c] if pending > 0 else 0.0
            load_poles(psi, last, drive)
            restore_rates(q, p, scale, gains[0], drive)
            pending = np.int64(-1)
        if level == 0 and pending < 0:
            for k in range(q.size):
                p[k] *= scale[k]
            pending = np.int64(0)
        for c in range(many):
            opening[c], before[c] = opened[c], -gap[row, c]
            if carried.shape[0] > 0:
                opening[c] += carried[n + m - first, c]
        if level == 0:
            for c in range(many):
                last[c] = force[row, c] if pending > 0 else 0.0
            if single is not None:
                opening[0] += advance(rows, q, p, last[0])
            else:
                advance_many(rows, psi, along, q, p, drive, last, opening)
            for i in range(count):
                a = amplitudes[i, n - first]
                largest[i] = max(largest[i], abs(a))
                if a != 0.0:
                    shape = shapes[i]
                    for k in range(shape.size):
                        q[k] += gains[0, 0, k] * shape[k] * a
                        p[k] += scale[k] * gains[0, 1, k] * shape[k] * a
                    for c in range(many):
                        opening[c] += lifts[i, c] * a
            pending = np.int64(1)
        else:
            sudden = False
            for i in range(count):
                begins, ends_at = amplitudes[i, n - first], amplitudes[i, n + m - 1 - first]
                amplitude[0, i] = (sums[i, n + m - first] - sums[i, n - first]) / m
                amplitude[1, i] = (ends_at - begins) * m / (m - 1)
                largest[i] = max(largest[i], abs(begins), abs(ends_at))
                inner = 0.5 * (amplitudes[i, n + m // 2 - 1 - first] + amplitudes[i, n + m // 2 - first])
                bend = max(abs(amplitude[0, i] - 0.5 * (begins + ends_at)), abs(inner - 0.5 * (begins + ends_at)))
                sudden = sudden or (bend > STRAIGHT * share[0] * largest[i] and not is_followed)
            if sudden:
                level, since, calm, wait = level - 1, np.int64(0), np.int64(0), n + PATIENCE
                continue
            _advance_leap(moves[level], gains[level], ramps[level], psi, shapes, amplitude, q, p, ahead, opening)
        for c in range(many):
            pen[c] = -opening[c]
        step, w = dt * m, own[level]
        solved = _solve(law, rough, films, w, shifts, level, swept, single, pen, before, step, warm, low, held)
        for d in range(many):
            if warm[d] != 0.0:
                for c in range(many):
                    opening[c] += w[d, c] * warm[d]
        if level > 0:
            load_poles(psi, warm, drive)
            _add_contact_forces(gains[level], strays[level], rest, drive, q, p, ahead)
            largest_stray = _norm(ahead[2])
            fits, bends, apart, mid, back = True, False, 0.0, n + 0.5 * m, row - 1
            middle = 0.5 * (ends[row] + ends[row - 1]) if row > 0 else 0.0
            while back >= 1 and middle - 0.5 * (ends[back] + ends[back - 1]) < m:
                back -= 1
            for c in range(many):
                bend = 0.0
                if carried.shape[0] > 0:
                    rise = carried[n + m - first, c] - carried[n - first, c]
                    for j in range(1, m):
                        bend = max(bend, abs(carried[n + j - first, c] - carried[n - first, c] - rise * j / m))
                now, was = warm[c], force[row, c]
                acts = now != 0.0 or opening[c] <= clear[c]
                acted = was != 0.0 or gap[row, c] <= clear[c]
                if acts != acted:
                    fits = False
                elif not acts:
                    least = min(gap[row, c], opening[c], opening[c] + BEFORE * (opening[c] - gap[row, c]) / m)
                    away, straight = norms[c] * largest_stray + bend, share[2] * share[sides[c]]  # by Cauchy, Schwarz
                    if least - away <= clear[c] or away > straight:
                        away = _bound_deviation(psi[c], ahead[2]) + bend
                    fits = fits and least - away > clear[c]
                    if away > straight and not is_followed:
                        fits, bends = False, True
                elif back < 1 or force[back, c] == 0.0:
                    fits = False
                else:
                    slope = (was - force[back, c]) / (middle - 0.5 * (ends[back] + ends[back - 1]))
                    apart += abs(now - was - slope * (mid - middle))
            if not fits or (apart > share[0] * share[1] and not is_followed):
                for c in range(many):
                    warm[c] = force[row, c]
                level, since, calm = level - 1, np.int64(0), np.int64(0)
                wait = n + PATIENCE if level == 0 else n
                if bends:
                    wait = n + PATIENCE * m
                continue
            for k in range(q.size):
                q[k], p[k] = ahead[0, k], ahead[1, k]
        if not solved:
            control[UNSOLVED] += 1
        row += 1
        n += m
        since += 1
        ends[row] = n
        total, flies = 0.0, True
        for c in range(many):
            force[row, c], gap[row, c] = warm[c], opening[c]
            total += abs(warm[c])
            share[sides[c]] = max(share[sides[c]], opening[c])
            flies = flies and warm[c] == 0.0 and opening[c] > clear[c]
            if films is not None and films[c, 0] > 0.0:
                pressed, pulled = alone(codes, rules, numbers, user, rough, films, pen, before, w, step, warm, c, 0.0)
                pulls[row, c] = pulled if pressed > 0.0 else warm[c]
            if rough is not None and codes[c] >= ROUGH:
                update_deepest(numbers, c, -opening[c])
        share[1] = max(share[1], total)
        rises = flies and n >= wait
        if not flies and since >= 2 * SMOOTH:
            calm = calm + 1 if _measure_bend(force, row) <= 0.5 * share[0] * share[1] else np.int64(0)
            rises = calm >= SMOOTH
        if rises and level + 1 < lengths.size and n % lengths[level + 1] == 0:
            level, since, calm = level + 1, np.int64(0), np.int64(0)
    control[STEP], control[ROW], control[LEVEL], control[PLACE] = n, row, level, place
    control[SINCE], control[CALM], control[WAIT], control[PENDING] = since, calm, wait, pending
