"""Modal Green's function: damped oscillators, relaxations and bare compliance; passive by construction."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.greens import base, oscillator
from impact.greens.base import Array, ComplexArray
from impact.greens.oscillator import combine, decay_responses, hann, mode_responses
from impact.quantities import brief

_BLOCK = 256  # number of times evaluated at once: memory is this times the number of poles
Ports = list[int] | slice
ALL: Final = slice(None)


@dataclass(frozen=True)
class Residual:
    """Residual flexibility of truncated modes, in a passive form.

    g_res(t) = sum_r a_r a_r' exp(-rates_r t) + compliance * delta(t)

    Attributes:
        shapes: amplitudes a_r (R, p) [sqrt(m/(N s))].
        rates: decay rates 1/tau >= 0 (R,) [1/s]; 0 is a dashpot or a semi-infinite rod.
        compliance: symmetric positive semidefinite bare compliance (p, p) [m/N].
    """

    shapes: Array
    rates: Array
    compliance: Array

    __repr__ = brief

    @staticmethod
    def none(n_ports: int = 1) -> Residual:
        """Return a residual of zero."""
        return Residual(np.zeros((0, n_ports)), np.zeros(0), np.zeros((n_ports, n_ports)))

    @staticmethod
    def spring(compliance: ArrayLike) -> Residual:
        """Return a bare residual flexibility (MacNeal): r0 delta(t), ``compliance`` scalar or (p, p) [m/N]."""
        r0 = _symmetric_psd(compliance, "residual compliance")
        return Residual(np.zeros((0, len(r0))), np.zeros(0), r0)

    @staticmethod
    def relaxing(compliance: ArrayLike, rate: float) -> Residual:
        """Return the exponential with integral R0 = ``compliance`` (scalar or (p, p)) [m/N] and a given ``rate`` [1/s].

        g_res(t) = R0 rate exp(-rate t): springs R0, each parallel to a dashpot.
        """
        r0 = _symmetric_psd(compliance, "residual compliance")
        if not (rate > 0 and np.isfinite(rate)):
            raise base.GreensFunctionError(f"rate = {rate:g} 1/s must be positive and finite")
        values, vectors = np.linalg.eigh(r0)
        positive = values > 1e-14 * max(values[-1], 0.0)
        shapes = (vectors[:, positive] * np.sqrt(values[positive] * rate)).T.copy()
        return Residual(shapes, np.full(int(positive.sum()), rate), np.zeros_like(r0))

    @staticmethod
    def exponential(compliance: ArrayLike, initial_value: ArrayLike) -> Residual:
        """Return the exponential with integral R0 = ``compliance`` and initial value G0 = ``initial_value``, (p, p) or
        scalar.

        g_res(t) = G0^(1/2) exp(-G0^(1/2) R0^-1 G0^(1/2) t) G0^(1/2); null directions of R0 are dropped.
        """
        r0 = _symmetric_psd(compliance, "residual compliance")
        g0 = _symmetric_psd(initial_value, "initial value")
        if r0.shape != g0.shape:
            raise base.GreensFunctionError(
                f"residual compliance is {r0.shape}, initial value {g0.shape}: give equal shapes"
            )
        scale, vectors = np.linalg.eigh(g0)
        if scale[0] <= 0:
            raise base.GreensFunctionError(f"g(0+) must be positive definite; smallest eigenvalue {scale[0]:g}")
        root = vectors * np.sqrt(scale) @ vectors.T
        inverse_root = vectors / np.sqrt(scale) @ vectors.T
        taus, modes = np.linalg.eigh(inverse_root @ r0 @ inverse_root)
        positive = taus > 1e-14 * max(taus[-1], 0.0)
        return Residual((root @ modes[:, positive]).T.copy(), 1.0 / taus[positive], np.zeros_like(r0))

    @staticmethod
    def together(residuals: Sequence[Residual]) -> Residual:
        """Return the sum of several residuals."""
        shapes, rates = (np.concatenate([getattr(r, name) for r in residuals]) for name in ("shapes", "rates"))
        return Residual(shapes, rates, np.asarray(sum(residual.compliance for residual in residuals)))

    def scaled(self, factor: float) -> Residual:
        """Return the residual times ``factor``."""
        return Residual(math.sqrt(factor) * self.shapes, self.rates, factor * self.compliance)

    def static(self) -> Array:
        """Return the static compliance (p, p) [m/N]; ``inf`` for a dashpot (rate 0)."""
        free = self.rates == 0
        bent = self.shapes[~free] / np.sqrt(self.rates[~free])[:, None]
        return np.asarray(bent.T @ bent + endless(self.shapes[free]) + self.compliance)

    def filtered(self, t: Array, width: float, rows: Ports = ALL, columns: Ports = ALL) -> Array:
        """Return the residual part of g (p, p, nt) after a unit Hann pulse of ``width`` [s], for the ports ``rows``
        under impulses on ``columns`` [m/(N s)]."""
        decays = combine(self.shapes[:, rows], decay_responses(self.rates, t, width), self.shapes[:, columns])
        return decays + self.compliance[rows][:, columns, None] * hann(t, width)


NO_RESIDUAL: Final = Residual.none(0)
"""The residual of nothing left out, for any number of ports."""


class PoleSums(base.StatedGreens):
    """Base of sums of oscillators and of complex poles, each term of which is known in closed form."""

    @abstractmethod
    def _values(self, t: Array, i: int, j: int, integrated: bool) -> Array:
        """Return g_ij, or its integral without bare compliance, at the times ``t`` (n,) >= 0."""

    @abstractmethod
    def _compliance(self, i: int, j: int) -> float:
        """Return the bare compliance [m/N]."""

    @abstractmethod
    def _filtered(self, t: Array, width: float, rows: list[int], columns: list[int]) -> Array:
        """Return g (rows, columns, n) after a unit Hann pulse of ``width`` [s]."""

    def _terms(self, counts: Mapping[str, int], noun: str, hertz: Array, ratios: Array, spring: Array) -> tuple[str]:
        """Return the terms in words: ``counts`` of rigid motions and of real poles, and the oscillations."""
        (rigid, real), span = (f"{n} {name}" if n else "" for name, n in counts.items()), ""
        if hertz.size:
            span = f"{hertz.size} {noun}, {hertz.min():.5g} ... {hertz.max():.5g} Hz, damping ratio "
            span += f"{ratios.min():.3g} ... {ratios.max():.3g}"
        parts = (rigid, span, real, "bare compliance" if np.any(spring) else "")
        return ("; ".join(filter(None, parts)) or "rigid and held",)

    def _sum(self, t: ArrayLike, i: int, j: int, integrated: bool) -> Array:
        t = np.asarray(t, dtype=float)
        flat = np.ravel(t)
        out = np.full(flat.shape, self._compliance(i, j) if integrated else 0.0)
        for start in range(0, flat.size, _BLOCK):
            block = slice(start, start + _BLOCK)
            out[block] += self._values(np.maximum(flat[block], 0.0), i, j, integrated)
        return np.where(flat < 0, 0.0, out).reshape(t.shape)

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        return self._sum(t, i, j, integrated=False)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        return self._sum(t, i, j, integrated=True)

    def filtered(self, t: ArrayLike, width: float, i: int = 0, j: int = 0) -> Array:
        t = np.asarray(t, dtype=float)
        return np.asarray(self._filtered(np.ravel(t), width, [i], [j])[0, 0].reshape(t.shape))

    def filtered_matrix(self, t: ArrayLike, width: float, columns: Sequence[int] = ()) -> Array:
        every = list(range(len(self.ports)))
        return self._filtered(np.asarray(t, dtype=float), width, every, list(columns) or every)


@dataclass(frozen=True)
class ModalGreens(PoleSums):
    """g_ij(t) = sum_k phi_ki phi_kj exp(-zeta_k w_k t) sin(wd_k t)/wd_k + residual, wd = w sqrt(1 - zeta^2).

    Attributes:
        omega: angular frequencies w_k >= 0 (M,) [rad/s]; 0 is a rigid-body mode (t).
        zeta: damping ratios >= 0 (M,); 1 and above are allowed.
        shapes: mass-normalised mode shapes at the ports (M, p) [1/sqrt(kg)].
        residual: residual flexibility of truncated modes.
        port_names: p names.
        error: estimated error of g.
        origin: provenance, plain JSON values.
        valid_for: time up to which g is known [s].
    """

    omega: Array
    zeta: Array
    shapes: Array
    residual: Residual
    port_names: tuple[str, ...] = ("contact",)
    error: base.ErrorEstimate = field(default_factory=base.ErrorEstimate)
    origin: Mapping[str, object] = field(default_factory=dict)
    valid_for: float = math.inf

    __repr__ = PoleSums.__str__

    def __post_init__(self) -> None:
        residual, m, p = self.residual, self.omega.size, len(self.port_names)
        r = residual.rates.size
        relaxations = (residual.shapes.shape, residual.rates.shape, residual.compliance.shape)
        modes = (self.omega.shape, self.zeta.shape, self.shapes.shape)
        if modes != ((m,), (m,), (m, p)) or relaxations != ((r, p), (r,), (p, p)):
            raise base.GreensFunctionError(
                f"shapes must match: omega {modes[0]}, zeta {modes[1]}, shapes {modes[2]}, residual shapes "
                f"{relaxations[0]}, rates {relaxations[1]}, compliance {relaxations[2]}, {p} ports"
            )
        for name, values in (("omega", self.omega), ("zeta", self.zeta), ("shapes", self.shapes)):
            if not np.all(np.isfinite(values)):
                raise base.GreensFunctionError(f"{name} must be finite, {np.sum(~np.isfinite(values))} values are not")
        for name, values in (("omega", self.omega), ("zeta", self.zeta), ("residual rates", self.residual.rates)):
            if values.size and values.min() < 0:
                raise base.GreensFunctionError(
                    f"{name} must be >= 0 (a body gains no energy); smallest {values.min():g}"
                )
        base.check_valid_for(self.valid_for)

    @staticmethod
    def from_hz(
        frequencies: ArrayLike,
        damping: ArrayLike,
        amplitudes: ArrayLike,
        *,
        residual: Residual = NO_RESIDUAL,
        port_names: tuple[str, ...] = (),
    ) -> ModalGreens:
        """Return the Green's function of modes as test and finite element programs list them.

        Args:
            frequencies: (M,) undamped natural frequencies [Hz]; 0 is a rigid-body mode.
            damping: (M,) damping ratios, 0.01 for 1 % of critical, or one for all.
            amplitudes: (M,) or (M, p) mass-normalised mode shapes at the ports [1/sqrt(kg)].
            residual: residual flexibility of truncated modes; default: none.
            port_names: p names; default: "contact" for one port, "port_1", ... for several.

        Raises `GreensFunctionError`: numbers of modes or ports that differ, values that are negative or not finite.
        """
        hertz, shapes = (np.atleast_1d(np.asarray(values, dtype=float)) for values in (frequencies, amplitudes))
        shapes = shapes[:, None] if shapes.ndim == 1 else shapes
        if hertz.ndim != 1 or shapes.ndim != 2 or np.ndim(damping) > 1 or np.size(damping) not in (1, hertz.size):
            raise base.GreensFunctionError(
                f"give frequencies (M,), damping (M,) or one, and amplitudes (M,) or (M, p), not {hertz.shape}, "
                f"{np.shape(damping)} and {np.shape(amplitudes)}"
            )
        zeta = np.broadcast_to(np.asarray(damping, dtype=float), hertz.shape).copy()
        count = shapes.shape[1]
        names = ("contact",) if count == 1 else tuple(f"port_{k}" for k in range(1, count + 1))
        rest = Residual.none(count) if residual is NO_RESIDUAL else residual
        return ModalGreens(2 * np.pi * hertz, zeta, shapes, rest, port_names or names)

    @property
    def modal(self) -> ModalGreens:
        return self

    @property
    def highest_rate(self) -> float:
        return float(self.omega.max(initial=0.0))

    def combined(self, weights: Array, port_names: tuple[str, ...]) -> ModalGreens:
        residual = self.residual
        at_ports = Residual(residual.shapes @ weights, residual.rates, weights.T @ residual.compliance @ weights)
        return replace(self, shapes=self.shapes @ weights, residual=at_ports, port_names=port_names)

    @property
    def frequencies_hz(self) -> Array:
        """Return the undamped natural frequencies (M,) [Hz]."""
        return self.omega / (2 * np.pi)

    def _describe(self) -> tuple[str, ...]:
        counts = {"rigid-body modes": int(np.sum(self.omega == 0)), "relaxations": self.residual.rates.size}
        return self._terms(counts, "modes", self.frequencies_hz[self.omega > 0], self.zeta, self.residual.compliance)

    def own_step_responses(self, t: Array) -> Array:
        return self._weighted(t, self.shapes**2, self.residual.shapes**2, True) + np.diag(self.residual.compliance)

    def _values(self, t: Array, i: int, j: int, integrated: bool) -> Array:
        modal, relaxing = (shapes[:, i] * shapes[:, j] for shapes in (self.shapes, self.residual.shapes))
        return self._weighted(t, modal, relaxing, integrated)

    def _weighted(self, t: Array, modal: Array, relaxing: Array, integrated: bool) -> Array:
        """Return the sums of modes and relaxations with these weights at ``t``, without the compliance."""
        function = oscillator.step_response if integrated else oscillator.impulse_response
        decay = -self.residual.rates * t[:, None]
        kernel = oscillator.expm1_over(decay) * t[:, None] if integrated else np.exp(decay)
        return np.asarray(function(t[:, None], self.omega, self.zeta) @ modal + kernel @ relaxing)

    def _compliance(self, i: int, j: int) -> float:
        return float(self.residual.compliance[i, j])

    def transfer(self, s: ComplexArray) -> ComplexArray:
        """Return the sum of phi phi'/(s^2 + 2 zeta w s + w^2) + a a'/(s + rate) + c (n, p, p) [m/N]."""
        residual, w, column = self.residual, self.omega, s[:, None]
        parts = (
            (1 / (column**2 + 2 * self.zeta * w * column + w**2), self.shapes),
            (1 / (column + residual.rates), residual.shapes),
        )
        sums = [np.einsum("nk,ki,kj->nij", f, phi, phi, optimize=True) for f, phi in parts]
        return np.asarray(sums[0] + sums[1] + residual.compliance, dtype=complex)

    def select_modes(self, kept: NDArray[np.bool_], residual: Residual) -> ModalGreens:
        """Return the function with the modes in the mask ``kept`` (M,), and another ``residual``."""
        return replace(self, omega=self.omega[kept], zeta=self.zeta[kept], shapes=self.shapes[kept], residual=residual)

    def above(self, omega: float) -> ModalGreens:
        """Return the function with the modes above ``omega`` [rad/s] only, without residual."""
        return self.select_modes(self.omega > omega, Residual.none(len(self.port_names)))

    def stored(self) -> base.Stored:
        arrays = {name: getattr(self, name) for name in ("omega", "zeta", "shapes")}
        arrays |= {f"residual/{name}": getattr(self.residual, name) for name in ("shapes", "rates", "compliance")}
        return base.Stored("modal", arrays=arrays)

    def static_compliance(self) -> Array:
        """Return sum of phi phi'/w^2 plus the residual's (p, p); ``inf`` with a rigid-body mode at the port [m/N]."""
        rigid = self.omega == 0
        bent = self.shapes[~rigid] / self.omega[~rigid, None]
        return np.asarray(bent.T @ bent + endless(self.shapes[rigid]) + self.residual.static())

    def initial_value(self) -> Array:
        start = np.einsum("ri,rj->ij", self.residual.shapes, self.residual.shapes)
        return np.asarray(start + np.where(self.residual.compliance != 0, np.inf, 0.0))

    def _filtered(self, t: Array, width: float, rows: list[int], columns: list[int]) -> Array:
        response = self.residual.filtered(t, width, rows, columns)
        for start in range(0, t.size, 1024):  # blocks limit the memory
            block = slice(start, start + 1024)
            each = mode_responses(self.omega, self.zeta, t[block], width)
            response[:, :, block] += combine(self.shapes[:, rows], each, self.shapes[:, columns])
        return response

    def step_matrix(self, dt: float) -> Array:
        """Return W_0 (p, p): displacement at the end of a step of ``dt`` [s] per unit force during it [m/N]."""
        gains = oscillator.step_response(np.full(self.omega.shape, dt), self.omega, self.zeta)
        res = self.residual
        eased = dt * oscillator.expm1_over(-res.rates * dt)
        whole = (self.shapes.T * gains) @ self.shapes + (res.shapes.T * eased) @ res.shapes + res.compliance
        return np.asarray((whole + whole.T) / 2)

    def step_kernel(self, dt: float, n_steps: int) -> base.StepKernel:
        """Return the function as a recursion, which is exact for forces constant over a step."""
        return base.StepKernel(self, None, f"pole recursion, {len(self.omega) + len(self.residual.rates)} poles")

    def inverse_mass(self) -> Array:
        rigid = self.shapes[self.omega == 0]
        return np.asarray(rigid.T @ rigid)

    def scaled(self, factor: float) -> ModalGreens:
        rest = self.residual.scaled(base.check_factor(factor))
        return replace(self, shapes=math.sqrt(factor) * self.shapes, residual=rest)

    def merge(self, others: Sequence[ModalGreens]) -> ModalGreens:
        """Return the sum of this function and ``others`` as one function with all their poles."""
        together = base.SumGreens((self, *others))
        omega, zeta, shapes = (
            np.concatenate([getattr(part, name) for part in (self, *others)]) for name in ("omega", "zeta", "shapes")
        )
        rest = Residual.together([part.residual for part in (self, *others)])
        error, origin, known = together.error_estimate, together.provenance, together.valid_for
        return ModalGreens(omega, zeta, shapes, rest, together.ports, error, origin, known)


def _symmetric_psd(values: ArrayLike, name: str) -> Array:
    """Return a symmetric matrix (p, p) without negative eigenvalues of round-off; raises for those beyond 1e-10."""
    matrix = np.atleast_2d(np.asarray(values, dtype=float))
    if matrix.shape[0] != matrix.shape[1] or not np.all(np.isfinite(matrix)):
        raise base.GreensFunctionError(f"{name} must be a finite square matrix, got shape {matrix.shape}")
    matrix = (matrix + matrix.T) / 2
    eigenvalues, vectors = np.linalg.eigh(matrix)
    limit = 1e-10 * max(abs(eigenvalues[-1]), abs(eigenvalues[0]))
    if eigenvalues[0] < -limit:
        raise base.GreensFunctionError(
            f"{name} must be positive semidefinite, or the body gains energy; eigenvalue {eigenvalues[0]:g}"
        )
    return matrix if eigenvalues[0] >= 0 else np.asarray(vectors * np.maximum(eigenvalues, 0.0) @ vectors.T)


def endless(shapes: Array) -> Array:
    """Return the compliance (p, p) of unrestrained motions (r, p): infinite if both ports take part in one."""
    shared = shapes.T @ shapes
    return np.where(shared != 0, np.copysign(np.inf, shared), 0.0)
