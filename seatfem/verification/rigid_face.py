"""A rigid face on the half-space: the struck patch in rings, each with a contact of its own."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.model import Array, Material
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.rings import face_compliance, ring_borders, ring_names, with_fewer_rings
from seatfem.structures.statics import spring_of
from seatfem.verification.case import Case, Estimate, richardson
from seatfem.verification.grids import section, split
from seatfem.verification.levels import recomputed

_BOUSSINESQ = "Boussinesq 1885; Johnson, Contact Mechanics, 3.4"
_GROUND = 0.25  # Poisson's ratio
_FINEST = 8  # rings


def rigid_face_cases() -> tuple[Case, ...]:
    """w E a/((1 - nu^2) F) of a flat punch, 1/2, from 2, 4 and 8 rings; a patch that moves as its mean has 0.5404."""

    @cache
    def compliance(young: float) -> Array:
        """(8, 8) of the rings, at infinite depth; see `seatfem.verification.ground`."""
        one, two, four = (_rings(radius, young) for radius in (8.0, 16.0, 32.0))
        before, after = 2 * two - one, 2 * four - two
        return np.asarray(after + (after - before) / 7)

    def solve(rings: int, young: float) -> float:
        ground = spring_of(compliance(young), 0.0, ring_names("contact", _FINEST), {})
        return face_compliance(with_fewer_rings(ground, rings)) / (1 - _GROUND**2)

    def limit() -> Estimate:
        return richardson(lambda rings: solve(rings, 1.0), _FINEST // 4, 2)

    compute = recomputed(lambda k: solve(_FINEST, k), limit)
    quantity = "w E a/((1 - nu^2) F), in rings"
    return (Case("half-space of finite elements, rigid disk", quantity, 0.5, 1e-6, _BOUSSINESQ, compute),)


def _rings(radius: float, young: float) -> Array:
    """(8, 8) compliance of the rings of a disk of radius 1 on a clamped cylinder of this radius and depth."""
    far = 2.0 ** np.arange(1, round(math.log2(radius)) + 1)
    r = split([*np.sqrt(ring_borders(_FINEST)), 1.02, 1.06, 1.2, 1.5, *far], 2)
    z = split([0.0, 0.01, 0.04, 0.12, 0.3, 0.6, 1.0, 1.5, *far], 2)
    mesh = section(r, z).with_boundaries({"contact": lambda x: (x[1] < 1e-12) & (x[0] < 1.0)})
    material = Material(young, _GROUND, 1.0)
    model = assemble_axisymmetric(mesh, material, fixed=("outer", "top"), order=2, rings=_FINEST)
    return np.asarray(model.port_matrix.T @ factorize(model.K).solve(model.port_matrix))
