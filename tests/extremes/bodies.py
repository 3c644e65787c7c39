"""Ratios of stiffness and mass, damping, modes, coincidence, residuals, g(0+): what a body is made of."""

import math

import numpy as np

from impact import Body, LinearSpring, ModalGreens, Residual, Signorini, measures, rigid_mass, spring
from impact.greens.base import Array
from impact.march.history import Poles
from tests.extremes import precise, scenes
from tests.extremes.cell import Cell, Finding, swept, worst

EPS = float(np.finfo(float).eps)


def body_cells() -> tuple[Cell, ...]:
    """Return one sweep for each number that makes a body extreme."""
    sixteen = [10.0**k for k in range(-8, 9)]
    dampings = [0.0, 1e-15, 1e-9, 1e-3, 0.5, 1 - 1e-9, 1.0, 1 + 1e-9, 2.0, 1e3, 1e6]
    return (
        *swept("stiffness of reed / seat", sixteen, stiffness_ratio),
        *swept("mass of striker / rod", sixteen, mass_ratio),
        *swept("mass of striker / target", sixteen, two_masses),
        *swept("damping ratio", dampings, damping, form=".10g"),
        *swept("modes", [1, 3, 10, 30, 100, 300, 1000, 3000], modes),
        *swept("separation of two modes", [0.0, *(10.0**k for k in range(-16, -1))], coincidence),
        *swept("residual compliance / static", [0.0, *(10.0**k for k in range(-16, 9, 2))], residual_spring),
        *swept("g(0+) x mass / time", [0.0, *(10.0**k for k in range(-8, 9, 2))], instant),
    )


def stiffness_ratio(ratio: float) -> Finding:
    """An oscillator (k m) strikes a massless spring at its rest position: half a swing at W = sqrt(k_r + k_s)/sqrt(m).

    Impulse 2 m v k_s/(k_r + k_s), peak k_s v/W. The step adds damping W h/4.
    """
    whole = math.sqrt(1 + ratio)
    h = 1e-3
    striker = scenes.oscillator(math.sqrt(ratio) / whole, x=0.0, v=-1.0)
    seat = Body(spring(stiffness=1 / whole**2))
    result = scenes.run(striker, seat, Signorini(), h, 3500)
    impulse = 2 / whole**2
    peak = 1 / whole**2
    errors = (scenes.relative(measures.impulse(result), impulse), scenes.relative(measures.peak_force(result), peak))
    return Finding(max(errors), 4 * h, scenes.said(result), "impulse and peak")


def mass_ratio(ratio: float) -> Finding:
    """A mass strikes a fixed rod: heavy, it meets a spring, else by the method of steps (`_rebound`).

    The spring's half swing pi sqrt(m/K), impulse 2 m v, leaves out m_rod/m. Light, it is absorbed: N = Z v exp(-Z t/m)
    for 2 transits at most.
    """
    light = ratio <= 0.05
    span = 40 * ratio if light else 1.2 * math.pi * math.sqrt(ratio) + 3.2
    n = 4000 if light else min(int(span / 2e-3), 400_000)
    result = scenes.run(rigid_mass(mass=ratio, velocity=-1.0), Body(scenes.FIXED_ROD), Signorini(), span / n, n)
    impulse = measures.impulse(result)
    if light:
        seen = 1 - math.exp(-min(span, 2.0) / ratio)
        return Finding(scenes.relative(impulse, ratio * seen), 1e-4, scenes.said(result), "impulse")
    if ratio <= 1e3:
        return Finding(scenes.relative(impulse, ratio * _rebound(ratio)), 2e-3, scenes.said(result), "impulse")
    end = float(measures.contact_groups(result, merge=2.0)[-1, 1])
    errors = (scenes.relative(impulse, 2 * ratio), abs(end / (math.pi * math.sqrt(ratio)) - 1))
    return Finding(max(errors), 2 / math.sqrt(ratio) + 1e-4, scenes.said(result), "impulse and duration")


def _rebound(ratio: float, steps: int = 4000) -> float:
    """Return impulse/(m v) of a mass on a fixed rod: m v' = -f, f = v + r, r(t) = 2 f(t - 2) - r(t - 2), while f > 0.

    Trapezoidal rule, ``steps`` per round trip. Contact may open and close again: then f = 0 until the surfaces meet.
    """
    h = 2.0 / steps
    before_f, before_r = np.zeros(steps + 1), np.zeros(steps + 1)
    v, apart, taken = 1.0, 0.0, 0.0
    for _ in range(int(math.pi * math.sqrt(ratio)) + 4):
        r = 2 * before_f - before_r
        f = np.empty(steps + 1)
        f[0] = max(v + r[0], 0.0) if apart <= 0 else 0.0
        for k in range(steps):
            pressed = (v - h / (2 * ratio) * f[k] + r[k + 1]) / (1 + h / (2 * ratio))
            moved = apart - h * (v + (r[k] + r[k + 1]) / 2)  # opening if nothing presses
            if moved <= 0 and pressed > 0:
                f[k + 1], apart = pressed, 0.0
            else:
                f[k + 1], apart = 0.0, max(moved, 0.0)
            v -= h / (2 * ratio) * (f[k] + f[k + 1])
        taken += float(h * (f.sum() - (f[0] + f[-1]) / 2))
        before_f, before_r = f, r
    return taken / ratio


def two_masses(ratio: float) -> Finding:
    """Two free masses on a spring have the duration pi sqrt(mu/k), impulse 2 mu v, both momenta; conserving step."""
    mu = ratio / (1 + ratio)
    dt = math.pi * math.sqrt(mu) / 1000
    striker = rigid_mass(mass=ratio, velocity=-1.0)
    result = scenes.run(striker, rigid_mass(mass=1.0, velocity=0.0), LinearSpring(1.0), dt, 1100, rule="conserving")
    impulse = measures.impulse(result)
    target = float(result.target_displacement[-1] - result.target_displacement[-2]) / dt
    errors = (scenes.relative(impulse, 2 * mu), scenes.relative(-target, 2 * mu))
    return Finding(max(errors), 1e-9, scenes.said(result), "impulse and momentum of the target")


def damping(zeta: float) -> Finding:
    """One mode's g, S and recursion agree with 50 digits, from 1e-6 to 1e6 radians."""
    errors = [0.0]
    for t in 10.0 ** np.arange(-6, 7):
        for ours, exact in (
            (_mode(zeta).impulse_response(t), precise.impulse_response(float(t), 1.0, zeta)),
            (_mode(zeta).step_response(t), precise.step_response(float(t), 1.0, zeta)),
        ):
            size = max(abs(exact), min(float(t), 1.0) * math.exp(-min(zeta, 1.0) * float(t)) * 1e-3, 1e-300)
            errors.append(abs(float(ours) - exact) / size / max(1.0, float(t)))
    n, dt = 4000, 0.3
    weights = Poles.from_modes([(_mode(zeta), np.ones((1, 1)))], dt, 1).weights(_mode(zeta).step_matrix(dt), n)[0, 0]
    exact_s = np.array([precise.step_response(dt * k, 1.0, zeta) for k in (0, 1, 2, 10, 11, 1000, 1001, n - 1, n)])
    ours_w = weights[[1, 10, 1000, n - 1]]
    exact_w = exact_s[[2, 4, 6, 8]] - exact_s[[1, 3, 5, 7]]
    errors.append(float(np.abs(ours_w - exact_w).max() / max(float(np.abs(weights).max()), 1e-300)) / 100)
    return Finding(max(errors), 1e-12, (), "g, S per radian, and weights after 4000 steps")


def modes(number: float) -> Finding:
    """The rod by its n lowest modes and the residual errs by less than 0.03/n in the impulse."""
    n = int(number)
    dt = min(2e-4, 0.4 / (n * math.pi))
    result = scenes.run(rigid_mass(mass=1.0, velocity=-1.0), Body(scenes.modal_rod(n)), Signorini(), dt, int(4 / dt))
    error = scenes.relative(measures.impulse(result), scenes.FIRST_BLOW)
    return Finding(max(error, result.energy.residual * 1e6), 0.03 / n + 1e-5, scenes.said(result), "impulse")


def coincidence(separation: float) -> Finding:
    """Two modes a relative distance apart meet a mass as by a matrix exponential, to the step.

    And as it closes, the answer meets that of one mode of their common strength.
    """
    omega = np.array([2.0, 2.0 * (1 + separation)])
    two = ModalGreens(omega, np.full(2, 0.01), np.array([[0.6], [0.8]]), Residual.spring(0.1))
    one = ModalGreens(omega[:1], np.full(1, 0.01), np.ones((1, 1)), Residual.spring(0.1))
    dt = 1e-3
    ours, alike = (
        scenes.run(rigid_mass(mass=1.0, velocity=-1.0), Body(g), Signorini(), dt, 3000).force for g in (two, one)
    )
    exact = scenes.sprung_force(two, 1.0, dt, _first_contact(ours) - 1)
    return Finding(
        *worst(
            (float(np.abs(ours - alike).max() / alike.max()), 1e4 * EPS + 10 * separation),
            (float(np.abs(ours[1 : len(exact) + 1] - exact).max() / exact.max()), 5e-3),
        ),
        note="force",
    )


def residual_spring(share: float) -> Finding:
    """A bare residual r0 under a rigid law equals a spring law k = 1/r0, and both a matrix exponential.

    The step adds damping W h/4 to the frequency W = 1/sqrt(r0) of the mass on the residual: up to 2e-3 of the force.
    """
    if share == 0.0:
        scenes.run(rigid_mass(mass=1.0, velocity=-1.0), scenes.oscillator(1.0), Signorini(), 1e-2, 1000)
        return Finding(math.inf, 0.0, (), "an ill-posed contact was answered")
    mode = scenes.oscillator(1.0).greens
    bare = ModalGreens(mode.omega, mode.zeta, mode.shapes, Residual.spring(share))
    fast = min(1.0, math.sqrt(share))
    dt, n = 2e-3 * fast, 4000
    rigid = scenes.run(rigid_mass(mass=1.0, velocity=-1.0), Body(bare), Signorini(), dt, n)
    soft = scenes.run(rigid_mass(mass=1.0, velocity=-1.0), Body(mode), LinearSpring(1 / share), dt, n)
    first = _first_contact(soft.force)
    exact = scenes.sprung_force(bare, 1.0, dt, first - 1)
    return Finding(
        *worst(
            (float(np.abs(rigid.force - soft.force)[:first].max() / exact.max()), 1e-9),
            (float(np.abs(rigid.force[1:first] - exact).max() / exact.max()), 3e-3),
        ),
        scenes.said(rigid),
        "force of the first contact",
    )


def instant(value: float) -> Finding:
    """A mass meets a dashpot g(0+) beside a mode, in units of its period; zero is refused.

    A small g(0+) = 1/Z leaves the mass two half masses on the mode, a large one absorbs it: here the force at first,
    N = Z v exp(-Z t/m), over a time that resolves it.
    """
    start = np.array([[math.sqrt(value)]]) if value else np.zeros((0, 1))
    rest = Residual(start, np.zeros(len(start)), np.zeros((1, 1)))
    body = Body(ModalGreens(np.ones(1), np.zeros(1), np.full((1, 1), 1e-3), rest))
    dt = value / 1000 if value else 1e-3
    dt = min(dt, 1e-3)
    result = scenes.run(rigid_mass(mass=1.0, velocity=-1.0), body, Signorini(), dt, 4000)
    t = result.time[1:] - dt / 2
    exact = np.exp(-t / value) / value
    soft = 1e-6 * min(value, 1.0) * 10  # the mode's own yield, phi^2 t
    return Finding(
        float(np.abs(result.force[1:] / exact[0] - exact / exact[0]).max()), 1e-3 + soft, scenes.said(result), "force"
    )


def _mode(zeta: float) -> ModalGreens:
    return ModalGreens(np.ones(1), np.array([zeta]), np.ones((1, 1)), Residual.none())


def _first_contact(force: Array) -> int:
    """Return the number of steps up to the end of the first contact."""
    closed = np.flatnonzero(force > 0)
    gaps = np.flatnonzero(np.diff(closed) > 1)
    return int(closed[gaps[0]] if gaps.size else closed[-1])
