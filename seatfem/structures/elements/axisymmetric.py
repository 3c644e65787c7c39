"""Second-order model of a solid of revolution from a mesh of its meridian, one Fourier harmonic at a time.

With u_r = U cos(n th), u_th = V sin(n th), u_z = W cos(n th) the strains of its elements are, row by row,

    rr: U,r    tt: (U + n V)/r    zz: W,z    tz: V,z - n W/r    rz: U,z + W,r    rt: V,r - (n U + V)/r

times cos(n th) in rr, tt, zz, rz and sin(n th) in tz, rt; the angle then integrates to 2 pi for n = 0 and pi for n > 0.
Source: Zienkiewicz & Taylor, The Finite Element Method, vol. 2, "Semi-analytical finite element processes".
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy import sparse
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine

from impact import notices, quantities
from seatfem.structures import errors, materials
from seatfem.structures.elements import assembly, shape_functions
from seatfem.structures.elements.shape_functions import Surface, element_of, facets_of
from seatfem.structures.elements.supports import (
    ONE_RADIUS,
    STRUCK,
    Constraint,
    Matrices,
    Support,
    freedom,
    ports_on,
    spread_supports,
    whole_model,
)
from seatfem.structures.model import Array, DofMap, ModelError, Port, SecondOrderModel

_FINE_RULE = 24  # degree of the quadrature over a patch whose rings end within elements


def assemble_axisymmetric(
    mesh: Any,
    material: materials.Solid | Mapping[str, Any],
    *,
    harmonic: int = 0,
    torsion: bool = False,
    fixed: str | Sequence[str] = "fixed",
    sliding: str | Sequence[str] = (),
    ports: Mapping[str, str] = STRUCK,
    order: int = 0,
    rayleigh: tuple[float, float] = (0.0, 0.0),
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
        ports: boundary name of each port's ring.
        order: 1 or 2, polynomial order of the displacement; 0: that of the mesh.
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
    mesh = getattr(mesh, "mesh", mesh)
    section = Section.from_mesh(mesh, order)
    solids, region = assembly.solids_by_region(mesh, material)
    for solid in solids:
        check_revolved(solid)
    patches = {} if torsion else dict(ports)
    held = {"fixed": assembly.names(fixed), "sliding": assembly.names(sliding)}
    assembly.check_ports(mesh, patches, held)
    unknowns = freedom(section.n_nodes, _constraints(section, harmonic, torsion, held))
    T = unknowns.displacements
    progress("assembly", 0.1)
    bodies = [ring_surface(section, s.boundary, type(s).__name__, angle_integral(harmonic)) for s in supports]
    added = {
        key: sparse.csr_array(T.T @ matrix @ T)
        for key, matrix in spread_supports(supports, bodies, solids, region, section.n_nodes).items()
    }
    whole: dict[str, Port] = {}
    for port, name in patches.items():
        patch = ring_surface(section, name, "port", 2 * math.pi, _FINE_RULE if rings > 1 else 0)
        whole |= ports_on(port, name, rings, patch, _places, solids, region, section.n_nodes)
    half = 1.0 if harmonic == 0 else 0.5
    of_ports = {name: Port(T.T @ port.vector, port.area, half * port.impedance) for name, port in whole.items()}
    points = np.stack([section.points[0], np.zeros(section.n_nodes), section.points[1]])
    matrices = _matrices(section, solids, region, harmonic, torsion, T)
    progress("assembly", 0.5)
    model = whole_model(matrices, solids, rayleigh, added, of_ports, DofMap(points, unknowns.free, mesh, T))
    progress("assembly", 1.0)
    return model


def _matrices(
    section: Section,
    solids: Sequence[materials.Solid],
    region: NDArray[np.int32],
    harmonic: int,
    torsion: bool,
    T: sparse.csr_array,
) -> Matrices:
    """Return the function that assembles (K, M) for scaled stiffness and density of each region."""
    components = np.array([1] if torsion else [0, 2] if harmonic == 0 else [0, 1, 2])
    moving = T[(3 * np.arange(section.n_nodes)[:, None] + components).ravel()]
    elasticity = np.array([solid.elasticity for solid in solids])[region]
    blocks = stiffness_blocks(section, elasticity, harmonic, torsion=torsion)
    volumes = mass_blocks(section, harmonic)
    density = np.array([solid.density for solid in solids])

    def matrices(scale: Array) -> tuple[sparse.csr_array, sparse.csr_array]:
        stiffness = section.gather(blocks * scale[region, 0][:, None, None, None, None])
        dense = volumes * (density * scale[:, 1])[region][:, None, None]
        inertia = sparse.kron(section.gather(dense[:, :, None, :, None]), np.eye(len(components)), format="csr")
        return sparse.csr_array(moving.T @ stiffness @ moving), sparse.csr_array(moving.T @ inertia @ moving)

    return matrices


def _constraints(
    section: Section, harmonic: int, torsion: bool, held: Mapping[str, Sequence[str]]
) -> Iterator[Constraint]:
    """Yield the constraints of the nodes: the harmonic's own conditions, fixed and sliding boundaries."""
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
            raise errors.ModelError(f"sliding: boundary {name!r} must be straight (its normal changes by {off:.1e})")
        yield boundary_nodes(section, name, "sliding"), normals[0]


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


_ELEMENTS = {
    ("RefTri", 1): skfem.ElementTriP1,
    ("RefTri", 2): skfem.ElementTriP2,
    ("RefQuad", 1): skfem.ElementQuad1,
    ("RefQuad", 2): skfem.ElementQuad2,
}
_CHUNK = 2048  # elements per batch: bounds the memory of the strain matrices


def section_element(mesh: Any, order: int) -> Any:
    """Return scikit-fem's element of an ``order`` (0: the mesh's) on triangles or quadrilaterals."""
    of_mesh = 1 if mesh.dofs.element_dofs.shape[0] == mesh.t.shape[0] else 2
    return element_of(mesh, order or of_mesh, _ELEMENTS, " in a meridian section")


@dataclass(frozen=True)
class Section:
    """A meridian mesh (x = r >= 0, y = z) and the displacement element on it.

    Attributes:
        points: (2, n_nodes) r and z of the nodes [m].
        cells: (n_local, n_cells) nodes of each cell.
        on_axis: nodes with r = 0.
    """

    mesh: Any
    element: Any
    points: Array
    cells: NDArray[np.int64]
    on_axis: NDArray[np.int64]

    @staticmethod
    def from_mesh(mesh: Any, order: int) -> Section:
        """Return the checked section: r >= 0, no folded cell; nodes within 1e-9 of the outer radius are on the axis."""
        if mesh.dim() != 2:
            raise ModelError(
                f"a meridian section must have two dimensions (r, z), this {type(mesh).__name__} has {mesh.dim()}"
            )
        element = section_element(mesh, order)
        basis = skfem.Basis(mesh, element, intorder=1)
        points = np.asarray(basis.doflocs, dtype=float)
        outer, inner = float(points[0].max()), float(points[0].min())
        if inner < -1e-9 * outer or not outer > 0:
            raise ModelError(f"meridian section: r reaches from {inner:g} to {outer:g} m, it must be >= 0")
        corners = np.asarray(mesh.elem.refdom.p, dtype=float)
        det = mesh.mapping().detDF(np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1))
        folded = np.flatnonzero((det.min(axis=1) <= 0) & (det.max(axis=1) >= 0))
        if folded.size:
            place = np.round(mesh.p[:, mesh.t[:, folded[0]]].mean(axis=1), 6)
            raise ModelError(
                f"{folded.size} elements are folded (Jacobian changes sign), the first at {place} m: mesh finer there"
            )
        cells = np.asarray(basis.element_dofs, dtype=np.int64)
        return Section(mesh, element, points, cells, np.flatnonzero(points[0] <= 1e-9 * outer))

    @property
    def n_nodes(self) -> int:
        """Return the number of nodes."""
        return int(self.points.shape[1])

    @property
    def order(self) -> int:
        """Return 1 or 2, the polynomial order of the displacement."""
        return 1 if len(self.cells) == self.mesh.t.shape[0] else 2

    @property
    def quadrature_order(self) -> int:
        """Return the order that is exact for the mass of straight cells; two more for others."""
        jacobian = self.mesh.mapping().DF(np.asarray(self.mesh.elem.refdom.p, dtype=float))
        straight = np.ptp(jacobian, axis=-1).max() <= 1e-10 * np.abs(jacobian).max()
        return 2 * self.order + (1 if straight else 3)

    def bases(self) -> Any:
        """Yield (cells, scikit-fem basis on them), batch by batch."""
        for start in range(0, self.cells.shape[1], _CHUNK):
            some = np.arange(start, min(start + _CHUNK, self.cells.shape[1]))
            yield some, skfem.Basis(self.mesh, self.element, intorder=self.quadrature_order, elements=some)

    def gather(self, blocks: Array) -> sparse.csr_array:
        """Sum (n_cells, n_local, d, n_local, d) element matrices, unknown d node + component."""
        n, d, local = self.n_nodes, blocks.shape[2], len(self.cells)
        key = (self.cells.T[:, :, None] * n + self.cells.T[:, None, :]).ravel()
        unique, place = np.unique(key, return_inverse=True)
        values = np.empty((len(unique), d, d))
        flat = blocks.transpose(2, 4, 0, 1, 3).reshape(d, d, len(self.cells.T) * local * local)
        for a in range(d):
            for b in range(d):
                values[:, a, b] = np.bincount(place, flat[a, b], len(unique))
        indptr = np.searchsorted(unique, np.arange(n + 1, dtype=np.int64) * n)
        total = sparse.bsr_array((values, unique % n, indptr), shape=(n * d, n * d)).tocsr()
        return sparse.csr_array((total + total.T) / 2)  # the products are symmetric to round-off only


def ring_surface(section: Section, name: str, role: str, angle: float, degree: int = 0) -> Surface:
    """Return the quadrature on a revolved boundary, with weights ``angle`` r ds; see `angle_integral`.

    ``degree``: degree of the quadrature; 0: exact for products of shape functions.
    """
    facets = facets_of(section.mesh, name, role)
    elements = np.asarray(section.mesh.f2t[0, facets], dtype=np.int64)
    which = np.argmax(np.asarray(section.mesh.t2f)[:, elements] == facets, axis=0)
    line, lengths = get_quadrature(RefLine, degree or 2 * section.order + 3)
    shapes = np.empty((len(facets), lengths.size, len(section.cells)))
    normals, weights = np.zeros((len(facets), lengths.size, 3)), np.empty((len(facets), lengths.size))
    places = np.empty((len(facets), lengths.size, 2))
    corners = np.asarray(section.element.refdom.p, dtype=float)
    for k, (first, last) in enumerate(section.element.refdom.facets):
        on = which == k
        along = corners[:, [last]] - corners[:, [first]]
        points = corners[:, [first]] + along * line
        mapping = section.mesh.mapping()
        places[on] = np.moveaxis(np.asarray(mapping.F(points, tind=elements[on])), 0, -1)
        tangent = np.einsum("abmq,b->mqa", np.asarray(mapping.DF(points, tind=elements[on])), along[:, 0])
        inward = np.moveaxis(np.asarray(mapping.F(corners.mean(axis=1, keepdims=True), tind=elements[on])), 0, -1)
        across = np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1)
        across *= np.sign(np.sum(across * (places[on] - inward), axis=-1, keepdims=True))
        length = np.linalg.norm(tangent, axis=-1)
        normals[on, :, 0], normals[on, :, 2] = across[..., 0] / length, across[..., 1] / length
        weights[on] = length * lengths * places[on][..., 0] * angle
        local = [section.element.lbasis(points, i)[0] * np.ones(lengths.size) for i in range(len(section.cells))]
        shapes[on] = np.stack(local, axis=1)
    return Surface(section.cells[:, elements].T.astype(np.int32), shapes, normals, weights, elements, facets, places)


def boundary_nodes(section: Section, name: str, role: str) -> NDArray[np.int64]:
    """Return the displacement nodes on a named boundary."""
    basis = skfem.Basis(section.mesh, section.element, intorder=1, elements=np.arange(1))
    return np.unique(basis.get_dofs(facets_of(section.mesh, name, role)).all())


def angle_integral(harmonic: int) -> float:
    """Return the integral of cos^2(n th) over the circle: 2 pi for n = 0, else pi."""
    return 2 * math.pi if harmonic == 0 else math.pi


def stiffness_blocks(section: Section, elasticity: Array, harmonic: int, *, torsion: bool = False) -> Array:
    """Return the (n_cells, n_local, d, n_local, d) element stiffness; d = 2 (r, z) for harmonic 0, else 3 (r, th, z).

    ``torsion``: for harmonic 0, the motion along th only, d = 1.

    ``elasticity``: (n_cells, 6, 6) in the order rr, tt, zz, tz, rz, rt. Where a cell's material is nearly
    incompressible its dilatation is replaced by the projection on fewer terms (B-bar; Hughes 1980, Simo & Taylor
    1985): its mean, or a linear field on nine-node quadrilaterals.
    """
    symmetric = ([0, 2], [0, 1, 2, 4]) if harmonic == 0 else ([0, 1, 2], [0, 1, 2, 3, 4, 5])
    components, rows = ([1], [3, 5]) if torsion else symmetric
    d, local = len(components), len(section.cells)
    out = np.empty((section.cells.shape[1], local * d, local * d))
    soft = nearly_incompressible(elasticity)
    for some, basis in section.bases():
        r = np.asarray(basis.global_coordinates().value[0])
        strain = np.zeros((*r.shape, 6, local, 3))
        for i, (field, *_) in enumerate(basis.basis):
            by_r, by_z = np.broadcast_to(field.grad, (2, *r.shape))
            revolved_strains(by_r, by_z, np.broadcast_to(np.asarray(field), r.shape) / r, harmonic, strain[..., i, :])
        weight = basis.dx * r * angle_integral(harmonic)
        strain = np.ascontiguousarray(strain[..., components]).reshape(*strain.shape[:3], local * d)
        if np.any(picked := soft[some]):
            strain[picked] = _projected(section, basis, strain, weight, picked)
        strain = strain[:, :, rows]
        stress = elasticity[some][:, None][..., rows, :][..., rows] @ (strain * weight[:, :, None, None])
        shape = (len(some), -1, local * d)
        out[some] = strain.reshape(shape).transpose(0, 2, 1) @ stress.reshape(shape)
    return out.reshape(-1, local, d, local, d)


def revolved_strains(by_r: Array, by_z: Array, over: Array, harmonic: int, out: Array) -> None:
    """Fill the (..., 6, 3) strains of a unit nodal amplitude (U, V, W), of its slopes and its value over r (...)."""
    out[..., 0, 0] = by_r
    out[..., 1, 0], out[..., 1, 1] = over, harmonic * over
    out[..., 2, 2] = by_z
    out[..., 3, 1], out[..., 3, 2] = by_z, -harmonic * over
    out[..., 4, 0], out[..., 4, 2] = by_z, by_r
    out[..., 5, 0], out[..., 5, 1] = -harmonic * over, by_r - over


def nearly_incompressible(elasticity: Array, limit: float = 0.45) -> NDArray[np.bool_]:
    """Return (n,) flags whether Poisson's ratio, by bulk and mean shear modulus, exceeds the ``limit``."""
    bulk = elasticity[:, :3, :3].sum(axis=(1, 2)) / 9
    shear = np.trace(elasticity[:, 3:, 3:], axis1=1, axis2=2) / 3
    return np.asarray((3 * bulk - 2 * shear) / (6 * bulk + 2 * shear) > limit)


def _projected(section: Section, basis: Any, strain: Array, weight: Array, picked: NDArray[np.bool_]) -> Array:
    """Return the strains of the picked cells, with the dilatation projected by weighted least squares."""
    terms = 3 if len(section.cells) == 9 else 1
    place = np.moveaxis(np.asarray(basis.global_coordinates().value), 0, -1)[picked]
    place = place - place.mean(axis=1, keepdims=True)
    place = place / np.abs(place).max(axis=(1, 2), keepdims=True)
    fields = np.concatenate([np.ones_like(place[..., :1]), place], axis=-1)[..., :terms]
    weighted = (fields * weight[picked][..., None]).transpose(0, 2, 1)
    dilatation = strain[picked][:, :, :3].sum(axis=2)
    smooth = fields @ np.linalg.solve(weighted @ fields, weighted @ dilatation)
    out = np.array(strain[picked])
    out[:, :, :3] += ((smooth - dilatation) / 3)[:, :, None]
    return out


def mass_blocks(section: Section, harmonic: int) -> Array:
    """Return the (n_cells, n_local, n_local) consistent integral of phi_i phi_j over each cell's ring [m^3]."""
    local = len(section.cells)
    out = np.empty((section.cells.shape[1], local, local))
    for some, basis in section.bases():
        weight = basis.dx * basis.global_coordinates().value[0] * angle_integral(harmonic)
        value = np.stack([np.broadcast_to(np.asarray(f[0]), weight.shape) for f in basis.basis], axis=1)
        out[some] = (value * weight[:, None, :]) @ value.transpose(0, 2, 1)
    return out
