"""Receptance: the Green's function in the frequency domain."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.greens.modal import ModalGreens

_BLOCK = 1 << 20  # frequencies times modes at once


def receptance(greens: ModalGreens, frequency: ArrayLike, i: int = 0, j: int = 0) -> NDArray[np.complex128]:
    """H_ij(f) = displacement of port i per unit harmonic force on port j [m/N], shape of ``frequency`` [Hz].

    H = sum_k phi_ki phi_kj/(w_k^2 - w^2 + 2 i zeta_k w_k w) + sum_r a_ri a_rj/(rate_r + i w) + c_ij,  w = 2 pi f > 0:
    the Fourier transform of `ModalGreens.impulse_response` (Ewins, Modal Testing, 2000).
    """
    f = np.asarray(frequency, dtype=float)
    w = 2 * np.pi * np.ravel(f)
    out = np.full(w.shape, greens.residual.compliance[i, j], dtype=complex)
    rows = max(1, _BLOCK // max(1, greens.omega.size))  # blocks bound the memory
    for start in range(0, w.size, rows):
        block = slice(start, start + rows)
        at = w[block, None]
        dynamic = greens.omega**2 - at**2 + 2j * greens.zeta * greens.omega * at
        out[block] += (1 / dynamic) @ (greens.shapes[:, i] * greens.shapes[:, j])
        relaxing = greens.residual.rates + 1j * at
        out[block] += (1 / relaxing) @ (greens.residual.shapes[:, i] * greens.residual.shapes[:, j])
    return out.reshape(f.shape)
