"""The energy ledger of an impact, replayed from the recorded force.

Each term is integrated on its own, pole by pole and step by step; none is found by difference, so that the sum of all
terms measures the solver's error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from impact import oscillator
from impact.body import Body
from impact.closed_form import DelayRod
from impact.greens import Array, StepKernel
from impact.modal import ModalGreens


@dataclass(frozen=True)
class EnergyLedger:
    """Energies [J] at every recorded time, all (n + 1,).

    Attributes:
        input: energy brought in: initial energy and work of loads.
        striker, target: energy stored (or, for a body in ``by_work``, all work it has received).
        contact: energy stored in the contact law.
        dissipated: lost in the bodies' damping and in the contact so far.
        contact_loss: the part of ``dissipated`` lost in the contact: the impact itself, and the step's own damping.
        by_work: names of the bodies known only by the work done on them.
    """

    input: Array
    striker: Array
    target: Array
    contact: Array
    dissipated: Array
    contact_loss: Array
    by_work: tuple[str, ...] = ()

    @property
    def stored(self) -> Array:
        """Striker + target + contact."""
        return self.striker + self.target + self.contact

    @property
    def residual(self) -> float:
        """max |input - stored - dissipated| / largest energy stored; 0 for a system that never holds any."""
        largest = float(np.max(np.abs(self.stored)))
        error = float(np.max(np.abs(self.input - self.stored - self.dissipated)))
        return error / largest if largest > 0 else error


@dataclass(frozen=True)
class BodyEnergy:
    """Stored and dissipated energy of one body at every time [J], and whether it is only known as work."""

    stored: Array
    dissipated: Array
    by_work: bool = False


def body_energy(body: Body, kernel: StepKernel, force: Array, displacement: Array, dt: float, port: int) -> BodyEnergy:
    """Energy of a body under the ``force`` (n,) it feels along the normal, displaced by ``displacement`` (n + 1,)."""
    if kernel.weights is None and kernel.modal is not None:
        return _modal_energy(body, kernel.modal, force, dt, port)
    if isinstance(body.greens, DelayRod):
        steps = body.greens.round_trip / dt
        if abs(steps - round(steps)) < 1e-6 and round(steps) > 0:
            return _wave_energy(body, body.greens, force, dt, round(steps))
    work = np.concatenate([[0.0], np.cumsum(force * np.diff(displacement))])
    return BodyEnergy(work, np.zeros_like(work), by_work=True)


def _modal_energy(body: Body, modal: ModalGreens, force: Array, dt: float, port: int) -> BodyEnergy:
    n = len(force)
    stored, lost = np.zeros(n + 1), np.zeros(n + 1)
    phi = modal.shapes[:, port]
    a, b = oscillator.transition(dt, modal.omega, modal.zeta)
    form = oscillator.dissipation_form(dt, modal.omega, modal.zeta)
    if isinstance(body.greens, ModalGreens):
        start = body.modal_start()
        q, p = start.displacement.copy(), start.velocity.copy()
    else:
        q, p = np.zeros(len(phi)), np.zeros(len(phi))
    stored[0] = 0.5 * float(p @ p + (modal.omega * q) @ (modal.omega * q))
    steps = np.array([a[0, 0], a[0, 1], a[1, 0], a[1, 1], phi * b[0], phi * b[1], modal.omega**2, phi])
    upper = np.array([form[0, 0], 2 * form[0, 1], 2 * form[0, 2], form[1, 1], 2 * form[1, 2], form[2, 2]])
    _replay(steps, upper, q, p, force, stored, lost)
    _add_relaxations(modal, port, force, dt, stored, lost)
    c = float(modal.residual.compliance[port, port])
    stored[1:] += 0.5 * c * force**2
    lost[1:] += 0.5 * c * np.diff(force, prepend=0.0) ** 2  # a spring loaded at once takes F^2 c and keeps half
    return BodyEnergy(stored, np.cumsum(lost))


def _add_relaxations(modal: ModalGreens, port: int, force: Array, dt: float, stored: Array, lost: Array) -> None:
    """Kelvin-Voigt element: f = y' + rate y; stores rate y^2/2, loses the integral of y'^2."""
    for amplitude, rate in zip(modal.residual.shapes[:, port], modal.residual.rates, strict=True):
        f = amplitude * force
        decay, gain = float(np.exp(-rate * dt)), dt * float(oscillator.expm1_over(np.array(-rate * dt)))
        y = np.concatenate([[0.0], _first_order(decay, gain, f)])
        stored += 0.5 * rate * y**2
        square = dt * float(oscillator.expm1_over(np.array(-2 * rate * dt)))
        lost[1:] += (f - rate * y[:-1]) ** 2 * square


def _wave_energy(body: Body, rod: DelayRod, force: Array, dt: float, steps: int) -> BodyEnergy:
    """Outgoing wave a = f/Z + R a(t - T); each carries Z a^2 per unit time, R^2 of it after the far end.

    A translating rod adds v times the momentum received and its own kinetic energy (Galilei).
    """
    n, r = len(force), rod.reflection
    a = _delayed(force / rod.impedance, r, steps)
    power = np.concatenate([[0.0], np.cumsum(rod.impedance * a**2 * dt)])
    now = np.arange(n + 1, dtype=np.float64)
    there, back = _at(power, now - np.float64(steps / 2)), _at(power, now - np.float64(steps))
    stored = (power - there) + r**2 * (there - back)
    if body.velocity != 0.0:
        momentum = np.concatenate([[0.0], np.cumsum(force * dt)])
        stored = stored + body.velocity * momentum + 0.5 * rod.mass * body.velocity**2
    return BodyEnergy(stored, (1 - r**2) * there)


def _at(cumulative: Array, index: Array) -> Array:
    return np.interp(index, np.arange(len(cumulative)), cumulative)


@njit(cache=True)
def _replay(steps, form, q, p, force, stored, lost):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Oscillators under a known force, mode by mode in blocks of time that stay in cache."""
    n = force.size
    for first in range(0, n, 2048):
        last = min(first + 2048, n)
        for k in range(q.size):
            a11, a12, a21, a22, b1, b2, w2, phi = steps[:, k]
            d11, d12, d13, d22, d23, d33 = form[:, k]
            x, v = q[k], p[k]
            for m in range(first, last):
                f = force[m]
                g = phi * f
                lost[m + 1] += x * (d11 * x + d12 * v + d13 * g) + v * (d22 * v + d23 * g) + d33 * g * g
                x, v = a11 * x + a12 * v + b1 * f, a21 * x + a22 * v + b2 * f
                stored[m + 1] += 0.5 * (v * v + w2 * x * x)
            q[k], p[k] = x, v


@njit(cache=True)
def _first_order(decay, gain, f):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    out = np.empty_like(f)
    y = 0.0
    for m in range(f.size):
        y = decay * y + gain * f[m]
        out[m] = y
    return out


@njit(cache=True)
def _delayed(f, r, steps):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    out = f.copy()
    for m in range(steps, f.size):
        out[m] += r * out[m - steps]
    return out
