"""What drives and holds the bodies of a scene: moving bases, valve springs, known loads, and where they begin."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

import impact
from impact.after.loads import spring_displacements
from impact.bodies.body import Body, Load
from impact.bodies.loads import SprungBody, on_springs
from impact.greens.base import GreensFunction, GreensFunctionError
from impact.march.stepper import with_recorded_loads
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.plate_loads import constant, scaled
from seatfem.structures.kinds.structure import in_role
from seatfem.study.impacts.gas import lift_of
from seatfem.study.impacts.touches import Touches, on_the_ports
from seatfem.study.scene import ContactGeometry, drives, problems
from seatfem.study.scene.contact import Stopper
from seatfem.units import write_quantity

STRAYS: Final = 0.01
"""Most that a body may bend by the inertia that is left out, over the way of its base."""
LOOKS: Final = 20_000  # times at which a course is looked at


def on_its_base(mount: drives.Mount, body: Body) -> Body:
    """Return the ``body`` carried by its base and under its own inertia, where that is known, or by the
    wave that comes along it.

    Raises:
        GreensFunctionError: a body that nothing holds; `TimeSeriesError`, a file that cannot be used.
    """
    role, structure, base, wave = mount.role, mount.structure, mount.base, mount.wave
    if wave is not None and body.base is None and (speed := structure.wave_speed) is not None:
        away = 1.0 if role == "seat" else -1.0  # from the rod: towards its partner
        incoming = wave.incoming(speed)
        return replace(body, base=lambda time: away * incoming.outwards(time))
    if base is None or body.base is not None:
        return body
    if not math.isinf(body.mass):
        raise GreensFunctionError(
            f"base.of = {role!r}: nothing holds this body, so that it has no base; clamp it somewhere, or give it a "
            "velocity"
        )
    motion, loads = base.motion(), body.loads
    modes = 0 if body.greens.modal is None else len(body.greens.modal.omega)
    if structure.traits.has_weight and modes:  # a spring in its place has no inertia
        with in_role(role, structure):
            shape, mass = structure.weight(body)
        alike = np.zeros(modes)  # as many as it has: what it is compared with may have fewer, or one more
        alike[: len(shape)] = shape[:modes]
        loads = (*loads, motion.load(alike, mass))
    return replace(body, loads=loads, base=motion.displacement)


def check_base(mount: drives.Mount, greens: GreensFunction, duration: float) -> None:
    """Refuse a base that moves so fast that the body, of which the rigid motion alone is known, bends by its inertia
    over the ``duration`` of the run [s].

    It bends by some a/w^2 of its lowest frequency: under a course at a tenth of that by 1 % of its way.

    Raises:
        GreensFunctionError: naming frequency, way and limit.
    """
    base, structure = mount.base, mount.structure
    if base is None or (structure.traits.has_weight and greens.modal is not None):
        return
    motion, lowest = base.motion(), _lowest(greens)
    time = np.linspace(0.0, duration, LOOKS)
    way, push = float(np.ptp(motion.displacement(time))), float(np.abs(motion.acceleration(time)).max())
    bends = push / lowest**2 if lowest > 0 else math.inf
    if push > 0 and bends > STRAYS * way:
        known = (
            f"its lowest frequency is {write_quantity(lowest / (2 * math.pi), 'frequency', 4)}"
            if lowest
            else "its frequencies are not known"
        )
        raise GreensFunctionError(
            f"base.of = {mount.role!r}: of a body of kind {structure.kind!r} the rigid motion alone is known; {known}, "
            f"and {push:.3g} m/s^2 would bend it by more than {100 * STRAYS:g} % of the way of "
            f"{write_quantity(way, 'length', 3)}: give a slower "
            "course, or a beam or plate"
        )


def _lowest(greens: GreensFunction) -> float:
    """Return the body's lowest natural angular frequency [rad/s]; ``inf`` for a spring, 0 where it is not known."""
    if greens.rod is not None:
        return math.pi / (2 * greens.rod.transit)
    if greens.modal is None:
        return 0.0
    omega = greens.modal.omega
    return float(omega.min()) if len(omega) else math.inf


def on_its_springs(springs: Sequence[drives.ValveSpring], gap: float, reed: Structure, body: Body) -> Body:
    """Return the ``body`` of a reed on its valve springs, under the force that they have as it lies undeformed, ``gap``
    above the closed one [m]: preload + stiffness gap, towards the seat. Itself where there are none.

    Raises:
        GreensFunctionError: a body without modes; one that the springs leave free to move.
    """
    if not springs:
        return body
    modal = body.greens.modal
    if modal is None or not len(modal.omega):
        raise GreensFunctionError(
            f"spring: a reed of kind {reed.kind!r} has no modes that valve springs could act on; take a beam, a "
            "plate, a ball or a rigid mass"
        )
    shapes, stiffness, loads = [], [], list(body.loads)
    for spring in springs:
        columns = reed.pushed_at(body, spring.places if spring.at is None else spring.at, by="springs")
        shapes.append(columns)
        stiffness.append(np.full(columns.shape[1], spring.stiffness / columns.shape[1]))
        loads.append(Load(columns.mean(axis=1), constant(-spring.force_on_undeformed(gap))))
    held = on_springs(replace(body, loads=tuple(loads)), np.concatenate(shapes, axis=1), np.concatenate(stiffness))
    if not math.isinf(held.mass):
        raise GreensFunctionError(
            "spring: the valve springs leave the reed free to rock, and so no place of its lip is held; give three "
            "places or more that do not lie in one line, by points, or by number and radius"
        )
    return held


def valve_spring_keys(
    springs: Sequence[drives.ValveSpring],
    geometry: ContactGeometry,
    striker: Body,
    seat: GreensFunction,
    touches: Touches,
) -> dict[str, object]:
    """Return the keys of the force of all valve springs together, towards the ``seat``: the largest one and that as the
    hardest landing begins; none where there are no such springs."""
    if not isinstance(striker, SprungBody):
        return {}
    dt = touches.seat.dt
    marched = with_recorded_loads(striker, lift_of(touches), dt)
    ports = on_the_ports(geometry, striker.greens, seat, touches)
    (moved,) = spring_displacements(marched, ports, dt, striker.springs.stiffness[:, None])
    force = np.asarray(sum(spring.force_on_undeformed(geometry.contact.gap) for spring in springs) + moved)
    hard = None if touches.landings is None else touches.landings.hardest
    return {
        "valve_spring_force_max_N": float(force.max()),
        "valve_spring_force_at_landing_N": hard and float(np.interp(hard.start, touches.seat.time, force)),
    }


def external_loads(loads: Sequence[drives.ExternalLoad], reed: Structure, body: Body) -> Iterator[Load]:
    """Yield the known loads on the ``reed`` as a ``body``."""
    for load in loads:
        if load.pressure is not None:
            yield _blown(load, reed, body)
        elif load.force is not None:
            place = load.at if load.point is None else np.array([load.point])
            yield Load(reed.pushed_at(body, place).ravel(), load.force.course)
        else:
            shape, mass = reed.weight(body)
            if load.gravity is not None:
                yield Load(shape, scaled(constant(load.gravity), mass))
            if load.base_motion is not None:
                yield Load(shape, scaled(load.base_motion.course, -mass))


def _blown(load: drives.ExternalLoad, reed: Structure, body: Body) -> Load:
    """Return the load of a pressure, p(t) A(0), and its change with the lift, A/A(0): 1 for a constant area."""
    assert load.pressure is not None
    assert load.area is not None
    closed = load.area(0.0)
    lifts, ratios = np.array(load.area.lift), np.array(load.area.area) / closed  # asked for every few steps
    by_opening = (lambda opening: float(np.interp(opening, lifts, ratios))) if load.by_lift else None
    shape = reed.pushed_at(body, None, by="pressure")[:, 0]
    return Load(shape, scaled(load.pressure.course, closed), by_opening)


SLACK: Final = 1e-2  # of the largest deflection of its ports: what modes left out may be off by


def check_start(stopper: Stopper | None, striker: impact.Body, contacts: Sequence[impact.Contact]) -> None:
    """Raise `SceneError` for a striker that is bent into what it is to strike, where it is deepest: rigid contact would
    throw it out within one step. What yields, as a spring, may begin compressed."""
    if striker.state is None or striker.greens.modal is None:
        return
    bent = striker.greens.modal.shapes.T @ striker.state.displacement
    rigid = [contact for contact in contacts if isinstance(contact.law, impact.Signorini)]
    starts = [contact.side * float(bent[striker.greens.port_index(contact.striker_port)]) for contact in rigid]
    start, contact = min(zip(starts, rigid, strict=True), key=lambda each: each[0] + each[1].gap, default=(0.0, None))
    if contact is None or contact.gap + start >= -SLACK * float(np.abs(bent).max()):
        return
    seat = contact.side > 0
    key = "contact.gap" if seat else f"stopper.{'lift' if stopper and stopper.lift is not None else 'gap'}"
    words = (
        f"the opening is {1e6 * contact.gap:.4g} um where reed.release bends the reed by {-1e6 * start:.4g} um "
        f"towards the {'seat' if seat else 'stopper'}, so that it would begin inside it: add "
        f"{-1e6 * (contact.gap + start):.4g} um or more to {key}, or release the reed from another shape"
    )
    raise problems.scene_error(key, words)
