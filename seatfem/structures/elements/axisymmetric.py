"""The second-order model of a solid of revolution from a mesh of its meridian, one Fourier harmonic at a time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from impact import notices, quantities
from seatfem.structures import errors, materials
from seatfem.structures.elements import assembly, revolved_elements, shape_functions
from seatfem.structures.elements.ports import ONE_RADIUS, ports_on
from seatfem.structures.elements.supports import Constraint, Matrices, Support, freedom, spread_supports, whole_model
from seatfem.structures.model import Array, DofMap, Port, SecondOrderModel

Mass = Literal["consistent", "nodal"]
_FINE_RULE = 24  # degree of the quadrature over a patch whose rings end within elements


def assemble_axisymmetric(
    mesh: Any,
    material: materials.Solid | Mapping[str, Any],
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
    progress: notices.Progress = notices.silent,
) -> SecondOrderModel:
    """Assemble small-strain elasticity with u_r, u_z ~ cos(n th) and u_th ~ sin(n th), n the ``harmonic``.

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
        torsion: for harmonic 0, assemble the torsional motion V instead, which no port excites.
        fixed: boundaries without displacement; ``()`` for a free body.
        sliding: straight boundaries without normal displacement: planes, cylinders, cones.
        ports: boundary name of each port's ring; default ``{"contact": "contact"}``.
        order: 1 or 2, polynomial order of the displacement; default: that of the mesh.
        mass: "consistent", or "nodal" for a diagonal one, see `nodal_mass_blocks`.
        rayleigh: (alpha [1/s], beta [s]) of the damping C = alpha M + beta K, on top of the materials' own.
        supports: springs and dashpots on boundaries (`elements.supports`), uniform in the angle.
        rings: number of ports into which every patch is divided, NAME_1, NAME_2, ... from the inner edge to the outer
            one.
        progress: called with ("assembly", fraction).

    Raises:
        ModelError: an unusable argument or mesh, a boundary that is missing, empty or inside the body, a port on a
            held boundary, a material that is not the same in every meridian.
    """
    if harmonic < 0 or harmonic != int(harmonic):
        raise errors.ModelError(f"harmonic = {harmonic} must be a whole number >= 0")
    if torsion and harmonic != 0:
        raise errors.ModelError(f"harmonic = {harmonic} must be 0 with torsion")
    if mass not in get_args(Mass):
        raise errors.ModelError(f"mass {mass!r} is unknown; choose from {', '.join(get_args(Mass))}")
    mesh = getattr(mesh, "mesh", mesh)
    section = revolved_elements.Section.from_mesh(mesh, order)
    solids, region = assembly.solids_by_region(mesh, material)
    for solid in solids:
        check_revolved(solid)
    patches = {"contact": "contact"} if ports is None else dict(ports)
    patches = {} if torsion else patches
    held = {"fixed": assembly.names(fixed), "sliding": assembly.names(sliding)}
    assembly.check_ports(mesh, patches, held)
    unknowns = freedom(section.n_nodes, _constraints(section, harmonic, torsion, held))
    T = unknowns.displacements
    progress("assembly", 0.1)
    bodies = [
        revolved_elements.ring_surface(
            section, s.boundary, type(s).__name__, revolved_elements.angle_integral(harmonic)
        )
        for s in supports
    ]
    added = {
        key: sparse.csr_array(T.T @ matrix @ T)
        for key, matrix in spread_supports(supports, bodies, solids, region, section.n_nodes).items()
    }
    whole: dict[str, Port] = {}
    for port, name in patches.items():
        patch = revolved_elements.ring_surface(section, name, "port", 2 * math.pi, _FINE_RULE if rings > 1 else None)
        whole |= ports_on(port, name, rings, patch, _places, solids, region, section.n_nodes)
    half = 1.0 if harmonic == 0 else 0.5
    of_ports = {
        name: Port(T.T @ port.vector, port.area, half * (port.impedance or 0.0)) for name, port in whole.items()
    }
    points = np.stack([section.points[0], np.zeros(section.n_nodes), section.points[1]])
    matrices = _matrices(section, solids, region, harmonic, torsion, mass, T)
    progress("assembly", 0.5)
    model = whole_model(matrices, solids, rayleigh, added, of_ports, DofMap(points, unknowns.free, mesh, T))
    progress("assembly", 1.0)
    return model


def _matrices(
    section: revolved_elements.Section,
    solids: Sequence[materials.Solid],
    region: NDArray[np.int32],
    harmonic: int,
    torsion: bool,
    mass: Mass,
    T: sparse.csr_array,
) -> Matrices:
    """Return the function that assembles (K, M) for scaled stiffness and density of each region."""
    components = np.array([1] if torsion else [0, 2] if harmonic == 0 else [0, 1, 2])
    moving = T[(3 * np.arange(section.n_nodes)[:, None] + components).ravel()]
    elasticity = np.array([solid.elasticity for solid in solids])[region]
    blocks = revolved_elements.stiffness_blocks(section, elasticity, harmonic, torsion=torsion)
    volumes = (revolved_elements.mass_blocks if mass == "consistent" else revolved_elements.nodal_mass_blocks)(
        section, harmonic
    )
    density = np.array([solid.density for solid in solids])

    def matrices(scale: Array) -> tuple[sparse.csr_array, sparse.csr_array]:
        stiffness = section.gather(blocks * scale[region, 0][:, None, None, None, None])
        dense = volumes * (density * scale[:, 1])[region].reshape(-1, *[1] * (volumes.ndim - 1))
        inertia = (
            section.gather(dense[:, :, None, :, None])
            if dense.ndim == 3
            else sparse.diags_array(np.bincount(section.cells.T.ravel(), dense.ravel(), section.n_nodes), format="csr")
        )
        inertia = sparse.kron(inertia, np.eye(len(components)), format="csr")
        return sparse.csr_array(moving.T @ stiffness @ moving), sparse.csr_array(moving.T @ inertia @ moving)

    return matrices


def _constraints(
    section: revolved_elements.Section, harmonic: int, torsion: bool, held: Mapping[str, Sequence[str]]
) -> Iterator[Constraint]:
    """Yield the constraints of the nodes: the harmonic's own conditions, fixed and sliding boundaries."""
    r, th, z = np.eye(3)
    if harmonic == 0:
        yield from ((np.arange(section.n_nodes), direction) for direction in ((r, z) if torsion else (th,)))
    on_axis = {0: (th,) if torsion else (r,), 1: (r + th, z)}.get(harmonic, (r, th, z))
    yield from ((section.on_axis, direction) for direction in on_axis)
    for name in held["fixed"]:
        yield from ((revolved_elements.boundary_nodes(section, name, "fixed"), direction) for direction in (r, th, z))
    for name in held["sliding"]:
        normals = revolved_elements.ring_surface(section, name, "sliding", 1.0).normals.reshape(-1, 3)
        if (off := float(np.ptp(normals, axis=0).max())) > 1e-6:
            raise errors.ModelError(f"sliding: boundary {name!r} must be straight (its normal changes by {off:.1e})")
        yield revolved_elements.boundary_nodes(section, name, "sliding"), normals[0]


def _places(patch: shape_functions.Surface) -> Array:
    """Return the positions by which rings divide a patch, as in `places_across`: r, or z on a cylinder."""
    radii = patch.places[..., 0]
    return patch.places[..., 1] if np.ptp(radii) <= ONE_RADIUS * radii.max() else radii


def check_revolved(solid: materials.Solid) -> None:
    """Raise `ModelError` unless the stiffness is invariant under rotations by an eighth and a quarter turn about z."""
    stiffness = materials.stiffness_tensor(solid.elasticity)
    for angle in (math.pi / 4, math.pi / 2):
        c, s = math.cos(angle), math.sin(angle)
        q = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        turned = np.einsum("ai,bj,ijkl,ck,dl->abcd", q, q, stiffness, q, q, optimize=True)
        if (off := np.abs(turned - stiffness).max() / np.abs(stiffness).max()) > 1e-6:
            raise errors.ModelError(
                f"material {solid.name!r}: its stiffness changes by {quantities.percent(off)} when it is turned by "
                f"{math.degrees(angle):g} degrees about z; an axisymmetric model needs E_1 = E_2, nu_13 = nu_23, "
                "G_13 = G_23 and G_12 = E_1/(2 (1 + nu_12)) with axis 3 along z: model the body in three dimensions"
            )
