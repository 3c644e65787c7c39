"""How bodies meet: speed, grazing, no gap, preload, release at contact, contact for ever."""

import math

import numpy as np
from scipy.optimize import brentq

from impact import (
    Body,
    ContactProblem,
    ContactStepper,
    Hertz,
    HuntCrossley,
    LinearSpring,
    Signorini,
    measures,
    prepare,
    rigid_mass,
    solve,
    spring,
)
from impact.greens.base import Array
from tests.extremes import scenes
from tests.extremes.cell import Cell, Finding, chosen, swept

EPS = float(np.finfo(float).eps)


def encounter_cells() -> tuple[Cell, ...]:
    """Return one sweep for each way to meet."""
    speeds = [10.0**k for k in range(-9, 4)]
    small = [10.0**k for k in range(-16, 0)]
    return (
        *swept("impact speed, rigid, m/s", speeds, rigid_speed),
        *swept("impact speed, Hertz, m/s", speeds, hertz_speed),
        *swept("impact speed, Hunt-Crossley, m/s", speeds, hunt_crossley_speed),
        *swept("grazing depth / amplitude", small, grazing),
        *swept("miss / amplitude", [10.0**k for k in range(-15, 0)], miss),
        *swept("preload / stiffness, m", [10.0**k for k in range(-12, 7)], preload),
        *swept("perpetual contact, mass / impedance / s", [10.0**k for k in range(-6, 7)], perpetual),
        *chosen("zero gap", zero_gap, ("at rest", "parting", "pressed", "striking", "released there")),
    )


def rigid_speed(v: float) -> Finding:
    """A mass strikes the fixed rod: the impulse is proportional to the speed (d'Alembert)."""
    result = scenes.run(rigid_mass(mass=1.0, velocity=-v), Body(scenes.FIXED_ROD), Signorini(), 1e-3, 4000)
    return Finding(
        scenes.relative(measures.impulse(result), v * scenes.FIRST_BLOW), 1e-4, scenes.said(result), "impulse"
    )


def hertz_speed(v: float) -> Finding:
    """A sphere strikes a wall: depth (5 m v^2/(4 k))^(2/5), duration 2.943275 depth/v, rebound at v (Hertz)."""
    depth = (5 * v**2 / 4e9) ** 0.4
    duration = 2 * math.sqrt(math.pi) / 5 * math.gamma(0.4) / math.gamma(0.9) * 2 * depth / v
    dt = duration / 1000
    result = scenes.run(rigid_mass(mass=1.0, velocity=-v), scenes.rigid_wall(), Hertz(1e9), dt, 1200, rule="conserving")
    errors = (
        scenes.relative(-float(result.gap.min()), depth),
        scenes.relative(measures.restitution(result), 1.0),
        abs(float(np.sum(result.force > 0)) * dt / duration - 1),
    )
    return Finding(max(errors), 2e-3, scenes.said(result), "depth, duration and rebound")


def hunt_crossley_speed(v: float) -> Finding:
    """A wall has (1 + e) d V = ln((1 + d V)/(1 - e d V)) at any speed; d = 1 s/m. First order in the step."""
    depth = min((5 * v**2 / 4e9) ** 0.4, (2.5e-9 * max(v, math.log1p(v))) ** 0.4)  # elastic, or stopped by the damping
    fine = 3000 if v < 10 else 100
    dt = depth / v / fine
    steps = int((3 + 6 * v) * fine)
    result = scenes.run(rigid_mass(mass=1.0, velocity=-v), scenes.rigid_wall(), HuntCrossley(1e9, 1.0), dt, steps)
    low, high = 0.0, 1.0
    for _ in range(200):  # the left side minus the right falls from d V - ln(1 + d V) > 0 as e grows
        e = (low + high) / 2
        possible = e * v < 1 and (1 + e) * v > math.log1p(v) - math.log1p(-e * v)
        low, high = (e, high) if possible else (low, e)
    return Finding(abs(measures.restitution(result) - e) / max(e, 1e-2), 1e-2, scenes.said(result), "restitution")


def grazing(depth: float) -> Finding:
    """An oscillator that would pass the seat by a share ``depth`` of its amplitude touches a dashpot Z = m w.

    The way is known to eps of the amplitude for each step up to the contact, no better: the impulse must lie between
    those of blows that much deeper and less deep. Below it no contact is as right as a contact.
    """
    reach = 1.0 - depth
    start = math.sqrt(2 * depth) * 2
    phase = math.pi - start if depth < 0.1 else math.acos(-reach) - 0.5
    dt = math.sqrt(2 * depth) / 100
    striker = scenes.oscillator(1.0, x=math.cos(phase), v=-math.sin(phase))
    result = scenes.run(striker, scenes.dashpot(1.0), Signorini(), dt, 500 if depth < 0.1 else 1000, gap=reach)
    first = measures.contact_groups(result)
    impulse = 0.0
    if len(first):
        inside = (result.time[1:] <= first[0, 1] + dt / 2) & (result.time[1:] > first[0, 0] - dt / 2)
        impulse = float(result.force[1:][inside].sum()) * dt
    round_off = 200 * EPS
    low, high = _grazing_impulse(depth - round_off), _grazing_impulse(depth + round_off)
    return Finding(max(low - impulse, impulse - high, 0.0) / high, 5e-3, scenes.said(result), "impulse")


def _grazing_impulse(depth: float) -> float:
    """Return Z times the way of x'' + x' + x = 0 from x = -(1 - depth) to x' = 0: the dashpot follows no further.

    Where the way is too short for digits of x, x = -reach within it, which leaves out the square of the speed.
    """
    if depth <= 0:
        return 0.0
    reach, v = 1.0 - depth, math.sqrt(depth * (2 - depth))
    if v < 1e-3:
        return v - reach * math.log1p(v / reach)
    w_d = math.sqrt(0.75)  # x = exp(-t/2) (a cos + b sin); rest at tan(w_d t) from x' = 0
    a, b = -reach, (-v - reach / 2) / w_d
    t = (math.atan2(b * w_d - a / 2, a * w_d + b / 2) % math.pi) / w_d
    return -reach - math.exp(-t / 2) * (a * math.cos(w_d * t) + b * math.sin(w_d * t))


def miss(distance: float) -> Finding:
    """An oscillator that stays away by a share of its amplitude never touches; round-off is 4 eps."""
    result = scenes.run(
        scenes.oscillator(1.0, x=1.0), scenes.dashpot(1.0), Signorini(), 1e-2, 100_000, gap=1 + distance
    )
    touched = float(result.force.max())
    nearest = float(result.gap.min())
    return Finding(touched if distance > 1e-13 else 0.0, 0.0, scenes.said(result), f"force; nearest {nearest:.3g}")


def preload(push: float) -> Finding:
    """An oscillator (w = 1) pressed on a unit spring rests for ever: N = push/2 by statics."""
    problem = ContactProblem(scenes.oscillator(1.0, push=-push), Body(spring(stiffness=1.0)), preload=True)
    result = solve(problem, dt=0.1, duration=1e4)
    return Finding(float(np.abs(result.force / (push / 2) - 1).max()), 1e-9, scenes.said(result), "force")


def perpetual(ratio: float) -> Finding:
    """A mass is pushed against a dashpot for 1000 times m/Z: N = F (1 - exp(-Z t/m)), first order."""
    dt = ratio / 100
    result = scenes.run(scenes.pushed_mass(ratio, 0.0, -1.0), scenes.dashpot(1.0), Signorini(), dt, 100_000)
    t = result.time[1:] - dt / 2
    return Finding(
        float(np.abs(result.force[1:] - (1 - np.exp(-t / ratio))).max()), 1e-2, scenes.said(result), "force / push"
    )


def zero_gap(name: str) -> Finding:
    """Bodies touch without force, part, press from t = 0, or strike at t = 0."""
    mass = rigid_mass(mass=1.0, velocity=0.0)
    if name == "at rest":
        result = scenes.run(mass, Body(scenes.FIXED_ROD), Signorini(), 1e-2, 10_000)
        return Finding(
            float(np.abs(result.force).max() + np.abs(result.gap).max()), 1e-100, scenes.said(result), "force"
        )
    if name == "parting":
        result = scenes.run(rigid_mass(mass=1.0, velocity=1e-9), Body(scenes.FIXED_ROD), Signorini(), 1e-2, 10_000)
        return Finding(float(result.force.max()), 0.0, scenes.said(result), "force")
    if name == "pressed":
        result = scenes.run(scenes.pushed_mass(1.0, 0.0, -1.0), scenes.dashpot(1.0), Signorini(), 1e-3, 20_000)
        exact = 1 - np.exp(-(result.time[1:] - 5e-4))
        return Finding(float(np.abs(result.force[1:] - exact).max()), 1e-3, scenes.said(result), "force")
    if name == "striking":
        result = scenes.run(rigid_mass(mass=1.0, velocity=-1.0), scenes.dashpot(1.0), Signorini(), 1e-3, 20_000)
        exact = np.exp(-(result.time[1:] - 5e-4))
        return Finding(float(np.abs(result.force[1:] - exact).max()), 1e-3, scenes.said(result), "force")
    # bent away to x = 0 where it touches, its rest is at x = -1: half a swing against a spring of its own stiffness
    striker = scenes.oscillator(1.0, push=-1.0)
    result = scenes.run(striker, Body(spring(stiffness=1.0)), Signorini(), 1e-3, 4000)
    exact = (1 - np.cos(math.sqrt(2.0) * (result.time[1:]))) / 2
    return Finding(float(np.abs(result.force[1:] - exact).max()), 2e-3, scenes.said(result), "force")


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
