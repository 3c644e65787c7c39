"""Contact along a lip: where it runs on both bodies, in how many arcs, and how far it is open."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from impact.greens.base import Array
from impact.march.problem import ContactProblem
from seatfem.fields import KeyProblem
from seatfem.structures.lip import Lip
from seatfem.structures.rings import MOST_PORTS, Division
from seatfem.study.scene import Scene, SceneError
from seatfem.study.scene.measures import Line
from seatfem.study.scene.problems import Problem

USUAL: Final = 32  # arcs, where nothing else is known
POINTS: Final = 4096  # of the centre line, at least, on which openings are averaged


def usual_ports(scene: Scene) -> int:
    """Arcs of a scene that states none: `USUAL` where it opens unevenly or lies off the middle, or under a plate that
    touches where the lip is, else one."""
    touches = scene.reed.meets_lips and not scene.reed.states_contact
    many = scene.seat.struck_ring is not None and (
        touches or scene.contact.uneven or scene.reed.is_curved or any(scene.contact.offset)
    )
    return min(USUAL, MOST_PORTS // scene.contact.rings) if many else 1


def lip_of(scene: Scene, ports: int | None = None) -> Lip | None:
    """The seat's lip in so many arcs, by default those that the scene states, or the usual number of them.

    ``None`` where the patch is not divided around, or no ring is struck.
    """
    arcs = ports or scene.contact.ports or usual_ports(scene)
    ring = scene.seat.struck_ring
    as_it_states = scene.contact.ports is None and scene.reed.states_contact
    if ring is None or (arcs == 1 and (as_it_states or not scene.reed.meets_lips)):
        return None
    return Lip(*ring, arcs=arcs, rings=scene.contact.rings)


def on_the_reed(scene: Scene, lip: Lip | None) -> Lip | None:
    """The same lip as a plate sees it, off its centre; ``None`` of a striker that touches as one rigid face."""
    if lip is None or not scene.reed.meets_lips:
        return None
    return Lip(lip.radius, lip.width, lip.arcs, lip.rings, scene.contact.offset)


def gaps_of(scene: Scene, arcs: int) -> Array:
    """(arcs,) openings of the undeformed bodies [m], the mean over each arc of

        gap(th) = gap + h(th) - min h,   h = R tan(tilt) sin(th - tilt_axis) + waviness(th) + w0(th)

    on the centre line of the lip, of mean radius R, with the height w0 of a reed that is not flat; ``gap`` is the
    smallest. Raises `SceneError` where that height is not known.
    """
    contact, ring = scene.contact, scene.seat.struck_ring
    if ring is None or not (contact.uneven or scene.reed.is_curved):
        return np.full(arcs, contact.gap)
    each = math.ceil(POINTS / arcs)
    angles = 2 * np.pi * (np.arange(arcs * each) + 0.5) / (arcs * each)
    height = ring[0] * math.tan(contact.tilt) * np.sin(angles - contact.tilt_axis)
    if contact.waviness:
        at, values = np.array(contact.waviness).T
        height = height + np.interp(angles, at, values, period=2 * np.pi)
    if scene.reed.is_curved:
        line = contact.offset + ring[0] * np.column_stack([np.cos(angles), np.sin(angles)])
        try:
            height = height + scene.reed.heights(line)
        except KeyProblem as problem:
            path = ("reed", *problem.key.split("."))
            raise SceneError((Problem(None, 0, ".".join(path), str(problem), path),)) from None
    return np.asarray(contact.gap + (height - height.min()).reshape(arcs, each).mean(axis=1))


def line_of(scene: Scene, problem: ContactProblem, parts: Array | None) -> Line | None:
    """The contact along the lip of a problem, from the forces (n + 1, parts) of the seat's parts [N]; ``None`` where
    it has no arcs."""
    division, ring = Division.of(problem.target.greens), scene.seat.struck_ring
    if parts is None or ring is None or division.arcs == 1:
        return None
    force = parts.reshape(len(parts), division.arcs, division.rings).sum(axis=2)
    return Line(force, 2 * math.pi * ring[0], scene.contact.line_arc / (2 * math.pi))
