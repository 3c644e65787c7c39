"""What springs did to a body in a run that is over: how they moved, and the body without them under their forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from impact.bodies.body import Body, Load, ModalState
from impact.bodies.springs import SPRINGS, SprungBody
from impact.greens.base import Array, GreensFunctionError
from impact.greens.modal import ModalGreens, Residual
from impact.march.followed import held_course
from impact.march.motion import Discrete


def spring_displacements(body: Body, force: Array, dt: float, weights: Array | None = None) -> Array:
    """Return the (S, n + 1) displacements of a body at its springs [m], as marched
    (`impact.march.followed.as_marched`).

    ``force``: (n + 1,) or (n + 1, ports) on its ports [N], ``force[0]`` since ever; ``weights``: (S, q) of sums over
    the springs, which then are given in their place, (q, n + 1). Raises `GreensFunctionError` without springs.
    """
    if not isinstance(body, SprungBody):
        raise GreensFunctionError("the body has no springs: give the one that impact.bodies.springs.on_springs returns")
    modal, pushes = body.greens.modal, np.atleast_2d(np.asarray(force, dtype=float).T)
    assert modal is not None
    seen = body.springs.shapes if weights is None else body.springs.shapes @ weights
    places, ports, rest = seen.shape[1], len(modal.ports), modal.residual
    none = np.zeros((ports + places, ports + places))
    none[:ports, :ports] = rest.compliance
    wider = ModalGreens(
        modal.omega,
        modal.zeta,
        np.column_stack([modal.shapes, seen]),
        Residual(np.column_stack([rest.shapes, np.zeros((len(rest.rates), places))]), rest.rates, none),
        (*modal.ports, *(f"spring {k + 1}" for k in range(places))),
        valid_for=modal.valid_for,
    )
    start, n = replace(Body(body.greens, state=body.state, loads=body.loads), greens=wider), pushes.shape[1] - 1
    discrete = Discrete.from_body(start, dt, n)
    if np.any(pushes[:, 0]):
        held = body.load_amplitudes(np.zeros(1))[:, 0]
        discrete = replace(discrete, rest=np.append(pushes[:, 0], np.zeros(places)), rest_loads=held)
    padded = np.concatenate([pushes[:, 1:], np.zeros((places, n))])
    return np.asarray(discrete.motion(padded).displacement[ports:])


def without_springs(body: Body, force: Array, dt: float) -> Body:
    """Return the body in its own modes, those without springs, under what its springs did in a run; itself without any.

    The springs' forces are loads that are constant over each step. Arguments as of `spring_displacements`.
    """
    if not isinstance(body, SprungBody):
        return body
    modal, springs = body.greens.modal, body.springs
    assert modal is not None
    moved = spring_displacements(body, force, dt)
    pulls = -springs.stiffness[:, None] * (moved[:, 1:] + moved[:, :-1]) / 2
    origin = {key: value for key, value in modal.origin.items() if key != SPRINGS}
    greens = replace(modal, origin=origin, omega=springs.omega, zeta=springs.zeta, shapes=springs.basis @ modal.shapes)
    state = body.state and ModalState(springs.basis @ body.state.displacement, springs.basis @ body.state.velocity)
    loads = [replace(load, shape=springs.basis @ load.shape) for load in body.loads]
    loads += [
        Load(springs.basis @ shape, held_course(pull, dt)) for shape, pull in zip(springs.shapes.T, pulls, strict=True)
    ]
    return Body(greens, state=state, loads=tuple(loads), base=body.base)
