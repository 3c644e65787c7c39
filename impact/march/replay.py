"""The displacement of a body under known forces, without the energies: several times cheaper than `motion`."""

from __future__ import annotations

import numpy as np
from numba import njit

from impact.greens import oscillator
from impact.greens.base import Array
from impact.greens.modal import ModalGreens
from impact.march import history
from impact.march.loop import FLOOR
from impact.march.motion import Discrete


def port_displacement(discrete: Discrete, force: Array) -> Array:
    """(n + 1,) displacement [m] of the port of a held body at rest under ``force`` (n,), constant over each step.

    Equal to ``discrete.motion(force[None]).displacement[0]``, which serves every other body.
    """
    kernel, body = discrete.kernel, discrete.body
    free = kernel.modal is not None and not np.all(kernel.modal.omega)
    if free or discrete.moves_by_itself or body.loads or len(body.greens.ports) > 1:
        return np.asarray(discrete.motion(force[None]).displacement[0])
    out = np.zeros(len(force) + 1)
    if kernel.modal is not None:
        out[1:] += _modal(kernel.modal, discrete.dt, force)
    if kernel.weights is not None:
        out[1:] += history.convolve(kernel.weights[0, 0], force)
    return out


def _modal(modal: ModalGreens, dt: float, force: Array) -> Array:
    a, b = oscillator.transition(dt, modal.omega, modal.zeta)
    square, rates = modal.shapes[:, 0] ** 2, modal.residual.rates
    modes = np.array([a[0, 0], a[0, 1] * a[1, 0], a[1, 1], square * b[0], square * a[0, 1] * b[1]])
    none = np.zeros(len(rates))
    gain = modal.residual.shapes[:, 0] ** 2 * dt * oscillator.expm1_over(-rates * dt)
    rows, state = history.streams(
        np.concatenate([modes, np.array([np.exp(-rates * dt), none, none, gain, none])], axis=1)
    )
    return np.asarray(_displaced(rows, state, force)) + float(modal.residual.compliance[0, 0]) * force


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _displaced(rows, state, force):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """(n,) sum of the poles, their shapes squared in b1 and b2; as in `history.Poles` p stands for a12 q'."""
    a11, a21, a22, b1, b2 = rows
    q, p = state
    out = np.empty(force.size)
    for m in range(force.size):
        f, total = force[m], 0.0
        for k in range(q.size):
            x, y = q[k], p[k]
            r = a11[k] * x + (y + b1[k] * f)
            q[k] = r
            p[k] = a21[k] * x + (a22[k] * y + (b2[k] * f + FLOOR))
            total += r
        out[m] = total
    return out
