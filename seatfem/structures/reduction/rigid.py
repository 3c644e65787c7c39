"""The rigid-body motions a model leaves free, exactly."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from seatfem.structures.model import Array, DofMap, SecondOrderModel

_NULL = 1e-11  # of default_shift^2: round-off leaves 1e-14, and what is softer than this is no spring


def rigid_shapes(model: SecondOrderModel) -> Array:
    """Return the (n, r) M-orthonormal shapes R with K R = 0 among translations and rotations; (n, 0) if unknown or
    held.

    The rigid part of g is B'R R'B t, exactly: R (R'MR)^-1 R' does not depend on the basis of the null space.
    """
    candidates = np.zeros((model.size, 0)) if model.dofs is None else _candidates(model.dofs)
    if candidates.shape[1] == 0 or len(candidates) != model.size:
        return np.zeros((model.size, 0))
    inertia = np.einsum("ij,ij->j", candidates, model.M @ candidates)
    candidates = candidates[:, inertia > 0] / np.sqrt(inertia[inertia > 0])  # turns of a body of any size count
    mass = candidates.T @ (model.M @ candidates)
    _, directions = scipy.linalg.eigh(mass)
    independent = np.diag(directions.T @ mass @ directions) > 1e-12 * np.trace(mass)
    candidates = candidates @ directions[:, independent]
    stiffness, mass = (candidates.T @ (a @ candidates) for a in (model.K, model.M))
    values, vectors = scipy.linalg.eigh(stiffness, mass)
    return np.asarray(candidates @ vectors[:, values < _NULL * default_shift(model) ** 2])


def default_shift(model: SecondOrderModel) -> float:
    """Return a shift of the order of the lowest elastic frequency: c/L from the local frequency c/h and the number of
    nodes."""
    local = float(np.median(model.K.diagonal() / model.M.diagonal()))
    return float(np.sqrt(0.1 * local) * model.size ** (-1 / 3))


def _candidates(dofs: DofMap) -> Array:
    """Return the (n_free, m) translations and, lengths made relative, rotations of the nodes, restricted to the
    unknowns."""
    if dofs.rigid is not None:
        return dofs.rigid
    dim, count = dofs.points.shape
    x = dofs.points - dofs.points.mean(axis=1, keepdims=True)
    x = x / max(float(np.abs(x).max()), 1e-300)
    motions = [np.repeat(axis[:, None], count, axis=1) for axis in np.eye(dim)]
    for i in range(dim):
        for j in range(i):
            turn = np.zeros_like(x)
            turn[i], turn[j] = -x[j], x[i]
            motions.append(turn)
    full = np.stack([motion.T.ravel() for motion in motions], axis=1)
    if dofs.turned is not None:
        return np.asarray(dofs.turned.T @ full)
    known = dofs.free.max(initial=-1) < len(full)  # else other unknowns than one displacement for each coordinate
    return np.asarray(full[dofs.free]) if known else np.zeros((len(dofs.free), 0))
