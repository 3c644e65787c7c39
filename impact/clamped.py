"""Euler-Bernoulli beam clamped at both ends, in closed form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.beam_modes import BeamModes, RectangularBeam, bisected, clamped_shape
from impact.greens import Array
from impact.modal import Residual


@dataclass(frozen=True)
class ClampedClamped(RectangularBeam):
    """Uniform beam of rectangular section, w = w' = 0 at x = 0 and x = length (all SI)."""

    family: ClassVar[str] = "clamped-clamped beam"

    @property
    def free_point(self) -> float:
        """The middle [m]."""
        return self.length / 2

    @property
    def description(self) -> Mapping[str, object]:
        """Kind and parameters."""
        return {"kind": self.family, **asdict(self)}

    def wave_numbers(self, n_modes: int) -> Array:
        """(n,) k_n L: roots of cos x cosh x = 1 near (n + 1/2) pi, by bisection of cos x - 1/cosh x."""
        n = np.arange(1, n_modes + 1)
        centre = (n + 0.5) * np.pi

        def past(k: Array) -> NDArray[np.bool_]:
            return np.asarray((np.cos(k) - 1 / np.cosh(np.minimum(k, 700.0))) * (-1.0) ** n < 0)

        return bisected(past, centre - 0.5, centre + 0.5)

    def frequencies(self, n_modes: int) -> Array:
        """(n,) undamped angular frequencies (k_n L)^2 sqrt(EI/(rho A L^4)) [rad/s]."""
        return np.asarray(self.wave_numbers(n_modes) ** 2 * self.frequency_scale)

    def shapes(self, n_modes: int, x: ArrayLike) -> Array:
        """(n, ...) mass-normalised mode shapes at ``x`` [1/sqrt(kg)].

        cosh - cos - s (sinh - sin), s = (cosh k - cos k)/(sinh k - sin k); any n keeps its digits.
        """
        xi = self.relative(x)
        k = self.wave_numbers(n_modes)
        growth = np.exp(-k)
        denominator = (1 - growth**2) / 2 - growth * np.sin(k)  # (sinh k - sin k) exp(-k)
        ratio = (np.cos(k) - np.sin(k) - growth) / denominator
        return np.asarray(clamped_shape(k, ratio * growth, ratio, xi) / np.sqrt(self.mass))

    def modes(self, n_modes: int) -> BeamModes:
        """The lowest modes."""
        return BeamModes(
            self.frequencies(n_modes),
            lambda x: self.shapes(n_modes, x),
            length=self.length,
            width=self.width,
            line_density=self.line_density,
        )

    def compliance(self, x: float, load: float) -> float:
        """Static deflection at ``x`` per unit force at ``load`` [m/N]:  a^2 c^2 (3 b L - a (3 b + c))/(6 EI L^3).

        a <= b the two distances from the clamp, c = L - b.
        """
        a, b = sorted((x, load))
        c = max(self.length - b, 0.0)
        return a**2 * c**2 * (3 * b * self.length - a * (3 * b + c)) / (6 * self.rigidity * self.length**3)

    def residual(self, compliance: Array, at: tuple[float, ...], damping_ratio: float, highest: float) -> Residual:
        """The exponential of half a radian of the highest mode kept, as for `Cantilever`."""
        return Residual.relaxing(compliance, 2 * highest)
