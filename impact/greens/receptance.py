"""Receptance: the Green's function in the frequency domain."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from impact.greens.answers import ComplexArray
from impact.greens.modal import ModalGreens

_BLOCK = 1 << 20  # frequencies times modes at once


def receptance(greens: ModalGreens, frequency: ArrayLike, i: int = 0, j: int = 0) -> ComplexArray:
    """H_ij(f) = displacement of port i per unit harmonic force on port j [m/N], shape of ``frequency`` [Hz].

    H = sum_k phi_ki phi_kj/(w_k^2 - w^2 + 2 i zeta_k w_k w) + sum_r a_ri a_rj/(rate_r + i w) + c_ij,  w = 2 pi f > 0:
    the Fourier transform of `ModalGreens.impulse_response` (Ewins, Modal Testing, 2000), by `ModalGreens.transfer`.
    """
    f = np.asarray(frequency, dtype=float)
    s = np.asarray(2j * np.pi * np.ravel(f))
    rows = max(1, _BLOCK // max(1, greens.omega.size))  # blocks bound the memory
    blocks = [greens.transfer(s[start : start + rows])[:, i, j] for start in range(0, s.size, rows)]
    return np.concatenate([*blocks, np.zeros(0, dtype=complex)]).reshape(f.shape)
