"""Quality of the elements of a mesh, and checks before it is used."""

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from skfem.quadrature import get_quadrature

from seatfem.structures import errors
from seatfem.structures.mesh import io
from seatfem.units import write_quantity

FLAT = 1e-9  # largest mean det J of a flat element, over the cube of the longest side of its bounding box
SAME_PLACE = 1e-7  # largest distance of coincident nodes, over the diagonal of the mesh
MOST_PAIRS = 16  # largest number of pairs of coincident nodes, per node
SHOWN = 3  # number of places named in a message


@dataclass(frozen=True)
class MeshQuality:
    """Measures of a mesh in SI units; volumes by a quadrature that is exact for the elements' maps.

    ``min_scaled_jacobian``: smallest det J at the nodes and centroid of an element over the mean of its straight twin;
    1 for straight tetrahedra and parallelepipeds, 0 for an element about to fold. ``cad_volume`` and ``cad_areas`` are
    exact, nan and empty for a mesh from a file. For a meridian, volumes and areas are those of the solid of
    revolution, and the Jacobian is relative to the mean of the element itself.
    """

    nodes: int
    elements: int
    min_scaled_jacobian: float
    volume: float
    areas: Mapping[str, float]
    cad_volume: float
    cad_areas: Mapping[str, float]


def measure(
    mesh: io.SolidMesh, arrays: io.MeshArrays, cad_volume: float, cad_areas: Mapping[str, float]
) -> MeshQuality:
    """Return the volume, areas and element quality of a mesh made by `to_skfem`."""
    return MeshQuality(
        nodes=mesh.doflocs.shape[1],
        elements=mesh.nelements,
        min_scaled_jacobian=float(scaled_jacobian(arrays).min()),
        volume=float(_integrals(arrays.kind, arrays.points, arrays.cells).sum()),
        areas={name: _area(mesh, facets) for name, facets in mesh.boundaries.items()},
        cad_volume=cad_volume,
        cad_areas=dict(cad_areas),
    )


def straight_determinants(arrays: io.MeshArrays) -> io.Floats:
    """Return the (m,) mean det J of each element with straight edges, negative for vertices in mirrored order."""
    return _integrals(io.CELL_KINDS[arrays.kind.corners], arrays.points, arrays.vertices, mean=True)


def scaled_jacobian(arrays: io.MeshArrays) -> io.Floats:
    """Return the (m,) smallest det J at nodes and centroid of each element, over |mean det J| with straight edges.

    It is -inf if the element with straight edges is flat, and negative for vertices in mirrored order.
    """
    kind = arrays.kind
    straight = straight_determinants(arrays)
    least = straight.copy()
    if kind.degree > 0:
        for determinant in _determinants(kind, arrays.points, arrays.cells, kind.places):
            np.minimum(least, determinant, out=least)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(straight == 0.0, -np.inf, least / np.abs(straight))


def _integrals(kind: io.CellKind, points: io.Floats, cells: io.Integers, *, mean: bool = False) -> io.Floats:
    """Return the integral of det J over each element, its volume; or its mean; (m,)."""
    places, weights = get_quadrature(kind.element.refdom, kind.degree)
    if mean:
        weights = weights / weights.sum()
    total = np.zeros(len(cells))
    for weight, determinant in zip(weights, _determinants(kind, points, cells, places.T), strict=True):
        total += weight * determinant
    return total


def _determinants(kind: io.CellKind, points: io.Floats, cells: io.Integers, places: io.Floats) -> Iterator[io.Floats]:
    """Yield the (m,) det J of all elements at each of the places."""
    nodes = points[cells.T].transpose(0, 2, 1).reshape(cells.shape[1], -1)
    for gradient in kind.gradients(places):
        a, b, c = (gradient.T @ nodes).reshape(3, 3, -1)
        yield (
            a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        )


def _area(mesh: io.SolidMesh, facets: io.Integers) -> float:
    """Return the area of facets; a FacetBasis would invert the elements' maps, which fails on coarse curved ones."""
    points, weights = get_quadrature(mesh.brefdom, 6)
    return float(np.sum(np.abs(mesh.mapping().detDG(points, find=facets)) * weights))


def check_mesh(
    arrays: io.MeshArrays, required: tuple[str, ...] = ("contact", "fixed"), parts: int = 1
) -> io.MeshArrays:
    """Return the mesh, with its vertices reordered if all elements are mirrored.

    Raises `MeshError` for a missing or empty group, coordinates that are not finite, flat, inside-out and folded
    elements, and another number of connected parts than ``parts``; messages give places.
    """
    check_groups(arrays, required)
    if not np.all(np.isfinite(arrays.points)):
        raise errors.MeshError(
            f"{arrays.source}: {np.sum(~np.isfinite(arrays.points))} node coordinates must be finite and are not"
        )
    arrays = right_side_out(arrays)
    check_elements(arrays)
    check_parts(arrays, parts)
    return arrays


def check_groups(arrays: io.MeshArrays, required: tuple[str, ...]) -> None:
    """Raise `MeshError` unless every required surface group exists and no group is empty."""
    for name in required:
        if name not in arrays.surfaces:
            listed = ", ".join(map(repr, sorted(arrays.surfaces))) or "none"
            raise errors.MeshError(f"{arrays.source}: no surface group named {name!r}; the mesh has: {listed}")
    for kind, groups in (("surface", arrays.surfaces), ("volume", arrays.volumes)):
        for name, members in groups.items():
            if len(members) == 0:
                raise errors.MeshError(f"{arrays.source}: {kind} group {name!r} is empty; remove it, or fill it")


def right_side_out(arrays: io.MeshArrays) -> io.MeshArrays:
    """Return the mesh with its vertices reordered if all elements are mirrored, as after mirroring a part."""
    if len(arrays.cells) == 0 or not np.all(straight_determinants(arrays) < 0.0):
        return arrays
    nodes = arrays.kind.nodes
    mirrored = nodes[:, [1, 0, 2]]
    columns = np.abs(mirrored[:, None, :] - nodes[None, :, :]).sum(axis=2).argmin(axis=1)
    return dataclasses.replace(arrays, cells=np.ascontiguousarray(arrays.cells[:, columns]))


def check_elements(arrays: io.MeshArrays) -> None:
    """Raise `MeshError` if an element is flat, inverted, or folded by its curvature."""
    straight = straight_determinants(arrays)
    box = np.ptp(arrays.points[arrays.vertices], axis=1).max(axis=1) ** 3
    _none(
        arrays,
        np.abs(straight) <= FLAT * box,
        straight,
        "flat elements (no volume)",
        "remove them in the program that wrote the mesh",
    )
    _none(
        arrays,
        straight < 0.0,
        straight,
        "inside-out elements, inverted against the others",
        "their vertices are in mirrored order: reorder them in the program that wrote the mesh",
    )
    jacobian = scaled_jacobian(arrays)
    _none(
        arrays,
        ~(jacobian > 0.0),
        jacobian,
        f"inverted elements, folded by their shape (smallest scaled Jacobian {jacobian.min(initial=1.0):.3g})",
        "use smaller elements there, or straight ones (curved = False)",
    )


def check_parts(arrays: io.MeshArrays, parts: int = 1) -> None:
    """Raise `MeshError` unless the mesh consists of ``parts`` connected parts."""
    label = part_of_element(arrays)
    count = int(label.max(initial=-1)) + 1
    if count == parts:
        return
    sizes = np.bincount(label)
    largest = np.argsort(sizes)[::-1][: 2 * SHOWN]
    listed = "; ".join(
        f"{sizes[k]} elements around {_place(arrays.points[arrays.vertices[label == k]].mean(axis=(0, 1)))}"
        for k in largest
    )
    more = f"; {count - len(largest)} more" if count > len(largest) else ""
    raise errors.MeshError(
        f"{arrays.source}: the mesh has {count} parts that share no node, not {parts}: {listed}{more}; "
        f"join them (merge = TOLERANCE where their nodes coincide), drop the loose ones, or accept parts = {count}"
    )


def part_of_element(arrays: io.MeshArrays) -> io.Integers:
    """Return the number of the connected part that each element belongs to, from 0; (m,)."""
    vertices = arrays.vertices
    n = len(arrays.points)
    first = np.repeat(vertices[:, 0], vertices.shape[1] - 1)
    graph = coo_array((np.ones(len(first), dtype=np.int8), (first, vertices[:, 1:].ravel())), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    _, part = np.unique(label[vertices[:, 0]], return_inverse=True)
    return np.asarray(part.ravel())


def check_coincident(arrays: io.MeshArrays) -> None:
    """Raise `MeshError` if two vertices of elements coincide: a seam that was not merged, or a slit."""
    used = io.distinct(arrays.vertices)
    places = arrays.points[used]
    diagonal = float(np.linalg.norm(np.ptp(places, axis=0)))
    pairs = near_pairs(places, SAME_PLACE * diagonal, arrays.source)
    if len(pairs):
        raise errors.MeshError(
            f"{arrays.source}: {len(np.unique(pairs[:, 1]))} nodes stand where another one stands and the elements "
            f"there are not joined; first at {_places(places[pairs[:, 0]])}; state merge = "
            f'"{write_quantity(1e-5 * diagonal, "length", 1)}", which joins them, or "0 m", which keeps the slit'
        )


def nearest_distances(points: io.Floats, others: io.Floats) -> io.Floats:
    """Return the (n,) distances of points from the nearest of others; ``inf`` if there are none."""
    if not len(others):
        return np.full(len(points), np.inf)
    return np.asarray(cKDTree(others).query(points)[0], dtype=np.float64)


def near_pairs(points: io.Floats, within: float, source: str) -> io.Integers:
    """Return the (n, 2) pairs of rows of points nearer to each other than ``within``.

    Raises:
        MeshError: more pairs than `MOST_PAIRS` per point; pairs are counted before they are listed.
    """
    tree = cKDTree(points)
    count = (int(tree.count_neighbors(tree, within)) - len(points)) // 2
    if count > MOST_PAIRS * len(points):
        raise errors.MeshError(
            f"{source}: {count:.3g} pairs of its {len(points)} nodes are nearer to each other than {within:.3g}, must "
            f"be at most {MOST_PAIRS} for each node: its nodes stand on top of each other, export it again"
        )
    return np.asarray(tree.query_pairs(within, output_type="ndarray"))


def _none(arrays: io.MeshArrays, bad: NDArray[np.bool_], measure: io.Floats, what: str, remedy: str) -> None:
    """Raise `MeshError` if an element is bad; the message begins with the worst by ``measure``."""
    rows = np.flatnonzero(bad)
    if len(rows):
        worst = rows[np.argsort(measure[rows], kind="stable")]
        centres = arrays.points[arrays.vertices[worst[:SHOWN]]].mean(axis=1)
        raise errors.MeshError(f"{arrays.source}: {len(rows)} {what}, near {_places(centres)}; {remedy}")


def _places(points: io.Floats) -> str:
    more = ", ..." if len(points) > SHOWN else ""
    return ", ".join(map(_place, points[:SHOWN])) + more


def _place(point: io.Floats) -> str:
    x, y, z = 1e3 * point + 0.0
    return f"({x:.4g}, {y:.4g}, {z:.4g}) mm"
