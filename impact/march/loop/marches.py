"""The loops over steps: of one contact and of several, and many scenes side by side."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from impact.march.laws import PASSIVE, ROUGH
from impact.march.loop.compiled import compiled
from impact.march.loop.forces import FLOOR, Vectors, advance, advance_many, contact_force, filmed_force, past
from impact.march.loop.joints import joint_step, remember
from impact.march.loop.several import active_set_from, alone, by_sweeps

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
                remember(numbers, i, -gap[i])
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
            opening += memory[n] + past(recent, force, rest, n - n % block, n)
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
            remember(numbers, 0, -gap[n + 1])


@compiled(nogil=True)
def march_many(
    start, stop, poles, state, free, memory, recent, block, w0, laws, shifted, swept, films, user, rough, dt, rest,
    force, gap, pulls,
):  # fmt: skip
    """Do the same for p contacts: force, pulls and memory (p, n), gap (n + 1, p), free (n, p), recent (p, p, block), w0
    (p, p), films (p, 3), the first number 0 of a contact without one. Either ``shifted`` (p, p) is that of
    `linear_laws` and ``swept`` None, or forces are found by sweeps and ``shifted`` is None: what the other asks for is
    not compiled. Returns how many steps' forces were not found, as `by_sweeps` says."""
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
                        opening[c] += past(recent[c, d], force[d], rest[d], n - n % block, n)
            pen[c], before[c] = -opening[c], -gap[n, c]
        if shifted is not None:
            active_set_from(shifted, pen, warm, low, held)
        if swept is not None and not by_sweeps(codes, rules, numbers, user, rough, films, pen, before, w0, dt, warm):
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
                remember(numbers, c, -closed[c])
    return unsolved
