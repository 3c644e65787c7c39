"""The bodies of a scene, with their loads, bases and springs, and the contact problem that they form."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Final

import numpy as np

import impact
from impact.bodies.body import Body, Load
from impact.bodies.loads import hold_on_springs
from impact.greens.base import Array, GreensFunction, GreensFunctionError
from impact.notices import Progress, silent
from seatfem.structures.cache import Cache, build, key_of
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.motion import constant, scaled
from seatfem.structures.method import Method, Solved, bed
from seatfem.structures.rings import Division
from seatfem.study.scene import ContactGeometry, Scene, drives, lips, local, problems
from seatfem.study.scene.contact import Stopper
from seatfem.units import write_quantity

STRAYS: Final = 0.01
"""Largest deflection of a body by its neglected inertia, over the displacement of its base."""
LOOKS: Final = 20_000  # instants at which a base motion is sampled


def solve_body(
    role: str,
    structure: Structure,
    method: Method,
    duration: float,
    progress: Progress = silent,
    *,
    mesh_error: bool = True,
) -> Solved | None:
    """Return a body solved by a method for a ``duration`` [s], cached in the process; ``None`` for a closed form.

    Raises:
        LevelError, MeshError, MeshingError, ModelError, GreensFunctionError, StorageError, with keys of the scene's
        table ``role`` in their messages.
    """
    if not structure.traits.is_solved:
        return None
    with problems.rewrite_errors(role, structure):
        return _solved(_Arguments(key_of(structure, method), mesh_error, structure, method, duration, progress))


@dataclass(frozen=True)
class _Arguments:
    """Arguments of `solve_body`; ``key`` and ``duration`` identify the result in the process's cache."""

    key: str
    mesh_error: bool
    structure: Structure = field(compare=False)
    method: Method = field(compare=False)
    duration: float
    progress: Progress = field(default=silent, compare=False)


@lru_cache(maxsize=6)
def _solved(call: _Arguments) -> Solved:
    cache = Cache(None) if call.structure.traits.needs_gmsh else None
    return build(call.structure, call.method, call.duration, cache, progress=call.progress, mesh_error=call.mesh_error)


def striker_of(scene: Scene, n_modes: int | None = None, greens: GreensFunction | None = None) -> Body:
    """Return the scene's striker under its loads, on its base and springs.

    ``n_modes``: number of modes of a beam, in place of the stated one; ``greens``: Green's function of a striker that
    is not in closed form.
    """
    reed = scene.reed
    with problems.rewrite_errors("reed", reed):
        body = reed.body(greens, n_modes or 0, scene.geometry.contact_at)
        pressed = scene.driven_by or any(load.pressure is not None for load in scene.load)
        ports, areas = (scene.geometry.port_points(), scene.geometry.port_areas()) if pressed else ((), ())
        by_wings = (load for each in scene.driven_by for load in each.loads(reed, body, ports))
        own = external_loads(scene.load, reed, body, tuple(zip(ports, areas, strict=True)))
        body = replace(body, loads=(*body.loads, *own, *by_wings))
        carried = mount_on_base(scene.mount("reed"), body)
        return mount_on_springs(scene.spring, scene.contact.gap, reed, carried)


def stopper_of(scene: Scene) -> Body | None:
    """Return the scene's stopper, solved as its keys state; ``None`` if there is none."""
    if scene.stopper is None:
        return None
    solved = solved_stopper(scene.geometry, scene.run.duration)
    greens = scene.stopper.body.closed_form() if solved is None else solved.greens
    waveless = len(greens.ports) == 1 and greens.modal is not None and greens.highest_rate == 0
    if scene.stopper.parts != Division() and waveless:  # one spring
        greens = bed(scene.stopper.parts, 1 / float(greens.static_compliance()[0, 0]))
    mount = scene.mount("stopper")
    check_base(mount, greens, scene.run.duration)
    return mount_on_base(mount, Body(greens, scene.stopper.speed))


def solved_stopper(geometry: ContactGeometry, duration: float) -> Solved | None:
    """Return the stopper, solved for a ``duration`` [s] as its keys state, with its mesh error; ``None`` for a closed
    form, or without a stopper."""
    if geometry.stopper is None:
        return None
    stopper = geometry.stopper.body
    with problems.rewrite_errors("stopper", stopper):
        moves_as_one = stopper.lip_face.no_lip or geometry.stopper.profile is not None
        lip = None if moves_as_one else geometry.stopper_lip()
        method = stopper.stated() if lip is None else replace(stopper.stated(rings=lip.rings), lip=lip)
    return solve_body("stopper", stopper, method, duration)


def problem_of(scene: Scene, striker: Body, seat: Body, stopper: Body | None = None) -> impact.ContactProblem:
    """Return the contact problem of striker and seat: one contact, or one for each part of the seat's patch, in which a
    striker without such ports moves as a rigid face; then those with the stopper. ``stopper``: in place of the
    scene's."""
    division, geometry = Division.from_greens(seat.greens), scene.geometry
    law, seat, apart = scene.contact.law, mount_on_base(scene.mount("seat"), seat), geometry.has_two_places
    gaps, films = geometry.gaps(division), geometry.films(division)
    contacts = [
        impact.Contact(
            seat,
            port=k,
            gap=float(gap),
            law=local.law_of_part(law, float(share), scene.seat, scene.reed),
            striker_port=striker.greens.port_index(name) if name in striker.greens.ports and not apart else 0,
            film=film,
        )
        for k, (name, gap, share, film) in enumerate(zip(division.names, gaps, division.shares, films, strict=True))
    ]
    if scene.stopper is not None:
        above = geometry.stopper_gaps()
        target = stopper or stopper_of(scene)
        assert target is not None
        target, parts = mount_on_base(scene.mount("stopper"), target), scene.stopper.parts
        for k, (name, share) in enumerate(zip(parts.names, parts.shares, strict=True)):
            port = lips.STOPPER + name
            contacts.append(
                impact.Contact(
                    target,
                    port=k if len(target.greens.ports) > 1 else 0,
                    gap=float(above[k]),
                    law=local.law_of_part(scene.stopper.law, float(share), scene.stopper.body, scene.reed),
                    side=-1,
                    striker_port=port if port in striker.greens.ports else (1 + k if apart else 0),
                )
            )
    check_start(scene.stopper, striker, contacts)
    return impact.ContactProblem(striker, contacts=contacts, preload=scene.contact.preload)


def mount_on_base(mount: drives.Mount, body: Body) -> Body:
    """Return the ``body`` with the motion of its base and, if its weight is known, the inertia that this causes; or
    with the displacement by an incoming wave.

    Raises:
        GreensFunctionError: nothing holds the body; `TimeSeriesError`: the file of the motion cannot be used.
    """
    role, structure, base, wave = mount.role, mount.structure, mount.base, mount.wave
    if wave is not None and body.base is None and (speed := structure.wave_speed):
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
    if structure.traits.has_weight and modes:  # a spring baseline has no inertia
        shape, mass = structure.weight(body)
        padded = np.zeros(modes)  # the body of a comparison may have fewer modes, or one more
        padded[: len(shape)] = shape[:modes]
        loads = (*loads, motion.load(padded, mass))
    return replace(body, loads=loads, base=motion.displacement)


def check_base(mount: drives.Mount, greens: GreensFunction, duration: float) -> None:
    """Refuse a base motion under which a body whose inertia is not modelled would bend by more than `STRAYS`.

    Under an acceleration a it bends by about a/w^2, w its lowest angular frequency; ``duration``: of the run [s].

    Raises:
        GreensFunctionError: the message names frequency, displacement and limit.
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
    """Return the body's lowest natural angular frequency [rad/s]; ``inf`` for a spring, 0 if it is not known."""
    if greens.rod is not None:
        return math.pi / (2 * greens.rod.transit)
    if greens.modal is None:
        return 0.0
    omega = greens.modal.omega
    return float(omega.min()) if len(omega) else math.inf


def mount_on_springs(springs: Sequence[drives.ValveSpring], gap: float, reed: Structure, body: Body) -> Body:
    """Return the ``body`` of a reed on its valve springs, if any; their force towards the seat is preload + stiffness
    ``gap`` on the undeformed reed, which lies a ``gap`` above its closed position [m].

    Raises:
        GreensFunctionError: the body has no modes, or the springs leave it free to move.
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
        force = constant(-spring.force_on_undeformed(gap))
        columns = reed.pushed_at(body, spring.places if spring.at is None else spring.at, by="springs")
        shapes.append(columns)
        stiffness.append(np.full(columns.shape[1], spring.stiffness / columns.shape[1]))
        loads.append(Load(columns.mean(axis=1), force))
    held = hold_on_springs(replace(body, loads=tuple(loads)), np.concatenate(shapes, axis=1), np.concatenate(stiffness))
    if not math.isinf(held.mass):
        raise GreensFunctionError(
            "spring: the valve springs leave the reed free to rock, and so no place of its lip is held; give three "
            "places or more that do not lie in one line, by points, or by number and radius"
        )
    return held


def external_loads(
    loads: Sequence[drives.ExternalLoad], reed: Structure, body: Body, ports: Sequence[tuple[Array, float]] = ()
) -> Iterator[Load]:
    """Yield the known loads on the ``reed`` as a ``body``; ``ports``: (n, 2) points of each of several ports that it
    covers, from the centre of its contact [m], with the port's area [m^2]."""
    for load in loads:
        if load.pressure is not None:
            yield _pressure_load(load, reed, body, ports)
        elif load.force is not None:
            place = load.at if load.point is None else np.array([load.point])
            yield Load(reed.pushed_at(body, place).ravel(), load.force.course)
        else:
            shape, mass = reed.weight(body)
            if load.gravity is not None:
                yield Load(shape, scaled(constant(load.gravity), mass))
            if load.base_motion is not None:
                yield Load(shape, scaled(load.base_motion.course, -mass))


def _pressure_load(
    load: drives.ExternalLoad, reed: Structure, body: Body, ports: Sequence[tuple[Array, float]]
) -> Load:
    """Return the load p(t) A(0) of a pressure, with the factor A(lift)/A(0) if its area depends on the lift; several
    ``ports`` share the area A by their own."""
    assert load.pressure is not None
    assert load.area is not None
    closed = load.area(0.0)
    lifts, ratios = np.array(load.area.lift), np.array(load.area.area) / closed  # evaluated every few steps
    by_opening = (lambda opening: float(np.interp(opening, lifts, ratios))) if load.by_lift else None
    if len(ports) > 1:
        means = [reed.pushed_at(body, points).mean(axis=1) for points, _ in ports]
        shape = np.average(means, axis=0, weights=[area for _, area in ports])
    else:
        shape = reed.pushed_at(body, None, by="pressure")[:, 0]
    return Load(shape, scaled(load.pressure.course, closed), by_opening)


SLACK: Final = 1e-2  # overlap by mode truncation that is accepted, over the largest deflection of the ports


def check_start(stopper: Stopper | None, striker: Body, contacts: Sequence[impact.Contact]) -> None:
    """Raise `SceneError` for a striker that overlaps seat or stopper at the start: rigid contact would throw it out
    within one step. A compliant contact may start compressed."""
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
