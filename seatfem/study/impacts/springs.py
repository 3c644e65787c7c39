"""The valve springs of a scene's [[spring]] tables: a reed on them, and the forces that they had in a run."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from impact.after.springs import spring_displacements
from impact.bodies.body import Body, Load
from impact.bodies.springs import SprungBody, on_springs
from impact.greens.base import Array, GreensFunction, GreensFunctionError
from impact.march.followed import as_marched
from seatfem.structures.kinds.plate_loads import constant
from seatfem.study.impacts.gas import lift_of
from seatfem.study.impacts.touches import Touches, on_the_ports
from seatfem.study.scene import Scene
from seatfem.study.scene.spring import ValveSpring


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
    marched = as_marched(striker, lift_of(touches), dt)
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


def _undeformed(scene: Scene, spring: ValveSpring) -> float:
    """Return the force on the undeformed reed, towards the seat [N]."""
    return spring.preload + spring.stiffness * scene.contact.gap


def _shapes(scene: Scene, spring: ValveSpring, body: Body) -> Array:
    """Return the (M, S) shapes of the body's modes at the springs of a table [1/sqrt(kg)]."""
    if spring.at is not None:
        return scene.reed.pushed_at(body, spring.at)
    return scene.reed.pushed_by_springs(body, spring.places)
