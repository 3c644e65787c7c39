"""The elastic half-space: static compliances, Rayleigh speed, point and disk loads; impacts that radiate for good."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, partial

import numpy as np

import impact
from impact.exact.half_space import (
    HalfSpacePatch,
    disk_compliance,
    half_space_patch,
    point_step_response,
    punch_compliance,
    square_compliance,
)
from impact.greens.base import Array
from seatfem.verify import Case

from .limits import stepped

_JOHNSON = "Johnson, Contact Mechanics, ch. 3"
_LOVE = "Love, Phil. Trans. A 228 (1929) 377"
_PEKERIS = "Pekeris, PNAS 41 (1955) 469"
_RAYLEIGH = "Rayleigh 1885"

_SPEEDS = {
    0.0: 0.874032049,
    0.25: 0.9194016868,
    0.29: 0.92584297,
    0.3: 0.92741271,
    1 / 3: 0.932525906,
    0.49: 0.954074354,
}
_POINT = {0.6: -0.018956562, 0.95: -0.049824306, 1.02: -0.15346846, 1.08: -1.17338174, 1.2: 0.375}
_DISK = {
    0.05: 0.044838886,
    0.1: 0.088665579,
    0.2: 0.173282395,
    0.3: 0.253850438,
    0.5: 0.402838554,
    0.75: 0.5662731,
    1.0: 0.704241842,
    1.25: 0.816068661,
    1.5: 0.900837572,
    1.75: 0.959697376,
    2.0: 0.992814196,
    2.1: 0.998641556,
    2.175: 0.999999974,
    2.2: 1.0,
    3.0: 1.0,
}
_QUARTER = 0.25  # Poisson ratio of the tables
_BEAM = "Goldsmith, Impact: transverse impact on long beams; Laplace transform"
_MILLER = "Miller & Pursey, Proc. R. Soc. A 233 (1955) 55: radiation of a slow force"
_STEPS = 400  # coarsest of three
_POISSON = 0.25
RADIATION = 0.148133877  # integral of 1/K - S(t) for rho = c_s = 1, nu = 1/4; also Im of the point compliance/omega


def half_space_cases() -> tuple[Case, ...]:
    """The elastic half-space: static compliances, Rayleigh speed, point and disk loads."""
    speeds = tuple(_rayleigh(nu, value) for nu, value in _SPEEDS.items())
    points = tuple(_pekeris(tau, value) for tau, value in _POINT.items())
    disk = tuple(_disk(tau, value) for tau, value in _DISK.items())
    return (*_static(), *speeds, _rayleigh_over_rod(), *points, *disk, _disk_start())


@cache
def unit_patch(poisson: float) -> HalfSpacePatch:
    """Return the patch of c_s = 1, rho = 1, a = 1."""
    return half_space_patch(young=2 * (1 + poisson), poisson=poisson, density=1.0, radius=1.0)


def stiffened(patch: HalfSpacePatch, factor: float) -> HalfSpacePatch:
    """Return the patch with Young's modulus multiplied; the response without dimensions depends on nu only."""
    return HalfSpacePatch(patch.young * factor, patch.poisson, patch.density, patch.radius, patch.response)


def _static() -> tuple[Case, ...]:
    """Return the cases of compliances times E/(1 - nu^2) and the size; the factor is on Young's modulus."""
    name, unit = "half-space, static load", {"poisson": 0.0}

    def disk(quantity: str, exact: float, at: str, factor: float) -> Case:
        compliance = partial(disk_compliance, radius=1.0, at=at, **unit)
        return Case(name, quantity, exact, 1e-9, _JOHNSON, lambda k: factor * compliance(young=k))

    def square(quantity: str, exact: float, at: str) -> Case:
        compliance = partial(square_compliance, side=1.0, at=at, **unit)
        return Case(name, quantity, exact, 1e-9, _LOVE, lambda k: compliance(young=k))

    def punch(young: float) -> float:
        return punch_compliance(young=young, radius=1.0, **unit)

    return (
        disk("disk, mean w E/((1 - nu^2) p a)", 1.6976527263, "mean", math.pi),
        disk("disk, mean w E a/((1 - nu^2) F)", 0.5403796461, "mean", 1.0),
        disk("disk, centre w E/((1 - nu^2) p a)", 2.0, "centre", math.pi),
        disk("disk, edge w E/((1 - nu^2) p a)", 1.2732395447, "edge", math.pi),
        square("square, mean w E/((1 - nu^2) p b)", 0.9464020088, "mean"),
        square("square, centre w E/((1 - nu^2) p b)", 1.1221997047, "centre"),
        Case(name, "rigid round punch, w E a/((1 - nu^2) F)", 0.5, 1e-12, _JOHNSON, punch),
    )


def _rayleigh(poisson: float, exact: float) -> Case:
    """Return the case of the Rayleigh speed, from the time the wave takes to cross the disk: then its g is zero."""
    quantity = f"c_R/c_s, nu = {poisson:.4g}"
    return Case("half-space, Rayleigh wave", quantity, exact, 1e-8, _RAYLEIGH, lambda k: _crossing_speed(poisson, k))


def _crossing_speed(poisson: float, factor: float) -> float:
    return 2.0 / stiffened(unit_patch(poisson), factor).crossing_time


def _rayleigh_over_rod() -> Case:
    """Return the case of the limit of the longitudinal wave of a cylinder for short waves."""
    rod, name, quantity = math.sqrt(2 * 1.29), "half-space, Rayleigh wave", "c_R/c_0, nu = 0.29"
    return Case(name, quantity, 0.57640466, 1e-7, _RAYLEIGH, lambda k: _crossing_speed(0.29, k) / rod)


def _pekeris(tau: float, exact: float) -> Case:
    """Return the case of a point load on a half-space; the factor is on nu."""
    rtol = max(1e-8, 5e-10 / abs(exact))  # nine decimals printed
    name, quantity = "half-space, point load that stays", f"w pi mu r/F at c_s t/r = {tau:g}"
    response = partial(point_step_response, tau)
    return Case(name, quantity, exact, rtol, _PEKERIS, lambda k: float(response(poisson=_QUARTER * k)))


def _disk(tau: float, exact: float) -> Case:
    static = 16 * (1 - _QUARTER**2) / (3 * math.pi**2 * 2 * (1 + _QUARTER))
    source = "Pekeris' point load averaged over the disk by quadrature"
    name, quantity = "half-space, disk load that stays", f"mean u/u_static at c_s t/a = {tau:g}"

    def compute(coefficient: float) -> float:
        return float(stiffened(unit_patch(_QUARTER), coefficient).step_response(tau)) / static

    return Case(name, quantity, exact, 1e-6, source, compute)


def _disk_start() -> Case:
    """Return the case of the plane wave under the disk."""

    def compute(coefficient: float) -> float:
        patch = stiffened(unit_patch(_QUARTER), coefficient)
        return float(patch.impulse_response(0.0)) * math.sqrt(3.0) * math.pi

    return Case("half-space, disk load that stays", "u'(0+) rho c_p pi a^2/F", 1.0, 1e-8, "plane wave", compute)


def radiating_cases() -> tuple[Case, ...]:
    """Impacts that lose their energy to waves that never return: on a long beam and on a half-space."""
    return (*_infinite_beam(), _slow_on_half_space())


def _infinite_beam() -> tuple[Case, Case]:
    """Return the cases of a mass on an infinite beam, g = C t^(1/2)/Gamma(3/2): v/V = exp(z^2) erfc(z), N M C^2/V =
    1/(pi^(1/2) z) - v/V, z = t^(1/2)/(M C).

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
        """Return the mean of the two steps that meet at z = 1, as the force of a step belongs to its middle."""
        return float(np.mean(strike(rigidity, steps)[steps : steps + 2]))

    pressed = 1 / math.sqrt(math.pi) - moderated
    return (
        Case(name, "v/V at z = 1", moderated, 1e-9, _BEAM, stepped(velocity, _STEPS, 2)),
        Case(name, "N M C^2/V at z = 1", pressed, 1e-9, _BEAM, stepped(force, _STEPS)),
    )


def _slow_on_half_space() -> Case:
    """Return the case of a heavy mass M on the disk, K its static stiffness, which loses R int N'^2 dt: e = 1 - (pi/2)
    R K (K/M)^(1/2) + ...

    R = int (1/K - S) dt depends on the material only, not on the disk. The limit of ever heavier masses.
    """
    patch = unit_patch(_POISSON)
    compliance = float(patch.static_compliance()[0, 0])

    def loss(density: float, number: int) -> float:
        """Return 1 - e over its leading term, for the mass 100 number^2 rho a^3."""
        mass = 100.0 * number**2
        contact = math.pi * math.sqrt(mass * compliance)
        seat = impact.Body(replace(patch, density=density))
        problem = impact.ContactProblem(impact.rigid_mass(mass=mass, velocity=-1.0), seat)
        result = impact.solve(problem, dt=contact / 16000, duration=1.2 * contact)
        leading = math.pi / 2 * RADIATION / compliance / math.sqrt(mass * compliance)
        return (2.0 - impact.measures.impulse(result) / mass) / leading

    name = "slow mass on a disk of a half-space, nu = 0.25"
    quantity = "velocity lost/radiated to leading order"
    return Case(name, quantity, 1.0, 1e-6, _MILLER, stepped(loss, 4, 1))
