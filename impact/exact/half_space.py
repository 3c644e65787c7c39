"""Elastic half-space: static compliances, Rayleigh speed, and the exact responses to a point load and a loaded disk.

The response of the surface to a vertical point load that remains (Lamb's problem) is dimensionless; that of a uniformly
loaded disk is its average. With tau = c_s t/r, kappa = c_s/c_p, gamma = c_s/c_R and the Rayleigh cubic, x = (slowness
c_s)^2,

    P(x) = (1 - 2x)^4 + 16 x^2 (x - kappa^2)(1 - x) = 16 (kappa^2 - 1) x^3 + 8 (3 - 2 kappa^2) x^2 - 8 x + 1,

the Cagniard integral over slownesses splits into partial fractions over the roots of P, each in closed form.

Sources: Pekeris, PNAS 41 (1955) 469 (nu = 1/4); Mooney, Bull. Seism. Soc. Am. 64 (1974) 473 and Kausel, Proc. R. Soc. A
469 (2013) 20120462 (any nu).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from impact.greens import base
from impact.greens.base import Array, ComplexArray
from impact.greens.modal import ModalGreens, Residual


def disk_compliance(*, young: float, poisson: float, radius: float, at: str = "mean") -> float:
    """Return the static displacement per unit force, spread evenly over a disk [m/N], ``at`` its "mean", "centre" or
    "edge".

    (1 - nu^2)/(E a) times 16/(3 pi^2), 2/pi, 4/pi^2. Source: Johnson, Contact Mechanics, 3.4.
    """
    return _unit_compliance(young, poisson, radius) * _place(
        at, {"mean": 16 / (3 * math.pi**2), "centre": 2 / math.pi, "edge": 4 / math.pi**2}
    )


def square_compliance(*, young: float, poisson: float, side: float, at: str = "mean") -> float:
    """Return the static displacement per unit force, spread evenly over a square [m/N], ``at`` its "mean" or "centre".

    (1 - nu^2)/(E b) times (4 (1 - sqrt 2)/3 + 4 asinh 1)/pi, 4 asinh(1)/pi. Source: Love,
    Phil. Trans. A 228 (1929) 377.
    """
    centre = 4 * math.asinh(1) / math.pi
    mean = centre - 4 / 3 * (math.sqrt(2) - 1) / math.pi
    return _unit_compliance(young, poisson, side, "side") * _place(at, {"mean": mean, "centre": centre})


def rectangle_compliance(*, young: float, poisson: float, sides: tuple[float, float]) -> float:
    """Return the mean static displacement per unit force, spread evenly over a rectangle of these ``sides`` [m/N].

    (1 - nu^2)/(pi E) times the mean of 1/r over the rectangle, 2/(a b) [a asinh(b/a) + b asinh(a/b) - (d^3 - a^3 -
    b^3)/(3 a b)] with sides a, b and the diagonal d. Source: Love, Phil. Trans. A 228 (1929) 377.
    """
    a, b = sides
    unit = min(_unit_compliance(young, poisson, side, "side") * side for side in sides)
    corners = (math.hypot(a, b) ** 3 - a**3 - b**3) / (3 * a * b)
    return unit / math.pi * 2 / (a * b) * (a * math.asinh(b / a) + b * math.asinh(a / b) - corners)


def punch_compliance(*, young: float, poisson: float, radius: float) -> float:
    """Return the static displacement per unit force of a rigid round punch, (1 - nu^2)/(2 E a) [m/N] (Johnson 3.36)."""
    return _unit_compliance(young, poisson, radius) / 2


@dataclass(frozen=True)
class HalfSpacePatch(base.ExactPort):
    """Mean displacement of a disk on an elastic half-space under a load spread evenly over it; exact.

    g(0+) = 1/(rho c_p pi a^2); g falls almost linearly and is exactly zero after 2a/c_R, when S has reached the static
    16 (1 - nu^2)/(3 pi^2 E a). A large body's g is this until its first reflection returns.

    Attributes:
        young: E [Pa].
        poisson: nu in [0, 0.5].
        density: rho [kg/m^3].
        radius: a [m].
        response: the same function without dimensions, it depends on nu only.
    """

    young: float
    poisson: float
    density: float
    radius: float
    response: DiskResponse = field(repr=False, compare=False)

    kind: ClassVar[str] = "half_space_patch"

    @property
    def error_estimate(self) -> base.ErrorEstimate:
        """Return what the Chebyshev series leave, about 1e-13; no mesh."""
        return base.ErrorEstimate(self.response.error, 0.0)

    @property
    def highest_rate(self) -> float:
        return 10 / self.crossing_time

    def scaled(self, factor: float) -> HalfSpacePatch:
        """Return the patch on 1/``factor`` the stiffness and the density: the same wave speeds."""
        return replace(self, young=self.young / base.check_factor(factor), density=self.density / factor)

    @property
    def crossing_time(self) -> float:
        """Return 2a/c_R [s]: the memory of the kernel."""
        return float(self.response.breaks[-1]) * self._unit_time

    @property
    def _unit_time(self) -> float:
        return 2 * self.radius / math.sqrt(self.young / (2 * (1 + self.poisson) * self.density))

    @property
    def _static(self) -> float:
        return disk_compliance(young=self.young, poisson=self.poisson, radius=self.radius)

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        time: Array = np.asarray(t, dtype=float)
        scale = self._static / self._unit_time
        values = scale * self.response(np.maximum(time, 0.0) / self._unit_time, integrated=False)
        return np.where(time < 0, 0.0, values)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        return np.asarray(self._static * self.response(time / self._unit_time, integrated=True))

    def static_compliance(self) -> Array:
        """Return 16 (1 - nu^2)/(3 pi^2 E a) [m/N]."""
        return np.array([[self._static]])

    def initial_value(self) -> Array:
        """Return 1/(rho c_p pi a^2) [m/(N s)]; 0 for nu = 0.5, where c_p is infinite."""
        slowness = math.sqrt((1 + self.poisson) * (1 - 2 * self.poisson) / (1 - self.poisson) / self.young)
        return np.array([[slowness / (math.sqrt(self.density) * math.pi * self.radius**2)]])

    def step_kernel(self, dt: float, n_steps: int) -> base.StepKernel:
        alive = min(n_steps, math.ceil(self.crossing_time / dt))
        weights = np.zeros((1, 1, n_steps))
        weights[:, :, :alive] = base.step_weights(self, dt, alive)
        return base.StepKernel(None, weights, f"half-space kernel, {alive} exact step weights")


def half_space_patch(*, young: float, poisson: float, density: float, radius: float) -> HalfSpacePatch:
    """Return a disk of ``radius`` on an elastic half-space, SI units.

    Raises:
        GreensFunctionError: a number that is not positive, or a Poisson ratio outside [0, 0.5].

    Sources: as `impact.exact.half_space`; the average over the disk is by the autocorrelation of its area.
    """
    base.check_positive(density=density)
    _unit_compliance(young, poisson, radius)
    return HalfSpacePatch(young, poisson, density, radius, DiskResponse.from_poisson(poisson))


def without_patch(greens: base.GreensFunction, patch: HalfSpacePatch, *, band_hz: float) -> base.GreensFunction:
    """Return ``greens`` without the local compliance of ``patch``, for a law that brings its own (Hertz): still
    passive.

    FE-BE split: compliance = (body - half-space under the patch) + contact law. As kernels the difference is not
    passive (it starts at g(0+) - g(0+) = 0 and holds reflections only), so the half-space is taken at its static value
    c = 16 (1 - nu^2)/(3 pi^2 E a), which it reaches after 2a/c_R, out of the terms of g that follow the force
    quasi-statically: bare compliance first, then relaxations a^2 exp(-rate t) (a^2/rate each) and modes (phi^2/w^2
    each) from the fastest down, the last in part. What is left is a part of the same passive sum. The static
    compliance falls by exactly c. The dynamics lost with the terms taken, relative to c and at the frequency f, are of
    order (f/f_low)^2 for modes and f/f_low for relaxations, f_low = ``origin["without_patch"]["lowest_hz"]``.

    Args:
        greens: the seat by modes, with one port; or a `SumGreens` with ``patch`` among its parts (that part is left
            out, exactly); or the patch itself (a rigid surface is left).
        patch: half-space of the body's material under the same disk.
        band_hz: band of the contact force [Hz]; modes and relaxations at or below it stay as they are.

    Raises:
        GreensFunctionError: the terms above ``band_hz`` hold less than c; several ports; another kind of function.

    Source: Johnson, Contact Mechanics, 4.2 and 11.4 for the local law; the split is that of coupled finite element
    and half-space contact models.
    """
    rest = tuple(part for part in greens.summands if part != patch)
    if not rest:
        return ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, 1)), Residual.none(), origin={"kind": "rigid"})
    if len(rest) < len(greens.summands):
        return rest[0] if len(rest) == 1 else base.SumGreens(rest)
    modal = greens.modal
    if modal is None or len(greens.ports) != 1:
        raise base.GreensFunctionError(
            f"cannot take a patch out of a {type(greens).__name__} with {len(greens.ports)} ports: give the modes of "
            "one port, or a SumGreens with the patch as a part"
        )
    return _quasi_static_removed(modal, float(patch.static_compliance()[0, 0]), band_hz)


def _quasi_static_removed(greens: ModalGreens, amount: float, band_hz: float) -> ModalGreens:
    residual = greens.residual
    speed = np.concatenate([[np.inf], residual.rates, greens.omega])
    with np.errstate(divide="ignore", invalid="ignore"):
        relaxed, modal = residual.shapes[:, 0] ** 2 / residual.rates, greens.shapes[:, 0] ** 2 / greens.omega**2
    held = np.where(speed > 2 * np.pi * band_hz, np.concatenate([residual.compliance[0], relaxed, modal]), 0.0)
    if amount > held.sum() * (1 + 1e-12):
        raise base.GreensFunctionError(
            f"the patch's compliance {amount:.4g} m/N exceeds the {held.sum():.4g} m/N that the residual and the modes "
            f"above {band_hz:g} Hz hold: check the patch's radius and material, add the residual flexibility, refine "
            "the mesh under the patch, or lower band_hz"
        )
    order = np.argsort(-speed, kind="stable")
    before = np.cumsum(held[order]) - held[order]
    taken = np.empty_like(held)
    taken[order] = np.clip(amount - before, 0.0, held[order])
    kept = 1 - np.divide(taken, held, out=np.zeros_like(held), where=held > 0)
    of_relaxed, of_modes = np.split(kept[1:], [len(residual.rates)])
    touched = speed[taken > 0]
    lowest = None if np.all(np.isinf(touched)) else float(touched.min() / (2 * np.pi))
    relaxing = (residual.shapes * np.sqrt(of_relaxed)[:, None])[of_relaxed > 0]
    rest = Residual(relaxing, residual.rates[of_relaxed > 0], residual.compliance * kept[0])
    report = {"compliance": amount, "band_hz": band_hz, "lowest_hz": lowest}
    seen = replace(greens, shapes=greens.shapes * np.sqrt(of_modes)[:, None])
    return replace(seen.select_modes(of_modes > 0, rest), origin={**greens.origin, "without_patch": report})


def _unit_compliance(young: float, poisson: float, size: float, name: str = "radius") -> float:
    """Return (1 - nu^2)/(E size)."""
    base.check_positive(**{"young": young, name: size})
    if not 0.0 <= poisson <= 0.5:
        raise base.GreensFunctionError(f"poisson = {poisson:g} is outside [0, 0.5]")
    return (1 - poisson**2) / (young * size)


def _place(at: str, factors: dict[str, float]) -> float:
    if at not in factors:
        raise base.GreensFunctionError(f"at = {at!r}: known places are {', '.join(factors)}")
    return factors[at]


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
        raise base.GreensFunctionError(f"poisson = {poisson:g} is outside [0, 0.5]")
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
            raise base.GreensFunctionError(
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
