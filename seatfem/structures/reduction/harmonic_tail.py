"""The Fourier harmonics of a ring above all waves of the band: they answer at once, so that statics describe them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from impact.greens.modal import ModalGreens
from seatfem.structures.damping import Damping
from seatfem.structures.model import Array, SecondOrderModel
from seatfem.structures.reduction.factorization import Backend, factorize
from seatfem.structures.reduction.residual import relaxation
from seatfem.structures.reduction.ring_patches import RingPatch, summed

_STEP = 1.3  # ratio of successive harmonics whose static compliance is computed


class Tail:
    """Static compliances R_n of the harmonics above ``reduced``, close to C/n."""

    def __init__(self, patches: Mapping[str, RingPatch], rings: list[str], reduced: int) -> None:
        self.patches, self.reduced, self.last = patches, reduced, reduced
        self._places = [rings.index(patch.boundary) for patch in patches.values()]
        self._numbers: list[int] = []
        self._scaled: list[Array] = []  # n R_n, (rings, rings)
        narrowest = min(patch.width for patch in patches.values())
        self._far = int(200 / narrowest) + 20  # beyond, s_n^2/n sums to less than 1e-4 of its whole

    @property
    def next(self) -> int:
        """Return the next harmonic whose compliance is wanted."""
        return self.last + max(1, int((_STEP - 1) * self.last))

    def add(self, model: SecondOrderModel, backend: Backend) -> None:
        """Solve the harmonic `next`."""
        self.last = self.next
        static = model.port_matrix.T @ factorize(model.K, backend=backend).solve(model.port_matrix)
        self._numbers.append(self.last)
        self._scaled.append(self.last * (static + static.T) / 2)

    def compliance(self) -> Array:
        """Return the (p, p) sum over all harmonics above ``reduced`` of s_ni s_nj cos n(th_i - th_j) R_n [m/N].

        n R_n is interpolated linearly in log n, which keeps it positive semidefinite, and constant beyond the last.
        """
        harmonics = np.arange(self.reduced + 1, max(self._far, 20 * self.last))
        return summed(self.patches, harmonics, self._law(harmonics), self._places)

    def diagonal(self) -> Array:
        """Return the (p,) diagonal of `compliance`, its largest values; in no time."""
        return self._diagonal(self.reduced + 1)

    def doubt(self) -> float:
        """Return the half of the largest compliance that was extrapolated [m/N]; ``inf`` before two were computed."""
        return math.inf if len(self._numbers) < 2 else float(self._diagonal(self.last + 1).max()) / 2

    def _diagonal(self, first: int) -> Array:
        """Return the (p,) sum from a harmonic on of s_ni^2 R_n: patches as wide on one ring share it."""
        harmonics = np.arange(first, max(self._far, 20 * self.last))
        law, known = self._law(harmonics), dict[tuple[float, int], float]()
        for patch, place in zip(self.patches.values(), self._places, strict=True):
            if (patch.width, place) not in known:
                known[patch.width, place] = float(patch.coefficients(harmonics) ** 2 @ law[place, place])
        return np.array(
            [known[patch.width, place] for patch, place in zip(self.patches.values(), self._places, strict=True)]
        )

    def _law(self, harmonics: NDArray[np.int64]) -> Array:
        """Return the (rings, rings, n) R_n."""
        known, scaled = np.log(self._numbers), np.array(self._scaled)
        at, rings = np.log(harmonics), range(scaled.shape[1])
        return np.array([[np.interp(at, known, scaled[:, i, j]) / harmonics for j in rings] for i in rings])


def static_lag(greens: ModalGreens, start: Array, damping: Damping, t: Array, width: float) -> float:
    """Return the largest difference, after the pulse, of a harmonic from the relaxation of its compliance [m/(N s)]."""
    if np.any(greens.omega == 0):
        return math.inf
    instant = relaxation(greens.static_compliance(), start, damping.beta).filtered(t, width)
    return float(np.abs(greens.filtered_matrix(t, width) - instant).max())
