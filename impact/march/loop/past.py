"""What earlier forces do to the gap: poles, oscillators and weighted sums over many steps.

Over a loop of steps with few oscillators each, what they are is loaded, and what they have come to stored and loaded
again, at every step; here both stay in registers over all steps.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from impact.greens.base import Array
from impact.march.loop.compiled import compiled

FLOOR = 1e-140  # value added to every state at every step: damped-out modes never become slow denormal numbers


@compiled(fastmath={"reassoc", "contract", "nsz"})
def advance(rows, q, p, force):
    """Advance all poles of one contact by a step after the last step's force; return their sum, the gap's part."""
    a11, a21, a22, c1, c2 = rows
    u = 0.0
    for k in range(q.size):
        qk, pk = q[k], p[k]
        r = a11[k] * qk + (pk + c1[k] * force)
        q[k] = r
        p[k] = a21[k] * qk + (a22[k] * pk + (c2[k] * force + FLOOR))
        u += r
    return u


@compiled(fastmath={"reassoc", "contract", "nsz"})
def advance_many(rows, psi, along, q, p, drive, force, opening):
    """Do the same for several contacts: ``opening`` (p,) gains the poles' part; ``along`` as of `Poles.along`."""
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


@compiled(fastmath={"reassoc", "contract", "nsz"})
def past(recent, force, rest, first, n):
    """Return what the forces of steps ``first``..``n``-1 beyond ``rest`` do at the end of step ``n``; ``recent`` holds
    the weights of one block in reverse order, so that both are read forwards."""
    stop = recent.size - 1
    w, f = recent[stop - (n - first) : stop], force[first:n]
    u = 0.0
    for m in range(f.size):
        u += w[m] * (f[m] - rest)
    return u


@compiled(nogil=True, fastmath={"reassoc", "contract", "nsz"})
def displaced(rows, state, w0, force):
    """Return the (n,) values that the march of one contact adds to the gap under a known ``force`` (n,); rows and state
    as there."""
    a11, a21, a22, c1, c2 = rows
    q, p = state
    out, last = np.empty(force.size), 0.0
    for n in range(force.size):
        u = w0 * force[n]
        for k in range(q.size):  # `advance`, written out: twice as fast without the march around it
            qk, pk = q[k], p[k]
            r = a11[k] * qk + (pk + c1[k] * last)
            q[k] = r
            p[k] = a21[k] * qk + (a22[k] * pk + (c2[k] * last + FLOOR))
            u += r
        out[n], last = u, force[n]
    return out


WIDE = 16


def padded(values: Array) -> Array:
    """Return (..., K) with columns of zeros up to a multiple of `WIDE`: oscillators that nothing moves."""
    more = -values.shape[-1] % WIDE
    return np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, more)])


class Vectors:
    """Doubles side by side in registers: loads from arrays, products and sums, as LLVM writes them."""

    def __init__(self, builder: Any, width: int) -> None:
        self._builder, self._vector = builder, ir.VectorType(ir.DoubleType(), width)

    def full(self, value: float) -> Any:
        return ir.Constant(self._vector, [value] * self._vector.count)

    def address(self, array: Any, index: Any) -> Any:
        return self._builder.bitcast(self._builder.gep(array.data, [index]), self._vector.as_pointer())

    def load(self, array: Any, index: Any) -> Any:
        value = self._builder.load(self.address(array, index))
        value.align = 8
        return value

    def times(self, x: Any, y: Any) -> Any:
        return self._builder.fmul(x, y, flags=("contract",))

    def fused(self, x: Any, y: Any, z: Any) -> Any:
        return self._builder.fadd(self.times(x, y), z, flags=("contract",))


@intrinsic
def _oscillate(typing: Any, first: Any, steps: Any, form: Any, q: Any, p: Any, pushed: Any, told: Any) -> Any:
    """Do `oscillate` for those from ``first`` on; ``form`` and ``told`` (2, m), stored and lost, may be ``None``."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kinds = zip(signature.args[1:], arguments[1:], strict=True)
        arrays: list[Any] = [None if t is types.none else context.make_array(t)(context, builder, a) for t, a in kinds]
        rates, gram, places, speeds, forces, energies = arrays
        start, number, lane = arguments[0], arguments[0].type, ir.IntType(32)
        row, count = builder.extract_value(forces.shape, 1), builder.extract_value(forces.shape, 0)
        vectors = Vectors(builder, WIDE)
        times, fused = vectors.times, vectors.fused

        def index(line: Any) -> Any:
            return builder.add(builder.mul(line, row), start)

        def load(array: Any, line: Any) -> Any:
            return vectors.load(array, index(line))

        def add_up(x: Any, line: int, step: Any) -> None:
            half = WIDE // 2
            while half:
                low, high = (ir.Constant(ir.VectorType(lane, half), list(range(k, k + half))) for k in (0, half))
                x = builder.fadd(builder.shuffle_vector(x, x, low), builder.shuffle_vector(x, x, high))
                half //= 2
            place = builder.gep(energies.data, [builder.add(builder.mul(number(line), count), step)])
            builder.store(builder.fadd(builder.load(place), builder.extract_element(x, lane(0))), place)

        a11, a12, a21, a22, b1, b2, squares = (load(rates, number(i)) for i in range(7))
        d = [] if gram is None else [load(gram, number(i)) for i in range(6)]
        floor, a_half = vectors.full(FLOOR), vectors.full(0.5)
        now = [cgutils.alloca_once_value(builder, load(array, number(0))) for array in (places, speeds)]
        with cgutils.for_range(builder, count) as loop:
            (x, v), y = (builder.load(place) for place in now), load(forces, loop.index)
            r = fused(a11, x, fused(a12, v, fused(b1, y, floor)))
            s = fused(a21, x, fused(a22, v, fused(b2, y, floor)))
            for value, place in zip((r, s), now, strict=True):
                builder.store(value, place)
            builder.store(r, vectors.address(forces, index(loop.index)), align=8)
            if d:
                kept = fused(s, s, times(times(squares, r), r))
                gone = fused(x, fused(d[0], x, fused(d[1], v, times(d[2], y))), times(times(d[5], y), y))
                gone = fused(v, fused(d[3], v, times(d[4], y)), gone)
                add_up(times(a_half, kept), 0, loop.index)
                add_up(gone, 1, loop.index)
        for place, array in zip(now, (places, speeds), strict=True):
            builder.store(builder.load(place), vectors.address(array, index(number(0))), align=8)
        return context.get_dummy_value()

    return types.void(first, steps, form, q, p, pushed, told), build


@compiled(nogil=True)
def oscillate(steps, form, q, p, pushed, told):
    """Move oscillators under known modal forces ``pushed`` (m, K), which become their coordinates after each step.

    steps: (7, K) rows a11, a12, a21, a22, b1, b2, w^2 of [q, p] <- A [q, p] + b f; K a multiple of `WIDE`. told (2, m)
    gains the energy stored after each step and that lost during it, by the (6, K) ``form``; both ``None``: no energies.
    """
    for first in range(0, q.size, WIDE):
        _oscillate(first, steps, form, q, p, pushed, told)  # type: ignore[call-arg]
