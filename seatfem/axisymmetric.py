"""The second-order model of a solid of revolution from a mesh of its meridian, one Fourier harmonic at a time."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy import sparse

from impact.progress import Progress, silent
from seatfem.errors import ModelError
from seatfem.materials import Solid
from seatfem.model import Array, DofMap, Port, SecondOrderModel
from seatfem.node_constraints import Constraint, free_directions
from seatfem.revolved_elements import Section, mass_blocks, nodal_mass_blocks, stiffness_blocks
from seatfem.revolved_materials import Regions, per_cell, regions_of

Mass = Literal["consistent", "nodal"]


def assemble_axisymmetric(
    mesh: Any,
    material: Solid | Mapping[str, Any],
    *,
    harmonic: int = 0,
    fixed: str | Sequence[str] = "fixed",
    sliding: str | Sequence[str] = (),
    ports: Mapping[str, str] | None = None,
    order: int | None = None,
    mass: Mass = "consistent",
    rayleigh: tuple[float, float] | None = None,
    progress: Progress = silent,
) -> SecondOrderModel:
    """Small-strain elasticity with u_r, u_z ~ cos(n th) and u_th ~ sin(n th), n the ``harmonic``.

    The unknowns are the amplitudes (U, V, W) of (u_r, u_th, u_z) at the nodes; ``model.expand`` returns them as
    (3, n_nodes) in that order. For n = 0 there is no V, and U = 0 on the axis. For n = 1 on the axis W = 0 and
    U + V = 0, the lateral motion (U, V) = (1, -1); for n > 1 nothing moves there. The angle integrates to 2 pi for
    n = 0, else pi.

    A port's b'u is the amplitude of the outward normal displacement averaged over its whole ring, of area A; b F is
    the load of traction F/A for n = 0 and 2 F cos(n th)/A else, the n-th Fourier term of a force F at th = 0.
    Its impedance is rho c_p A for n = 0, else half of it.

    Args:
        mesh: scikit-fem mesh of triangles or quadrilaterals, straight or curved, with x = r, y = z [m] and named
            boundaries, or an object that carries one as ``.mesh``. The axis needs no name.
        material: a `Material`; an `Orthotropic` one whose stiffness does not change by turning it about z; a mapping
            with young [Pa], poisson and density [kg/m^3]; or one of these for each subdomain of the mesh by name.
        harmonic: n >= 0.
        fixed: boundaries without displacement; ``()`` for a free body.
        sliding: straight boundaries without normal displacement: planes, cylinders, cones.
        ports: boundary name of each port's ring; default ``{"contact": "contact"}``.
        order: 1 or 2, polynomial order of the displacement; default: that of the mesh.
        mass: "consistent", or "nodal" for a diagonal one, see `nodal_mass_blocks`.
        rayleigh: (alpha [1/s], beta [s]) of the damping C = alpha M + beta K, on top of the materials' own.
        progress: called with ("assembly", fraction).

    Raises:
        ModelError: an unusable argument or mesh, a boundary that is missing, empty or inside the body, a port on a
            held boundary, a material that is not the same in every meridian.
    """
    if harmonic < 0 or harmonic != int(harmonic):
        raise ModelError(f"harmonic = {harmonic} must be a whole number >= 0")
    if mass not in get_args(Mass):
        raise ModelError(f"mass {mass!r} is unknown; choose from {', '.join(get_args(Mass))}")
    mesh = getattr(mesh, "mesh", mesh)
    section = Section.of(mesh, order)
    regions = regions_of(mesh, material)
    patches = {"contact": "contact"} if ports is None else dict(ports)
    held = {"fixed": _names(fixed), "sliding": _names(sliding)}
    T = free_directions(section.n_nodes, 3, _constraints(section, harmonic, held))
    components = np.array([0, 2] if harmonic == 0 else [0, 1, 2])
    moving = T[(3 * np.arange(section.n_nodes)[:, None] + components).ravel()]
    progress("assembly", 0.1)
    K, M, C, loss = _matrices(section, regions, harmonic, mass, moving)
    if rayleigh is not None:
        uniform = rayleigh[0] * M + rayleigh[1] * K
        C = uniform if C is None else C + uniform
    progress("assembly", 0.9)
    made = {port: _port(section, name, held, regions, harmonic, moving) for port, name in patches.items()}
    points = np.stack([section.points[0], np.zeros(section.n_nodes), section.points[1]])
    dofs = DofMap(points, _largest_entries(T), mesh, T)
    progress("assembly", 1.0)
    return SecondOrderModel(M, C, K, made, dofs, loss)


def _matrices(
    section: Section, regions: Regions, harmonic: int, mass: Mass, moving: sparse.csr_array
) -> tuple[sparse.csr_array, sparse.csr_array, sparse.csr_array | None, sparse.csr_array | None]:
    """(K, M, C, loss) of the unknowns; C and loss are the materials' own, ``None`` without."""
    n_cells = section.cells.shape[1]
    blocks = stiffness_blocks(section, per_cell(regions, n_cells, lambda solid: solid.elasticity), harmonic)
    volumes = (mass_blocks if mass == "consistent" else nodal_mass_blocks)(section, harmonic)
    density = per_cell(regions, n_cells, lambda solid: np.array(solid.density))
    alpha, beta = per_cell(regions, n_cells, lambda solid: np.array(solid.rayleigh)).T
    eta = per_cell(regions, n_cells, lambda solid: np.array(solid.loss_factor))

    def stiffness(factor: Array | float) -> sparse.csr_array:
        weighted = blocks * np.reshape(factor, (-1, 1, 1, 1, 1))
        return sparse.csr_array(moving.T @ section.gather(weighted) @ moving)

    def inertia(factor: Array) -> sparse.csr_array:
        scalar = _scalar_mass(section, volumes, factor)
        each = sparse.kron(scalar, np.eye(blocks.shape[2]), format="csr")
        return sparse.csr_array(moving.T @ each @ moving)

    damped = np.any(alpha > 0) or np.any(beta > 0)
    C = inertia(alpha * density) + stiffness(beta) if damped else None
    return stiffness(1.0), inertia(density), C, stiffness(eta) if np.any(eta > 0) else None


def _scalar_mass(section: Section, volumes: Array, density: Array) -> sparse.csr_array:
    if volumes.ndim == 3:
        return section.gather((volumes * density[:, None, None])[:, :, None, :, None])
    lumps = np.bincount(section.cells.T.ravel(), (volumes * density[:, None]).ravel(), section.n_nodes)
    return sparse.diags_array(lumps, format="csr")


def _names(given: str | Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)


def _facets(mesh: Any, name: str, role: str) -> NDArray[np.int64]:
    """Facets of a named boundary; the error lists the names there are."""
    boundaries = mesh.boundaries or {}
    if name not in boundaries:
        raise ModelError(f"{role}: the mesh has no boundary {name!r}; it has {', '.join(sorted(boundaries)) or 'none'}")
    facets = np.asarray(boundaries[name], dtype=np.int64)
    if facets.size == 0:
        raise ModelError(f"{role}: boundary {name!r} is empty (length 0): select at least one facet")
    inside = np.setdiff1d(facets, mesh.boundary_facets())
    if inside.size:
        raise ModelError(
            f"{role}: {inside.size} facets of boundary {name!r} lie inside the section, not on its outline"
        )
    return facets


def _surface(section: Section, name: str, role: str) -> Any:
    facets = _facets(section.mesh, name, role)
    return skfem.FacetBasis(section.mesh, section.element, facets=facets, intorder=2 * section.order + 3)


def _constraints(section: Section, harmonic: int, held: Mapping[str, Sequence[str]]) -> Iterator[Constraint]:
    """What holds the nodes: the harmonic's own conditions, fixed and sliding boundaries."""
    r, th, z = np.eye(3)
    if harmonic == 0:
        yield np.arange(section.n_nodes), th
    on_axis = {0: (r,), 1: (r + th, z)}.get(harmonic, (r, th, z))
    yield from ((section.on_axis, direction) for direction in on_axis)
    for name in held["fixed"]:
        nodes = np.unique(_surface(section, name, "fixed").get_dofs(_facets(section.mesh, name, "fixed")).all())
        yield from ((nodes, direction) for direction in (r, th, z))
    for name in held["sliding"]:
        surface = _surface(section, name, "sliding")
        normals = surface.normals.reshape(2, -1)
        if (off := float(np.ptp(normals, axis=1).max())) > 1e-6:
            raise ModelError(f"sliding: boundary {name!r} is not straight (its normal changes by {off:.1e})")
        nodes = np.unique(surface.get_dofs(_facets(section.mesh, name, "sliding")).all())
        yield nodes, np.array([normals[0, 0], 0.0, normals[1, 0]])


def _port(
    section: Section,
    name: str,
    held: Mapping[str, Sequence[str]],
    regions: Regions,
    harmonic: int,
    moving: sparse.csr_array,
) -> Port:
    """b = integral of n . N over the ring / its area."""
    for role, group in held.items():
        for other in group:
            common = np.intersect1d(_facets(section.mesh, name, "port"), _facets(section.mesh, other, role)).size
            if common:
                raise ModelError(f"port: {common} facets of {name!r} are also {role} ({other!r}) and cannot be pushed")
    surface = _surface(section, name, "port")
    weight = 2 * math.pi * surface.dx * surface.global_coordinates().value[0]
    area = float(weight.sum())
    if not area > 0:
        raise ModelError(f"port: boundary {name!r} has area {area:g} m^2")
    vector = np.zeros((section.n_nodes, moving.shape[0] // section.n_nodes))
    for dofs, field in zip(surface.element_dofs, surface.basis, strict=True):
        for axis, normal in zip((0, -1), surface.normals, strict=True):
            share = (normal * np.asarray(field[0]) * weight).sum(axis=-1)
            vector[:, axis] += np.bincount(dofs, share, section.n_nodes)
    impedance = float((weight * _impedance(section, surface, regions)).sum())
    return Port(moving.T @ vector.ravel() / area, area, impedance if harmonic == 0 else impedance / 2)


def _impedance(section: Section, surface: Any, regions: Regions) -> Array:
    """(n_facets, n_points) rho c_p along the normal [N s/m^3]."""
    normals = np.stack([surface.normals[0], 0 * surface.normals[0], surface.normals[1]], axis=-1)
    cells = section.mesh.f2t[0, surface.find]
    out = np.empty(normals.shape[:-1])
    for solid, made_of in regions:
        here = np.isin(cells, made_of)
        out[here] = solid.density * solid.c_p_along(normals[here])
    return out


def _largest_entries(T: sparse.csr_array) -> NDArray[np.int64]:
    """Row of the largest entry of each column: node and component that each unknown is nearest to."""
    by_column = T.tocsc()
    return np.array(
        [
            by_column.indices[a + int(np.argmax(np.abs(by_column.data[a:b])))]
            for a, b in itertools.pairwise(by_column.indptr)
        ],
        dtype=np.int64,
    )
