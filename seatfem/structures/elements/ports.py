"""Ports on a contact patch, for all solid models: load and observation vectors, area and impedance.

Rings divide a disk, or a ring with inner and outer edge, by the distance from its axis, a cylinder by the position
along the axis, and every other patch by the distance from its rim, however many faces it has.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from seatfem.structures import errors, lands, materials, model
from seatfem.structures.elements.shape_functions import Surface
from seatfem.structures.rings import parted, ring_borders, ring_names
from seatfem.structures.shapes.loops import unshared

ONE_RADIUS = 1e-3  # largest relative difference of radii of a circle, or a cylinder
_POLYGON = 0.2  # largest relative error of a circle's area by the straight sides of coarse elements
_NEAREST = 8  # number of sides of the rim, those with the nearest middles, whose distance is computed


def ports_on(
    name: str,
    boundary: str,
    rings: int,
    patch: Surface,
    places: Callable[[Surface], model.Array],
    solids: Sequence[materials.Solid],
    region: NDArray[np.int32],
    n_nodes: int,
    lip: lands.FaceLip | None = None,
) -> dict[str, model.Port]:
    """Return a port for each of the ``rings`` of a boundary, NAME or NAME_1, NAME_2, ... from the inner edge outwards;
    with a ``lip``, for each ring of each arc, by their names.

    With n the outward normal, b = integral of
    n . N over the ring / its area A [m^2], over all 3 ``n_nodes`` displacements; the impedance is rho c_p A.

    Args:
        name, boundary: names of the port and of its boundary.
        patch: quadrature points of the boundary, fine enough for rings that end within elements.
        places: function to the (f, Q) positions of these points between the edges; used for several rings.

    Raises:
        ModelError: a patch without area.
    """
    if not patch.area > 0:
        raise errors.ModelError(f"port: boundary {boundary!r} has area {patch.area:g} m^2, which must be positive")
    shares, called = patch.weights[None], ring_names(name, rings)
    if lip is not None:
        shares, called = along(lip, patch), lip.division.names
    elif rings > 1:
        across = places(patch).ravel()
        shares = parted(across, patch.weights.ravel(), ring_borders(rings)).reshape(rings, *patch.weights.shape)
    waves = of_solids(patch, solids, region, lambda solid, normals: solid.density * solid.c_p_along(normals))
    ports = (_port(patch, weights, waves, n_nodes) for weights in shares)
    return dict(zip(called, ports, strict=True))


def along(lip: lands.FaceLip, patch: Surface) -> model.Array:
    """Return the (p, f, Q) weights of a patch's points in each part of a lip: arcs of equal area, divided into rings.

    Weights of points at a border are split between the parts; all parts add up to the patch.
    """
    around, across = lip.places(patch.places.reshape(-1, 3))
    arcs = parted(around, patch.weights.ravel(), np.arange(lip.arcs + 1) / lip.arcs)
    parts = np.zeros((lip.arcs, lip.rings, arcs.shape[1]))
    for arc, weights in enumerate(arcs):
        inside = np.flatnonzero(weights)
        parts[arc][:, inside] = parted(across[inside], weights[inside], ring_borders(lip.rings))
    return parts.reshape(-1, *patch.weights.shape)


def of_solids(
    patch: Surface,
    solids: Sequence[materials.Solid],
    region: NDArray[np.int32],
    value: Callable[[materials.Solid, model.Array], model.Array | float],
) -> model.Array:
    """Return ``value``, a function of a solid and the (g, Q, 3) normals, at the (f, Q) points of the patch."""
    out = np.empty(patch.weights.shape)
    for k, solid in enumerate(solids):
        of = region[patch.elements] == k
        out[of] = value(solid, patch.normals[of])
    return out


def _port(patch: Surface, weights: model.Array, waves: model.Array, n_nodes: int) -> model.Port:
    parts = np.einsum("fqi,fqa,fq->fia", patch.shapes, patch.normals, weights, optimize=True)
    vector = np.zeros((n_nodes, 3))
    np.add.at(vector, patch.cells, parts)
    area = float(weights.sum())
    return model.Port(vector.ravel() / area, area, float((waves * weights).sum()))


def places_across(mesh: Any, patch: Surface, cuts: NDArray[np.int64], copies: int) -> model.Array:
    """Return the (f, Q) position of each quadrature point by which rings divide the patch [m], see the module.

    Args:
        mesh: scikit-fem mesh.
        patch: quadrature points of the patch.
        cuts: facets on planes of symmetry through the z axis, beyond which the patch continues.
        copies: number of such sectors in the whole body.
    """
    points = patch.places.reshape(-1, 3)
    ends = np.asarray(mesh.p).T[_rim(mesh, patch.facets, cuts)]
    middle, axis = _axis(patch, copies)
    around = copies * float(np.abs(np.einsum("fqa,a,fq->", patch.normals, axis, patch.weights)))
    if around <= ONE_RADIUS * copies * patch.area:
        return (patch.places - middle) @ axis
    if len(ends) == 0 or _is_round(_radius(ends.reshape(-1, 3), middle, axis), around):
        return _radius(points, middle, axis).reshape(patch.weights.shape)
    return _distance(points, ends).reshape(patch.weights.shape)


def _rim(mesh: Any, facets: NDArray[np.int64], cuts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the (s, 2) vertices of the sides of one facet only, except those on planes of symmetry."""
    rim = unshared(np.sort(_sides(mesh, facets), axis=0).T)
    if len(cuts):
        rim = rim[~np.isin(rim, np.unique(np.asarray(mesh.facets)[:, cuts])).all(axis=1)]
    return np.asarray(rim, dtype=np.int64)


def _sides(mesh: Any, facets: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the (2, s) vertices of all sides of the facets, one after the other."""
    reference = mesh.elem.refdom
    elements = np.asarray(mesh.f2t)[0, facets]
    which = np.argmax(np.asarray(mesh.t2f)[:, elements] == facets, axis=0)
    sides = []
    for k, vertices in enumerate(reference.facets):
        corners = np.asarray(mesh.t)[:, elements[which == k]]
        sides += [corners[side] for side in reference.edges if set(side) <= set(vertices)]
    return np.concatenate(sides, axis=1)


def _axis(patch: Surface, copies: int) -> tuple[model.Array, model.Array]:
    """Return a point on the patch's axis and its direction: centroid and mean normal, or the z axis for sectors."""
    if copies > 1:
        return np.zeros(3), np.array([0.0, 0.0, 1.0])
    centre = np.einsum("fq,fqa->a", patch.weights, patch.places) / patch.area
    normal = np.einsum("fq,fqa->a", patch.weights, patch.normals)
    length = float(np.linalg.norm(normal))
    return centre, normal / length if length > 1e-6 * patch.area else np.array([0.0, 0.0, 1.0])


def _radius(points: model.Array, middle: model.Array, axis: model.Array) -> model.Array:
    off = points - middle
    return np.asarray(np.linalg.norm(off - np.outer(off @ axis, axis), axis=1))


def _is_round(radii: model.Array, area: float) -> bool:
    """Return whether the rim is one circle, or two with the patch's projected ``area`` between them."""
    largest = float(radii.max())
    outer = radii >= (radii.min() + largest) / 2
    circles = [radii[part] for part in (outer, ~outer) if part.any()]
    if any(np.ptp(circle) > ONE_RADIUS * largest for circle in circles):
        return False
    between = np.pi * (largest**2 - (circles[1].max() ** 2 if len(circles) > 1 else 0.0))
    return bool(abs(area - between) <= _POLYGON * between)


def _distance(points: model.Array, ends: model.Array) -> model.Array:
    """Return the (n,) distance of points (n, 3) from the nearest of the sides (s, 2, 3)."""
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    count = min(_NEAREST, len(ends))
    near = np.reshape(cKDTree(ends.mean(axis=1)).query(points, k=count)[1], (len(points), count))
    off = points[:, None] - start[near]
    share = np.einsum("nka,nka->nk", off, along[near]) / np.maximum(np.sum(along[near] ** 2, axis=2), 1e-300)
    gap = off - np.clip(share, 0.0, 1.0)[..., None] * along[near]
    return np.asarray(np.sqrt(np.min(np.sum(gap**2, axis=2), axis=1)))
