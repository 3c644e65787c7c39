"""The elastic half-space: static compliances, Rayleigh speed, point and disk loads."""

from __future__ import annotations

import math
from functools import cache

from impact.exact.half_space import (
    HalfSpacePatch,
    disk_compliance,
    half_space_patch,
    point_step_response,
    punch_compliance,
    square_compliance,
)
from seatfem.verification.case import Case, Estimate

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


def half_space_cases() -> tuple[Case, ...]:
    """Static compliances, Rayleigh speeds, Pekeris' point load, the disk."""
    speeds = tuple(_rayleigh(nu, value) for nu, value in _SPEEDS.items())
    points = tuple(_pekeris(tau, value) for tau, value in _POINT.items())
    disk = tuple(_disk(tau, value) for tau, value in _DISK.items())
    return (*_static(), *speeds, _rayleigh_over_rod(), *points, *disk, _disk_start())


@cache
def unit_patch(poisson: float) -> HalfSpacePatch:
    """c_s = 1, rho = 1, a = 1."""
    return half_space_patch(young=2 * (1 + poisson), poisson=poisson, density=1.0, radius=1.0)


def stiffened(patch: HalfSpacePatch, factor: float) -> HalfSpacePatch:
    """Young's modulus multiplied; the response without dimensions depends on nu only."""
    return HalfSpacePatch(patch.young * factor, patch.poisson, patch.density, patch.radius, patch.response)


def _static() -> tuple[Case, ...]:
    """Compliances times E/(1 - nu^2) and the size; the factor is on Young's modulus."""
    name, unit = "half-space, static load", {"poisson": 0.0}

    def disk(quantity: str, exact: float, at: str, factor: float) -> Case:
        def compute(k: float) -> Estimate:
            return Estimate(factor * disk_compliance(young=k, radius=1.0, at=at, **unit))

        return Case(name, quantity, exact, 1e-9, _JOHNSON, compute)

    def square(quantity: str, exact: float, at: str) -> Case:
        def compute(k: float) -> Estimate:
            return Estimate(square_compliance(young=k, side=1.0, at=at, **unit))

        return Case(name, quantity, exact, 1e-9, _LOVE, compute)

    return (
        disk("disk, mean w E/((1 - nu^2) p a)", 1.6976527263, "mean", math.pi),
        disk("disk, mean w E a/((1 - nu^2) F)", 0.5403796461, "mean", 1.0),
        disk("disk, centre w E/((1 - nu^2) p a)", 2.0, "centre", math.pi),
        disk("disk, edge w E/((1 - nu^2) p a)", 1.2732395447, "edge", math.pi),
        square("square, mean w E/((1 - nu^2) p b)", 0.9464020088, "mean"),
        square("square, centre w E/((1 - nu^2) p b)", 1.1221997047, "centre"),
        Case(
            name,
            "rigid round punch, w E a/((1 - nu^2) F)",
            0.5,
            1e-12,
            _JOHNSON,
            lambda k: Estimate(punch_compliance(young=k, radius=1.0, **unit)),
        ),
    )


def _rayleigh(poisson: float, exact: float) -> Case:
    """From the time that the Rayleigh wave takes to cross the disk, after which its g is zero."""

    def compute(coefficient: float) -> Estimate:
        return Estimate(2.0 / stiffened(unit_patch(poisson), coefficient).crossing_time)

    return Case("half-space, Rayleigh wave", f"c_R/c_s, nu = {poisson:.4g}", exact, 1e-8, _RAYLEIGH, compute)


def _rayleigh_over_rod() -> Case:
    """The limit of the longitudinal wave of a cylinder for short waves."""
    poisson = 0.29

    def compute(coefficient: float) -> Estimate:
        patch = stiffened(unit_patch(poisson), coefficient)
        return Estimate(2.0 / patch.crossing_time / math.sqrt(2 * (1 + poisson)))

    return Case("half-space, Rayleigh wave", "c_R/c_0, nu = 0.29", 0.57640466, 1e-7, _RAYLEIGH, compute)


def _pekeris(tau: float, exact: float) -> Case:
    """The factor is on nu."""

    def compute(coefficient: float) -> Estimate:
        return Estimate(float(point_step_response(tau, poisson=_QUARTER * coefficient)))

    rtol = max(1e-8, 5e-10 / abs(exact))  # nine decimals printed
    return Case(
        "half-space, point load that stays", f"w pi mu r/F at c_s t/r = {tau:g}", exact, rtol, _PEKERIS, compute
    )


def _disk(tau: float, exact: float) -> Case:
    static = 16 * (1 - _QUARTER**2) / (3 * math.pi**2 * 2 * (1 + _QUARTER))

    def compute(coefficient: float) -> Estimate:
        return Estimate(float(stiffened(unit_patch(_QUARTER), coefficient).step_response(tau)) / static)

    source = "Pekeris' point load averaged over the disk by quadrature"
    return Case(
        "half-space, disk load that stays", f"mean u/u_static at c_s t/a = {tau:g}", exact, 1e-6, source, compute
    )


def _disk_start() -> Case:
    """The plane wave under the disk."""

    def compute(coefficient: float) -> Estimate:
        patch = stiffened(unit_patch(_QUARTER), coefficient)
        return Estimate(float(patch.impulse_response(0.0)) * math.sqrt(3.0) * math.pi)

    return Case("half-space, disk load that stays", "u'(0+) rho c_p pi a^2/F", 1.0, 1e-8, "plane wave", compute)
