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
from impact.greens.base import Array, GreensFunction, GreensFunctionError
from impact.march.stepper import with_recorded_loads
from seatfem.structures.kinds.plate_loads import constant, scaled
from seatfem.structures.kinds.structure import in_role
from seatfem.study.impacts.gas import gas_loads, lift_of
from seatfem.study.impacts.touches import Touches, on_the_ports
from seatfem.study.scene import Scene, SceneError, drives, problems
from seatfem.units import write_quantity

STRAYS: Final = 0.01
"""Most that a body may bend by the inertia that is left out, over the way of its base."""
LOOKS: Final = 20_000  # times at which a course is looked at


def on_its_base(scene: Scene, role: str, body: Body) -> Body:
    """Return the ``body`` in a ``role``, carried by its base and under its own inertia, where that is known, or by the
    wave that comes along it.

    Raises:
        GreensFunctionError: a body that nothing holds; `TimeSeriesError`, a file that cannot be used.
    """
    base, wave = scene.base_of(role), scene.wave_on(role)
    if wave is not None and body.base is None and (speed := scene.bodies[role].wave_speed) is not None:
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
    motion, structure, loads = base.motion(), scene.bodies[role], body.loads
    modes = 0 if body.greens.modal is None else len(body.greens.modal.omega)
    if structure.traits.has_weight and modes:  # a spring in its place has no inertia
        with in_role(role, structure):
            shape, mass = structure.weight(body)
        alike = np.zeros(modes)  # as many as it has: what it is compared with may have fewer, or one more
        alike[: len(shape)] = shape[:modes]
        loads = (*loads, motion.load(alike, mass))
    return replace(body, loads=loads, base=motion.displacement)


def check_base(scene: Scene, role: str, greens: GreensFunction) -> None:
    """Refuse a base that moves so fast that the body, of which the rigid motion alone is known, bends by its inertia.

    It bends by some a/w^2 of its lowest frequency: under a course at a tenth of that by 1 % of its way.

    Raises:
        GreensFunctionError: naming frequency, way and limit.
    """
    base, structure = scene.base_of(role), scene.bodies[role]
    if base is None or (structure.traits.has_weight and greens.modal is not None):
        return
    motion, lowest = base.motion(), _lowest(greens)
    time = np.linspace(0.0, scene.run.duration, LOOKS)
    way, push = float(np.ptp(motion.displacement(time))), float(np.abs(motion.acceleration(time)).max())
    bends = push / lowest**2 if lowest > 0 else math.inf
    if push > 0 and bends > STRAYS * way:
        known = (
            f"its lowest frequency is {write_quantity(lowest / (2 * math.pi), 'frequency', 4)}"
            if lowest
            else "its frequencies are not known"
        )
        raise GreensFunctionError(
            f"base.of = {role!r}: of a body of kind {structure.kind!r} the rigid motion alone is known; {known}, and "
            f"{push:.3g} m/s^2 would bend it by more than {100 * STRAYS:g} % of the way of "
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


def on_its_springs(scene: Scene, body: Body) -> Body:
    """Return the striker's ``body`` on the scene's valve springs, under the force that they have as it lies undeformed:
    preload + stiffness contact.gap, towards the seat. Itself where there are none.

    Raises:
        GreensFunctionError: a body without modes; one that the springs leave free to move.
    """
    if not scene.spring:
        return body
    modal = body.greens.modal
    if modal is None or not len(modal.omega):
        raise GreensFunctionError(
            f"spring: a reed of kind {scene.reed.kind!r} has no modes that valve springs could act on; take a beam, a "
            "plate, a ball or a rigid mass"
        )
    shapes, stiffness, loads = [], [], list(body.loads)
    for spring in scene.spring:
        columns = _shapes(scene, spring, body)
        shapes.append(columns)
        stiffness.append(np.full(columns.shape[1], spring.stiffness / columns.shape[1]))
        loads.append(Load(columns.mean(axis=1), constant(-_undeformed(scene, spring))))
    held = on_springs(replace(body, loads=tuple(loads)), np.concatenate(shapes, axis=1), np.concatenate(stiffness))
    if not math.isinf(held.mass):
        raise GreensFunctionError(
            "spring: the valve springs leave the reed free to rock, and so no place of its lip is held; give three "
            "places or more that do not lie in one line, by points, or by number and radius"
        )
    return held


def spring_force(scene: Scene, striker: Body, seat: GreensFunction, touches: Touches) -> Array | None:
    """Return the (n + 1,) force of all valve springs together in a run on a ``seat``, towards it [N]; ``None`` where
    there are none."""
    if not isinstance(striker, SprungBody):
        return None
    dt = touches.seat.dt
    marched = with_recorded_loads(striker, lift_of(touches), dt)
    ports = on_the_ports(scene, striker.greens, seat, touches)
    (moved,) = spring_displacements(marched, ports, dt, striker.springs.stiffness[:, None])
    return np.asarray(sum(_undeformed(scene, spring) for spring in scene.spring) + moved)


def valve_spring_keys(scene: Scene, striker: Body, seat: GreensFunction, touches: Touches) -> dict[str, object]:
    """Return the keys of the valve springs' force, the largest one and that as the hardest landing begins; none where
    there are no such springs."""
    if (force := spring_force(scene, striker, seat, touches)) is None:
        return {}
    hard = None if touches.landings is None else touches.landings.hardest
    return {
        "valve_spring_force_max_N": float(force.max()),
        "valve_spring_force_at_landing_N": hard and float(np.interp(hard.start, touches.seat.time, force)),
    }


def _undeformed(scene: Scene, spring: drives.ValveSpring) -> float:
    """Return the force on the undeformed reed, towards the seat [N]."""
    return spring.preload + spring.stiffness * scene.contact.gap


def _shapes(scene: Scene, spring: drives.ValveSpring, body: Body) -> Array:
    """Return the (M, S) shapes of the body's modes at the springs of a table [1/sqrt(kg)]."""
    return scene.reed.pushed_at(body, spring.places if spring.at is None else spring.at, by="springs")


def loaded(scene: Scene, body: Body) -> Body:
    """Return the striker's ``body`` under the scene's loads and its gas, beside the loads that it has, on its base and
    its valve springs. Raises as `Body`, `on_its_base` and `on_its_springs`."""
    if scene.load or scene.gas is not None:
        body = replace(body, loads=(*body.loads, *_loads(scene, body), *gas_loads(scene, body)))
    return on_its_springs(scene, on_its_base(scene, "reed", body))


def _loads(scene: Scene, body: Body) -> Iterator[Load]:
    for load in scene.load:
        if load.pressure is not None:
            yield _blown(scene, load, body)
        elif load.force is not None:
            place = load.at if load.point is None else np.array([load.point])
            yield Load(scene.reed.pushed_at(body, place).ravel(), load.force.course)
        else:
            shape, mass = scene.reed.weight(body)
            if load.gravity is not None:
                yield Load(shape, scaled(constant(load.gravity), mass))
            if load.base_motion is not None:
                yield Load(shape, scaled(load.base_motion.course, -mass))


def _blown(scene: Scene, load: drives.ExternalLoad, body: Body) -> Load:
    """Return the load of a pressure, p(t) A(0), and its change with the lift, A/A(0): 1 for a constant area."""
    assert load.pressure is not None
    assert load.area is not None
    closed = load.area(0.0)
    lifts, ratios = np.array(load.area.lift), np.array(load.area.area) / closed  # asked for every few steps
    by_opening = (lambda opening: float(np.interp(opening, lifts, ratios))) if load.by_lift else None
    shape = scene.reed.pushed_at(body, None, by="pressure")[:, 0]
    return Load(shape, scaled(load.pressure.course, closed), by_opening)


SLACK: Final = 1e-2  # of the largest deflection of its ports: what modes left out may be off by


def check_start(scene: Scene, striker: impact.Body, contacts: Sequence[impact.Contact]) -> None:
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
    key = "contact.gap" if seat else f"stopper.{'lift' if scene.stopper and scene.stopper.lift is not None else 'gap'}"
    words = (
        f"the opening is {1e6 * contact.gap:.4g} um where reed.release bends the reed by {-1e6 * start:.4g} um "
        f"towards the {'seat' if seat else 'stopper'}, so that it would begin inside it: add "
        f"{-1e6 * (contact.gap + start):.4g} um or more to {key}, or release the reed from another shape"
    )
    raise SceneError((problems.Problem(None, 0, key, words, tuple(key.split("."))),))
