"""Stress below a Hertzian contact while it is pressed and let go, for criteria of several axes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from impact.exact.contact_stress import circular_axis_stress
from impact.greens.base import Array
from impact.life.curves import LifeError

DEPTHS: Final = 40
"""On the axis, down to 1.5 radii of the largest contact: the largest shear stress lies at 0.5."""
WIDTHS: Final = 60
"""Of the contact, from none to the largest."""


def hertz_path(force: float, *, stiffness: float, modulus: float, poisson: float = 0.3) -> Iterator[tuple[str, Array]]:
    """Yield names of depths with the (n, 6) stress there [Pa], while a contact of N = k d^(3/2) goes from 0 to
    ``force`` [N].

    Its radius is R = (3 k/(4 E*))^2; at the half-width a the pressure is p0 = 2 E* a/(pi R), and the stress on the axis
    p0 times that of `circular_axis_stress`. What a blow does in time does not matter: it takes each depth along one
    line of tensors, there and back, and the criteria of `impact.life.multiaxial` depend on that line alone.
    ``stiffness``: k [N/m^1.5]; ``modulus``: E* of both bodies [Pa]; ``poisson``: of the body that is judged. Raises
    `LifeError`: a stiffness or modulus that is not positive, a force below 0.

    Source: K. L. Johnson, Contact Mechanics, Cambridge 1985, 3.45, 4.22 - 4.24.
    """
    if not (stiffness > 0 and modulus > 0 and force >= 0):
        raise LifeError(
            f"a Hertzian contact of stiffness {stiffness:g} N/m^1.5 and modulus {modulus:g} Pa under {force:g} N: both "
            "must be positive, the force not below 0"
        )
    radius = (3 * stiffness / (4 * modulus)) ** 2
    widest = (3 * force * radius / (4 * modulus)) ** (1 / 3)
    widths = widest * np.arange(1, WIDTHS + 1) / WIDTHS
    for depth in widest * 1.5 * np.arange(DEPTHS + 1) / DEPTHS:
        path = np.zeros((WIDTHS + 1, 6))
        if widest > 0:
            across, along = circular_axis_stress(depth / widths, poisson=poisson)
            pressure = 2 * modulus * widths / (math.pi * radius)
            path[1:, 0] = path[1:, 1] = pressure * across
            path[1:, 2] = pressure * along
        yield f"{1e6 * depth:.3g} um below the contact", path
