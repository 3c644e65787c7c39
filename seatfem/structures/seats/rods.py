"""A bar as a rod: in closed form, and with the lateral inertia that the closed form leaves out."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

import impact
from impact.greens.base import GreensFunction
from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.kinds.parts import Material
from seatfem.structures.kinds.seats import BarSeat

MODES: Final = 200  # of Love's rod; the last has a wavelength of a hundredth of the length


def rod_of(seat: BarSeat) -> GreensFunction:
    """The elementary rod of the bar's cross-section, clamped at its far end."""
    material = _isotropic(seat)
    return impact.fixed_rod(
        young=material.young,
        density=material.density,
        area=seat.width * seat.height,
        length=seat.length,
        damping_ratio=seat.damping_ratio,
    )


def love_rod(seat: BarSeat) -> ModalGreens:
    """The rod with lateral inertia (Love): mode n is slower by sqrt(s) and heavier by s, s = 1 + nu^2 k_n^2 r^2.

    k_n = (2n - 1) pi/(2 l), r^2 = (width^2 + height^2)/12; the static compliance is the elementary rod's. Source: Love,
    A Treatise on the Mathematical Theory of Elasticity, article 278.
    """
    material = _isotropic(seat)
    area = seat.width * seat.height
    k = (np.arange(MODES) + 0.5) * math.pi / seat.length
    s = 1 + material.poisson**2 * k**2 * (seat.width**2 + seat.height**2) / 12
    omega = math.sqrt(material.young / material.density) * k / np.sqrt(s)
    shapes = np.sqrt(2 / (material.density * area * seat.length * s))
    left_out = max(seat.length / (material.young * area) - float(np.sum(shapes**2 / omega**2)), 0.0)
    zeta = np.full(MODES, seat.damping_ratio)
    return ModalGreens(omega, zeta, shapes[:, None], Residual.spring(left_out))


def _isotropic(seat: BarSeat) -> Material:
    assert isinstance(seat.material, Material)
    return seat.material
