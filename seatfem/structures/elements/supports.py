"""Supports and ports of a body, and its second-order model by matrices, damping and supports, for all solid models.

At each node the forbidden directions span a space; the unknowns are the displacements along an orthonormal basis of its
complement, so that K -> T'KT keeps symmetry and T'MT keeps a nodal mass diagonal. With the traction t = -(k_n n n' +
k_t (I - n n')) u - (d_n n n' + d_t (I - n n')) u' on a boundary, K and C gain

    integral of N' (k_n n n' + k_t (I - n n')) N dA,        integral of N' (d_n n n' + d_t (I - n n')) N dA

A port is the load and observation vector of a contact patch, with its area and impedance. Rings divide a disk, or a
ring with inner and outer edge, by the distance from its axis, a cylinder by the position along the axis, and every
other patch by the distance from its rim, however many faces it has.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from seatfem.structures import errors, lands, materials, model
from seatfem.structures.elements.shape_functions import Array, Discretization, Surface, surface
from seatfem.structures.errors import ModelError
from seatfem.structures.rings import parted, ring_borders, ring_names
from seatfem.structures.shapes.loops import unshared

ONE_RADIUS = 1e-3  # largest relative difference of radii of a circle, or a cylinder
STRUCK: Final = MappingProxyType({"contact": "contact"})  # port and boundary of a body that is struck at one place
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
    waves = evaluate_by_solid(patch, solids, region, lambda solid, normals: solid.density * solid.c_p_along(normals))
    ports = (_port(patch, weights, waves, n_nodes) for weights in shares)
    return dict(zip(called, ports, strict=True))


def along(lip: lands.FaceLip, patch: Surface) -> model.Array:
    """Return the (p, f, Q) weights of a patch's points in each part of a lip: arcs of equal area, divided into rings.

    Weights of points at a border are split between the parts; all parts add up to what of the patch lies on the lip.
    """
    around, across, held = lip.places(patch.places.reshape(-1, 3))
    arcs = np.zeros((lip.arcs, len(around)))
    arcs[:, held] = parted(around[held], patch.weights.ravel()[held], np.arange(lip.arcs + 1) / lip.arcs)
    parts = np.zeros((lip.arcs, lip.rings, arcs.shape[1]))
    for arc, weights in enumerate(arcs):
        inside = np.flatnonzero(weights)
        parts[arc][:, inside] = parted(across[inside], weights[inside], ring_borders(lip.rings))
    return parts.reshape(-1, *patch.weights.shape)


def evaluate_by_solid(
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


Constraint = tuple[NDArray[np.integer], Array]
"""Nodes, and the (3,) direction in which their displacement is zero."""
_ALIGNED = 1e-6  # largest 1 - cos of the angle between normals, or between a normal and the axis that replaces it
_FREE = 1e-9  # eigenvalue of the sum of d d' over held unit directions d below which a direction is free


@dataclass(frozen=True)
class Freedom:
    """Unknowns after constraints on the three displacements of each node.

    Attributes:
        displacements: (3 n, n_free) T with orthonormal columns: displacements = T unknowns.
        free: (n_free,) 3 node + component of each unknown; 3 node + a counter for unknowns oblique to the axes.
    """

    displacements: sparse.csr_array
    free: NDArray[np.int64]

    @cached_property
    def base(self) -> NDArray[np.int64]:
        """Return (n_base,) numbers 3 node + component of the displacements that are not zero: they are assembled."""
        return np.flatnonzero(np.diff(self.displacements.indptr))

    @cached_property
    def unknown(self) -> NDArray[np.int32]:
        """Return the (n, 3) number of each displacement among those assembled, -1 if it is held."""
        numbers = np.full(self.displacements.shape[0], -1, dtype=np.int32)
        numbers[self.base] = np.arange(len(self.base))
        return numbers.reshape(-1, 3)

    @cached_property
    def turn(self) -> sparse.csr_array | None:
        """Return the (n_base, n_free) map from unknowns to assembled displacements, ``None`` if they are the same."""
        return None if np.array_equal(self.base, self.free) else sparse.csr_array(self.displacements[self.base])

    def turned(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """Return a matrix of the assembled displacements transformed to the unknowns."""
        if self.turn is None:
            return matrix
        product = (self.turn.T @ matrix @ self.turn).tocsr()
        return sparse.csr_array((product + product.T) / 2)


def freedom(n_nodes: int, constraints: Iterable[Constraint]) -> Freedom:
    """Return the unknowns under constraints; a node held along coordinate axes has the other axes as unknowns."""
    forbidden = np.zeros((n_nodes, 3, 3))
    for nodes, direction in constraints:
        unit = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        forbidden[nodes] += np.outer(unit, unit)
    axes = np.eye(3, dtype=bool)
    strength, bases = forbidden[:, axes], np.broadcast_to(np.eye(3), forbidden.shape).copy()
    oblique = np.flatnonzero(np.any(forbidden[:, ~axes], axis=1))
    if oblique.size:
        strength[oblique], bases[oblique] = np.linalg.eigh(forbidden[oblique])
    node, column = np.nonzero(strength < _FREE)
    values, rows = bases[node, :, column], 3 * node[:, None] + np.arange(3)
    columns = np.broadcast_to(np.arange(len(node))[:, None], rows.shape)
    used = values != 0
    shape = (3 * n_nodes, len(node))
    turned = sparse.csr_array((values[used], (rows[used], columns[used])), shape=shape)
    return Freedom(turned, 3 * node + column)


def held(
    made: Discretization, fixed: Sequence[str], sliding: Sequence[str], antisymmetric: Sequence[str]
) -> Iterator[Constraint]:
    """Yield nodes and held directions of clamped faces, and of planes without normal or without tangential motion.

    Raises:
        ModelError: a boundary that is missing or empty, or not plane although sliding or antisymmetric.
    """
    for name in fixed:
        nodes = surface(made, name, "fixed").nodes
        yield from ((nodes, axis) for axis in np.eye(3))
    for role, group in (("sliding", sliding), ("antisymmetric", antisymmetric)):
        for name in group:
            plane = surface(made, name, role)
            normal, *along = _frame(plane.normals.reshape(-1, 3), f"{role}: boundary {name!r}")
            yield from ((plane.nodes, axis) for axis in ([normal] if role == "sliding" else along))


def _frame(normals: Array, what: str) -> Array:
    """Return (3, 3) rows: the normal of a plane, or the axis to which it is close, and two directions in the plane."""
    n = normals[0] / np.linalg.norm(normals[0])
    if (off := 1 - np.abs(normals @ n).min()) > _ALIGNED:
        raise ModelError(f"{what} must be plane (its normal turns by {np.degrees(np.arccos(1 - off)):.2g} degrees)")
    axis = int(np.argmax(np.abs(n)))
    if 1 - abs(n[axis]) <= _ALIGNED:
        return np.roll(np.eye(3), -axis, axis=0)
    across = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
    across /= np.linalg.norm(across)
    return np.stack([n, across, np.cross(n, across)])


_MINDLIN = 0.82  # ratio of tangential to normal contact stiffness at nu = 0.3, 2 (1 - nu)/(2 - nu)


Densities = Sequence[tuple[Literal["K", "C"], Array, Array]]
"""Stiffness (K) or damping (C) per area, along and across the normal, at the points (f, Q) of a patch."""


@dataclass(frozen=True)
class _Even:
    """Base of supports with uniform values: ``normal`` along the normal of ``boundary``, ``tangential`` across it."""

    boundary: str
    normal: float
    tangential: float | None = 0.0

    def __post_init__(self) -> None:
        for name in ("normal", "tangential"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                kind = type(self).__name__
                raise ModelError(f"{kind}({self.boundary!r}): {name} = {value} must be finite and >= 0")

    def densities(self, patch: Surface, solids: Sequence[materials.Solid], region: NDArray[np.int32]) -> Densities:
        """Return the spring stiffness per area."""
        one = np.ones(patch.weights.shape)
        return [("K", self.normal * one, (self.tangential or 0.0) * one)]


@dataclass(frozen=True)
class Foundation(_Even):
    """Elastic foundation (Winkler): stiffness per area [N/m^3] along and across the normal of ``boundary``."""


@dataclass(frozen=True)
class Bolted(_Even):
    """A bolted face: contact stiffness per area [N/m^3]; across the normal 0.82 of it (Mindlin 1949) unless given."""

    tangential: float | None = None

    def __post_init__(self) -> None:
        if self.tangential is None:
            object.__setattr__(self, "tangential", _MINDLIN * self.normal)
        super().__post_init__()


@dataclass(frozen=True)
class Dashpot(_Even):
    """Viscous support [N s/m^3] along and across the normal of ``boundary``."""

    def densities(self, patch: Surface, solids: Sequence[materials.Solid], region: NDArray[np.int32]) -> Densities:
        """Return the damping per area."""
        return [("C", along, across) for _, along, across in super().densities(patch, solids, region)]


@dataclass(frozen=True)
class Absorbing:
    """Boundary through which waves leave into the rest of the body: dashpots rho c_p along, rho c_s across the normal.

    Waves that arrive along the normal leave; others are reflected in part (Lysmer & Kuhlemeyer 1969). With ``centre``,
    the place [m] the waves come from, at the distance R, springs 4 mu/R along and 2 mu/R across the normal stand for
    the body beyond: the boundary is then right for slow motion too (Liu, Du, Du, Wang & Wu 2006).
    """

    boundary: str
    centre: tuple[float, float, float] | None = None

    def densities(self, patch: Surface, solids: Sequence[materials.Solid], region: NDArray[np.int32]) -> Densities:
        """Return dashpots and, with a centre, springs; `ModelError` on a meridian, which has no centre."""
        along = evaluate_by_solid(
            patch, solids, region, lambda solid, normals: solid.density * solid.c_p_along(normals)
        )
        across = evaluate_by_solid(patch, solids, region, lambda solid, normals: solid.density * solid.c_s)
        if self.centre is None:
            return [("C", along, across)]
        if patch.places.shape[-1] != len(self.centre):
            raise ModelError(f"Absorbing({self.boundary!r}): centre serves solid models only; leave it out")
        rigidity = evaluate_by_solid(patch, solids, region, lambda solid, normals: solid.density * solid.c_s**2)
        spring = rigidity / np.linalg.norm(patch.places - np.asarray(self.centre), axis=-1)
        return [("C", along, across), ("K", 4 * spring, 2 * spring)]


Support = Foundation | Bolted | Dashpot | Absorbing


def spread_supports(
    supports: Sequence[Support],
    patches: Sequence[Surface],
    solids: Sequence[materials.Solid],
    region: NDArray[np.int32],
    n_nodes: int,
) -> dict[Literal["K", "C"], sparse.csr_array]:
    """Return the matrices (3 n, 3 n) that supports on their ``patches`` add to "K" and "C"; no key if they add none."""
    sums: dict[Literal["K", "C"], sparse.csr_array] = {}
    for support, patch in zip(supports, patches, strict=True):
        for target, along, across in support.densities(patch, solids, region):
            matrix = _spread(patch, along, across, n_nodes)
            sums[target] = sums[target] + matrix if target in sums else matrix
    return sums


def _spread(patch: Surface, along: Array, across: Array, n_nodes: int) -> sparse.csr_array:
    """Return the integral of N' (along n n' + across (I - n n')) N over the patch."""
    n = patch.normals
    tensor = across[..., None, None] * np.eye(3) + ((along - across)[..., None] * n)[..., None] * n[..., None, :]
    tensor *= patch.weights[..., None, None]
    blocks = np.einsum("fqi,fqj,fqab->fiajb", patch.shapes, patch.shapes, tensor, optimize=True)
    return sum_blocks(patch.cells, blocks, n_nodes)


def sum_blocks(cells: NDArray[np.integer], blocks: Array, n_nodes: int) -> sparse.csr_array:
    """Return the (3 n, 3 n) sum of the matrices of cells (m, k), each of 3 k rows and columns, three a node."""
    unknowns = (3 * cells[:, :, None].astype(np.int64) + np.arange(3)).reshape(len(cells), -1)
    width = unknowns.shape[1]
    rows, columns = np.repeat(unknowns, width, axis=1).ravel(), np.tile(unknowns, (1, width)).ravel()
    matrix = sparse.csr_array((blocks.ravel(), (rows, columns)), shape=(3 * n_nodes, 3 * n_nodes))
    return sparse.csr_array((matrix + matrix.T) / 2)  # symmetric to the last bit


Matrices = Callable[[Array], tuple[sparse.csr_array, sparse.csr_array]]
"""Function to (K, M) of a body, with stiffness and density of each region scaled by its row of (regions, 2) factors."""


def whole_model(
    matrices: Matrices,
    solids: Sequence[materials.Solid],
    rayleigh: tuple[float, float],
    supports: Mapping[Literal["K", "C"], sparse.csr_array],
    ports: Mapping[str, model.Port],
    dofs: model.DofMap,
    copies: int = 1,
) -> model.SecondOrderModel:
    """Return M, K, C = sum of alpha_r M_r + beta_r K_r and H = sum of eta_r K_r over regions r, with supports.

    Args:
        matrices: function to K and M of the body, in its unknowns.
        solids: materials of the regions.
        rayleigh: (alpha [1/s], beta [s]) of all regions, in addition to their own.
        supports: matrices that supports add to K and C, in the unknowns; absent keys add nothing.
        copies: number of equal sectors; all matrices are multiplied by it.
    """
    pairs = np.array([solid.rayleigh for solid in solids]) + np.array(rayleigh)
    losses = np.array([solid.loss_factor for solid in solids])
    K, M = matrices(np.ones_like(pairs))
    C = H = None
    if np.ptp(pairs, axis=0).any():
        of_stiffness, of_mass = matrices(pairs[:, ::-1])
        C = of_mass + of_stiffness
    elif pairs.any():
        C = pairs[0, 0] * M + pairs[0, 1] * K
    if np.ptp(losses):
        H = matrices(np.stack([losses, np.zeros_like(losses)], axis=1))[0]
    elif losses.any():
        H = losses[0] * K
    if "K" in supports:
        K = K + supports["K"]
    if "C" in supports:
        C = supports["C"] if C is None else C + supports["C"]
    if copies > 1:
        M, K = M * copies, K * copies
        C, H = (None if matrix is None else matrix * copies for matrix in (C, H))
    springs, dashpots = (key in supports and bool(supports[key].count_nonzero()) for key in ("K", "C"))
    known = model.Damping.from_regions(pairs, losses, H, springs=springs, dashpots=dashpots)
    return model.SecondOrderModel(M, C, K, ports, dofs, H, known)
