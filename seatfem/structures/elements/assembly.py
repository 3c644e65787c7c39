"""Mass, damping, stiffness and port vectors of a linear elastic solid on a scikit-fem mesh.

With T_ij = integral of grad phi_i (x) grad phi_j over the body, the 3 x 3 blocks that couple nodes i and j are

    K_ij = lambda T_ij + mu T_ij' + mu tr(T_ij) I   (isotropic),     (K_ij)_ab = C_acbd (T_ij)_cd   (orthotropic)
    M_ij = rho I integral of phi_i phi_j

Shape functions and quadrature are scikit-fem's; the loop over the elements is compiled and writes straight into the
sparsity pattern of the unknowns, which are numbered node by node. In nearly incompressible solids the volume change
of each element is projected on fewer functions against locking (Hughes 1980): its mean in tetrahedra of order 2 and
hexahedra of order 1, linear functions in hexahedra of order 2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from impact.notices import Progress, silent
from impact.quantities import brief_value
from seatfem.structures.elements import element_kernels, shape_functions
from seatfem.structures.elements.supports import (
    STRUCK,
    Freedom,
    Support,
    freedom,
    held,
    places_across,
    ports_on,
    spread_supports,
    whole_model,
)
from seatfem.structures.lands import FaceLip
from seatfem.structures.materials import Material, Orthotropic, Solid, material_from, stiffness_tensor
from seatfem.structures.model import Array, DofMap, ModelError, Port, SecondOrderModel

Mass = Literal["consistent", "nodal"]
Dilatation = Literal["auto", "full", "projected"]

PROJECT_ABOVE = 0.45  # Poisson's ratio above which the volume change is projected
_MODES = {("RefTet", 2): 1, ("RefHex", 1): 1, ("RefHex", 2): 4}  # number of functions on which it is projected
_FINE_RULE = 14  # degree of the quadrature over a patch whose rings end within elements
_CUTS = ("symmetry_0", "symmetry_1")
_CHUNK = 16_384  # elements between two reports of progress


def assemble(
    mesh: Any,
    material: Solid | Mapping[str, Any],
    *,
    fixed: str | Sequence[str] = "fixed",
    sliding: str | Sequence[str] = (),
    antisymmetric: str | Sequence[str] = (),
    supports: Sequence[Support] = (),
    ports: Mapping[str, str] = STRUCK,
    order: int = 0,
    mass: Mass = "consistent",
    dilatation: Dilatation = "auto",
    rayleigh: tuple[float, float] = (0.0, 0.0),
    copies: int = 1,
    rings: int = 1,
    lip: FaceLip | None = None,
    progress: Progress = silent,
) -> SecondOrderModel:
    """Assemble small-strain elasticity by displacement elements.

    Args:
        mesh: scikit-fem mesh with named boundaries, coordinates in m, or an object that carries one as ``.mesh``.
        material: a `Material` or `Orthotropic`; a mapping with young [Pa], poisson and density [kg/m^3]; or a solid for
            each of the mesh's named regions (``mesh.subdomains``), which together cover it once.
        fixed: boundaries without displacement; ``()`` for a free body.
        sliding: plane boundaries without normal displacement: planes of symmetry.
        antisymmetric: plane boundaries without tangential displacement.
        supports: springs and dashpots on boundaries (`seatfem.structures.elements.supports`).
        ports: boundary name of each port's patch.
        order: 1 or 2, polynomial order of the displacement; 0: that of the mesh.
        mass: "consistent", or "nodal": diagonal, by Gauss-Lobatto quadrature at the nodes of hexahedra, by scaling the
            diagonal in tetrahedra. Each element keeps its whole mass.
        dilatation: "projected" keeps nearly incompressible solids from locking; "auto" does so for isotropic solids
            with poisson above 0.45.
        rayleigh: (alpha [1/s], beta [s]) of the damping C = alpha M + beta K, on top of the solids' own.
        copies: number of equal sectors with equal motion, of which the mesh is one: M, C, K, areas and impedances are
            those of the whole; the cuts are the sliding boundaries "symmetry_0" and "symmetry_1".
        rings: number of ports into which every patch is divided, NAME_1, NAME_2, ... (`seatfem.structures.rings`).
        lip: parts into which every patch is divided instead, each a port by its name.
        progress: called with ("assembly", fraction).

    Raises:
        ModelError: a boundary that is missing or empty, a port on a fixed face, folded or flat elements, loose parts,
            regions that do not cover the mesh once, linear tetrahedra of a nearly incompressible solid.
    """
    mesh = getattr(mesh, "mesh", mesh)
    if not hasattr(mesh, "boundaries"):
        raise ModelError(f"mesh: {brief_value(mesh)} is no mesh; give one of scikit-fem, of make_mesh or of read_mesh")
    patches = dict(ports)
    faces = {"fixed": names(fixed), "sliding": names(sliding), "antisymmetric": names(antisymmetric)}
    check_ports(mesh, patches, faces)
    solids, region = solids_by_region(mesh, material)
    space = shape_functions.discretize(mesh, order)
    progress("assembly", 0.1)
    unknowns = freedom(space.size, held(space, *faces.values()))
    if not unknowns.free.size:
        raise ModelError(f"fixed: {', '.join(faces['fixed'])} hold every node: nothing is left to move; mesh finer")
    body = _Body(space, solids, region, _modes(space, solids, dilatation), unknowns, mass)
    cuts = [np.asarray(f) for cut, f in (mesh.boundaries or {}).items() if cut in _CUTS and copies > 1]
    across = partial(places_across, mesh, cuts=np.concatenate([np.zeros(0, np.int64), *cuts]), copies=copies)
    of_nodes, T = dict[str, Port](), unknowns.displacements
    for port, name in patches.items():
        patch = shape_functions.surface(space, name, "port", _FINE_RULE if rings > 1 or lip is not None else 0)
        of_nodes |= ports_on(port, name, rings, patch, across, solids, region, space.size, lip)
    of_ports = {
        name: Port(unknowns.displacements.T @ port.vector, copies * port.area, copies * port.impedance)
        for name, port in of_nodes.items()
    }
    bodies = [shape_functions.surface(space, support.boundary, type(support).__name__) for support in supports]
    added = {
        key: unknowns.turned(sparse.csr_array(matrix[unknowns.base][:, unknowns.base]))
        for key, matrix in spread_supports(supports, bodies, solids, region, space.size).items()
    }
    dofs = DofMap(space.nodes, unknowns.free, mesh, None if unknowns.turn is None else T)
    model = whole_model(partial(body.matrices, progress), solids, rayleigh, added, of_ports, dofs, copies)
    progress("assembly", 1.0)
    return model


@dataclass(frozen=True)
class _Body:
    """Elements with their solids and unknowns, and their assembly to matrices."""

    made: shape_functions.Discretization
    solids: tuple[Solid, ...]
    region: NDArray[np.int32]
    modes: NDArray[np.int32]
    unknowns: Freedom
    mass: Mass

    def matrices(self, progress: Progress, scale: Array) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Return (K, M), with stiffness and density of each solid scaled by its row of ``scale`` (solids, 2)."""
        space, unknown = self.made, self.unknowns.unknown
        lame = np.array([s.lame if isinstance(s, Material) else (0.0, 0.0) for s in self.solids]) * scale[:, :1]
        tensors = np.stack([stiffness_tensor(s.elasticity) for s in self.solids]) * scale[:, :1, None, None, None]
        density = np.array([solid.density for solid in self.solids]) * scale[:, 1]
        free, graph = len(self.unknowns.base), space.graph
        rows, columns, offset = element_kernels.expand_pattern(*graph, unknown, free)
        stiffness, scalar = np.zeros(len(columns)), np.zeros(len(graph[1]))
        exact, nodal = shape_functions.mass_rule(space), self.mass == "nodal"
        none = (exact[0][:0], exact[1], exact[2], exact[3])
        rules = shape_functions.stiffness_rule(space), none if nodal else exact
        for start in range(0, len(space.cells), _CHUNK):
            some = slice(start, start + _CHUNK)
            of_some = space.cells[some], space.corners[some], space.places, *rules, self.region[some]
            element_kernels.add_elements(
                *of_some, lame, tensors, density, self.modes, graph, (rows, offset), unknown, stiffness, scalar
            )
            progress("assembly", 0.1 + 0.8 * min(1.0, (start + _CHUNK) / len(space.cells)))
        K = sparse.csr_array((stiffness, columns, rows), shape=(free, free))
        if nodal:
            shares = shape_functions.nodal_rule(space)
            of_nodes = element_kernels.nodal_mass(
                space.cells, space.corners, space.places, exact, shares, self.region, density, space.size
            )
            M = sparse.csr_array(sparse.diags_array(of_nodes[self.unknowns.free // 3]))
        else:
            rows, columns, data = element_kernels.expand_scalar(*graph, scalar, unknown, free)
            M = self.unknowns.turned(sparse.csr_array((data, columns, rows), shape=(free, free)))
        return self.unknowns.turned(K), M


def solids_by_region(mesh: Any, material: Any) -> tuple[tuple[Solid, ...], NDArray[np.int32]]:
    """Return the solids, and the number of each element's solid."""
    count = int(mesh.nelements)
    if isinstance(material, Material | Orthotropic):
        return (material,), np.zeros(count, np.int32)
    if not any(isinstance(value, Material | Orthotropic | Mapping) for value in material.values()):
        return (material_from(material),), np.zeros(count, np.int32)
    regions = {name: np.asarray(of) for name, of in (mesh.subdomains or {}).items()}
    sizes = ", ".join(f"{name} ({of.size} elements)" for name, of in sorted(regions.items())) or "none"
    if unknown := [name for name in material if name not in regions]:
        raise ModelError(f"material: the mesh has no region {', '.join(map(repr, unknown))}; it has {sizes}")
    times, region = np.zeros(count, np.int64), np.zeros(count, np.int32)
    for k, name in enumerate(material):
        np.add.at(times, regions[name], 1)
        region[regions[name]] = k
    if (times != 1).any():
        raise ModelError(
            f"material: of {count} elements {np.sum(times == 0)} have none and {np.sum(times > 1)} have several; "
            f"give each one: the mesh's regions are {sizes}, materials are given for {', '.join(material)}"
        )
    solids = (
        value if isinstance(value, Material | Orthotropic) else material_from(value) for value in material.values()
    )
    return tuple(solids), region


def _modes(made: shape_functions.Discretization, solids: Sequence[Solid], dilatation: Dilatation) -> NDArray[np.int32]:
    """Return, for each solid, the number of functions on which the volume change is projected; 0: not projected."""
    kind = made.element.refdom.__name__
    modes = np.zeros(len(solids), np.int32)
    for k, solid in enumerate(solids):
        if not isinstance(solid, Material) or dilatation == "full":
            continue
        if dilatation == "projected" or solid.poisson > PROJECT_ABOVE:
            if (kind, made.order) not in _MODES:
                raise ModelError(
                    f"material {solid.name!r}: poisson = {solid.poisson} above {PROJECT_ABOVE} locks tetrahedra of "
                    "order 1; mesh it with elements of order 2"
                )
            modes[k] = _MODES[kind, made.order]
    return modes


def names(given: str | Sequence[str]) -> tuple[str, ...]:
    """Return the names of boundaries, a single one of which may be given as text."""
    return (given,) if isinstance(given, str) else tuple(given)


def check_ports(mesh: Any, patches: Mapping[str, str], held: Mapping[str, Sequence[str]]) -> None:
    """Raise `ModelError` if a boundary is missing, or a port shares facets with a held boundary."""
    for role, group in {**held, "port": tuple(patches.values())}.items():
        for name in group:
            shape_functions.facets_of(mesh, name, role)
    for name in patches.values():
        for role, group in held.items():
            for other in group:
                common = np.intersect1d(
                    shape_functions.facets_of(mesh, name, "port"), shape_functions.facets_of(mesh, other, role)
                ).size
                if common:
                    raise ModelError(
                        f"port: {common} facets of {name!r} are also {role} ({other!r}): take them out of one"
                    )
