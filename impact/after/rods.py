"""Rods at any place: displacement, axial force and stress under the contact force, and their modes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from impact.after.histories import StressError
from impact.after.result import ImpactResult
from impact.exact.closed_form import ExactRod, check_on_rod, reflect
from impact.greens.base import Array, ErrorEstimate, GreensFunction, GreensFunctionError, convolve
from impact.greens.modal import ModalGreens, Residual


def rod_stress(result: ImpactResult, rod: GreensFunction, *, area: float, at: float = 1.0) -> Array:
    """Return the (n + 1,) axial stress, > 0 in compression [Pa], of a rod struck by ``result.force``; exact for its
    steps.

    The contact sends out the wave of particle velocity a(t) = N(t)/Z + R a(t - T); at the distance x it meets the
    wave that returns from the far end:  sigma A = Z (a(t - x/c) - R a(t - T + x/c)).  Like the force,
    ``stress[m]`` holds over the step that ends at ``result.time[m]``.

    Args:
        result: its force acts on the rod's end.
        rod: its Green's function, of an undamped uniform rod.
        area: of its section [m^2].
        at: x/l, 0 at the contact ... 1 at the far end.

    Raises:
        StressError: a body that is no undamped rod, a position off it, an area that is not positive, or a delay that is
            no multiple of the step.

    Source: Timoshenko & Goodier, Theory of Elasticity, longitudinal impact of bars.
    """
    if not 0.0 <= at <= 1.0:
        raise StressError(f"at = {at:g} is off the rod, 0 (contact) ... 1 (far end)")
    if not area > 0:
        raise StressError(f"area = {area:g} m^2 must be positive")
    uniform = rod.rod
    if uniform is None or uniform.damping_ratio != 0.0:
        raise StressError(
            f"a {type(rod).__name__} is no undamped uniform rod, in which waves keep their shape; make it by fixed_rod"
        )
    trip = _steps(2 * uniform.transit, result.dt)
    delay = _steps(at * uniform.transit, result.dt)
    outgoing = reflect(result.force / uniform.impedance, uniform.reflection, trip)
    away, back = (np.concatenate([np.zeros(steps), outgoing])[: len(outgoing)] for steps in (delay, trip - delay))
    force = away - uniform.reflection * back
    return np.asarray(uniform.impedance / area * force)


def _steps(delay: float, dt: float) -> int:
    count = round(delay / dt)
    if abs(delay / dt - count) > 1e-6:
        raise StressError(
            f"the wave needs {delay:g} s, {delay / dt:.6g} steps of {dt:g} s, not a whole number; "
            f"use dt = {delay / max(count, 1):.17g} s"
        )
    return count


def displacement_response(rod: ExactRod, t: ArrayLike, *, at: float) -> Array:
    """Return S(x, t) [m/N]: displacement at ``at`` = x/l (0 contact ... 1 far end) after a unit force set on at t = 0.

    Undamped, the wavefronts and their images behind both ends (T = 2 l/c, R of the particle velocity at the far end):

        S = (1/Z) sum_k R^k [<t - x/c - kT> + R <t + x/c - (k+1)T>],   <s> = max(s, 0).

    With uniform modal damping zeta, q = exp(lambda t), theta = pi x/(2l), chi_2 Legendre's function:

        S = (l - x)/(EA) + 2/(pi Z sqrt(1 - zeta^2)) Im [(chi_2(q e^(i theta)) + chi_2(q e^(-i theta)))/lambda].

    Raises:
        GreensFunctionError: a position off the rod.

    Source: d'Alembert's solution, e.g. Graff, Wave Motion in Elastic Solids, ch. 2; the damped form is derived from the
    modal sum as `DampedFixedRod` is.
    """
    return rod.displacement_at(np.maximum(np.asarray(t, dtype=float), 0.0), check_on_rod(at))


def force_response(rod: ExactRod, t: ArrayLike, *, at: float) -> Array:
    """Return E(x, t), (n,), the ratio of the axial force -EA du/dx at ``at`` = x/l to a force set on at ``t`` = 0.

    It is > 0 in compression. Undamped: E = sum_k R^k [H(t - x/c - kT) - R H(t + x/c - (k+1)T)]; right-continuous.
    Damped: minus the derivative of `displacement_response` along x, in closed form; its limit from the right at t = 0.
    Raises `GreensFunctionError` off the rod.
    """
    return rod.force_at(np.maximum(np.asarray(t, dtype=float), 0.0), check_on_rod(at))


def rod_displacement(rod: ExactRod, force: Array, dt: float, *, at: float) -> Array:
    """Return the (n + 1,) displacement [m] at ``at`` = x/l under ``force`` (n + 1,) [N] on the rod's end; exact.

    ``force[m]`` is constant over the step that ends at m ``dt`` and pushes into the rod, as in `ImpactResult`; > 0 is
    the direction of the force, so `ImpactResult.target_displacement` is minus this at ``at`` = 0.

    Raises:
        GreensFunctionError: a position off the rod.
    """
    steps = displacement_response(rod, dt * np.arange(len(force)), at=at)
    return _superposed(np.diff(steps), force)


def rod_axial_force(rod: ExactRod, force: Array, dt: float, *, at: float) -> Array:
    """Return the (n + 1,) axial force [N] at ``at`` = x/l, > 0 in compression, under ``force`` as in
    `rod_displacement`.

    The value at the middle of the step that ends at m ``dt``; where the delays x/c and 2l/c are whole numbers of steps
    it holds over the whole step and is `impact.rod_stress` times the area. Raises `GreensFunctionError` off the rod.
    """
    return axial_force(force, dt, lambda time: force_response(rod, time, at=at))


def axial_force(force: Array, dt: float, response: Callable[[Array], Array]) -> Array:
    """Return the (n + 1,) axial force [N] of `rod_axial_force`, the sum of (N_m - N_(m - 1)) E(t - (m - 1) dt).

    ``response`` is E at times (n,) >= 0 [s], the axial force at x per unit of a step force on the end; for an infinite
    rod H(t - x/c).
    """
    middle = dt * (np.arange(len(force)) - 0.5)
    steps = np.where(middle < 0, 0.0, response(np.maximum(middle, 0.0)))
    return _superposed(np.diff(steps), force)


def fixed_rod_modes(rod: ExactRod, n_modes: int, *, at: tuple[float, ...] = (), residual: bool = False) -> ModalGreens:
    """Return a fixed rod by its lowest modes; ports: the contact, then the positions ``at`` (x/l).

    phi_n(x) = sqrt(2/(rho A l)) cos(omega_n x/c), omega_n = (2n - 1) pi c/(2l), all with the rod's damping ratio.
    S_x0(t), the displacement at x after a unit force at the contact, converges like 1/n. ``residual`` adds, at
    the contact only, the exponential that restores the static compliance and g(0+).

    Raises:
        GreensFunctionError: a rod that is not fixed, no modes, a position off the rod, ``residual`` with positions.
    """
    uniform = rod.rod
    if uniform.reflection != -1.0:
        raise GreensFunctionError(
            f"reflection = {uniform.reflection:g} at the far end must be -1: only a fixed rod has these modes"
        )
    if n_modes < 1:
        raise GreensFunctionError(f"n_modes = {n_modes} must be at least 1")
    if residual and at:
        raise GreensFunctionError("a residual with g(0+) is known at the contact only: leave out at, or the residual")
    transit, places = uniform.transit, np.array([0.0, *map(check_on_rod, at)])
    omega = np.asarray((2.0 * np.arange(1, n_modes + 1) - 1.0) * math.pi / (2 * transit), dtype=np.float64)
    shapes = math.sqrt(2 / (uniform.impedance * transit)) * np.cos(omega[:, None] * transit * places)
    compliance = transit / uniform.impedance - math.fsum((shapes[:, 0] / omega) ** 2)
    rest = Residual.exponential(compliance, rod.initial_value()) if residual else Residual.none(len(places))
    return ModalGreens(
        omega,
        np.full(n_modes, uniform.damping_ratio),
        np.asarray(shapes),
        rest,
        port_names=("contact", *(f"x/l = {x:g}" for x in at)),
        error=ErrorEstimate(),
        origin={"kind": "fixed_rod_modes", "n_modes": n_modes, "rod": dict(rod.provenance)},
    )


def modal_displacement(greens: GreensFunction, force: Array, dt: float, *, port: str | int = 0) -> Array:
    """Return the (n + 1,) displacement [m] of ``port`` under ``force`` (n + 1,) [N] on the first port; exact for its
    steps."""
    steps = greens.step_response(dt * np.arange(len(force)), greens.port_index(port), 0)
    return _superposed(np.diff(steps), force)


def _superposed(weights: Array, force: Array) -> Array:
    return np.concatenate([[0.0], convolve(weights, force[1:])])
