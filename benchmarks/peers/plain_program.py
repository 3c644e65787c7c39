"""Landings as an engineer would program them in an afternoon, with nothing of `impact` or `seatfem`.

    python -m benchmarks.peers.plain_program SCENE.toml LEVEL

reads a scene, computes it at a fidelity 0, 1, ... and prints its measures as JSON. Both bodies are sums of natural
modes: a cantilever and a rod by their closed forms, an annular seat and a ring by finite elements (`plain_bodies.py`).
Modes are kept up to one radian a step; what the others would yield is a spring in series with the contact. Between
steps each mode moves exactly; contact, film and gas act as kicks at both ends of a step (the splitting of Strang, that
is velocity Verlet, which resonates with modes that turn by pi in a step).
"""

from __future__ import annotations

import json
import math
import sys
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import norm

Array = NDArray[np.float64]
UNITS: Final = {
    "m": 1.0, "mm": 1e-3, "um": 1e-6, "s": 1.0, "ms": 1e-3, "us": 1e-6, "N": 1.0, "g": 1e-3, "m/s": 1.0, "bar": 1e5,
    "N/um": 1e6, "N/mm": 1e3, "GN/m": 1e9, "GPa": 1e9, "MPa": 1e6, "kg/m^3": 1.0, "mm^2": 1e-6, "cm^3": 1e-6,
    "uPa s": 1e-6, "deg": math.pi / 180,
}  # fmt: skip
STEP: Final = 1e-6  # s, longest at level 0; each level halves it
ELEMENTS: Final = 4  # at level 0, for bodies by finite elements; each level has twice as many modes
GAS_CONSTANT: Final = 8.31446261815324 / 28.9647e-3  # J/(kg K), air
HEATS: Final = 1.4  # ratio of its specific heats


def number(text: Any) -> float:
    """Return a quantity in SI units."""
    if not isinstance(text, str):
        return float(text)
    value, unit = text.split(" ", 1)
    return float(value) + 273.15 if unit == "degC" else float(value) * UNITS[unit]


def numbers(table: dict[str, Any], *keys: str) -> tuple[float, ...]:
    """Return some quantities of a table in SI units."""
    return tuple(number(table[key]) for key in keys)


@dataclass(frozen=True)
class Body:
    """Modes with unit modal mass.

    Attributes:
        omega, damping: (n,) angular frequencies [rad/s] and damping ratios.
        shapes: (n,) displacement of the contact by each mode.
        residual: compliance of the contact by modes left out [m/N].
        rates: (n,) modal velocities at the start.
        push: (n,) constant forces on the modes.
        stress: (places, n) stress at each place by each mode [Pa].
        kinks: (places,) stress by modes left out under a unit force at rest [Pa/N].
    """

    omega: Array
    damping: Array
    shapes: Array
    residual: float
    rates: Array
    push: Array
    stress: Array
    kinks: Array


def at_rest(omega: Any, damping: float, shapes: Array, compliance: float) -> Body:
    """Return a body at rest whose contact has this static compliance [m/N]."""
    left, zero = compliance - float(np.sum((shapes / omega) ** 2)), np.zeros_like(omega)
    no_stress = np.zeros((0, len(omega)))
    return Body(omega, np.full_like(omega, damping), shapes, max(left, 0.0), zero, zero, no_stress, np.zeros(0))


def cantilever(table: dict[str, Any], at: float, highest: float) -> Body:
    """Return an Euler-Bernoulli beam struck at ``at`` [m]; stresses at its root and its contact."""
    length, width, thickness = numbers(table, "length", "width", "thickness")
    young, density = numbers(table["material"], "young", "density")
    mass, bending = density * length * width * thickness, young * width * thickness**3 / 12
    count = int(math.sqrt(highest * math.sqrt(mass / (bending * length))) * length / math.pi + 0.5)
    guess = (np.arange(count) + 0.5) * np.pi
    guess[0] = 1.875
    for _ in range(20):  # Newton's on cos k + 1/cosh k
        sech = 1 / np.cosh(np.minimum(guess, 700))
        guess += (np.cos(guess) + sech) / (np.sin(guess) + sech * np.tanh(guess))
    fall, end = np.exp(-guess), np.cos(guess) + np.sin(guess)
    rising = (fall + end) / (1 + fall**2 + 2 * fall * np.cos(guess))  # (1 - sigma) exp(k)/2
    sigma = 1 - 2 * rising * fall

    def shape(x: float, sign: int) -> Array:
        """Return the modes at ``x`` of the length (sign -1), or their curvatures times (length/k)^2 (sign 1)."""
        bent = rising * np.exp(guess * (x - 1)) + (1 + sigma) / 2 * np.exp(-guess * x)
        return np.asarray((bent + sign * (np.cos(guess * x) - sigma * np.sin(guess * x))) / math.sqrt(mass))

    omega = (guess / length) ** 2 * math.sqrt(bending * length / mass)
    body = at_rest(omega, number(table.get("damping_ratio", 0)), shape(at / length, -1), at**3 / (3 * bending))
    rates = np.zeros(count)
    if "release" in table:
        rates[0] = number(table["release"]["velocity"]) / shape(1.0, -1)[0]
    curvatures = (guess / length) ** 2 * np.array([shape(0.0, 1), shape(at / length, 1)])
    kinks = np.array([at, 0.0]) / bending - curvatures @ (body.shapes / omega**2)
    face = young * thickness / 2
    return replace(body, rates=rates, stress=face * curvatures, kinks=face * kinks)


def rod(table: dict[str, Any], highest: float) -> Body:
    """Return a rod that is fixed at its far end."""
    young, density, length, area = numbers(table, "young", "density", "length", "area")
    speed = math.sqrt(young / density)
    omega = np.pi * speed / length * (np.arange(max(1, int(highest * length / (np.pi * speed) + 0.5))) + 0.5)
    shapes = np.full(len(omega), math.sqrt(2 / (density * area * length)))
    return at_rest(omega, number(table.get("damping_ratio", 0)), shapes, length / (young * area))


def massless() -> Body:
    """Return a body without modes, for a seat that is a spring."""
    return at_rest(np.zeros(0), 0.0, np.zeros(0), 0.0)


@njit(cache=True)
def march(turns, rate_turns, shapes, stress, kinks, q, v, push, gap0, stiffness, film, gas, state, dt, steps):
    """Return forces (steps, contacts), stresses (steps, places), openings (steps,), gas flows (3,)."""
    contacts, count = shapes.shape
    forces, seen = np.zeros((steps, contacts)), np.zeros((steps, len(stress)))
    opening, flows = np.zeros(steps), np.zeros(3)
    gaps = gap0 + shapes @ q
    yields = shapes[0] @ shapes[0]
    for step in range(steps):
        kick = push * dt / 2
        for half in range(2):
            if half:
                for k in range(count):
                    moved = turns[k, 0] * q[k] + turns[k, 1] * v[k]
                    v[k] = rate_turns[k, 0] * q[k] + rate_turns[k, 1] * v[k]
                    q[k] = moved
                gaps = gap0 + shapes @ q
                kick = push * dt / 2
            load = 0.0
            if gas[0] > 0:
                load = feed_gas(gas, state, flows, max(gaps[0], 0.0), (step + half / 2) * dt, dt / 2)
            for c in range(contacts):
                force = stiffness[c] * max(0.0, -gaps[c])
                if film[0] > 0 and c == 0 and gaps[0] > 0:
                    speed = shapes[0] @ v
                    braked = 1 - math.exp(-film[0] * yields * dt / 2 / (gaps[0] + film[1]) ** 3)
                    force += max(-speed * braked / yields / (dt / 2), -film[2])
                forces[step, c] += force / 2
                kick = kick + shapes[c] * (force * dt / 2)
            v += kick + shapes[0] * (load * dt / 2)
        seen[step] = stress @ q + kinks * forces[step, 0]
        opening[step] = gaps[0]
    return forces, seen, opening, flows


@njit(cache=True)
def nozzle(upstream, temperature, downstream):
    """Return the mass flow through an area [kg/(s m^2)], Saint-Venant and Wantzel."""
    r = max(downstream / upstream, (2 / (HEATS + 1)) ** (HEATS / (HEATS - 1)))
    inside = 2 * HEATS / ((HEATS - 1) * GAS_CONSTANT * temperature)
    return upstream * math.sqrt(inside * max(r ** (2 / HEATS) - r ** ((HEATS + 1) / HEATS), 0.0))


@njit(cache=True)
def gas_rates(gas, pressure, mass, lift, time):
    """Return p', flow through the reed, flow out through the other valve."""
    _, radius, flow, suction, warm, discharge, _, speed, start, bore, crank, link, clearance, other = gas
    angle = start + speed * time
    root = math.sqrt(link**2 - (crank * math.sin(angle)) ** 2)
    piston = math.pi / 4 * bore**2
    volume = clearance + piston * (crank * (1 - math.cos(angle)) + link - root)
    growth = piston * speed * (crank * math.sin(angle) + crank**2 * math.sin(angle) * math.cos(angle) / root)
    inside = pressure * volume / (mass * GAS_CONSTANT)
    area = flow * min(2 * math.pi * radius * lift, math.pi * radius**2)
    if suction >= pressure:
        entering, source = area * nozzle(suction, warm, pressure), warm
    else:
        entering, source = -area * nozzle(pressure, inside, suction), inside
    leaving = other * nozzle(pressure, inside, discharge) if pressure > discharge else 0.0
    rise = HEATS / volume * (GAS_CONSTANT * (source * entering - inside * leaving) - pressure * growth)
    return rise, entering, leaving


@njit(cache=True)
def feed_gas(gas, state, flows, lift, time, span):
    """Advance pressure and mass by the midpoint rule; return the force on the reed [N]."""
    rise, entering, leaving = gas_rates(gas, state[0], state[1], lift, time)
    pressure, mass = state[0] + span / 2 * rise, state[1] + span / 2 * (entering - leaving)
    rise, entering, leaving = gas_rates(gas, pressure, mass, lift, time + span / 2)
    state[0] += span * rise
    state[1] += span * (entering - leaving)
    flows[0 if entering > 0 else 1] += span * abs(entering)
    flows[2] += span * leaving
    return (gas[3] - pressure) * math.pi * gas[1] ** 2


def exact_turns(omega: Array, damping: Array, dt: float) -> tuple[Array, Array]:
    """Return what coordinates and velocities after ``dt`` owe to both before; rigid modes have omega 0."""
    decay, rest = damping * omega, omega * np.sqrt(1 - damping**2)
    fall, c = np.exp(-decay * dt), np.cos(rest * dt)
    s = np.where(rest > 0, np.sin(rest * dt) / np.where(rest > 0, rest, 1), dt)
    turns = fall[:, None] * np.column_stack([c + decay * s, s])
    return turns, fall[:, None] * np.column_stack([-(omega**2) * s, c - decay * s])


def largest_mean(force: Array, dt: float, width: float) -> float:
    """Return the largest mean of forces at the ends of steps over a window [N]."""
    summed, time = np.concatenate([[0.0], np.cumsum(force) * dt]), dt * np.arange(len(force) + 1)
    ends = time[time >= width]
    return float(((np.interp(ends, time, summed) - np.interp(ends - width, time, summed)) / width).max())


def rainflow(history: Array) -> list[tuple[float, float]]:
    """Return (amplitude, mean) of the whole cycles of a history that repeats."""
    around = np.append(np.roll(history, -int(np.argmax(history))), history.max())
    stack: list[float] = []
    cycles = []
    turning = np.concatenate([[True], (np.diff(around[:-1]) * np.diff(around[1:])) < 0, [True]])
    for value in around[turning]:
        stack.append(float(value))
        while len(stack) > 2 and abs(stack[-1] - stack[-2]) >= abs(stack[-2] - stack[-3]):
            low = stack[-3:-1]
            cycles.append((abs(low[0] - low[1]) / 2, sum(low) / 2))
            del stack[-3:-1]
    return cycles


def life_margin(histories: Array, table: dict[str, Any], strength: dict[str, Any]) -> float:
    """Return the factor on all stresses at which Miner's sum over the life is 1, by Goodman and Haibach."""
    curve, ultimate = strength["curve"], number(strength["ultimate"])
    knee, cycles, slope = numbers(curve, "knee_stress", "knee_cycles", "slope")
    fewer = 10 ** (-norm.ppf(number(table["survival"])) * number(curve["scatter"]))
    blocks = 60 * number(table["hours"]) * number(table["rpm"])
    margins = []
    for history in (sign * row for row in histories.T for sign in (1, -1)):
        counted = np.array(rainflow(history))

        def damage(factor: float, counted: Array = counted) -> float:
            amplitude, mean = factor * counted.T
            reversed_ = amplitude / (1 - np.maximum(mean, 0) / ultimate)
            lives = fewer * cycles * (reversed_ / knee) ** -np.where(reversed_ > knee, slope, 2 * slope - 1)
            return float(np.log(blocks * np.sum(1 / lives)))

        highest = 0.999999 * ultimate / counted[:, 1].max() if counted[:, 1].max() > 0 else 1e3
        margins.append(brentq(damage, 1e-3, highest))
    return float(min(margins))


def gas_of(table: dict[str, Any]) -> tuple[float, ...]:
    """Return the numbers of the gas, as `gas_rates` takes them; the first says that there is gas."""
    suction = numbers(table["suction"], "pressure", "temperature")
    discharge = numbers(table["discharge"], "pressure", "temperature")
    bore, stroke, link, clearance, other = numbers(table, "bore", "stroke", "rod", "clearance", "other_valve_area")
    turns = 2 * math.pi * number(table["rpm"]) / 60
    radius = number(table["port_diameter"]) / 2
    return (
        1.0, radius, 0.6, *suction, *discharge, turns, number(table.get("angle", 0)), bore, stroke / 2, link,
         clearance, other,
    )  # fmt: skip


@dataclass(frozen=True)
class Fidelity:
    """Longest step [s] and size of bodies by finite elements, in modes."""

    step: float
    elements: int


def fidelity(level: int) -> Fidelity:
    """Return what a level means."""
    return Fidelity(STEP / 2**level, ELEMENTS * 2**level)


def bodies_of(scene: dict[str, Any], fine: Fidelity) -> tuple[Body, Body, float]:
    """Return the striker, the seat and the stiffness of a seat that is a spring."""
    if {scene["reed"]["kind"], scene["seat"]["kind"]} & {"annular", "cad", "ring_plate"}:
        from benchmarks.peers import plain_bodies  # scikit-fem takes a second to load

    reed, seat, contact = scene["reed"], scene["seat"], scene.get("contact", {})
    if reed["kind"] == "cantilever":
        striker = cantilever(reed, number(contact.get("at", reed["length"])), 1 / fine.step)
    elif reed["kind"] == "rigid_mass":
        mass, speed = numbers(reed, "mass", "velocity")
        zero, root = np.zeros(1), np.full(1, math.sqrt(mass))
        striker = Body(zero, zero, 1 / root, 0.0, speed * root, zero, np.zeros((0, 1)), np.zeros(0))
    else:
        modes = plain_bodies.sprung_ring_modes(scene, number, fine.elements, 1 / fine.step)
        omega, shapes, rates, push, residual = modes
        damping = np.full_like(omega, number(reed["damping_ratio"]))
        damping[0] = 0.0  # the ring on its springs, which have none
        no_stress = np.zeros((0, len(omega)))
        striker = Body(omega, damping, shapes, max(residual, 0.0), rates, push, no_stress, np.zeros(0))
    if seat["kind"] == "spring":
        return striker, massless(), number(seat["stiffness"])
    if seat["kind"] == "rod":
        return striker, rod(seat, 1 / fine.step), math.inf
    modes = plain_bodies.cad_seat_modes if seat["kind"] == "cad" else plain_bodies.seat_modes
    omega, shapes, compliance = modes(seat, number, fine.elements, 1 / fine.step)
    return striker, at_rest(omega, number(seat["damping_ratio"]), shapes, compliance), math.inf


def solve(scene: dict[str, Any], fine: Fidelity, strength: dict[str, Any] | None = None) -> dict[str, float]:
    """Return the measures of a scene by their names in summary.json."""
    striker, seat, seat_stiffness = bodies_of(scene, fine)
    contact, run = scene.get("contact", {}), scene["run"]
    law = number(contact["law"]["stiffness"]) if isinstance(contact.get("law"), dict) else math.inf
    film, film_table = np.zeros(3), contact.get("film")
    if film_table:
        viscosity, floor, width, length = numbers(film_table, "viscosity", "floor", "width", "length")
        film = np.array([viscosity * length * width**3, floor, 1e5 * width * length])
    residual = 0.0 if film_table else striker.residual + seat.residual
    stiffness = [1 / (1 / law + 1 / seat_stiffness + residual)]
    shapes, gaps = [np.concatenate([striker.shapes, -seat.shapes])], [number(contact.get("gap", 0))]
    if "stopper" in scene:
        stiffness.append(1 / (1 / number(scene["stopper"]["stiffness"]) + striker.residual))
        shapes.append(np.concatenate([-striker.shapes, 0 * seat.shapes]))
        gaps.append(number(scene["stopper"]["lift"]) - gaps[0])
    keys = ("omega", "damping", "rates", "push")
    omega, damping, v, push = (np.concatenate([getattr(b, key) for b in (striker, seat)]) for key in keys)
    q = np.zeros_like(omega)
    gas: tuple[float, ...] = (0.0,) * 14
    state, duration = np.zeros(2), number(run.get("duration", 0))
    if "gas" in scene:
        table, gas = scene["gas"], gas_of(scene["gas"])
        duration = 60 * number(table["cycles"]) / number(table["rpm"])
        pressure = number(table["start_pressure"])
        warm = gas[4] * (pressure / gas[3]) ** ((HEATS - 1) / HEATS)
        state = np.array([pressure, pressure * gas[12] / (GAS_CONSTANT * warm)])
        load = (gas[3] - pressure) * math.pi * gas[1] ** 2  # presses the reed on the seat at the start
        compliance = float(np.sum((striker.shapes / striker.omega) ** 2))
        held = -compliance * load / (1 / stiffness[0] + compliance)
        q = striker.shapes / striker.omega**2 * (load + held)
    rows = np.array(shapes)
    steps = math.ceil(duration / fine.step)
    dt = duration / steps
    if max(k * row @ row for k, row in zip(stiffness, rows, strict=True)) * dt**2 > 4:
        raise ValueError("the step is too long for the contact's stiffness")
    stress = np.hstack([striker.stress, np.zeros((len(striker.stress), len(seat.omega)))])
    turns = exact_turns(omega, damping, dt)
    forces, seen, opening, flows = march(
        *turns, rows, stress, striker.kinks, q.copy(), v.copy(), push, np.array(gaps), np.array(stiffness),
        film, gas, state, dt, steps,
    )  # fmt: skip
    return read_measures(scene, strength, forces, seen, opening, flows, dt)


def read_measures(
    scene: dict[str, Any],
    strength: dict[str, Any] | None,
    forces: Array,
    seen: Array,
    opening: Array,
    flows: Array,
    dt: float,
) -> dict[str, float]:
    """Return the measures of a march."""
    force, width = forces[:, 0], number(scene["run"].get("filter_width", "1 us"))
    out = {"impulse_Ns": float(force.sum() * dt), "filtered_peak_force_N": largest_mean(force, dt, width)}
    if seen.shape[1]:
        first = int(np.argmax(force > 0))
        out["peak_reed_stress_after_contact_Pa"] = float(np.abs(seen[first:]).max())
        out["stress_at_contact_Pa"] = float(np.abs(seen[first:, 1]).max())
    if strength:
        out["life_margin"] = life_margin(np.vstack([np.zeros((1, seen.shape[1])), seen]), scene["life"], strength)
    if "gas" in scene:
        out |= {"gas_mass_forward_kg": flows[0], "gas_mass_back_kg": flows[1], "gas_mass_other_kg": flows[2]}
        out["largest_lift"] = float(opening.max())
    return {key: float(value) for key, value in out.items()}


def read_scene(path: Path) -> dict[str, Any]:
    """Return a scene, the file of its seat by its whole path."""
    scene = tomllib.loads(path.read_text(encoding="utf-8"))
    if "file" in scene["seat"]:
        scene["seat"]["file"] = str(path.parent / scene["seat"]["file"])
    return scene


def main(words: Sequence[str]) -> None:
    """Compute a scene and print its measures."""
    path = Path(words[0])
    scene, strength = read_scene(path), None
    if "life" in scene:
        strength = tomllib.loads((path.parent / scene["life"]["strength"]).read_text(encoding="utf-8"))
    print(json.dumps(solve(scene, fidelity(int(words[1])), strength)))  # noqa: T201


if __name__ == "__main__":
    main(sys.argv[1:])
