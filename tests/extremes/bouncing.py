"""Bounces by the thousand: without loss, and dying out in finite time as in Zeno's paradox."""

import math

import numpy as np
from scipy.optimize import brentq

from impact import Body, ContactProblem, ContactStepper, LinearSpring, ModalGreens, Residual, prepare
from impact.greens.base import Array
from tests.extremes import scenes
from tests.extremes.cell import Cell, Finding, swept


def bouncing_cells() -> tuple[Cell, ...]:
    """Return sweeps over the number of bounces and over what is left of the speed after each."""
    return (
        *swept("bounces", [10.0, 100.0, 1000.0, 10_000.0], bouncing),
        *swept("Zeno, restitution", [0.14, 0.3, 0.5, 0.8, 0.9, 0.97, 0.99], zeno),
        *swept("Zeno on a sinking wall, restitution", [0.7, 0.9, 0.99, 0.999, 0.9999], sinking),
    )


def bouncing(bounces: float) -> Finding:
    """A ball under gravity on a lossless spring leaves each bounce as fast as it came, by the conserving step."""
    gravity, dt, n = 0.2, 0.05, int(bounces)
    flight = 2 / gravity + math.pi
    problem = ContactProblem(scenes.pushed_mass(1.0, -1.0, -gravity), scenes.rigid_wall(), law=LinearSpring(1.0))
    stepper = ContactStepper(prepare(problem, dt, n * flight, "conserving"))
    stepper.advance(stepper.prepared.steps)
    gap, force = stepper.gap[:, 0], stepper.force[:, 0]
    free = np.flatnonzero((force[1:] == 0) & (force[:-1] == 0))  # steps that are flight from end to end
    speed = np.diff(gap)[free + 1] / dt
    middle = (gap[free + 1] + gap[free + 2]) / 2 + gravity * dt**2 / 8
    energy = speed**2 / 2 + gravity * middle
    return Finding(float(np.abs(energy / 0.5 - 1).max()), 1e-9, (), f"energy in flight, {_count(force)} bounces")


def zeno(e: float) -> Finding:
    """A ball on a spring beside a dashpot bounces until it rests, in finite time, by rigid contact.

    Without gravity e = exp(-2 z acos(z)/sqrt(1 - z^2)); with it each contact m x'' + c x' + K x = -m G is solved in
    closed form up to N = 0. The step adds damping w h/4; at the end the seat carries the weight.
    """
    damping = brentq(lambda z: 2 * z * math.acos(z) / math.sqrt(1 - z * z) + math.log(e), 1e-6, 1 - 1e-9)
    gravity, dt = 0.01, 0.005
    seat = ModalGreens(
        np.zeros(0),
        np.zeros(0),
        np.zeros((0, 1)),
        Residual.relaxing(1.0, 1 / (2 * damping)),
        origin={"kind": "dashpot"},
    )
    speeds = _speeds(damping, gravity, dt)
    duration = 2 / gravity * sum(speeds) + 40 * (len(speeds) + 2)
    striker = scenes.pushed_mass(1.0, -1.0, -gravity)
    stepper = ContactStepper(prepare(ContactProblem(striker, Body(seat)), dt, duration))
    stepper.advance(stepper.prepared.steps)
    falls = _speeds_after(stepper.gap[:, 0], stepper.force[:, 0], dt)
    n = min(len(falls), len(speeds) - 1)
    early = float(np.abs(falls[:n] - np.array(speeds[1 : n + 1])).max()) if n else math.inf
    rest = abs(float(stepper.force[-100:].mean()) / gravity - 1)
    return Finding(max(early, rest), 0.02, (), f"speed after each of {n} bounces / the first, weight at rest")


def sinking(e: float) -> Finding:
    """A ball bounces on a lossless spring on a dashpot Z, which gives way a little each time; conserving step.

    The force is a damped oscillator about the weight, N'' + (k/Z) N' + (k/m) N = k G, from N = 0, N' = k v to N = 0
    again, where N' is k times the next speed: e = exp(-pi z/sqrt(1 - z^2)), 2 z = sqrt(k m)/Z, without gravity. At
    0.9999 the ball bounces 10,000 times before a flight is shorter than ten steps, and then rests on the wall.
    """
    damping, gravity, dt = -math.log(e) / math.hypot(math.pi, math.log(e)), 0.2, 0.05
    speeds = _sinking_speeds(damping, gravity, least=5 * gravity * dt)
    duration = sum(2 * v / gravity + math.pi + 1 for v in speeds) + 16 / damping
    striker, wall = scenes.pushed_mass(1.0, -1.0, -gravity), scenes.dashpot(1 / (2 * damping))
    problem = ContactProblem(striker, wall, law=LinearSpring(1.0))
    stepper = ContactStepper(prepare(problem, dt, duration, "conserving"))
    stepper.advance(stepper.prepared.steps)
    gap, force = stepper.gap[:, 0], stepper.force[:, 0]
    closed = force > 0
    flight = np.flatnonzero(closed[:-4] & ~closed[1:-3] & ~closed[2:-2] & ~closed[3:-1]) + 2  # second step of each
    speed, middle = (gap[flight + 1] - gap[flight]) / dt, (gap[flight] + gap[flight + 1]) / 2 + gravity * dt**2 / 8
    approach = np.sqrt(np.maximum(speed**2 + 2 * gravity * middle, 0.0))
    n = sum(v >= 5 * gravity * dt for v in speeds[1:])
    off = float(np.abs(approach[:n] - np.array(speeds[1 : n + 1])).max()) if len(approach) >= n else 1.0
    rest = abs(float(force[-200:].mean()) / gravity - 1)
    return Finding(max(off, rest), 2e-3, (), f"speed after each of {n} bounces / the first, weight at rest")


def _sinking_speeds(z: float, gravity: float, least: float) -> list[float]:
    """Return speeds of approach, bounce by bounce, down to ``least``: N = G + exp(-z t) (a cos + b sin)."""
    speeds, w_d = [1.0], math.sqrt(1 - z * z)
    while speeds[-1] > least:
        a, b = -gravity, (speeds[-1] - z * gravity) / w_d

        def force(t: float, b: float = b) -> float:
            return gravity + math.exp(-z * t) * (-gravity * math.cos(w_d * t) + b * math.sin(w_d * t))

        crest = (math.pi / 2 + math.atan2(-a, b)) / w_d  # from there on the force falls for half a period
        if force(crest + math.pi / w_d) >= 0:
            break  # the spring stays pressed for ever
        t = brentq(force, crest, crest + math.pi / w_d, xtol=1e-14)
        c, s = math.cos(w_d * t), math.sin(w_d * t)
        speeds.append(-math.exp(-z * t) * ((w_d * b - z * a) * c - (w_d * a + z * b) * s))
    return speeds


def _speeds(z: float, gravity: float, dt: float) -> list[float]:
    """Return speeds of approach while a flight lasts longer than 20 relaxation times of the seat."""
    speeds, w_d = [1.0], math.sqrt(1 - z * z)
    while 2 * speeds[-1] / gravity > 40 * z + 20 * dt and len(speeds) < 2000:
        v = speeds[-1]
        b = (-v + z * gravity) / w_d  # x + G = exp(-z t) (G cos + b sin)

        def both(t: float, b: float = b) -> tuple[float, float]:
            decay, c, s = math.exp(-z * t), math.cos(w_d * t), math.sin(w_d * t)
            x = decay * (gravity * c + b * s) - gravity
            return x, -z * (x + gravity) + decay * w_d * (b * c - gravity * s)

        times = np.linspace(1e-9, 2 * math.pi / w_d, 4000)
        force = [-(2 * z * both(t)[1] + both(t)[0]) for t in times]
        end = next((i for i, f in enumerate(force) if f < 0), None)
        if end is None or end == 0:
            break
        t = brentq(lambda t: 2 * z * both(t)[1] + both(t)[0], times[end - 1], times[end])
        x, leaving = both(t)
        if leaving <= 0 or leaving**2 + 2 * gravity * x <= 0:
            break
        speeds.append(math.sqrt(leaving**2 + 2 * gravity * x))
    return speeds


def _count(force: Array) -> int:
    closed = force > 0
    return int(np.sum(closed[1:] & ~closed[:-1])) + int(closed[0])


def _speeds_after(gap: Array, force: Array, dt: float) -> Array:
    """Return speeds at which the ball falls back, from the height of each ended flight: sqrt(2 G h)."""
    closed = force > 0
    ends = np.flatnonzero(closed[:-1] & ~closed[1:])
    starts = np.flatnonzero(closed[1:] & ~closed[:-1])
    return np.array([(starts[starts > end][0] - end) * dt * 0.01 / 2 for end in ends if np.any(starts > end)])
