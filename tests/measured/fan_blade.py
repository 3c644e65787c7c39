"""A curved blade as a solid of curved hexahedra, clamped along one curved edge."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import skfem

from seatfem import assemble, solve_modes
from seatfem.structures.materials import Material
from seatfem.structures.model import Array
from seatfem.units import parse_quantity
from seatfem.verify import Estimate, MeasuredSet

MODES = 7
CELLS = (12, 24)
"""Quadratic elements along each side, one through the thickness."""


def predict(record: MeasuredSet) -> Mapping[str, Estimate]:
    """Return the frequencies. Bars: what the finer mesh changes, and the tolerance of the modulus."""
    coarse, fine = (_frequencies(record.geometry, n) for n in CELLS)
    modulus = record.geometry["tolerance_of_modulus"] / 2 * fine
    bars = np.hypot(coarse - fine, modulus)
    return {f"frequency of mode {k + 1}": Estimate(fine[k], bars[k]) for k in range(MODES)}


def _frequencies(geometry: Mapping[str, Any], n: int) -> Array:
    lengths = [parse_quantity(geometry[key], "length") for key in ("length", "arc", "radius", "thickness")]
    length, arc, radius, thickness = lengths
    angles, along = np.linspace(0.0, arc / radius, n + 1), np.linspace(0.0, length, n + 1)
    flat = skfem.MeshHex.init_tensor(angles, along, np.array([0.0, 1.0])).with_boundaries(
        {"fixed": lambda x: x[1] < 1e-9}
    )
    square = skfem.MeshHex2.from_mesh(flat)
    angle, y, through = square.doflocs
    r = radius + thickness * (through - 0.5)
    bent = skfem.MeshHex2(np.array([r * np.sin(angle), y, r * np.cos(angle)]), square.t, _boundaries=flat.boundaries)
    young, density = parse_quantity(geometry["young"], "pressure"), parse_quantity(geometry["density"], "density")
    model = assemble(bent, Material(young, geometry["poisson"], density), ports={}, order=2)
    return solve_modes(model, MODES, shift_hz=100.0).frequencies_hz
