"""A fluid film in the open gap of a contact: it resists closing, and opening up to what the fluid bears.

A long strip of width w and length l, plane and parallel, its fluid of viscosity mu incompressible and of no inertia:

    N = -c(g) dg/dt,   c(g) = k/(g + f)^3,   k = mu l w^3,

with a floor f of the gap g: what roughness, and tilt within the strip, leave open when the bodies touch. Over a step of
length h, from the gap g0 to g1, the march takes the mean of the exact solution,

    N h = k/2 (1/G1^2 - 1/G0^2),   G = max(g, 0) + f,

implicitly with the law of the contact. Whatever the steps, the film then takes the momentum k/2 (1/G1^2 - 1/G0^2) from
the bodies, and N (g1 - g0) <= 0 holds in each of them. (With the c of the step before, the march fails where c > h/W0,
and the more so the shorter the step.) The film acts on the open gap alone: where a law lets the bodies penetrate, G
rests at f. Beyond `FAR` floors it is left out, a millionth of its momentum.

A pull is limited to what cavitation leaves, its pressure below that of the surroundings times the strip's area.

The fluid is a gas, too, as long as the film's pressure is small against the ambient one: where it is not, a gas gives
way, and the force of this film is an upper bound.

Source: Stefan, Sitzungsber. Akad. Wiss. Wien 69 II (1874) 713; Reynolds, Phil. Trans. R. Soc. 177 (1886) 157.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from impact.march.laws import LawError, Parameters

FAR: Final = 1000.0
"""Gap in floors beyond which the film is left out."""
NO_FILM: Final[Parameters] = (0.0, 0.0, 0.0)
"""`SqueezeFilm.parameters` of a contact without one."""


@dataclass(frozen=True)
class SqueezeFilm:
    """N = -k/(g + f)^3 dg/dt in the open gap g of a contact, beside its law.

    Attributes:
        coefficient: k [N s m^2] > 0, mu l w^3 of a long strip.
        floor: f [m] > 0.
        tension: largest pull [N] >= 0; infinite: the film never breaks.

    Raises:
        LawError: a coefficient or floor that is not positive and finite, a negative tension.
    """

    coefficient: float
    floor: float
    tension: float = math.inf

    def __post_init__(self) -> None:
        for name, unit in (("coefficient", "N s m^2"), ("floor", "m")):
            value = getattr(self, name)
            if not (value > 0 and math.isfinite(value)):
                raise LawError(f"SqueezeFilm.{name} = {value:g} {unit} must be positive and finite")
        if not self.tension >= 0:
            raise LawError(f"SqueezeFilm.tension = {self.tension:g} N must be >= 0")

    @staticmethod
    def strip(
        *, viscosity: float, length: float, width: float, floor: float, underpressure: float = 1e5
    ) -> SqueezeFilm:
        """Return the film under a long strip, or a narrow ring of this length; raises as the class does.

        It breaks at an ``underpressure`` [Pa], by default that of one bar around and a fluid that bears no tension.
        """
        return SqueezeFilm(viscosity * length * width**3, floor, underpressure * length * width)

    @property
    def parameters(self) -> Parameters:
        """Return k, f and the largest pull."""
        return (self.coefficient, self.floor, self.tension)

    def part(self, share: float) -> SqueezeFilm:
        """Return the film of a ``share`` of the strip's length."""
        return SqueezeFilm(share * self.coefficient, self.floor, share * self.tension)
