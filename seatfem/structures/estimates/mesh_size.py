"""Element sizes for an error of g, and the error of g by given sizes.

    error of g = PATCH (contact_size/width)^1.5 + size (WAVE band/c_s + BODY/depth)

width: of the struck face, c_s/band: the shear wavelength at the band edge, depth: of the body behind the face; elements
of order 2. The constants bound what was measured on seats of every kind but the finest plates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from seatfem.structures.estimates.patch import Patch

PATCH: Final = 0.03
PATCH_ORDER: Final = 1.5
WAVE: Final = 0.03
BODY: Final = 0.02
BENT: Final = 0.12  # in its place for a plate that bends on a clamped rim
ACROSS: Final = 0.5  # elements of order 2 across the struck face, at least: one, twice as long along it
FIRST_ORDER: Final = 6.0  # how much larger the error is with elements of order 1
ERRORS: Final = (0.5, 0.3, 0.2, 0.13, 0.09, 0.06, 0.04, 0.025, 0.016, 0.01, 0.006, 0.004, 0.0025, 0.0016, 0.001)
"""Errors of g that meshes are chosen for, so that different contact scenes share a seat."""


@dataclass(frozen=True)
class Sizes:
    """Element sizes [m]: in the bulk and on the struck face."""

    size: float
    contact_size: float


def sizes_for(patch: Patch, band: float, error: float, order: int = 2) -> Sizes:
    """Return the coarsest sizes with an error of g of at most ``error``, half of it at the patch, half in the bulk."""
    half = error / 2 / _order(order)
    contact = patch.width * min(1 / ACROSS, (half / PATCH) ** (1 / PATCH_ORDER))
    size = min(patch.depth, patch.c_s / band, half / _per_size(patch, band))
    return Sizes(_rounded(max(size, contact)), _rounded(contact))


def mesh_error(patch: Patch, band: float, sizes: Sizes, order: int = 2) -> float:
    """Return the relative error of g."""
    local = PATCH * (min(sizes.contact_size, 2 * patch.width) / patch.width) ** PATCH_ORDER
    return float(_order(order) * (local + sizes.size * _per_size(patch, band)))


def per_wavelength(patch: Patch, band: float, sizes: Sizes) -> float:
    """Return the elements per shear wavelength at the band edge."""
    return patch.c_s / (band * sizes.size)


def _per_size(patch: Patch, band: float) -> float:
    return WAVE * band / patch.c_s + (BENT if patch.bending > 0 else BODY) / patch.depth


def _order(order: int) -> float:
    return FIRST_ORDER if order == 1 else 1.0


def _rounded(size: float) -> float:
    """Return the number rounded down to two digits."""
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return float(f"{math.floor(size / unit * (1 + 1e-9)) * unit:.3g}")
