"""The displacement of a body under known forces, without the energies: several times cheaper than `impact.motion`."""

from __future__ import annotations

import numpy as np
from numba import njit

from impact import history, oscillator
from impact.greens import Array
from impact.march import FLOOR
from impact.modal import ModalGreens
from impact.motion import Discrete


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
    rates, rest = modal.residual.rates, modal.residual.shapes[:, 0]
    none = np.zeros(len(rates))
    decay, gain = np.exp(-rates * dt), dt * oscillator.expm1_over(-rates * dt)
    modes = np.array([a[0, 0], a[0, 1], a[1, 0], a[1, 1], b[0], b[1]])
    relaxations = np.array([decay, none, none, none, gain, none])
    steps = np.ascontiguousarray(np.concatenate([modes, relaxations], axis=1))
    seen = np.concatenate([modal.shapes[:, 0], rest])
    return np.asarray(_displaced(steps, seen, force)) + float(modal.residual.compliance[0, 0]) * force


@njit(cache=True)
def _displaced(steps, shape, force):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    a11, a12, a21, a22, b1, b2 = steps
    q, p = np.zeros(shape.size), np.zeros(shape.size)
    out = np.empty(force.size)
    for m in range(force.size):
        total = 0.0
        for k in range(shape.size):
            f = shape[k] * force[m]
            x = a11[k] * q[k] + a12[k] * p[k] + b1[k] * f + FLOOR
            p[k] = a21[k] * q[k] + a22[k] * p[k] + b2[k] * f + FLOOR
            q[k] = x
        for k in range(shape.size):
            total += shape[k] * q[k]
        out[m] = total
    return out
