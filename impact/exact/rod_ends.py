"""Green's function of a free rod that is struck at both ends, as in the middle of a chain of rods."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from impact.exact.rods import DelayRod
from impact.greens import base
from impact.greens.answers import Array, check_positive


@dataclass(frozen=True)
class TwoEndedRod(base.ExactPort):
    """Undamped free rod with a port at either end, both displaced along the same normal:

    g_11 = g_22 = (1/Z) (H(t) + 2 sum_k H(t - k T)),  g_12 = (2/Z) sum_k H(t - (k - 1/2) T),  k = 1, 2, ...

    ``impedance``: Z = rho c A [N s/m]; ``round_trip``: T = 2 l/c [s].
    """

    kind: ClassVar[str] = "two_ended_rod"
    memory: ClassVar[str] = "delay kernel"
    impedance: float
    round_trip: float

    @property
    def one(self) -> DelayRod:
        """Return the Green's function of one end alone, a free rod."""
        return DelayRod(self.impedance, self.round_trip, 1.0)

    @property
    def ports(self) -> tuple[str, ...]:
        return ("front", "back")

    @property
    def highest_rate(self) -> float:
        return self.one.highest_rate

    def inverse_mass(self) -> Array:
        """Return 1/(rho A l) between any two ends [1/kg]."""
        return np.full((2, 2), float(self.one.inverse_mass()[0, 0]))

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        if i == j:
            return self.one.impulse_response(t)
        arrived = np.floor(np.asarray(t, dtype=float) / self.round_trip + 0.5)
        return np.asarray(2 * np.maximum(arrived, 0.0) / self.impedance)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        if i == j:
            return self.one.step_response(t)
        return self.one.displacement_at(np.maximum(np.asarray(t, dtype=float), 0.0), 1.0)

    def static_compliance(self) -> Array:
        return np.full((2, 2), math.inf)

    def initial_value(self) -> Array:
        return np.eye(2) / self.impedance


def rod_of_two_ends(*, young: float, density: float, area: float, length: float) -> TwoEndedRod:
    """Return an undamped free rod, E [Pa], rho [kg/m^3], A [m^2], l [m], struck at its ends "front" and "back".

    Displacements of both ends are along one normal: of two forces that press the rod together one is < 0. Raises
    `GreensFunctionError` for an argument that is not positive and finite.
    """
    check_positive(young=young, density=density, area=area, length=length)
    return TwoEndedRod(area * math.sqrt(young * density), 2 * length / math.sqrt(young / density))
