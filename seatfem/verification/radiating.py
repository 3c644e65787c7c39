"""Impacts that lose their energy to waves that never return: on a long beam and on a half-space."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

import impact
from impact.greens.base import Array
from seatfem.verification.case import Case, refined, richardson
from seatfem.verification.half_space import unit_patch

_BEAM = "Goldsmith, Impact: transverse impact on long beams; Laplace transform"
_MILLER = "Miller & Pursey, Proc. R. Soc. A 233 (1955) 55: radiation of a slow force"
_STEPS = 400  # coarsest of three
_POISSON = 0.25
RADIATION = 0.148133877  # integral of 1/K - S(t) for rho = c_s = 1, nu = 1/4; also Im of the point compliance/omega


def radiating_cases() -> tuple[Case, ...]:
    """A mass that strikes and stays on a beam; a slow one that bounces off a half-space."""
    return (*_infinite_beam(), _slow_on_half_space())


def _infinite_beam() -> tuple[Case, Case]:
    """g = C t^(1/2)/Gamma(3/2): v/V = exp(z^2) erfc(z), N M C^2/V = 1/(pi^(1/2) z) - v/V, z = t^(1/2)/(M C).

    The mass never leaves the beam. Here M C = 1 and z = 1.
    """
    name = "rigid mass on an infinite beam"
    moderated = math.exp(1.0) * math.erfc(1.0)
    mass = 8 / 4**0.75  # 1/C for EI = rho A = 1

    def strike(rigidity: float, steps: int) -> Array:
        beam = impact.infinite_beam(young=rigidity, density=1.0, area=1.0, second_moment=1.0)
        problem = impact.ContactProblem(impact.rigid_mass(mass=mass, velocity=-1.0), impact.Body(beam))
        return impact.solve(problem, dt=1 / steps, duration=1 + 1 / steps).force / mass

    def velocity(rigidity: float, steps: int) -> float:
        return 1.0 - float(np.sum(strike(rigidity, steps)[: steps + 1])) / steps

    def force(rigidity: float, steps: int) -> float:
        """The mean of the two steps that meet at z = 1, as the force of a step belongs to its middle."""
        return float(np.mean(strike(rigidity, steps)[steps : steps + 2]))

    pressed = 1 / math.sqrt(math.pi) - moderated
    return (
        Case(name, "v/V at z = 1", moderated, 1e-9, _BEAM, lambda k: richardson(partial(velocity, k), _STEPS, 2)),
        Case(name, "N M C^2/V at z = 1", pressed, 1e-9, _BEAM, lambda k: refined(partial(force, k), _STEPS)),
    )


def _slow_on_half_space() -> Case:
    """A heavy mass M on the disk, K its static stiffness, loses R int N'^2 dt: e = 1 - (pi/2) R K (K/M)^(1/2) + ...

    R = int (1/K - S) dt depends on the material only, not on the disk. The limit of ever heavier masses.
    """
    patch = unit_patch(_POISSON)
    compliance = float(patch.static_compliance()[0, 0])

    def loss(density: float, number: int) -> float:
        """1 - e over its leading term, for the mass 100 number^2 rho a^3."""
        mass = 100.0 * number**2
        contact = math.pi * math.sqrt(mass * compliance)
        seat = impact.Body(replace(patch, density=density))
        problem = impact.ContactProblem(impact.rigid_mass(mass=mass, velocity=-1.0), seat)
        result = impact.solve(problem, dt=contact / 16000, duration=1.2 * contact)
        leading = math.pi / 2 * RADIATION / compliance / math.sqrt(mass * compliance)
        return (2.0 - impact.measures.impulse(result) / mass) / leading

    name = "slow mass on a disk of a half-space, nu = 0.25"
    quantity = "velocity lost/radiated to leading order"
    return Case(name, quantity, 1.0, 1e-6, _MILLER, lambda k: richardson(partial(loss, k), 4, 1))
