"""The loops over steps, of one contact, of several, and of many scenes side by side; contacts at one time level.

At one time level N >= 0 with N_c = law_c(pen_c - (W N)_c), W symmetric and positive semidefinite, is solved exactly by
block principal pivoting, warm-started from the last step's contacts.
Source: Judice & Pires, Comput. Oper. Res. 21 (1994) 587; Kim & Park, SIAM J. Sci. Comput. 33 (2011) 3261.

Linear laws form a linear complementarity problem, a spring k adding 1/k to its diagonal. Others are solved by sweeps of
exact scalar solves (nonlinear Gauss-Seidel), which descend the strictly convex energy of the step; films in the gaps,
too: their force does not decrease with the penetration at the end of the step either.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.march.laws import BLENDED, PASSIVE, ROUGH, SIGNORINI, SPRING
from impact.march.loop.compiled import compiled
from impact.march.loop.forces import FLOOR, RIGID, Vectors, advance, advance_many, contact_force, filmed_force, sum_past
from impact.march.loop.joints import joint_step, update_deepest

Codes = NDArray[np.int64]
HELD = 1e-14  # least pivot over its diagonal: less is round-off


def active_set(w: Array, pen: Array, force: Array) -> None:
    """Write into ``force`` (..., p) that with force >= 0, w force >= pen, complementary, of w (..., p, p); of more than
    two contacts, which are compiled for, it warm-starts the active set."""
    if pen.shape[-1] > 2:
        active_set_from(w, pen, force, np.empty(w.shape), np.full(pen.size + 1, -1))
        return
    alone = np.maximum(pen, 0.0) / np.diagonal(w, axis1=-2, axis2=-1)
    if pen.shape[-1] == 2:
        first, between, second = w[..., 0, 0], w[..., 0, 1], w[..., 1, 1]
        pivot = np.maximum(second - between**2 / first, HELD * second)
        of_second = (pen[..., 1] - between / first * pen[..., 0]) / pivot
        both = np.stack([(pen[..., 0] - between * of_second) / first, of_second], axis=-1)
        enough = alone * between[..., None] >= pen[..., ::-1]  # where one of them keeps the other's gap open
        pressed = np.stack([enough[..., 0], enough[..., 1] & ~enough[..., 0]], axis=-1)
        alone = np.where(np.any(enough, axis=-1, keepdims=True), alone * pressed, np.maximum(both, 0.0))
    force[...] = alone


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
    held at `HELD` of its diagonal.

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
                    low[i, i] = np.sqrt(max(value, HELD * w[index[i], index[i]]))
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


def linear_laws(codes: Codes, rules: Codes, numbers: Array, w: Array) -> Array | None:
    """Return w with what springs yield; ``None`` where not all laws are linear in N."""
    shifted, linear = w.copy(), True
    for c, together in enumerate(np.abs(w).sum(axis=1)):
        passive = rules[c] == PASSIVE or (rules[c] == BLENDED and numbers[c, 0] * together >= RIGID)
        linear = linear and (codes[c] == SIGNORINI or (codes[c] == SPRING and passive))
        if codes[c] == SPRING:
            shifted[c, c] += 1.0 / numbers[c, 0]
    return shifted if linear else None


@compiled()
def sweep_forces(codes, rules, numbers, user, rough, films, pen, pen_start, w, dt, force):
    """Find all forces of one step, in place, one after the other; where that crawls, by `_newton`.

    ``numbers`` (p, k): parameters of the laws; ``rough``: None where none is of rough faces, whose code then is not
    compiled; ``films`` (p, 3) or None; ``pen`` (p,): without the forces. Returns
    whether they were found. A film's force is known to what round-off of its gap leaves; forces of stiff laws that
    depend on the speed may go round in a cycle of round-off, of parts in 1e14, and count as found below 1e-12.
    """
    p = pen.size
    for sweep in range(2000):
        change, size = 0.0, 0.0
        for c in range(p):
            pressed, pulled = alone(codes, rules, numbers, user, rough, films, pen, pen_start, w, dt, force, c, 0.0)
            new = pressed + pulled
            if films is None or w[c, c] * abs(new - force[c]) > _slack(films, pen, w, force, c):
                change = max(change, abs(new - force[c]))
            size = max(size, abs(new))
            force[c] = new
        if change <= (1e-14 if sweep < 200 else 1e-12) * size:
            return True
        if sweep % 10 == 9:
            _newton(codes, rules, numbers, user, rough, films, pen, pen_start, w, dt, force, change)
    return False


@compiled()
def alone(codes, rules, numbers, user, rough, films, pen, pen_start, w, dt, force, c, more):
    """Return (the law's, the film's) force of contact ``c`` if the others' stay, its penetration raised by ``more``."""
    others, together = pen[c] + more, 0.0
    for d in range(pen.size):
        together += abs(w[c, d])
        if d != c:
            others -= w[c, d] * force[d]
    a, b, exponent = numbers[c, 0], numbers[c, 1], numbers[c, 2]
    code, rule, start, w0 = codes[c], rules[c], pen_start[c], w[c, c]
    if rough is not None and code >= ROUGH:
        return joint_step(code, rule, numbers, c, others, start, w0, together, dt), 0.0
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
def _newton(codes, rules, numbers, user, rough, films, pen, pen_start, w, dt, force, worst):
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
            pressed, pulled = alone(codes, rules, numbers, user, rough, films, pen, pen_start, w, dt, trial, c, 0.0)
            now = pressed + pulled
            gain[c] = now - trial[c]
            residual = max(residual, abs(gain[c]))
            small = 1e-7 * (w[c, c] * abs(now) + abs(pen[c])) + 1e-300
            pressed, pulled = alone(codes, rules, numbers, user, rough, films, pen, pen_start, w, dt, trial, c, small)
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


LANES = 16  # scenes that are marched side by side


@intrinsic
def _advance_lanes(typing: Any, rows: Any, state: Any, force: Any, total: Any) -> Any:
    """Do `advance` for LANES scenes at once, in vector instructions: rows (K, 5), state (K, 2, LANES), force and total
    (LANES,). Written as LLVM vectors: the loop vectoriser does not find this form, as the arrays might overlap."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        arrays = [context.make_array(t)(context, builder, a) for t, a in zip(signature.args, arguments, strict=True)]
        poles = builder.extract_value(arrays[0].shape, 0)
        number, lane = poles.type, ir.IntType(32)
        vectors, first = Vectors(builder, LANES), ir.Constant(ir.VectorType(lane, LANES), [0] * LANES)
        empty = ir.Constant(ir.VectorType(ir.DoubleType(), LANES), ir.Undefined)
        at, load, fused = vectors.address, vectors.load, vectors.fused

        def everywhere(index: Any) -> Any:
            value = builder.load(builder.gep(arrays[0].data, [index]))
            return builder.shuffle_vector(builder.insert_element(empty, value, lane(0)), empty, first)

        f = load(arrays[2], number(0))
        floor = vectors.full(FLOOR)
        u = cgutils.alloca_once_value(builder, vectors.full(0.0))
        with cgutils.for_range(builder, poles) as loop:
            row = builder.mul(loop.index, number(5))
            a11, a21, a22, c1, c2 = (everywhere(builder.add(row, number(i))) for i in range(5))
            q_index = builder.mul(loop.index, number(2 * LANES))
            p_index = builder.add(q_index, number(LANES))
            q, p = load(arrays[1], q_index), load(arrays[1], p_index)
            r = fused(a11, q, fused(c1, f, p))
            builder.store(r, at(arrays[1], q_index), align=8)
            builder.store(fused(a21, q, fused(a22, p, fused(c2, f, floor))), at(arrays[1], p_index), align=8)
            builder.store(builder.fadd(builder.load(u), r), u)
        builder.store(builder.load(u), at(arrays[3], number(0)), align=8)
        return context.get_dummy_value()

    return types.void(rows, state, force, total), build


@compiled(nogil=True)
def march_lanes(rows, state, free, scales, w0, law, user, rough, dt, force, opening, approach):
    """March LANES scenes of one contact; state (K + 1, 2, LANES) zero, its last row is scratch; force (n, LANES) and
    opening (n + 1, LANES) are filled.

    free (3, n + 1): gap without contact, per unit of the scales (3, LANES) after the first row, which all share with
    scales[0] as their initial gap. law: (code, rule, its numbers (LANES, k)). approach (LANES,): closing speed over the
    step before the first contact.
    """
    code, rule, numbers = law
    a, b, c = numbers[0, 0], numbers[0, 1], numbers[0, 2]
    last, total = state[-1, 0], state[-1, 1]
    gap, before = np.empty(LANES), np.empty(LANES)
    met = np.zeros(LANES, dtype=np.bool_)
    for i in range(LANES):
        gap[i] = scales[0, i] + free[0, 0] + free[1, 0] * scales[1, i] + free[2, 0] * scales[2, i]
    before[:] = gap
    opening[0] = gap
    for n in range(force.shape[0]):
        _advance_lanes(rows, state, last, total)  # type: ignore[call-arg]
        base, moved, released = free[0, n + 1], free[1, n + 1], free[2, n + 1]
        for i in range(LANES):
            free_gap = scales[0, i] + base + moved * scales[1, i] + released * scales[2, i] + total[i]
            f = 0.0
            if rough is not None and code >= ROUGH:
                f = joint_step(code, rule, numbers, i, -free_gap, -gap[i], w0, w0, dt)
            elif free_gap < 0.0 or rule != PASSIVE:
                f = contact_force(code, rule, a, b, c, user, -free_gap, -gap[i], w0, w0, dt)
            if f > 0.0 and not met[i]:
                met[i] = True
                if n > 0:
                    approach[i] = (before[i] - gap[i]) / dt
            before[i] = gap[i]
            gap[i] = free_gap + w0 * f
            if rough is not None and code >= ROUGH:
                update_deepest(numbers, i, -gap[i])
            opening[n + 1, i] = gap[i]
            last[i] = f
            force[n, i] = f


@compiled(nogil=True)
def march_one(
    start, stop, rows, state, free, memory, recent, block, w0, law, film, user, rough, dt, rest, force, gap, pulls
):  # fmt: skip
    """March the steps ``start``..``stop``-1 of one contact; force (n,) and gap (n + 1,) are filled in place.

    rows: `Poles.folded`; state: (q, p). free (n,): gap at the end of each step without contact. memory (n,): what
    finished blocks add. recent: `BlockedSum.recent`. law: (code, rule, its numbers (1, k)). film: its three numbers;
    None: a march without any is compiled on its own, as one without laws of ``rough`` faces is. rest: force carried
    since ever. pulls (n,): the film's part of the force.
    """
    q, p = state
    code, rule, numbers = law
    a, b, c = numbers[0, 0], numbers[0, 1], numbers[0, 2]
    for n in range(start, stop):
        last = force[n - 1] - rest if n > 0 else 0.0
        opening = free[n] + advance(rows, q, p, last)
        if recent.size > 0:
            opening += memory[n] + sum_past(recent, force, rest, n - n % block, n)
        opening -= w0 * rest
        if film is not None:
            pressed, pulled = filmed_force(code, rule, a, b, c, user, film, -opening, -gap[n], w0, w0, dt)
            f, pulls[n] = pressed + pulled, pulled
        elif rough is not None and code >= ROUGH:
            f = joint_step(code, rule, numbers, 0, -opening, -gap[n], w0, w0, dt)
        else:
            f = contact_force(code, rule, a, b, c, user, -opening, -gap[n], w0, w0, dt)
        force[n] = f
        gap[n + 1] = opening + w0 * f
        if rough is not None and code >= ROUGH:
            update_deepest(numbers, 0, -gap[n + 1])


@compiled(nogil=True)
def march_many(
    start, stop, poles, state, free, memory, recent, block, w0, laws, shifted, swept, films, user, rough, dt, rest,
    force, gap, pulls,
):  # fmt: skip
    """Do the same for p contacts: force, pulls and memory (p, n), gap (n + 1, p), free (n, p), recent (p, p, block), w0
    (p, p), films (p, 3), the first number 0 of a contact without one. Either ``shifted`` (p, p) is that of
    `linear_laws` and ``swept`` None, or forces are found by sweeps and ``shifted`` is None: what the other asks for is
    not compiled. Returns how many steps' forces were not found, as `sweep_forces` says."""
    rows, psi, along = poles
    unsolved = 0
    q, v = state
    codes, rules, numbers = laws
    contacts = rest.size
    carried, pen, before = np.zeros(contacts), np.empty(contacts), np.empty(contacts)
    opening, last, warm = np.empty(contacts), np.zeros(contacts), np.zeros(contacts)
    drive = np.empty(q.size)
    low, held = np.empty((contacts, contacts)), np.full(contacts + 1, -1)
    heard = np.zeros((contacts, contacts), dtype=np.bool_)  # a seat and a stopper do not hear each other
    for c in range(contacts):  # written out: numpy's assignments and products take seconds to compile
        warm[c] = force[c, start - 1] if start > 0 else 0.0
        for d in range(contacts):
            carried[c] += w0[c, d] * rest[d]
            for m in range(recent.shape[2]):
                if recent[c, d, m] != 0.0:
                    heard[c, d] = True
                    break
    for n in range(start, stop):
        for c in range(contacts):
            last[c] = force[c, n - 1] - rest[c] if n > 0 else 0.0
            opening[c] = free[n, c] - carried[c]
        advance_many(rows, psi, along, q, v, drive, last, opening)
        for c in range(contacts):
            if recent.size > 0:
                opening[c] += memory[c, n]
                for d in range(contacts):
                    if heard[c, d]:
                        opening[c] += sum_past(recent[c, d], force[d], rest[d], n - n % block, n)
            pen[c], before[c] = -opening[c], -gap[n, c]
        if shifted is not None:
            active_set_from(shifted, pen, warm, low, held)
        if swept is not None and not sweep_forces(codes, rules, numbers, user, rough, films, pen, before, w0, dt, warm):
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
                pressed, pulled = alone(codes, rules, numbers, user, rough, films, pen, before, w0, dt, warm, c, 0.0)
                pulls[c, n] = pulled if pressed > 0.0 else warm[c]
            if rough is not None and codes[c] >= ROUGH:
                update_deepest(numbers, c, -closed[c])
    return unsolved
