"""Mass, stiffness and ports of thick plates: Mindlin-Reissner theory on curved quadrilaterals of nine nodes.

A node has the deflection w and the rotations a = (a_x, a_y) of its normal, grad w in thin plates. Unknowns are w and
l a, l the typical side of an element: as both then have one unit, the solution is 200 times as accurate. With
D = E h^3/(12 (1 - nu^2)), kappa = 5/6 and G = E/(2 (1 + nu)),

    2 U = integral of D ((a_x,x + a_y,y)^2 - 2 (1 - nu) (a_x,x a_y,y - (a_x,y + a_y,x)^2/4)) + kappa G h |grad w - a|^2
    2 T = integral of rho h w'^2 + rho h^3/12 |a'|^2

Bending and mass are integrated by 3 x 3 Gauss points, shear by 2 x 2, which keeps thin plates from locking (Hughes,
Cohen & Haroun, Nuclear Engineering and Design 46 (1978) 203). This alone has a zero-energy mode on every mesh:
w = +1 at vertices, -1 at middles of sides, 0 at centres. The part of its shear strain that vanishes at 2 x 2 points is
therefore given its energy, times h^2/(h^2 + A) in an element of area A. That part is zero where grad w = a.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from impact.march.loop.compiled import compiled
from impact.quantities import brief
from seatfem.structures.elements.supports import sum_blocks, whole_model
from seatfem.structures.errors import ModelError
from seatfem.structures.lip import Patch
from seatfem.structures.materials import Material
from seatfem.structures.model import Array, DofMap, Port, SecondOrderModel

Unknown = Literal["w", "a_x", "a_y"]
Integers = NDArray[np.int64]

UNKNOWNS: Final[tuple[Unknown, ...]] = ("w", "a_x", "a_y")
SHEAR: Final = 5 / 6  # shear factor kappa of a rectangular section
_NODES: Final = ((-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0))  # gmsh's order
_NORM: Final = 15 / 8  # 1 over the integral of the squared pattern of `_unseen`, 2 * 2/3 * 2/5
_FLAT: Final = 1e-6  # largest ratio of the least to the greatest Jacobian of a folded element
_NEAREST: Final = 16  # number of elements with the nearest centres in which a point is searched
_NEWTON: Final = 12  # most steps of Newton's iteration
_BEYOND: Final = 1.5  # bound on the reference coordinates of points outside an element
_REACH: Final = 1.25  # factor on the distance of the farthest node from the centre: sides bulge between nodes
_SETTLED: Final = 1e-12  # step at which Newton's iteration ends, in reference coordinates
_INSIDE: Final = 1e-6  # largest distance beyond the sides of an element at which a point counts as inside


@dataclass(frozen=True)
class PlateMesh:
    """The mid-surface of a plate, of curved quadrilaterals.

    Attributes:
        points: (n, 2) nodes [m].
        cells: (m, 9) nodes of each element: vertices anticlockwise, middles of the sides 01, 12, 23, 30, centre.
        lines: nodes on named parts of the outline.

    Raises:
        ModelError: arrays of another shape, elements that are folded or turned over, unused nodes.
    """

    points: Array
    cells: Integers
    lines: Mapping[str, Integers] = field(default_factory=dict)

    __repr__ = brief

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", np.asarray(self.points, dtype=float))
        object.__setattr__(self, "cells", np.asarray(self.cells, dtype=np.int64))
        if self.points.ndim != 2 or self.points.shape[1] != 2 or not np.all(np.isfinite(self.points)):
            raise ModelError(f"plate: points of shape {self.points.shape} must be (n, 2) and finite")
        if self.cells.ndim != 2 or self.cells.shape[1] != 9 or not len(self.cells):
            raise ModelError(f"plate: cells of shape {self.cells.shape} must be (m, 9), at least one element")
        used = np.unique(self.cells)
        if used[0] < 0 or used[-1] >= len(self.points) or len(used) < len(self.points):
            raise ModelError(f"plate: the cells name {len(used)} nodes of {len(self.points)}: each must be in one")
        _check_shape(self)

    @property
    def area(self) -> float:
        """Return the area of the mid-surface [m^2]."""
        return float(_jacobians(self, *_gauss(3))[1].sum())

    @cached_property
    def side(self) -> float:
        """Return l, the root of the mean area of an element [m]."""
        return math.sqrt(self.area / len(self.cells))

    def centre(self, cell: int) -> str:
        """Return the centre of an element, for messages."""
        x, y = self.points[self.cells[cell, 8]]
        return f"({1e3 * x:.4g}, {1e3 * y:.4g}) mm"


def assemble_plate(
    mesh: PlateMesh,
    material: Material,
    thickness: float,
    *,
    clamped: str | Sequence[str] = (),
    held: Mapping[str, Sequence[Unknown]] = MappingProxyType({}),
    ports: Mapping[str, Patch] = MappingProxyType({}),
) -> SecondOrderModel:
    """Assemble the bending motion of a plate by the theory of this module.

    Args:
        mesh: mesh of the mid-surface.
        material: isotropic material, with its damping.
        thickness: h [m].
        clamped: names of ``mesh.lines`` without deflection and rotation; ``()`` for a free plate.
        held: unknowns that vanish on other lines: a simple support has ``("w",)``, or w and the rotation along it.
        ports: patches, loaded by a uniform pressure and observed by their mean deflection.

    Returns:
        The model; its ``dofs.expand`` gives displacements (3, n) of the mid-surface.

    Raises:
        ModelError: an unknown line, a thickness that is not positive, a patch that extends beyond the plate.
    """
    if not (np.isfinite(thickness) and thickness > 0):
        raise ModelError(f"plate: thickness = {thickness:g} m must be positive and finite")
    dofs = plate_dofs(mesh, clamped=clamped, held=held)
    free = dofs.free
    stiffness, mass = _stiffness(mesh, material, thickness), _mass(mesh, material.density, thickness)
    K, M = (_assembled(mesh, blocks)[free][:, free] for blocks in (stiffness, mass))
    patches = plate_ports(mesh, ports, material, free)
    return whole_model(lambda scale: (K * scale[0, 0], M * scale[0, 1]), [material], (0.0, 0.0), {}, patches, dofs)


def plate_dofs(
    mesh: PlateMesh, *, clamped: str | Sequence[str] = (), held: Mapping[str, Sequence[Unknown]] = MappingProxyType({})
) -> DofMap:
    """Return the unknowns of `assemble_plate`. Raises `ModelError` for an unknown line."""
    lines = [clamped] if isinstance(clamped, str) else clamped
    count, moves = len(mesh.points), np.ones((len(mesh.points), 3), dtype=bool)
    for name, unknowns in {**held, **dict.fromkeys(lines, UNKNOWNS)}.items():
        if name not in mesh.lines:
            raise ModelError(f"plate: no line {name!r}; the mesh has {', '.join(mesh.lines) or 'none'}")
        for unknown in unknowns:
            moves[mesh.lines[name], UNKNOWNS.index(unknown)] = False
    free = np.flatnonzero(moves)
    upwards = sparse.coo_array((np.ones(count), (3 * np.arange(count) + 2, 3 * np.arange(count))), (3 * count,) * 2)
    rigid = np.zeros((count, 3, 3))  # w = 1, x, y with their rotations
    rigid[:, 0, 0], rigid[:, 0, 1:] = 1.0, mesh.points - mesh.points.mean(axis=0)
    rigid[:, 1, 1] = rigid[:, 2, 2] = mesh.side
    points = np.column_stack([mesh.points, np.zeros(count)]).T
    return DofMap(points, free, mesh, sparse.csr_array(upwards.tocsc()[:, free]), rigid.reshape(3 * count, 3)[free])


def plate_ports(mesh: PlateMesh, patches: Mapping[str, Patch], material: Material, free: Integers) -> dict[str, Port]:
    """Return ports of patches under a uniform pressure; ``free``: numbers of the unknowns that are not held.

    Raises:
        ModelError: a point of a patch outside the plate.
    """
    areas = [float(patch.weights.sum()) for patch in patches.values()]
    vectors = average(mesh, *patches.values(), names=tuple(patches))
    return {
        name: Port(vector[free], area, material.density * material.c_p * area)
        for name, vector, area in zip(patches, vectors, areas, strict=True)
    }


def average(mesh: PlateMesh, *patches: Patch, names: Sequence[str] = ("port",)) -> list[Array]:
    """Return the vector b (3 n,) of each patch, so that b'u is its mean deflection; ``names`` is for messages.

    Raises:
        ModelError: a point of a patch outside the plate.
    """
    counts = [len(patch.weights) for patch in patches]
    if not counts:
        return []
    whose = np.repeat(list(names), counts)
    cells, inside = located(mesh, np.concatenate([patch.points for patch in patches]), whose)
    averages = []
    for patch, rows in zip(patches, np.split(np.arange(sum(counts)), np.cumsum(counts)[:-1]), strict=True):
        vector = np.zeros(len(mesh.points))
        shares = shapes_at(inside[rows])[0] * (patch.weights / patch.weights.sum())[:, None]
        np.add.at(vector, mesh.cells[cells[rows]], shares)
        averages.append(np.asarray(np.kron(vector, [1.0, 0.0, 0.0])))
    return averages


def deflections(mesh: PlateMesh, nodal: Array, points: Array) -> Array:
    """Return the (q,) deflections at points (q, 2) [m] from those at the nodes (n,). Raises like `average`."""
    cells, inside = located(mesh, points, np.full(len(points), "a point"))
    return np.asarray(np.einsum("qk,qk->q", shapes_at(inside)[0], nodal[mesh.cells[cells]]))


def everywhere(mesh: PlateMesh) -> Array:
    """Return b (3 n,), so that b'u is the mean deflection of the plate; b is also the load by a unit total pressure."""
    _, weights, shapes = _jacobians(mesh, *_gauss(3))
    vector = np.zeros(len(mesh.points))
    np.add.at(vector, mesh.cells, weights @ shapes)
    return np.asarray(np.kron(vector / weights.sum(), [1.0, 0.0, 0.0]))


def _stiffness(mesh: PlateMesh, material: Material, thickness: float) -> Array:
    """Return the (m, 27, 27) stiffness, w and a node by node."""
    young, nu = material.young, material.poisson
    rigidity = young * thickness**3 / (12 * (1 - nu**2))
    shear = SHEAR * material.lame[1] * thickness
    slopes, weights, _ = _jacobians(mesh, *_gauss(3))
    bend = np.zeros((*weights.shape, 3, 9, 3))
    bend[:, :, 0, :, 1] = bend[:, :, 2, :, 2] = slopes[..., 0]
    bend[:, :, 1, :, 2] = bend[:, :, 2, :, 1] = slopes[..., 1]
    law = rigidity * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    stiffness = _energy(bend, weights, law)
    slopes, weights, shapes = _jacobians(mesh, *_gauss(2))
    strain = np.zeros((*weights.shape, 2, 9, 3))  # grad w - a
    strain[..., 0] = np.swapaxes(slopes, 2, 3)
    strain[:, :, 0, :, 1] = strain[:, :, 1, :, 2] = -shapes
    stiffness += _energy(strain, weights, shear * np.eye(2))
    unseen = _unseen(mesh)
    area = _jacobians(mesh, *_gauss(3))[1].sum(axis=1)
    factor: Array = _NORM * shear * thickness**2 / (thickness**2 + area)
    return stiffness + factor[:, None, None] * unseen[:, :, None] * unseen[:, None, :]


def _unseen(mesh: PlateMesh) -> Array:
    """Return the (m, 27) projection of grad w - a, in reference coordinates, on (s (3 t^2 - 1), t (3 s^2 - 1))/2.

    This pattern is zero at the 2 x 2 Gauss points.
    """
    points, weights = _gauss(3)
    shapes, slopes = shapes_at(points)
    tangents = np.einsum("qks,mkc->mqsc", slopes, mesh.points[mesh.cells])
    s, t = points.T
    pattern = np.stack([s * (3 * t**2 - 1), t * (3 * s**2 - 1)], axis=1) / 2 * weights[:, None]
    part = np.zeros((len(mesh.cells), 9, 3))
    part[..., 0] = np.einsum("qs,qks->k", pattern, slopes)
    part[..., 1:] = -np.einsum("qs,qk,mqsc->mkc", pattern, shapes, tangents, optimize=True)
    return part.reshape(-1, 27)


def _energy(strain: Array, weights: Array, law: Array) -> Array:
    """Return the (m, 27, 27) sum over the points of strain' law strain."""
    flat = strain.reshape(*strain.shape[:3], 27)
    stress = np.einsum("ij,mqjk->mqik", law, flat, optimize=True) * weights[..., None, None]
    rows = flat.reshape(len(flat), -1, 27)
    return np.asarray(np.swapaxes(rows, 1, 2) @ stress.reshape(rows.shape))


def _mass(mesh: PlateMesh, density: float, thickness: float) -> Array:
    """Return the (m, 27, 27) consistent mass."""
    _, weights, shapes = _jacobians(mesh, *_gauss(3))
    each = np.einsum("mq,qi,qj->mij", weights, shapes, shapes, optimize=True)
    inertia = density * thickness * np.diag([1.0, thickness**2 / 12, thickness**2 / 12])
    return np.asarray(np.einsum("mij,ab->miajb", each, inertia).reshape(-1, 27, 27))


def _assembled(mesh: PlateMesh, blocks: Array) -> sparse.csr_array:
    """Return the (3 n, 3 n) matrix of (m, 27, 27), for unknowns w and l a."""
    scale = np.tile([1.0, 1 / mesh.side, 1 / mesh.side], 9)
    return sum_blocks(mesh.cells, blocks * scale[:, None] * scale, len(mesh.points))


def _gauss(count: int) -> tuple[Array, Array]:
    """Return the points (count^2, 2) and weights of the square from -1 to 1."""
    x, weights = np.polynomial.legendre.leggauss(count)
    points = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    return points, np.outer(weights, weights).ravel()


def shapes_at(points: Array) -> tuple[Array, Array]:
    """Return the shape functions (q, 9) and their slopes (q, 9, 2) at (q, 2) reference points."""
    nodes = np.array(_NODES) + 1  # of the factors at -1, 0 and 1
    values = np.stack([points * (points - 1) / 2, 1 - points**2, points * (points + 1) / 2], axis=-1)
    slopes = np.stack([points - 0.5, -2 * points, points + 0.5], axis=-1)
    in_s, in_t = values[:, 0, nodes[:, 0]], values[:, 1, nodes[:, 1]]
    along = np.stack([slopes[:, 0, nodes[:, 0]] * in_t, in_s * slopes[:, 1, nodes[:, 1]]], axis=-1)
    return np.asarray(in_s * in_t), along


def _jacobians(mesh: PlateMesh, points: Array, weights: Array) -> tuple[Array, Array, Array]:
    """Return slopes (m, Q, 9, 2) along x and y, weights (m, Q) times the Jacobian, and the shape functions (Q, 9)."""
    shapes, slopes = shapes_at(points)
    tangents = np.einsum("qks,mkc->mqsc", slopes, mesh.points[mesh.cells])
    turned = np.einsum("qks,mqcs->mqkc", slopes, np.linalg.inv(tangents), optimize=True)
    return turned, np.linalg.det(tangents) * weights, shapes


def _check_shape(mesh: PlateMesh) -> None:
    """Raise `ModelError` if a Jacobian is not positive at the nodes or the Gauss points."""
    slopes = shapes_at(np.concatenate([np.array(_NODES, dtype=float), _gauss(3)[0]]))[1]
    tangents = np.einsum("qks,mkc->mqsc", slopes, mesh.points[mesh.cells])
    det = np.linalg.det(tangents)
    bad = np.flatnonzero(det.min(axis=1) <= _FLAT * np.abs(det).max(axis=1))
    if len(bad):
        raise ModelError(
            f"plate: {len(bad)} of {len(mesh.cells)} elements are inside out or folded, the first about "
            f"{mesh.centre(int(bad[0]))}: number their nodes anticlockwise, or mesh finer there"
        )


def located(mesh: PlateMesh, points: Array, names: NDArray[np.str_]) -> tuple[Integers, Array]:
    """Return the element (q,) in which each point lies, and its reference coordinates there (q, 2), by Newton's method.

    Elements are tried in the order of their centres' distance. ``names``: (q,) names of the points, for messages.
    """
    cells, inside = _locate(np.ascontiguousarray(mesh.points[mesh.cells]), np.ascontiguousarray(points, dtype=float))
    beyond = np.abs(inside) > 1 + _INSIDE
    if not beyond.any():
        return cells, inside
    outside = np.flatnonzero(beyond.any(axis=1))
    x, y = 1e3 * points[outside[0]]
    name = names[outside[0]]
    raise ModelError(
        f"plate: {str(name)!r} reaches off it: {np.sum(names[outside] == name)} of its {np.sum(names == name)} points "
        f"lie outside, the first at ({x:.4g}, {y:.4g}) mm"
    )


@compiled()
def _nine_shapes(s: float, t: float, values: Array, slopes: Array) -> None:
    """Write the values (9,) and slopes (9, 2) of `shapes_at` at one point."""
    for k in range(9):
        i, j = _NODES[k]
        in_s = s * (s + i) / 2 if i else 1 - s * s
        in_t = t * (t + j) / 2 if j else 1 - t * t
        values[k] = in_s * in_t
        slopes[k, 0] = (s + i / 2 if i else -2 * s) * in_t
        slopes[k, 1] = in_s * (t + j / 2 if j else -2 * t)


@compiled(error_model="numpy")
def _solve_inside(nodes: Array, x: float, y: float, inside: Array, values: Array, slopes: Array) -> bool:
    """Solve in place for the reference coordinates ``inside`` (2,) of a point in an element of nodes (9, 2); return
    whether they converge. The last two arrays are workspace."""
    for _ in range(_NEWTON):
        _nine_shapes(inside[0], inside[1], values, slopes)
        off_x, off_y, a, b, c, d = -x, -y, 0.0, 0.0, 0.0, 0.0
        for k in range(9):
            off_x += values[k] * nodes[k, 0]
            off_y += values[k] * nodes[k, 1]
            a += slopes[k, 0] * nodes[k, 0]
            b += slopes[k, 1] * nodes[k, 0]
            c += slopes[k, 0] * nodes[k, 1]
            d += slopes[k, 1] * nodes[k, 1]
        shift = 1e-12 * max(abs(a), abs(b), abs(c), abs(d))  # if the map is singular outside the element
        a, d = a + shift, d + shift
        step_s, step_t = (d * off_x - b * off_y) / (a * d - b * c), (a * off_y - c * off_x) / (a * d - b * c)
        inside[0] = min(max(inside[0] - step_s, -_BEYOND), _BEYOND)
        inside[1] = min(max(inside[1] - step_t, -_BEYOND), _BEYOND)
        if max(abs(step_s), abs(step_t)) < _SETTLED:
            return True
    return False


@compiled()
def _locate(nodes: Array, points: Array) -> tuple[Integers, Array]:
    """Return the elements (q,) and reference coordinates (q, 2) of points (q, 2) on elements of nodes (m, 9, 2).

    The element of the previous point is tried first, from its coordinates, as points come along lines. Numbers are
    assigned one by one: array assignments take seconds to compile.
    """
    count, last = len(nodes), -1
    reach = np.zeros(count)  # squared largest distance of an element's points from its centre
    for e in range(count):
        for k in range(8):
            x, y = nodes[e, k, 0] - nodes[e, 8, 0], nodes[e, k, 1] - nodes[e, 8, 1]
            reach[e] = max(reach[e], _REACH**2 * (x * x + y * y))
    cells, coordinates = np.zeros(len(points), np.int64), np.empty((len(points), 2))
    distances, inside, start = np.empty(count), np.empty(2), np.zeros(2)
    values, slopes = np.empty(9), np.empty((9, 2))
    for q in range(len(points)):
        x, y = points[q, 0], points[q, 1]
        if last >= 0 and (x - nodes[last, 8, 0]) ** 2 + (y - nodes[last, 8, 1]) ** 2 < reach[last]:
            settled = _solve_inside(nodes[last], x, y, start, values, slopes)
            if settled and max(abs(start[0]), abs(start[1])) <= 1:
                cells[q], coordinates[q, 0], coordinates[q, 1] = last, start[0], start[1]
                continue
        for e in range(count):
            distances[e] = (x - nodes[e, 8, 0]) ** 2 + (y - nodes[e, 8, 1]) ** 2
        best, coordinates[q, 0], coordinates[q, 1] = 2.0, 2.0, 2.0
        for _ in range(min(_NEAREST, count)):
            e = 0
            for other in range(1, count):
                e = other if distances[other] < distances[e] else e
            near = distances[e] < reach[e]
            distances[e] = np.inf
            if not near:
                continue
            inside[0] = inside[1] = 0.0
            _solve_inside(nodes[e], x, y, inside, values, slopes)
            farthest = max(abs(inside[0]), abs(inside[1]))
            if farthest < best:
                best, cells[q], coordinates[q, 0], coordinates[q, 1] = farthest, e, inside[0], inside[1]
            if best <= 1 + _INSIDE:
                break
        last = cells[q] if best <= 1 + _INSIDE else -1
        start[0], start[1] = coordinates[q, 0], coordinates[q, 1]
    return cells, coordinates
