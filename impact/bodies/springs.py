"""A body on springs to the ground that always act, exact within its modes: M q'' + (W^2 + B k B') q = f."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from impact.bodies.body import Body, ModalState
from impact.greens.base import Array, GreensFunctionError

ROUND_OFF: Final = 1e-10  # relative, of what springs and forces share with a motion that the springs leave free

SPRINGS: Final = "springs"
"""In the origin of a Green's function: how many springs its modes are with."""


@dataclass(frozen=True)
class Suspension:
    """Springs of a body, by the M modes that it has with them.

    ``shapes`` (M, S) of these modes at the S springs [1/sqrt(kg)]; ``stiffness`` (S,) [N/m]; ``basis`` (M, M): these
    modes in terms of those without the springs, orthonormal, q = basis q_with; ``omega`` (M,) [rad/s] and ``zeta`` (M,)
    without.
    """

    shapes: Array
    stiffness: Array
    basis: Array
    omega: Array
    zeta: Array


@dataclass(frozen=True, repr=False)
class SprungBody(Body):
    """A body on ``springs``: its Green's function, state and loads are in the modes that it has with them."""

    springs: Suspension = field(kw_only=True)


def on_springs(body: Body, shapes: Array, stiffness: ArrayLike) -> SprungBody:
    """Return the body with undamped linear springs between some of its places and the ground.

    With the modes of the body, W their frequencies and B (M, S) their shapes at the springs' places, the modes with
    springs are the eigenvectors V of W^2 + B k B'. This is exact in the space of the modes; what the modes left out
    would yield to the springs is neglected, as it is of loads. Damping stays modal: the terms that V' 2 zeta W V has
    off its diagonal are left out. A velocity becomes part of the state, for a body on springs is held.

    Args:
        body: a sum of modes.
        shapes: B (M, S) [1/sqrt(kg)].
        stiffness: (S,), or one for all [N/m].

    Raises `GreensFunctionError`: a body without modes, shapes that do not fit them, a stiffness that is not positive.
    """
    modal = body.greens.modal
    if modal is None or not len(modal.omega):
        raise GreensFunctionError(
            f"springs: a body known by a {type(body.greens).__name__} has no modes that springs could act on; take "
            "a beam, a plate or a rigid mass"
        )
    held = np.broadcast_to(np.asarray(stiffness, dtype=float), np.shape(shapes)[1:])
    if SPRINGS in modal.origin:
        raise GreensFunctionError("springs: the body is on springs already; give all of them at once")
    if np.ndim(shapes) != 2 or len(shapes) != len(modal.omega) or not np.all(np.isfinite(shapes)):
        raise GreensFunctionError(
            f"springs: shapes {np.shape(shapes)} must be finite and have a row for each of the {len(modal.omega)} "
            "modes: give (modes, springs) values"
        )
    if not (np.all(np.isfinite(held)) and np.all(held > 0)):
        raise GreensFunctionError(f"springs: stiffness = {held} N/m must be positive and finite")
    omega, basis = _modes_with(modal.omega, np.asarray(shapes * np.sqrt(held)))
    damped = (basis**2).T @ (modal.zeta * modal.omega)
    zeta = np.divide(damped, omega, out=np.zeros_like(omega), where=omega > 0)

    def turned(values: Array) -> Array:
        seen = np.asarray(basis.T @ values)
        unmoved = (omega == 0) if seen.ndim == 1 else (omega == 0)[:, None]
        return np.where(unmoved & (np.abs(seen) <= ROUND_OFF * np.abs(seen).max(axis=0)), 0.0, seen)

    start = body.modal_start()
    state = ModalState(basis.T @ start.displacement, basis.T @ start.velocity)
    origin = {**modal.origin, SPRINGS: len(held)}
    greens = replace(modal, omega=omega, zeta=zeta, shapes=turned(modal.shapes), origin=origin)
    return SprungBody(
        greens,
        state=state if np.any(state.displacement) or np.any(state.velocity) else None,
        loads=tuple(replace(load, shape=turned(load.shape)) for load in body.loads),
        base=body.base,
        springs=Suspension(turned(np.asarray(shapes)), np.array(held), basis, modal.omega, modal.zeta),
    )


def own_coordinates(body: Body, coordinates: Array) -> Array:
    """Return the (n, M) ``coordinates`` of a body in its modes without its springs [m sqrt(kg)]."""
    return coordinates @ body.springs.basis.T if isinstance(body, SprungBody) else coordinates


def _modes_with(omega: Array, pulls: Array) -> tuple[Array, Array]:
    """Return the (M,) angular frequencies [rad/s] and the (M, M) vectors of diag(omega^2) + pulls pulls'.

    Rigid motions that no spring feels stay as they are, with the frequency 0. The others' squares are sums of positive
    terms, |W v|^2 + |pulls' v|^2, which soft springs leave exact where an eigenvalue solver, off by round-off of the
    highest frequency's square, does not.
    """
    rigid, elastic = np.flatnonzero(omega == 0), np.flatnonzero(omega > 0)
    turn = np.eye(len(omega))
    if len(rigid):
        vectors, sizes, _ = np.linalg.svd(pulls[rigid])
        felt = int(np.sum(sizes > ROUND_OFF * np.linalg.norm(pulls)))
        turn[np.ix_(rigid, rigid)] = vectors
        free, moved = rigid[felt:], np.concatenate([rigid[:felt], elastic])
    else:
        free, moved = rigid, elastic
    seen = turn.T @ pulls
    square = np.diag(omega[moved] ** 2) + seen[moved] @ seen[moved].T
    _, own = np.linalg.eigh(square)
    values = ((omega[moved, None] * own) ** 2).sum(axis=0) + ((seen[moved].T @ own) ** 2).sum(axis=0)
    order = np.argsort(values, kind="stable")
    basis = np.column_stack([turn[:, free], turn[:, moved] @ own[:, order]])
    return np.concatenate([np.zeros(len(free)), np.sqrt(values[order])]), basis
