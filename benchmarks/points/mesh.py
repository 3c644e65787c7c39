"""Meshes of mapped quadrilaterals whose nodes are Gauss-Lobatto points, and where a point lies in them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from points.gll import Array, derivative_matrix, lagrange_values, lobatto_nodes, lobatto_weights

SAME = 1e-8  # m, nodes nearer than this are one
NEAREST = 8  # nodes whose elements are searched for a point
NEWTON = 30  # iterations of a point's place in an element
INSIDE = 1 + 1e-6  # largest local coordinate of a point that lies in an element

Map = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Block:
    """A mapped square: ``place`` maps s, t in [0, 1] to points (..., 2) [m]; elements end at ``s`` and at ``t``."""

    place: Map
    s: Array
    t: Array


@dataclass(frozen=True)
class Mesh:
    """Spectral elements: points (n, 2) [m] and the nodes (e, (order + 1)^2) of each element, s slowest."""

    order: int
    points: Array
    elements: NDArray[np.int64]

    def gradients(self) -> tuple[Array, Array, Array]:
        """Return d/dx and d/dy (e, q, q) from an element's nodes to its nodes, and quadrature weights (e, q) [m^2]."""
        matrix, eye = derivative_matrix(self.order), np.eye(self.order + 1)
        by_s, by_t = np.kron(matrix, eye), np.kron(eye, matrix)
        corners = self.points[self.elements]
        x_s, y_s = np.moveaxis(by_s @ corners, 2, 0)
        x_t, y_t = np.moveaxis(by_t @ corners, 2, 0)
        jacobian = x_s * y_t - x_t * y_s
        weights = np.outer(lobatto_weights(self.order), lobatto_weights(self.order)).ravel()
        by_x = (y_t[..., None] * by_s - y_s[..., None] * by_t) / jacobian[..., None]
        by_y = (x_s[..., None] * by_t - x_t[..., None] * by_s) / jacobian[..., None]
        return by_x, by_y, weights * np.abs(jacobian)

    def interpolate(self, places: Array, values: Array) -> Array:
        """Return (p, k) nodal ``values`` (n, k) at places (p, 2) [m]."""
        element_of: list[list[int]] = [[] for _ in self.points]
        for number, nodes in enumerate(self.elements):
            for node in nodes:
                element_of[node].append(number)
        _, near = cKDTree(self.points).query(places, k=NEAREST)
        rows = np.empty((len(places), values.shape[1]))
        for row, (place, nodes) in enumerate(zip(places, near, strict=True)):
            elements = dict.fromkeys(number for node in nodes for number in element_of[node])
            shape = next(filter(None, (self._shape(number, place) for number in elements)), None)
            if shape is None:
                raise ValueError(f"point {place} lies in no element")
            rows[row] = shape[1] @ values[self.elements[shape[0]]]
        return rows

    def mirrored(self) -> NDArray[np.int64]:
        """Return the node (n,) at the mirror image (x, -y) of every node; the mesh must be symmetric."""
        distance, nodes = cKDTree(self.points).query(self.points * (1, -1))
        if distance.max() > SAME:
            raise ValueError("the mesh is not symmetric about the x axis")
        return np.asarray(nodes)

    def _shape(self, number: int, place: Array) -> tuple[int, Array] | None:
        """Return the element and its shape functions at a place, or ``None`` of a place outside of it."""
        corners, matrix = self.points[self.elements[number]], derivative_matrix(self.order)
        local = np.zeros(2)
        for _ in range(NEWTON):
            a, b = (lagrange_values(self.order, np.array([value])) for value in local)
            miss = place - np.kron(a, b)[0] @ corners
            slope = np.stack([np.kron(a @ matrix, b)[0] @ corners, np.kron(a, b @ matrix)[0] @ corners], axis=1)
            change = np.linalg.solve(slope, miss)
            local = np.clip(local + change, -1.2, 1.2)
            if np.abs(change).max() < 1e-12:
                break
        if np.abs(local).max() > INSIDE:
            return None
        a, b = (lagrange_values(self.order, np.array([value])) for value in local)
        return number, np.kron(a, b)[0]


def mesh_blocks(blocks: Sequence[Block], order: int) -> Mesh:
    """Divide blocks into elements, joined where their nodes coincide."""
    shares = (lobatto_nodes(order) + 1) / 2
    clouds = []
    for block in blocks:
        s = (block.s[:-1, None] + np.diff(block.s)[:, None] * shares)[:, None, :, None]
        t = (block.t[:-1, None] + np.diff(block.t)[:, None] * shares)[None, :, None, :]
        s, t = np.broadcast_arrays(s, t)
        clouds.append(block.place(s, t).reshape(-1, (order + 1) ** 2, 2))
    cloud = np.concatenate(clouds)
    keys = np.round(cloud.reshape(-1, 2) / SAME + 0.3137).astype(np.int64)
    _, first, nodes = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return Mesh(order, cloud.reshape(-1, 2)[first], nodes.reshape(cloud.shape[:2]))


def equal_parts(length: float, size: float, least: int = 1) -> Array:
    """Return ends (n + 1,) in [0, 1] of equal parts of a length, none longer than ``size``."""
    return np.linspace(0, 1, max(least, int(np.ceil(length / size - 1e-9))) + 1)
