"""Ritz pairs, whichever reduction found them: what each does after the pulse, and which of them stay."""

from __future__ import annotations

import numpy as np

from impact.greens.modal import ModalGreens
from impact.greens.pulse import combine, hann, mode_responses
from seatfem.structures.model import Array
from seatfem.structures.reduction.growth import Space
from seatfem.structures.reduction.residual import truncate


class RitzSpace(Space[ModalGreens]):
    """A space whose Ritz pairs damping does not couple."""

    def see(self, omega: Array, shapes: Array, *, loss: Array | None = None, beyond: Array | None = None) -> Array:
        """Return (p, p, nt) what pairs do after the pulse; they are those of the space from now on.

        Args:
            omega, shapes: (k,) and (k, p), mass-normalised.
            loss: (k,) phi' H phi of each pair [1/s^2], for a loss matrix that is not eta K.
            beyond: (p, p) static compliance of pairs too high to be listed; they follow the pulse as a spring [m/N].
        """
        t, width, p = self.t, self.aims.width, shapes.shape[1]
        self.omega, self._shapes = omega, shapes
        self._beyond = np.zeros((p, p)) if beyond is None else beyond
        self._zeta = self.damping.ratios(omega, loss)
        self._each = mode_responses(omega, self._zeta, t, width)
        self._spring = self._beyond[:, :, None] * hann(t, width)
        self._response = combine(shapes, self._each) + self._spring
        return self._response

    def truncated(self, above: float) -> tuple[ModalGreens, float]:
        """Truncate as `Space.truncated`: high pairs stand for no mode of the body; kept, they would ring in the
        contact."""
        greens = truncate(self.omega, self._zeta, self._shapes, above, self._beyond, self.model, self.damping)
        dropped = self.omega > above
        stand_in = greens.residual.filtered(self.t, self.aims.width)
        lost = stand_in - self._spring - combine(self._shapes[dropped], self._each[dropped])
        return greens, float(np.abs(lost).max()) / float(np.abs(self._response).max())
