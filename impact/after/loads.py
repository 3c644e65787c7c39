"""Loads in a finished run: forces of a body's springs, and the quasi-static load that presses the bodies on each other.

With the compliances C of both bodies, their gap g under the loads of an instant without contact, and the law's force
N(p) at a penetration p,

    p = -g - C N,   N = N(p) >= 0,

is solved at some instants, between which the forces are interpolated linearly.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from impact.bodies.body import Body, Load, ModalState
from impact.bodies.loads import SPRINGS, SprungBody
from impact.greens.base import Array, GreensFunctionError
from impact.greens.modal import ModalGreens, Residual
from impact.march import laws, motion
from impact.march.loop.marches import active_set
from impact.march.problem import Contact, ContactProblem
from impact.march.stepper import hold_course
from impact.quantities import brief

INSTANTS: Final = 4096  # most instants at which one contact or two are solved
INSTANTS_OF_MANY: Final = 512  # most instants at which a lip in arcs is solved, whose equations are larger
FEW_CONTACTS: Final = 2  # most contacts that are solved at `INSTANTS`
SOFT: Final = 1e-4  # fraction of a load borne by the soft spring that replaces the missing support of a free body
SECANTS: Final = 24  # secant steps for a law that stiffens with the force: each divides the error by three or more
ROUND_OFF: Final = 1e-12  # relative compliance added to keep the equations regular


@dataclass(frozen=True)
class StaticLoad:
    """The quasi-static forces at m instants ``time`` [s]: totals of the contacts with seats and with stoppers (m,), and
    of g groups of contacts (m, g) [N]."""

    time: Array
    seat: Array
    stopper: Array
    groups: Array = field(default_factory=lambda: np.zeros((1, 0)))

    __repr__ = brief

    def course(self, time: Array, *, stopper: bool = False) -> Array:
        """Return the (n,) forces [N] at times (n,) [s], constant beyond the last instant."""
        return self._at(self.stopper if stopper else self.seat, time)

    def of_group(self, number: int, time: Array) -> Array:
        """Return the (n,) forces on a group of contacts [N] at times (n,) [s], constant beyond the last instant."""
        return self._at(self.groups[:, number], time)

    def _at(self, force: Array, time: Array) -> Array:
        return np.interp(time, self.time, force) if np.any(force) else np.zeros(len(time))


def static_load(problem: ContactProblem, duration: float, groups: Sequence[slice] = ()) -> StaticLoad:
    """Return the quasi-static forces of a problem over a ``duration`` [s], also on ``groups`` of its contacts.

    A free body is held by a spring so soft that it bears `SOFT` of the largest load; without loads it has no static
    contact force. Hertz' and Hunt-Crossley's laws are solved by secants; a user's law counts as rigid. Loads that
    depend on the opening must be given as recorded in the run (`impact.march.stepper.with_recorded_loads`).
    """
    count = INSTANTS if len(problem.contacts) <= FEW_CONTACTS else INSTANTS_OF_MANY
    time = np.asarray(np.linspace(0.0, duration, count + 1), dtype=np.float64)
    opening, compliance = _openings(problem, time)
    modal = problem.striker.greens.modal
    held = modal is None or bool(np.all(modal.omega)) or bool(np.any(problem.striker.load_amplitudes(time)))
    if np.all(opening >= 0) or not held:
        return StaticLoad(np.zeros(1), np.zeros(1), np.zeros(1), np.zeros((1, len(groups))))
    seats = np.array([contact.side > 0 for contact in problem.contacts])
    force = _pressing(problem.contacts, compliance, opening)
    by_group = np.zeros((len(time), len(groups)))
    for column, group in enumerate(groups):
        by_group[:, column] = force[:, group].sum(axis=1)
    return StaticLoad(time, force[:, seats].sum(axis=1), force[:, ~seats].sum(axis=1), by_group)


def _openings(problem: ContactProblem, time: Array) -> tuple[Array, Array]:
    """Return the (m, p) gaps under bases and loads without contact [m], and the (p, p) compliance [m/N]."""
    opening = np.array([contact.gap for contact in problem.contacts]) + problem.carried(time)
    reach = max(float(np.abs(opening).max()), np.finfo(float).tiny)
    compliance = np.zeros((len(problem.contacts),) * 2)
    for body in problem.bodies:
        turn, pushed = problem.directions(body), body.load_amplitudes(time)
        moved, softness = _statics(body, pushed, reach)
        opening = opening + (turn.T @ moved).T
        compliance += turn.T @ softness @ turn
    size = float(np.trace(compliance)) / len(compliance)
    return opening, compliance + ROUND_OFF * (size or 1.0) * np.eye(len(compliance))


def _statics(body: Body, pushed: Array, reach: float) -> tuple[Array, Array]:
    """Return the (ports, m) displacements under load amplitudes [m] and the (ports, ports) compliance [m/N].

    ``reach``: gap that a free body can cross on its soft spring [m]. A body without modes or loads is at rest.
    """
    modal, ports = body.greens.modal, len(body.greens.ports)
    none = np.zeros((ports, pushed.shape[1]))
    if modal is None or not np.any(modal.omega == 0):
        compliance = body.greens.static_compliance()
        compliance = compliance if np.all(np.isfinite(compliance)) else np.zeros((ports, ports))
        if modal is None or not len(pushed):
            return none, compliance
        square = modal.omega**2
    else:
        if not len(pushed) or not np.any(pushed):
            return none, np.zeros((ports, ports))
        rigid = modal.omega == 0
        participation = max(float(np.abs(load.shape[rigid]).max()) for load in body.loads)
        seen = float(np.abs(modal.shapes[rigid]).max()) * participation
        square = np.where(rigid, SOFT * float(np.abs(pushed).max()) * seen / reach, modal.omega**2)
        square = np.where(square > 0, square, 1.0)
        rest = modal.residual.static()
        compliance = (modal.shapes / square[:, None]).T @ modal.shapes
        compliance = compliance + (rest if np.all(np.isfinite(rest)) else 0.0)
    shapes = np.array([load.shape for load in body.loads])
    return np.asarray(modal.shapes.T @ ((shapes.T @ pushed) / square[:, None])), compliance


def _pressing(contacts: tuple[Contact, ...], compliance: Array, opening: Array) -> Array:
    """Return the (m, p) forces [N] at gaps (m, p) [m]; many contacts are solved one instant after the other."""
    force = np.zeros(opening.shape)
    curved = any(contact.law.code not in (laws.SIGNORINI, laws.SPRING, laws.USER) for contact in contacts)
    parts: Sequence[slice | int] = [slice(None)] if len(contacts) <= FEW_CONTACTS else range(len(opening))
    for row, part in enumerate(parts):
        pressed = force[part]
        if row:
            pressed[:] = force[row - 1]
            if np.array_equal(opening[row], opening[row - 1]):
                continue
        for _ in range(SECANTS if curved else 1):
            softness = np.stack([_secant(each, pressed[..., k]) for k, each in enumerate(contacts)], axis=-1)
            active_set(compliance + softness[..., None] * np.eye(len(contacts)), -opening[part], pressed)
    return force


def _secant(contact: Contact, force: Array) -> Array:
    """Return the secant compliance of a law, penetration over force, at given forces [m/N]; 0 for a rigid law."""
    law = contact.law
    if law.code == laws.SPRING:
        return np.full(force.shape, 1 / law.parameters[0])
    return np.array([law.closure(float(each)) / each if each > 0 else 0.0 for each in force.flat]).reshape(force.shape)


def spring_displacements(body: Body, force: Array, dt: float, weights: Array | None = None) -> Array:
    """Return the (S, n + 1) displacements at the springs of a body [m], with loads recorded in a run
    (`impact.march.stepper.with_recorded_loads`).

    ``force``: (n + 1,) or (n + 1, ports) forces on its ports [N], ``force[0]`` the static preload; ``weights``: (S, q)
    weights of sums over the springs, (q, n + 1), to return instead. Raises `GreensFunctionError` without springs.
    """
    if not isinstance(body, SprungBody):
        raise GreensFunctionError("the body has no springs: give the one that impact.bodies.loads.on_springs returns")
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
    discrete = motion.Discrete.from_body(start, dt, n)
    if np.any(pushes[:, 0]):
        held = body.load_amplitudes(np.zeros(1))[:, 0]
        discrete = replace(discrete, rest=np.append(pushes[:, 0], np.zeros(places)), rest_loads=held)
    padded = np.concatenate([pushes[:, 1:], np.zeros((places, n))])
    return np.asarray(discrete.motion(motion.PortForces.at_ports(padded, dt)).displacement[ports:])


def without_springs(body: Body, force: Array, dt: float) -> Body:
    """Return the body in its modes without springs, under the springs' forces in a run as loads that are constant over
    each step; a body without springs is returned itself. Arguments as in `spring_displacements`."""
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
        Load(springs.basis @ shape, hold_course(pull, dt)) for shape, pull in zip(springs.shapes.T, pulls, strict=True)
    ]
    return Body(greens, state=state, loads=tuple(loads), base=body.base)
