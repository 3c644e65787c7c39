"""Compiled loops over the elements and the sparsity pattern: matrices, mass and shape; graph, rows and columns.

What the loops call is in this file: numba's cache is renewed when this file changes, not when one it calls does.
Arrays are plain: m elements of L nodes with V geometry nodes, Q quadrature points, n nodes, three unknowns a node.
"""

import numpy as np
from numpy.typing import NDArray

from impact.march.loop.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@compiled()
def node_graph(cells: Ints, n: int) -> tuple[Ints, Ints]:
    """Return (indptr, indices) of the nodes that share an element, rows sorted; ``cells`` is (m, L)."""
    m, local = cells.shape
    start = np.zeros(n + 1, np.int64)
    for e in range(m):
        for a in range(local):
            start[cells[e, a] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    around, fill = np.empty(m * local, np.int32), start[:-1].copy()
    for e in range(m):
        for a in range(local):
            around[fill[cells[e, a]]] = e
            fill[cells[e, a]] += 1
    seen = np.full(n, -1, np.int32)
    indptr = np.zeros(n + 1, np.int32)
    for i in range(n):
        count = 0
        for p in range(start[i], start[i + 1]):
            for b in range(local):
                j = cells[around[p], b]
                if seen[j] != i:
                    seen[j] = i
                    count += 1
        indptr[i + 1] = indptr[i] + count
    # row i goes, as entry i, to the rows it names: the graph is symmetric, so they come out whole and sorted
    indices, place = np.empty(indptr[n], np.int32), indptr[:-1].copy()
    seen[:] = -1
    for i in range(n):
        for p in range(start[i], start[i + 1]):
            for b in range(local):
                j = cells[around[p], b]
                if seen[j] != i:
                    seen[j] = i
                    indices[place[j]] = i
                    place[j] += 1
    return indptr, indices


@compiled()
def expand_pattern(indptr: Ints, indices: Ints, unknown: Ints, free: int) -> tuple[Ints, Ints, Ints]:
    """Return the pattern of all couplings of the unknowns, for the graph (indptr, indices) of the nodes.

    ``unknown`` (n, 3) numbers the unknowns of a node, -1 where held. Returns (rows, columns, offset): ``offset`` of an
    entry of the graph is where, within the rows of its first node, the columns of its second begin.
    """
    n = len(indptr) - 1
    width = np.zeros(n, np.int32)
    for j in range(n):
        for b in range(3):
            width[j] += unknown[j, b] >= 0
    rows, offset = np.zeros(free + 1, np.int32), np.empty(len(indices), np.int32)
    for i in range(n):
        total = 0
        for k in range(indptr[i], indptr[i + 1]):
            offset[k] = total
            total += width[indices[k]]
        for a in range(3):
            if unknown[i, a] >= 0:
                rows[unknown[i, a] + 1] = total
    for r in range(free):
        rows[r + 1] += rows[r]
    columns = np.empty(rows[free], np.int32)
    for i in range(n):
        for a in range(3):
            if unknown[i, a] < 0:
                continue
            p = rows[unknown[i, a]]
            for k in range(indptr[i], indptr[i + 1]):
                for b in range(3):
                    if unknown[indices[k], b] >= 0:
                        columns[p] = unknown[indices[k], b]
                        p += 1
    return rows, columns, offset


@compiled()
def expand_scalar(indptr: Ints, indices: Ints, values: Floats, unknown: Ints, free: int) -> tuple[Ints, Ints, Floats]:
    """Return rows, columns and data of values (x) I over the unknowns: a component couples only with its own kind."""
    n = len(indptr) - 1
    rows = np.zeros(free + 1, np.int32)
    for i in range(n):
        for k in range(indptr[i], indptr[i + 1]):
            for a in range(3):
                if unknown[i, a] >= 0 and unknown[indices[k], a] >= 0:
                    rows[unknown[i, a] + 1] += 1
    for r in range(free):
        rows[r + 1] += rows[r]
    columns, data = np.empty(rows[free], np.int32), np.empty(rows[free])
    for i in range(n):
        for a in range(3):
            if unknown[i, a] < 0:
                continue
            p = rows[unknown[i, a]]
            for k in range(indptr[i], indptr[i + 1]):
                if unknown[indices[k], a] >= 0:
                    columns[p], data[p] = unknown[indices[k], a], values[k]
                    p += 1
    return rows, columns, data


@compiled()
def _jacobian(corners: Ints, points: Floats, slopes: Floats, inverse: Floats) -> float:
    """Return det J of x = sum_v points_v N_v, with J^-1 into ``inverse`` (left as it is where J is singular)."""
    xx = xy = xz = yx = yy = yz = zx = zy = zz = 0.0
    for v in range(len(corners)):
        x, y, z = points[corners[v], 0], points[corners[v], 1], points[corners[v], 2]
        r, s, t = slopes[v, 0], slopes[v, 1], slopes[v, 2]
        xx, xy, xz = xx + x * r, xy + x * s, xz + x * t
        yx, yy, yz = yx + y * r, yy + y * s, yz + y * t
        zx, zy, zz = zx + z * r, zy + z * s, zz + z * t
    a, b, c = yy * zz - yz * zy, yz * zx - yx * zz, yx * zy - yy * zx
    det = xx * a + xy * b + xz * c
    if det != 0.0:
        one = 1 / det
        inverse[0, 0], inverse[1, 0], inverse[2, 0] = a * one, b * one, c * one
        inverse[0, 1], inverse[0, 2] = (xz * zy - xy * zz) * one, (xy * yz - xz * yy) * one
        inverse[1, 1], inverse[1, 2] = (xx * zz - xz * zx) * one, (xz * yx - xx * yz) * one
        inverse[2, 1], inverse[2, 2] = (xy * zx - xx * zy) * one, (xx * yy - xy * yx) * one
    return det


@compiled()
def jacobian_range(corners: Ints, points: Floats, slopes: Floats) -> Floats:
    """Return (m, 2) least and largest det J of each element at the points where ``slopes`` (Q, V, 3) were taken."""
    extremes, inverse = np.empty((len(corners), 2)), np.empty((3, 3))
    for e in range(len(corners)):
        extremes[e, 0], extremes[e, 1] = np.inf, -np.inf
        for q in range(len(slopes)):
            det = _jacobian(corners[e], points, slopes[q], inverse)
            extremes[e, 0] = min(extremes[e, 0], det)
            extremes[e, 1] = max(extremes[e, 1], det)
    return extremes


@compiled(fastmath={"contract"})
def _add_products(T: Floats, G: Floats, weight: float) -> None:
    """Do T += weight G (x) G in the blocks on and above the diagonal; G holds the gradients node by node."""
    size = len(G)
    for r in range(size):
        g = weight * G[r]
        for c in range(r - r % 3, size):
            T[r, c] += g * G[c]


@compiled()
def _orthonormalise(gram: Floats, D: Floats, modes: int) -> None:
    """Do D <- L^-1 D for the Cholesky factor gram = L L', so that sum_k D_k (x) D_k is the projected product."""
    for k in range(modes):
        for h in range(k):
            factor = gram[k, h] / gram[h, h]
            D[k] -= factor * D[h]
            for c in range(modes):
                gram[k, c] -= factor * gram[h, c]
    for k in range(modes):
        D[k] /= np.sqrt(gram[k, k])


@compiled()
def _element_stiffness(
    corners: Ints,
    points: Floats,
    weights: Floats,
    shapes: Floats,
    slopes: Floats,
    gradients: Floats,
    modes: int,
    T: Floats,
    D: Floats,
) -> None:
    """Add T_ij = integral of grad phi_i (x) grad phi_j to T (3 L, 3 L), upper blocks; projected dilatation into D."""
    local = gradients.shape[1]
    inverse, G, gram, psi = np.empty((3, 3)), np.empty(3 * local), np.zeros((4, 4)), np.ones(4)
    T[:] = 0.0
    D[:] = 0.0
    for q in range(len(weights)):
        weight = weights[q] * abs(_jacobian(corners, points, slopes[q], inverse))
        for i in range(local):
            for a in range(3):
                g = 0.0
                for c in range(3):
                    g += gradients[q, i, c] * inverse[c, a]
                G[3 * i + a] = g
        _add_products(T, G, weight)
        if modes:
            for a in range(modes - 1):
                psi[a + 1] = -points[corners[0], a]
                for v in range(len(corners)):
                    psi[a + 1] += shapes[q, v] * points[corners[v], a]
            for k in range(modes):
                D[k] += weight * psi[k] * G
                for h in range(modes):
                    gram[k, h] += weight * psi[k] * psi[h]
    if modes:
        _orthonormalise(gram, D, modes)


@compiled()
def _isotropic(T: Floats, D: Floats, modes: int, lam: float, mu: float, K: Floats) -> None:
    """Add lam T + mu T' + mu tr(T) I on and above the diagonal of K; the volume's part from D where projected."""
    for r in range(0, len(T), 3):
        for s in range(r, len(T), 3):
            trace = mu * (T[r, s] + T[r + 1, s + 1] + T[r + 2, s + 2])
            for a in range(3):
                for b in range(3):
                    volume = T[r + a, s + b]
                    if modes:
                        volume = 0.0
                        for k in range(modes):
                            volume += D[k, r + a] * D[k, s + b]
                    K[r + a, s + b] = lam * volume + mu * T[r + b, s + a]
                K[r + a, s + a] += trace


@compiled()
def _anisotropic(T: Floats, tensor: Floats, K: Floats) -> None:
    """Add blocks C_acbd T_cd on and above the diagonal of K."""
    for r in range(0, len(T), 3):
        for s in range(r, len(T), 3):
            for a in range(3):
                for b in range(3):
                    total = 0.0
                    for c in range(3):
                        for d in range(3):
                            total += tensor[a, c, b, d] * T[r + c, s + d]
                    K[r + a, s + b] = total


@compiled()
def _mirror(A: Floats) -> None:
    """Copy the upper triangle of A to the lower."""
    for r in range(len(A)):
        for c in range(r):
            A[r, c] = A[c, r]


@compiled()
def _position(indices: Ints, low: int, high: int, node: int) -> int:
    """Return where ``node`` stands in the sorted indices[low:high]."""
    while low < high:
        middle = (low + high) >> 1
        if indices[middle] < node:
            low = middle + 1
        else:
            high = middle
    return low


@compiled()
def add_elements(
    cells: Ints,
    corners: Ints,
    points: Floats,
    stiffness_rule: tuple[Floats, Floats, Floats, Floats],
    mass_rule: tuple[Floats, Floats, Floats, Floats],
    region: Ints,
    lame: Floats,
    tensors: Floats,
    density: Floats,
    modes: Ints,
    graph: tuple[Ints, Ints],
    pattern: tuple[Ints, Ints],
    unknown: Ints,
    stiffness: Floats,
    mass: Floats,
) -> None:
    """Add the elements to ``stiffness`` (pattern of the unknowns) and ``mass`` (pattern of the nodes).

    A rule is (weights (Q,), shapes (Q, V) and slopes (Q, V, 3) of the geometry, gradients (Q, L, 3) or values (Q, L)
    of the displacement). ``region`` gives each element's row in lame, tensors, density and modes, the number of
    dilatation modes it is projected on (0: none).
    """
    indptr, indices = graph
    rows, offset = pattern
    weights, shapes, slopes, gradients = stiffness_rule
    mass_weights, _, mass_slopes, values = mass_rule
    local = cells.shape[1]
    T, D, K = np.empty((3 * local, 3 * local)), np.empty((4, 3 * local)), np.empty((3 * local, 3 * local))
    inverse, products, place = np.empty((3, 3)), np.empty((local, local)), np.empty(local, np.int64)
    for e in range(len(cells)):
        m = region[e]
        cell, corner, number, tensor, lam, mu = cells[e], corners[e], modes[m], tensors[m], lame[m, 0], lame[m, 1]
        _element_stiffness(corner, points, weights, shapes, slopes, gradients, number, T, D)
        products[:] = 0.0
        for q in range(len(mass_weights)):
            weight = density[m] * mass_weights[q] * abs(_jacobian(corner, points, mass_slopes[q], inverse))
            for i in range(local):
                share = weight * values[q, i]
                for j in range(i, local):
                    products[i, j] += share * values[q, j]
        if mu > 0:
            _isotropic(T, D, number, lam, mu, K)
        else:
            _anisotropic(T, tensor, K)
        _mirror(K)
        whole = True
        for j in range(local):
            for b in range(3):
                whole = whole and unknown[cell[j], b] >= 0
        _mirror(products)
        for i in range(local):
            first = cell[i]
            for j in range(local):
                place[j] = _position(indices, indptr[first], indptr[first + 1], cell[j])
                mass[place[j]] += products[i, j]
            for a in range(3):
                if unknown[first, a] >= 0:
                    start = rows[unknown[first, a]]
                    for j in range(local):
                        p = start + offset[place[j]]
                        if whole:
                            for b in range(3):
                                stiffness[p + b] += K[3 * i + a, 3 * j + b]
                            continue
                        for b in range(3):
                            if unknown[cell[j], b] >= 0:
                                stiffness[p] += K[3 * i + a, 3 * j + b]
                                p += 1


@compiled()
def nodal_mass(
    cells: Ints,
    corners: Ints,
    points: Floats,
    exact_rule: tuple[Floats, Floats, Floats, Floats],
    share_rule: tuple[Floats, Floats, Floats, Floats],
    region: Ints,
    density: Floats,
    n: int,
) -> Floats:
    """Return the (n,) masses of the nodes: each element's own mass, shared as the ``share_rule`` integrates phi_i^2."""
    weights, _, slopes, _ = exact_rule
    share_weights, _, share_slopes, values = share_rule
    local = cells.shape[1]
    mass, share, inverse = np.zeros(n), np.empty(local), np.empty((3, 3))
    for e in range(len(cells)):
        total = 0.0
        for q in range(len(weights)):
            total += density[region[e]] * weights[q] * abs(_jacobian(corners[e], points, slopes[q], inverse))
        share[:] = 0.0
        for q in range(len(share_weights)):
            weight = share_weights[q] * abs(_jacobian(corners[e], points, share_slopes[q], inverse))
            for i in range(local):
                share[i] += weight * values[q, i] ** 2
        share *= total / share.sum()
        for i in range(local):
            mass[cells[e, i]] += share[i]
    return mass
