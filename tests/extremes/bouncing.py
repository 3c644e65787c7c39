"""Bounces by the thousand: without loss, and dying out in finite time as in Zeno's paradox."""

import math

import numpy as np
from scipy.optimize import brentq

from impact import ContactProblem, ContactStepper, LinearSpring, prepare
from impact.greens.base import Array
from tests.extremes import scenes
from tests.extremes.cell import Cell, Finding, swept


def bouncing_cells() -> tuple[Cell, ...]:
    """Return sweeps over the number of bounces and over what is left of the speed after each."""
    return (
        *swept("bounces", [10.0, 100.0, 1000.0, 10_000.0], bouncing),
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


def _count(force: Array) -> int:
    closed = force > 0
    return int(np.sum(closed[1:] & ~closed[:-1])) + int(closed[0])
