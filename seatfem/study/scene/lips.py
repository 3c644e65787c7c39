"""Geometry of a scene's contacts: positions on both bodies, division of a lip into arcs, and gaps."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from impact.after.histories import ClosedLine
from impact.after.result import NO_FILM
from impact.greens.base import Array
from impact.march.grid import TimeGrid
from impact.march.laws import SqueezeFilm
from seatfem.fields import KeyProblem
from seatfem.structures.errors import ModelError
from seatfem.structures.kinds.structure import PORTS_AND_LANDS, Finding, Structure, is_curved
from seatfem.structures.lands import FaceLip, Gate, under
from seatfem.structures.lip import AnyLip, tilted, turned_over
from seatfem.structures.outlines import covered_share
from seatfem.structures.rings import ACROSS, FEWEST_ARCS, MOST_CHOSEN, Division, arc_rings_to_compare
from seatfem.study.scene.contact import Contact, Stopper
from seatfem.study.scene.measures import Line
from seatfem.study.scene.problems import scene_error
from seatfem.study.scene.retainers import Retainer, distance_of_clamp, middles
from seatfem.study.scene.wings import PortLift
from seatfem.units import write_quantity

NO_ANGLES: Final = (
    "the struck lip is a strip, several faces, or winds about its centroid, so that an angle does not define a place "
    "on it; remove the key, or strike one ring that each ray from its centroid crosses once"
)
STOPPER: Final = "stopper_"  # prefix of the names of ports that meet a stopper
LINES: Final = 9  # number of lines from rim to rim on which the smallest gap is searched for a curved reed
USUAL: Final = 32  # default number of arcs of a lip
COVERED: Final = 0.999  # share of a lip, by sampled points, that counts as all of it


@dataclass(frozen=True)
class ContactGeometry:
    """Positions and gaps of the contacts between reed, seat and stopper, by their tables and bodies.

    Attributes:
        seat, reed: the struck body and the striker.
        contact: the table [contact].
        stopper: the table [stopper]; ``None`` without a stopper.
    """

    seat: Structure
    reed: Structure
    contact: Contact
    stopper: Stopper | None = None

    @property
    def own_place(self) -> float:
        """Return contact.at [m], by default the tip of a beam; 0 of a reed without positions, as a rod."""
        return self.reed.place(self.contact.at)

    @property
    def contact_at(self) -> float | tuple[float, ...] | None:
        """Return the position on the reed of the seat's contact [m], and those of the stopper if they differ."""
        at = self.contact.at
        if rolled := self._rolled():
            return (self.own_place, *rolled)
        if self.stopper is None or self.stopper.at is None:
            return at
        place = self.own_place
        return at if self.stopper.at == place else (place, self.stopper.at)

    @property
    def has_two_places(self) -> bool:
        """Return whether seat and stopper meet a beam or rod at different places, so that it has a port at each."""
        return isinstance(self.contact_at, tuple)

    @property
    def stopper_gap(self) -> float:
        """Return the distance from the undeformed reed to the stopper, its gap, or lift - contact.gap less the height
        of its profile at the contact [m]."""
        assert self.stopper is not None
        if self.stopper.lift is not None:
            return self.stopper.lift - self.contact.gap - self._height_at_contact()
        assert self.stopper.gap is not None
        return self.stopper.gap

    @property
    def stopper_gap_at_contact(self) -> float:
        """Return the distance from the undeformed reed to the stopper at the reed's contact [m]."""
        return self.stopper_gap + self._height_at_contact()

    @property
    def retainer(self) -> Retainer | None:
        """Return the stopper on whose profile the reed rolls; ``None`` of others."""
        if self.stopper is None or self.stopper.profile is None:
            return None
        return Retainer(self.stopper.profile, self.stopper.body)

    def _height_at_contact(self) -> float:
        """Return the height of the stopper's profile at the reed's contact [m]."""
        if (retainer := self.retainer) is None:
            return 0.0
        return float(retainer.heights(np.array([self._from_clamp()]))[0])

    def _from_clamp(self) -> float:
        """Return the distance of the reed's contact from its clamp [m]. Raises `KeyProblem` without a clamp."""
        return distance_of_clamp(self.reed.views_at(self.own_place, coarse=True))

    def _rolled(self) -> tuple[float, ...]:
        """Return the distances from the clamp of the segments of a profile on which a beam rolls [m]; none without
        one."""
        if self.retainer is None or (lip := self.stopper_lip()) is None:
            return ()
        if self.reed.meets(lip) is not None:  # a plate has ports of its own there
            return ()
        root = self._from_clamp()
        return tuple(root + middle for middle in middles(lip))

    @property
    def usual_ports(self) -> int:
        """Return the default number of arcs: `USUAL` if the gap varies along the lip or the lip is off the middle, or
        if a plate without a stated contact face meets the ring of a body of revolution; `FEWEST_ARCS` if it meets other
        rings or strips; else one."""
        uneven = self.contact.uneven_key or is_curved(self.reed) or any(self.contact.offset)
        if not (uneven or self._meets_a_lip):
            return 1
        arcs = USUAL if uneven or self.seat.lip_face.ring is not None else FEWEST_ARCS
        return min(arcs, MOST_CHOSEN // self.contact.rings)

    @property
    def _meets_a_lip(self) -> bool:
        """Return whether a plate without a stated contact face meets rings or strips that can be divided into arcs."""
        return not self.seat.lip_face.no_lip and (region := self.region()) is not None and not region.is_disc

    def region(self) -> AnyLip | None:
        """Return the struck face with which a plate without a stated contact face meets it all over, undivided;
        ``None`` of other reeds, and of seats without such a face. Raises `SceneError` of a face that is neither ring
        nor strip."""
        return self._face_met(self.seat, "seat.contact")

    def segments(self) -> AnyLip | None:
        """Return the struck face in segments and parts across, with which one contact of a plate is compared; ``None``
        of other reeds, of a face that is no ring or strip, as a disc, and of one that the reed does not cover."""
        try:
            region = self.reed.meets(self.overlap(self.seat))
        except ModelError:  # a face that the reed's stated contact meets in part
            return None
        if region is None or region.is_disc:
            return None
        face, over = self.seat.views(coarse=True), self.reed.views_at(self.own_place, coarse=True).turned_over()
        if not region.is_part and (covered_share(face, over, self.contact.offset) or 0.0) < COVERED:
            return None
        across = 1 if self.contact.film is not None else ACROSS[1]
        return replace(region, arcs=region.whole(FEWEST_ARCS), rings=across)  # type: ignore[type-var]

    def overlap(self, struck: Structure) -> AnyLip | None:
        """Return the struck face of seat or stopper, undivided: of flat faces what lies under a plate. Raises
        `ModelError` of a seat's face that is neither ring nor strip, as only a stopper's may be broad, and
        `UncoveredError` of too little under the plate."""
        if (retainer := self.retainer) is not None and struck is retainer.body:
            try:
                return retainer.face(self.reed.views_at(self.own_place, coarse=True))
            except KeyProblem as problem:
                raise scene_error(f"stopper.profile.{problem.key}".rstrip("."), str(problem)) from None
        region = struck.region()
        if struck is self.seat and isinstance(region, FaceLip):
            for strip in region.face.strips:
                strip.check_narrow()
        if not isinstance(met := self.reed.meets(region), FaceLip):
            return region
        loops, seals = self.reed.views_at(self.own_place, coarse=True).turned_over().plan, struck is self.seat
        seen = [loop - self.contact.offset if seals else turned_over(loop) for loop in loops]
        part = under(met.face, tuple(loop.tobytes() for loop in seen), seals=seals)
        return FaceLip(part, is_part=part != met.face)

    def struck(self, arcs: int = 1, rings: int = 1, body: Structure | None = None) -> AnyLip | None:
        """Return the `overlap`, by default the seat's, in parts; ``None`` if `lip_face` excludes that."""
        body = body or self.seat
        is_retainer = self.retainer is not None and body is self.retainer.body
        face = self.overlap(body) if is_retainer or not body.lip_face.no_lip else None
        return None if face is None else replace(face, arcs=arcs, rings=rings)  # type: ignore[type-var]

    def _face_met(self, struck: Structure, key: str) -> AnyLip | None:
        if self.reed.states_contact:
            return None
        try:
            return self.overlap(struck)
        except ModelError as error:
            as_a_whole = "state where the reed touches, reed.contact_radius, of a ring also contact_width"
            raise scene_error(key, f"{error} (as a whole: {as_a_whole})") from error

    def lip(self, ports: int | None = None, rings: int | None = None) -> AnyLip | None:
        """Return the seat's lip divided into arcs and rings, by default the stated or usual numbers.

        It is ``None`` if the contact face is no lip or not divided into arcs: where the reed is no plate or states its
        own contact, only ``contact.ports`` or an uneven gap divide it. Raises `ModelError` for a face from a file that
        is no lip.
        """
        arcs, rings = ports or self.contact.ports or self.usual_ports, rings or self.contact.rings
        if arcs == 1 and self.contact.ports is None and not self._meets_a_lip:
            return None
        lip = self.struck(arcs, rings)
        if arcs == 1:
            return self.reed.meets(lip)
        stated = ports or self.contact.ports
        if stated or lip is None or (whole := lip.whole(arcs)) == arcs:
            return lip
        return self.struck(whole, rings)

    def arcs_behind_rings(self, division: Division) -> int:
        """Return the number of arcs for runs that compare numbers of rings: half of those of the division, or fewer if
        there would be more than `MOST_CHOSEN` parts, at least `FEWEST_ARCS`."""
        arcs, most = division.arcs, max(division.rings, arc_rings_to_compare(division.rings)[0])
        while arcs % 2 == 0 and arcs // 2 >= FEWEST_ARCS and (arcs == division.arcs or arcs * most > MOST_CHOSEN):
            lip = self.struck(arcs // 2)
            if lip is None or lip.whole(arcs // 2) != arcs // 2:
                break
            arcs //= 2
        return arcs

    def cover_doubts(self) -> Iterator[Finding]:
        """Yield a key, and why it is doubtful, if too little of the faces of reed and seat lies on each other."""
        yield from self.reed.cover_doubts(self.seat, self.own_place, self.contact.offset, self.contact.ports or 1)

    def place_on_reed(self, lip: AnyLip | None) -> AnyLip | None:
        """Return the lip, where it is not divided the region, in the coordinates of a plate, with its offset, and in
        rings only where it is in arcs: those of one contact face a rigid face; ``None`` for a striker with a face of
        its own."""
        if (face := self.reed.meets(lip or self.region())) is None:
            return None
        rings = face.rings if face.arcs > 1 else 1
        return replace(face, rings=rings, offset=self.contact.offset)  # type: ignore[type-var]

    def stopper_lip(self) -> AnyLip | None:
        """Return the stopper's contact face divided into its parts; ``None`` if it is not divided, but all of it.

        It is the stopper's flat face, or that of the reed if the stopper has none. Raises `ModelError` for a face from
        a file that is no lip.
        """
        if self.stopper is None:
            return None
        body, parts = self.stopper.body, self.stopper.parts
        if parts == Division():
            return met if (met := self._face_met(body, "stopper.contact")) is not None and met.is_part else None
        if (lip := self.struck(parts.arcs, parts.rings, body)) is not None:
            return lip
        own = next(iter(self.reed.lips(None)), None)
        return None if own is None else replace(own, arcs=parts.arcs, rings=parts.rings)  # type: ignore[type-var]

    def with_stopper_in(self, division: Division | None) -> ContactGeometry:
        """Return the geometry with the stopper's face in other parts; ``None``: there is no stopper."""
        if self.stopper is None or division is None:
            return self
        return replace(self, stopper=self.stopper.divided(division))

    def place_behind_reed(self) -> AnyLip | None:
        """Return the stopper's lip, or what of its face a plate meets as a whole, in the reed's coordinates, with the
        prefix `STOPPER` in names of ports."""
        lip = self.stopper_lip()
        if lip is None and self.stopper is not None:
            lip = self._face_met(self.stopper.body, "stopper.contact")
        met = self.reed.meets(lip)
        return None if met is None else replace(met, side=STOPPER)  # type: ignore[type-var]

    def stopper_gaps(self) -> Array:
        """Return the gaps (parts,) between the undeformed reed and the stopper [m], as in `gaps`, with h by the tilt of
        the stopper, less the height of a reed that is not flat, and that of its profile added."""
        lip, stopper = self.stopper_lip(), self.stopper
        if lip is None or stopper is None:
            return np.array([self.stopper_gap])

        def heights(points: Array) -> Array:
            below = turned_over(points)
            return tilted(below, stopper.tilt, stopper.tilt_axis) - self._find_reed_heights(below, (0.0, 0.0))

        if (retainer := self.retainer) is None:
            return _openings(self.stopper_gap, lip, self._lines_sought, heights)
        risen = retainer.heights(self._from_clamp() + lip.lines()[..., 0])
        return np.asarray(self.stopper_gap + risen.mean(axis=-1).ravel())

    def gaps(self, division: Division) -> Array:
        """Return the gaps (parts,) of the undeformed bodies [m], arc by arc, the mean over each part of

            gap(th) = gap + h(th) - min h,   h = r(th) tan(tilt) sin(th - tilt_axis) + waviness(th) + w0(th)

        on its centre line, r from the lip's centre, with the height w0 of a reed that is not flat; ``gap`` is the
        smallest on the whole lip, rims included, for any number of parts. Raises `SceneError` if w0 is not known.
        """
        lip = self.struck(division.arcs, division.rings) if self._is_uneven else None
        if lip is None:
            return np.full(len(division.names), self.contact.gap)
        angles = lip.turns(lip.places_in_arcs)
        return _openings(self.contact.gap, lip, self._lines_sought, lambda points: self._heights(points, angles))

    def films(self, division: Division) -> tuple[SqueezeFilm | None, ...]:
        """Return the film under each part of the contact face, arc by arc; the rings of an arc have equal films.

        Its floor is raised by half the height difference of the gap within the arc.
        """
        film, arcs, rings = self.contact.film, division.arcs, division.rings
        if film is None:
            return (None,) * (arcs * rings)
        whole, lip = film.build_film(self.seat.lip_face.ring), self.struck(arcs)
        shares, rises = np.full(arcs, 1 / arcs), np.zeros(arcs)
        if lip is not None:
            shares = lip.lengths / lip.lengths.sum()
        if lip is not None and self._is_uneven:
            rises = np.ptp(self._heights(lip.lines_across(2), lip.turns(lip.places_in_arcs)), axis=(1, 2))
        parts = (whole.part(float(share) / rings) for share in shares)
        films = (replace(part, floor=part.floor + float(rise) / 2) for part, rise in zip(parts, rises, strict=True))
        return tuple(film for film in films for _ in range(rings))

    def line(self, division: Division, parts: Array, grid: TimeGrid, film: Array = NO_FILM) -> Line | None:
        """Return the contact along the lip from the forces (N + 1, parts) on the seat's parts in the steps of ``grid``
        [N], and their part by a film (N + 1, parts); ``None`` for a lip without arcs."""
        if division.arcs == 1 or (lip := self.struck(division.arcs)) is None:
            return None
        every, share = np.broadcast_to(film, parts.shape), self.contact.line_arc / (2 * math.pi)
        force, by_film = (
            each.reshape(len(parts), division.arcs, division.rings).sum(axis=2) for each in (parts, every)
        )
        places = lip.line().mean(axis=1) if len(lip.pieces) > 1 else np.zeros((0, 2))
        return Line(force, grid, lip.lengths, share, lip.edges, by_film, lip.pieces, lip.names, places)

    def lands(self, division: Division) -> tuple[slice, ...]:
        """Return the parts of each land of the seat, in the order of the parts; none of a seat with a single one."""
        if division.arcs == 1 or (lip := self.struck(division.arcs)) is None or len(lip.pieces) < 2:
            return ()
        ends = (division.rings * np.cumsum([0, *(arcs for arcs, _ in lip.pieces)])).tolist()
        return tuple(slice(*pair) for pair in itertools.pairwise(ends))

    def _lands_met(self) -> FaceLip | None:
        """Return the struck face of several lands that a plate meets all over, undivided; ``None`` of others."""
        region = self.region()
        return region if isinstance(region, FaceLip) and len(region.face.gates) > 1 else None

    def port_points(self) -> tuple[Array, ...]:
        """Return (n, 2) points all over each port of a seat of several lands, from the centre of the reed's contact
        [m]; none of a seat with a single land."""
        return tuple(gate.points() + self.contact.offset for gate in self._ports_met())

    def port_areas(self) -> tuple[float, ...]:
        """Return the area of each of these ports [m^2]."""
        return tuple(gate.area / gate.share for gate in self._ports_met())

    def _ports_met(self) -> tuple[Gate, ...]:
        """Return one way of gas over the lands of each port."""
        if (met := self._lands_met()) is None:
            return ()
        return met.face.gates[:: round(1 / met.face.gates[0].share)]

    def lifts(self, division: Division, gap: Array, grid: TimeGrid) -> tuple[PortLift, ...]:
        """Return the lift over each land of a seat of several from the gaps (N + 1, parts) on the seat's parts [m], the
        mean of all parts where they are not divided by lands; none of a seat with a single land."""
        if (met := self._lands_met()) is None:
            return ()
        gates, lands = met.face.gates, self.lands(division)
        parts = lands if len(lands) == len(gates) else (slice(None),) * len(gates)
        return tuple(
            PortLift(name, grid.spread_motions(gap[:, part].mean(axis=1)), gate.rim, gate.area, gate.share)
            for name, part, gate in zip(met.face.names, parts, gates, strict=True)
        )

    @property
    def _is_uneven(self) -> bool:
        return bool(self.contact.uneven_key) or is_curved(self.reed)

    @property
    def _lines_sought(self) -> int:
        return LINES if is_curved(self.reed) else 2

    def _heights(self, points: Array, angles: Array) -> Array:
        """Return the heights (arcs, lines, n) of the gap [m] at points (arcs, lines, n, 2) from the centre of the lip,
        at these angles (arcs, n).

        Raises `SceneError` for waviness on a lip without angles."""
        contact = self.contact
        height = tilted(points, contact.tilt, contact.tilt_axis)
        if contact.waviness:
            if not len(angles):
                raise scene_error("contact.waviness", NO_ANGLES)
            at, values = np.array(contact.waviness).T
            height = height + np.interp(angles, at, values, period=2 * np.pi)[:, None]
        return np.asarray(height + self._find_reed_heights(points, contact.offset))

    def _find_reed_heights(self, points: Array, offset: tuple[float, float]) -> Array:
        """Return the heights of the stress-free reed over a flat one at points (..., 2), relative to a place off its
        contact by ``offset`` [m]. Raises `SceneError` if they are not known."""
        try:
            return self.reed.heights((offset + points).reshape(-1, 2)).reshape(points.shape[:-1])
        except KeyProblem as problem:
            raise scene_error(f"reed.{problem.key}", str(problem)) from None


def or_diameter(geometry: ContactGeometry, find: Callable[[ContactGeometry], Iterable[Finding]]) -> tuple[Finding, ...]:
    """Return what ``find`` has to say of contacts, and a question if it has nothing to say of half the radius of the
    seat's port: a diameter may be written in its place."""
    findings = tuple(find(geometry))
    port = next((port for port, _ in PORTS_AND_LANDS if port in type(geometry.seat).model_fields), "")
    if not findings or not port:
        return findings
    radius = float(getattr(geometry.seat, port))
    if tuple(find(replace(geometry, seat=geometry.seat.model_copy(update={port: radius / 2})))):
        return findings
    whole, half = (write_quantity(each, "length") for each in (radius, radius / 2))
    return (*findings, (("seat", port), f"{whole} is a radius; if you mean the diameter, write {half!r}"))


def _openings(gap: float, lip: AnyLip, across: int, heights: Callable[[Array], Array]) -> Array:
    """Return the (parts,) mean gaps [m] along the parts' centre lines, so that the smallest gap of the lip on
    ``across`` lines is ``gap``; ``heights``: function of (arcs, lines, n, 2) points.

    Under a flat reed the height is linear across the lip, as waviness depends on the angle only, so that the smallest
    gap lies on a rim: two lines are enough.
    """
    height = heights(np.concatenate([lip.lines_across(across), lip.lines()], axis=1))
    return np.asarray(gap + (height[:, across:] - height[:, :across].min()).mean(axis=-1)).ravel()


def closed_line(lip: AnyLip) -> ClosedLine:
    """Return the centre line of a lip, divided into its arcs."""
    return ClosedLine(lip.lengths, lip.edges, lip.line().mean(axis=1), lip.pieces, lip.names)
