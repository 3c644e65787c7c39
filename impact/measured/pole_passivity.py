"""Whether a sum of poles is passive: the real part of its mobility at all frequencies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from impact.greens.base import Array
from impact.greens.poles import PoleGreens

TOLERANCE = 1e-9  # of the sum of the sizes of the terms
_AROUND = np.concatenate([-np.geomspace(30, 0.03, 10), [0.0], np.geomspace(0.03, 30, 10)])  # half widths off a pole
_CHUNK = 2_000_000  # numbers at once


@dataclass(frozen=True)
class PolePassivity:
    """The frequency at which the mobility of a body is nearest to giving energy.

    Attributes:
        margin: least over w of the smallest eigenvalue of Re[iw G(iw)] over the sum of the sizes of its terms at that
            frequency, -1 ... 1; < 0 is a gain.
        frequency: where [Hz].
        tolerance: the verdict is passive where ``margin`` >= -``tolerance``.
    """

    margin: float
    frequency: float
    tolerance: float = TOLERANCE

    @property
    def passive(self) -> bool:
        """Return the verdict."""
        return self.margin >= -self.tolerance

    def __str__(self) -> str:
        verdict = "passive" if self.passive else "not passive"
        return f"{verdict}: margin {self.margin:.3g} at {self.frequency:.4g} Hz (limit {-self.tolerance:.1g})"


def pole_passivity(greens: PoleGreens, *, tolerance: float = TOLERANCE) -> PolePassivity:
    """Report whether a force, of whatever course, can draw energy from the body.

    A force N takes the work integral of N u' = (1/pi) integral over w > 0 of N^ Re[iw G(iw)] N: never negative if and
    only if Re[iw G(iw)] (symmetric, p x p) is positive semidefinite at all w, its limits at 0 and infinity included. A
    pole on the imaginary axis needs r r' = -i times a positive matrix in addition.

    The terms are summed in a form free of cancellation (`real_mobility`); the frequencies are refined around each
    pole, and the least value by two rounds of subdivision. A violation narrower than that grid is not seen.

    ``tolerance``: of the margin, which is relative. Source: Anderson and Vongpanitlerd, Network Analysis and
    Synthesis (1973), ch. 2.
    """
    w = passivity_grid(greens)
    margins = passivity_margins(greens, w)
    for _ in range(2):  # the neighbourhood of the eight least values
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

    A pair R = r r' at s gives w^2 (2 sigma B - A (|s|^2 - w^2))/((|s|^2 - w^2)^2 + 4 w^2 sigma^2), sigma = -Re s,
    A = 2 Re R, B = -2 Re(R s*); a real pole sign a a' w^2/(w^2 + rate^2); rigid bodies and compliance nothing.
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
    """Return the (n,) smallest eigenvalue of Re[iw G(iw)] over the sum of the sizes of its terms."""
    total, size = real_mobility(greens, omega)
    least = total[:, 0, 0] if total.shape[1] == 1 else np.linalg.eigvalsh(total)[:, 0]
    return np.asarray(least / np.where(size > 0, size, 1.0))


def passivity_grid(greens: PoleGreens) -> Array:
    """Return the angular frequencies around each pole in half widths, each real pole in octaves, far below and above
    all."""
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
