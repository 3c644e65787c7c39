"""What all Euler-Bernoulli beams share: from wave numbers and shapes to modes, and what the modes leave out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from impact.beams.modes import BeamModes, RectangularBeam, clamped_shape
from impact.greens.base import Array
from impact.greens.modal import Residual


class EulerBernoulliBeam(RectangularBeam, ABC):
    """A beam with EI w'''' + rho A w'' = p and the supports of a family (all SI)."""

    @abstractmethod
    def wave_numbers(self, n_modes: int) -> Array:
        """Return the (n,) k_n L, the roots of the family's frequency equation."""

    @abstractmethod
    def end_condition(self, k: Array) -> Array:
        """Return (n,) (1 - s) exp(k): the s of each shape cosh - cos - s (sinh - sin), as the far end asks for it."""

    def modal_mass(self, k: Array) -> Array:
        """Return the mass of these shapes [kg], (n,) or one for all."""
        return np.asarray(self.mass)

    def shapes(self, n_modes: int, x: ArrayLike) -> Array:
        """Return the (n, ...) mass-normalised mode shapes at ``x`` [1/sqrt(kg)], cosh - cos - s (sinh - sin) over the
        root of their mass; any n keeps its digits."""
        return self._on_modes(clamped_shape, self.wave_numbers(n_modes), self.relative(x))

    def _on_modes(self, function: Callable[[Array, Array, Array, Array], Array], k: Array, xi: Array) -> Array:
        """Return the (n, ...) `clamped_shape`, or a derivative of it, of unit modal mass."""
        ratio = self.end_condition(k)
        scale = np.reshape(np.sqrt(self.modal_mass(k)), (-1, *[1] * xi.ndim))
        return np.asarray(function(k, ratio * np.exp(-k), ratio, xi) / scale)

    @property
    def end_mass(self) -> float:
        """Return the point mass at the end [kg]."""
        return 0.0

    def frequencies(self, n_modes: int) -> Array:
        """Return the (n,) undamped angular frequencies (k_n L)^2 sqrt(EI/(rho A L^4)) [rad/s]."""
        return np.asarray(self.wave_numbers(n_modes) ** 2 * self.frequency_scale)

    def modes(self, n_modes: int) -> BeamModes:
        """Return the lowest modes."""
        return BeamModes(
            self.frequencies(n_modes),
            lambda x: self.shapes(n_modes, x),
            length=self.length,
            width=self.width,
            line_density=self.line_density,
            tip_mass=self.end_mass,
        )

    def compliance(self, x: float, load: float) -> float:
        """Return the static deflection at ``x`` per unit force at ``load`` [m/N], of a cantilever: a^2 (3b - a)/(6 EI),
        a <= b."""
        a, b = sorted((x, load))
        return a * a * (3 * b - a) / (6 * self.rigidity)

    def residual(self, compliance: Array, at: tuple[float, ...], damping_ratio: float, highest: float) -> Residual:
        """Return the exponential that relaxes within half a radian of the highest mode retained, tau = 1/(2 highest).

        The continuum has no finite impedance at t = 0 (g starts like t^(1/2)); the higher modes carry energy away. A
        bare spring in their place would ring against the contact (docs/methods.md). At a tip mass it is small.
        """
        return Residual.relaxing(compliance, 2 * highest)
