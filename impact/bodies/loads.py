"""Loads on a body: prescribed pressure, point forces, gravity, the motion of its base, and springs to the ground.

Loads are positive along the normal, away from the other body.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final, Literal, Protocol, get_args

import numpy as np
import scipy
from numpy.polynomial import legendre
from numpy.typing import ArrayLike

from impact.beams.euler_bernoulli import BeamModes
from impact.bodies.body import Body, Load, ModalState
from impact.bodies.time_series import TimeSeries, TimeSeriesError
from impact.greens.base import Array, GreensFunctionError
from impact.quantities import brief

Course = Callable[[Array], ArrayLike] | float  # (n,) times [s] -> (n,) values; a number is a constant


WHOLE: Final = (0.0, math.inf)
"""Range of distances from the clamp that includes every reed as a whole [m]."""


class ReedLoad(Protocol):
    """A load on a reed whose distribution is known.

    The quasi-static response of the omitted modes to such a load is neglected. Relative to the static tip deflection it
    is, under a force at the tip, 4.1e-2/n^3 for an Euler-Bernoulli cantilever with n modes (6e-7 for 40) and 2.3e-3/n
    for a stubby Timoshenko cantilever, L/h = 10 (6e-5 for 40); under uniform pressure 5e-10 and 4e-8 for 40.
    """

    def modal(self, modes: BeamModes) -> tuple[Load, ...]:
        """Return the load as modal shapes with their courses in time."""


@dataclass(frozen=True)
class PointForce:
    """Force F(t) [N] at the distance ``at`` from the clamp [m], with the modal forces w_k(at) F(t)."""

    force: Course
    at: float

    def modal(self, modes: BeamModes) -> tuple[Load, ...]:
        """Return one load; `GreensFunctionError` if ``at`` is off the reed."""
        return (Load(modes.deflection(self.at), _course(self.force)),)


@dataclass(frozen=True)
class Pressure:
    """Pressure p(t) profile(x) [Pa] on the whole width, with the modal forces p(t) width * integral of w_k profile dx.

    Attributes:
        pressure: p(t), times (n,) s -> Pa; positive pushes the reed away from the seat.
        between: distances from the clamp between which it acts [m], such as those of a port; by default the whole reed.
        profile: distribution along the reed, x (G,) m -> (G,), by default uniform.
    """

    pressure: Course
    between: tuple[float, float] = WHOLE
    profile: Callable[[Array], ArrayLike] = np.ones_like

    def modal(self, modes: BeamModes) -> tuple[Load, ...]:
        """Return one load; `GreensFunctionError` if ``between`` is off the reed or the profile is not finite."""
        start, end = _span(self.between, modes.length)
        x, weights = modes.quadrature(start, end)
        profile = np.asarray(self.profile(x), dtype=float)
        if not np.all(np.isfinite(profile)):
            raise GreensFunctionError(
                f"the pressure profile must be finite, {np.sum(~np.isfinite(profile))} values are not"
            )
        area = modes.width * (end - start)
        shape = modes.deflection(x) @ (weights * profile) / (end - start)
        return (Load(shape, _course(self.pressure, area)),)


@dataclass(frozen=True)
class PressureField:
    """Pressure p(x, t) [Pa] that is no product p(t) profile(x), by the polynomial in x through ``points`` Gauss points.

    Each point is one load with the course p(x_g, t), spread by its Lagrange polynomial. This is exact for polynomials
    of degree points - 1, and of spectral accuracy for smooth p. Where the pressure ends sharply, use ``between``.

    Attributes:
        pressure: p(x, t), one distance [m] and times (n,) s -> (n,) Pa; positive pushes the reed away from the seat.
        between: distances from the clamp between which it acts [m], by default the whole reed.
        points: number of Gauss points; each costs as much as one contact port.
    """

    pressure: Callable[[float, Array], ArrayLike]
    between: tuple[float, float] = WHOLE
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
    """Weight of a reed; ``acceleration`` [m/s^2]: component of g along the normal, < 0 presses the reed on its seat."""

    acceleration: float

    def modal(self, modes: BeamModes) -> tuple[Load, ...]:
        """Return one constant load, tip mass included; `GreensFunctionError` if the acceleration is not finite."""
        if not math.isfinite(self.acceleration):
            raise GreensFunctionError(f"acceleration = {self.acceleration} m/s^2 must be finite")
        mass = modes.line_density * modes.length
        return (Load(modes.project(lambda x: np.ones_like(x)) / mass, _course(lambda t: self.acceleration, mass)),)


def _course(values: Course, factor: float = 1.0) -> Callable[[Array], Array]:
    def amplitude(t: Array) -> Array:
        course = np.asarray(values(t) if callable(values) else values, dtype=float)
        if course.ndim and course.shape != t.shape:
            raise GreensFunctionError(f"a load gave {course.shape} values for {t.shape} times; give one value per time")
        return np.asarray(factor * np.broadcast_to(course, t.shape))

    return amplitude


def _span(between: tuple[float, float], length: float) -> tuple[float, float]:
    start, end = (0.0, length) if between == WHOLE else between
    if not 0 <= start < end <= length * (1 + 1e-12):
        raise GreensFunctionError(f"pressure between {start:g} and {end:g} m must lie on the reed, 0..{length:g} m")
    return start, min(end, length)


Kind = Literal["displacement", "velocity", "acceleration"]


@dataclass(frozen=True)
class BaseMotion:
    """A motion of the base along the normal; at t = 0 the body is at rest relative to the base.

    In the frame of the base the inertia load, -acceleration times the mass, acts on the body like gravity; its ports
    also move with the base by the displacement. A body needs both:

        body = impact.cantilever_reed(..., loads=[motion])
        body = dataclasses.replace(body, base=motion.displacement)

    Attributes:
        displacement: s(t) - s(0) at the times (n,) s -> (n,) m.
        acceleration: its second derivative, (n,) s -> (n,) m/s^2.
    """

    displacement: Callable[[Array], Array]
    acceleration: Callable[[Array], Array]

    __repr__ = brief

    @staticmethod
    def from_series(series: TimeSeries, kind: Kind) -> BaseMotion:
        """Return the motion from a record of displacement, velocity or acceleration, by exact integrals and derivatives
        of a piecewise polynomial.

        An acceleration or velocity is linear between its samples, a displacement is a cubic spline (not-a-knot). The
        base starts from s = 0 at t = 0, and from rest if the record is an acceleration. Raises `TimeSeriesError` for
        another kind; the motion raises it at times that the record does not cover.
        """
        if kind not in get_args(Kind):
            raise TimeSeriesError(f"{series.name}: {kind!r} of a base is unknown; choose {', '.join(get_args(Kind))}")
        path: scipy.interpolate.PPoly
        if kind == "displacement":
            path = scipy.interpolate.CubicSpline(series.time, series.value, extrapolate=False)
        else:
            slope = np.diff(series.value) / np.diff(series.time)
            line = scipy.interpolate.PPoly(np.stack([slope, series.value[:-1]]), series.time, extrapolate=False)
            path = line.antiderivative(1 if kind == "velocity" else 2)
        speed, acceleration = path.derivative(), path.derivative(2)
        first, last = float(series.time[0]), float(series.time[-1])

        def clip_times(t: Array) -> Array:
            slack = 1e-9 * (last - first)
            if t.size and (t.min() < first - slack or t.max() > last + slack):
                raise TimeSeriesError(
                    f"{series.name}: the base's {kind} covers {first:g}..{last:g} s, the run asks for "
                    f"{t.min():g}..{t.max():g} s; give a longer record"
                )
            return np.clip(t, first, last)

        def displacement(t: Array) -> Array:
            zero = clip_times(np.zeros(1))
            drift = float(speed(zero)[0]) if kind == "acceleration" else 0.0  # the record may begin before t = 0
            return np.asarray(path(clip_times(t)) - path(zero) - drift * t)

        return BaseMotion(displacement, lambda t: np.asarray(acceleration(clip_times(t))))

    def modal(self, modes: BeamModes) -> tuple[Load, ...]:
        """Return the load on a beam in the frame of its base, -s'' times the integral of rho A w_k dx, tip mass
        included."""
        return tuple(self.load(load.shape, modes.line_density * modes.length) for load in Gravity(1.0).modal(modes))

    def load(self, shape: Array, mass: float) -> Load:
        """Return the inertia load on a body of ``mass`` [kg] with modal participation ``shape`` (M,) [1/sqrt(kg)]."""
        return Load(shape, lambda t: -mass * np.asarray(self.acceleration(t), dtype=float))


ROUND_OFF: Final = 1e-10  # relative modal participation of springs and forces in a rigid mode that counts as zero

SPRINGS: Final = "springs"
"""Key, in the origin of a Green's function, of the number of springs that its modes include."""


@dataclass(frozen=True)
class Suspension:
    """Springs of a body, in terms of the M modes of the body with the springs.

    ``shapes`` (M, S): these modes at the S springs [1/sqrt(kg)]; ``stiffness`` (S,) [N/m]; ``basis`` (M, M): orthogonal
    transformation q = basis q_with to the modal coordinates without springs; ``omega`` (M,) [rad/s] and ``zeta`` (M,):
    frequencies and damping ratios without springs.
    """

    shapes: Array
    stiffness: Array
    basis: Array
    omega: Array
    zeta: Array


@dataclass(frozen=True, repr=False)
class SprungBody(Body):
    """A body on ``springs``: its Green's function, state and loads refer to the modes with the springs."""

    springs: Suspension = field(kw_only=True)


def hold_on_springs(body: Body, shapes: Array, stiffness: ArrayLike) -> SprungBody:
    """Return the body with undamped linear springs between some of its points and the ground.

    With the body's modal frequencies W and mode shapes B (M, S) at the springs, the modes with springs are the
    eigenvectors V of W^2 + B k B'. This is exact within the modal space; the residual flexibility at the springs is
    neglected, as it is for loads. Damping stays modal: off-diagonal terms of V' 2 zeta W V are neglected. The velocity
    becomes part of the state, since a body on springs is held.

    Args:
        body: a sum of modes.
        shapes: B (M, S) [1/sqrt(kg)].
        stiffness: (S,), or one for all [N/m].

    Raises `GreensFunctionError` for a body without modes, shapes that do not fit them, a stiffness that is not
    positive.
    """
    modal = body.greens.modal
    if modal is None or not len(modal.omega):
        raise GreensFunctionError(
            f"springs: a body known by a {type(body.greens).__name__} has no modes that springs could act on; take "
            "a beam, a plate or a rigid mass"
        )
    stiffnesses = np.broadcast_to(np.asarray(stiffness, dtype=float), np.shape(shapes)[1:])
    if SPRINGS in modal.origin:
        raise GreensFunctionError("springs: the body is on springs already; give all of them at once")
    if np.ndim(shapes) != 2 or len(shapes) != len(modal.omega) or not np.all(np.isfinite(shapes)):
        raise GreensFunctionError(
            f"springs: shapes {np.shape(shapes)} must be finite and have a row for each of the {len(modal.omega)} "
            "modes: give (modes, springs) values"
        )
    if not (np.all(np.isfinite(stiffnesses)) and np.all(stiffnesses > 0)):
        raise GreensFunctionError(f"springs: stiffness = {stiffnesses} N/m must be positive and finite")
    omega, basis = _find_sprung_modes(modal.omega, np.asarray(shapes * np.sqrt(stiffnesses)))
    decay_rates = (basis**2).T @ (modal.zeta * modal.omega)
    zeta = np.divide(decay_rates, omega, out=np.zeros_like(omega), where=omega > 0)

    def transform(values: Array) -> Array:
        """Return values of the modes with springs, round-off of rigid motions removed."""
        sprung = np.asarray(basis.T @ values)
        rigid = (omega == 0) if sprung.ndim == 1 else (omega == 0)[:, None]
        return np.where(rigid & (np.abs(sprung) <= ROUND_OFF * np.abs(sprung).max(axis=0)), 0.0, sprung)

    start = body.modal_start()
    state = ModalState(basis.T @ start.displacement, basis.T @ start.velocity)
    origin = {**modal.origin, SPRINGS: len(stiffnesses)}
    greens = replace(modal, omega=omega, zeta=zeta, shapes=transform(modal.shapes), origin=origin)
    return SprungBody(
        greens,
        state=state if np.any(state.displacement) or np.any(state.velocity) else None,
        loads=tuple(replace(load, shape=transform(load.shape)) for load in body.loads),
        base=body.base,
        springs=Suspension(transform(np.asarray(shapes)), np.array(stiffnesses), basis, modal.omega, modal.zeta),
    )


def find_own_coordinates(body: Body, coordinates: Array) -> Array:
    """Return (n, M) modal ``coordinates`` [m sqrt(kg)] of a body, transformed to its modes without springs."""
    return coordinates @ body.springs.basis.T if isinstance(body, SprungBody) else coordinates


def _find_sprung_modes(omega: Array, pulls: Array) -> tuple[Array, Array]:
    """Return the (M,) angular frequencies [rad/s] and the (M, M) eigenvectors of diag(omega^2) + pulls pulls'.

    Rigid motions without spring forces keep the frequency 0. The squares of the other frequencies are sums of positive
    terms, |W v|^2 + |pulls' v|^2, which stay accurate for soft springs, whereas the computed eigenvalues err by the
    round-off of the highest squared frequency.
    """
    rigid, elastic = np.flatnonzero(omega == 0), np.flatnonzero(omega > 0)
    rotation = np.eye(len(omega))
    if len(rigid):
        vectors, sizes, _ = np.linalg.svd(pulls[rigid])
        rank = int(np.sum(sizes > ROUND_OFF * np.linalg.norm(pulls)))
        rotation[np.ix_(rigid, rigid)] = vectors
        free, sprung = rigid[rank:], np.concatenate([rigid[:rank], elastic])
    else:
        free, sprung = rigid, elastic
    rotated = rotation.T @ pulls
    square = np.diag(omega[sprung] ** 2) + rotated[sprung] @ rotated[sprung].T
    _, vectors = np.linalg.eigh(square)
    values = ((omega[sprung, None] * vectors) ** 2).sum(axis=0) + ((rotated[sprung].T @ vectors) ** 2).sum(axis=0)
    order = np.argsort(values, kind="stable")
    basis = np.column_stack([rotation[:, free], rotation[:, sprung] @ vectors[:, order]])
    return np.concatenate([np.zeros(len(free)), np.sqrt(values[order])]), basis
