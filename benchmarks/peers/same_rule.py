"""The peers' ways to a response, by matrices of ours: what is left between both is a mistake, of one or the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from impact.greens.modal import ModalGreens, Residual
from impact.greens.pulse import hann
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.modes import solve_modes

Array = NDArray[np.float64]


def trapezoidal(model: SecondOrderModel, dt: float, count: int, width: float) -> Array:
    """(count,) the port's displacement [m/(N s)] at dt, 2 dt, ... under the unit Hann pulse: Newmark, beta = 1/4."""
    [port] = model.ports.values()
    factor = factorize(model.M + dt**2 / 4 * model.K)
    u, v, a = np.zeros((3, model.size))
    out = np.empty(count)
    for k, push in enumerate(hann(dt * np.arange(1, count + 1), width)):
        u, v = u + dt * v + dt**2 / 4 * a, v + dt / 2 * a
        a = factor.solve(push * port.vector - model.K @ u)
        u, v = u + dt**2 / 4 * a, v + dt / 2 * a
        out[k] = port.vector @ u
    return out


def modal(model: SecondOrderModel, modes: int, times: Array, width: float) -> Array:
    """The same at ``times`` [s], from the lowest ``modes`` alone."""
    [port] = model.ports.values()
    found = solve_modes(model, modes)
    shares = (port.vector @ found.shapes)[:, None]
    omega = 2 * np.pi * found.frequencies_hz
    return ModalGreens(omega, np.zeros(modes), shares, Residual.spring([[0.0]]), ("port",)).filtered(times, width)
