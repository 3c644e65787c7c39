"""Memory of the past inside the contact loop, and which engine keeps it: pole recursion, blocked FFT or direct sum.

Poles are advanced exactly for forces constant over a step. Step weights are summed directly inside a block, and past
blocks are folded in by FFT as soon as they are complete (relaxed convolution: Hairer, Lubich & Schlichte, SIAM J. Sci.
Stat. Comput. 6 (1985) 532), O(n log^2 n) in total.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from impact.greens import oscillator
from impact.greens.base import Array, StepKernel
from impact.greens.modal import ModalGreens
from impact.march.loop.forces import FLOOR
from impact.march.problem import ContactError
from impact.quantities import brief

BLOCK = 1024  # steps summed directly; 512 to 2048 are equally fast
FEWEST = 8  # fewest contacts at which poles with proportional shapes are merged
ALIKE, NEARLY = (
    64 * np.finfo(float).eps,
    1e-9,
)  # largest relative difference of proportional shapes, and of their ratios


@dataclass(frozen=True)
class Poles:
    """All poles of all bodies, seen from the contacts: gap_c = sum_k psi_ck q_k, q_k driven by f_k = sum_c psi_ck N_c.

    One step after the force f held during the last one, with p = a12 q' (which never divides by a12):

        q <- a11 q + p + c1 f,    p <- a12 a21 q + a22 p + c2 f.

    A relaxation is a pole with a11 = exp(-rate dt), a21 = a22 = 0 and p = 0.

    Attributes:
        steps: (5, K) rows a11, a12 a21, a22, c1, c2.
        psi: (p, K) shapes with the sign of the contact.
    """

    steps: Array
    psi: Array

    __repr__ = brief

    @staticmethod
    def from_modes(parts: list[tuple[ModalGreens, Array]], dt: float, contacts: int) -> Poles:
        """Return the poles of several bodies, each with its (ports, contacts) directions, without the poles that move
        no contact."""
        steps, psi = [np.zeros((5, 0))], [np.zeros((contacts, 0))]
        for greens, directions in parts:
            ((a11, a12), (a21, a22)), (b1, b2) = oscillator.transition(dt, greens.omega, greens.zeta)
            driven = (a11 * b1 + a12 * b2, a12 * (a21 * b1 + a22 * b2))
            rates = greens.residual.rates
            decay, gain, none = np.exp(-rates * dt), dt * oscillator.expm1_over(-rates * dt), np.zeros(len(rates))
            for rows, shapes in (
                (np.array([a11, a12 * a21, a22, *driven]), greens.shapes),
                (np.array([decay, none, none, decay * gain, none]), greens.residual.shapes),
            ):
                seen = (shapes @ directions).T
                kept = np.any(seen != 0, axis=0)
                steps.append(rows[:, kept])
                psi.append(seen[:, kept])
        return Poles(*(np.ascontiguousarray(np.concatenate(a, axis=1)) for a in (steps, psi)))

    def folded(self) -> Array:
        """Return for one contact the step rows with psi^2 in c1 and c2, so that the gap is a plain sum."""
        rows = self.steps.copy()
        rows[3:] *= self.psi[0] ** 2
        return rows

    def along(self) -> tuple[NDArray[np.int64], Array, Array]:
        """Return groups of poles with proportional shapes, such as those of one harmonic around a lip.

        (K,) group numbers g, (K,) sizes and (p, G) directions: psi_ck = size_k directions_cg to round-off; empty arrays
        if this saves nothing.
        """
        contacts, count = self.psi.shape
        none = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((contacts, 0))
        if contacts < FEWEST:
            return none
        places = np.arange(contacts) ** 2.0  # ratio of two functionals without symmetry: equal for proportional shapes
        with np.errstate(all="ignore"):
            ratio = (np.cos(1.7 * places) @ self.psi) / (np.cos(1.0 + places) @ self.psi)
        order = np.argsort(ratio, kind="stable")
        apart = ~(np.abs(np.diff(ratio[order])) <= NEARLY * np.abs(ratio[order[1:]]))
        if 2 * (1 + np.count_nonzero(apart)) > count:  # too many groups, as for a plate
            return none
        group, size, firsts = np.zeros(count, dtype=np.int64), np.ones(count), list[int]()
        for k in order:
            shape = self.psi[:, k]
            if firsts and abs(ratio[k] - ratio[firsts[-1]]) <= NEARLY * abs(ratio[k]):
                first = self.psi[:, firsts[-1]]
                size[k] = (first @ shape) / (first @ first)
                if np.abs(shape - size[k] * first).max() <= ALIKE * np.abs(shape).max():
                    group[k] = len(firsts) - 1
                    continue
            firsts.append(k)
            group[k], size[k] = len(firsts) - 1, 1.0
        if 2 * len(firsts) > count:
            return none
        return group, size, np.ascontiguousarray(self.psi[:, firsts])

    def weights(self, own: Array, n: int) -> Array:
        """Return the (p, p, n) step weights: W_0 = ``own`` (p, p), W_m = sum_k psi_ck psi_dk [1 0] A_k^(m-1) c_k.

        A^(i J + j) = (A^J)^i A^j makes each W a product of an (n/J, 2K) and a (2K, J) matrix: about 2J recursions
        and 4 n K operations at the speed of BLAS.
        """
        contacts, inner = len(self.psi), max(1, math.isqrt(n))
        a11, a21, a22, c1, c2 = self.steps
        columns = _powers(a11, a21, a22, c1, c2, inner)
        one, none = np.ones_like(a11), np.zeros_like(a11)
        first, second = (_powers(a11, a21, a22, *start, inner + 1)[-1] for start in ((one, none), (none, one)))
        rows = _powers(first[0], second[0], second[1], one, none, -(-n // inner), first[1])
        coarse, fine = rows.reshape(len(rows), -1), columns.reshape(inner, -1).T
        out = np.empty((contacts, contacts, n))
        for c in range(contacts):
            for d in range(c + 1):
                both = np.tile(self.psi[c] * self.psi[d], 2)
                out[c, d, 1:] = out[d, c, 1:] = ((coarse * both) @ fine).ravel()[: n - 1]
        out[:, :, 0] = own
        return out


def streams(rows: Array) -> tuple[tuple[Array, ...], tuple[Array, Array]]:
    """Return the (5, K) rows as five arrays and a zero state (q, p), laid out for the march.

    Each begins a cache line, and all lie 576 bytes apart modulo 4096: processors tell loads from earlier stores by the
    last 12 bits of the address, and two arrays that agree there cost up to three times the time.
    """
    count = rows.shape[1]
    stride = 72 + 512 * -(-max(count - 72, 0) // 512)
    room = aligned(7 * stride).reshape(7, stride)[:, :count]
    room[:5] = rows
    a11, a21, a22, c1, c2, q, p = room
    return (a11, a21, a22, c1, c2), (q, p)


def aligned(count: int) -> Array:
    """Return the (count,) zeros that begin a cache line."""
    raw = np.zeros(count + 8)
    first = -raw.ctypes.data // 8 % 8
    return raw[first : first + count]


def _powers(a: Array, c: Array, d: Array, q: Array, p: Array, count: int, b: Array | float = 1.0) -> Array:
    """Return (count, 2, K): the vectors x, A x, A^2 x, ... with A = [[a, b], [c, d]] and x = (q, p), pole by pole."""
    out = np.empty((count, 2, len(a)))
    for row in out:
        row[0], row[1] = q, p
        q, p = a * q + b * p + FLOOR, c * q + d * p + FLOOR
    return out


class BlockedSum:
    """The effect of finished blocks of force on later steps, folded in by FFT.

    ``weights``: (p, p, n) step weights; ``memory``: (p, n) displacement that finished blocks have added so far;
    ``recent``: (p, p, block) the first weights, last one first, for the sum inside a block.
    """

    def __init__(self, weights: Array, block: int) -> None:
        self.weights, self.block = weights, block
        self.memory: Array = np.zeros(weights.shape[1:])
        self.recent = np.ascontiguousarray(weights[:, :, :block][:, :, ::-1])
        self._spectra: dict[int, NDArray[np.complex128]] = {}

    def fold(self, force: Array, rest: Array, done: int) -> None:
        """Add the effect of block number ``done`` (1, 2, ...) of ``force`` (p, n), less the preload ``rest`` (p,).

        With k the largest power of two dividing ``done``, the last k blocks act on the next k blocks; over the run
        every pair of blocks is included once. The cyclic convolution of length 2k is exact in its second half.
        """
        size = (done & -done) * self.block
        end, n = done * self.block, self.memory.shape[1]
        if end >= n:
            return
        stop = min(end + size, n)
        past = np.fft.rfft(force[:, end - size : end] - rest[:, None], 2 * size)
        spectrum = self._spectra.get(size)
        if spectrum is None:
            spectrum = np.fft.rfft(self.weights[:, :, : 2 * size], 2 * size)
            if 4 * size <= n:  # this size is needed again
                self._spectra[size] = spectrum
        later = np.fft.irfft(np.einsum("cdf,df->cf", spectrum, past), 2 * size)
        self.memory[:, end:stop] += later[:, size : size + stop - end]


Engine = Literal["auto", "poles", "fft", "direct"]
MARGIN = 0.8  # predicted time with step weights, over that with poles, below which step weights replace poles


# Costs measured on one core of an AVX-512 server processor at 2.6 GHz [s]; the choice depends on their ratios only.
POLE, POLE_OF_CONTACT, WEIGHT = 0.33e-9, 0.2e-9, 0.08e-9
MULTIPLY, TRANSFORM, PRODUCT, CALL = 0.14e-9, 2.5e-9, 1.7e-9, 11e-6


def cost_of_poles(n: int, poles: int, contacts: int) -> float:
    """Return the time of n steps of K poles and p contacts, n K (POLE + (p - 1) POLE_OF_CONTACT) [s]."""
    return n * poles * (POLE + (contacts - 1) * POLE_OF_CONTACT)


def cost_of_weights(n: int, contacts: int, block: int) -> float:
    """Return the time of n step weights [s]: within a block p^2 n block/2 MULTIPLY; with several n/block CALL, and for
    each doubling of the block n/2 (p log2(2 length) TRANSFORM + p^2 PRODUCT)."""
    cost, size = contacts**2 * n * min(block, n) / 2 * MULTIPLY + n // block * CALL, block
    while size < n:
        cost += n / 2 * (contacts * math.log2(2 * size) * TRANSFORM + contacts**2 * PRODUCT)
        size *= 2
    return cost


@dataclass(frozen=True)
class Plan:
    """The history engine of each body, also in ``words``.

    ``by_poles``: for each body, whether its poles are advanced by recursion (else they become step weights); ``block``:
    steps summed directly before they are folded in by FFT, all steps for a direct sum; ``seconds``: predicted, on
    one core.
    """

    by_poles: tuple[bool, ...]
    block: int
    seconds: float
    words: str


def choose(
    kernels: Sequence[StepKernel],
    contacts: int,
    steps: int,
    engine: Engine = "auto",
    block: int = 0,
) -> Plan:
    """Return the fastest plan for the bodies' ``kernels`` (striker first), or that with all possible poles unless
    another takes less than `MARGIN` of its time; a ``block`` other than 0 is kept.

    Raises `ContactError`: unknown engine; "poles" where a body has none; a negative block.
    """
    if engine not in get_args(Engine):
        raise ContactError(f"engine {engine!r} is unknown; choose from {', '.join(get_args(Engine))}")
    if block < 0:
        raise ContactError(f"block = {block} must be at least one step, or 0 for that of the cost model")
    without = [kernel.engine for kernel in kernels if kernel.weights is not None]
    if engine == "poles" and without:
        raise ContactError(
            f"engine 'poles' is impossible: {without[0]} has step weights and no poles; use 'fft', 'direct' or 'auto'"
        )
    modal = [kernel.modal is not None and engine in ("auto", "poles") for kernel in kernels]
    candidates = [tuple(modal)]  # all bodies by poles, then without the largest one, without the two largest, ...
    for number in sorted(range(len(kernels)), key=lambda i: -_count(kernels[i])) if engine == "auto" else ():
        modal[number] = False
        candidates.append(tuple(modal))
    blocks: tuple[int, ...] = (min(block or BLOCK, steps),)
    if engine == "direct" or (not block and engine != "fft"):
        blocks = (steps,) if engine == "direct" else (min(BLOCK, steps), steps)
    plans = [
        _plan(kernels, each, contacts, steps, size, engine) for each in dict.fromkeys(candidates) for size in blocks
    ]
    best = min(plans, key=lambda plan: plan.seconds)
    first = min((plan for plan in plans if plan.by_poles == plans[0].by_poles), key=lambda plan: plan.seconds)
    return best if best.seconds < MARGIN * first.seconds else first


def _plan(
    kernels: Sequence[StepKernel], by_poles: tuple[bool, ...], contacts: int, steps: int, block: int, engine: Engine
) -> Plan:
    recursive = sum(_count(k) for k, poles in zip(kernels, by_poles, strict=True) if poles)
    converted = sum(_count(k) for k, poles in zip(kernels, by_poles, strict=True) if not poles)
    weights = converted > 0 or any(k.weights is not None for k in kernels)
    weights = weights or not all(poles or k.modal is None for k, poles in zip(kernels, by_poles, strict=True))
    seconds = cost_of_poles(steps, recursive, contacts) + steps * converted * contacts * (contacts + 1) / 2 * WEIGHT
    if weights:
        seconds += cost_of_weights(steps, contacts, block)
    names = ("striker", *["target"] * (len(kernels) - 1))
    parts = [
        f"{name}: {k.engine if k.modal is None or poles else f'step weights of {_count(k)} poles'}"
        for name, k, poles in zip(names, kernels, by_poles, strict=True)
    ]
    if weights:
        parts.append("direct sum" if block >= steps else f"FFT in blocks of {block} steps")
    choice = "chosen by the cost model" if engine == "auto" else "as asked"
    parts.append(f"{choice}, {seconds:.2g} s predicted")
    return Plan(by_poles, block, seconds, "; ".join(parts))


def _count(kernel: StepKernel) -> int:
    return 0 if kernel.modal is None else len(kernel.modal.omega) + len(kernel.modal.residual.rates)
