"""What earlier forces do to the gap: poles advanced by a step, weighted sums of the latest block."""

from __future__ import annotations

import numpy as np

from impact.march.loop.compiled import compiled

FLOOR = 1e-140  # added to every state at every step: damped-out modes never reach slow denormal numbers


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
