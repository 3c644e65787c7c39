"""Green's function as a sum over poles: modes coupled by damping, or a fitted measurement."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from impact.greens import answers, base, oscillator
from impact.greens.modal import ModalGreens, Residual, endless

_BLOCK = 4096  # number of poles evaluated at once


@dataclass(frozen=True)
class PoleGreens(base.PoleSums):
    """Symmetric sum of simple poles, of rigid-body motions and of a bare compliance:

        g_ij(t) = 2 Re sum_k r_ki r_kj exp(s_k t) + sum_m sign_m a_mi a_mj exp(-rate_m t)
                  + sum_n b_ni b_nj t + c_ij delta(t)

    With M u'' + C u' + K u = B f and (s^2 M + s C + K) x = 0, x normalised by x'(2 s M + C) x = 1, r = B'x. Unlike
    `ModalGreens` it need not be passive: see `measured.pole_passivity`. It is convolved by step weights; its energy in
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

    poles: answers.ComplexArray
    shapes: answers.ComplexArray
    rates: answers.Array = field(default_factory=lambda: np.zeros((0, 0)))
    real_shapes: answers.Array = field(default_factory=lambda: np.zeros((0, 0)))
    signs: answers.Array = field(default_factory=lambda: np.zeros((0, 0)))
    rigid: answers.Array = field(default_factory=lambda: np.zeros((0, 0)))
    compliance: answers.Array = field(default_factory=lambda: np.zeros((0, 0)))
    port_names: tuple[str, ...] = ("contact",)
    error: answers.ErrorEstimate = field(default_factory=answers.ErrorEstimate)
    origin: Mapping[str, object] = field(default_factory=dict)
    valid_for: float = math.inf

    __repr__ = base.PoleSums.__str__

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

    def inverse_mass(self) -> answers.Array:
        return np.asarray(self.rigid.T @ self.rigid)

    def scaled(self, factor: float) -> PoleGreens:
        root = math.sqrt(answers.check_factor(factor))
        return replace(
            self,
            shapes=root * self.shapes,
            real_shapes=root * self.real_shapes,
            rigid=root * self.rigid,
            compliance=factor * self.compliance,
        )

    def _in_words(self) -> tuple[str, ...]:
        counts = {"rigid bodies": len(self.rigid), "real poles": self.rates.size}
        return self._terms(counts, "pole pairs", self.frequencies_hz, self.damping_ratios, self.compliance)

    def combined(self, weights: answers.Array, port_names: tuple[str, ...]) -> PoleGreens:
        shapes = {name: getattr(self, name) @ weights for name in ("shapes", "real_shapes", "rigid")}
        return replace(self, compliance=weights.T @ self.compliance @ weights, port_names=port_names, **shapes)

    @property
    def frequencies_hz(self) -> answers.Array:
        """Return |s_k|/(2 pi) (K,) [Hz]: undamped natural frequencies if the modes are uncoupled."""
        return np.asarray(np.abs(self.poles) / (2 * np.pi))

    @property
    def damping_ratios(self) -> answers.Array:
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
            raise answers.GreensFunctionError("a mode with zeta = 1 is a double pole: change its zeta by 1e-6")
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

    def _values(self, t: answers.Array, i: int, j: int, integrated: bool) -> answers.Array:
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

    def transfer(self, s: answers.ComplexArray) -> answers.ComplexArray:
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

    def stored(self) -> answers.Stored:
        names = ("poles", "shapes", "rates", "real_shapes", "signs", "rigid", "compliance")
        return answers.Stored("poles", arrays={name: getattr(self, name) for name in names})

    def static_compliance(self) -> answers.Array:
        free = self.rates == 0
        rates = np.where(free, 1.0, self.rates)
        pairs = -2 * np.einsum("ki,kj,k->ij", self.shapes, self.shapes, 1 / self.poles).real
        real = np.einsum("m,mi,mj->ij", np.where(free, 0.0, self.signs / rates), self.real_shapes, self.real_shapes)
        return np.asarray(pairs + real + self.compliance + endless(self.rigid) + endless(self.real_shapes[free]))

    def initial_value(self) -> answers.Array:
        pairs = 2 * np.einsum("ki,kj->ij", self.shapes, self.shapes).real
        real = np.einsum("m,mi,mj->ij", self.signs, self.real_shapes, self.real_shapes)
        return np.asarray(pairs + real + np.where(self.compliance != 0, np.inf, 0.0))

    def step_kernel(self, dt: float, n_steps: int) -> answers.StepKernel:
        count = len(self.poles) + len(self.rates)
        return answers.StepKernel(
            None, self.step_weights(dt, n_steps), f"convolution of {count} poles, {n_steps} weights"
        )

    def step_weights(self, dt: float, n_steps: int) -> answers.Array:
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

    def _filtered(self, t: answers.Array, width: float, rows: list[int], columns: list[int]) -> answers.Array:
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
        raise answers.GreensFunctionError(f"shapes must match {p} ports: {'; '.join(wrong)}")
    for name in expected:
        if bad := int(np.sum(~np.isfinite(getattr(g, name)))):
            raise answers.GreensFunctionError(f"{name} must be finite, {bad} values are not")
    if k and g.poles.imag.min() <= 0:
        raise answers.GreensFunctionError(
            f"a pole has Im s = {g.poles.imag.min():g} 1/s: give one of each conjugate pair, that with Im s > 0, and "
            "real poles as rates"
        )
    growth = max(g.poles.real.max(initial=-np.inf), (-g.rates).max(initial=-np.inf))
    if growth > 0:
        raise answers.GreensFunctionError(
            f"a pole grows as exp({growth:g} t): a body gains no energy; Re s <= 0 is needed"
        )
    if np.any(np.abs(g.signs) != 1) or np.any(g.signs[g.rates == 0] < 0):
        raise answers.GreensFunctionError(f"signs must be +1 or -1, and +1 at rate 0; smallest {g.signs.min():g}")
    answers.check_valid_for(g.valid_for)
    object.__setattr__(g, "compliance", Residual.spring(g.compliance).compliance)
