"""The way to a Green's function that needs no more than scikit-fem and SciPy: what ours is measured against."""

from __future__ import annotations

from typing import Any

import numpy as np
import skfem
from scipy.linalg import eigh
from skfem.helpers import dot
from skfem.models.elasticity import linear_elasticity

from seatfem.structures.materials import Material


def assembled(mesh: Any, material: Material) -> tuple[Any, Any, np.ndarray[Any, Any]]:
    """K, M and the vector of the mean pressure of the free unknowns, by scikit-fem's forms on tetrahedra of order 2."""

    @skfem.BilinearForm
    def inertia(u: Any, v: Any, _: Any) -> Any:
        return material.density * dot(u, v)

    @skfem.LinearForm
    def pressure(v: Any, w: Any) -> Any:
        return dot(v, w.n)

    @skfem.Functional
    def one(w: Any) -> Any:
        return np.ones_like(w.x[0])

    element = skfem.ElementVector(skfem.ElementTetP2())
    stiff = skfem.asm(linear_elasticity(*material.lame), skfem.Basis(mesh, element, intorder=4))
    mass = skfem.asm(inertia, skfem.Basis(mesh, element, intorder=6))
    patch = skfem.FacetBasis(mesh, element, facets="contact", intorder=4)
    free = np.setdiff1d(np.arange(stiff.shape[0]), patch.get_dofs("fixed").flatten())
    K, M = (matrix[free][:, free].tocsc() for matrix in (stiff, mass))
    return K, M, (skfem.asm(pressure, patch) / skfem.asm(one, patch))[free]


def dense_modes(K: Any, M: Any, b: Any) -> tuple[Any, Any, float]:
    """Squares of all frequencies, the port's share in the shapes, static compliance: LAPACK's divide and conquer, 6 n^2
    numbers of memory."""
    square, vectors = eigh(
        K.toarray(order="F"), M.toarray(order="F"), driver="gvd", overwrite_a=True, overwrite_b=True, check_finite=False
    )
    shares = b @ vectors
    return square, shares, float(np.sum(shares**2 / square))
