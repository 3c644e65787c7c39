"""Loads that are known only as the march goes: co-simulation."""

from __future__ import annotations

import numpy as np

from impact.greens import oscillator
from impact.greens.base import Array
from impact.march.motion import Discrete
from impact.march.problem import ContactError


class LiveLoads:
    """Motion of the striker under load amplitudes given step by step, superposed on everything else.

    Attributes:
        amplitudes: (L, n) given so far, beyond the loads' own courses [N].
        state: (2, M) modal coordinates and rates due to them.
        awake: whether any amplitude was ever not zero.
    """

    def __init__(self, striker: Discrete, directions: Array, steps: int) -> None:
        loads = striker.body.loads
        self.amplitudes = np.zeros((len(loads), steps))
        self.awake = False
        self.state = np.zeros((2, 0))
        greens = striker.body.greens.modal
        if loads and greens is not None:  # a Body with loads is modal
            self._a, self._b = oscillator.transition(striker.dt, greens.omega, greens.zeta)
            self._shapes = np.stack([load.shape for load in loads])
            self._seen = (greens.shapes @ directions).T
            self.state = np.zeros((2, len(greens.omega)))

    def record(self, step: int, amplitudes: Array) -> None:
        """Amplitudes for one step; raises `ContactError` unless they are one finite number per load."""
        if np.shape(amplitudes) != (len(self.amplitudes),) or not np.all(np.isfinite(amplitudes)):
            raise ContactError(
                f"{len(self.amplitudes)} finite load amplitudes are needed, one for each of the striker's loads; "
                f"got {amplitudes}"
            )
        self.amplitudes[:, step] = amplitudes
        self.awake = self.awake or bool(np.any(self.amplitudes[:, step]))

    def advance(self, step: int) -> Array:
        """Over one step; returns (p,) what it adds to the gaps at its end [m]."""
        f = self.amplitudes[:, step] @ self._shapes
        self.state[...] = np.einsum("abm,bm->am", self._a, self.state) + self._b * f
        return np.asarray(self._seen @ self.state[0])
