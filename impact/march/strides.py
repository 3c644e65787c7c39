"""Long strides through flight: many steps of all poles at once, where no contact can close on the way.

Between contacts the poles swing freely (under the constant drive of a preload). Over m steps a pole that is a damped
oscillation of amplitude A about its rest stays within min(2, (m w h)^2/8) A of the straight line between where it is
and where it will be, as |q''| <= w^2 A; a relaxation within 1 - exp(-m rate h) of what it has; a rigid motion on it. So

    gap_j >= free_j + line_j - sum_k |psi_k| A_k err_k,   j = 1..m,

with the free gaps known step by step. Where that stays positive no force can act, and the m steps are one product
with A^m. Powers and rests are found in extended precision: those of doubles would turn slow modes by eps/(w h)^2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impact.brief import brief
from impact.greens.base import Array

SHORTEST, LONGEST = 4, 13  # powers of two, of steps; a shorter stride costs what it saves


@dataclass(frozen=True)
class Strides:
    """Data of K poles for the strides of a march.

    ``lengths`` (L,): steps, none where poles are no oscillations, relaxations or rigid motions; ``powers`` (L, 5, K):
    b11, b12, b21, b22 of A^m, and err; ``swing`` (4, K): rest (q, p), and u, v with A^2 = q^2 + (v p + u q)^2 about it.
    """

    lengths: NDArray[np.int64]
    powers: Array
    swing: Array

    __repr__ = brief

    @staticmethod
    def none() -> Strides:
        """Return the strides of a march step by step."""
        return Strides(np.zeros(0, dtype=np.int64), np.zeros((0, 5, 0)), np.zeros((4, 0)))

    @staticmethod
    def from_poles(steps: Array, drive: Array, most: int) -> Strides:
        """Return the strides of poles with the (5, K) ``steps`` of `history.Poles` under a constant ``drive`` (K,), of
        ``most`` steps."""
        a11, a21, a22, c1, c2 = np.asarray(steps, dtype=np.longdouble)
        half, det = (a11 - a22) / 2, a11 * a22 - a21
        sine = det - ((a11 + a22) / 2) ** 2  # (exp(-zeta w h) sin(w_d h))^2
        rigid = (a11 == 1) & (a22 == 1) & (a21 == 0)
        relaxes = (a22 == 0) & (a21 == 0)
        swings = (sine > 1e-12 * det) & ~rigid & ~relaxes
        if not np.all(rigid | relaxes | swings):
            return Strides.none()
        over = np.where(swings, 1 / np.sqrt(np.where(swings, sine, 1.0)), 0.0)
        turn = np.arctan2(np.sqrt(np.maximum(sine, 0.0)), (a11 + a22) / 2)
        phase = np.hypot(turn, np.log(np.where(swings, det, 1.0)) / 2)  # w h
        gap = 1 - a11 - a22 + det
        held = np.where(gap != 0, 1 / np.where(gap != 0, gap, 1.0), 0.0) * drive
        rest = (held * ((1 - a22) * c1 + c2), held * (a21 * c1 + (1 - a11) * c2))
        power, powers, lengths = (a11, np.ones_like(a11), a21, a22), [], []
        for j in range(1, LONGEST + 1):
            b11, b12, b21, b22 = power
            power = (b11 * b11 + b12 * b21, b12 * (b11 + b22), b21 * (b11 + b22), b21 * b12 + b22 * b22)
            if j < SHORTEST or 2**j > most:
                continue
            strays = np.where(swings, np.minimum(2.0, (2**j * phase) ** 2 / 8), np.where(rigid, 0.0, 1 - power[0]))
            powers.append(np.array([*power, strays], dtype=float))
            lengths.append(2**j)
        if not powers:
            return Strides.none()
        swing = np.array([*rest, half * over, over], dtype=float)
        return Strides(np.array(lengths, dtype=np.int64), np.ascontiguousarray(powers), swing)
