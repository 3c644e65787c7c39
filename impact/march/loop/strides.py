"""Many steps of flight at once, where no contact can close on the way (`impact.march.strides`)."""

from __future__ import annotations

import math

import numpy as np

from impact.march.loop.compiled import compiled


@compiled()
def flight(n, stop, strides, level, psi, q, p, ahead, line, free, carried, clear, gap):
    """Fly one stride from step ``n`` on, of ``level`` or shorter; return (steps flown, level for the next one).

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


@compiled(fastmath={"reassoc", "contract", "nsz"})
def _stride(power, swing, psi, q, p, ahead, line):
    """Write where one stride of `impact.march.strides` would take all poles, in ``ahead`` (2, K); of each contact in
    ``line`` (3, p) their part of the gap now and then, and how far it may stray from the line between; psi (p, K)."""
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


@compiled(fastmath={"reassoc", "contract", "nsz", "nnan"})
def _least(n, m, line, free, carried, clear):
    """Return by how much any contact may be open at least, beyond the gap ``clear`` (p,), in ``m`` steps from ``n`` on;
    free (n, p)."""
    contacts, least = carried.size, np.inf
    slope, base = np.empty(contacts), np.empty(contacts)
    for c in range(contacts):
        slope[c], base[c] = (line[1, c] - line[0, c]) / m, line[0, c] - line[2, c] - carried[c] - clear[c]
    for j in range(m):
        for c in range(contacts):
            least = min(least, free[n + j, c] + base[c] + slope[c] * (j + 1))
    return least
