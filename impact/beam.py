"""Euler-Bernoulli cantilever reed in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from impact.body import Body, ModalState
from impact.greens import Array, ErrorEstimate, GreensFunctionError
from impact.modal import ModalGreens, Residual


@dataclass(frozen=True)
class Cantilever:
    """Uniform clamped-free beam of rectangular section, bending about its thin side (all SI).

    EI w'''' + rho A w'' = p, w = w' = 0 at x = 0, M = Q = 0 at x = length.
    """

    young: float
    density: float
    length: float
    width: float
    thickness: float

    def __post_init__(self) -> None:
        for name in ("young", "density", "length", "width", "thickness"):
            value = getattr(self, name)
            if not (value > 0 and math.isfinite(value)):
                raise GreensFunctionError(f"cantilever {name} = {value:g} must be positive and finite")

    @property
    def rigidity(self) -> float:
        """EI = E w h^3/12 [N m^2]."""
        return self.young * self.width * self.thickness**3 / 12

    @property
    def line_density(self) -> float:
        """rho A [kg/m]."""
        return self.density * self.width * self.thickness

    @property
    def mass(self) -> float:
        """rho A L [kg]."""
        return self.line_density * self.length

    def wave_numbers(self, n_modes: int) -> Array:
        """(n,) k_n L: roots of cos x cosh x = -1 by Newton on cos x + 1/cosh x."""
        k = np.arange(1, n_modes + 1)
        x = (k - 0.5) * np.pi
        x[0] = 1.875
        for _ in range(8):
            sech = 1 / np.cosh(np.minimum(x, 700.0))
            x = x + (np.cos(x) + sech) / (np.sin(x) + sech * np.tanh(x))
        return np.asarray(x)

    def frequencies(self, n_modes: int) -> Array:
        """(n,) undamped angular frequencies (k_n L)^2 sqrt(EI/(rho A L^4)) [rad/s]."""
        scale = math.sqrt(self.rigidity / (self.line_density * self.length**4))
        return np.asarray(self.wave_numbers(n_modes) ** 2 * scale)

    def shapes(self, n_modes: int, x: float) -> Array:
        """(n,) mass-normalised mode shapes at ``x`` [1/sqrt(kg)]; 2 (-1)^(n+1)/sqrt(mass) at the tip.

        cosh - cos - s (sinh - sin), rewritten without growing exponentials so that any n keeps its digits.
        """
        if not 0 <= x <= self.length * (1 + 1e-12):
            raise GreensFunctionError(f"position {x:g} m is outside the cantilever, 0..{self.length:g} m")
        k = self.wave_numbers(n_modes)
        xi = min(x / self.length, 1.0)
        # s = (sinh k - sin k)/(cosh k + cos k) = 1 - delta
        growth = np.exp(-k)
        denominator = 1 + growth**2 + 2 * growth * np.cos(k)
        delta = 2 * growth * (growth + np.cos(k) + np.sin(k)) / denominator
        s = 1 - delta
        # cosh z - s sinh z = exp(-z) + delta sinh z, with sinh z exp(-k) bounded
        scaled_sinh = (np.exp(k * (xi - 1)) - np.exp(-k * (xi + 1))) / 2
        ratio = 2 * (growth + np.cos(k) + np.sin(k)) / denominator
        z = k * xi
        w = np.exp(-z) + ratio * scaled_sinh - np.cos(z) + s * np.sin(z)
        return np.asarray(w / math.sqrt(self.mass))

    def compliance(self, x: float, load: float) -> float:
        """Static deflection at ``x`` per unit force at ``load`` [m/N]: a^2 (3b - a)/(6 EI), a <= b."""
        a, b = sorted((x, load))
        return a * a * (3 * b - a) / (6 * self.rigidity)


def cantilever_reed(
    *,
    young: float,
    density: float,
    length: float,
    width: float,
    thickness: float,
    damping_ratio: float = 0.0,
    n_modes: int = 40,
    tip_deflection: float = 0.0,
    contact_at: float | None = None,
) -> Body:
    """Cantilever reed released at t = 0 from the static shape under a tip force.

    Modes of `Cantilever`, one damping ratio for all, plus the static compliance they leave out at the contact point
    as a bare spring (an Euler-Bernoulli beam has no finite impedance at t = 0: g starts like t^(1/2)).

    Args:
        young, density, length, width, thickness: SI.
        damping_ratio: of every mode.
        n_modes: modes kept.
        tip_deflection: at release [m]; > 0 is away from the seat.
        contact_at: distance of the contact point from the clamp [m]; ``None`` is the tip.

    Raises:
        GreensFunctionError: a length that is not positive, a contact point off the reed, no modes.
    """
    beam = Cantilever(young, density, length, width, thickness)
    if n_modes < 1:
        raise GreensFunctionError(f"n_modes = {n_modes} must be at least 1")
    if not damping_ratio >= 0:
        raise GreensFunctionError(f"damping_ratio = {damping_ratio:g} must be >= 0")
    x = length if contact_at is None else contact_at
    if not 0 < x <= length * (1 + 1e-12):
        raise GreensFunctionError(f"contact_at = {x:g} m is off the reed, 0..{length:g} m")
    omega, shape, tip = beam.frequencies(n_modes), beam.shapes(n_modes, x), beam.shapes(n_modes, length)
    left_out = max(beam.compliance(x, x) - math.fsum((shape / omega) ** 2), 0.0)
    greens = ModalGreens(
        omega,
        np.full(n_modes, damping_ratio),
        shape[:, None],
        Residual.spring(left_out),
        port_names=("contact",),
        error=ErrorEstimate(),
        origin={
            "kind": "cantilever",
            "young": young,
            "density": density,
            "length": length,
            "width": width,
            "thickness": thickness,
            "damping_ratio": damping_ratio,
            "contact_at": x,
        },
    )
    force = tip_deflection / beam.compliance(length, length)
    return Body(greens, state=ModalState(force * tip / omega**2, np.zeros(n_modes)))
