"""Ritz pairs, whichever reduction found them: what each does after the pulse, and which of them stay."""

from __future__ import annotations

import numpy as np

from impact.greens.modal import ModalGreens
from impact.greens.pulse import combine, hann, mode_responses
from seatfem.structures.damping import Damping
from seatfem.structures.model import Array, SecondOrderModel
from seatfem.structures.reduction.residual import truncate


class RitzPairs:
    """Ritz pairs seen through the pulse.

    Args:
        omega, shapes: (k,) and (k, p), mass-normalised.
        loss: (k,) phi' H phi of each pair [1/s^2], for a loss matrix that is not eta K.
        beyond: (p, p) static compliance of pairs too high to be listed; they follow the pulse as a spring [m/N].
        t, width: times and width of the pulse [s].
    """

    def __init__(
        self,
        model: SecondOrderModel,
        damping: Damping,
        omega: Array,
        shapes: Array,
        t: Array,
        width: float,
        *,
        loss: Array | None = None,
        beyond: Array | None = None,
    ) -> None:
        self.model, self.damping, self.omega, self.shapes, self.t, self.width = model, damping, omega, shapes, t, width
        p = shapes.shape[1]
        self.beyond = np.zeros((p, p)) if beyond is None else beyond
        self.zeta = damping.ratios(omega, loss)
        self.each = mode_responses(omega, self.zeta, t, width)
        self.spring = self.beyond[:, :, None] * hann(t, width)
        self.response = combine(shapes, self.each) + self.spring

    def cut(self, band: float, allowed: float) -> tuple[ModalGreens, float]:
        """Drop the pairs above the lowest cutoff that costs less than ``allowed`` into the residual; (g, its error).

        High pairs stand for no mode of the body; kept, they would ring in the contact. Their compliance is kept.
        """
        scale = float(np.abs(self.response).max())
        best, lowest, above = None, np.inf, 2 * band
        while best is None or (lowest > allowed and np.any(self.omega > above)):
            greens = self._truncated(above)
            error = self._error(greens, above) / scale
            if best is None or error < lowest:
                best, lowest = greens, error
            above *= 1.25
        return best, lowest

    def _truncated(self, above: float) -> ModalGreens:
        return truncate(self.omega, self.zeta, self.shapes, above, self.beyond, self.model, self.damping)

    def _error(self, greens: ModalGreens, above: float) -> float:
        dropped = self.omega > above
        stand_in = greens.residual.filtered(self.t, self.width)
        return float(np.abs(stand_in - self.spring - combine(self.shapes[dropped], self.each[dropped])).max())
