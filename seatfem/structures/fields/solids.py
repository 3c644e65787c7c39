"""The way from the unknowns of a solid, in three dimensions or a harmonic of a body of revolution, to its stress.

Stress is evaluated where it is asked for, by the element's own shape functions, and averaged over the elements that
meet there. Of elements of order p its error falls at least as h^p where the displacement is smooth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy import sparse

from seatfem.structures.elements.assembly import PROJECT_ABOVE, solids_by_region
from seatfem.structures.elements.revolved_elements import Section, nearly_incompressible, revolved_strains
from seatfem.structures.elements.shape_functions import Discretization, discretize, gradients, values
from seatfem.structures.fields.sites import Array, Sites
from seatfem.structures.materials import Solid
from seatfem.structures.model import DofMap, ModelError, SecondOrderModel

COMPONENTS: Final = ("xx", "yy", "zz", "yz", "xz", "xy")
"""Of stress; in a body of revolution rr, tt, zz, tz, rz, rt at the angle 0, the shear tz and rt at a quarter wave."""
_TO_AXIS: Final = 1e-4  # of an element: where 1/r is taken in place of the axis
_BLOCK: Final = 1024  # sites
_INDICES: Final = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


def elements_of(mesh: Any, order: int | None = None) -> Discretization:
    """Return the elements as `assemble` or, of a mesh in two dimensions, `assemble_axisymmetric` numbers them."""
    mesh = getattr(mesh, "mesh", mesh)
    if mesh.dim() == 3:
        return discretize(mesh, order)
    section = Section.of(mesh, order)
    corners = np.ascontiguousarray(mesh.dofs.element_dofs.T, dtype=np.int32)
    cells = np.ascontiguousarray(section.cells.T, dtype=np.int32)
    places = np.ascontiguousarray(mesh.doflocs.T)
    return Discretization(mesh, section.element, mesh.elem(), section.order, cells, corners, places, False)


@dataclass(frozen=True)
class StressOperator:
    """(6 P, n) C, so that C @ u is the stress of the unknowns u (n,) or (n, k) at P sites [Pa], `COMPONENTS` of each.

    Its rows are made for `_BLOCK` sites at once, whenever it multiplies: of 20,000 sites they would take a gigabyte.
    """

    made: Discretization
    dofs: DofMap
    sites: Sites
    elasticity: Array
    strain: Callable[[Discretization, Sites], Array]

    def __matmul__(self, unknowns: Array) -> Array:
        out = np.empty((6 * len(self.sites), *unknowns.shape[1:]))
        for first in range(0, len(self.sites), _BLOCK):
            chosen = np.zeros(len(self.sites), dtype=bool)
            chosen[first : first + _BLOCK] = True
            out[6 * first : 6 * (first + _BLOCK)] = self._rows(self.sites.at(chosen)) @ unknowns
        return out

    def _rows(self, sites: Sites) -> sparse.csr_array:
        strain = self.strain(self.made, sites)
        flat = strain.reshape(len(strain), 6, -1)
        stress = self.elasticity[sites.element] @ flat * sites.share[:, None, None]
        rows = 6 * sites.site[:, None, None] + np.arange(6)[:, None]
        cells = self.made.cells[sites.element].astype(np.int64)
        columns = (3 * cells[:, :, None] + np.arange(3)).reshape(len(flat), 1, -1)
        rows, columns = np.broadcast_arrays(rows, columns)
        shape = (6 * len(sites), 3 * self.made.size)
        nodal = sparse.coo_array((stress.ravel(), (rows.ravel(), columns.ravel())), shape).tocsr()
        dofs = self.dofs
        return sparse.csr_array(nodal[:, dofs.free] if dofs.turned is None else nodal @ dofs.turned)


def solid_stress(
    made: Discretization,
    material: Solid | Mapping[str, Any],
    model: SecondOrderModel,
    sites: Sites,
    *,
    harmonic: int = 0,
) -> StressOperator:
    """Return the stress at sites.

    Args:
        made: the elements (`elements_of`).
        material: as the model was assembled with.
        model: it, with its `DofMap`.
        sites: where.
        harmonic: of a body of revolution: C u are amplitudes, of cos(n th), in tz and rt of sin(n th).

    Raises:
        ModelError: elements or a model that do not belong together, a material that is nearly incompressible, whose
            volume change the elements project: its stress is not that of the displacement.
    """
    dofs = model.dofs
    if dofs is None or dofs.points.shape[1] != made.size:
        raise ModelError("the model's unknowns are not those of these elements: use the mesh and order of its assembly")
    solids, region = solids_by_region(made.mesh, material)
    elasticity = np.array([solid.elasticity for solid in solids])
    if (soft := nearly_incompressible(elasticity, PROJECT_ABOVE)).any():
        name = solids[int(np.argmax(soft))].name
        raise ModelError(f"material {name!r}: poisson must be at most {PROJECT_ABOVE} for stress to be known")
    return StressOperator(made, dofs, sites, elasticity[region], _strain if made.mesh.dim() == 3 else _around(harmonic))


def _slopes(made: Discretization, element: Any, inside: Array) -> Array:
    """Return the (E, L, d) gradients of the shape functions along the coordinates."""
    jacobian = np.einsum("evc,eva->eac", gradients(made.geometry, inside), made.places[made.corners[element]])
    return np.asarray(gradients(made.element, inside) @ np.linalg.inv(jacobian))


def _strain(made: Discretization, sites: Sites) -> Array:
    """Return the (E, 6, L, 3) strains of unit nodal displacements, shear as angles."""
    slopes = _slopes(made, sites.element, sites.inside)
    out = np.zeros((len(slopes), 6, slopes.shape[1], 3))
    for row, (a, b) in enumerate(_INDICES):
        out[:, row, :, a] = slopes[..., b]
        out[:, row, :, b] = slopes[..., a]
    return out


def _around(harmonic: int) -> Callable[[Discretization, Sites], Array]:
    """Return the same of unit amplitudes (U, V, W), as in `revolved_elements`."""

    def strain(made: Discretization, sites: Sites) -> Array:
        on_axis = sites.points[sites.site, 0] <= _TO_AXIS * _TO_AXIS * made.places[:, 0].max()
        centre = np.asarray(made.element.refdom.p, dtype=float).mean(axis=1)[:, None]
        inside = sites.inside + np.where(on_axis, _TO_AXIS, 0.0) * (centre - sites.inside)
        slopes = _slopes(made, sites.element, inside)
        radius = np.einsum("ev,ev->e", values(made.geometry, inside), made.places[made.corners[sites.element], 0])
        by_r, by_z, over = slopes[..., 0], slopes[..., 1], values(made.element, inside) / radius[:, None]
        out = np.zeros((len(slopes), 6, slopes.shape[1], 3))
        revolved_strains(by_r, by_z, over, harmonic, out.transpose(0, 2, 1, 3))
        return out

    return strain
