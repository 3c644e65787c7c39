"""Brute force: the matrices of a striker and a seat as they are, marched together with contact between their ports.

No modes, no Green's functions, no residual, and nothing of `impact`: what the product's runs are compared with.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import eigsh, splu

from seatfem.structures.model import SecondOrderModel

Array = NDArray[np.float64]


def marched(
    bodies: Sequence[SecondOrderModel],
    velocity: Array,
    gaps: Array,
    dt: float,
    duration: float,
    stiffness: float | None = None,
) -> Array:
    """Return (n, ports) contact forces of a striker and a seat, if any, whose ports face each other [N].

    Both move by the trapezoidal rule, one factorization each. Where each port has a spring of ``stiffness`` [N/m], its
    force belongs to the opening half a step on; without, ports that would be closed half a step on do not close any
    further at its end (Moreau and Jean).

    Args:
        velocity: of the striker's unknowns at the start, undeformed [m/s].
        gaps: of the ports, undeformed [m].
    """
    parts = []
    for sign, model in zip((1.0, -1.0), bodies, strict=False):
        matrix = csc_array(model.M + dt**2 / 4 * model.K)
        solve = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).solve
        ports = sign * model.port_matrix
        parts.append((model, solve, ports, dt * solve(ports)))
    own = np.asarray(sum(ports.T @ push for _, _, ports, push in parts))
    u, v = ([np.zeros(model.size) for model in bodies] for _ in range(2))
    v[0] = velocity
    forces, opening = np.zeros((round(duration / dt), len(gaps))), gaps.copy()
    rate = np.asarray(sum(ports.T @ w for (_, _, ports, _), w in zip(parts, v, strict=True)))
    for n in range(len(forces)):
        free = [s(b.M @ w - dt * (b.K @ (x + dt / 4 * w))) for (b, s, _, _), x, w in zip(parts, u, v, strict=True)]
        alone = np.asarray(sum(ports.T @ w for (_, _, ports, _), w in zip(parts, free, strict=True)))
        if stiffness is not None:
            half_way = opening + dt / 4 * (rate + alone)
            forces[n] = complementary(dt / 4 * own + np.eye(len(gaps)) / stiffness, half_way)
        elif (near := opening + dt / 2 * rate <= 0).any():
            forces[n, near] = complementary(own[np.ix_(near, near)], alone[near])
        for k, (*_, push) in enumerate(parts):
            after = free[k] + push @ forces[n]
            u[k], v[k] = u[k] + dt / 2 * (v[k] + after), after
        now = alone + own @ forces[n]
        opening, rate = opening + dt / 2 * (rate + now), now
    return forces


def complementary(own: Array, opening: Array) -> Array:
    """Return N >= 0 with opening + own N >= 0 and one of both 0, guessing the closed ports anew until they stay."""
    closed = opening < 0
    for _ in range(50):
        force = np.zeros(len(opening))
        if closed.any():
            force[closed] = np.linalg.solve(own[np.ix_(closed, closed)], -opening[closed])
        openings = opening + own @ force
        new = np.where(closed, force > 0, openings < 0)
        if np.array_equal(new, closed):
            return force
        closed = new
    raise AssertionError("no solution of the complementarity problem")


def first_mode(model: SecondOrderModel) -> Array:
    """Return (n,) the shape of the lowest mode, of any length."""
    _, shapes = eigsh(csc_array(model.K), k=1, M=csc_array(model.M), sigma=0.0)
    return np.asarray(shapes[:, 0])
