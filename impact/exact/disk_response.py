"""Lamb's problem at the surface of an elastic half-space, without dimensions: Rayleigh speed, the motion after a
vertical point load that stays, and its average over a uniformly loaded disk.

With tau = c_s t/r, kappa = c_s/c_p, gamma = c_s/c_R and the Rayleigh cubic, x = (slowness c_s)^2,

    P(x) = (1 - 2x)^4 + 16 x^2 (x - kappa^2)(1 - x) = 16 (kappa^2 - 1) x^3 + 8 (3 - 2 kappa^2) x^2 - 8 x + 1,

the Cagniard integral over slownesses splits into partial fractions over the roots of P, each in closed form.

Sources: Pekeris, PNAS 41 (1955) 469 (nu = 1/4); Mooney, Bull. Seism. Soc. Am. 64 (1974) 473 and Kausel, Proc. R. Soc.
A 469 (2013) 20120462 (any nu).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from impact.greens.base import Array, ComplexArray, GreensFunctionError

_NEARLY_DOUBLE = 1e-3  # least distance of roots at which partial fractions keep their digits


@dataclass(frozen=True)
class PointLoad:
    """Terms of h = f/f(inf), f the `point_step_response`; h = 0 before kappa, 1 beyond gamma, between them

    h = 1/2 + Re sum_j strength_j/sqrt(tau^2 - pole_j) - (rayleigh/2)/sqrt(gamma^2 - tau^2),  kappa < tau < 1
    h = 1 - rayleigh/sqrt(gamma^2 - tau^2),  1 < tau < gamma.
    """

    kappa: float
    gamma: float
    poles: ComplexArray
    strengths: ComplexArray
    rayleigh: float

    @staticmethod
    def from_poisson(poisson: float) -> PointLoad:
        """Return the terms for a Poisson ratio in [0, 0.5]; raises `GreensFunctionError` outside."""
        kappa2 = _kappa2(poisson)
        x1, x2, x3 = _roots(kappa2)
        static = (1 - poisson) / 2

        def residue(x: ComplexArray, slope: ComplexArray) -> ComplexArray:
            return np.asarray((1 - 2 * x) ** 2 * np.sqrt(kappa2 - x + 0j) / (2 * static * slope))

        lead = 16 * (kappa2 - 1)
        if abs(x1 - x2) > _NEARLY_DOUBLE:
            poles = np.array([x1, x2])
            strengths = residue(poles, lead * (poles - x3) * np.array([x1 - x2, x2 - x1]))
        else:  # Cauchy's integral around both, trapezoidal rule: its 16 points act as poles; exact to round-off
            arm = 10 * _NEARLY_DOUBLE * np.exp(2j * np.pi * (np.arange(16) + 0.5) / 16)
            poles = (x1 + x2) / 2 + arm
            strengths = residue(poles, lead * (poles - x1) * (poles - x2) * (poles - x3)) * arm / 16
        top, slope = x3.real, lead * ((x3 - x1) * (x3 - x2)).real
        rayleigh = -((1 - 2 * top) ** 2) * math.sqrt(top - kappa2) / (static * slope)
        return PointLoad(math.sqrt(kappa2), math.sqrt(top), poles, strengths, rayleigh)


def rayleigh_speed(poisson: float) -> float:
    """Return c_R/c_s of an elastic half-space, 0.8740 (nu = 0) ... 0.9553 (nu = 0.5): the exact root of the Rayleigh
    cubic.

    Raises:
        GreensFunctionError: Poisson ratio outside [0, 0.5].
    """
    return 1 / math.sqrt(_roots(_kappa2(poisson))[2].real)


def point_step_response(tau: ArrayLike, *, poisson: float) -> Array:
    """Return f(tau), shape of ``tau``: w = F f(c_s t/r)/(pi mu r) is the surface's displacement along a point load F
    H(t) [m].

    f is 0 before the pressure wave, -inf at the Rayleigh wave tau = c_s/c_R and (1 - nu)/2 (Boussinesq) after it.
    The error is below 1e-11 of (1 - nu)/2 away from the Rayleigh pole.
    """
    load = PointLoad.from_poisson(poisson)
    t = np.asarray(tau, dtype=float)
    square = np.ravel(t) ** 2
    before, late = load.gamma**2 - square, np.ravel(t) > load.gamma
    with np.errstate(divide="ignore"):
        pole = load.rayleigh / np.sqrt(np.where(late, 1.0, np.maximum(before, 0.0)))
    early = (np.ravel(t) > load.kappa) & (np.ravel(t) < 1)
    terms = load.strengths / np.sqrt(np.where(early, square, 1.0)[:, None] - load.poles)
    h = np.where(early, 0.5 + terms.sum(axis=1).real - pole / 2, np.where(late, 1.0, 1.0 - pole))
    return np.asarray((1 - poisson) / 2 * np.where(np.ravel(t) > load.kappa, h, 0.0)).reshape(t.shape)


def _kappa2(poisson: float) -> float:
    if not 0.0 <= poisson <= 0.5:
        raise GreensFunctionError(f"poisson = {poisson:g} is outside [0, 0.5]")
    return (1 - 2 * poisson) / (2 * (1 - poisson))


def _roots(kappa2: float) -> tuple[complex, complex, complex]:
    """Return the roots of P, the Rayleigh root (the only one above 1) last; a Newton step removes round-off."""
    cubic = np.polynomial.Polynomial([1.0, -8.0, 8 * (3 - 2 * kappa2), 16 * (kappa2 - 1)])
    roots = np.asarray(cubic.roots(), dtype=complex)
    last = np.argmax(roots.real)  # above 1; the two others have real parts below 3/4
    roots[last] -= cubic(roots[last]) / cubic.deriv()(roots[last])
    x1, x2 = np.delete(roots, last)
    return complex(x1), complex(x2), complex(roots[last])


_DEGREE = 96  # degree of the Chebyshev polynomial of each piece of g
_ERROR_LIMIT = 1e-9  # largest relative error of g accepted; below 3e-11 for every Poisson ratio so far


@dataclass(frozen=True)
class DiskResponse:
    """Motion of a disk of radius a on a half-space, over T = c_s t/(2a), relative to its static displacement.

    The point load's response h (`PointLoad`), averaged over the distances r = 2a x between two points of the disk:

        S/S_static = (3/2) int (acos x - x sqrt(1 - x^2)) h(T/x) dx,
        dS/dT      = 3 int_0^1 sqrt(1 - x^2) Q(x/T) dx,   Q(y) = H - y H',  H(y) = int_0^y h(1/u) du,

    the second by parts. Q is elementary in four pieces, broken at the Rayleigh, shear and pressure waves. g = dS/dT is
    kept as Chebyshev series between the times at which these waves cross the disk; S is their
    exact integral, scaled to end at 1.

    Attributes:
        breaks: (P + 1,) edges of the pieces, 0 ... c_s/c_R.
        speed: (P, d) Chebyshev coefficients of dS/dT.
        rise: (P, e) Chebyshev coefficients of S.
        error: of dS/dT between the nodes and of S at the end, each relative to its largest value.
    """

    breaks: Array
    speed: Array
    rise: Array
    error: float

    @staticmethod
    def from_poisson(poisson: float) -> DiskResponse:
        """Return the response for a Poisson ratio in [0, 0.5]; about 0.1 s.

        Raises `GreensFunctionError`: a Poisson ratio outside the interval, or an error above 1e-9 (none is known).
        """
        load = PointLoad.from_poisson(poisson)
        # where g(T) is not smooth; of a fast pressure wave pieces shrink by 8 towards T = 0 (T log T)
        towards_zero = [x for x in (1 / 512, 1 / 64, 1 / 8) if x > 2 * load.kappa]
        breaks = np.array(sorted({0.0, load.kappa, *towards_zero, 1.0, load.gamma}))
        low, width = breaks[:-1, None], np.diff(breaks)[:, None]
        nodes = chebyshev.chebpts1(_DEGREE + 1)
        values = _disk_speed(low + width * _clustered(nodes), load)
        speed = np.asarray(chebyshev.chebfit(nodes, values.T, _DEGREE).T, dtype=np.float64)
        slope = np.array([3 / 8, 0.0, -3 / 8])  # of the clustering map, 3 (1 - v^2)/4
        pieces = [
            w * chebyshev.chebint(chebyshev.chebmul(s, slope), lbnd=-1) for s, w in zip(speed, width, strict=True)
        ]
        rise = np.array(pieces)
        ends = np.cumsum(chebyshev.chebval(1.0, rise.T))
        rise[1:, 0] += ends[:-1]
        between = np.cos(np.pi * (np.arange(1, 8)) / 8.3)
        exact = _disk_speed(low + width * _clustered(between), load)
        error = max(np.abs(chebyshev.chebval(between, speed.T) - exact).max() / values.max(), abs(ends[-1] - 1))
        if not error < _ERROR_LIMIT:
            raise GreensFunctionError(
                f"half-space disk, nu = {poisson:g}: error {error:.1e} exceeds {_ERROR_LIMIT:g}; report it"
            )
        return DiskResponse(breaks, speed, rise / ends[-1], float(error))

    def __call__(self, time: Array, *, integrated: bool) -> Array:
        """Return S/S_static (``integrated``) or its slope at T >= 0; exactly 1 or 0 after the Rayleigh wave."""
        out = np.full(time.shape, 1.0 if integrated else 0.0)
        piece = np.searchsorted(self.breaks, time, side="right") - 1
        for n, series in enumerate(self.rise if integrated else self.speed):
            inside = piece == n
            part = (time[inside] - self.breaks[n]) / (self.breaks[n + 1] - self.breaks[n])
            out[inside] = chebyshev.chebval(np.asarray(2 * np.sin(np.arcsin(2 * part - 1) / 3)), series)
        return np.where(time > 0, out, 0.0) if integrated else out


def _disk_speed(time: Array, load: PointLoad) -> Array:
    """Return dS/dT, shape of ``time`` > 0, by quadrature over the three pieces where Q is not zero; x = sin(theta)."""
    t = np.ravel(time)[:, None]
    pulse = load.rayleigh / load.gamma**2  # Q = pulse/sqrt(gamma^2 y^2 - 1) between the Rayleigh and the shear wave

    def poles(y: Array) -> Array:
        terms = (s / p / np.sqrt(1 - p * y**2) for s, p in zip(load.strengths, load.poles, strict=True))
        return np.asarray(sum(terms, start=np.zeros_like(y)).real)

    def early(y: Array) -> Array:
        return np.asarray(offset - poles(y) + pulse / 2 / np.sqrt(load.gamma**2 * y**2 - 1))

    offset = (poles(np.ones(1)) + pulse / 2 / math.sqrt(load.gamma**2 - 1))[0]  # Q is continuous at the shear wave
    with np.errstate(divide="ignore"):
        r, s, p = (np.arcsin(np.minimum(t / c, 1.0)) for c in (load.gamma, 1.0, np.float64(load.kappa)))
    # Gauss panels on [0, 1], each 1/4 of its neighbour towards both ends: end singularities converge too
    half = np.concatenate([[0.0], 0.5 * 0.25 ** np.arange(14, -1, -1)])
    edges = np.concatenate([half, 1 - half[-2::-1]])
    nodes, gauss = np.polynomial.legendre.leggauss(14)
    width = np.diff(edges)[:, None] / 2
    w, weight = (edges[:-1, None] + width * (1 + nodes)).ravel(), (width * gauss).ravel()
    # the squared map cancels the inverse root at the Rayleigh wave; (gamma y)^2 - 1 ~ sin(theta - r) sin(theta + r)
    shift = (s - r) * w**2
    root = np.sqrt(np.sin(shift) * np.sin(2 * r + shift))
    total = (np.cos(r + shift) ** 2 * pulse / load.gamma * t / root * 2 * w * (s - r)) @ weight
    theta = s + (p - s) * w
    total += (np.cos(theta) ** 2 * early(np.sin(theta) / t) * (p - s)) @ weight
    if load.kappa > 0:  # before the pressure wave Q is constant
        total += (early(np.array([[1 / load.kappa]])) * (math.pi / 4 - p / 2 - np.sin(2 * p) / 4))[:, 0]
    return np.asarray(3 * total).reshape(time.shape)


def _clustered(v: Array) -> Array:
    """Map [-1, 1] onto [0, 1], quadratic at both ends: half-integer powers there become whole."""
    return (2 + 3 * v - v**3) / 4
