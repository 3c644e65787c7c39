"""Gauss-Lobatto-Legendre nodes on [-1, 1], on which spectral elements interpolate and integrate."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial.legendre import Legendre
from numpy.typing import NDArray

Array = NDArray[np.float64]


@cache
def lobatto_nodes(order: int) -> Array:
    """Return the (order + 1,) ends and extrema of the Legendre polynomial of this order, ascending."""
    inner = np.sort(Legendre.basis(order).deriv().roots().real) if order > 1 else np.empty(0)
    return np.concatenate([[-1.0], inner, [1.0]])


def lobatto_weights(order: int) -> Array:
    """Return the (order + 1,) quadrature weights at the nodes, exact for polynomials up to 2 order - 1."""
    values = Legendre.basis(order)(lobatto_nodes(order))
    return np.asarray(2 / (order * (order + 1) * values**2))


def derivative_matrix(order: int) -> Array:
    """Return (order + 1, order + 1) derivatives of the Lagrange polynomials (columns) at the nodes (rows)."""
    nodes = lobatto_nodes(order)
    differences = nodes[:, None] - nodes + np.eye(order + 1)
    products = differences.prod(axis=1)
    matrix = products[:, None] / products / differences
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return np.asarray(matrix)


def lagrange_values(order: int, places: Array) -> Array:
    """Return (n, order + 1) values of the Lagrange polynomials at places (n,) of [-1, 1]."""
    nodes = lobatto_nodes(order)
    factors = places[:, None, None] - nodes + np.zeros((order + 1, 1))
    scales = nodes[:, None] - nodes
    same = np.eye(order + 1, dtype=bool)
    return np.asarray(np.where(same, 1.0, factors).prod(axis=2) / np.where(same, 1.0, scales).prod(axis=1))
