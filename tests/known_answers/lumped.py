"""Masses, springs and dashpots, gravity and preload: impacts with elementary solutions."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

import impact
from impact.greens.modal import ModalGreens, Residual
from seatfem.verify import Case

from .compliant import MASS, VELOCITY, plate_seat, rigid_seat, strike
from .limits import stepped
from .rods import end_of_contact, first_impact

_HUNT = "Hunt & Crossley, J. Appl. Mech. 42 (1975) 440; the phase plane integrates"
_PAD = "Schwager & Poeschel, Granular Matter 9 (2007) 465: no tension at the end of contact"
_WEIGHT = "Timoshenko, Strength of Materials: impact of a falling weight"
_JET = "a load that falls with the opening is a spring: F (1 - x/L)"
_CHAIN = "Herrmann & Schmaelzle, Am. J. Phys. 49 (1981) 761: beads with springs"
_PROP = "Timoshenko, Strength of Materials: propped cantilever, 3 q L/8"
_ZENER = "Zener, Phys. Rev. 59 (1941) 669: first order in lambda"
_STEPS = 800  # per unit of time, coarsest of three


def lumped_cases() -> tuple[Case, ...]:
    """Masses, springs and dashpots, gravity and preload: impacts with elementary solutions.

    Restitution of damped contacts, falling and blown weights, chain of masses, pressed reed; m = k = V = 1.
    """
    return (*_hunt_crossley(), *_pad(), *_falling_weight(), _blown_mass(), *_chain(), *_pressed_reed(), _slow_plate())


def _on_rigid(law: impact.HuntCrossley, steps: int, rule: str = "auto") -> impact.ImpactResult:
    problem = impact.ContactProblem(impact.rigid_mass(mass=1.0, velocity=-1.0), impact.Body(rigid_seat()), law=law)
    return impact.solve(problem, dt=1 / steps, duration=5.0, rule=rule)


def _hunt_crossley() -> tuple[Case, Case]:
    """Return the cases v dv/(1 + d v) = -k x^n dx: (1 + e) d V = ln((1 + d V)/(1 - e d V)); here d V = 1/2, n = 3/2."""
    name, d, e = "Hunt-Crossley contact, d V = 0.5", 0.5, 0.748434931597
    deepest = (2.5 * (1 / d - math.log(1 + d) / d**2)) ** 0.4

    def rebound(damping: float, steps: int) -> float:
        law = impact.HuntCrossley(stiffness=1.0, damping=d * damping)
        return impact.measures.impulse(_on_rigid(law, steps)) - 1.0

    def approach(stiffness: float, steps: int) -> float:
        law = impact.HuntCrossley(stiffness=stiffness, damping=d)
        return -float(np.min(_on_rigid(law, steps, "passive").gap))

    return (
        Case(name, "restitution", e, 1e-6, _HUNT, stepped(rebound, _STEPS, 2)),
        Case(name, "deepest (k/(m V^2))^(2/5)", deepest, 1e-6, _HUNT, stepped(approach, _STEPS, 1)),
    )


def _pad() -> tuple[Case, Case]:
    """Return the cases of a mass on a plate on spring beside dashpot, zeta = 0.3: until the force is zero.

    w_d t = pi - atan(2 zeta r/(1 - 2 zeta^2)), r = sqrt(1 - zeta^2), and e = exp(-zeta w t).
    """
    zeta = 0.3
    root = math.sqrt(1 - zeta**2)
    end = (math.pi - math.atan2(2 * zeta * root, 1 - 2 * zeta**2)) / root
    name = "mass on a spring with dashpot, damping ratio 0.3"

    def run(viscosity: float, stiffness: float, steps: int) -> impact.ImpactResult:
        pad = Residual.relaxing(1 / stiffness, stiffness / (2 * zeta * viscosity))
        greens = ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, 1)), pad)
        problem = impact.ContactProblem(impact.rigid_mass(mass=1.0, velocity=-1.0), impact.Body(greens))
        return impact.solve(problem, dt=1 / steps, duration=4.0)

    def case(quantity: str, exact: float, solve: Callable[[float, int], float]) -> Case:
        return Case(name, quantity, exact, 1e-6, _PAD, stepped(solve, _STEPS))

    return (
        case("restitution", math.exp(-zeta * end), lambda k, n: impact.measures.impulse(run(k, 1.0, n)) - 1.0),
        case("w t at the end of contact", end, lambda k, n: end_of_contact(run(1.0, k, n))),
    )


def _falling_weight() -> tuple[Case, Case, Case]:
    """Return the cases of a mass dropped on a spring from h = 4 m g/k and 0: N/(m g) = 1 + sqrt(1 + 2 h k/(m g)).

    Contact lasts 2 (pi - atan(sqrt(2 h k/(m g))))/w. It begins on a step.
    """
    height = 4.0
    fall = math.sqrt(2 * height)

    def drop(height: float, weight: float, stiffness: float, steps: int) -> impact.ImpactResult:
        load = impact.Load(np.ones(1), lambda t: np.full_like(t, -weight))
        body = impact.Body(impact.rigid_mass(mass=1.0, velocity=0.0).greens, loads=(load,))
        problem = impact.ContactProblem(body, impact.Body(impact.spring(stiffness=stiffness)), gap=height)
        return impact.solve(problem, dt=fall / steps, duration=2.5 * fall)

    def case(name: str, quantity: str, exact: float, solve: Callable[[float, int], float]) -> Case:
        return Case(name, quantity, exact, 1e-6, _WEIGHT, stepped(solve, 2 * _STEPS, 1))

    name, laid = "weight falling on a spring, h k/(m g) = 4", "weight laid on a spring at once"
    lasts, peak = 2 * (math.pi - math.atan(fall)), impact.measures.peak_force
    return (
        case(name, "largest N/(m g)", 4.0, lambda k, n: peak(drop(height, 1.0, k, n))),
        case(name, "w times contact duration", lasts, lambda k, n: end_of_contact(drop(height, 1.0, k, n)) - fall),
        case(laid, "largest N/(m g)", 2.0, lambda k, n: peak(drop(0.0, k, 1.0, n))),
    )


def _blown_mass() -> Case:
    """Return the case x = 1 - cos(t)/2 of a mass let go at x = 1/2 under the load 1 - x that its opening takes."""

    def lifted(strength: float, steps: int) -> float:
        jet = impact.Load(np.ones(1), lambda t: np.full_like(t, strength), lambda opening: 1.0 - opening)
        body = impact.Body(impact.rigid_mass(mass=1.0, velocity=0.0).greens, loads=(jet,))
        problem = impact.ContactProblem(body, impact.Body(impact.spring(stiffness=1.0)), gap=0.5)
        return float(impact.solve(problem, dt=1 / steps, duration=1.0).gap[-1])

    name = "mass under a load that falls with its opening"
    return Case(name, "opening/L at w t = 1", 1 - math.cos(1) / 2, 1e-6, _JET, stepped(lifted, 4 * _STEPS, 2))


def _chain() -> tuple[Case, Case]:
    """Return the cases of a bead that strikes two at rest: N = (sin w t + sin(3^(1/2) w t)/3^(1/2))/2."""
    name = "bead on two beads, equal springs"
    end, velocity = 2.554812911197, -0.130261695065

    def run(coupling: float, steps: int) -> impact.ImpactResult:
        half = np.full((2, 1), math.sqrt(0.5))
        pair = ModalGreens(np.array([0.0, math.sqrt(2 * coupling)]), np.zeros(2), half, Residual.none())
        bead = impact.rigid_mass(mass=1.0, velocity=-1.0)
        problem = impact.ContactProblem(bead, impact.Body(pair), law=impact.LinearSpring(stiffness=1.0))
        return impact.solve(problem, dt=1 / steps, duration=4.0)

    def after(coupling: float, steps: int) -> float:
        result = run(coupling, steps)
        return 1.0 - float(np.sum(result.force[first_impact(result)])) * result.dt

    duration = stepped(lambda k, n: end_of_contact(run(k, n)), _STEPS, 2)
    return (
        Case(name, "w t at the end of contact", end, 1e-6, _CHAIN, duration),
        Case(name, "velocity after/V", velocity, 1e-6, _CHAIN, stepped(after, _STEPS, 2)),
    )


def _pressed_reed() -> tuple[Case, Case]:
    """Return the cases of pressure q on a cantilever whose tip rests on its seat, rigid or the spring 3 EI/L^3."""

    def reaction(target: impact.GreensFunction, young: float, load: float) -> float:
        beam = impact.Cantilever(young=12.0 * young, density=1.0, length=1.0, width=1.0, thickness=1.0)
        reed = impact.reed(beam, loads=(impact.Pressure(lambda t: -load),))
        problem = impact.ContactProblem(reed, impact.Body(target), preload=True)
        return float(impact.solve(problem, dt=1e-3, duration=0.1).force[-1])

    name, spring = "reed pressed on its seat by a pressure q", impact.spring(stiffness=3.0)
    return (
        Case(name, "N/(q L), rigid seat", 0.375, 1e-7, _PROP, lambda k: reaction(rigid_seat(), 1.0, k)),
        Case(name, "N/(q L), seat of the reed's stiffness", 0.1875, 1e-7, _PROP, lambda k: reaction(spring, k, 1.0)),
    )


def _slow_plate() -> Case:
    """Return the case of (1 - e)/lambda for lambda -> 0: the work of Hertz's force on the plate's dashpot.

    Integral of s^3 over the impact s'' = -s^(3/2), s'(0) = 1: (4/5) (5/4)^(8/5) B(8/5, 1/2).
    """

    def loss(factor: float, number: int) -> float:
        """Return the loss for lambda = 0.04/number; by the conserving rule, which is second order."""
        inelasticity = 0.04 / number
        result = strike(plate_seat(inelasticity * factor), 1.0, 1.0, 3200, rule="conserving")
        return (2.0 - impact.measures.impulse(result) / (MASS * VELOCITY)) / inelasticity

    exact = 0.8 * 1.25**1.6 * math.gamma(1.6) * math.gamma(0.5) / math.gamma(2.1)
    return Case("sphere on an infinite plate", "(1 - e)/lambda, lambda to 0", exact, 1e-6, _ZENER, stepped(loss, 4, 1))
