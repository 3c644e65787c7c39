"""Many scenes of one contact side by side, in vector instructions."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from impact.march.laws import PASSIVE
from impact.march.loop.compiled import compiled
from impact.march.loop.forces import contact_force
from impact.march.loop.oscillators import Vectors
from impact.march.loop.past import FLOOR

LANES = 16  # scenes marched side by side


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
def march_lanes(rows, state, free, scales, w0, law, user, dt, force, opening, approach):
    """March LANES scenes of one contact; state (K + 1, 2, LANES) zero, its last row is scratch; force (n, LANES) and
    opening (n + 1, LANES) are filled.

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
    opening[0] = gap
    for n in range(force.shape[0]):
        _advance_lanes(rows, state, last, total)  # type: ignore[call-arg]
        base, moved, released = free[0, n + 1], free[1, n + 1], free[2, n + 1]
        for i in range(LANES):
            free_gap = scales[0, i] + base + moved * scales[1, i] + released * scales[2, i] + total[i]
            f = 0.0
            if free_gap < 0.0 or rule != PASSIVE:
                f = contact_force(code, rule, a, b, c, user, -free_gap, -gap[i], w0, w0, dt)
            if f > 0.0 and not met[i]:
                met[i] = True
                if n > 0:
                    approach[i] = (before[i] - gap[i]) / dt
            before[i] = gap[i]
            gap[i] = free_gap + w0 * f
            opening[n + 1, i] = gap[i]
            last[i] = f
            force[n, i] = f
