"""The motion and energy of one body under known forces, replayed mode by mode.

Each energy term is integrated on its own, pole by pole and step by step; none is found by difference, so that the sum
of all terms measures the solver's error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from impact.bodies.body import Body
from impact.brief import brief
from impact.greens import oscillator
from impact.greens.base import Array, GreensFunctionError, Rod, StepKernel
from impact.greens.modal import ModalGreens
from impact.march import history
from impact.march.loop import FLOOR

_ROUND_OFF = 1e-13  # relative, of a difference of inverse masses


@dataclass(frozen=True)
class Motion:
    """One body over time.

    Attributes:
        displacement: (P, n + 1) of the ports [m].
        stored: (n + 1,) elastic and kinetic energy [J]; for ``by_work`` that of its translation and all work received.
        dissipated: (n + 1,) lost in the body's damping so far [J].
        load_work: (n + 1,) work of the prescribed loads so far [J].
        by_work: known only by the work done on it.
    """

    displacement: Array
    stored: Array
    dissipated: Array
    load_work: Array
    by_work: bool = False

    __repr__ = brief


@dataclass(frozen=True)
class Discrete:
    """A body at a fixed step, with what it carried before t = 0.

    Attributes:
        body: the body.
        kernel: its memory at this step.
        dt: step [s].
        loads: (L, n) amplitudes of the body's loads, constant over each step [N].
        rest: (P,) port forces carried since ever: the preload [N].
        rest_loads: (L,) load amplitudes carried since ever [N].
        free: (P, n + 1) displacement without contact [m], where it is known.
    """

    body: Body
    kernel: StepKernel
    dt: float
    loads: Array
    rest: Array
    rest_loads: Array
    free: Array | None = None

    __repr__ = brief

    @staticmethod
    def of(body: Body, dt: float, n: int) -> Discrete:
        """``body`` over ``n`` steps of ``dt``, starting from its initial state."""
        body.greens.check_length(dt, n)
        middle = dt * (np.arange(n) + 0.5)
        loads = np.zeros((len(body.loads), n))
        for row, load in zip(loads, body.loads, strict=True):
            row[:] = load.amplitude(np.asarray(middle, dtype=np.float64))
        if not np.all(np.isfinite(loads)):
            raise GreensFunctionError(f"a load has {np.sum(~np.isfinite(loads))} amplitudes that are not finite")
        ports = len(body.greens.ports)
        return Discrete(body, body.greens.step_kernel(dt, n), dt, loads, np.zeros(ports), np.zeros(len(body.loads)))

    @property
    def moves_by_itself(self) -> bool:
        """Whether the body moves, or is deflected, without contact."""
        b = self.body
        return b.velocity != 0.0 or b.state is not None or len(b.loads) > 0 or bool(np.any(self.rest))

    def free_motion(self) -> Array:
        """(P, n + 1) displacement [m] without contact: initial state, loads and preload."""
        if self.free is not None:
            return self.free
        return self.motion(np.repeat(self.rest[:, None], self.loads.shape[1], axis=1)).displacement

    def motion(self, force: Array) -> Motion:
        """Under port forces (P, n) along the normal, constant over each step."""
        n = force.shape[1]
        out = Motion(np.zeros((len(force), n + 1)), np.zeros(n + 1), np.zeros(n + 1), np.zeros(n + 1))
        if self.kernel.modal is not None:
            out = _modal_motion(self, self.kernel.modal, force)
        if self.kernel.weights is not None:
            out = _sampled_motion(self, self.kernel.weights, force, out)
        return out


def _start(discrete: Discrete, modal: ModalGreens) -> tuple[Array, Array]:
    """Modal coordinates and rates at t = 0, preload included."""
    pull = modal.shapes @ discrete.rest
    for load, amplitude in zip(discrete.body.loads, discrete.rest_loads, strict=True):
        pull = pull + load.shape * amplitude
    if np.any(pull[modal.omega == 0] != 0):
        raise GreensFunctionError("a body free to move cannot carry a preload: nothing balances it; hold it somewhere")
    q = pull / np.where(modal.omega == 0, 1.0, modal.omega) ** 2
    start = discrete.body.modal_start(modal)
    return q + start.displacement, start.velocity.copy()


def _modal_motion(discrete: Discrete, modal: ModalGreens, force: Array) -> Motion:
    ports, n = force.shape
    shapes = np.column_stack([modal.shapes, *(load.shape for load in discrete.body.loads)])
    channels = np.concatenate([force, discrete.loads[:, :n]])
    q, p = _start(discrete, modal)
    u, stored, lost = np.zeros((len(channels), n + 1)), np.zeros(n + 1), np.zeros(n + 1)
    u[:, 0] = shapes.T @ q
    stored[0] = 0.5 * float(p @ p + (modal.omega * q) @ (modal.omega * q))
    rigid = modal.omega == 0
    for seen, place, rate in zip(shapes[rigid], q[rigid], p[rigid], strict=True):
        places, rates = np.empty(n), np.empty(n)
        translate(discrete.dt, place, rate, seen @ channels, places, rates)
        u[:, 1:] += seen[:, None] * places
        stored[1:] += 0.5 * rates**2
    omega, zeta, bent = modal.omega[~rigid], modal.zeta[~rigid], shapes[~rigid]
    a, b = oscillator.transition(discrete.dt, omega, zeta)
    form = oscillator.dissipation_form(discrete.dt, omega, zeta)
    steps = np.array([a[0, 0], a[0, 1], a[1, 0], a[1, 1], b[0], b[1], omega**2])
    upper = np.array([form[0, 0], 2 * form[0, 1], 2 * form[0, 2], form[1, 1], 2 * form[1, 2], form[2, 2]])
    if len(omega):
        _replay(steps, upper, np.ascontiguousarray(bent.T), q[~rigid], p[~rigid], channels, u, stored, lost)
    load_work = np.zeros(n + 1)
    load_work[1:] = np.cumsum(np.sum(channels[ports:] * np.diff(u[ports:], axis=1), axis=0))
    u = u[:ports]
    _add_relaxations(discrete, modal, force, u, stored, lost)
    compliance = modal.residual.compliance
    if np.any(compliance):
        before = np.concatenate([discrete.rest[:, None], force], axis=1)
        u += compliance @ before
        stored += 0.5 * np.sum(before * (compliance @ before), axis=0)
        jump = np.diff(before, axis=1)  # a spring loaded at once takes F^2 c and keeps half
        lost[1:] += 0.5 * np.sum(jump * (compliance @ jump), axis=0)
    return Motion(u, stored, np.cumsum(lost), load_work)


def _add_relaxations(
    discrete: Discrete, modal: ModalGreens, force: Array, u: Array, stored: Array, lost: Array
) -> None:
    """Kelvin-Voigt elements f = y' + rate y: each stores rate y^2/2 and loses the integral of y'^2."""
    dt = discrete.dt
    for amplitudes, rate in zip(modal.residual.shapes, modal.residual.rates, strict=True):
        f, held = amplitudes @ force, float(amplitudes @ discrete.rest)
        decay, gain = float(np.exp(-rate * dt)), dt * float(oscillator.expm1_over(np.array(-rate * dt)))
        if held != 0.0 and rate == 0.0:
            raise GreensFunctionError("a dashpot cannot carry a preload: hold the body somewhere")
        start = held / rate if held != 0.0 else 0.0
        y = np.concatenate([[start], _first_order(decay, gain, f, start)])
        u += amplitudes[:, None] * y
        stored += 0.5 * rate * y**2
        square = dt * float(oscillator.expm1_over(np.array(-2 * rate * dt)))
        lost[1:] += (f - rate * y[:-1]) ** 2 * square


def _sampled_motion(discrete: Discrete, weights: Array, force: Array, base: Motion) -> Motion:
    """Add the part known by step weights; its energy from waves where possible, else as work."""
    body, dt = discrete.body, discrete.dt
    ports, n = force.shape
    u = base.displacement.copy()
    for i in range(ports):
        for j in range(ports):
            u[i, 1:] += history.convolve(weights[i, j], force[j] - discrete.rest[j])
    if np.any(discrete.rest):
        u += (body.greens.static_compliance() @ discrete.rest)[:, None]
    drift = _translation(discrete)
    u += drift[:, None] * (dt * np.arange(n + 1))
    kinetic = 0.5 * body.momentum * float(drift[0])
    rod = body.greens.rod
    if rod is not None and rod.damping_ratio == 0.0 and not np.any(discrete.rest):
        steps = 2 * rod.transit / dt
        if abs(steps - round(steps)) < 1e-6 and round(steps) > 0:
            stored, lost = _wave_energy(rod, force[0], dt, round(steps))
            momentum = np.concatenate([[0.0], np.cumsum(force[0] * dt)])  # a translating rod: Galilei
            stored = stored + float(drift[0]) * momentum + kinetic
            return Motion(u, base.stored + stored, base.dissipated + lost, base.load_work)
    work = np.concatenate([[0.0], np.cumsum(np.sum(force * np.diff(u - base.displacement, axis=1), axis=0))])
    return Motion(u, base.stored + work + kinetic, base.dissipated, base.load_work, by_work=True)


def _translation(discrete: Discrete) -> Array:
    """(P,) velocity of the ports in the initial translation, of the part known by step weights [m/s]."""
    body, modal = discrete.body, discrete.kernel.modal
    if body.velocity == 0.0:
        return np.zeros(len(body.greens.ports))
    whole = body.greens.inverse_mass()[:, 0]
    part = whole if modal is None else whole - modal.inverse_mass()[:, 0]
    return body.momentum * np.where(np.abs(part) > _ROUND_OFF * np.abs(whole).max(), part, 0.0)


def _wave_energy(rod: Rod, force: Array, dt: float, steps: int) -> tuple[Array, Array]:
    """Outgoing wave a = f/Z + R a(t - T); each carries Z a^2 per unit time, R^2 of it after the far end."""
    n, r = len(force), rod.reflection
    a = _delayed(force / rod.impedance, r, steps)
    power = np.concatenate([[0.0], np.cumsum(rod.impedance * a**2 * dt)])
    now = np.arange(n + 1, dtype=np.float64)
    there, back = _at(power, now - np.float64(steps / 2)), _at(power, now - np.float64(steps))
    return (power - there) + r**2 * (there - back), (1 - r**2) * there


def _at(cumulative: Array, index: Array) -> Array:
    return np.interp(index, np.arange(len(cumulative)), cumulative)


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _replay(steps, form, shapes, q, p, force, u, stored, lost):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Oscillators under known channel forces, all at once: the loops over modes are vector code. shapes (C, M)."""
    a11, a12, a21, a22, b1, b2, w2 = steps[0], steps[1], steps[2], steps[3], steps[4], steps[5], steps[6]
    d11, d12, d13, d22, d23, d33 = form[0], form[1], form[2], form[3], form[4], form[5]
    channels, n = force.shape
    g = np.empty(q.size)
    for m in range(n):
        f, shape = force[0, m], shapes[0]
        for k in range(q.size):
            g[k] = shape[k] * f
        for c in range(1, channels):
            f, shape = force[c, m], shapes[c]
            for k in range(q.size):
                g[k] += shape[k] * f
        gone, kept = 0.0, 0.0
        for k in range(q.size):
            x, v, y = q[k], p[k], g[k]
            gone += x * (d11[k] * x + d12[k] * v + d13[k] * y) + v * (d22[k] * v + d23[k] * y) + d33[k] * y * y
            r = a11[k] * x + a12[k] * v + b1[k] * y + FLOOR
            s = a21[k] * x + a22[k] * v + b2[k] * y + FLOOR
            q[k] = r
            p[k] = s
            kept += s * s + w2[k] * r * r
        lost[m + 1] += gone
        stored[m + 1] += 0.5 * kept
        for c in range(channels):
            shape, total = shapes[c], 0.0
            for k in range(q.size):
                total += shape[k] * q[k]
            u[c, m + 1] += total


@njit(cache=True)
def translate(dt, place, rate, force, places, rates):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """A rigid-body mode: the sums of forces and of ways carry their own round-off (Knuth's two-sum).

    Bare sums drift: a steady force is rounded the same way at every step, and the position is off by eps n^2.
    """
    push, push_rest, way, way_rest = 0.0, 0.0, place, 0.0
    speed = rate
    for m in range(force.size):
        step = dt * (speed + 0.5 * dt * force[m])
        total = push + force[m]
        part = total - push
        push_rest += (push - (total - part)) + (force[m] - part)
        push = total
        speed = rate + dt * (push + push_rest)
        total = way + step
        part = total - way
        way_rest += (way - (total - part)) + (step - part)
        way = total
        places[m] = way + way_rest
        rates[m] = speed


@njit(cache=True)
def _first_order(decay, gain, f, start):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    out = np.empty_like(f)
    y = start
    for m in range(f.size):
        y = decay * y + gain * f[m] + FLOOR
        out[m] = y
    return out


@njit(cache=True)
def _delayed(f, r, steps):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    out = f.copy()
    for m in range(steps, f.size):
        out[m] += r * out[m - steps]
    return out
