"""The way from the unknowns of a Mindlin plate to the stress in its faces and its transverse shear.

Slopes of the rotations, and grad w - a, are taken at the 2 x 2 Gauss points of an element, where those of its nine
nodes are right to one order more than elsewhere (Barlow, IJNME 10 (1976) 243), and led on linearly to the point.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from seatfem.structures.elements.mindlin import SHEAR, PlateMesh, located, shapes_at
from seatfem.structures.fields.sites import Sites
from seatfem.structures.materials import Material
from seatfem.structures.model import Array, ModelError, SecondOrderModel

_NODES = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0)], dtype=float)
_GAUSS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / np.sqrt(3)


def plate_points(mesh: PlateMesh, points: Array) -> Sites:
    """Return the sites at points (P, 2) [m]. Raises `ModelError` of one that lies off the plate."""
    element, inside = located(mesh, points, np.full(len(points), "stress.points"))
    return Sites.of(points, np.arange(len(points)), element, inside.T)


def plate_nodes(mesh: PlateMesh) -> Sites:
    """Return all nodes of a plate."""
    site, element = mesh.cells.ravel(), np.repeat(np.arange(len(mesh.cells)), 9)
    return Sites.of(mesh.points, site, element, np.tile(_NODES, (len(mesh.cells), 1)).T)


def plate_stress(
    mesh: PlateMesh, material: Material, thickness: float, model: SecondOrderModel, sites: Sites
) -> sparse.csr_array:
    """Return (6 P, n) C, so that C u is the stress xx, yy, zz, yz, xz, xy at P sites of the face z = h/2 [Pa].

    With moments M = D ((1 - nu) kappa + nu tr(kappa) I), kappa = -sym grad a, it is 6 M/h^2 in the plane and zero
    across it; the opposite in the face z = -h/2.

    Raises:
        ModelError: a model of another mesh.
    """
    factor = -material.young * thickness / (2 * (1 - material.poisson**2))
    nu, (slopes, _) = material.poisson, _at_gauss(mesh, sites)
    rows = np.zeros((len(slopes), 6, 9, 3))
    rows[:, 0, :, 1], rows[:, 0, :, 2] = slopes[..., 0], nu * slopes[..., 1]
    rows[:, 1, :, 1], rows[:, 1, :, 2] = nu * slopes[..., 0], slopes[..., 1]
    rows[:, 5, :, 1], rows[:, 5, :, 2] = (1 - nu) / 2 * slopes[..., 1], (1 - nu) / 2 * slopes[..., 0]
    rows[..., 1:] *= factor / mesh.side
    return _of_unknowns(mesh, model, sites, rows)


def plate_shear(
    mesh: PlateMesh, material: Material, thickness: float, model: SecondOrderModel, sites: Sites
) -> sparse.csr_array:
    """Return the (2 P, n) matrix to the transverse shear xz, yz in the mid-surface [Pa], 3/2 of the mean kappa G (grad
    w - a).

    Raises as `plate_stress`.
    """
    slopes, shapes = _at_gauss(mesh, sites)
    rows = np.zeros((len(slopes), 2, 9, 3))
    rows[..., 0] = np.swapaxes(slopes, 1, 2)
    rows[:, 0, :, 1] = rows[:, 1, :, 2] = -shapes / mesh.side
    return _of_unknowns(mesh, model, sites, 1.5 * SHEAR * material.lame[1] * rows)


def _at_gauss(mesh: PlateMesh, sites: Sites) -> tuple[Array, Array]:
    """Return (E, 9, 2) slopes of the shape functions and (E, 9) their values, led on from the Gauss points."""
    shapes, slopes = shapes_at(_GAUSS)
    s, t = sites.inside
    weights = (1 + 3 * s[:, None] * _GAUSS[:, 0]) * (1 + 3 * t[:, None] * _GAUSS[:, 1]) / 4
    cells: NDArray[np.int64] = mesh.cells[sites.element]
    tangents = np.einsum("gks,ekc->egsc", slopes, mesh.points[cells])
    along = np.einsum("gks,egcs->egkc", slopes, np.linalg.inv(tangents), optimize=True)
    return np.einsum("eg,egkc->ekc", weights, along), weights @ shapes


def _of_unknowns(mesh: PlateMesh, model: SecondOrderModel, sites: Sites, rows: Array) -> sparse.csr_array:
    """Return (R P, n) matrix of (E, R, 9, 3) each element's share of a site, by the unknowns w and l a of its nodes."""
    if model.dofs is None or model.dofs.points.shape[1] != len(mesh.points):
        raise ModelError("the model's unknowns are not those of this plate: use the mesh of its assembly")
    count = rows.shape[1]
    which = count * sites.site[:, None, None] + np.arange(count)[:, None]
    unknowns = (3 * mesh.cells[sites.element][:, :, None] + np.arange(3)).reshape(len(rows), 1, -1)
    which, unknowns = np.broadcast_arrays(which, unknowns)
    data = rows.reshape(len(rows), count, -1) * sites.share[:, None, None]
    matrix = sparse.coo_array(
        (data.ravel(), (which.ravel(), unknowns.ravel())), (count * len(sites), 3 * len(mesh.points))
    )
    return sparse.csr_array(matrix.tocsc()[:, model.dofs.free])
