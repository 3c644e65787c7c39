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

    def truncated(self, above: float) -> tuple[ModalGreens, float]:
        """(pairs up to ``above`` [rad/s] and the residual of the others, its error relative to the largest response).

        High pairs stand for no mode of the body; kept, they would ring in the contact. Their compliance is kept.
        """
        greens = truncate(self.omega, self.zeta, self.shapes, above, self.beyond, self.model, self.damping)
        dropped = self.omega > above
        stand_in = greens.residual.filtered(self.t, self.width)
        lost = stand_in - self.spring - combine(self.shapes[dropped], self.each[dropped])
        return greens, float(np.abs(lost).max()) / float(np.abs(self.response).max())
