"""Geometry of a scene's contact along a lip: where it runs on both bodies, in how many arcs, how far it is open."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from impact.after.histories import ClosedLine
from impact.greens.base import Array
from impact.march.laws import SqueezeFilm
from impact.march.problem import ContactProblem
from seatfem.fields import KeyProblem
from seatfem.structures.kinds.striking import is_curved
from seatfem.structures.lip import AnyLip, tilted
from seatfem.structures.rings import FEWEST_ARCS, MOST_CHOSEN, Division, arc_rings_to_compare
from seatfem.study.scene import Scene, SceneError
from seatfem.study.scene.measures import Line
from seatfem.study.scene.problems import Problem

NO_ANGLES: Final = (
    "the struck lip is a strip, several faces, or winds about its centroid, so that an angle does not define a place "
    "on it; remove the key, or strike one ring that each ray from its centroid crosses once"
)
STOPPER: Final = "stopper_"  # prefix of the names of ports that meet a stopper
ACROSS: Final = 9  # lines from rim to rim of which the lowest is sought: a reed may sag between them
USUAL: Final = 32  # arcs of a lip by default


def usual_ports(scene: Scene) -> int:
    """Return the number of arcs of a scene that states none: `USUAL` where it opens unevenly or lies off the middle, or
    where a plate that touches where the lip is meets a ring, else one."""
    touches = (reed := scene.reed.thin_plate) is not None and not reed.states_contact
    uneven = scene.contact.uneven or is_curved(scene.reed) or any(scene.contact.offset)
    many = (touches and scene.seat.lip_face.ring is not None) or uneven
    return min(USUAL, MOST_CHOSEN // scene.contact.rings) if many else 1


def lip_of(scene: Scene, ports: int | None = None, rings: int | None = None) -> AnyLip | None:
    """Return the seat's lip in so many arcs and rings, by default those that the scene states, or usual ones.

    ``None`` where the patch is not divided around, or no ring is struck. A face that is no ring of a body of revolution
    is struck as ``contact.ports`` says alone. Raises `ModelError` of a face of a file that is no lip.
    """
    arcs, rings = ports or scene.contact.ports or usual_ports(scene), rings or scene.contact.rings
    reed = scene.reed.thin_plate
    open_ports = arcs == 1 and scene.contact.ports is None
    if arcs == 1 and (reed is None or (open_ports and (reed.states_contact or scene.seat.lip_face.ring is None))):
        return None
    lip = scene.seat.lip(arcs, rings)
    stated = ports or scene.contact.ports
    if stated or lip is None or arcs == 1 or (whole := lip.whole(arcs)) == arcs:
        return lip
    return scene.seat.lip(whole, rings)


def arcs_behind_rings(scene: Scene, division: Division) -> int:
    """Return the number of arcs in which rings across them are compared: half of those there are, or fewer, at least
    `FEWEST_ARCS`, where that makes more than `MOST_CHOSEN` parts."""
    arcs, most = division.arcs, max(division.rings, arc_rings_to_compare(division.rings)[0])
    while arcs % 2 == 0 and arcs // 2 >= FEWEST_ARCS and (arcs == division.arcs or arcs * most > MOST_CHOSEN):
        lip = scene.seat.lip(arcs // 2)
        if lip is None or lip.whole(arcs // 2) != arcs // 2:
            break
        arcs //= 2
    return arcs


def across_of(scene: Scene) -> int:
    """Return the rings across the lip's arcs to compare the scene's own with; with a film that own number."""
    rings = scene.contact.rings
    return rings if scene.contact.film is not None else max(rings, arc_rings_to_compare(rings)[0])


def on_the_reed(scene: Scene, lip: AnyLip | None) -> AnyLip | None:
    """Return the lip in a plate's coordinates, off its centre; ``None`` for a striker with one rigid face."""
    if lip is None or scene.reed.thin_plate is None:
        return None
    return replace(lip, offset=scene.contact.offset)  # type: ignore[type-var]


def stopper_lip(scene: Scene) -> AnyLip | None:
    """Return the part of the stopper that the reed meets, in the parts asked for; ``None``: as a whole.

    Its own flat face, or what the reed touches with of a body that has none. Raises `ModelError` of a face of a file
    that is no lip.
    """
    if scene.stopper is None or (parts := scene.stopper.parts) == Division():
        return None
    lip = scene.stopper.body.lip(parts.arcs, parts.rings)
    own: AnyLip | None = getattr(scene.reed, "own_lip", None)
    return replace(own, arcs=parts.arcs, rings=parts.rings) if lip is None and own is not None else lip  # type: ignore[type-var]


def behind_the_reed(scene: Scene) -> AnyLip | None:
    """Return the stopper's lip in the reed's coordinates, under names of its own."""
    lip = stopper_lip(scene)
    return None if lip is None else replace(lip, side=STOPPER)  # type: ignore[type-var]


def stopper_gaps(scene: Scene) -> Array:
    """Return the openings (parts,) between the undeformed reed and the stopper [m], as `gaps_of`: with h of the
    stopper's tilt, less the height of a reed that is not flat."""
    assert scene.stopper is not None
    lip, stopper = stopper_lip(scene), scene.stopper
    if lip is None:
        return np.array([scene.stopper_gap])

    def heights(points: Array) -> Array:
        return tilted(points, stopper.tilt, stopper.tilt_axis) - of_the_reed(scene, points, (0.0, 0.0))

    return _openings(scene.stopper_gap, lip, _lines_sought(scene), heights)


def gaps_of(scene: Scene, division: Division) -> Array:
    """Return the openings (parts,) of the undeformed bodies [m], arc by arc, the mean over each part of

        gap(th) = gap + h(th) - min h,   h = r(th) tan(tilt) sin(th - tilt_axis) + waviness(th) + w0(th)

    on its centre line, r from the lip's centre, with the height w0 of a reed that is not flat; ``gap`` is the smallest
    on the whole lip, rims included, into however many parts it is divided. Raises `SceneError` where that height is
    not known.
    """
    lip = scene.seat.lip(division.arcs, division.rings) if scene.contact.uneven or is_curved(scene.reed) else None
    if lip is None:
        return np.full(len(division.names), scene.contact.gap)
    angles = lip.turns(lip.places_in_arcs)
    return _openings(scene.contact.gap, lip, _lines_sought(scene), lambda points: _heights(scene, points, angles))


def _lines_sought(scene: Scene) -> int:
    return ACROSS if is_curved(scene.reed) else 2


def _openings(gap: float, lip: AnyLip, across: int, heights: Callable[[Array], Array]) -> Array:
    """Return the means (parts,) of the heights of (arcs, lines, n, 2) points along the parts' centre lines over the
    lowest of the lip, sought on so many lines, which is open by ``gap`` [m].

    Under a flat reed the height is linear along a cut, h(s) = h(0) + s (h(1) - h(0)): that of a tilted plane, and what
    waviness adds depends on the angle alone. Its least value is on a rim, so that two lines hold the lowest.
    """
    height = heights(np.concatenate([lip.lines_across(across), lip.lines()], axis=1))
    return np.asarray(gap + (height[:, across:] - height[:, :across].min()).mean(axis=-1)).ravel()


def films_of(scene: Scene, division: Division) -> tuple[SqueezeFilm | None, ...]:
    """Return the film under each part of the struck patch, arc by arc, whose rings bear equal shares of the arc's.

    Its floor is raised by half of what the lip rises within the arc, along and across it.
    """
    contact, arcs, rings = scene.contact, division.arcs, division.rings
    if contact.film is None:
        return (None,) * (arcs * rings)
    whole, lip = contact.film.on_ring(scene.seat.lip_face.ring), scene.seat.lip(arcs)
    shares, rises = np.full(arcs, 1 / arcs), np.zeros(arcs)
    if lip is not None:
        shares = lip.lengths / lip.lengths.sum()
    if lip is not None and (contact.uneven or is_curved(scene.reed)):
        rises = np.ptp(_heights(scene, lip.lines_across(2), lip.turns(lip.places_in_arcs)), axis=(1, 2))
    parts = (whole.part(float(share) / rings) for share in shares)
    films = (replace(part, floor=part.floor + float(rise) / 2) for part, rise in zip(parts, rises, strict=True))
    return tuple(film for film in films for _ in range(rings))


def _heights(scene: Scene, points: Array, angles: Array | None) -> Array:
    """Return the heights (arcs, lines, n) of the gap at points (arcs, lines, n, 2) from the lip's centre, at these
    angles (arcs, n) [m].

    Raises `SceneError` of a table by angles of a lip that has none."""
    contact = scene.contact
    height = tilted(points, contact.tilt, contact.tilt_axis)
    if contact.waviness:
        if angles is None:
            raise _problem("contact.waviness", NO_ANGLES)
        at, values = np.array(contact.waviness).T
        height = height + np.interp(angles, at, values, period=2 * np.pi)[:, None]
    return np.asarray(height + of_the_reed(scene, points, contact.offset))


def of_the_reed(scene: Scene, points: Array, offset: tuple[float, float]) -> Array:
    """Return the heights of the stress-free reed over a flat one, at points (..., 2) about what is off its contact by
    ``offset`` [m]. Raises `SceneError` where they are not known."""
    reed = scene.reed.thin_plate
    if reed is None or not is_curved(reed):
        return np.zeros(points.shape[:-1])
    try:
        return reed.heights((offset + points).reshape(-1, 2)).reshape(points.shape[:-1])
    except KeyProblem as problem:
        raise _problem(f"reed.{problem.key}", str(problem)) from None


def _problem(key: str, message: str) -> SceneError:
    return SceneError((Problem(None, 0, key, message, tuple(key.split("."))),))


def closed_line(lip: AnyLip) -> ClosedLine:
    """Return the centre line of a lip in its arcs."""
    return ClosedLine(lip.lengths, lip.edges, lip.line().mean(axis=1), lip.pieces)


def line_of(scene: Scene, problem: ContactProblem, parts: Array | None, film: Array | None = None) -> Line | None:
    """Return the contact along the lip of a problem, from the forces (n + 1, parts) of the seat's parts [N] and what of
    them a film bears; ``None`` where it has no arcs."""
    division = Division.from_greens(problem.target.greens)
    if parts is None or division.arcs == 1 or (lip := scene.seat.lip(division.arcs)) is None:
        return None
    force = parts.reshape(len(parts), division.arcs, division.rings).sum(axis=2)
    share = scene.contact.line_arc / (2 * math.pi)
    return Line(force, lip.lengths, share, lip.edges, film, lip.pieces)
