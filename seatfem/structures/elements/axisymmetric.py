"""The second-order model of a solid of revolution from a mesh of its meridian, one Fourier harmonic at a time."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from impact.progress import Progress, silent
from seatfem.structures.damping import Damping
from seatfem.structures.elements.assembly import check_ports, solids_by_region
from seatfem.structures.elements.node_constraints import Constraint, free_directions
from seatfem.structures.elements.revolved_elements import (
    Section,
    angle_integral,
    boundary_nodes,
    mass_blocks,
    nodal_mass_blocks,
    ring_surface,
    stiffness_blocks,
)
from seatfem.structures.elements.revolved_materials import check_revolved
from seatfem.structures.elements.supports import Support, acts, spread_supports, total
from seatfem.structures.elements.surfaces import Surface
from seatfem.structures.errors import ModelError
from seatfem.structures.materials import Solid
from seatfem.structures.model import Array, DofMap, Port, SecondOrderModel
from seatfem.structures.rings import divided, ring_names

Mass = Literal["consistent", "nodal"]
_FINE_RULE = 24  # degree of the quadrature over a patch whose rings end within elements


def assemble_axisymmetric(
    mesh: Any,
    material: Solid | Mapping[str, Any],
    *,
    harmonic: int = 0,
    torsion: bool = False,
    fixed: str | Sequence[str] = "fixed",
    sliding: str | Sequence[str] = (),
    ports: Mapping[str, str] | None = None,
    order: int | None = None,
    mass: Mass = "consistent",
    rayleigh: tuple[float, float] | None = None,
    supports: Sequence[Support] = (),
    rings: int = 1,
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
        torsion: of harmonic 0, the motion that the symmetric one leaves out: V alone, which no port excites.
        fixed: boundaries without displacement; ``()`` for a free body.
        sliding: straight boundaries without normal displacement: planes, cylinders, cones.
        ports: boundary name of each port's ring; default ``{"contact": "contact"}``.
        order: 1 or 2, polynomial order of the displacement; default: that of the mesh.
        mass: "consistent", or "nodal" for a diagonal one, see `nodal_mass_blocks`.
        rayleigh: (alpha [1/s], beta [s]) of the damping C = alpha M + beta K, on top of the materials' own.
        supports: springs and dashpots on boundaries (`elements.supports`), all around.
        rings: every patch is divided into so many ports, NAME_1, NAME_2, ... (`rings`), from the inner edge to
            the outer one.
        progress: called with ("assembly", fraction).

    Raises:
        ModelError: an unusable argument or mesh, a boundary that is missing, empty or inside the body, a port on a
            held boundary, a material that is not the same in every meridian.
    """
    if harmonic < 0 or harmonic != int(harmonic):
        raise ModelError(f"harmonic = {harmonic} must be a whole number >= 0")
    if torsion and harmonic != 0:
        raise ModelError(f"torsion is a motion of harmonic 0, not of {harmonic}")
    if mass not in get_args(Mass):
        raise ModelError(f"mass {mass!r} is unknown; choose from {', '.join(get_args(Mass))}")
    mesh = getattr(mesh, "mesh", mesh)
    section = Section.of(mesh, order)
    solids, region = solids_by_region(mesh, material)
    for solid in solids:
        check_revolved(solid)
    patches = {"contact": "contact"} if ports is None else dict(ports)
    patches = {} if torsion else patches
    held = {"fixed": _names(fixed), "sliding": _names(sliding)}
    check_ports(mesh, patches, held)
    T = free_directions(section.n_nodes, 3, _constraints(section, harmonic, torsion, held))
    progress("assembly", 0.1)
    K, M, C, loss = _matrices(section, solids, region, harmonic, torsion, mass, T)
    progress("assembly", 0.8)
    if rayleigh is not None:
        C = total(C, rayleigh[0] * M + rayleigh[1] * K)
    bodies = [ring_surface(section, s.boundary, type(s).__name__, angle_integral(harmonic)) for s in supports]
    added = spread_supports(supports, bodies, solids, region, section.n_nodes)
    springs, dashpots = (sparse.csr_array(T.T @ added[key] @ T) if key in added else None for key in ("K", "C"))
    K, C = K if springs is None else sparse.csr_array(K + springs), total(C, dashpots)
    known = Damping.of_regions(
        np.array([solid.rayleigh for solid in solids]) + np.array(rayleigh or (0.0, 0.0)),
        np.array([solid.loss_factor for solid in solids]),
        loss,
        springs=acts(springs),
        dashpots=acts(dashpots),
    )
    whole: dict[str, Port] = {}
    for port, name in patches.items():
        parts = _ports(section, name, solids, region, harmonic, rings)
        whole |= dict(zip(ring_names(port, rings), parts, strict=True))
    made = {name: replace(port, vector=T.T @ port.vector) for name, port in whole.items()}
    points = np.stack([section.points[0], np.zeros(section.n_nodes), section.points[1]])
    progress("assembly", 1.0)
    return SecondOrderModel(M, C, K, made, DofMap(points, _largest_entries(T), mesh, T), loss, known)


def _matrices(
    section: Section,
    solids: Sequence[Solid],
    region: NDArray[np.int32],
    harmonic: int,
    torsion: bool,
    mass: Mass,
    T: sparse.csr_array,
) -> tuple[sparse.csr_array, sparse.csr_array, sparse.csr_array | None, sparse.csr_array | None]:
    """(K, M, C, loss) of the unknowns; C and loss are the materials' own, ``None`` without."""
    components = np.array([1] if torsion else [0, 2] if harmonic == 0 else [0, 1, 2])
    moving = T[(3 * np.arange(section.n_nodes)[:, None] + components).ravel()]
    blocks = stiffness_blocks(
        section, np.array([solid.elasticity for solid in solids])[region], harmonic, torsion=torsion
    )
    volumes = (mass_blocks if mass == "consistent" else nodal_mass_blocks)(section, harmonic)
    density = np.array([solid.density for solid in solids])[region]
    alpha, beta = np.array([solid.rayleigh for solid in solids])[region].T
    eta = np.array([solid.loss_factor for solid in solids])[region]

    def stiffness(factor: Array | float) -> sparse.csr_array:
        weighted = blocks * np.reshape(factor, (-1, 1, 1, 1, 1))
        return sparse.csr_array(moving.T @ section.gather(weighted) @ moving)

    def inertia(factor: Array) -> sparse.csr_array:
        each = sparse.kron(_scalar_mass(section, volumes, factor), np.eye(len(components)), format="csr")
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


def _constraints(
    section: Section, harmonic: int, torsion: bool, held: Mapping[str, Sequence[str]]
) -> Iterator[Constraint]:
    """What holds the nodes: the harmonic's own conditions, fixed and sliding boundaries."""
    r, th, z = np.eye(3)
    if harmonic == 0:
        yield from ((np.arange(section.n_nodes), direction) for direction in ((r, z) if torsion else (th,)))
    on_axis = {0: (th,) if torsion else (r,), 1: (r + th, z)}.get(harmonic, (r, th, z))
    yield from ((section.on_axis, direction) for direction in on_axis)
    for name in held["fixed"]:
        yield from ((boundary_nodes(section, name, "fixed"), direction) for direction in (r, th, z))
    for name in held["sliding"]:
        normals = ring_surface(section, name, "sliding", 1.0).normals.reshape(-1, 3)
        if (off := float(np.ptp(normals, axis=0).max())) > 1e-6:
            raise ModelError(f"sliding: boundary {name!r} is not straight (its normal changes by {off:.1e})")
        yield boundary_nodes(section, name, "sliding"), normals[0]


def _ports(
    section: Section, name: str, solids: Sequence[Solid], region: NDArray[np.int32], harmonic: int, rings: int
) -> list[Port]:
    """Of each ring: b = integral of n . N over it / its area, over all nodes; impedance = integral of rho c_p, halved.

    Between the edges a ring lies by r, or by z where that changes more.
    """
    patch = ring_surface(section, name, "port", 2 * math.pi, None if rings == 1 else _FINE_RULE)
    if not patch.area > 0:
        raise ModelError(f"port: boundary {name!r} has area {patch.area:g} m^2")
    weights = patch.weights[None]
    if rings > 1:
        flat = patch.places.reshape(-1, 2)
        across = flat[:, int(np.argmax(np.ptp(flat, axis=0)))]
        weights = divided(across, patch.weights.ravel(), rings).reshape(rings, *patch.weights.shape)
    speeds = np.zeros(patch.weights.shape)  # rho c_p
    for k, solid in enumerate(solids):
        of = region[patch.elements] == k
        speeds[of] = solid.density * solid.c_p_along(patch.normals[of])
    return [_port(section, patch, part, speeds, harmonic) for part in weights]


def _port(section: Section, patch: Surface, weights: Array, speeds: Array, harmonic: int) -> Port:
    parts = np.einsum("fqi,fqa,fq->fia", patch.shapes, patch.normals, weights, optimize=True)
    vector = np.zeros((section.n_nodes, 3))
    np.add.at(vector, patch.cells, parts)
    area, impedance = float(weights.sum()), float((speeds * weights).sum())
    return Port(vector.ravel() / area, area, impedance if harmonic == 0 else impedance / 2)


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
