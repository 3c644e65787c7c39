"""Memory of the past inside the contact loop: exact pole recursion, and a blocked FFT for step weights.

Poles are advanced exactly for forces constant over a step. Step weights are summed directly inside a block, and past
blocks are folded in by FFT as soon as they are complete (relaxed convolution: Hairer, Lubich & Schlichte, SIAM J. Sci.
Stat. Comput. 6 (1985) 532), O(n log^2 n) in total.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from impact import oscillator
from impact.greens import Array
from impact.modal import ModalGreens

BLOCK = 512


@dataclass(frozen=True)
class Poles:
    """All poles of all bodies, seen from the contacts: gap_c = sum_k psi_kc q_k, q_k driven by sum_c psi_kc N_c.

    Attributes:
        steps: (6, M) rows a11, a12, a21, a22, b1, b2 of the exact step of each oscillator.
        psi: (M, p) mode shapes with the sign of the contact.
        decay, gain: (R,) relaxations y <- decay (y + gain f).
        rho: (R, p) relaxation amplitudes with the sign of the contact.
    """

    steps: Array
    psi: Array
    decay: Array
    gain: Array
    rho: Array

    @staticmethod
    def of(parts: list[tuple[ModalGreens, Array]], dt: float, contacts: int) -> Poles:
        """Poles of several bodies, each with its (ports, contacts) directions; unseen modes are dropped."""
        steps, psi, decay, gain, rho = [np.zeros((6, 0))], [np.zeros((0, contacts))], [], [], [np.zeros((0, contacts))]
        for greens, directions in parts:
            seen = greens.shapes @ directions
            a, b = oscillator.transition(dt, greens.omega, greens.zeta)
            kept = np.any(seen != 0, axis=1)
            steps.append(np.array([a[0, 0], a[0, 1], a[1, 0], a[1, 1], b[0], b[1]])[:, kept])
            psi.append(seen[kept])
            rates = greens.residual.rates
            decay.append(np.exp(-rates * dt))
            gain.append(dt * oscillator.expm1_over(-rates * dt))
            rho.append(greens.residual.shapes @ directions)
        none = [np.zeros(0)]
        return Poles(
            np.ascontiguousarray(np.concatenate(steps, axis=1)),
            np.ascontiguousarray(np.concatenate(psi)),
            np.concatenate(none + decay),
            np.concatenate(none + gain),
            np.ascontiguousarray(np.concatenate(rho)),
        )

    def folded(self) -> tuple[Array, Array, Array]:
        """For one contact: step rows with psi^2 in b, decay, gain with rho^2, so that the gap is a plain sum."""
        rows = self.steps.copy()
        rows[4:] *= self.psi[:, 0] ** 2
        return rows, self.decay, self.gain * self.rho[:, 0] ** 2


def fold_block(memory: Array, force: Array, weights: Array, done: int, block: int) -> None:
    """Add what finished blocks do to later ones, after block number ``done`` (1, 2, ...), in place.

    memory, force (n,); weights (n,). With k the largest power of two dividing ``done``, the last k blocks of force act
    on the next k blocks; over the run every pair of blocks is met exactly once.
    """
    size = (done & -done) * block
    end = done * block
    if end >= len(force):
        return
    stop = min(end + size, len(force))
    kernel = weights[: 2 * size]
    product = np.fft.rfft(force[end - size : end], 4 * size) * np.fft.rfft(kernel, 4 * size)
    memory[end:stop] += np.fft.irfft(product, 4 * size)[size : size + stop - end]


def convolve(weights: Array, force: Array) -> Array:
    """u[n] = sum_m weights[n - m] force[m], by FFT."""
    n = len(force)
    size = 1 << (2 * n - 1).bit_length()
    return np.asarray(np.fft.irfft(np.fft.rfft(weights[:n], size) * np.fft.rfft(force, size), size)[:n])


def direct_sum(weights: Array, force: Array) -> Array:
    """The same sum, term by term: the oracle."""
    return np.array([weights[: n + 1] @ force[n::-1] for n in range(len(force))])
