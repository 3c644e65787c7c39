"""Receptance: the Green's function in the frequency domain."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from impact.greens.answers import ComplexArray
from impact.greens.base import GreensFunction

_BLOCK = 1 << 20  # frequencies times modes at once


def receptance(
    greens: GreensFunction, frequency: ArrayLike, i: int | None = None, j: int | None = None
) -> ComplexArray:
    """Return H_ij(f) = displacement of port i per unit harmonic force on port j [m/N], at ``frequency`` (...,) > 0
    [Hz].

    Shape (..., p, p): frequency, response, reference, the layout of pyFBS and other programs of substructuring; (...,)
    where ``i`` and ``j`` are given. Of oscillators and relaxations

        H = sum_k phi_ki phi_kj/(w_k^2 - w^2 + 2 i zeta_k w_k w) + sum_r a_ri a_rj/(rate_r + i w) + c_ij,  w = 2 pi f,

    the Fourier transform, with exp(i w t), of `impulse_response` (Ewins, Modal Testing, 2000). The way back is
    `impact.FrequencyResponse` and `impact.fit_poles`.

    Raises:
        GreensFunctionError: a representation whose transform is not known in closed form.
    """
    f = np.asarray(frequency, dtype=float)
    s = np.asarray(2j * np.pi * np.ravel(f))
    modes = 0 if greens.modal is None else greens.modal.omega.size
    rows = max(1, _BLOCK // max(1, modes))  # blocks bound the memory
    which = (slice(None), slice(None) if i is None else i, slice(None) if j is None else j)
    blocks = [greens.transfer(s[start : start + rows])[which] for start in range(0, s.size, rows)]
    p = len(greens.ports)
    rest = (*([p] * (i is None)), *([p] * (j is None)))
    return np.concatenate([*blocks, np.zeros((0, *rest), dtype=complex)]).reshape((*f.shape, *rest))
