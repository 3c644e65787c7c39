"""The ports of a struck patch, in every model alike: what pushes it, where it is observed, its area and impedance."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from seatfem.structures.elements.surfaces import Surface
from seatfem.structures.errors import ModelError
from seatfem.structures.materials import Solid
from seatfem.structures.model import Array, Port
from seatfem.structures.rings import divided, ring_names


def ports_on(
    name: str,
    boundary: str,
    rings: int,
    surface: Callable[[bool], Surface],
    places: Callable[[Surface], Array],
    solids: Sequence[Solid],
    region: NDArray[np.int32],
    n_nodes: int,
) -> dict[str, Port]:
    """A port for each of the ``rings`` of a boundary, NAME or NAME_1, NAME_2, ... from its inner edge on.

    With n the outward normal, b = integral of n . N over the ring / its area A, over all 3 ``n_nodes`` displacements;
    A = integral of 1 [m^2]; the impedance is the integral of rho c_p [N s/m].

    Args:
        name: of the port.
        boundary: of the mesh, for messages.
        surface: the patch; with true, by a quadrature that is fine enough for rings that end within elements.
        places: (f, Q) where the points of the patch lie between its edges; asked for more rings than one.
        solids, region: the solids and which of them each element is made of.

    Raises:
        ModelError: a patch without area.
    """
    patch = surface(rings > 1)
    if not patch.area > 0:
        raise ModelError(f"port: boundary {boundary!r} has area {patch.area:g} m^2")
    shares = patch.weights[None]
    if rings > 1:
        shares = divided(places(patch).ravel(), patch.weights.ravel(), rings).reshape(rings, *patch.weights.shape)
    waves = of_solids(patch, solids, region, lambda solid, normals: solid.density * solid.c_p_along(normals))
    made = (_port(patch, weights, waves, n_nodes) for weights in shares)
    return dict(zip(ring_names(name, rings), made, strict=True))


def of_solids(
    patch: Surface,
    solids: Sequence[Solid],
    region: NDArray[np.int32],
    value: Callable[[Solid, Array], Array | float],
) -> Array:
    """(f, Q) ``value`` of the solid behind each point of the patch, from it and the (g, Q, 3) normals there."""
    out = np.empty(patch.weights.shape)
    for k, solid in enumerate(solids):
        of = region[patch.elements] == k
        out[of] = value(solid, patch.normals[of])
    return out


def _port(patch: Surface, weights: Array, waves: Array, n_nodes: int) -> Port:
    parts = np.einsum("fqi,fqa,fq->fia", patch.shapes, patch.normals, weights, optimize=True)
    vector = np.zeros((n_nodes, 3))
    np.add.at(vector, patch.cells, parts)
    area = float(weights.sum())
    return Port(vector.ravel() / area, area, float((waves * weights).sum()))
