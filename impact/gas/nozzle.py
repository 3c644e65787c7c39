"""A perfect gas, and its steady isentropic flow through a nozzle (Saint-Venant and Wantzel 1839)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

MOLAR: Final = 8.31446261815324
"""Molar gas constant [J/(mol K)], exact in the SI of 2019."""


class GasError(ValueError):
    """Gas, geometry or tables that nothing can be computed with; the message names the value, the limit, the remedy."""


@dataclass(frozen=True)
class PerfectGas:
    """A gas with p V = m R T and constant specific heats.

    Attributes:
        k: ratio of the specific heats, > 1.
        constant: R of this gas [J/(kg K)], molar constant over molar mass.
        source: of the numbers.

    Raises:
        GasError: k <= 1, R <= 0, or a number that is not finite.
    """

    k: float
    constant: float
    source: str = ""

    def __post_init__(self) -> None:
        if not (self.k > 1 and self.constant > 0 and math.isfinite(self.k * self.constant)):
            raise GasError(f"a gas needs k > 1 and R > 0, finite; got k = {self.k:g}, R = {self.constant:g} J/(kg K)")

    @property
    def heat(self) -> float:
        """Return the specific heat at constant pressure, c_p = k R/(k - 1) [J/(kg K)]."""
        return self.k * self.constant / (self.k - 1)

    @property
    def critical(self) -> float:
        """Return the ratio of the pressures at and below which the flow is choked, (2/(k + 1))^(k/(k - 1))."""
        return float((2 / (self.k + 1)) ** (self.k / (self.k - 1)))

    def flux(self, upstream: float, temperature: float, drop: float) -> float:
        """Return the mass flow through an effective area [kg/(s m^2)], at rest ``upstream`` [Pa] with its
        ``temperature`` [K].

            m'/A = p_u sqrt(2 k/((k - 1) R T_u) (r^(2/k) - r^((k + 1)/k))),   r = max(p_d/p_u, r*),

        where r* is `critical`. Given is ``drop`` = p_u - p_d >= 0 [Pa], so that no digit is lost where it is small.
        """
        k = self.k
        ratio = max(1 - drop / upstream, self.critical)
        log = math.log1p(-drop / upstream) if ratio > self.critical else math.log(ratio)
        falls = -math.expm1((k - 1) / k * log)  # 1 - r^((k - 1)/k)
        speed = math.sqrt(2 * k / ((k - 1) * self.constant * temperature) * falls)
        return float(upstream * ratio ** (1 / k) * speed)


def of_molar_mass(k: float, molar_mass: float, source: str = "") -> PerfectGas:
    """Return the gas by its molar mass [kg/mol]; raises `GasError`."""
    if not molar_mass > 0:
        raise GasError(f"molar mass = {molar_mass:g} kg/mol must be positive")
    return PerfectGas(k, MOLAR / molar_mass, source)


GASES: Final = {
    "air": of_molar_mass(1.400, 28.9647e-3, "dry air near 300 K: Moran and Shapiro, Engineering Thermodynamics"),
    "nitrogen": of_molar_mass(1.400, 28.0134e-3, "near 300 K: NIST Chemistry WebBook"),
    "R134a": of_molar_mass(
        1.108, 102.032e-3, "ideal-gas limit at 300 K: Tillner-Roth and Baehr, J. Phys. Chem. Ref. Data 23 (1994) 657"
    ),
}
"""By name, in the ideal-gas limit: near saturation real gases are denser, state k and molar mass that fit there."""
