"""Loads in a finished run: forces of a body's springs, and the quasi-static load that presses the bodies on each other.

With the sum C of the bodies' static compliances, the gap g that the loads of an instant would leave without contact,
and the law's force N(p) at a penetration p, the equations

    p = -g - C N,   N = N(p) >= 0

are solved at some instants, between which the forces are interpolated linearly.
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

INSTANTS: Final = 4096  # number of instants at which up to `FEW_CONTACTS` are solved
INSTANTS_OF_MANY: Final = 512  # number of instants at which more contacts are solved, whose equations are larger
FEW_CONTACTS: Final = 2  # most contacts that are solved at `INSTANTS`
SOFT: Final = 1e-4  # fraction of a load borne by the soft spring that replaces the missing support of a free body
SECANTS: Final = 24  # secant steps for a law that stiffens with the force; each divides the error by three or more
ROUND_OFF: Final = 1e-12  # compliance added to keep the equations regular, over the mean of its diagonal


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

    def find_group_force(self, number: int, time: Array) -> Array:
        """Return the (n,) forces on a group of contacts [N] at times (n,) [s], constant beyond the last instant."""
        return self._at(self.groups[:, number], time)

    def _at(self, force: Array, time: Array) -> Array:
        return np.interp(time, self.time, force) if np.any(force) else np.zeros(len(time))


def find_static_load(problem: ContactProblem, duration: float, groups: Sequence[slice] = ()) -> StaticLoad:
    """Return the quasi-static forces of a problem over a ``duration`` [s], also on ``groups`` of its contacts.

    A free body is held by a spring so soft that it bears `SOFT` of the largest load; without loads it has no static
    contact force. Hertz' and Hunt-Crossley's laws are solved by secants; a user's law counts as rigid. Loads that
    depend on the opening must be given as recorded in the run (`impact.march.stepper.with_recorded_loads`).
    """
    count = INSTANTS if len(problem.contacts) <= FEW_CONTACTS else INSTANTS_OF_MANY
    time = np.asarray(np.linspace(0.0, duration, count + 1), dtype=np.float64)
    opening, compliance = _find_gaps(problem, time)
    modal = problem.striker.greens.modal
    held = modal is None or bool(np.all(modal.omega)) or bool(np.any(problem.striker.load_amplitudes(time)))
    if np.all(opening >= 0) or not held:
        return StaticLoad(np.zeros(1), np.zeros(1), np.zeros(1), np.zeros((1, len(groups))))
    seats = np.array([contact.side > 0 for contact in problem.contacts])
    force = _solve_forces(problem.contacts, compliance, opening)
    by_group = np.zeros((len(time), len(groups)))
    for column, group in enumerate(groups):
        by_group[:, column] = force[:, group].sum(axis=1)
    return StaticLoad(time, force[:, seats].sum(axis=1), force[:, ~seats].sum(axis=1), by_group)


def _find_gaps(problem: ContactProblem, time: Array) -> tuple[Array, Array]:
    """Return the (m, p) gaps under moving bases and loads, without contact [m], and the (p, p) compliance [m/N]."""
    gap = np.array([contact.gap for contact in problem.contacts]) + problem.find_base_gaps(time)
    largest_gap = max(float(np.abs(gap).max()), np.finfo(float).tiny)
    compliance = np.zeros((len(problem.contacts),) * 2)
    for body in problem.bodies:
        signs, amplitudes = problem.directions(body), body.load_amplitudes(time)
        displacement, of_ports = _find_static_response(body, amplitudes, largest_gap)
        gap = gap + (signs.T @ displacement).T
        compliance += signs.T @ of_ports @ signs
    mean = float(np.trace(compliance)) / len(compliance)
    return gap, compliance + ROUND_OFF * (mean or 1.0) * np.eye(len(compliance))


def _find_static_response(body: Body, amplitudes: Array, largest_gap: float) -> tuple[Array, Array]:
    """Return the (ports, m) displacements under load ``amplitudes`` [m] and the (ports, ports) compliance [m/N].

    ``largest_gap``: displacement on its soft spring by which a free body closes every gap [m]. A body without modes or
    loads has no displacement.
    """
    modal, ports = body.greens.modal, len(body.greens.ports)
    at_rest = np.zeros((ports, amplitudes.shape[1]))
    if modal is None or not np.any(modal.omega == 0):
        compliance = body.greens.static_compliance()
        compliance = compliance if np.all(np.isfinite(compliance)) else np.zeros((ports, ports))
        if modal is None or not len(amplitudes):
            return at_rest, compliance
        square = modal.omega**2
    else:
        if not len(amplitudes) or not np.any(amplitudes):
            return at_rest, np.zeros((ports, ports))
        rigid = modal.omega == 0
        participation = max(float(np.abs(load.shape[rigid]).max()) for load in body.loads)
        product = float(np.abs(modal.shapes[rigid]).max()) * participation
        square = np.where(rigid, SOFT * float(np.abs(amplitudes).max()) * product / largest_gap, modal.omega**2)
        square = np.where(square > 0, square, 1.0)
        residual = modal.residual.static()
        compliance = (modal.shapes / square[:, None]).T @ modal.shapes
        compliance = compliance + (residual if np.all(np.isfinite(residual)) else 0.0)
    shapes = np.array([load.shape for load in body.loads])
    return np.asarray(modal.shapes.T @ ((shapes.T @ amplitudes) / square[:, None])), compliance


def _solve_forces(contacts: tuple[Contact, ...], compliance: Array, opening: Array) -> Array:
    """Return the (m, p) forces [N] at gaps (m, p) [m], of many contacts one instant after the other."""
    force = np.zeros(opening.shape)
    curved = any(contact.law.code not in (laws.SIGNORINI, laws.SPRING, laws.USER) for contact in contacts)
    parts: Sequence[slice | int] = [slice(None)] if len(contacts) <= FEW_CONTACTS else range(len(opening))
    for row, part in enumerate(parts):
        forces = force[part]
        if row:
            forces[:] = force[row - 1]
            if np.array_equal(opening[row], opening[row - 1]):
                continue
        for _ in range(SECANTS if curved else 1):
            secants = [_find_secant_compliance(contact, forces[..., k]) for k, contact in enumerate(contacts)]
            of_laws = np.stack(secants, axis=-1)[..., None] * np.eye(len(contacts))
            active_set(compliance + of_laws, -opening[part], forces)
    return force


def _find_secant_compliance(contact: Contact, force: Array) -> Array:
    """Return the secant compliance of a law, penetration over force, at given forces [m/N]; 0 for a rigid law."""
    law = contact.law
    if law.code == laws.SPRING:
        return np.full(force.shape, 1 / law.parameters[0])
    return np.array([law.closure(float(each)) / each if each > 0 else 0.0 for each in force.flat]).reshape(force.shape)


def spring_displacements(body: Body, force: Array, dt: float, weights: Array | None = None) -> Array:
    """Return the (S, n + 1) displacements at the springs of a body [m], or the (q, n + 1) sums over them by ``weights``
    (S, q).

    ``force``: (n + 1,) or (n + 1, ports) forces on the body's ports [N], ``force[0]`` the static preload. The body's
    loads are those recorded in the run (`impact.march.stepper.with_recorded_loads`). Raises `GreensFunctionError` for
    a body without springs.
    """
    if not isinstance(body, SprungBody):
        raise GreensFunctionError(
            "the body has no springs: give the one that impact.bodies.loads.hold_on_springs returns"
        )
    modal, forces = body.greens.modal, np.atleast_2d(np.asarray(force, dtype=float).T)
    assert modal is not None
    shapes = body.springs.shapes if weights is None else body.springs.shapes @ weights
    springs, ports, residual = shapes.shape[1], len(modal.ports), modal.residual
    compliance = np.zeros((ports + springs, ports + springs))
    compliance[:ports, :ports] = residual.compliance
    with_springs = ModalGreens(  # springs as further ports
        modal.omega,
        modal.zeta,
        np.column_stack([modal.shapes, shapes]),
        Residual(
            np.column_stack([residual.shapes, np.zeros((len(residual.rates), springs))]), residual.rates, compliance
        ),
        (*modal.ports, *(f"spring {k + 1}" for k in range(springs))),
        valid_for=modal.valid_for,
    )
    start, n = replace(Body(body.greens, state=body.state, loads=body.loads), greens=with_springs), forces.shape[1] - 1
    discrete = motion.DiscreteBody.from_body(start, dt, n)
    if np.any(forces[:, 0]):
        at_start = body.load_amplitudes(np.zeros(1))[:, 0]
        discrete = replace(discrete, rest=np.append(forces[:, 0], np.zeros(springs)), rest_loads=at_start)
    on_all_ports = np.concatenate([forces[:, 1:], np.zeros((springs, n))])
    return np.asarray(discrete.motion(motion.PortForces.at_ports(on_all_ports, dt)).displacement[ports:])


def without_springs(body: Body, force: Array, dt: float) -> Body:
    """Return the body in its modes without springs, with the spring forces of a run as loads, constant over each step.

    A body without springs is returned unchanged. Arguments as in `spring_displacements`.
    """
    if not isinstance(body, SprungBody):
        return body
    modal, springs = body.greens.modal, body.springs
    assert modal is not None
    displacement = spring_displacements(body, force, dt)
    pulls = -springs.stiffness[:, None] * (displacement[:, 1:] + displacement[:, :-1]) / 2
    origin = {key: value for key, value in modal.origin.items() if key != SPRINGS}
    greens = replace(modal, origin=origin, omega=springs.omega, zeta=springs.zeta, shapes=springs.basis @ modal.shapes)
    state = body.state and ModalState(springs.basis @ body.state.displacement, springs.basis @ body.state.velocity)
    loads = [replace(load, shape=springs.basis @ load.shape) for load in body.loads]
    loads += [
        Load(springs.basis @ shape, hold_course(pull, dt)) for shape, pull in zip(springs.shapes.T, pulls, strict=True)
    ]
    return Body(greens, state=state, loads=tuple(loads), base=body.base)
