"""Passivity: whether a body can return more work than it received, as samples or as a sum of poles; the nearest passive
samples of a response; advice on runs with samples."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from impact.greens.base import Array, GreensFunction, GreensFunctionError, is_greens, step_weights
from impact.greens.poles import PoleGreens
from impact.greens.sampled import SampledGreens
from impact.notices import Advice

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
    of g' at its own step (`impact.passivity`). The dual of this quadratic programme is solved by an
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


UNRESOLVED_LIMIT = 0.01  # fraction of the power above the run's Nyquist frequency beyond which there is advice
REST_LIMIT = 0.05  # ratio of a record's end to its largest value beyond which there is advice, for tail 'zero'
_CHECKED_STEPS = 8192  # most steps whose passivity is checked


def sampling_advice(greens: GreensFunction, dt: float, n: int, *, body: str = "target") -> tuple[Advice, ...]:
    """Return advice for a run of ``n`` steps of ``dt`` [s] with a sampled body (or the sampled parts of a sum).

    Advice is given if the fraction of the power |g^(f)|^2 of the samples above 1/(2 dt) is large, if the step weights
    are not passive (in the first 8192 steps), and if a record that is set to zero at its end is not at rest there.
    """
    return tuple(advice for part in greens.sampled_parts for advice in _advice_on(part, dt, n, body))


def _advice_on(greens: SampledGreens, dt: float, n: int, body: str) -> Iterator[Advice]:
    power = np.sum(np.abs(np.fft.rfft(greens.values, axis=2)) ** 2, axis=(0, 1))
    above = np.fft.rfftfreq(greens.values.shape[2], greens.dt) > 0.5 / dt * (1 + 1e-9)
    share = float(power[above].sum() / max(power.sum(), 1e-300))
    if share > UNRESOLVED_LIMIT:
        yield Advice(
            f"share of the sampled {body}'s response above half the step rate",
            share,
            UNRESOLVED_LIMIT,
            f"the samples reach {0.5 / greens.dt:.3g} Hz, steps of {dt:.3g} s only {0.5 / dt:.3g} Hz",
            f"use dt <= {greens.dt:.3g} s",
        )
    size = np.abs(greens.values).max(axis=(0, 1))
    level = float(size[-max(len(size) // 10, 1) :].max() / max(size.max(), 1e-300))
    if greens.tail == "zero" and n * dt > greens.end * (1 + 1e-9) and level > REST_LIMIT:
        yield Advice(
            f"last tenth of the sampled {body}'s record over its largest value",
            level,
            REST_LIMIT,
            f"the tail rule 'zero' cuts a motion that goes on at {greens.end:.3g} s",
            "measure or compute longer, until it has come to rest",
        )
    report = passivity(greens, dt, min(n, _CHECKED_STEPS))
    if not report.passive:
        yield Advice(
            f"least work of the sampled {body} over the largest",
            report.smallest / report.largest,
            -report.tolerance / report.largest,
            f"contact can draw energy from it, most near {report.frequency:.3g} Hz",
            "use impact.repair(greens, dt), and a step that is a whole multiple of the samples' spacing",
        )


POLE_TOLERANCE = 1e-9  # largest negative eigenvalue that counts as round-off, over the sum of the sizes of the terms
_AROUND = np.concatenate([-np.geomspace(30, 0.03, 10), [0.0], np.geomspace(0.03, 30, 10)])  # in half widths from a pole
_CHUNK = 2_000_000  # number of values evaluated at once


@dataclass(frozen=True)
class PolePassivity:
    """Frequency at which the real part of a body's mobility is smallest.

    Attributes:
        margin: smallest eigenvalue of Re[iw G(iw)] over the sum of the sizes of its terms at that frequency, least over
            w, -1 ... 1; < 0 is an energy gain.
        frequency: the frequency [Hz].
        tolerance: the body counts as passive if ``margin`` >= -``tolerance``.
    """

    margin: float
    frequency: float
    tolerance: float = POLE_TOLERANCE

    @property
    def passive(self) -> bool:
        """Return whether the body is passive within the tolerance."""
        return self.margin >= -self.tolerance

    def __str__(self) -> str:
        verdict = "passive" if self.passive else "not passive"
        return f"{verdict}: margin {self.margin:.3g} at {self.frequency:.4g} Hz (limit {-self.tolerance:.1g})"


def pole_passivity(greens: PoleGreens, *, tolerance: float = POLE_TOLERANCE) -> PolePassivity:
    """Report whether any force history can draw energy from the body.

    A force N does the work integral of N u' = (1/pi) integral over w > 0 of N^ Re[iw G(iw)] N: never negative if and
    only if Re[iw G(iw)] (symmetric, p x p) is positive semidefinite at all w, including its limits at 0 and infinity. A
    pole on the imaginary axis also needs r r' = -i times a positive matrix.

    The terms are summed in a form free of cancellation (`real_mobility`); frequencies are refined around each pole, and
    around the least values by two rounds of subdivision. A violation narrower than that grid is not detected.

    ``tolerance``: relative tolerance of the margin. Source: Anderson and Vongpanitlerd, Network Analysis and Synthesis
    (1973), ch. 2.
    """
    w = passivity_grid(greens)
    margins = passivity_margins(greens, w)
    for _ in range(2):  # neighbourhood of the eight least values
        least = np.argsort(margins)[:8]
        fine = [np.linspace(w[max(k - 1, 0)], w[min(k + 1, len(w) - 1)], 33)[1:-1] for k in least]
        w = np.concatenate([w, *fine])
        margins = np.concatenate([margins, passivity_margins(greens, np.concatenate(fine))])
        order = np.argsort(w)
        w, margins = w[order], margins[order]
    worst = int(np.argmin(margins))
    margin, frequency = float(margins[worst]), float(w[worst])
    for k in np.flatnonzero(greens.poles.real == 0):
        r = greens.shapes[k]
        size = float(np.sum(np.abs(r) ** 2))
        turned = 1j * np.outer(r, r)  # must be real and positive
        worst_turn = float(np.linalg.eigvalsh(turned.real)[0] - np.abs(turned.imag).max())
        if size and worst_turn / size < min(margin, -tolerance):
            margin, frequency = worst_turn / size, float(greens.poles[k].imag)
    return PolePassivity(margin, frequency / (2 * np.pi), tolerance)


def real_mobility(greens: PoleGreens, omega: Array) -> tuple[Array, Array]:
    """Return Re[iw G(iw)] (n, p, p), and the sum of the sizes (traces) of its terms (n,) [m/(N s)].

    A pair R = r r' at s gives w^2 (2 sigma B - A (|s|^2 - w^2))/((|s|^2 - w^2)^2 + 4 w^2 sigma^2), sigma = -Re s, A = 2
    Re R, B = -2 Re(R s*); a real pole sign a a' w^2/(w^2 + rate^2); rigid bodies and compliance contribute nothing.
    """
    n, p = len(omega), len(greens.port_names)
    total, size = np.zeros((n, p, p)), np.zeros(n)
    residues = np.einsum("ki,kj->kij", greens.shapes, greens.shapes)
    a, b = 2 * residues.real, -2 * (residues * greens.poles.conj()[:, None, None]).real
    sigma, square = -greens.poles.real, np.abs(greens.poles) ** 2
    real = greens.signs[:, None, None] * np.einsum("mi,mj->mij", greens.real_shapes, greens.real_shapes)
    chunk = max(1, _CHUNK // max(1, len(sigma) + len(real)))
    sizes = [np.abs(np.einsum("kii->ki", x)).sum(axis=1) for x in (a, b, real)]
    for start in range(0, n, chunk):
        w2 = omega[start : start + chunk, None] ** 2
        away = square - w2
        below = away**2 + 4 * w2 * sigma**2
        below = np.where(below == 0, np.inf, below)  # on an undamped pole
        weight_b, weight_a = 2 * w2 * sigma / below, -w2 * away / below
        weight_r = w2 / np.where((w2 == 0) & (greens.rates == 0), 1.0, w2 + greens.rates**2)
        terms = ((weight_b, b), (weight_a, a), (weight_r, real))
        total[start : start + chunk] = sum(np.tensordot(weight, x, axes=1) for weight, x in terms)
        size[start : start + chunk] = sum(
            np.abs(weight) @ x for (weight, _), x in zip(terms, (sizes[1], sizes[0], sizes[2]), strict=True)
        )
    return total, size


def passivity_margins(greens: PoleGreens, omega: Array) -> Array:
    """Return the smallest eigenvalue (n,) of Re[iw G(iw)] over the sum of the sizes of its terms."""
    total, size = real_mobility(greens, omega)
    least = total[:, 0, 0] if total.shape[1] == 1 else np.linalg.eigvalsh(total)[:, 0]
    return np.asarray(least / np.where(size > 0, size, 1.0))


def passivity_grid(greens: PoleGreens) -> Array:
    """Return angular frequencies around each pole in multiples of its half width, around each real pole in octaves, and
    far below and above all."""
    s, width = greens.poles, np.maximum(-greens.poles.real, 1e-6 * np.abs(greens.poles))
    near = (s.imag[:, None] + width[:, None] * _AROUND).ravel()
    rates = greens.rates[greens.rates > 0]
    octaves = (rates[:, None] * 2.0 ** np.arange(-4, 5)).ravel()
    scale = np.concatenate([np.abs(s), rates])
    if not scale.size:
        return np.ones(1)
    wide = np.geomspace(1e-4 * scale.min(), 1e4 * scale.max(), 600)
    w = np.unique(np.concatenate([near, octaves, wide]))
    return np.asarray(w[w > 0])
