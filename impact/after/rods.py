"""Struck rods at any x: displacement and axial force by travelling waves, in closed form with damping, and by modes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.exact.closed_form import DelayRod
from impact.exact.damped_rods import DampedFixedRod, legendre_chi2
from impact.greens.base import Array, ErrorEstimate, GreensFunction, GreensFunctionError
from impact.greens.modal import ModalGreens, Residual
from impact.march import history

Rod = DelayRod | DampedFixedRod
"""Rods known in closed form."""


def displacement_response(rod: Rod, t: ArrayLike, *, at: float) -> Array:
    """S(x, t) [m/N]: displacement at ``at`` = x/l (0 contact ... 1 far end) after a unit force set on at t = 0.

    Undamped, the wavefronts and their images behind both ends (T = 2 l/c, R of the particle velocity at the far end):

        S = (1/Z) sum_k R^k [<t - x/c - kT> + R <t + x/c - (k+1)T>],   <s> = max(s, 0).

    With uniform modal damping zeta, q = exp(lambda t), theta = pi x/(2l), chi_2 Legendre's function:

        S = (l - x)/(EA) + 2/(pi Z sqrt(1 - zeta^2)) Im [(chi_2(q e^(i theta)) + chi_2(q e^(-i theta)))/lambda].

    Raises:
        GreensFunctionError: a position off the rod.

    Source: d'Alembert's solution, e.g. Graff, Wave Motion in Elastic Solids, ch. 2; the damped form is derived from the
    modal sum as `DampedFixedRod` is.
    """
    time, delay = _place(rod, t, at)
    if isinstance(rod, DelayRod):
        there = _ramps(rod, time - delay)
        back = _ramps(rod, time + delay - rod.round_trip)
        return np.asarray((there + rod.reflection * back) / rod.impedance)
    turn = 0.5j * math.pi * at
    moving = rod.over_exponents(
        lambda rate: (legendre_chi2(np.exp(rate * time + turn)) + legendre_chi2(np.exp(rate * time - turn))) / 2 / rate
    )
    return np.asarray((1 - at) * rod.transit / rod.impedance + moving)


def force_response(rod: Rod, t: ArrayLike, *, at: float) -> Array:
    """E(x, t) [1]: axial force -EA du/dx at ``at`` = x/l, > 0 in compression, after a unit force set on at t = 0.

    Undamped: E = sum_k R^k [H(t - x/c - kT) - R H(t + x/c - (k+1)T)]; right-continuous. Damped: minus the derivative of
    `displacement_response` along x, in closed form; its limit from the right at t = 0.

    Raises:
        GreensFunctionError: a position off the rod.
    """
    time, delay = _place(rod, t, at)
    if isinstance(rod, DelayRod):
        there = _fronts(rod, time - delay)
        back = _fronts(rod, time + delay - rod.round_trip)
        return np.asarray(there - rod.reflection * back)
    if at == 0.0:
        return np.ones_like(time)
    turn = 0.5j * math.pi * at
    slope = rod.impedance * rod.omega_1  # EA d theta/dx

    def term(rate: complex) -> NDArray[np.complex128]:
        pair = np.arctanh(np.exp(rate * time + turn)) - np.arctanh(np.exp(rate * time - turn))
        return np.asarray(pair * (0.5j * slope / rate))

    return np.asarray(np.where(time > 0, 1.0 - rod.over_exponents(term), 0.0))


def rod_displacement(rod: Rod, force: Array, dt: float, *, at: float) -> Array:
    """(n + 1,) displacement [m] at ``at`` = x/l under ``force`` (n + 1,) [N] on the rod's end; exact.

    ``force[m]`` is constant over the step that ends at m ``dt`` and pushes into the rod, as in `ImpactResult`; > 0 is
    the direction of the force, so the target displacement of a result is minus this at ``at`` = 0.

    Raises:
        GreensFunctionError: a position off the rod.
    """
    steps = displacement_response(rod, dt * np.arange(len(force)), at=at)
    return _superposed(np.diff(steps), force)


def rod_axial_force(rod: Rod, force: Array, dt: float, *, at: float) -> Array:
    """(n + 1,) axial force [N] at ``at`` = x/l, > 0 in compression, under ``force`` as in `rod_displacement`.

    The value at the middle of the step that ends at m ``dt``; where the delays x/c and 2l/c are whole numbers of steps
    it holds over the whole step and is `impact.rod_stress` times the area. The stress is this over the area.

    Raises:
        GreensFunctionError: a position off the rod.
    """
    middle = dt * (np.arange(len(force)) - 0.5)
    steps = np.where(middle < 0, 0.0, force_response(rod, np.maximum(middle, 0.0), at=at))
    return _superposed(np.diff(steps), force)


def fixed_rod_modes(rod: Rod, n_modes: int, *, at: tuple[float, ...] = (), residual: bool = False) -> ModalGreens:
    """A fixed rod by its lowest modes; ports: the contact, then the positions ``at`` (x/l).

    phi_n(x) = sqrt(2/(rho A l)) cos(omega_n x/c), omega_n = (2n - 1) pi c/(2l), all with the rod's damping ratio.
    S_x0(t), the displacement at x after a unit force at the contact, converges like 1/n. ``residual`` adds, at
    the contact only, the exponential that restores the static compliance and g(0+).

    Raises:
        GreensFunctionError: a rod that is not fixed, no modes, a position off the rod, ``residual`` with positions.
    """
    if isinstance(rod, DelayRod) and rod.reflection != -1.0:
        raise GreensFunctionError(
            f"reflection = {rod.reflection:g} at the far end: only a fixed rod (-1) has these modes"
        )
    if n_modes < 1:
        raise GreensFunctionError(f"n_modes = {n_modes} must be at least 1")
    if residual and at:
        raise GreensFunctionError("a residual with g(0+) is known at the contact only: leave out at, or the residual")
    transit = rod.round_trip / 2 if isinstance(rod, DelayRod) else rod.transit
    places = np.array([0.0, *(_place(rod, 0.0, x)[1] / transit for x in at)])
    omega = np.asarray((2.0 * np.arange(1, n_modes + 1) - 1.0) * math.pi / (2 * transit), dtype=np.float64)
    shapes = math.sqrt(2 / (rod.impedance * transit)) * np.cos(omega[:, None] * transit * places)
    left = transit / rod.impedance - math.fsum((shapes[:, 0] / omega) ** 2)
    rest = Residual.exponential(left, rod.initial_value()) if residual else Residual.none(len(places))
    return ModalGreens(
        omega,
        np.full(n_modes, 0.0 if isinstance(rod, DelayRod) else rod.damping_ratio),
        np.asarray(shapes),
        rest,
        port_names=("contact", *(f"x/l = {x:g}" for x in at)),
        error=ErrorEstimate(),
        origin={"kind": "fixed_rod_modes", "n_modes": n_modes, "rod": dict(rod.provenance)},
    )


def modal_displacement(greens: GreensFunction, force: Array, dt: float, *, port: str | int = 0) -> Array:
    """(n + 1,) displacement [m] of ``port`` under ``force`` (n + 1,) [N] on the first port; exact for its steps."""
    steps = greens.step_response(dt * np.arange(len(force)), greens.port_index(port), 0)
    return _superposed(np.diff(steps), force)


def _place(rod: Rod, t: ArrayLike, at: float) -> tuple[Array, float]:
    """(times >= 0, x/c)."""
    if not 0.0 <= at <= 1.0:
        raise GreensFunctionError(f"at = {at:g} is off the rod, 0 (contact) ... 1 (far end)")
    transit = rod.round_trip / 2 if isinstance(rod, DelayRod) else rod.transit
    return np.maximum(np.asarray(t, dtype=float), 0.0), at * transit


def _superposed(weights: Array, force: Array) -> Array:
    return np.concatenate([[0.0], history.convolve(weights, force[1:])])


def _fronts(rod: DelayRod, s: Array) -> Array:
    """sum_k R^k H(s - k T)."""
    n, r = np.floor(_settled(rod, s)) + 1.0, rod.reflection
    count = n if r == 1.0 else (1 - r**n) / (1 - r)
    return np.asarray(np.where(n > 0, count, 0.0))


def _ramps(rod: DelayRod, s: Array) -> Array:
    """sum_k R^k <s - k T>."""
    s, r = np.maximum(s, 0.0), rod.reflection
    n = np.floor(s / rod.round_trip)
    if r == 1.0:
        return np.asarray((n + 1) * (s - rod.round_trip * n / 2))
    delays = r * (1 - (n + 1) * r**n + n * r ** (n + 1)) / (1 - r) ** 2  # sum of k r^k
    return np.asarray(s * (1 - r ** (n + 1)) / (1 - r) - rod.round_trip * delays)


def _settled(rod: DelayRod, s: Array) -> Array:
    """s/T, with round-off below a whole number taken as that number; never below -1."""
    relative = s / rod.round_trip
    nearest = np.round(relative)
    return np.maximum(np.where(np.abs(relative - nearest) < 1e-9, nearest, relative), -1.0)
