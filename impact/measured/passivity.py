"""Passivity: whether a body can return more work than it received, and the nearest passive samples of a response."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from impact.greens.base import Array, GreensFunction, GreensFunctionError, is_greens, step_weights
from impact.greens.sampled import SampledGreens

TOLERANCE = 1e-9  # largest negative eigenvalue that counts as round-off, over the largest eigenvalue
_LANCZOS = 80


@dataclass(frozen=True)
class PassivityReport:
    """Largest energy gain by any force of ``steps`` steps on a body.

    Attributes:
        smallest: smallest eigenvalue of the work form [m/N]: work per (unit force)^2 and step; < 0 is a gain.
        frequency: frequency of the harmonic force with the least work [Hz].
        tolerance: the body counts as passive if ``smallest`` >= -``tolerance`` [m/N].
        largest: largest eigenvalue, the scale of ``tolerance`` [m/N].
        dt: step [s].
        steps: number of steps.
    """

    smallest: float
    frequency: float
    tolerance: float
    largest: float
    dt: float
    steps: int

    @property
    def passive(self) -> bool:
        """Return whether no force can draw work from the body."""
        return self.smallest >= -self.tolerance

    @property
    def gain_per_cycle(self) -> float:
        """Return the largest energy per cycle that a force as strong as a harmonic one of 1 N amplitude gains [J]; 0 if
        passive."""
        per_step = 0.5 * max(-self.smallest, 0.0)
        return 0.0 if self.passive else per_step * min(1 / (max(self.frequency, 1e-300) * self.dt), self.steps)

    def __str__(self) -> str:
        over = f"over {self.steps} steps of {self.dt:.4g} s"
        if self.passive:
            return f"passive {over}: least work {self.smallest:.3g} m/N (limit {-self.tolerance:.3g})"
        return (
            f"not passive {over}: a force of amplitude 1 N near {self.frequency:.4g} Hz gains {self.gain_per_cycle:.3g}"
            f" J per cycle (least work {self.smallest:.3g} m/N, limit {-self.tolerance:.3g})"
        )


def passivity(
    greens: GreensFunction | ArrayLike, dt: float, n: int = 0, *, tolerance: float = TOLERANCE
) -> PassivityReport:
    """Report whether a force of ``n`` steps of ``dt`` [s], constant over each, can draw work from the body.

    The force N_k of step k does the work N_k (u_{k+1} - u_k), u_{k+1} = sum_m W_m N_{k-m}. With z the delay by a step,
    (1 - z) W(z) maps the force to the displacement's increments, so the total work is the quadratic form of

        T = (L + L^T)/2,   L the lower triangular Toeplitz matrix of D_m = W_m - W_{m-1},   symbol Re[(1 - z) W(z)].

    No force of n steps gains energy if and only if T is positive semidefinite; for every n, if and only if the symbol
    is so on |z| = 1 (matrix-valued for several ports): the positive real lemma, for discrete work. A record truncated
    after n steps has a symbol with ripples below zero even if the body is passive, so T itself decides: the body is
    passive if the symbol is >= 0; otherwise the smaller of two upper bounds of T's smallest eigenvalue decides: the
    Fejer mean

        sum_m (1 - m/n) D_m cos(m theta) = (work of the force exp(i m theta), m < n) / n,

    on a grid of 4 n frequencies, and a Lanczos iteration started at its minimum. Both are the work of actual forces: a
    passive body is never refused.

    Args:
        greens: body, or its step weights (n,) or (p, p, n) [m/N].
        dt: step of the run [s].
        n: number of steps; 0, for weights and bodies with sampled parts alone: all known ones.
        tolerance: tolerance relative to the largest eigenvalue; the round-off of summed weights is added.

    Raises:
        GreensFunctionError: n missing or < 1, weights of a wrong shape or not finite.

    Source: Anderson and Vongpanitlerd, Network Analysis and Synthesis, ch. 2; Grenander and Szego, Toeplitz Forms.
    """
    increments = work_increments(greens, dt, n)
    n = increments.shape[2]
    symbol = work_spectrum(increments, grid_size(n))
    fejer = work_spectrum(increments * (1 - np.arange(n) / n), grid_size(n))
    mean = eigenvalues(fejer)
    largest = float(max(mean.max(), increments[:, :, 0].trace(), 1e-300))
    worst = int(np.argmin(mean[:, 0]))
    least = float(min(mean[worst, 0], largest))
    if eigenvalues(symbol).min() < -tolerance * largest:  # otherwise passive for any number of steps
        harmonic = np.linalg.eigh(fejer[worst])[1][:, 0]
        start = np.cos(np.pi * worst / (len(mean) - 1) * np.arange(n)) * harmonic[:, None]
        least = min(least, _smallest_ritz_value(symbol, start))
    frequency = worst / (len(mean) - 1) / (2 * dt)
    response = np.abs(increments.cumsum(axis=2).cumsum(axis=2)).max()  # each D_m is a second difference of it
    allowed = tolerance * largest + float(4 * np.finfo(float).eps * response * math.sqrt(n))
    return PassivityReport(least, frequency, allowed, largest, dt, n)


def require_passive(greens: GreensFunction, dt: float, n: int = 0, *, tolerance: float = TOLERANCE) -> None:
    """Raise an error if a contact of ``n`` steps of ``dt`` could draw energy; arguments as `passivity`.

    Raises:
        GreensFunctionError: not passive; the message states the gain, its frequency, and a remedy.
    """
    report = passivity(greens, dt, n, tolerance=tolerance)
    if not report.passive:
        raise GreensFunctionError(
            f"the Green's function is {report}; check its sign, its time zero and its noise, or mend it with "
            "impact.repair(greens, dt)"
        )


def work_increments(greens: GreensFunction | ArrayLike, dt: float, n: int = 0) -> Array:
    """Return D_m = W_m - W_{m-1} (p, p, n) [m/N]: increment of the displacement m steps after a unit force of one
    step."""
    if is_greens(greens):
        if not n:
            ends = [part.end for part in greens.sampled_parts]
            if not ends:
                raise GreensFunctionError("n is missing: give the steps over which the body shall be passive")
            n = max(math.floor(min(ends) / dt * (1 + 1e-9)), 1)
        weights = step_weights(greens, dt, n)
    else:
        weights = np.asarray(greens, dtype=float)
        weights = weights.reshape(1, 1, -1) if weights.ndim == 1 else weights
        if weights.ndim != 3 or weights.shape[0] != weights.shape[1] or not np.all(np.isfinite(weights)):
            raise GreensFunctionError(f"step weights must be finite, (n,) or (p, p, n), got {weights.shape}")
        weights = weights[:, :, : n or None]
    if weights.shape[2] < 1 or (n and n != weights.shape[2]):
        raise GreensFunctionError(
            f"n = {n} must be at least 1 and at most {weights.shape[2]}, the step weights that are known"
        )
    return np.asarray(np.diff(weights, axis=2, prepend=0.0))


def work_spectrum(increments: Array, size: int) -> Array:
    """Return Re sum_m D_m exp(-i m theta) (k, p, p) on theta = 0 ... pi; the grid is 4 to 8 times finer than 2 pi/n."""
    transformed = np.fft.rfft(increments, size, axis=2).real
    both = (transformed + transformed.transpose(1, 0, 2)) / 2
    return np.ascontiguousarray(both.transpose(2, 0, 1))


def grid_size(n: int) -> int:
    """Return the number of points on the full circle: a power of two, at least 4 n."""
    return int(4 << max(n - 1, 1).bit_length())


def eigenvalues(symbol: Array) -> Array:
    """Return the ascending eigenvalues (k, p) of symmetric matrices (k, p, p)."""
    return symbol[:, :, 0] if symbol.shape[1] == 1 else np.asarray(np.linalg.eigvalsh(symbol))


def positive_part(matrices: Array) -> Array:
    """Return the positive semidefinite part of symmetric matrices (..., p, p), negative eigenvalues set to zero."""
    if matrices.shape[-1] == 1:
        return np.maximum(matrices, 0.0)
    values, vectors = np.linalg.eigh(matrices)
    if np.all(values >= 0):
        return matrices
    return np.asarray(np.einsum("...ia,...a,...ja->...ij", vectors, np.maximum(values, 0.0), vectors))


def _smallest_ritz_value(symbol: Array, start: Array) -> float:
    """Return an upper bound of the smallest eigenvalue of the block Toeplitz form, which converges fast: by Lanczos
    from ``start`` (p, n)."""
    size, n = 2 * (len(symbol) - 1), start.shape[1]

    def apply(x: Array) -> Array:
        out = np.einsum("kij,jk->ik", symbol, np.fft.rfft(x, size, axis=1))
        return np.asarray(np.fft.irfft(out, size, axis=1)[:, :n])

    noise = np.random.default_rng(0).standard_normal(start.shape)
    vector = start / np.linalg.norm(start) + 1e-3 * noise / np.linalg.norm(noise)
    vector /= np.linalg.norm(vector)
    before, beta = np.zeros_like(vector), 0.0
    diagonal: list[float] = []
    off_diagonal: list[float] = []
    for _ in range(min(_LANCZOS, start.size)):
        image = apply(vector) - beta * before
        diagonal.append(float(np.sum(image * vector)))
        image -= diagonal[-1] * vector
        beta = float(np.linalg.norm(image))
        if beta <= 1e-13 * abs(symbol).max():
            break
        off_diagonal.append(beta)
        before, vector = vector, image / beta
    coupling = np.diag(off_diagonal[: len(diagonal) - 1], 1)
    return float(np.linalg.eigvalsh(np.diag(diagonal) + coupling + coupling.T)[0])


_ITERATIONS = 2000
_ACCURACY = 1e-3  # accuracy of the iteration, over the peak of g; the ramp removes the remaining violation
_MARGIN = 1.000001  # factor on the ramp, for round-off
_FREEDOM = 100.0  # weight of a change within the record over that of one beyond it, where nothing is known
_ROUNDS = 8  # rounds of the proximal iteration, each relative to the last continuation


def repair(greens: SampledGreens, dt: float = 0.0) -> SampledGreens:
    """Return the nearest samples from which no force can draw work; ``greens`` itself if it is passive.

    Minimises sum_ij,k (g'_ij - g_ij)^2 at the sample times under Re[(1 - z) W(z)] >= 0 on |z| = 1, W the step weights
    of g' at its own step (`impact.measured.passivity.passivity`). The dual of this quadratic programme is solved by an
    accelerated projected gradient; the remaining small violation is removed by the least multiple of a falling ramp,
    since any g that never rises and ends at zero is passive:

        Re[(1 - z) W(z)] of it = sum_m |D_m| (1 - cos m theta) >= 0.

    The record may be truncated, so it is continued to four to eight times its length, where a change has hardly any
    weight (proximal iteration). With tail "zero" and "hold" the continuation is part of the result, which is passive
    for runs of up to four times the record's length; with "forbid" it is not, and the result is passive up to its end.
    A grid of points z is enough: the work form of n steps is a part of the circulant matrix whose eigenvalues are on
    the grid. All this holds for steps of ``dt`` and whole multiples; `passivity` checks others, as linear interpolation
    between samples is not passive in general.

    Args:
        greens: samples with tail "zero", "hold" or "forbid".
        dt: step of the run [s], if it is not ``greens.dt`` or a multiple: g is resampled at it; 0: ``greens.dt``.

    Returns:
        Samples with ``origin["repair"]``: the report before, the multiple of the ramp, and the largest change over the
        largest |g|, also in ``error.reduction`` if none is known.

    Raises:
        GreensFunctionError: tail "rigid": subtract the rigid-body part t/M first, which is passive.

    Sources: Beck and Teboulle, SIAM J. Imaging Sci. 2 (2009) 183 (the iteration); Grivet-Talocia and Gustavsen, Passive
    Macromodeling (2016), ch. 10 (least perturbation).
    """
    if greens.tail == "rigid":
        raise GreensFunctionError(
            'tail "rigid" cannot be repaired: subtract t/M from the samples, repair the rest under tail "hold" or '
            '"zero", and add both by impact.SumGreens'
        )
    start, ratio = greens, (dt or greens.dt) / greens.dt
    if not (round(ratio) >= 1 and abs(ratio - round(ratio)) < 1e-9 * ratio):
        t, p = dt * np.arange(int(greens.end / dt * (1 + 1e-12)) + 1), range(len(greens.port_names))
        sampled = np.array([[greens.impulse_response(t, i, j) for j in p] for i in p])
        start = replace(greens, values=sampled, dt=dt)
    form, x = _posed(start)
    n = start.values.shape[2]
    before = passivity(start, start.dt, n - 1 if start.tail == "forbid" else 4 * n)
    if before.passive and (
        start.tail == "forbid" or eigenvalues(form.apply(x)).min() >= -TOLERANCE * before.largest / start.dt
    ):
        return start
    samples, iterations = x[:, :, :n], 0
    for _ in range(_ROUNDS):
        x, count = _nearest(form, np.concatenate([samples, x[:, :, n:]], axis=2))
        iterations += count
    lift = _MARGIN * form.missing(x)
    values = x + lift * form.falling + form.held[:, :, None]
    values = values[:, :, :n] if start.tail == "forbid" else values
    change = float(np.abs(values[:, :, :n] - start.values).max() / np.abs(start.values).max())
    record = {"before": str(before), "iterations": iterations, "relaxation_added": lift, "change_of_peak": change}
    origin = {**start.origin, "repair": record}
    error = start.error if start.error.reduction is not None else replace(start.error, reduction=change)
    return replace(start, values=values, origin=origin, error=error)


@dataclass(frozen=True)
class _WorkForm:
    """Linear map from samples x (p, p, n), followed by zeros, to the spectrum of the work form over dt.

    Attributes:
        freedom: 1/weight (n,) of each sample; 0 means fixed.
        held: constant value (p, p) that g has in addition to x; it raises the whole spectrum by as much.
        size: number of grid points on the full circle.
    """

    freedom: Array
    held: Array
    size: int

    @cached_property
    def scale(self) -> Array:
        """Return |1 - z| (k, 1, 1): ``apply`` divided by it has a norm <= 1, since Re[(1 - z)/|1 - z| W(z)] has."""
        return np.asarray(2 * np.sin(np.pi * np.arange(self.size // 2 + 1) / self.size))[:, None, None]

    @cached_property
    def falling(self) -> Array:
        """Return a passive g that falls from 1 to 0 at every port."""
        n = len(self.freedom)
        return np.asarray(np.eye(len(self.held))[:, :, None] * (1 - np.arange(n) / (n - 1)))

    def apply(self, x: Array) -> Array:
        """Return the spectrum (k, p, p)."""
        return _spectrum(x, self.size) + self.held

    @cached_property
    def _gain(self) -> Array:
        return _spectrum(self.falling[:1, :1], self.size)[1:, 0, 0]

    def missing(self, x: Array) -> float:
        """Return the least multiple of ``falling`` that makes the spectrum of ``x`` positive; at theta = 0 it is
        ``held``."""
        return max(float(np.max(-eigenvalues(self.apply(x))[1:, 0] / self._gain)), 0.0)

    def adjoint(self, spectrum: Array) -> Array:
        """Return the adjoint of `apply` without ``held``, in the mean over the circle."""
        increments = np.fft.irfft(spectrum.transpose(1, 2, 0), self.size, axis=2)[:, :, : len(self.freedom)]
        steps = -np.diff(increments, axis=2)
        x = np.zeros_like(increments)
        x[:, :, :-1] += steps / 2
        x[:, :, 1:] += steps / 2
        return x


def _spectrum(x: Array, size: int) -> Array:
    steps = np.zeros_like(x)
    steps[:, :, :-1] = (x[:, :, 1:] + x[:, :, :-1]) / 2
    return work_spectrum(np.diff(steps, axis=2, prepend=0.0), size)


def _posed(greens: SampledGreens) -> tuple[_WorkForm, Array]:
    """Return the form and its samples: continued by zeros, minus the constant value that they have at the end."""
    values, n = greens.values, greens.values.shape[2]
    size = grid_size(2 * n)
    padding = size // 2 - n
    # a constant final velocity towards the force would give unlimited work
    constant = positive_part(values[None, :, :, -1])[0] if greens.tail == "hold" else np.zeros(values.shape[:2])
    freedom = np.repeat([1.0, _FREEDOM], [n, padding])
    freedom[-1] = 0.0 if greens.tail == "hold" else _FREEDOM
    return _WorkForm(freedom, constant, size), np.pad(values - constant[:, :, None], ((0, 0), (0, 0), (0, padding)))


def _nearest(form: _WorkForm, x: Array) -> tuple[Array, int]:
    """Return the samples nearest to ``x`` whose spectrum is positive once a small multiple of ``falling`` is added, and
    the iterations."""
    inverse = np.append(0.0, 1 / form.scale[1:, 0, 0])[:, None, None]
    step, enough = 1 / form.freedom.max(), _ACCURACY * float(np.abs(x).max())
    multipliers = momentum = np.zeros_like(form.apply(x))
    inertia, rounds = 1.0, 0
    for _ in range(_ITERATIONS):
        rounds += 1
        nearest = x + form.adjoint(momentum * inverse) * form.freedom
        if form.missing(nearest) <= enough:
            break
        new = positive_part(momentum - step * inverse * form.apply(nearest))
        if np.sum((momentum - new) * (new - multipliers)) > 0:
            inertia = 1.0  # restart, as the momentum increases the objective
        following = (1 + np.sqrt(1 + 4 * inertia**2)) / 2
        momentum = new + (inertia - 1) / following * (new - multipliers)
        multipliers, inertia = new, following
    return nearest, rounds
