"""Prescribed loads on a reed: pressure, point forces, gravity. Positive along the normal, away from the seat."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike

from impact.beams.modes import BeamModes
from impact.bodies.body import Load
from impact.greens.base import Array, GreensFunctionError

Course = Callable[[Array], ArrayLike]  # (n,) times [s] -> (n,) values, or one value for all times


class ReedLoad(Protocol):
    """Anything that pushes a reed in a known way.

    The modes left out follow such a load statically; that part is neglected. Relative to the static tip deflection it
    is, under a force at the tip, 4.1e-2/n^3 for an Euler-Bernoulli cantilever with n modes (6e-7 for 40) and 2.3e-3/n
    for a stubby Timoshenko cantilever, L/h = 10 (6e-5 for 40); under uniform pressure 5e-10 and 4e-8 for 40.
    """

    def modal(self, modes: BeamModes) -> tuple[Load, ...]:
        """Return the load as shapes on the modes and courses in time."""


@dataclass(frozen=True)
class PointForce:
    """Force F(t) [N] at the distance ``at`` from the clamp [m]:  modal forces w_k(at) F(t)."""

    force: Course
    at: float

    def modal(self, modes: BeamModes) -> tuple[Load, ...]:
        """Return one load; `GreensFunctionError` if ``at`` is off the reed."""
        return (Load(modes.deflection(self.at), _course(self.force)),)


@dataclass(frozen=True)
class Pressure:
    """Pressure p(t) profile(x) [Pa] on the whole width:  modal forces  p(t) width * integral of w_k profile dx.

    Attributes:
        pressure: p(t), times (n,) s -> Pa; positive pushes the reed away from the seat.
        between: distances from the clamp where it acts [m] (the port's hole); ``None`` is the whole reed.
        profile: distribution along the reed, x (G,) m -> (G,); ``None`` is uniform.
    """

    pressure: Course
    between: tuple[float, float] | None = None
    profile: Callable[[Array], ArrayLike] | None = None

    def modal(self, modes: BeamModes) -> tuple[Load, ...]:
        """Return one load; `GreensFunctionError` if ``between`` is off the reed or the profile is not finite."""
        start, end = _span(self.between, modes.length)
        x, weights = modes.quadrature(start, end)
        profile = np.ones(1) if self.profile is None else np.asarray(self.profile(x), dtype=float)
        if not np.all(np.isfinite(profile)):
            raise GreensFunctionError(
                f"the pressure profile must be finite, {np.sum(~np.isfinite(profile))} values are not"
            )
        area = modes.width * (end - start)
        shape = modes.deflection(x) @ (weights * profile) / (end - start)
        return (Load(shape, _course(self.pressure, area)),)


@dataclass(frozen=True)
class PressureField:
    """Pressure p(x, t) [Pa] that does not separate, as the polynomial in x through ``points`` Gauss points.

    Each point is one load with the course p(x_g, t), spread by its Lagrange polynomial: exact for polynomials of degree
    points - 1, spectral for smooth p. Use ``between`` where the pressure ends sharply.

    Attributes:
        pressure: p(x, t), one distance [m] and times (n,) s -> (n,) Pa; positive pushes the reed away from the seat.
        between: distances from the clamp where it acts [m]; ``None`` is the whole reed.
        points: number of Gauss points; each costs as much as one contact port.
    """

    pressure: Callable[[float, Array], ArrayLike]
    between: tuple[float, float] | None = None
    points: int = 8

    def modal(self, modes: BeamModes) -> tuple[Load, ...]:
        """Return ``points`` loads; `GreensFunctionError` if ``between`` is off the reed or there are no points."""
        if not 1 <= self.points <= 64:
            raise GreensFunctionError(f"points = {self.points} of a pressure field must be 1..64")
        start, end = _span(self.between, modes.length)
        x, weights = modes.quadrature(start, end, self.points)
        nodes, gauss_weights = legendre.leggauss(self.points)
        relative = (2 * x - start - end) / (end - start)
        degrees = self.points - 1
        # Lagrange polynomials of Gauss nodes: l_g(x) = weight_g * sum_n (n + 1/2) P_n(x_g) P_n(x)
        norms = np.arange(self.points) + 0.5
        lagrange = (legendre.legvander(nodes, degrees) * norms) @ legendre.legvander(relative, degrees).T
        shapes = modes.deflection(x) @ (weights * lagrange).T * 2 / (end - start)
        areas = modes.width * (end - start) / 2 * gauss_weights
        places = (start + end) / 2 + (end - start) / 2 * nodes
        return tuple(
            Load(shape, _course(partial(self.pressure, float(at)), float(area)))
            for shape, at, area in zip(shapes.T, places, areas, strict=True)
        )


@dataclass(frozen=True)
class Gravity:
    """Weight: ``acceleration`` [m/s^2] is the component of g along the normal, < 0 presses the reed on its seat."""

    acceleration: float

    def modal(self, modes: BeamModes) -> tuple[Load, ...]:
        """Return one constant load, tip mass included; `GreensFunctionError` if the acceleration is not finite."""
        if not math.isfinite(self.acceleration):
            raise GreensFunctionError(f"acceleration = {self.acceleration} m/s^2 must be finite")
        mass = modes.line_density * modes.length
        return (Load(modes.project(lambda x: np.ones_like(x)) / mass, _course(lambda t: self.acceleration, mass)),)


def _course(values: Course, factor: float = 1.0) -> Callable[[Array], Array]:
    def amplitude(t: Array) -> Array:
        course = np.asarray(values(t), dtype=float)
        if course.ndim and course.shape != t.shape:
            raise GreensFunctionError(f"a load gave {course.shape} values for {t.shape} times; give one value per time")
        return np.asarray(factor * np.broadcast_to(course, t.shape))

    return amplitude


def _span(between: tuple[float, float] | None, length: float) -> tuple[float, float]:
    start, end = (0.0, length) if between is None else between
    if not 0 <= start < end <= length * (1 + 1e-12):
        raise GreensFunctionError(f"pressure between {start:g} and {end:g} m must lie on the reed, 0..{length:g} m")
    return start, min(end, length)
