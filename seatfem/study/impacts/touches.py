"""The contacts of one run taken apart: those of the seat, ring by ring and as one, and that of the stopper."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import impact
from impact import measures
from impact.after.result import ImpactResult, as_one, of_contacts
from impact.bodies.body import Body
from impact.greens.base import Array, GreensFunction
from impact.march.motion import mean_displacement
from seatfem.structures.rings import Division
from seatfem.study.impacts.landings import Landings, landings_of_result
from seatfem.study.scene import Scene
from seatfem.study.scene.lips import STOPPER, line_of
from seatfem.study.scene.measures import Line


@dataclass(frozen=True)
class Touches:
    """One run, contact by contact; the energies in each are those of the whole run.

    Attributes:
        seat: its patch, all parts seen as one contact.
        parts: part by part, where it is divided into arcs and rings.
        stopper: where there is one, all parts seen as one contact.
        stopper_parts: part by part, where it is divided.
        line: along the lip, where it has several arcs.
        landings: of the run; ``None``: not looked for.
    """

    seat: ImpactResult
    parts: ImpactResult | None = None
    stopper: ImpactResult | None = None
    line: Line | None = None
    stopper_parts: ImpactResult | None = None
    landings: Landings | None = None

    @property
    def stopper_force(self) -> Array | None:
        """Return the force (n + 1,) of the stopper [N]; ``None`` where there is none."""
        return None if self.stopper is None else self.stopper.force


def taken_apart(scene: Scene, problem: impact.ContactProblem, result: ImpactResult) -> Touches:
    """Return the contacts of ``result`` of a problem of a scene: the seat's columns come first, the stopper's last."""
    shares = Division.of(problem.target.greens).shares
    landings = landings_of_result(problem, result, scene.run.filter_width)
    if result.force.ndim == 1:
        return Touches(result, landings=landings)
    of_seat = seat_contacts(problem)
    stopper = above = None
    if scene.stopper is not None:
        above = of_contacts(result, slice(of_seat, None)) if scene.stopper.parts != Division() else None
        stopper = measures.of_contact(result, of_seat) if above is None else as_one(above, scene.stopper.parts.shares)
    if of_seat == 1:
        return Touches(measures.of_contact(result, 0), stopper=stopper, stopper_parts=above, landings=landings)
    parts = of_contacts(result, slice(of_seat))
    line = line_of(scene, problem, parts.force, parts.film)
    seat = as_one(parts, shares)
    mass = _mass_that_moves(problem, np.asarray(parts.force.sum(axis=0)), shares)
    return Touches(replace(seat, striker_mass=mass or seat.striker_mass), parts, stopper, line, above, landings)


def _mass_that_moves(problem: impact.ContactProblem, pushed: Array, shares: Array) -> float | None:
    """Return the sum of the forces on the seat's contacts over the acceleration that they give to the mean of these.

    It is the mass [kg] of a striker that is free and does not turn, less where it turns as well; ``None`` of one that
    is held, and without force.
    """
    inverse = problem.striker.greens.inverse_mass()
    seen = problem.directions(problem.striker)[:, : len(shares)]
    moved = float(shares @ seen.T @ np.where(np.isfinite(inverse), inverse, 0.0) @ seen @ pushed)
    return float(pushed.sum()) / moved if moved > 0 else None


def seat_contacts(problem: impact.ContactProblem) -> int:
    """Return how many of the contacts are the seat's: the first ones."""
    return sum(contact.side > 0 for contact in problem.contacts)


def stopper_in(problem: impact.ContactProblem) -> Body | None:
    """Return the stopper of a problem."""
    return next((contact.target for contact in problem.contacts if contact.side < 0), None)


def force_of(stepper: impact.ContactStepper) -> Array:
    """Return the contact force (n + 1,) of the seat's whole patch at every step done [N]."""
    return np.asarray(parts_of(stepper).sum(axis=1))


def film_of(stepper: impact.ContactStepper) -> Array | None:
    """Return the film's part (n + 1,) of `force_of` [N]; ``None`` where there is none."""
    if stepper.film.size == 0:
        return None
    seat = seat_contacts(stepper.prepared.problem)
    return np.concatenate([[0.0], stepper.film[: stepper.done, :seat].sum(axis=1)])


def parts_of(stepper: impact.ContactStepper) -> Array:
    """Return the contact force (n + 1, parts) of each part of the seat's patch at every step done [N]."""
    seat = seat_contacts(stepper.prepared.problem)
    return np.concatenate([stepper.prepared.rest[None, :seat], stepper.force[: stepper.done, :seat]])


def stopper_force_of(stepper: impact.ContactStepper) -> Array | None:
    """Return the contact force (n + 1,) of the stopper at every step done [N]; ``None`` where there is none."""
    if seat_contacts(stepper.prepared.problem) == stepper.force.shape[1]:
        return None
    seat = seat_contacts(stepper.prepared.problem)
    parts = np.concatenate([stepper.prepared.rest[None, seat:], stepper.force[: stepper.done, seat:]])
    return np.asarray(parts.sum(axis=1))


def displacement_of(stepper: impact.ContactStepper) -> Array:
    """Return the displacement (n + 1,) of the seat's patch, its mean [m]."""
    contacts = seat_contacts(stepper.prepared.problem)
    seat, force = stepper.prepared.bodies[1], stepper.force[: stepper.done, :contacts]
    moved = mean_displacement(seat, -force.T, Division.of(seat.body.greens).shares)
    if seat.body.base is None:
        return moved
    return moved + seat.body.carried(np.asarray(seat.dt * np.arange(len(moved)), dtype=np.float64))


def facing(scene: Scene, striker: GreensFunction, part: str) -> int:
    """Return the striker's port over a part of the seat: the one of its name, and the first where there is none, or
    where the ports are the places of seat and stopper."""
    return striker.port_index(part) if part in striker.ports and not scene.has_two_places else 0


def on_the_ports(scene: Scene, striker: GreensFunction, seat: GreensFunction, touches: Touches) -> Array:
    """Return the forces (n + 1, ports) of seat and stopper on all ports of the striker, along the normal [N]."""
    force = np.zeros((len(touches.seat.force), len(striker.ports)))

    def add(parts: ImpactResult | None, whole: ImpactResult, names: tuple[str, ...], other: int, sign: int) -> None:
        each = whole.force[:, None] if parts is None else parts.force
        for name, pushed in zip(names if parts is not None else ("",), each.T, strict=True):
            force[:, striker.port_index(name) if name in striker.ports else other] += sign * pushed

    add(touches.parts, touches.seat, Division.of(seat).names, 0, 1)
    if touches.stopper is not None and scene.stopper is not None:
        names = tuple(STOPPER + name for name in scene.stopper.parts.names)
        add(touches.stopper_parts, touches.stopper, names, len(striker.ports) - 1 if scene.has_two_places else 0, -1)
    return force


def pushes(striker: Body, force: Array, stopper: Array | None) -> Array:
    """Return the forces (n + 1,), or (n + 1, 2) with two ports, of seat and stopper on the striker's ports [N]."""
    if stopper is None:
        return force
    return np.column_stack([force, -stopper]) if len(striker.greens.ports) > 1 else force - stopper
