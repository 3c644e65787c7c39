"""The nearest passive Green's function to a measured one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from impact.greens.base import Array, GreensFunctionError
from impact.greens.sampled import SampledGreens
from impact.measured.passivity import TOLERANCE, eigenvalues, grid_size, passivity, positive_part, work_spectrum

_ITERATIONS = 2000
_ACCURACY = 1e-3  # of the peak: what the iteration may leave to the lift
_MARGIN = 1.000001  # for round-off
_FREEDOM = 100.0  # 1/weight of a change beyond the record, where nothing is known, against one within
_ROUNDS = 8  # of making the continuation found the one to be near to


def repair(greens: SampledGreens, dt: float | None = None) -> SampledGreens:
    """Return the nearest samples from which no force can draw work; ``greens`` itself if it is passive.

    Minimises sum_ij,k (g'_ij - g_ij)^2 at the sample times under Re[(1 - z) W(z)] >= 0 on |z| = 1, W the step weights
    of g' at its own step (`impact.measured.passivity.passivity`). The dual of this quadratic programme is solved by an
    accelerated projected gradient; the small violation it leaves is lifted by the least multiple of a falling ramp:
    any g that never rises and ends at zero is passive, for

        Re[(1 - z) W(z)] of it = sum_m |D_m| (1 - cos m theta) >= 0.

    The record may have been cut off, so it is continued to four to eight times its length, where a change costs next to
    nothing (proximal iteration). Under tail "zero" and "hold" the continuation is part of the result, passive for
    runs of up to four records; under "forbid" it is not, and the result is passive up to its end. A grid of points z
    is enough for that: the work form of n steps is a part of the circulant matrix whose eigenvalues stand on the grid.
    All this for steps of ``dt`` and whole multiples; ask `passivity` about others: linear interpolation within the
    spacing is not passive in general.

    Args:
        greens: tail "zero", "hold" or "forbid".
        dt: step of the run [s], if it is to be other than ``greens.dt`` or a multiple: g is sampled anew at it.

    Returns:
        Samples with ``origin["repair"]``: the report before, what was added, and the largest change over the largest
        |g|, also in ``error.reduction`` if none is known.

    Raises:
        GreensFunctionError: tail "rigid": take the rigid-body part t/M off first, it is passive by itself.

    Sources: Beck and Teboulle, SIAM J. Imaging Sci. 2 (2009) 183 (the iteration); Grivet-Talocia and Gustavsen, Passive
    Macromodeling (2016), ch. 10 (least perturbation).
    """
    if greens.tail == "rigid":
        raise GreensFunctionError(
            'tail "rigid" cannot be repaired: subtract t/M from the samples, repair the rest under tail "hold" or '
            '"zero", and add both by impact.SumGreens'
        )
    start, ratio = greens, 1.0 if dt is None else dt / greens.dt
    if dt is not None and not (round(ratio) >= 1 and abs(ratio - round(ratio)) < 1e-9 * ratio):
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
        x, more = _nearest(form, np.concatenate([samples, x[:, :, n:]], axis=2))
        iterations += more
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
    """The linear map from samples x (p, p, n), zero afterwards, to the spectrum of the work form over dt.

    Attributes:
        freedom: (n,) 1/weight of each sample; 0 is fixed.
        held: (p, p) value that g keeps beside x for ever; raises the whole spectrum by as much.
        size: of the grid on the full circle.
    """

    freedom: Array
    held: Array
    size: int

    @cached_property
    def scale(self) -> Array:
        """Return |1 - z|, (k, 1, 1): ``apply`` over it has a norm <= 1, for Re[(1 - z)/|1 - z| W(z)] has."""
        return np.asarray(2 * np.sin(np.pi * np.arange(self.size // 2 + 1) / self.size))[:, None, None]

    @cached_property
    def falling(self) -> Array:
        """Return a passive g from 1 to 0 at every port."""
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
    """Return the form, and the samples it works on: continued by zeros, less the value they hold at the end."""
    values, n = greens.values, greens.values.shape[2]
    size = grid_size(2 * n)
    beyond = size // 2 - n
    # a body held on the move towards the force would give work without end
    held = positive_part(values[None, :, :, -1])[0] if greens.tail == "hold" else np.zeros(values.shape[:2])
    freedom = np.repeat([1.0, _FREEDOM], [n, beyond])
    freedom[-1] = 0.0 if greens.tail == "hold" else _FREEDOM
    return _WorkForm(freedom, held, size), np.pad(values - held[:, :, None], ((0, 0), (0, 0), (0, beyond)))


def _nearest(form: _WorkForm, x: Array) -> tuple[Array, int]:
    """Return samples nearest to ``x`` with a spectrum positive but for a small lift, and the iterations it took."""
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
            inertia = 1.0  # restart: the momentum points uphill
        following = (1 + np.sqrt(1 + 4 * inertia**2)) / 2
        momentum = new + (inertia - 1) / following * (new - multipliers)
        multipliers, inertia = new, following
    return nearest, rounds
