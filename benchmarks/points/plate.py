"""Mindlin's plate in spectral elements: stiffness, lumped mass and modes.

With the deflection w and the rotations a of the normals, D = E h^3/(12 (1 - nu^2)) and kappa = 5/6 the energy is

    2 U = integral D (a_x,x^2 + a_y,y^2 + 2 nu a_x,x a_y,y + (1 - nu)/2 (a_x,y + a_y,x)^2) + kappa G h |grad w - a|^2,
    2 T = integral rho h w'^2 + rho h^3/12 |a'|^2.

Nodes are the points of quadrature, so that the mass is diagonal; frequencies converge with the power 2 order of the
size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, diags, identity
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from points.gll import Array
from points.mesh import Mesh

SHEAR_FACTOR = 5 / 6
SHIFT = 1e-8  # of a free plate's stiffness, over its largest diagonal term: far above round-off, below its modes
MORE_MODES = 1.35  # of a plate with free edges, over the count of Weyl's leading term


@dataclass(frozen=True)
class Material:
    """An isotropic elastic material: young [Pa], poisson, density [kg/m^3]."""

    young: float
    poisson: float
    density: float

    @property
    def shear(self) -> float:
        """Shear modulus [Pa]."""
        return self.young / (2 * (1 + self.poisson))


@dataclass(frozen=True)
class Plate:
    """A thin plate: its mesh, material, thickness [m] and the degrees of freedom (3 node + 0, 1, 2 of w, a_x, a_y) that
    are held."""

    mesh: Mesh
    material: Material
    thickness: float
    held: NDArray[np.int64]

    @property
    def rigidity(self) -> float:
        """D [N m]."""
        return self.material.young * self.thickness**3 / (12 * (1 - self.material.poisson**2))

    def matrices(self) -> tuple[csc_matrix, Array]:
        """Return the stiffness (3 n, 3 n) and the diagonal of the mass (3 n,)."""
        nu, h = self.material.poisson, self.thickness
        by_x, by_y, weights = self.mesh.gradients()
        bend, shear = self.rigidity * weights, SHEAR_FACTOR * self.material.shear * h * weights

        def product(left: Array, scale: Array, right: Array) -> Array:
            return np.asarray(np.swapaxes(left, 1, 2) @ (scale[..., None] * right))

        bed = shear[:, :, None] * np.eye(weights.shape[1])
        xx, yy, xy = (product(*ends) for ends in ((by_x, bend, by_x), (by_y, bend, by_y), (by_x, bend, by_y)))
        yx = np.swapaxes(xy, 1, 2)
        deflection = product(by_x, shear, by_x) + product(by_y, shear, by_y)
        w_x, w_y = (-np.swapaxes(by, 1, 2) * shear[:, None, :] for by in (by_x, by_y))
        a_xx, a_yy = xx + (1 - nu) / 2 * yy + bed, yy + (1 - nu) / 2 * xx + bed
        a_xy = nu * xy + (1 - nu) / 2 * yx
        t = (0, 2, 1)
        rows = [[deflection, w_x, w_y], [w_x.transpose(t), a_xx, a_xy], [w_y.transpose(t), a_xy.transpose(t), a_yy]]
        nodes = self.mesh.elements
        at = [np.broadcast_to(3 * nodes[:, :, None] + k, (*nodes.shape, nodes.shape[1])).ravel() for k in range(3)]
        to = [np.broadcast_to(3 * nodes[:, None, :] + k, (*nodes.shape, nodes.shape[1])).ravel() for k in range(3)]
        entries = [(rows[i][j].ravel(), at[i], to[j]) for i in range(3) for j in range(3)]
        values, i, j = (np.concatenate(part) for part in zip(*entries, strict=True))
        size = 3 * len(self.mesh.points)
        area = np.bincount(nodes.ravel(), weights.ravel(), minlength=len(self.mesh.points))
        density = self.material.density * h * np.array([1, h**2 / 12, h**2 / 12])
        return csc_matrix((values, (i, j)), shape=(size, size)), np.outer(area, density).ravel()

    def modes(self, count: int) -> tuple[Array, Array]:
        """Return the lowest ``count`` circular frequencies [rad/s] and deflections (n, count) of unit modal mass, those
        symmetric about the x axis and the others apart."""
        stiffness, mass = self.matrices()
        free = np.setdiff1d(np.arange(len(mass)), self.held)
        families = []
        for sign in (1, -1):
            basis = self._family(sign)[free]
            basis = basis[:, np.diff(basis.indptr) > 0]
            half = csc_matrix(basis.T @ stiffness[free][:, free] @ basis)
            lumped = basis.multiply(basis).T @ mass[free]
            squares, vectors = lowest_modes(half, lumped, math.ceil(0.54 * count) + 4, free=len(self.held) == 0)
            shapes = np.zeros((len(mass), len(squares)))
            shapes[free] = basis @ vectors
            families.append((squares, shapes[::3]))
        squares = np.concatenate([family[0] for family in families])
        complete = min(family[0][-1] for family in families)
        order = np.argsort(squares)[: min(count, int((squares <= complete).sum()))]
        shapes = np.concatenate([family[1] for family in families], axis=1)
        return np.sqrt(np.maximum(squares[order], 0.0)), shapes[:, order]

    def _family(self, sign: int) -> csc_matrix:
        """Return the columns (3 n, m) of all motions in which w and a_x are even (``sign`` 1) or odd (-1) in y."""
        nodes, mirror = np.arange(len(self.mesh.points)), self.mesh.mirrored()
        signs = sign * np.array([1, 1, -1])
        pairs, axis = nodes[nodes < mirror], nodes[nodes == mirror]
        rows, columns, values = [], [], []
        number = 0
        for component, factor in enumerate(signs):
            at = number + np.arange(len(pairs))
            rows += [3 * pairs + component, 3 * mirror[pairs] + component]
            columns += [at, at]
            values += [np.full(len(pairs), math.sqrt(0.5)), np.full(len(pairs), factor * math.sqrt(0.5))]
            number += len(pairs)
            if factor > 0:
                rows.append(3 * axis + component)
                columns.append(number + np.arange(len(axis)))
                values.append(np.ones(len(axis)))
                number += len(axis)
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        return csc_matrix(entries, shape=(3 * len(nodes), number))

    def modes_below(self, frequency: float) -> tuple[Array, Array]:
        """Return the `modes` up to a frequency [Hz]; their number is estimated, and narrow plates have more."""
        number = math.sqrt(self.material.density * self.thickness / self.rigidity)
        count = math.ceil(MORE_MODES * self.mesh.gradients()[2].sum() * frequency * number / 2) + 10
        while (inside := (found := self.modes(count))[0] <= 2 * np.pi * frequency).all():
            count = math.ceil(1.2 * count)
        return found[0][inside], found[1][:, inside]


def lowest_modes(stiffness: csc_matrix, mass: Array, count: int, *, free: bool = False) -> tuple[Array, Array]:
    """Return the lowest eigenvalues of K - x M, M diagonal, and vectors of unit modal mass, by inversion of K, or of
    K + s M of a ``free`` body."""
    roots = 1 / np.sqrt(mass)
    scaled = (diags(roots) @ stiffness @ diags(roots)).tocsc()
    shift = SHIFT * float(scaled.diagonal().max()) if free else 0.0
    shifted = (scaled + shift * identity(len(mass))).tocsc()
    factor = splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    inverse = LinearOperator(scaled.shape, matvec=factor.solve, dtype=float)
    kept = min(len(mass) - 1, math.ceil(1.4 * count) + 20)
    values, vectors = eigsh(scaled, count, sigma=-shift, OPinv=inverse, v0=np.ones(len(mass)), ncv=kept)
    order = np.argsort(values)
    return values[order], roots[:, None] * vectors[:, order]
