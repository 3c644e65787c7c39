"""Green's function as a sum over poles (modes coupled by damping, or a fitted measurement), and Green's functions in
other forms: receptance, and state space for control and simulation programs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import scipy
from numpy.typing import ArrayLike

from impact.greens import base, oscillator
from impact.greens.base import Array, ComplexArray
from impact.greens.modal import ALL, ModalGreens, PoleSums, Residual, endless
from impact.quantities import brief

_BLOCK = 4096  # number of poles evaluated at once
_VALUES = 1 << 20  # number of frequencies times modes evaluated at once


@dataclass(frozen=True)
class PoleGreens(PoleSums):
    """Symmetric sum of simple poles, of rigid-body motions and of a bare compliance:

        g_ij(t) = 2 Re sum_k r_ki r_kj exp(s_k t) + sum_m sign_m a_mi a_mj exp(-rate_m t)
                  + sum_n b_ni b_nj t + c_ij delta(t)

    With M u'' + C u' + K u = B f and (s^2 M + s C + K) x = 0, x normalised by x'(2 s M + C) x = 1, r = B'x. Unlike
    `ModalGreens` it need not be passive: see `impact.pole_passivity`. It is convolved by step weights; its energy in
    a ledger is the work done on it.

    Attributes:
        poles: s_k (K,) with Im > 0 and Re <= 0, one of each conjugate pair [1/s].
        shapes: complex r_k (K, p) [sqrt(m/(N s))].
        rates: decay rates (R,) of the real poles, >= 0 [1/s].
        real_shapes: a_m (R, p) [sqrt(m/(N s))].
        signs: +1 or -1 (R,); an overdamped pair has one of each.
        rigid: rigid-body shapes b_n (N, p) [1/sqrt(kg)]: the double pole at 0.
        compliance: symmetric positive semidefinite c (p, p) [m/N].
        port_names: p names.
        error: estimated error of g.
        origin: provenance, plain JSON values.
        valid_for: time up to which g is known [s].

    Raises:
        GreensFunctionError: shapes that do not match, values not finite, a growing pole, Im <= 0, signs other than +-1,
            a negative real pole at rate 0, an indefinite compliance.

    Source: Tisseur and Meerbergen, SIAM Review 43 (2001) 235 (the quadratic eigenvalue problem).
    """

    poles: ComplexArray
    shapes: ComplexArray
    rates: Array = field(default_factory=lambda: np.zeros((0, 0)))
    real_shapes: Array = field(default_factory=lambda: np.zeros((0, 0)))
    signs: Array = field(default_factory=lambda: np.zeros((0, 0)))
    rigid: Array = field(default_factory=lambda: np.zeros((0, 0)))
    compliance: Array = field(default_factory=lambda: np.zeros((0, 0)))
    port_names: tuple[str, ...] = ("contact",)
    error: base.ErrorEstimate = field(default_factory=base.ErrorEstimate)
    origin: Mapping[str, object] = field(default_factory=dict)
    valid_for: float = math.inf

    __repr__ = PoleSums.__str__

    def __post_init__(self) -> None:
        p = len(self.port_names)
        kinds = {"poles": complex, "shapes": complex}
        arrays = {
            name: np.asarray(getattr(self, name), dtype=kinds.get(name, float))
            for name in ("poles", "shapes", "rates", "real_shapes", "signs", "rigid", "compliance")
        }
        empty = {"shapes": (0, p), "rates": (0,), "real_shapes": (0, p), "signs": (0,), "rigid": (0, p)}
        for name, shape in (empty | {"compliance": (p, p)}).items():
            if arrays[name].size == 0:
                arrays[name] = np.zeros(shape, arrays[name].dtype)
        for name, values in arrays.items():
            object.__setattr__(self, name, values)
        _check(self)

    @property
    def highest_rate(self) -> float:
        return float(np.abs(self.poles).max(initial=0.0))

    def inverse_mass(self) -> Array:
        return np.asarray(self.rigid.T @ self.rigid)

    def scaled(self, factor: float) -> PoleGreens:
        root = math.sqrt(base.check_factor(factor))
        return replace(
            self,
            shapes=root * self.shapes,
            real_shapes=root * self.real_shapes,
            rigid=root * self.rigid,
            compliance=factor * self.compliance,
        )

    def _describe(self) -> tuple[str, ...]:
        counts = {"rigid bodies": len(self.rigid), "real poles": self.rates.size}
        return self._terms(counts, "pole pairs", self.frequencies_hz, self.damping_ratios, self.compliance)

    def combined(self, weights: Array, port_names: tuple[str, ...]) -> PoleGreens:
        shapes = {name: getattr(self, name) @ weights for name in ("shapes", "real_shapes", "rigid")}
        return replace(self, compliance=weights.T @ self.compliance @ weights, port_names=port_names, **shapes)

    @property
    def frequencies_hz(self) -> Array:
        """Return |s_k|/(2 pi) (K,) [Hz]: undamped natural frequencies if the modes are uncoupled."""
        return np.asarray(np.abs(self.poles) / (2 * np.pi))

    @property
    def damping_ratios(self) -> Array:
        """Return the damping ratios -Re s_k/|s_k| (K,)."""
        return np.asarray(-self.poles.real / np.abs(self.poles))

    @staticmethod
    def from_modal(modal: ModalGreens) -> PoleGreens:
        """Return the same function by its poles; raises `GreensFunctionError` for a critically damped mode (double
        pole)."""
        omega, zeta, phi, residual = modal.omega, modal.zeta, modal.shapes, modal.residual
        free = omega == 0
        under, over = ~free & (zeta < 1), ~free & (zeta > 1)
        if np.any(~(free | under | over)):
            raise base.GreensFunctionError("a mode with zeta = 1 is a double pole: change its zeta by 1e-6")
        wd = np.where(free, 1.0, omega) * np.sqrt(np.abs((1 - zeta) * (1 + zeta)))
        fast = (zeta * omega + wd)[over]
        slow = omega[over] ** 2 / fast
        pair = phi[over] / np.sqrt(2 * wd[over])[:, None]
        count = len(fast)
        return PoleGreens(
            (-zeta * omega + 1j * wd)[under],
            phi[under] / np.sqrt(2j * wd[under])[:, None],
            np.concatenate([slow, fast, residual.rates]),
            np.concatenate([pair, pair, residual.shapes]),
            np.repeat([1.0, -1.0, 1.0], [count, count, len(residual.rates)]),
            phi[free],
            residual.compliance,
            modal.port_names,
            modal.error,
            modal.origin,
            modal.valid_for,
        )

    def _values(self, t: Array, i: int, j: int, integrated: bool) -> Array:
        pairs = 2 * self.shapes[:, i] * self.shapes[:, j]
        decays = self.signs * self.real_shapes[:, i] * self.real_shapes[:, j]
        free = float(self.rigid[:, i] @ self.rigid[:, j])
        x, y = np.outer(t, self.poles), np.outer(t, -self.rates)
        if integrated:
            each = (oscillator.expm1_over(x) @ pairs).real + oscillator.expm1_over(y) @ decays
            return np.asarray(each * t + free * t**2 / 2)
        return np.asarray((np.exp(x) @ pairs).real + np.exp(y) @ decays + free * t)

    def _compliance(self, i: int, j: int) -> float:
        return float(self.compliance[i, j])

    @property
    def pole_sum(self) -> PoleGreens:
        return self

    def transfer(self, s: ComplexArray) -> ComplexArray:
        """Return the sum (n, p, p) of residues over distances from the poles, b b'/s^2 and c [m/N]."""
        column = s[:, None]
        parts = (
            (1 / (column - self.poles), self.shapes),
            (1 / (column - self.poles.conj()), self.shapes.conj()),
            (self.signs / (column + self.rates), self.real_shapes),
        )
        sums = [np.einsum("nk,ki,kj->nij", f, x, x, optimize=True) for f, x in parts]
        rigid = (self.rigid.T @ self.rigid) / (s**2)[:, None, None]
        return np.asarray(sum(sums) + rigid + self.compliance, dtype=complex)

    def above(self, omega: float) -> PoleGreens:
        """Return only the oscillations above ``omega`` [rad/s]."""
        high = self.poles.imag > omega
        return PoleGreens(self.poles[high], self.shapes[high], port_names=self.port_names)

    def stored(self) -> base.Stored:
        names = ("poles", "shapes", "rates", "real_shapes", "signs", "rigid", "compliance")
        return base.Stored("poles", arrays={name: getattr(self, name) for name in names})

    def static_compliance(self) -> Array:
        free = self.rates == 0
        rates = np.where(free, 1.0, self.rates)
        pairs = -2 * np.einsum("ki,kj,k->ij", self.shapes, self.shapes, 1 / self.poles).real
        real = np.einsum("m,mi,mj->ij", np.where(free, 0.0, self.signs / rates), self.real_shapes, self.real_shapes)
        return np.asarray(pairs + real + self.compliance + endless(self.rigid) + endless(self.real_shapes[free]))

    def initial_value(self) -> Array:
        pairs = 2 * np.einsum("ki,kj->ij", self.shapes, self.shapes).real
        real = np.einsum("m,mi,mj->ij", self.signs, self.real_shapes, self.real_shapes)
        return np.asarray(pairs + real + np.where(self.compliance != 0, np.inf, 0.0))

    def step_kernel(self, dt: float, n_steps: int) -> base.StepKernel:
        count = len(self.poles) + len(self.rates)
        return base.StepKernel(None, self.step_weights(dt, n_steps), f"convolution of {count} poles, {n_steps} weights")

    def step_weights(self, dt: float, n_steps: int) -> Array:
        """Return W_m = 2 Re sum_k r_ki r_kj exp(s_k m dt) (exp(s_k dt) - 1)/s_k + ... (p, p, n) [m/N].

        exp(s (a J + b) dt) = exp(s a J dt) exp(s b dt), J = sqrt(n): one product of an (n/J, 2K) and a (2K, J) matrix
        for each pair of ports; no array is larger than these or the result.
        """
        p, inner = len(self.port_names), max(1, math.isqrt(n_steps))
        outer = -(-n_steps // inner)
        rates = np.concatenate([self.poles, -self.rates.astype(complex)])
        shapes = np.concatenate([self.shapes, self.real_shapes * np.sqrt(self.signs.astype(complex))[:, None]])
        twice = np.repeat([2.0, 1.0], [len(self.poles), len(self.rates)])
        out = np.zeros((p, p, outer * inner))
        for start in range(0, len(rates), _BLOCK):
            s, r = rates[start : start + _BLOCK], shapes[start : start + _BLOCK]
            gain = twice[start : start + _BLOCK] * dt * oscillator.expm1_over(s * dt)
            coarse = np.exp(np.outer(inner * dt * np.arange(outer), s))
            fine = np.exp(np.outer(s, dt * np.arange(inner)))
            for i in range(p):
                for j in range(i + 1):
                    factors = coarse * (gain * r[:, i] * r[:, j])
                    out[i, j] += (factors.real @ fine.real - factors.imag @ fine.imag).ravel()
        out = out[:, :, :n_steps]
        free = self.rigid.T @ self.rigid
        out += free[:, :, None] * dt**2 * (np.arange(n_steps) + 0.5)
        out[:, :, 0] += self.compliance
        rows, columns = np.tril_indices(p, -1)
        out[columns, rows] = out[rows, columns]
        return np.ascontiguousarray(out)

    def _filtered(self, t: Array, width: float, rows: list[int], columns: list[int]) -> Array:
        free = np.zeros(len(self.rigid))
        parts = (
            (2 * self.shapes, self.shapes, oscillator.exponentials(self.poles, t, width)),
            (
                self.real_shapes * self.signs[:, None],
                self.real_shapes,
                oscillator.decay_responses(self.rates, t, width),
            ),
            (self.rigid, self.rigid, oscillator.mode_responses(free, free, t, width)),
        )
        sums = [
            np.einsum("ki,kj,kt->ijt", row_shapes[:, rows], column_shapes[:, columns], each, optimize=True).real
            for row_shapes, column_shapes, each in parts
        ]
        return np.asarray(sum(sums) + self.compliance[np.ix_(rows, columns)][:, :, None] * oscillator.hann(t, width))


def _check(g: PoleGreens) -> None:
    p, k, m = len(g.port_names), g.poles.size, g.rates.size
    expected = {"poles": (k,), "shapes": (k, p), "rates": (m,), "real_shapes": (m, p), "signs": (m,)}
    expected |= {"rigid": (len(g.rigid), p), "compliance": (p, p)}
    wrong = [
        f"{name} {getattr(g, name).shape}, not {shape}"
        for name, shape in expected.items()
        if getattr(g, name).shape != shape
    ]
    if wrong:
        raise base.GreensFunctionError(f"shapes must match {p} ports: {'; '.join(wrong)}")
    for name in expected:
        if bad := int(np.sum(~np.isfinite(getattr(g, name)))):
            raise base.GreensFunctionError(f"{name} must be finite, {bad} values are not")
    if k and g.poles.imag.min() <= 0:
        raise base.GreensFunctionError(
            f"a pole has Im s = {g.poles.imag.min():g} 1/s: give one of each conjugate pair, that with Im s > 0, and "
            "real poles as rates"
        )
    growth = max(g.poles.real.max(initial=-np.inf), (-g.rates).max(initial=-np.inf))
    if growth > 0:
        raise base.GreensFunctionError(
            f"a pole grows as exp({growth:g} t): a body gains no energy; Re s <= 0 is needed"
        )
    if np.any(np.abs(g.signs) != 1) or np.any(g.signs[g.rates == 0] < 0):
        raise base.GreensFunctionError(f"signs must be +1 or -1, and +1 at rate 0; smallest {g.signs.min():g}")
    base.check_valid_for(g.valid_for)
    object.__setattr__(g, "compliance", Residual.spring(g.compliance).compliance)


def receptance(
    greens: base.GreensFunction, frequency: ArrayLike, i: int | slice = ALL, j: int | slice = ALL
) -> ComplexArray:
    """Return H_ij(f) = displacement of port i per unit harmonic force on port j [m/N], at ``frequency`` (...,) > 0
    [Hz].

    The shape is (..., p, p): frequency, response, reference, as in pyFBS and other programs of substructuring; (...,)
    if ``i`` and ``j`` are given. For oscillators and relaxations

        H = sum_k phi_ki phi_kj/(w_k^2 - w^2 + 2 i zeta_k w_k w) + sum_r a_ri a_rj/(rate_r + i w) + c_ij,  w = 2 pi f,

    the Fourier transform, with exp(i w t), of `impulse_response` (Ewins, Modal Testing, 2000). Its inverse is
    `impact.FrequencyResponse` with `impact.fit_poles`.

    Raises:
        GreensFunctionError: a representation whose transform is not known in closed form.
    """
    f = np.asarray(frequency, dtype=float)
    s = np.asarray(2j * np.pi * np.ravel(f))
    modes = 0 if greens.modal is None else greens.modal.omega.size
    rows = max(1, _VALUES // max(1, modes))  # blocks limit the memory
    blocks = [greens.transfer(s[start : start + rows])[:, i, j] for start in range(0, s.size, rows)]
    none = np.zeros((0, len(greens.ports), len(greens.ports)), dtype=complex)[:, i, j]
    return np.concatenate([*blocks, none]).reshape((*f.shape, *none.shape[1:]))


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B F, u = C x + D F, with g(t) = C exp(A t) B + D delta(t); F [N] and u [m] at the ports.

    Attributes:
        A, B, C, D: matrices (s, s), (s, p), (p, s) and (p, p); D is the bare compliance [m/N].
        states: meaning and unit of each state (s,), in words.
        ports: p names.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    ports: tuple[str, ...]

    __repr__ = brief


def state_space(greens: base.GreensFunction) -> StateSpace:
    """Return the exact state space of a function of oscillators, relaxations, complex poles and rigid motions.

    Modal: the states are q_k and q_k' of q'' + 2 zeta w q' + w^2 q = phi' F, then z_r of z' = -rate z + a' F. Complex
    poles s = -d + i w with shapes r: blocks [[-d, -w], [w, -d]] with inputs (Re r, Im r), outputs 2 (Re r, -Im r).

    Raises:
        GreensFunctionError: a function that is no finite sum of poles, such as a rod with travelling waves.
    """
    if (modal := greens.modal) is not None:
        return _realize_modes(modal)
    if (poles := greens.pole_sum) is not None:
        return _realize_poles(poles)
    raise base.GreensFunctionError(
        f"{greens}: is no finite sum of poles, and has no state space; fit poles to it first"
    )


def _realize_modes(greens: ModalGreens) -> StateSpace:
    residual, m = greens.residual, len(greens.omega)
    zero = np.zeros((m, m))
    damping = np.diag(2 * greens.zeta * greens.omega)
    A = scipy.linalg.block_diag(
        np.block([[zero, np.eye(m)], [-np.diag(greens.omega**2), -damping]]), -np.diag(residual.rates)
    )
    still = np.zeros_like(greens.shapes)
    B, C = np.vstack([still, greens.shapes, residual.shapes]), np.vstack([greens.shapes, still, residual.shapes]).T
    names = [f"q_{k} [m sqrt(kg)]" for k in range(m)] + [f"dq_{k}/dt [m sqrt(kg)/s]" for k in range(m)]
    names += [f"z_{r} [sqrt(m N s)]" for r in range(len(residual.rates))]
    return StateSpace(A, B, C, residual.compliance, tuple(names), greens.ports)


def _realize_poles(greens: PoleGreens) -> StateSpace:
    blocks = [np.array([[s.real, -s.imag], [s.imag, s.real]]) for s in greens.poles]
    pairs = [np.array([r.real, r.imag]) for r in greens.shapes]
    outputs = [2 * np.array([r.real, -r.imag]) for r in greens.shapes]
    doubles = [np.array([[0.0, 1.0], [0.0, 0.0]]) for _ in greens.rigid]
    still = np.zeros(len(greens.ports))
    A = scipy.linalg.block_diag(*blocks, -np.diag(greens.rates), *doubles)
    B = np.vstack([*pairs, greens.real_shapes, *(row for b in greens.rigid for row in (still, b))])
    C = np.vstack(
        [*outputs, greens.signs[:, None] * greens.real_shapes, *(row for b in greens.rigid for row in (b, still))]
    )
    names = [f"{part} x_{k} [sqrt(m N s)]" for k in range(len(blocks)) for part in ("Re", "Im")]
    names += [f"z_{r} [sqrt(m N s)]" for r in range(len(greens.rates))]
    names += [name for n in range(len(doubles)) for name in (f"q_{n} [m sqrt(kg)]", f"dq_{n}/dt [m sqrt(kg)/s]")]
    return StateSpace(A, B, C.T, greens.compliance, tuple(names), greens.ports)
